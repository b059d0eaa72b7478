// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Elementary functions made of polynomials (multiply and add, plus / and sqrt, which IEEE 754 rounds correctly), so
// that every machine, compiler and ISA computes the same bytes. The data path does not call libm, whose results differ
// between C libraries and CPUs. Build with -ffp-contract=off.
//
// The float forms are templates on a value type V: float in the references, a vector in the SIMD kernels, so both share
// one source. V needs a constructor from float, + - * /, < and >, and the free functions select, abs_of, min_of and
// max_of. For float they are below. A vector type declares them in its own namespace, where argument-dependent lookup
// finds them. No function branches on data, and none uses unary minus (0 - v gives +0 on every ISA). Arguments must be
// finite; for a NaN the result is unspecified.
//
// Bounds are measured against x87 long double by tests/test_math.cpp; ulp = unit in the last place of the true value.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/check.h"

namespace overtake {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kHalfPi = 1.57079632679489661923;
inline constexpr double kTwoPi = 6.28318530717958647693;
inline constexpr float kPiF = 3.14159265358979323846f;  // 8.7e-8 above pi
inline constexpr float kHalfPiF = 1.57079632679489661923f;
inline constexpr float kTwoPiF = 6.28318530717958647693f;
inline constexpr float kSqrt2F = 1.41421357f;

// The free functions for V = float. They use compiler built-ins, not std::fabs: the linker could take a library's
// inline function from a file built for AVX and use it for every CPU.
OVT_INLINE float select(bool mask, float yes, float no) { return mask ? yes : no; }
OVT_INLINE float abs_of(float v) { return __builtin_fabsf(v); }
OVT_INLINE float min_of(float a, float b) { return a < b ? a : b; }
OVT_INLINE float max_of(float a, float b) { return a > b ? a : b; }
OVT_INLINE int32_t to_int(float v) { return int32_t(v); }
OVT_INLINE float to_float(int32_t v) { return float(v); }
OVT_INLINE float gather(const float* base, int32_t index) { return base[index]; }
OVT_INLINE double select(bool mask, double yes, double no) { return mask ? yes : no; }
OVT_INLINE double abs_of(double v) { return __builtin_fabs(v); }
OVT_INLINE double min_of(double a, double b) { return a < b ? a : b; }
OVT_INLINE double max_of(double a, double b) { return a > b ? a : b; }
OVT_INLINE double sqrt_of(double v) { return __builtin_sqrt(v); }

// ---- float, scalar and vector ---------------------------------------------------------------------------------------

// atan t for t in [0, 1] as t + t^3 P(t^2), P by Remez in relative error (1.1e-7; two terms more would give 2.6e-9).
template <class V>
OVT_INLINE V atan_of_octant(V t) {
  const V z = t * t;
  V p(-0.00482305931f);
  p = p * z + V(0.0247360021f);
  p = p * z + V(-0.06020597f);
  p = p * z + V(0.0996868163f);
  p = p * z + V(-0.140414074f);
  p = p * z + V(0.199742287f);
  p = p * z + V(-0.333323926f);
  return t + t * (z * p);
}

// Angle of (x, y) for x >= 0 and y >= 0, given the longer of the two. The subtractions from pi/2 and pi add the part of
// each constant that float cannot hold.
template <class V>
OVT_INLINE V angle_in_quarter(V y, V x, V longer) {
  const V angle = atan_of_octant(min_of(x, y) / longer);
  return select(y > x, V(kHalfPiF) - (angle + V(kHalfPiF * 2.78275199e-8f)), angle);
}

// The angle in [-pi, pi] of (x, y), from the angle of (|x|, |y|).
template <class V>
OVT_INLINE V turn_all_round(V angle, V y, V x) {
  const V zero(0.0f);
  const V turned = select(x < zero, V(kPiF) - (angle + V(kPiF * 2.78275199e-8f)), angle);
  return select(y < zero, zero - turned, turned);
}

// Angle of (x, y) in [-pi, pi] from |x|, |y| and the longer of these, which must be above 0.
template <class V>
OVT_INLINE V angle_all_round(V y, V x, V abs_y, V abs_x, V longer) {
  return turn_all_round(angle_in_quarter(abs_y, abs_x, longer), y, x);
}

// Angle of (x, y) in [-pi, pi], error <= 3.5 ulp for all finite arguments. (0, 0) gives 0. The sign of y is tested as
// y < 0, so -0.0 acts as 0.0: atan2(-0, -1) = +pi, and a zero result is +0.
template <class V>
OVT_INLINE V atan2_of(V y, V x) {
  const V abs_x = abs_of(x), abs_y = abs_of(y);
  const V longer = max_of(abs_x, abs_y);
  return angle_all_round(y, x, abs_y, abs_x, select(longer > V(0.0f), longer, V(1.0f)));
}

// The same result for x >= 0 and y >= 0, with fewer operations.
template <class V>
OVT_INLINE V atan2_quarter_of(V y, V x) {
  const V longer = max_of(x, y);
  return angle_in_quarter(y, x, select(longer > V(0.0f), longer, V(1.0f)));
}

// The same result for coordinates that are 0 or at least `least` > 0 in size.
template <class V>
OVT_INLINE V atan2_of(V y, V x, float least) {
  const V abs_x = abs_of(x), abs_y = abs_of(y);
  return angle_all_round(y, x, abs_y, abs_x, max_of(max_of(abs_x, abs_y), V(least)));
}

// The same result for x >= 0, except for (0, 0), whose result is unspecified.
template <class V>
OVT_INLINE V atan2_half_of(V y, V x) {
  const V zero(0.0f), abs_y = abs_of(y);
  const V angle = angle_in_quarter(abs_y, x, max_of(x, abs_y));
  return select(y < zero, zero - angle, angle);
}

// The integer nearest to v (ties to even), |v| < 2^22: after adding 1.5 * 2^23 a float has no fraction bits left.
template <class V>
OVT_INLINE V round_of(V v) {
  return (v + V(12582912.0f)) - V(12582912.0f);
}

// s = sin a, c = cos a for |a| <= 1000, absolute error <= 1.2e-7 (2^-23).
//   a = k pi/2 + r with pi/2 in three parts, the first two so short that k times them is exact (Cody & Waite 1980).
template <class V>
OVT_INLINE void sin_cos_of(V a, V& s, V& c) {
  const V zero(0.0f);
  const V k = round_of(a * V(0.636619772f));
  const V r = ((a - k * V(1.5703125f)) - k * V(0.0004838109016418457f)) - k * V(1.58932547e-8f);
  const V z = r * r;
  V ps(-0.000195036278f);
  ps = ps * z + V(0.00833209883f);
  ps = ps * z + V(-0.166666552f);
  const V sin_r = r + r * (z * ps);
  V pc(2.44380917e-5f);
  pc = pc * z + V(-0.00138873642f);
  pc = pc * z + V(0.0416666456f);
  const V cos_r = V(1.0f) - (V(0.5f) * z - z * z * pc);
  // q = k modulo 4 as -2, -1, 0, 1 or 2. Odd quarters swap sine and cosine.
  const V q = k - V(4.0f) * round_of(k * V(0.25f));
  const V size = abs_of(q);
  const V one_quarter = V(1.0f) - abs_of(size - V(1.0f));  // 1 in odd quarters, 0 in even ones
  const auto odd = one_quarter > V(0.5f);
  const V sin_u = select(odd, cos_r, sin_r);
  const V cos_u = select(odd, sin_r, cos_r);
  const V sin_n = zero - sin_u, cos_n = zero - cos_u;
  s = select(q < V(-0.5f), sin_n, select(q > V(1.5f), sin_n, sin_u));  // -2, -1, 2
  c = select(q > V(0.5f), cos_n, select(q < V(-1.5f), cos_n, cos_u));  // 1, 2, -2
}

// The same for |a| <= pi/2 (elevations, column pitches) at half the cost; absolute error <= 1.8e-7 (1.5 * 2^-23). The
// sine's error is also <= 2 ulp of the sine, so sines of small angles keep their digits.
template <class V>
OVT_INLINE void sin_cos_small_of(V a, V& s, V& c) {
  const V z = a * a;
  V ps(2.60575075e-6f);
  ps = ps * z + V(-0.000198095906f);
  ps = ps * z + V(0.00833306648f);
  ps = ps * z + V(-0.166666597f);
  s = a + a * (z * ps);
  V pc(-2.62976926e-7f);
  pc = pc * z + V(2.47753524e-5f);
  pc = pc * z + V(-0.00138886797f);
  pc = pc * z + V(0.0416666605f);
  c = V(1.0f) - (V(0.5f) * z - z * z * pc);
}

OVT_INLINE float atan2_f32(float y, float x) { return atan2_of(y, x); }
OVT_INLINE float atan2_quarter_f32(float y, float x) { return atan2_quarter_of(y, x); }
OVT_INLINE void sin_cos_f32(float a, float& s, float& c) { sin_cos_of(a, s, c); }
OVT_INLINE void sin_cos_small_f32(float a, float& s, float& c) { sin_cos_small_of(a, s, c); }

// ---- double, scalar -------------------------------------------------------------------------------------------------

// Angle of (x, y) in [-pi, pi], error <= 2 ulp. Zeros as in atan2_of.
//   atan t = atan c + atan((t - c) / (1 + t c)) with c the nearest of 1/4, 1/2, 3/4, 1: the second term's argument is
//   within 1/8. Below 3/16 the Taylor series takes t itself, because subtracting larger angles would lose digits there.
inline double atan2_f64(double y, double x) {
  static constexpr double kAtan[5] = {0.0, 0.24497866312686414, 0.46364760900080609, 0.64350110879328437,
                                      0.78539816339744828};
  const double ax = std::fabs(x), ay = std::fabs(y);
  const bool steep = ay > ax;
  const double longer = steep ? ay : ax, shorter = steep ? ax : ay;
  const double t = longer > 0.0 ? shorter / longer : 0.0;
  if (!(longer > 0.0 && t <= 1.0)) return 0.0;  // the origin, and infinite or NaN arguments
  const int32_t quarter = t < 0.1875 ? 0 : int32_t(t * 4.0 + 0.5);
  const double c = 0.25 * quarter;
  const double u = quarter == 0 ? t : (t - c) / (1.0 + t * c);
  const double z = u * u;
  double p = 1.0 / 23.0;
  for (double n = 21.0; n >= 3.0; n -= 2.0) p = 1.0 / n - z * p;
  const double angle = kAtan[quarter] + (u - u * (z * p));
  const bool backwards = x < 0.0;
  const double base = steep ? kHalfPi : backwards ? kPi : 0.0;
  const double turned = base + ((steep != backwards ? -angle : angle) + base * 3.8981718325193755e-17);
  return y < 0.0 ? -turned : turned;
}

// s = sin a, c = cos a for |a| <= 1.6e6, error <= 2 ulp. Taylor series on |r| <= pi/4 after a = k pi/2 + r with pi/2 in
// three parts of at most 33 bits, so that k times each of the first two is exact. Beyond 1.6e6, and for NaN: NaN.
inline void sin_cos_f64(double a, double& s, double& c) {
  if (!(std::fabs(a) <= 1.6e6)) {
    s = c = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  const double turns = a * 0.63661977236758134;
  const int64_t k = int64_t(turns < 0.0 ? turns - 0.5 : turns + 0.5);
  const double kd = double(k);
  const double high = a - kd * 1.5707963267341256, middle = kd * 6.077100506303966e-11, near = high - middle;
  const double r = near + (((high - near) - middle) - kd * 2.0222662487959506e-21);  // adds near's rounding error
  const double z = r * r;
  double ps = 1.0 / 355687428096000.0;  // 1/17!
  ps = ps * z - 1.0 / 1307674368000.0;  // 1/15!
  ps = ps * z + 1.0 / 6227020800.0;     // 1/13!
  ps = ps * z - 1.0 / 39916800.0;       // 1/11!
  ps = ps * z + 1.0 / 362880.0;         // 1/9!
  ps = ps * z - 1.0 / 5040.0;           // 1/7!
  ps = ps * z + 1.0 / 120.0;            // 1/5!
  ps = ps * z - 1.0 / 6.0;              // 1/3!
  const double sin_r = r + r * (z * ps);
  double pc = 1.0 / 20922789888000.0;  // 1/16!
  pc = pc * z - 1.0 / 87178291200.0;   // 1/14!
  pc = pc * z + 1.0 / 479001600.0;     // 1/12!
  pc = pc * z - 1.0 / 3628800.0;       // 1/10!
  pc = pc * z + 1.0 / 40320.0;         // 1/8!
  pc = pc * z - 1.0 / 720.0;           // 1/6!
  pc = pc * z + 1.0 / 24.0;            // 1/4!
  const double half_z = 0.5 * z, near_one = 1.0 - half_z;
  const double cos_r = near_one + (((1.0 - near_one) - half_z) + z * z * pc);  // 1 - z/2 plus its rounding error
  switch (k & 3) {
    case 0:
      s = sin_r;
      c = cos_r;
      break;
    case 1:
      s = cos_r;
      c = -sin_r;
      break;
    case 2:
      s = -sin_r;
      c = -cos_r;
      break;
    default:
      s = -cos_r;
      c = sin_r;
      break;
  }
}

// sin_cos_f64 for V = double, or a vector of doubles: the same bytes for |a| <= 1.6e6. Beyond, and for NaN: NaN.
template <class V>
OVT_INLINE void sin_cos_f64_of(V a, V& s, V& c) {
  const V turns = a * V(0.63661977236758134);
  // The integer nearest to |turns|, halves up: adding 2^52 rounds to an integer, and one too large is corrected.
  const V half_up = abs_of(turns) + V(0.5);
  const V rounded = (half_up + V(4503599627370496.0)) - V(4503599627370496.0);
  const V whole = select(rounded > half_up, rounded - V(1.0), rounded);
  const V kd = select(turns < V(0.0), V(0.0) - whole, whole);
  const V high = a - kd * V(1.5707963267341256), middle = kd * V(6.077100506303966e-11), near = high - middle;
  const V r = near + (((high - near) - middle) - kd * V(2.0222662487959506e-21));
  const V z = r * r;
  V ps(1.0 / 355687428096000.0);
  ps = ps * z - V(1.0 / 1307674368000.0);
  ps = ps * z + V(1.0 / 6227020800.0);
  ps = ps * z - V(1.0 / 39916800.0);
  ps = ps * z + V(1.0 / 362880.0);
  ps = ps * z - V(1.0 / 5040.0);
  ps = ps * z + V(1.0 / 120.0);
  ps = ps * z - V(1.0 / 6.0);
  const V sin_r = r + r * (z * ps);
  V pc(1.0 / 20922789888000.0);
  pc = pc * z - V(1.0 / 87178291200.0);
  pc = pc * z + V(1.0 / 479001600.0);
  pc = pc * z - V(1.0 / 3628800.0);
  pc = pc * z + V(1.0 / 40320.0);
  pc = pc * z - V(1.0 / 720.0);
  pc = pc * z + V(1.0 / 24.0);
  const V half_z = V(0.5) * z, near_one = V(1.0) - half_z;
  const V cos_r = near_one + (((V(1.0) - near_one) - half_z) + z * z * pc);
  // Quarter turns modulo 4, from -2 to 2.
  const V fourth = kd * V(0.25);
  const V q = kd - V(4.0) * ((fourth + V(6755399441055744.0)) - V(6755399441055744.0));
  const V one_quarter = V(1.0) - abs_of(abs_of(q) - V(1.0));  // 1 in odd quarters, 0 in even ones
  const auto odd = one_quarter > V(0.5);
  const V sin_u = select(odd, cos_r, sin_r), cos_u = select(odd, sin_r, cos_r);
  // Times -1, not 0 - x: a zero keeps the sign that sin_cos_f64 gives it.
  const V sin_n = sin_u * V(-1.0), cos_n = cos_u * V(-1.0);
  const V none(std::numeric_limits<double>::quiet_NaN());
  const auto in_range = abs_of(a) <= V(1.6e6);
  s = select(in_range, select(q < V(-0.5), sin_n, select(q > V(1.5), sin_n, sin_u)), none);
  c = select(in_range, select(q > V(0.5), cos_n, select(q < V(-1.5), cos_n, cos_u)), none);
}

// Natural logarithm of a normal x > 0, error <= 2 ulp. x = 2^e m with m in [sqrt 1/2, sqrt 2); with s = (m-1)/(m+1):
// log m = 2 atanh s = 2 (s + s^3/3 + s^5/5 + ...). Any other x gives NaN.
inline double log_f64(double x) {
  if (!(x >= std::numeric_limits<double>::min() && x <= std::numeric_limits<double>::max()))
    return std::numeric_limits<double>::quiet_NaN();
  const uint64_t bits = std::bit_cast<uint64_t>(x);
  int32_t e = int32_t(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0xfffffffffffffu) | 0x3ff0000000000000u);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    ++e;
  }
  const double f = m - 1.0, s = f / (2.0 + f), z = s * s;
  double p = 2.0 / 23.0;
  for (double n = 21.0; n >= 3.0; n -= 2.0) p = p * z + 2.0 / n;
  // 2 s = f - s f, and s f = f^2/2 - s f^2/2: f holds most digits, the other terms are a small correction.
  const double half_f2 = 0.5 * f * f;
  const double correction = half_f2 - s * (half_f2 + z * p);
  return double(e) * 0.6931471803691238 + (f - (correction - double(e) * 1.9082149292705877e-10));
}

