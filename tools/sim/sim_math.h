// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The simulator's elementary functions: double, made only of + - * / and sqrt, so that one seed gives the same bytes on
// every machine and compiler (build with -ffp-contract=off). They share nothing with core/math.h, because the simulator
// is used to test the library.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

namespace overtake::sim {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180;
inline constexpr double kGravity = 9.80665;

inline double square(double v) { return v * v; }
inline double clamp(double v, double low, double high) { return v < low ? low : v > high ? high : v; }
inline double lerp(double a, double b, double share) { return a + (b - a) * share; }

// The angle in [-pi, pi].
inline double wrap_angle(double a) { return a - 2 * kPi * std::floor(a / (2 * kPi) + 0.5); }

struct SinCos {
  double sin, cos;
};

// Taylor series on [-pi/4, pi/4] after a reduction in two parts; |angle| up to 1e5: absolute error about 1e-14.
inline SinCos sin_cos(double angle) {
  const double turns = std::floor(angle * (2 / kPi) + 0.5);
  const double r = (angle - turns * 1.57079632673412561417) - turns * 6.07710050650619224932e-11;
  const double z = r * r;
  double s = -7.6471637318198164e-13;
  s = s * z + 1.6059043836821613e-10;
  s = s * z - 2.5052108385441720e-8;
  s = s * z + 2.7557319223985893e-6;
  s = s * z - 1.9841269841269841e-4;
  s = s * z + 8.3333333333333333e-3;
  s = s * z - 1.6666666666666667e-1;
  s = r + r * z * s;
  double c = 4.7794773323873853e-14;
  c = c * z - 1.1470745597729725e-11;
  c = c * z + 2.0876756987868099e-9;
  c = c * z - 2.7557319223985891e-7;
  c = c * z + 2.4801587301587302e-5;
  c = c * z - 1.3888888888888889e-3;
  c = c * z + 4.1666666666666667e-2;
  c = 1 - 0.5 * z + z * z * c;
  switch (int64_t(turns) & 3) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}
inline double sin_of(double a) { return sin_cos(a).sin; }
inline double cos_of(double a) { return sin_cos(a).cos; }
inline double tan_of(double a) {
  const SinCos sc = sin_cos(a);
  return sc.sin / sc.cos;
}

// Two halvings of the argument, then the series: relative error below 1e-15.
inline double atan_of(double t) {
  if (t < 0) return -atan_of(-t);
  if (t > 1) return kPi / 2 - atan_of(1 / t);
  const double h1 = t / (1 + std::sqrt(1 + t * t));
  const double h2 = h1 / (1 + std::sqrt(1 + h1 * h1));
  const double z = h2 * h2;
  double p = 0;
  for (int k = 23; k >= 1; k -= 2) p = (k % 4 == 1 ? 1.0 : -1.0) / k + z * p;
  return 4 * h2 * p;
}
inline double atan2_of(double y, double x) {
  if (x == 0 && y == 0) return 0;
  if (std::fabs(y) > std::fabs(x)) return (y > 0 ? kPi / 2 : -kPi / 2) - atan_of(x / y);
  const double a = atan_of(y / x);
  return x >= 0 ? a : y >= 0 ? a + kPi : a - kPi;
}
inline double asin_of(double v) { return atan2_of(v, std::sqrt(1 - clamp(v * v, 0, 1))); }

// 2^k times a series of degree 14, even and odd powers separate: two short chains instead of a long one.
inline double exp_of(double v) {
  if (v < -700) return 0;
  if (v > 700) v = 700;
  const double k = std::floor(v * 1.44269504088896340736 + 0.5);
  const double r = (v - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10;
  const double z = r * r;
  double even = 1, odd = 1;
  for (int i = 14; i >= 2; i -= 2) {
    even = 1 + z * (1.0 / (i * (i - 1))) * even;
    if (i > 2) odd = 1 + z * (1.0 / ((i - 1) * (i - 2))) * odd;
  }
  return (even + r * odd) * std::bit_cast<double>(uint64_t(int64_t(k) + 1023) << 52);
}
inline double log_of(double v) {  // of a normal positive number
  const uint64_t bits = std::bit_cast<uint64_t>(v);
  int64_t exponent = int64_t(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & ((uint64_t(1) << 52) - 1)) | (uint64_t(1023) << 52));
  if (m > 1.41421356237309504880) m *= 0.5, ++exponent;
  const double t = (m - 1) / (m + 1), z = t * t;
  double p = 0;
  for (int k = 21; k >= 1; k -= 2) p = 1.0 / k + z * p;
  return double(exponent) * 0.69314718055994530942 + 2 * t * p;
}

// Smooth step 0..1; the first two derivatives are zero at both ends.
inline double smooth_step(double share) {
  const double t = clamp(share, 0, 1);
  return t * t * t * (10 + t * (6 * t - 15));
}

struct Vec3 {
  double x = 0, y = 0, z = 0;
  Vec3 operator+(Vec3 o) const { return {x + o.x, y + o.y, z + o.z}; }
  Vec3 operator-(Vec3 o) const { return {x - o.x, y - o.y, z - o.z}; }
  Vec3 operator*(double f) const { return {x * f, y * f, z * f}; }
};
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(Vec3 v) { return std::sqrt(dot(v, v)); }
inline Vec3 normalized(Vec3 v) { return v * (1 / length(v)); }

// Columns are the axes of the inner frame, seen from the outer one.
struct Mat3 {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Vec3 operator*(Vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  Mat3 operator*(const Mat3& o) const { return {*this * o.x, *this * o.y, *this * o.z}; }
  Vec3 transposed_times(Vec3 v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};
inline Mat3 rotation_about_z(double yaw) {
  const SinCos a = sin_cos(yaw);
  return {{a.cos, a.sin, 0}, {-a.sin, a.cos, 0}, {0, 0, 1}};
}
// Rz(yaw) Ry(pitch) Rx(roll), as in REP 103.
inline Mat3 rotation_of(double roll, double pitch, double yaw) {
  const SinCos r = sin_cos(roll), p = sin_cos(pitch);
  const Mat3 ry{{p.cos, 0, -p.sin}, {0, 1, 0}, {p.sin, 0, p.cos}}, rx{{1, 0, 0}, {0, r.cos, r.sin}, {0, -r.sin, r.cos}};
  return rotation_about_z(yaw) * (ry * rx);
}
struct RollPitchYaw {
  double roll, pitch, yaw;
};
inline RollPitchYaw angles_of(const Mat3& m) {
  return {atan2_of(m.y.z, m.z.z), -asin_of(clamp(m.x.z, -1, 1)), atan2_of(m.x.y, m.x.x)};
}

struct Rigid {  // T_outer_inner
  Mat3 rotation;
  Vec3 place;
  Vec3 operator*(Vec3 p) const { return rotation * p + place; }
  Rigid operator*(const Rigid& o) const { return {rotation * o.rotation, rotation * o.place + place}; }
  Vec3 inverse_times(Vec3 p) const { return rotation.transposed_times(p - place); }
};
// Interpolates linearly between two poses less than a few milliradians apart; the result is a rotation within 1e-7.
inline Rigid blend(const Rigid& a, const Rigid& b, double share) {
  const auto mix = [share](Vec3 u, Vec3 v) { return u + (v - u) * share; };
  return {{mix(a.rotation.x, b.rotation.x), mix(a.rotation.y, b.rotation.y), mix(a.rotation.z, b.rotation.z)},
          mix(a.place, b.place)};
}

}  // namespace overtake::sim
