// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The SIMD wrapper. It and simd_<isa>.h, which hold the intrinsics, are the only files that depend on ISA and xsimd
// version.
//
//   Float<A>, Int<A>   kSize values of 4 bytes        Mask<A>         one bool per lane
//   Double<A>          kDoubles values of 8 bytes     DoubleMask<A>   one bool per lane
//
// A is an xsimd architecture. Every name here is a template on A or always inlined, so that the linker cannot use code
// of one ISA for another. Kernels must do the same: no std:: function, no inline function without OVT_INLINE. Each
// operation gives the bytes of the scalar operation: + - * / sqrt are IEEE; min and max are `a < b ? a : b` and
// `a > b ? a : b` (the second operand on a tie or a NaN); comparisons with NaN are false except !=. There is no fused
// multiply-add and no approximation.
//
// Loads and stores need no alignment: on aligned data they cost the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <xsimd/xsimd.hpp>

#include "core/math.h"

namespace overtake::simd {

template <class A>
inline constexpr int32_t kSize = int32_t(xsimd::batch<float, A>::size);

// Compilers make no vectors of a loop with it: scattered stores cost more than single ones.
OVT_INLINE void keep_scalar() { __asm__ volatile(""); }

template <class A>
struct Native;  // the intrinsics, one specialisation per ISA, in simd_<isa>.h

template <class A>
struct Mask {
  using Batch = xsimd::batch_bool<float, A>;
  Batch v;

  OVT_INLINE Mask() {}
  OVT_INLINE Mask(Batch b) : v(b) {}
  OVT_INLINE explicit Mask(bool all) : v(all) {}
  // Lane i is set if bit i is.
  OVT_INLINE static Mask from_bits(uint32_t bits) { return Native<A>::mask_of_bits(bits); }
  // The first `count` lanes; count may be negative or larger than kSize.
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
  OVT_INLINE friend Int operator*(Int a, Int b) { return a.v * b.v; }  // the low 32 bits
  OVT_INLINE friend Int operator&(Int a, Int b) { return a.v & b.v; }
  OVT_INLINE friend Int operator>>(Int a, int32_t places) { return a.v >> places; }  // arithmetic shift
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

template <class A>
inline constexpr int32_t kDoubles = int32_t(xsimd::batch<double, A>::size);

template <class A>
struct DoubleMask {
  using Batch = xsimd::batch_bool<double, A>;
  Batch v;

  OVT_INLINE DoubleMask(Batch b) : v(b) {}
  OVT_INLINE friend DoubleMask operator&(DoubleMask a, DoubleMask b) { return a.v & b.v; }
};

template <class A>
struct Double {
  using Batch = xsimd::batch<double, A>;
  Batch v;