// e^x for |x| <= 700, error <= 2 ulp. Taylor series on |r| <= (ln 2)/2 after x = k ln 2 + r with ln 2 in two parts, so
// that k times the first is exact. Beyond 700, and for NaN: NaN.
inline double exp_f64(double x) {
  if (!(std::fabs(x) <= 700.0)) return std::numeric_limits<double>::quiet_NaN();
  const double turns = x * 1.4426950408889634;
  const int64_t k = int64_t(turns < 0.0 ? turns - 0.5 : turns + 0.5);
  const double high = x - double(k) * 0.6931471803691238, low = double(k) * 1.9082149292705877e-10;
  const double r = high - low;
  double p = 1.0 / 6227020800.0;  // 1/13!
  p = p * r + 1.0 / 479001600.0;  // 1/12!
  p = p * r + 1.0 / 39916800.0;   // 1/11!
  p = p * r + 1.0 / 3628800.0;    // 1/10!
  p = p * r + 1.0 / 362880.0;     // 1/9!
  p = p * r + 1.0 / 40320.0;      // 1/8!
  p = p * r + 1.0 / 5040.0;       // 1/7!
  p = p * r + 1.0 / 720.0;        // 1/6!
  p = p * r + 1.0 / 120.0;        // 1/5!
  p = p * r + 1.0 / 24.0;         // 1/4!
  p = p * r + 1.0 / 6.0;          // 1/3!
  p = p * r + 0.5;
  const double rounding = (high - r) - low;  // of r
  const double of_r = 1.0 + (r + (r * r * p + rounding));
  return of_r * std::bit_cast<double>(uint64_t(k + 1023) << 52);
}

