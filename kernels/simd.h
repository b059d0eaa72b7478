// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The shim: the only file that knows intrinsics, and what differs between ISAs and between versions of xsimd.
//
//   Float<A>, Int<A>   kSize values of 4 bytes        Mask<A>   one truth value a lane
//
// A is an xsimd architecture. Every name here is a template on it or always inlined, so nothing built for one ISA can be
// linked into another; keep the kernels so, too: no std:: function, no inline function without OVT_INLINE.
// Each operation gives the bytes the scalar twin gets: + - * / sqrt are IEEE, min and max are `a < b ? a : b` and
// `a > b ? a : b` (the second operand on a tie or a NaN), comparisons with NaN are false except !=. There is no fused
// multiply-add and nothing approximate.
//
// Loads and stores need no alignment: on aligned data they cost the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <xsimd/xsimd.hpp>

#include "core/math.h"

#if defined(__x86_64__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace overtake::simd {

template <class A>
inline constexpr int32_t kSize = int32_t(xsimd::batch<float, A>::size);

template <class A> struct Native;   // the intrinsics, one specialisation per ISA, at the end of this file

template <class A>
struct Mask {
  using Batch = xsimd::batch_bool<float, A>;
  Batch v;

  OVT_INLINE Mask() {}
  OVT_INLINE Mask(Batch b) : v(b) {}
  OVT_INLINE explicit Mask(bool all) : v(all) {}
  // Lane i from bit i.
  OVT_INLINE static Mask from_bits(uint32_t bits) { return Native<A>::mask_of_bits(bits); }
  // The lanes before `count`, which may be negative or beyond the last.
  OVT_INLINE static Mask first(int32_t count) {
    return from_bits(count <= 0 ? 0u : count >= kSize<A> ? (1u << kSize<A>)-1u : (1u << count) - 1u);
  }
  OVT_INLINE uint32_t bits() const { return Native<A>::bits_of_mask(v); }
  OVT_INLINE bool any() const { return bits() != 0; }
  OVT_INLINE Mask operator~() const { return ~v; }
  OVT_INLINE friend Mask operator&(Mask a, Mask b) { return a.v & b.v; }
  OVT_INLINE friend Mask operator|(Mask a, Mask b) { return a.v | b.v; }
};

template <class A>
struct Int {
  using Batch = xsimd::batch<int32_t, A>;
  Batch v;

  OVT_INLINE Int() {}
  OVT_INLINE Int(Batch b) : v(b) {}
  OVT_INLINE explicit Int(int32_t all) : v(all) {}
  OVT_INLINE static Int load(const int32_t* at) { return Batch::load_unaligned(at); }
  OVT_INLINE void store(int32_t* at) const { v.store_unaligned(at); }
  // begin, begin + 1, begin + 2, ...
  OVT_INLINE static Int count_from(int32_t begin) { return Int(begin) + Native<A>::iota(); }
  OVT_INLINE friend Int operator+(Int a, Int b) { return a.v + b.v; }
  OVT_INLINE friend Int operator-(Int a, Int b) { return a.v - b.v; }
  OVT_INLINE friend Int operator*(Int a, Int b) { return a.v * b.v; }   // the low 32 bits
  OVT_INLINE friend Int operator&(Int a, Int b) { return a.v & b.v; }
  OVT_INLINE friend Int operator>>(Int a, int32_t places) { return a.v >> places; }   // fills with the sign
  OVT_INLINE friend Int operator|(Int a, Int b) { return a.v | b.v; }
  OVT_INLINE friend Int operator^(Int a, Int b) { return a.v ^ b.v; }
  OVT_INLINE friend Mask<A> operator==(Int a, Int b) { return Native<A>::equal(a.v, b.v); }
  OVT_INLINE friend Mask<A> operator>(Int a, Int b) { return Native<A>::greater(a.v, b.v); }
  OVT_INLINE friend Mask<A> operator<(Int a, Int b) { return b > a; }
};

template <class A>
struct Float {
  using Batch = xsimd::batch<float, A>;
  static constexpr int32_t kCount = kSize<A>;
  Batch v;

