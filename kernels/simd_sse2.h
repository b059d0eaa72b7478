// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The wrapper's intrinsics for SSE2. Only simd.h includes this file; it defines each operation.
#pragma once

#include <immintrin.h>

namespace overtake::simd {

template <>
struct Native<xsimd::sse2> {
  using A = xsimd::sse2;
  using F = xsimd::batch<float, A>;
  using I = xsimd::batch<int32_t, A>;
  using M = xsimd::batch_bool<float, A>;
  OVT_INLINE static I iota() { return I(_mm_setr_epi32(0, 1, 2, 3)); }
  OVT_INLINE static M mask_of_bits(uint32_t bits) {
    const __m128i lane = _mm_setr_epi32(1, 2, 4, 8);
    return M(_mm_castsi128_ps(_mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(int32_t(bits)), lane), lane)));
  }
  OVT_INLINE static uint32_t bits_of_mask(M m) { return uint32_t(_mm_movemask_ps(m)); }
  OVT_INLINE static F divide(F a, F b) { return F(_mm_div_ps(a, b)); }
  OVT_INLINE static F min(F a, F b) { return F(_mm_min_ps(a, b)); }
  OVT_INLINE static F max(F a, F b) { return F(_mm_max_ps(a, b)); }
  OVT_INLINE static F sqrt(F a) { return F(_mm_sqrt_ps(a)); }
  OVT_INLINE static F keep(M m, F a) { return F(_mm_and_ps(m, a)); }
  OVT_INLINE static F add_where(M m, F a, F b) { return F(_mm_add_ps(a, _mm_and_ps(m, b))); }
  OVT_INLINE static I permute(I table, I index) {
    alignas(16) int32_t t[4];
    table.store_aligned(t);
    return gather(t, index);
  }
  OVT_INLINE static I count_starts(uint32_t bits) {
    const int32_t b1 = int32_t(bits >> 1) & 1, b2 = int32_t(bits >> 2) & 1, b3 = int32_t(bits >> 3) & 1;
    return I(_mm_setr_epi32(0, b1, b1 + b2, b1 + b2 + b3));
  }
  OVT_INLINE static I select(M m, I yes, I no) {
    const __m128i k = _mm_castps_si128(m);
    return I(_mm_or_si128(_mm_and_si128(k, yes), _mm_andnot_si128(k, no)));
  }
  OVT_INLINE static M equal(I a, I b) { return M(_mm_castsi128_ps(_mm_cmpeq_epi32(a, b))); }
  OVT_INLINE static M greater(I a, I b) { return M(_mm_castsi128_ps(_mm_cmpgt_epi32(a, b))); }
  OVT_INLINE static I to_int(F a) { return I(_mm_cvttps_epi32(a)); }
  OVT_INLINE static F to_float(I a) { return F(_mm_cvtepi32_ps(a)); }
  OVT_INLINE static I bits_of(F a) { return I(_mm_castps_si128(a)); }
  OVT_INLINE static F float_of_bits(I a) { return F(_mm_castsi128_ps(a)); }
  OVT_INLINE static F gather(const float* base, I index) {
    alignas(16) int32_t i[4];
    index.store_aligned(i);
    return F(_mm_setr_ps(base[i[0]], base[i[1]], base[i[2]], base[i[3]]));
  }
  OVT_INLINE static I gather(const int32_t* base, I index) {
    alignas(16) int32_t i[4];
    index.store_aligned(i);
    return I(_mm_setr_epi32(base[i[0]], base[i[1]], base[i[2]], base[i[3]]));
  }
  OVT_INLINE static void store_where(M m, F a, float* at) {
    _mm_storeu_ps(at, _mm_or_ps(_mm_and_ps(m, a), _mm_andnot_ps(m, _mm_loadu_ps(at))));
  }
  OVT_INLINE static void store_where(M m, I a, int32_t* at) { select(m, a, I::load_unaligned(at)).store_unaligned(at); }
  OVT_INLINE static void store_packed(M m, I a, int32_t* at) {
    alignas(16) int32_t v[4];
    a.store_aligned(v);
    const uint32_t bits = bits_of_mask(m), b0 = bits & 1, b1 = bits >> 1 & 1, b2 = bits >> 2 & 1;
    at[0] = v[0];  // the next lane overwrites an unselected one
    at[b0] = v[1];
    at[b0 + b1] = v[2];
    at[b0 + b1 + b2] = v[3];
  }
  OVT_INLINE static void store_bytes(I a, uint8_t* at) {
    const __m128i low = _mm_and_si128(a, _mm_set1_epi32(0xff));
    const __m128i words = _mm_packs_epi32(low, low);
    const int32_t bytes = _mm_cvtsi128_si32(_mm_packus_epi16(words, words));
    __builtin_memcpy(at, &bytes, 4);
  }
  OVT_INLINE static I load_bytes(const uint8_t* at) {
    int32_t bytes;
    __builtin_memcpy(&bytes, at, 4);
    const __m128i zero = _mm_setzero_si128();
    return I(_mm_unpacklo_epi16(_mm_unpacklo_epi8(_mm_cvtsi32_si128(bytes), zero), zero));
  }
  OVT_INLINE static I load_words(const uint16_t* at) {
    return I(_mm_unpacklo_epi16(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at)), _mm_setzero_si128()));
  }
  OVT_INLINE static void load_records(const char* at, std::ptrdiff_t stride, I& c0, I& c1, I& c2, I& c3) {
    const auto record = [=](int32_t i)
                            OVT_INLINED { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at + i * stride)); };
    const __m128i r0 = record(0), r1 = record(1), r2 = record(2), r3 = record(3);
    const __m128i a = _mm_unpacklo_epi32(r0, r1), b = _mm_unpacklo_epi32(r2, r3);
    const __m128i c = _mm_unpackhi_epi32(r0, r1), d = _mm_unpackhi_epi32(r2, r3);
    c0 = I(_mm_unpacklo_epi64(a, b)), c1 = I(_mm_unpackhi_epi64(a, b));
    c2 = I(_mm_unpacklo_epi64(c, d)), c3 = I(_mm_unpackhi_epi64(c, d));
  }
  OVT_INLINE static __m128i scale_half(__m128d v, double unit) {
    const __m128d huge = _mm_set1_pd(1e200), limit = _mm_set1_pd(2147483647.0), sign = _mm_set1_pd(-0.0);
    v = _mm_max_pd(_mm_min_pd(v, huge), _mm_xor_pd(huge, sign));
    v = _mm_mul_pd(v, _mm_set1_pd(unit));
    v = _mm_max_pd(_mm_min_pd(v, limit), _mm_xor_pd(limit, sign));
    return _mm_cvttpd_epi32(_mm_add_pd(v, _mm_or_pd(_mm_and_pd(v, sign), _mm_set1_pd(0.5))));
  }
  OVT_INLINE static I scale_to_int(F a, double unit) {
    return I(
        _mm_unpacklo_epi64(scale_half(_mm_cvtps_pd(a), unit), scale_half(_mm_cvtps_pd(_mm_movehl_ps(a, a)), unit)));
  }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    return F(_mm_shuffle_ps(a, a, kApart == 2 ? _MM_SHUFFLE(1, 0, 3, 2) : _MM_SHUFFLE(2, 3, 0, 1)));
  }
};

}  // namespace overtake::simd