// The same angle in (-pi, pi]. An angle already in this range is unchanged. Exact to an ulp of `a` up to |a| = 1.6e6,
// less exact beyond. NaN, and |a| above 1e15 (where a turn is smaller than an ulp), give NaN.
inline double wrap_angle(double a) {
  if (a > -kPi && a <= kPi) return a;
  if (!(std::fabs(a) <= 1e15)) return std::numeric_limits<double>::quiet_NaN();
  double r;
  if (std::fabs(a) <= 3.0 * kPi) {  // the common case; -pi becomes pi
    r = a > 0.0 ? a - kTwoPi : a + kTwoPi;
  } else {
    const double turns = a * 0.15915494309189535;
    const double k = double(int64_t(turns < 0.0 ? turns - 0.5 : turns + 0.5));
    r = ((a - k * 6.2831853069365025) - k * 2.4308402025215864e-10) - k * 8.0890649951838024e-21;
  }
  if (r > kPi) r -= kTwoPi;
  if (r <= -kPi) r += kTwoPi;
  return r;
}

// wrap_angle for V = double, or a vector of doubles, with the same bytes for |a| <= 3 pi; for NaN: NaN.
template <class V>
OVT_INLINE V wrap_once_of(V a) {
  const V pi(kPi), turn(kTwoPi), back(-kPi);
  const V once = select(a > V(0.0), a - turn, a + turn);
  const V above = select(once > pi, once - turn, once);
  const V within = select(above <= back, above + turn, above);
  return select(a > pi, within, select(a <= back, within, a));
}

inline float wrap_angle(float a) {
  if (a > -kPiF && a <= kPiF) return a;
  const float r = float(wrap_angle(double(a)));
  return r <= -kPiF ? kPiF : r;
}

// sin x / x, and 1 at 0. Below 0.1 it uses the series, whose first omitted term is x^10/11! < 3e-18.
inline double sinc(double x) {
  if (std::fabs(x) < 0.1) {
    const double z = x * x;
    return 1.0 - z / 6.0 * (1.0 - z / 20.0 * (1.0 - z / 42.0 * (1.0 - z / 72.0)));
  }
  double s, c;
  sin_cos_f64(x, s, c);
  return s / x;
}

// Plain square root of the sum of squares. It has no guard against overflow: the arguments are metres.
inline double hypot_f64(double x, double y) { return std::sqrt(x * x + y * y); }

}  // namespace overtake