  OVT_INLINE Float() {}
  OVT_INLINE Float(Batch b) : v(b) {}
  OVT_INLINE explicit Float(float all) : v(all) {}
  OVT_INLINE static Float load(const float* at) { return Batch::load_unaligned(at); }
  OVT_INLINE void store(float* at) const { v.store_unaligned(at); }
  OVT_INLINE friend Float operator+(Float a, Float b) { return a.v + b.v; }
  OVT_INLINE friend Float operator-(Float a, Float b) { return a.v - b.v; }
  OVT_INLINE friend Float operator*(Float a, Float b) { return a.v * b.v; }
  OVT_INLINE friend Float operator/(Float a, Float b) { return Native<A>::divide(a.v, b.v); }
  OVT_INLINE friend Mask<A> operator<(Float a, Float b) { return a.v < b.v; }
  OVT_INLINE friend Mask<A> operator>(Float a, Float b) { return a.v > b.v; }
  OVT_INLINE friend Mask<A> operator<=(Float a, Float b) { return a.v <= b.v; }
  OVT_INLINE friend Mask<A> operator>=(Float a, Float b) { return a.v >= b.v; }
  OVT_INLINE friend Mask<A> operator==(Float a, Float b) { return a.v == b.v; }
  OVT_INLINE friend Mask<A> operator!=(Float a, Float b) { return ~(a.v == b.v); }
};

// What core/math.h's templates ask of a value type. Its forms for float stay in sight.
using overtake::abs_of, overtake::max_of, overtake::min_of, overtake::select;
template <class A> OVT_INLINE Float<A> select(Mask<A> m, Float<A> yes, Float<A> no) { return xsimd::select(m.v, yes.v, no.v); }
template <class A> OVT_INLINE Int<A> select(Mask<A> m, Int<A> yes, Int<A> no) { return Native<A>::select(m.v, yes.v, no.v); }
template <class A> OVT_INLINE Float<A> abs_of(Float<A> a) { return xsimd::abs(a.v); }
template <class A> OVT_INLINE Float<A> min_of(Float<A> a, Float<A> b) { return Native<A>::min(a.v, b.v); }
template <class A> OVT_INLINE Float<A> max_of(Float<A> a, Float<A> b) { return Native<A>::max(a.v, b.v); }
template <class A> OVT_INLINE Float<A> sqrt_of(Float<A> a) { return Native<A>::sqrt(a.v); }

// a + b where the mask holds, elsewhere a + 0, which is a (a -0 must not come here).
template <class A> OVT_INLINE Float<A> add_where(Mask<A> m, Float<A> a, Float<A> b) { return Native<A>::add_where(m.v, a.v, b.v); }
// Where the mask holds, the value, elsewhere +0.
template <class A> OVT_INLINE Float<A> keep(Mask<A> m, Float<A> a) { return Native<A>::keep(m.v, a.v); }

// Conversions: to_int cuts off the fraction (|a| < 2^31), the other two keep the bits.
template <class A> OVT_INLINE Int<A> to_int(Float<A> a) { return Native<A>::to_int(a.v); }
template <class A> OVT_INLINE Float<A> to_float(Int<A> a) { return Native<A>::to_float(a.v); }
template <class A> OVT_INLINE Int<A> bits_of(Float<A> a) { return Native<A>::bits_of(a.v); }
template <class A> OVT_INLINE Float<A> float_of_bits(Int<A> a) { return Native<A>::float_of_bits(a.v); }

// base[index] per lane. Every lane's index must be readable.
template <class A> OVT_INLINE Float<A> gather(const float* base, Int<A> index) { return Native<A>::gather(base, index.v); }
template <class A> OVT_INLINE Int<A> gather(const int32_t* base, Int<A> index) { return Native<A>::gather(base, index.v); }

// Lane i gets lane index[i] of the table, 0 <= index[i] < kSize.
template <class A> OVT_INLINE Int<A> permute(Int<A> table, Int<A> index) { return Native<A>::permute(table.v, index.v); }

