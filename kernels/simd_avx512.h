// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The wrapper's intrinsics for AVX-512 (F, BW, DQ, VL). Only simd.h includes this file; it defines each operation.
#pragma once

#include <immintrin.h>

namespace overtake::simd {

template <>
struct Native<xsimd::avx512bw> {
  using A = xsimd::avx512bw;
  using F = xsimd::batch<float, A>;
  using I = xsimd::batch<int32_t, A>;
  using M = xsimd::batch_bool<float, A>;
  OVT_INLINE static __mmask16 k(M m) { return __mmask16(typename M::register_type(m)); }
  OVT_INLINE static I iota() { return I(_mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)); }
  OVT_INLINE static M mask_of_bits(uint32_t bits) { return M(__mmask16(bits)); }
  OVT_INLINE static uint32_t bits_of_mask(M m) { return k(m); }
  OVT_INLINE static F divide(F a, F b) { return F(_mm512_div_ps(a, b)); }
  OVT_INLINE static F min(F a, F b) { return F(_mm512_min_ps(a, b)); }
  OVT_INLINE static F max(F a, F b) { return F(_mm512_max_ps(a, b)); }
  OVT_INLINE static F sqrt(F a) { return F(_mm512_sqrt_ps(a)); }
  OVT_INLINE static F keep(M m, F a) { return F(_mm512_maskz_mov_ps(k(m), a)); }
  OVT_INLINE static F add_where(M m, F a, F b) { return F(_mm512_mask_add_ps(a, k(m), a, b)); }
  OVT_INLINE static I permute(I table, I index) { return I(_mm512_permutexvar_epi32(index, table)); }
  OVT_INLINE static I permute2(I t0, I t1, I index) { return I(_mm512_permutex2var_epi32(t0, index, t1)); }
  OVT_INLINE static I permute4(I t0, I t1, I t2, I t3, I index) {
    const __mmask16 high = _mm512_test_epi32_mask(index, _mm512_set1_epi32(32));
    return I(_mm512_mask_blend_epi32(high, _mm512_permutex2var_epi32(t0, index, t1),
                                     _mm512_permutex2var_epi32(t2, index, t3)));
  }
  // One bit per byte, times 0x0101...: each byte becomes the sum of itself and all lower bytes.
  OVT_INLINE static I count_starts(uint32_t bits) {
    constexpr uint64_t kOnes = 0x0101010101010101u;
    const uint64_t low = _pdep_u64(bits & 0xfeu, kOnes) * kOnes;
    const uint64_t high = (_pdep_u64((bits >> 8) & 0xffu, kOnes) + (low >> 56)) * kOnes;
    return I(_mm512_cvtepu8_epi32(_mm_set_epi64x(int64_t(high), int64_t(low))));
  }
  OVT_INLINE static I select(M m, I yes, I no) { return I(_mm512_mask_blend_epi32(k(m), no, yes)); }
  OVT_INLINE static M equal(I a, I b) { return M(_mm512_cmpeq_epi32_mask(a, b)); }
  OVT_INLINE static M greater(I a, I b) { return M(_mm512_cmpgt_epi32_mask(a, b)); }
  OVT_INLINE static I to_int(F a) { return I(_mm512_cvttps_epi32(a)); }
  OVT_INLINE static F to_float(I a) { return F(_mm512_cvtepi32_ps(a)); }
  OVT_INLINE static I bits_of(F a) { return I(_mm512_castps_si512(a)); }
  OVT_INLINE static F float_of_bits(I a) { return F(_mm512_castsi512_ps(a)); }
  OVT_INLINE static F gather(const float* base, I index) { return F(_mm512_i32gather_ps(index, base, 4)); }
  OVT_INLINE static I gather(const int32_t* base, I index) { return I(_mm512_i32gather_epi32(index, base, 4)); }
  OVT_INLINE static void store_where(M m, F a, float* at) { _mm512_mask_storeu_ps(at, k(m), a); }
  OVT_INLINE static void store_where(M m, I a, int32_t* at) { _mm512_mask_storeu_epi32(at, k(m), a); }
  OVT_INLINE static void store_packed(M m, I a, int32_t* at) {
    _mm512_storeu_si512(at, _mm512_maskz_compress_epi32(k(m), a));
  }
  OVT_INLINE static void store_bytes(I a, uint8_t* at) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(at), _mm512_cvtepi32_epi8(a));
  }
  OVT_INLINE static I load_bytes(const uint8_t* at) {
    return I(_mm512_cvtepu8_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at))));
  }
  OVT_INLINE static I load_words(const uint16_t* at) {
    return I(_mm512_cvtepu16_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(at))));
  }
  OVT_INLINE static void load_records(const char* at, std::ptrdiff_t stride, I& c0, I& c1, I& c2, I& c3) {
    const auto record = [=](int32_t i) OVT_INLINED {  // records i, i + 4, i + 8 and i + 12
      const auto part = [=](int32_t j)
                            OVT_INLINED { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at + j * stride)); };
      __m512i r = _mm512_castsi128_si512(part(i));
      r = _mm512_inserti32x4(r, part(i + 4), 1);
      r = _mm512_inserti32x4(r, part(i + 8), 2);
      return _mm512_inserti32x4(r, part(i + 12), 3);
    };
    const __m512i r0 = record(0), r1 = record(1), r2 = record(2), r3 = record(3);
    const __m512i a = _mm512_unpacklo_epi32(r0, r1), b = _mm512_unpacklo_epi32(r2, r3);
    const __m512i c = _mm512_unpackhi_epi32(r0, r1), d = _mm512_unpackhi_epi32(r2, r3);
    c0 = I(_mm512_unpacklo_epi64(a, b)), c1 = I(_mm512_unpackhi_epi64(a, b));
    c2 = I(_mm512_unpacklo_epi64(c, d)), c3 = I(_mm512_unpackhi_epi64(c, d));
  }
  OVT_INLINE static __m256i scale_half(__m512d v, double unit) {
    const __m512d huge = _mm512_set1_pd(1e200), limit = _mm512_set1_pd(2147483647.0), sign = _mm512_set1_pd(-0.0);
    v = _mm512_max_pd(_mm512_min_pd(v, huge), _mm512_xor_pd(huge, sign));
    v = _mm512_mul_pd(v, _mm512_set1_pd(unit));
    v = _mm512_max_pd(_mm512_min_pd(v, limit), _mm512_xor_pd(limit, sign));
    return _mm512_cvttpd_epi32(_mm512_add_pd(v, _mm512_or_pd(_mm512_and_pd(v, sign), _mm512_set1_pd(0.5))));
  }
  OVT_INLINE static I scale_to_int(F a, double unit) {
    const __m256 low = _mm512_castps512_ps256(a), high = _mm512_extractf32x8_ps(a, 1);
    return I(_mm512_inserti64x4(_mm512_castsi256_si512(scale_half(_mm512_cvtps_pd(low), unit)),
                                scale_half(_mm512_cvtps_pd(high), unit), 1));
  }
  // Adds lanes 8, 4, 2 and 1 apart.
  OVT_INLINE static void fold_four(F a, F b, F c, F d, float* out) {
    const auto two = [](__m512 v, __m512 w) OVT_INLINED {
      return _mm512_add_ps(_mm512_shuffle_f32x4(v, w, _MM_SHUFFLE(1, 0, 1, 0)),
                           _mm512_shuffle_f32x4(v, w, _MM_SHUFFLE(3, 2, 3, 2)));
    };
    const __m512 ab = two(a, b), cd = two(c, d);
    const __m512 all = _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, _MM_SHUFFLE(2, 0, 2, 0)),
                                     _mm512_shuffle_f32x4(ab, cd, _MM_SHUFFLE(3, 1, 3, 1)));
    const __m512 twos = _mm512_add_ps(all, _mm512_permute_ps(all, _MM_SHUFFLE(1, 0, 3, 2)));
    const __m512 ones = _mm512_add_ps(twos, _mm512_permute_ps(twos, _MM_SHUFFLE(2, 3, 0, 1)));
    _mm_storeu_ps(out, _mm512_castps512_ps128(_mm512_maskz_compress_ps(0x1111, ones)));  // one lane of each quarter
  }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    if constexpr (kApart == 8) return F(_mm512_shuffle_f32x4(a, a, _MM_SHUFFLE(1, 0, 3, 2)));
    if constexpr (kApart == 4) return F(_mm512_shuffle_f32x4(a, a, _MM_SHUFFLE(2, 3, 0, 1)));
    return F(_mm512_permute_ps(a, kApart == 2 ? _MM_SHUFFLE(1, 0, 3, 2) : _MM_SHUFFLE(2, 3, 0, 1)));
  }
};

}  // namespace overtake::simd