  OVT_INLINE Double() {}
  OVT_INLINE Double(Batch b) : v(b) {}
  OVT_INLINE explicit Double(double all) : v(all) {}
  OVT_INLINE static Double load(const double* at) { return Batch::load_unaligned(at); }
  OVT_INLINE void store(double* at) const { v.store_unaligned(at); }
  OVT_INLINE friend Double operator+(Double a, Double b) { return a.v + b.v; }
  OVT_INLINE friend Double operator-(Double a, Double b) { return a.v - b.v; }
  OVT_INLINE friend Double operator*(Double a, Double b) { return a.v * b.v; }
  OVT_INLINE friend Double operator/(Double a, Double b) { return a.v / b.v; }
  OVT_INLINE friend DoubleMask<A> operator<(Double a, Double b) { return a.v < b.v; }
  OVT_INLINE friend DoubleMask<A> operator>(Double a, Double b) { return a.v > b.v; }
  OVT_INLINE friend DoubleMask<A> operator<=(Double a, Double b) { return a.v <= b.v; }
};

// The functions that core/math.h's templates need for a value type. The forms for float stay visible.
using overtake::abs_of, overtake::gather, overtake::max_of, overtake::min_of, overtake::select, overtake::to_float,
    overtake::to_int;
template <class A>
OVT_INLINE Float<A> select(Mask<A> m, Float<A> yes, Float<A> no) {
  return xsimd::select(m.v, yes.v, no.v);
}
template <class A>
OVT_INLINE Int<A> select(Mask<A> m, Int<A> yes, Int<A> no) {
  return Native<A>::select(m.v, yes.v, no.v);
}
template <class A>
OVT_INLINE Float<A> abs_of(Float<A> a) {
  return xsimd::abs(a.v);
}
template <class A>
OVT_INLINE Float<A> min_of(Float<A> a, Float<A> b) {
  return Native<A>::min(a.v, b.v);
}
template <class A>
OVT_INLINE Float<A> max_of(Float<A> a, Float<A> b) {
  return Native<A>::max(a.v, b.v);
}
template <class A>
OVT_INLINE Float<A> sqrt_of(Float<A> a) {
  return Native<A>::sqrt(a.v);
}

template <class A>
OVT_INLINE Double<A> select(DoubleMask<A> m, Double<A> yes, Double<A> no) {
  return xsimd::select(m.v, yes.v, no.v);
}
template <class A>
OVT_INLINE Double<A> abs_of(Double<A> a) {
  return xsimd::abs(a.v);
}
template <class A>
OVT_INLINE Double<A> min_of(Double<A> a, Double<A> b) {
  return select(a < b, a, b);
}
template <class A>
OVT_INLINE Double<A> max_of(Double<A> a, Double<A> b) {
  return select(a > b, a, b);
}
template <class A>
OVT_INLINE Double<A> sqrt_of(Double<A> a) {
  return xsimd::sqrt(a.v);
}

// a + b where the mask is set, elsewhere a + 0, which is a (a must not be -0).
template <class A>
OVT_INLINE Float<A> add_where(Mask<A> m, Float<A> a, Float<A> b) {
  return Native<A>::add_where(m.v, a.v, b.v);
}
// The value where the mask is set, elsewhere +0.
template <class A>
OVT_INLINE Float<A> keep(Mask<A> m, Float<A> a) {
  return Native<A>::keep(m.v, a.v);
}

// Conversions: to_int truncates the fraction (|a| < 2^31), the other two keep the bits.
template <class A>
OVT_INLINE Int<A> to_int(Float<A> a) {
  return Native<A>::to_int(a.v);
}
template <class A>
OVT_INLINE Float<A> to_float(Int<A> a) {
  return Native<A>::to_float(a.v);
}
template <class A>
OVT_INLINE Int<A> bits_of(Float<A> a) {
  return Native<A>::bits_of(a.v);
}
template <class A>
OVT_INLINE Float<A> float_of_bits(Int<A> a) {
  return Native<A>::float_of_bits(a.v);
}

// base[index] per lane. The indices of all lanes must be readable.
template <class A>
OVT_INLINE Float<A> gather(const float* base, Int<A> index) {
  return Native<A>::gather(base, index.v);
}
template <class A>
OVT_INLINE Int<A> gather(const int32_t* base, Int<A> index) {
  return Native<A>::gather(base, index.v);
}

// Lane i gets lane index[i] of the table, 0 <= index[i] < kSize.
template <class A>
OVT_INLINE Int<A> permute(Int<A> table, Int<A> index) {
  return Native<A>::permute(table.v, index.v);
}

OVT_INLINE int32_t count_bits(uint64_t bits) {
#if defined(__POPCNT__) || defined(__aarch64__)
  return __builtin_popcountll(bits);
#else  // the compiler would make a table in memory of the built-in
  bits = bits - ((bits >> 1) & 0x5555555555555555u);
  bits = (bits & 0x3333333333333333u) + ((bits >> 2) & 0x3333333333333333u);
  return int32_t((((bits + (bits >> 4)) & 0x0f0f0f0f0f0f0f0fu) * 0x0101010101010101u) >> 56);
#endif
}
OVT_INLINE int32_t lowest_bit(uint64_t bits) { return __builtin_ctzll(bits); }
OVT_INLINE int32_t highest_bit(uint64_t bits) { return 63 - __builtin_clzll(bits); }

// Whether the ISA has lookups in registers. The next three functions exist only there.
template <class A>
inline constexpr bool kPermutes = kSize<A> > 4;

// Lane i gets value index[i] of four consecutive vectors, 0 <= index[i] < 4 kSize.
template <class A>
OVT_INLINE Int<A> permute(Int<A> t0, Int<A> t1, Int<A> t2, Int<A> t3, Int<A> index) {
  return Native<A>::permute4(t0.v, t1.v, t2.v, t3.v, index.v);
}

// Lane i gets value index[i] of two consecutive vectors, 0 <= index[i] < 2 kSize.
template <class A>
OVT_INLINE Int<A> permute(Int<A> t0, Int<A> t1, Int<A> index) {
  return Native<A>::permute2(t0.v, t1.v, index.v);
}

// Lane i gets the number of set bits among bits 1 .. i (bit 0 does not count, so the sum is less than kSize).
template <class A>
OVT_INLINE Int<A> count_starts(uint32_t bits) {
  return Native<A>::count_starts(bits);
}

// Writes the lanes of the mask only. The memory of all lanes must be readable, and may be rewritten with its own value.
template <class A>
OVT_INLINE void store_where(Mask<A> m, Float<A> a, float* at) {
  Native<A>::store_where(m.v, a.v, at);
}
template <class A>
OVT_INLINE void store_where(Mask<A> m, Int<A> a, int32_t* at) {
  Native<A>::store_where(m.v, a.v, at);
}

// Packs the lanes of the mask to `at`; may write up to kSize places. Then advance: at += count_bits(m.bits()).
template <class A>
OVT_INLINE void store_packed(Mask<A> m, Int<A> a, int32_t* at) {
  Native<A>::store_packed(m.v, a.v, at);
}

// The low byte of each lane.
template <class A>
OVT_INLINE void store_bytes(Int<A> a, uint8_t* at) {
  Native<A>::store_bytes(a.v, at);
}
template <class A>
OVT_INLINE Int<A> load_bytes(const uint8_t* at) {
  return Native<A>::load_bytes(at);
}
template <class A>
OVT_INLINE Int<A> load_words(const uint16_t* at) {
  return Native<A>::load_words(at);
}

// Records of four words, `stride` bytes apart: word k of record i goes to lane i of column k. May be unaligned.
template <class A>
OVT_INLINE void load_records(const char* at, std::ptrdiff_t stride, Int<A>& column0, Int<A>& column1, Int<A>& column2,
                             Int<A>& column3) {
  Native<A>::load_records(at, stride, column0.v, column1.v, column2.v, column3.v);
}

// a * unit in double, clamped to +-(2^31 - 1), rounded to the nearest integer, halves away from zero. The result of a
// NaN is unspecified. |a| is first clamped to 1e200, so that infinity times a unit of zero is zero.
template <class A>
OVT_INLINE Int<A> scale_to_int(Float<A> a, double unit) {
  return Native<A>::scale_to_int(a.v, unit);
}

// Lane i gets lane i ^ kApart, kApart a power of two below kSize.
template <int32_t kApart, class A>
OVT_INLINE Float<A> swap_lanes(Float<A> a) {
  return Native<A>::template swap_lanes<kApart>(a.v);
}
template <class A>
OVT_INLINE float first_lane(Float<A> a) {
  return a.v.get(0);
}

// Folds the lanes of one vector, for callers that ignore the sign of a zero.
template <class A, class F>
OVT_INLINE float fold_vector(Float<A> v, F&& f) {
  if constexpr (kSize < A >> 8) v = f(v, swap_lanes<8>(v));
  if constexpr (kSize < A >> 4) v = f(v, swap_lanes<4>(v));
  v = f(v, swap_lanes<2>(v));
  return first_lane(f(v, swap_lanes<1>(v)));
}

// Folds kLanes = 16 values in the order of core/reduce.h; v holds them in 16 / kSize vectors.
template <class A, class F>
OVT_INLINE float fold_lanes(Float<A>* v, F&& f) {
  for (int32_t apart = 8 / kSize<A>; apart > 0; apart /= 2)
    for (int32_t i = 0; i < apart; ++i) v[i] = f(v[i], v[i + apart]);
  return fold_vector(v[0], f);
}
template <class A>
OVT_INLINE float lane_sum(Float<A>* v) {
  return fold_lanes(v, [](Float<A> a, Float<A> b) OVT_INLINED { return a + b; });
}
template <class A>
OVT_INLINE float lane_min(Float<A>* v) {
  return fold_lanes(v, [](Float<A> a, Float<A> b) OVT_INLINED { return min_of(a, b); });
}
template <class A>
OVT_INLINE float lane_max(Float<A>* v) {
  return fold_lanes(v, [](Float<A> a, Float<A> b) OVT_INLINED { return max_of(a, b); });
}

template <class A>
OVT_INLINE float any_lane_min(Float<A> v) {
  return fold_vector(v, [](Float<A> a, Float<A> b) OVT_INLINED { return min_of(a, b); });
}
template <class A>
OVT_INLINE float any_lane_max(Float<A> v) {
  return fold_vector(v, [](Float<A> a, Float<A> b) OVT_INLINED { return max_of(a, b); });
}

// Four lane_sums at once, to four floats: the same additions, in registers that hold lanes of all four.
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

}  // namespace overtake::simd

#if defined(__x86_64__)
#include "kernels/simd_sse2.h"
#if defined(__AVX2__)
#include "kernels/simd_avx2.h"
#endif
#if defined(__AVX512BW__)
#include "kernels/simd_avx512.h"
#endif
#elif defined(__aarch64__)
#include "kernels/simd_neon64.h"
#endif
