// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The wrapper's intrinsics for AVX2. Only simd.h includes this file; it defines each operation.
#pragma once

#include <immintrin.h>

namespace overtake::simd {

// The selected lanes of each mask, a byte each, packed.
struct PackedLanes {
  uint64_t of[256];
};
constexpr PackedLanes kPackedLanes = [] {
  PackedLanes lanes{};
  for (uint32_t mask = 0; mask < 256; ++mask)
    for (uint32_t lane = 8; lane-- > 0;)
      if (mask >> lane & 1) lanes.of[mask] = lanes.of[mask] << 8 | lane;
  return lanes;
}();

template <>
struct Native<xsimd::avx2> {
  using A = xsimd::avx2;
  using F = xsimd::batch<float, A>;
  using I = xsimd::batch<int32_t, A>;
  using M = xsimd::batch_bool<float, A>;
  OVT_INLINE static I iota() { return I(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)); }
  OVT_INLINE static M mask_of_bits(uint32_t bits) {
    const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return M(_mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(int32_t(bits)), lane), lane)));
  }
  OVT_INLINE static uint32_t bits_of_mask(M m) { return uint32_t(_mm256_movemask_ps(m)); }
  OVT_INLINE static F divide(F a, F b) { return F(_mm256_div_ps(a, b)); }
  OVT_INLINE static F min(F a, F b) { return F(_mm256_min_ps(a, b)); }
  OVT_INLINE static F max(F a, F b) { return F(_mm256_max_ps(a, b)); }
  OVT_INLINE static F sqrt(F a) { return F(_mm256_sqrt_ps(a)); }
  OVT_INLINE static F keep(M m, F a) { return F(_mm256_and_ps(m, a)); }
  OVT_INLINE static F add_where(M m, F a, F b) { return F(_mm256_add_ps(a, _mm256_and_ps(m, b))); }
  OVT_INLINE static I permute(I table, I index) { return I(_mm256_permutevar8x32_epi32(table, index)); }
  OVT_INLINE static I permute2(I t0, I t1, I index) {
    const __m256 bit3 = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
    const auto pick = [=](I t) OVT_INLINED { return _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(t, index)); };
    return I(_mm256_castps_si256(_mm256_blendv_ps(pick(t0), pick(t1), bit3)));
  }
  OVT_INLINE static I permute4(I t0, I t1, I t2, I t3, I index) {
    const __m256 bit3 = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
    const __m256 bit4 = _mm256_castsi256_ps(_mm256_slli_epi32(index, 27));
    const auto pick = [=](I t) OVT_INLINED { return _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(t, index)); };
    const __m256 low = _mm256_blendv_ps(pick(t0), pick(t1), bit3), high = _mm256_blendv_ps(pick(t2), pick(t3), bit3);
    return I(_mm256_castps_si256(_mm256_blendv_ps(low, high, bit4)));
  }
  // One bit per byte, times 0x0101...: each byte becomes the sum of itself and all lower bytes.
  OVT_INLINE static I count_starts(uint32_t bits) {
    const uint64_t bytes = _pdep_u64(bits & 0xfeu, 0x0101010101010101u) * 0x0101010101010101u;
    return I(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(int64_t(bytes))));
  }
  OVT_INLINE static I select(M m, I yes, I no) { return I(_mm256_blendv_epi8(no, yes, _mm256_castps_si256(m))); }
  OVT_INLINE static M equal(I a, I b) { return M(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b))); }
  OVT_INLINE static M greater(I a, I b) { return M(_mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b))); }
  OVT_INLINE static I to_int(F a) { return I(_mm256_cvttps_epi32(a)); }
  OVT_INLINE static F to_float(I a) { return F(_mm256_cvtepi32_ps(a)); }
  OVT_INLINE static I bits_of(F a) { return I(_mm256_castps_si256(a)); }
  OVT_INLINE static F float_of_bits(I a) { return F(_mm256_castsi256_ps(a)); }
  OVT_INLINE static F gather(const float* base, I index) { return F(_mm256_i32gather_ps(base, index, 4)); }
  OVT_INLINE static I gather(const int32_t* base, I index) { return I(_mm256_i32gather_epi32(base, index, 4)); }
  OVT_INLINE static void store_where(M m, F a, float* at) { _mm256_maskstore_ps(at, _mm256_castps_si256(m), a); }
  OVT_INLINE static void store_where(M m, I a, int32_t* at) { _mm256_maskstore_epi32(at, _mm256_castps_si256(m), a); }
  OVT_INLINE static void store_packed(M m, I a, int32_t* at) {
    const auto* lanes = reinterpret_cast<const __m128i*>(kPackedLanes.of + bits_of_mask(m));
    permute(a, I(_mm256_cvtepu8_epi32(_mm_loadl_epi64(lanes)))).store_unaligned(at);
  }
  OVT_INLINE static void store_bytes(I a, uint8_t* at) {
    const __m256i low = _mm256_and_si256(a, _mm256_set1_epi32(0xff));
    const __m128i words = _mm_packs_epi32(_mm256_castsi256_si128(low), _mm256_extracti128_si256(low, 1));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(at), _mm_packus_epi16(words, words));
  }
  OVT_INLINE static I load_bytes(const uint8_t* at) {
    return I(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at))));
  }
  OVT_INLINE static I load_words(const uint16_t* at) {
    return I(_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at))));
  }
  OVT_INLINE static void load_records(const char* at, std::ptrdiff_t stride, I& c0, I& c1, I& c2, I& c3) {
    const auto record = [=](int32_t i) OVT_INLINED {  // records i and i + 4
      return _mm256_inserti128_si256(
          _mm256_castsi128_si256(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at + i * stride))),
          _mm_loadu_si128(reinterpret_cast<const __m128i*>(at + (i + 4) * stride)), 1);
    };
    const __m256i r0 = record(0), r1 = record(1), r2 = record(2), r3 = record(3);
    const __m256i a = _mm256_unpacklo_epi32(r0, r1), b = _mm256_unpacklo_epi32(r2, r3);
    const __m256i c = _mm256_unpackhi_epi32(r0, r1), d = _mm256_unpackhi_epi32(r2, r3);
    c0 = I(_mm256_unpacklo_epi64(a, b)), c1 = I(_mm256_unpackhi_epi64(a, b));
    c2 = I(_mm256_unpacklo_epi64(c, d)), c3 = I(_mm256_unpackhi_epi64(c, d));
  }
  OVT_INLINE static __m128i scale_half(__m256d v, double unit) {
    const __m256d huge = _mm256_set1_pd(1e200), limit = _mm256_set1_pd(2147483647.0), sign = _mm256_set1_pd(-0.0);
    v = _mm256_max_pd(_mm256_min_pd(v, huge), _mm256_xor_pd(huge, sign));
    v = _mm256_mul_pd(v, _mm256_set1_pd(unit));
    v = _mm256_max_pd(_mm256_min_pd(v, limit), _mm256_xor_pd(limit, sign));
    return _mm256_cvttpd_epi32(_mm256_add_pd(v, _mm256_or_pd(_mm256_and_pd(v, sign), _mm256_set1_pd(0.5))));
  }
  OVT_INLINE static I scale_to_int(F a, double unit) {
    const __m128 low = _mm256_castps256_ps128(a), high = _mm256_extractf128_ps(a, 1);
    return I(_mm256_inserti128_si256(_mm256_castsi128_si256(scale_half(_mm256_cvtps_pd(low), unit)),
                                     scale_half(_mm256_cvtps_pd(high), unit), 1));
  }
  // Adds halves (4 apart), then quarters (2 and 1 apart), of four vectors.
  OVT_INLINE static __m128 fold_quarters(__m256 a, __m256 b, __m256 c, __m256 d) {
    const auto half = [](__m256 v)
                          OVT_INLINED { return _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1)); };
    const __m128 p = half(a), q = half(b), r = half(c), s = half(d);
    const __m128 pq = _mm_add_ps(_mm_movelh_ps(p, q), _mm_movehl_ps(q, p));
    const __m128 rs = _mm_add_ps(_mm_movelh_ps(r, s), _mm_movehl_ps(s, r));
    return _mm_add_ps(_mm_shuffle_ps(pq, rs, _MM_SHUFFLE(2, 0, 2, 0)), _mm_shuffle_ps(pq, rs, _MM_SHUFFLE(3, 1, 3, 1)));
  }
  OVT_INLINE static void fold_four(F a, F b, F c, F d, float* out) { _mm_storeu_ps(out, fold_quarters(a, b, c, d)); }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    if constexpr (kApart == 4) return F(_mm256_permute2f128_ps(a, a, 1));
    return F(_mm256_permute_ps(a, kApart == 2 ? _MM_SHUFFLE(1, 0, 3, 2) : _MM_SHUFFLE(2, 3, 0, 1)));
  }
};

}  // namespace overtake::simd
