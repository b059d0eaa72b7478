// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The wrapper's intrinsics for AArch64. Only simd.h includes this file; it defines each operation.
#pragma once

#include <arm_neon.h>

namespace overtake::simd {

template <>
struct Native<xsimd::neon64> {
  using A = xsimd::neon64;
  using F = xsimd::batch<float, A>;
  using I = xsimd::batch<int32_t, A>;
  using M = xsimd::batch_bool<float, A>;
  OVT_INLINE static uint32x4_t lanes() {
    const uint32_t bit[4] = {1, 2, 4, 8};
    return vld1q_u32(bit);
  }
  OVT_INLINE static I iota() {
    const int32_t i[4] = {0, 1, 2, 3};
    return I(vld1q_s32(i));
  }
  OVT_INLINE static M mask_of_bits(uint32_t bits) { return M(vtstq_u32(vdupq_n_u32(bits), lanes())); }
  OVT_INLINE static uint32_t bits_of_mask(M m) { return vaddvq_u32(vandq_u32(m, lanes())); }
  // xsimd's division is an approximation that is refined in steps.
  OVT_INLINE static F divide(F a, F b) { return F(vdivq_f32(a, b)); }
  OVT_INLINE static F sqrt(F a) { return F(vsqrtq_f32(a)); }
  // vminq and vmaxq handle NaN and -0 differently.
  OVT_INLINE static F min(F a, F b) { return F(vbslq_f32(vcltq_f32(a, b), a, b)); }
  OVT_INLINE static F max(F a, F b) { return F(vbslq_f32(vcgtq_f32(a, b), a, b)); }
  OVT_INLINE static F keep(M m, F a) { return F(vreinterpretq_f32_u32(vandq_u32(m, vreinterpretq_u32_f32(a)))); }
  OVT_INLINE static F add_where(M m, F a, F b) { return F(vaddq_f32(a, keep(m, b))); }
  OVT_INLINE static I select(M m, I yes, I no) { return I(vbslq_s32(m, yes, no)); }
  OVT_INLINE static I permute(I table, I index) {
    int32_t t[4];
    table.store_unaligned(t);
    return gather(t, index);
  }
  OVT_INLINE static I count_starts(uint32_t bits) {
    const int32_t b1 = int32_t(bits >> 1) & 1, b2 = int32_t(bits >> 2) & 1, b3 = int32_t(bits >> 3) & 1;
    const int32_t count[4] = {0, b1, b1 + b2, b1 + b2 + b3};
    return I(vld1q_s32(count));
  }
  OVT_INLINE static M equal(I a, I b) { return M(vceqq_s32(a, b)); }
  OVT_INLINE static M greater(I a, I b) { return M(vcgtq_s32(a, b)); }
  OVT_INLINE static I to_int(F a) { return I(vcvtq_s32_f32(a)); }
  OVT_INLINE static F to_float(I a) { return F(vcvtq_f32_s32(a)); }
  OVT_INLINE static I bits_of(F a) { return I(vreinterpretq_s32_f32(a)); }
  OVT_INLINE static F float_of_bits(I a) { return F(vreinterpretq_f32_s32(a)); }
  OVT_INLINE static F gather(const float* base, I index) {
    int32_t i[4];
    index.store_unaligned(i);
    const float value[4] = {base[i[0]], base[i[1]], base[i[2]], base[i[3]]};
    return F::load_unaligned(value);
  }
  OVT_INLINE static I gather(const int32_t* base, I index) {
    int32_t i[4];
    index.store_unaligned(i);
    const int32_t value[4] = {base[i[0]], base[i[1]], base[i[2]], base[i[3]]};
    return I::load_unaligned(value);
  }
  OVT_INLINE static void store_where(M m, F a, float* at) { vst1q_f32(at, vbslq_f32(m, a, vld1q_f32(at))); }
  OVT_INLINE static void store_where(M m, I a, int32_t* at) { vst1q_s32(at, vbslq_s32(m, a, vld1q_s32(at))); }
  OVT_INLINE static void store_packed(M m, I a, int32_t* at) {
    int32_t v[4];
    a.store_unaligned(v);
    const uint32_t bits = bits_of_mask(m), b0 = bits & 1, b1 = bits >> 1 & 1, b2 = bits >> 2 & 1;
    at[0] = v[0];  // the next lane overwrites an unselected one
    at[b0] = v[1];
    at[b0 + b1] = v[2];
    at[b0 + b1 + b2] = v[3];
  }
  OVT_INLINE static void store_bytes(I a, uint8_t* at) {
    const uint16x4_t words = vmovn_u32(vreinterpretq_u32_s32(a));
    const uint8x8_t bytes = vmovn_u16(vcombine_u16(words, words));
    const uint32_t four = vget_lane_u32(vreinterpret_u32_u8(bytes), 0);
    __builtin_memcpy(at, &four, 4);
  }
  OVT_INLINE static I load_bytes(const uint8_t* at) {
    uint32_t four;
    __builtin_memcpy(&four, at, 4);
    const uint16x8_t words = vmovl_u8(vreinterpret_u8_u32(vdup_n_u32(four)));
    return I(vreinterpretq_s32_u32(vmovl_u16(vget_low_u16(words))));
  }
  OVT_INLINE static I load_words(const uint16_t* at) { return I(vreinterpretq_s32_u32(vmovl_u16(vld1_u16(at)))); }
  OVT_INLINE static void load_records(const char* at, std::ptrdiff_t stride, I& c0, I& c1, I& c2, I& c3) {
    int32_t r[4][4];
    for (int32_t i = 0; i < 4; ++i) __builtin_memcpy(r[i], at + i * stride, 16);
    const int32x4x4_t c = vld4q_s32(r[0]);
    c0 = I(c.val[0]), c1 = I(c.val[1]), c2 = I(c.val[2]), c3 = I(c.val[3]);
  }
  OVT_INLINE static int32x2_t scale_half(float64x2_t v, double unit) {
    const float64x2_t huge = vdupq_n_f64(1e200), limit = vdupq_n_f64(2147483647.0);
    v = vmaxq_f64(vminq_f64(v, huge), vnegq_f64(huge));
    v = vmulq_f64(v, vdupq_n_f64(unit));
    v = vmaxq_f64(vminq_f64(v, limit), vnegq_f64(limit));
    const float64x2_t half = vbslq_f64(vcltq_f64(v, vdupq_n_f64(0.0)), vdupq_n_f64(-0.5), vdupq_n_f64(0.5));
    return vmovn_s64(vcvtq_s64_f64(vaddq_f64(v, half)));
  }
  OVT_INLINE static I scale_to_int(F a, double unit) {
    return I(vcombine_s32(scale_half(vcvt_f64_f32(vget_low_f32(a)), unit), scale_half(vcvt_high_f64_f32(a), unit)));
  }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    if constexpr (kApart == 2) return F(vextq_f32(a, a, 2));
    return F(vrev64q_f32(a));
  }
};

}  // namespace overtake::simd