OVT_INLINE int32_t count_bits(uint64_t bits) {
#if defined(__POPCNT__) || defined(__aarch64__)
  return __builtin_popcountll(bits);
#else  // what the compiler calls for it is a table in memory
  bits = bits - ((bits >> 1) & 0x5555555555555555u);
  bits = (bits & 0x3333333333333333u) + ((bits >> 2) & 0x3333333333333333u);
  return int32_t((((bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu) * 0x0101010101010101u) >> 56);
#endif
}
OVT_INLINE int32_t lowest_bit(uint64_t bits) { return __builtin_ctzll(bits); }
OVT_INLINE int32_t highest_bit(uint64_t bits) { return 63 - __builtin_clzll(bits); }

// Whether the ISA looks values up in registers; else the next two are not there.
template <class A> inline constexpr bool kPermutes = kSize<A> > 4;

// Lane i gets value index[i] of four vectors in a row, 0 <= index[i] < 4 kSize.
template <class A>
OVT_INLINE Int<A> permute(Int<A> t0, Int<A> t1, Int<A> t2, Int<A> t3, Int<A> index) {
  return Native<A>::permute4(t0.v, t1.v, t2.v, t3.v, index.v);
}

// Rows of a table that mostly lie near each other, because they came from the sensor one after the other: a gather from
// columns of it reads whole vectors, then, and picks from these. Built for the lanes of `in`, of which there is at least
// one; the others give anything. `at` is where the rows lie in memory.
template <class A>
struct NearRows {
  static constexpr int32_t kWindow = 4 * kSize<A>;
  Int<A> row, offset;
  int32_t begin = 0;
  bool near = false;

  OVT_INLINE NearRows(const int32_t* at, Mask<A> in, int32_t capacity) {
    row = select(in, Int<A>::load(at), Int<A>(0));
    if constexpr (kPermutes<A>) {
      const uint32_t bits = in.bits();
      const int32_t first = at[lowest_bit(bits)], last = at[highest_bit(bits)];
      // The rows may fall as well as rise. A window of whole cache lines is read faster than it is placed well.
      begin = (first + (last - first) / 2 - (kWindow - kSize<A>) / 2) & ~(kSize<A> - 1);
      const int32_t latest = (capacity & ~(kSize<A> - 1)) - kWindow;
      begin = begin < latest ? begin : latest;
      begin = begin > 0 ? begin : 0;
      offset = row - Int<A>(begin);
      near = capacity >= kWindow && !(in & ~((offset & Int<A>(~(kWindow - 1))) == Int<A>(0))).any();
    }
  }
  OVT_INLINE Int<A> get(const int32_t* column) const {
    if constexpr (kPermutes<A>)
      if (near) {
        const int32_t* v = column + begin;
        return permute(Int<A>::load(v), Int<A>::load(v + kSize<A>), Int<A>::load(v + 2 * kSize<A>),
                       Int<A>::load(v + 3 * kSize<A>), offset);
      }
    return gather(column, row);
  }
  OVT_INLINE Float<A> get(const float* column) const {
    if constexpr (kPermutes<A>)
      if (near) {
        const float* v = column + begin;
        return float_of_bits(permute(bits_of(Float<A>::load(v)), bits_of(Float<A>::load(v + kSize<A>)),
                                     bits_of(Float<A>::load(v + 2 * kSize<A>)), bits_of(Float<A>::load(v + 3 * kSize<A>)),
                                     offset));
      }
    return gather(column, row);
  }
};

// Lane i gets the number of set bits among bits 1 .. i (bit 0 does not count, so the sum is less than kSize).
template <class A> OVT_INLINE Int<A> count_starts(uint32_t bits) { return Native<A>::count_starts(bits); }


// Writes the lanes of the mask only; the others' memory must be readable and may be rewritten with what it holds.
template <class A> OVT_INLINE void store_where(Mask<A> m, Float<A> a, float* at) { Native<A>::store_where(m.v, a.v, at); }
template <class A> OVT_INLINE void store_where(Mask<A> m, Int<A> a, int32_t* at) { Native<A>::store_where(m.v, a.v, at); }

// The lanes of the mask, packed, to `at`; up to kSize places are written. Follow with at += count_bits(m.bits()).
template <class A> OVT_INLINE void store_packed(Mask<A> m, Int<A> a, int32_t* at) { Native<A>::store_packed(m.v, a.v, at); }

// The low byte of each lane.
template <class A> OVT_INLINE void store_bytes(Int<A> a, uint8_t* at) { Native<A>::store_bytes(a.v, at); }
template <class A> OVT_INLINE Int<A> load_bytes(const uint8_t* at) { return Native<A>::load_bytes(at); }
template <class A> OVT_INLINE Int<A> load_words(const uint16_t* at) { return Native<A>::load_words(at); }

// Records of four words, `stride` bytes apart: word k of record i to lane i of column k. Need not be aligned.
template <class A>
OVT_INLINE void load_records(const char* at, std::ptrdiff_t stride, Int<A>& column0, Int<A>& column1, Int<A>& column2,
                             Int<A>& column3) {
  Native<A>::load_records(at, stride, column0.v, column1.v, column2.v, column3.v);
}

// a * unit by double arithmetic, cut off at +-(2^31 - 1), to the nearest integer, halves away from zero. A NaN gives
// anything. |a| is cut off at 1e200 first, so that infinity times a unit of zero is zero.
template <class A> OVT_INLINE Int<A> scale_to_int(Float<A> a, double unit) { return Native<A>::scale_to_int(a.v, unit); }

// Lane i gets lane i ^ kApart, kApart a power of two below kSize.
template <int32_t kApart, class A> OVT_INLINE Float<A> swap_lanes(Float<A> a) { return Native<A>::template swap_lanes<kApart>(a.v); }
template <class A> OVT_INLINE float first_lane(Float<A> a) { return a.v.get(0); }

// Over the lanes of one vector, where it makes no difference which of -0 and +0 comes out.
template <class A, class F>
OVT_INLINE float fold_vector(Float<A> v, F&& f) {
  if constexpr (kSize<A> > 8) v = f(v, swap_lanes<8>(v));
  if constexpr (kSize<A> > 4) v = f(v, swap_lanes<4>(v));
  v = f(v, swap_lanes<2>(v));
  return first_lane(f(v, swap_lanes<1>(v)));
}

// Folds of kLanes = 16 values in the shape of core/reduce.h; v holds them in 16 / kSize vectors.
template <class A, class F>
OVT_INLINE float fold_lanes(Float<A>* v, F&& f) {
  for (int32_t apart = 8 / kSize<A>; apart > 0; apart /= 2)
    for (int32_t i = 0; i < apart; ++i) v[i] = f(v[i], v[i + apart]);
  return fold_vector(v[0], f);
}
template <class A> OVT_INLINE float lane_sum(Float<A>* v) { return fold_lanes(v, [](Float<A> a, Float<A> b) __attribute__((always_inline)) { return a + b; }); }
template <class A> OVT_INLINE float lane_min(Float<A>* v) { return fold_lanes(v, [](Float<A> a, Float<A> b) __attribute__((always_inline)) { return min_of(a, b); }); }
template <class A> OVT_INLINE float lane_max(Float<A>* v) { return fold_lanes(v, [](Float<A> a, Float<A> b) __attribute__((always_inline)) { return max_of(a, b); }); }

template <class A> OVT_INLINE float any_lane_min(Float<A> v) { return fold_vector(v, [](Float<A> a, Float<A> b) __attribute__((always_inline)) { return min_of(a, b); }); }
template <class A> OVT_INLINE float any_lane_max(Float<A> v) { return fold_vector(v, [](Float<A> a, Float<A> b) __attribute__((always_inline)) { return max_of(a, b); }); }

// lane_sum of four at once, to four floats: the same additions, in registers that hold lanes of all four.
template <class A>
OVT_INLINE void lane_sums(Float<A>* v0, Float<A>* v1, Float<A>* v2, Float<A>* v3, float* out) {
  if constexpr (kPermutes<A>) {
    Float<A>* const v[4] = {v0, v1, v2, v3};
    if constexpr (kSize<A> == 8)
      for (int32_t i = 0; i < 4; ++i) v[i][0] = v[i][0] + v[i][1];
    Native<A>::fold_four(v0[0].v, v1[0].v, v2[0].v, v3[0].v, out);
  } else {
    out[0] = lane_sum(v0), out[1] = lane_sum(v1), out[2] = lane_sum(v2), out[3] = lane_sum(v3);
  }
}

// Two values abreast: a function of core/math.h on a Pair is two chains of dependent operations in lockstep, which keeps
// the arithmetic units busy where one chain would wait for its own results.
template <class V, class M>
struct Pair {
  V a, b;

  OVT_INLINE Pair() {}
  OVT_INLINE Pair(V first, V second) : a(first), b(second) {}
  OVT_INLINE explicit Pair(float all) : a(all), b(all) {}
  static constexpr int32_t kCount = 2 * V::kCount;
  OVT_INLINE static Pair load(const float* at) { return {V::load(at), V::load(at + V::kCount)}; }
  OVT_INLINE void store(float* at) const {
    a.store(at);
    b.store(at + V::kCount);
  }
  struct Masks {
    M a, b;
    OVT_INLINE friend Masks operator|(Masks v, Masks w) { return {v.a | w.a, v.b | w.b}; }
    OVT_INLINE Masks operator~() const { return {~a, ~b}; }
    OVT_INLINE bool any() const { return a.any() || b.any(); }
  };
  OVT_INLINE friend Masks operator==(Pair v, Pair w) { return {v.a == w.a, v.b == w.b}; }
  OVT_INLINE friend Pair operator+(Pair v, Pair w) { return {v.a + w.a, v.b + w.b}; }
  OVT_INLINE friend Pair operator-(Pair v, Pair w) { return {v.a - w.a, v.b - w.b}; }
  OVT_INLINE friend Pair operator*(Pair v, Pair w) { return {v.a * w.a, v.b * w.b}; }
  OVT_INLINE friend Pair operator/(Pair v, Pair w) { return {v.a / w.a, v.b / w.b}; }
  OVT_INLINE friend Masks operator<(Pair v, Pair w) { return {v.a < w.a, v.b < w.b}; }
  OVT_INLINE friend Masks operator>(Pair v, Pair w) { return {v.a > w.a, v.b > w.b}; }
  OVT_INLINE friend Pair select(Masks m, Pair yes, Pair no) { return {select(m.a, yes.a, no.a), select(m.b, yes.b, no.b)}; }
  OVT_INLINE friend Pair abs_of(Pair v) { return {abs_of(v.a), abs_of(v.b)}; }
  OVT_INLINE friend Pair min_of(Pair v, Pair w) { return {min_of(v.a, w.a), min_of(v.b, w.b)}; }
  OVT_INLINE friend Pair max_of(Pair v, Pair w) { return {max_of(v.a, w.a), max_of(v.b, w.b)}; }
};
template <class A> using FloatPair = Pair<Float<A>, Mask<A>>;

// ---- x86-64 ---------------------------------------------------------------------------------------------------------
#if defined(__x86_64__)

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
    at[0] = v[0];                  // an unwanted one is overwritten by the next
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
    const auto record = [=](int32_t i) __attribute__((always_inline)) {
      return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at + i * stride));
    };
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
    return I(_mm_unpacklo_epi64(scale_half(_mm_cvtps_pd(a), unit), scale_half(_mm_cvtps_pd(_mm_movehl_ps(a, a)), unit)));
  }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    return F(_mm_shuffle_ps(a, a, kApart == 2 ? _MM_SHUFFLE(1, 0, 3, 2) : _MM_SHUFFLE(2, 3, 0, 1)));
  }
};

