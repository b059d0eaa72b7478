// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Two vectors side by side.
#pragma once

#include "kernels/simd.h"

namespace overtake::simd {

// Two values side by side. A function of core/math.h on a Pair runs two independent chains of operations, which keep
// the arithmetic units busy; one chain would wait for its own results.
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
  OVT_INLINE friend Pair select(Masks m, Pair yes, Pair no) {
    return {select(m.a, yes.a, no.a), select(m.b, yes.b, no.b)};
  }
  OVT_INLINE friend Pair abs_of(Pair v) { return {abs_of(v.a), abs_of(v.b)}; }
  OVT_INLINE friend Pair min_of(Pair v, Pair w) { return {min_of(v.a, w.a), min_of(v.b, w.b)}; }
  OVT_INLINE friend Pair max_of(Pair v, Pair w) { return {max_of(v.a, w.a), max_of(v.b, w.b)}; }
};
template <class A>
using FloatPair = Pair<Float<A>, Mask<A>>;

}  // namespace overtake::simd