#if defined(__AVX2__)
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
  OVT_INLINE static I permute4(I t0, I t1, I t2, I t3, I index) {
    const __m256 bit3 = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));
    const __m256 bit4 = _mm256_castsi256_ps(_mm256_slli_epi32(index, 27));
    const auto pick = [=](I t) __attribute__((always_inline)) { return _mm256_castsi256_ps(_mm256_permutevar8x32_epi32(t, index)); };
    const __m256 low = _mm256_blendv_ps(pick(t0), pick(t1), bit3), high = _mm256_blendv_ps(pick(t2), pick(t3), bit3);
    return I(_mm256_castps_si256(_mm256_blendv_ps(low, high, bit4)));
  }
  // One bit a byte, times 0x0101...: each byte is the sum of itself and all below.
  OVT_INLINE static I count_starts(uint32_t bits) {
    const uint64_t bytes = _pdep_u64(bits & 0xfeu, 0x0101010101010101u) * 0x0101010101010101u;
    return I(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(int64_t(bytes))));
  }
  OVT_INLINE static I select(M m, I yes, I no) {
    return I(_mm256_blendv_epi8(no, yes, _mm256_castps_si256(m)));
  }
  OVT_INLINE static M equal(I a, I b) { return M(_mm256_castsi256_ps(_mm256_cmpeq_epi32(a, b))); }
  OVT_INLINE static M greater(I a, I b) { return M(_mm256_castsi256_ps(_mm256_cmpgt_epi32(a, b))); }
  OVT_INLINE static I to_int(F a) { return I(_mm256_cvttps_epi32(a)); }
  OVT_INLINE static F to_float(I a) { return F(_mm256_cvtepi32_ps(a)); }
  OVT_INLINE static I bits_of(F a) { return I(_mm256_castps_si256(a)); }
  OVT_INLINE static F float_of_bits(I a) { return F(_mm256_castsi256_ps(a)); }
  OVT_INLINE static F gather(const float* base, I index) { return F(_mm256_i32gather_ps(base, index, 4)); }
  OVT_INLINE static I gather(const int32_t* base, I index) { return I(_mm256_i32gather_epi32(base, index, 4)); }
  OVT_INLINE static void store_where(M m, F a, float* at) { _mm256_maskstore_ps(at, _mm256_castps_si256(m), a); }
  OVT_INLINE static void store_where(M m, I a, int32_t* at) {
    _mm256_maskstore_epi32(at, _mm256_castps_si256(m), a);
  }
  // Which lanes: their numbers as nibbles, the wanted ones pulled together.
  OVT_INLINE static void store_packed(M m, I a, int32_t* at) {
    const uint64_t wanted = _pdep_u64(bits_of_mask(m), 0x1111111111111111u) * 15u;
    const uint64_t lanes = _pdep_u64(_pext_u64(0x76543210u, wanted), 0x0f0f0f0f0f0f0f0fu);
    permute(a, I(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(int64_t(lanes))))).store_unaligned(at);
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
    const auto record = [=](int32_t i) __attribute__((always_inline)) {   // i and i + 4
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
  // Halves 4 apart, then quarters 2 and 1 apart, of four vectors.
  OVT_INLINE static __m128 fold_quarters(__m256 a, __m256 b, __m256 c, __m256 d) {
    const auto half = [](__m256 v) __attribute__((always_inline)) {
      return _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
    };
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
#endif

#if defined(__AVX512BW__)
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
  OVT_INLINE static I permute4(I t0, I t1, I t2, I t3, I index) {
    const __mmask16 high = _mm512_test_epi32_mask(index, _mm512_set1_epi32(32));
    return I(_mm512_mask_blend_epi32(high, _mm512_permutex2var_epi32(t0, index, t1),
                                     _mm512_permutex2var_epi32(t2, index, t3)));
  }
  // One bit a byte, times 0x0101...: each byte is the sum of itself and all below.
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
    const auto record = [=](int32_t i) __attribute__((always_inline)) {   // i, i + 4, i + 8 and i + 12
      const auto part = [=](int32_t j) __attribute__((always_inline)) {
        return _mm_loadu_si128(reinterpret_cast<const __m128i*>(at + j * stride));
      };
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
  // 8, 4, 2 and 1 apart.
  OVT_INLINE static void fold_four(F a, F b, F c, F d, float* out) {
    const auto two = [](__m512 v, __m512 w) __attribute__((always_inline)) {
      return _mm512_add_ps(_mm512_shuffle_f32x4(v, w, _MM_SHUFFLE(1, 0, 1, 0)),
                           _mm512_shuffle_f32x4(v, w, _MM_SHUFFLE(3, 2, 3, 2)));
    };
    const __m512 ab = two(a, b), cd = two(c, d);
    const __m512 all = _mm512_add_ps(_mm512_shuffle_f32x4(ab, cd, _MM_SHUFFLE(2, 0, 2, 0)),
                                     _mm512_shuffle_f32x4(ab, cd, _MM_SHUFFLE(3, 1, 3, 1)));
    const __m512 twos = _mm512_add_ps(all, _mm512_permute_ps(all, _MM_SHUFFLE(1, 0, 3, 2)));
    const __m512 ones = _mm512_add_ps(twos, _mm512_permute_ps(twos, _MM_SHUFFLE(2, 3, 0, 1)));
    _mm_storeu_ps(out, _mm512_castps512_ps128(_mm512_maskz_compress_ps(0x1111, ones)));   // one of each quarter
  }
  template <int32_t kApart>
  OVT_INLINE static F swap_lanes(F a) {
    if constexpr (kApart == 8) return F(_mm512_shuffle_f32x4(a, a, _MM_SHUFFLE(1, 0, 3, 2)));
    if constexpr (kApart == 4) return F(_mm512_shuffle_f32x4(a, a, _MM_SHUFFLE(2, 3, 0, 1)));
    return F(_mm512_permute_ps(a, kApart == 2 ? _MM_SHUFFLE(1, 0, 3, 2) : _MM_SHUFFLE(2, 3, 0, 1)));
  }
};
#endif

// ---- AArch64 --------------------------------------------------------------------------------------------------------
#elif defined(__aarch64__)

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
  // xsimd's own are approximations refined by steps.
  OVT_INLINE static F divide(F a, F b) { return F(vdivq_f32(a, b)); }
  OVT_INLINE static F sqrt(F a) { return F(vsqrtq_f32(a)); }
  // vminq and vmaxq treat NaN and -0 otherwise.
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
    at[0] = v[0];                  // an unwanted one is overwritten by the next
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
#endif

}  // namespace overtake::simd
