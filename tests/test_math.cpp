// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The project's elementary functions against long double libm: bounds as in core/math.h.
#include "core/math.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <type_traits>

namespace overtake {
namespace {

using Wide = long double;

// |got - want| in units of the last place of `want`, for T = float or double.
template <class T>
double ulps(T got, Wide want) {
  constexpr int kDigits = std::numeric_limits<T>::digits;
  constexpr int kLowest = std::numeric_limits<T>::min_exponent - kDigits;
  const int exponent = want == 0 ? kLowest : std::max(std::ilogb(want) - kDigits + 1, kLowest);
  return double(std::fabs(Wide(got) - want) / std::ldexp(Wide(1), exponent));
}

// A value with random sign and size 2^-range .. 2^range.
template <class T, class Random>
T any_size(Random& random, double range) {
  std::uniform_real_distribution<double> exponent(-range, range);
  return T((random() & 1 ? 1.0 : -1.0) * std::exp2(exponent(random)));
}

TEST_CASE("math: atan2_f32 is within 3.5 ulp everywhere") {
  const unsigned seed = 1;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turn(-3.2, 3.2), near_one(-1e-3, 1e-3), place(-200.0, 200.0);
  double worst = 0.0;
  float worst_y = 0, worst_x = 0;
  const auto look = [&](float y, float x) {
    const double error = ulps(atan2_f32(y, x), std::atan2(Wide(y), Wide(x)));
    if (error > worst) worst = error, worst_y = y, worst_x = x;
  };
  for (int i = 0; i < 1000000; ++i) {
    const double a = turn(random);
    look(float(80.0 * std::sin(a)), float(80.0 * std::cos(a)));
    look(float(place(random)), float(place(random)));
    look(any_size<float>(random, 126.0), any_size<float>(random, 126.0));
    const float v = any_size<float>(random, 60.0);
    look(v, float(double(v) * (1.0 + near_one(random))));  // the edge of the octant
    look(v, float(-double(v) * (1.0 + near_one(random))));
  }
  const float edges[] = {1e-45f, 1.17549435e-38f, 1e-20f, 0.5f, 1.0f, 3.0f, 1e20f, 3.40282347e38f};
  for (const float a : edges)
    for (const float b : edges)
      for (const float sy : {-1.0f, 1.0f})
        for (const float sx : {-1.0f, 1.0f}) look(sy * a, sx * b);
  CAPTURE(worst_y);
  CAPTURE(worst_x);
  MESSAGE("atan2_f32: worst error " << worst << " ulp");
  CHECK(worst <= 3.5);
}

TEST_CASE("math: atan2 on the axes is 0 for the origin, and pi behind for either sign of zero") {
  CHECK(atan2_f32(0.0f, 0.0f) == 0.0f);
  CHECK(atan2_f32(0.0f, -1.0f) == kPiF);
  CHECK(atan2_f32(-0.0f, -1.0f) == kPiF);
  CHECK(atan2_f32(1.0f, 0.0f) == kHalfPiF);
  CHECK(atan2_f32(-1.0f, 0.0f) == -kHalfPiF);
  CHECK(atan2_f32(-1.0f, -0.0f) == -kHalfPiF);
  CHECK_FALSE(std::signbit(atan2_f32(-0.0f, 1.0f)));
  CHECK_FALSE(std::signbit(atan2_f32(-0.0f, 0.0f)));
  CHECK(atan2_f64(0.0, 0.0) == 0.0);
  CHECK(atan2_f64(0.0, -1.0) == kPi);
  CHECK(atan2_f64(-0.0, -1.0) == kPi);
  CHECK(atan2_f64(1.0, 0.0) == kHalfPi);
  CHECK(atan2_f64(-1.0, 0.0) == -kHalfPi);
  CHECK(atan2_f64(2.0, 2.0) == kHalfPi / 2);
}

TEST_CASE("math: sin_cos_f32 is within 2^-23 up to a thousand radians") {
  const unsigned seed = 2;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> few(-26.0f, 26.0f), many(-1000.0f, 1000.0f);
  std::uniform_int_distribution<int> quarter(-600, 600);
  double worst = 0.0;
  float worst_a = 0;
  const auto look = [&](float a) {
    float s, c;
    sin_cos_f32(a, s, c);
    const double error =
        double(std::max(std::fabs(Wide(s) - std::sin(Wide(a))), std::fabs(Wide(c) - std::cos(Wide(a)))));
    if (error > worst) worst = error, worst_a = a;
  };
  for (int i = 0; i < 1000000; ++i) {
    look(few(random));
    look(many(random));
    look(float(quarter(random) * kHalfPi + 1e-4 * double(few(random))));          // where the sine or cosine is zero
    look(float((quarter(random) + 0.5) * kHalfPi + 1e-6 * double(few(random))));  // where the quarter changes
  }
  look(0.0f);
  CAPTURE(worst_a);
  MESSAGE("sin_cos_f32: worst error " << worst << " (2^-23 = 1.19e-7)");
  CHECK(worst <= 1.2e-7);
}

TEST_CASE("math: sin_cos_small_f32 is within 1.8e-7, its sine within 2 ulp, up to a quarter turn") {
  double worst = 0.0, worst_sine = 0.0;
  for (int i = -1000000; i <= 1000000; ++i) {
    const float a = float(i * (kHalfPi / 1000000));
    float s, c;
    sin_cos_small_f32(a, s, c);
    worst = std::max(worst, double(std::fabs(Wide(s) - std::sin(Wide(a)))));
    worst = std::max(worst, double(std::fabs(Wide(c) - std::cos(Wide(a)))));
    worst_sine = std::max(worst_sine, ulps(s, std::sin(Wide(a))));
  }
  MESSAGE("sin_cos_small_f32: worst error " << worst << ", sine " << worst_sine << " ulp");
  CHECK(worst <= 1.8e-7);
  CHECK(worst_sine <= 2.0);
}

// A value type other than float, like a SIMD vector.
struct Lanes {
  float v[2];
  explicit Lanes(float a) : v{a, a} {}
  Lanes(float a, float b) : v{a, b} {}
};
struct Mask {
  bool v[2];
};
Lanes operator+(Lanes a, Lanes b) { return {a.v[0] + b.v[0], a.v[1] + b.v[1]}; }
Lanes operator-(Lanes a, Lanes b) { return {a.v[0] - b.v[0], a.v[1] - b.v[1]}; }
Lanes operator*(Lanes a, Lanes b) { return {a.v[0] * b.v[0], a.v[1] * b.v[1]}; }
Lanes operator/(Lanes a, Lanes b) { return {a.v[0] / b.v[0], a.v[1] / b.v[1]}; }
Mask operator<(Lanes a, Lanes b) { return {{a.v[0] < b.v[0], a.v[1] < b.v[1]}}; }
Mask operator>(Lanes a, Lanes b) { return {{a.v[0] > b.v[0], a.v[1] > b.v[1]}}; }
Lanes select(Mask m, Lanes a, Lanes b) { return {m.v[0] ? a.v[0] : b.v[0], m.v[1] ? a.v[1] : b.v[1]}; }
Lanes abs_of(Lanes a) { return {std::fabs(a.v[0]), std::fabs(a.v[1])}; }
Lanes min_of(Lanes a, Lanes b) { return select(a < b, a, b); }
Lanes max_of(Lanes a, Lanes b) { return select(a > b, a, b); }

TEST_CASE("math: the float templates give the same bits with a vector type") {
  const unsigned seed = 3;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> any(-9.0f, 9.0f);
  for (int i = 0; i < 10000; ++i) {
    const Lanes y(any(random), any(random)), x(any(random), any(random));
    const Lanes a = atan2_of(y, x);
    Lanes s(0.0f), c(0.0f), small_s(0.0f), small_c(0.0f);
    sin_cos_of(y, s, c);
    sin_cos_small_of(a, small_s, small_c);
    for (int k = 0; k < 2; ++k) {
      float want_s, want_c;
      REQUIRE(a.v[k] == atan2_f32(y.v[k], x.v[k]));
      sin_cos_f32(y.v[k], want_s, want_c);
      REQUIRE(s.v[k] == want_s);
      REQUIRE(c.v[k] == want_c);
      sin_cos_small_f32(a.v[k], want_s, want_c);
      REQUIRE(small_s.v[k] == want_s);
      REQUIRE(small_c.v[k] == want_c);
    }
  }
}

TEST_CASE("math: atan2_f64 of invalid coordinates is 0") {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  for (double y : {infinity, -infinity, nan})
    for (double x : {infinity, -infinity, nan}) CHECK(atan2_f64(y, x) == 0.0);
  CHECK(atan2_f64(nan, 1.0) == 0.0);
  CHECK(atan2_f64(1.0, nan) == 0.0);
}

TEST_CASE("math: atan2_f64 is within 2 ulp everywhere") {
  const unsigned seed = 4;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-200.0, 200.0), near_one(-1e-3, 1e-3);
  std::uniform_int_distribution<int> eighth(0, 8);
  double worst = 0.0, worst_y = 0, worst_x = 0;
  const auto look = [&](double y, double x) {
    const double error = ulps(atan2_f64(y, x), std::atan2(Wide(y), Wide(x)));
    if (error > worst) worst = error, worst_y = y, worst_x = x;
  };
  for (int i = 0; i < 500000; ++i) {
    look(place(random), place(random));
    look(any_size<double>(random, 500.0), any_size<double>(random, 500.0));
    const double x = place(random);
    look(x * (eighth(random) / 8.0 + near_one(random)), x);  // where the table's entry changes
    look(x * (eighth(random) / 8.0 + near_one(random)), -x);
  }
  CAPTURE(worst_y);
  CAPTURE(worst_x);
  MESSAGE("atan2_f64: worst error " << worst << " ulp");
  CHECK(worst <= 2.0);
}

TEST_CASE("math: sin_cos_f64 is within 2 ulp") {
  const unsigned seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> few(-7.0, 7.0), many(-1.6e6, 1.6e6);
  std::uniform_int_distribution<int> quarter(-1000, 1000);
  double worst = 0.0, worst_a = 0.0;
  const auto look = [&](double a) {
    double s, c;
    sin_cos_f64(a, s, c);
    const double error = std::max(ulps(s, std::sin(Wide(a))), ulps(c, std::cos(Wide(a))));
    if (error > worst) worst = error, worst_a = a;
  };
  for (int i = 0; i < 500000; ++i) {
    look(few(random));
    look(many(random));
    look(any_size<double>(random, 20.0));
    look(quarter(random) * kHalfPi + 1e-5 * few(random));
  }
  CAPTURE(worst_a);
  MESSAGE("sin_cos_f64: worst error " << worst << " ulp");
  CHECK(worst <= 2.0);
  double s, c;
  sin_cos_f64(0.0, s, c);
  CHECK(s == 0.0);
  CHECK(c == 1.0);
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    sin_cos_f64(bad, s, c);
    CHECK(std::isnan(s));
    CHECK(std::isnan(c));
  }
}

TEST_CASE("math: the forms of sin_cos_f64 and wrap_angle for vectors give the same bytes") {
  const auto same = [](double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; };
  std::mt19937_64 random(9);
  int32_t differences = 0;
  const auto check = [&](double a) {
    double s, c, vector_s, vector_c;
    sin_cos_f64(a, s, c);
    sin_cos_f64_of(a, vector_s, vector_c);
    differences += !same(s, vector_s) || !same(c, vector_c);
    if (std::fabs(a) <= 3.0 * kPi) differences += !same(wrap_angle(a), wrap_once_of(a));
  };
  for (int n = 0; n < 1000000; ++n) {
    const double unit = double(int64_t(random() >> 11)) / double(int64_t(1) << 52) - 1.0;
    for (const double size : {1e-9, 1.0, 10.0, 1e3, 1.6e6}) check(size * unit);
  }
  for (int k = -12; k <= 12; ++k)
    for (const double a :
         {k * kHalfPi, std::nextafter(k * kHalfPi, 1e9), std::nextafter(k * kHalfPi, -1e9), k * kHalfPi / 2})
      check(a);
  check(-0.0);
  CHECK(differences == 0);
  double s, c;
  for (const double a : {1.7e6, double(INFINITY), -double(INFINITY), double(NAN)}) {
    sin_cos_f64_of(a, s, c);
    CHECK(std::isnan(s));
    CHECK(std::isnan(c));
  }
}

TEST_CASE("math: log_f64 is within 2 ulp, and NaN where no logarithm exists") {
  const unsigned seed = 6;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> near_one(0.5, 2.0), close(-1e-3, 1e-3);
  double worst = 0.0, worst_x = 0.0;
  const auto look = [&](double x) {
    const double error = ulps(log_f64(x), std::log(Wide(x)));
    if (error > worst) worst = error, worst_x = x;
  };
  for (int i = 0; i < 500000; ++i) {
    look(std::fabs(any_size<double>(random, 1021.0)));
    look(near_one(random));
    look(1.0 + close(random));
  }
  look(std::numeric_limits<double>::min());
  look(std::numeric_limits<double>::max());
  CAPTURE(worst_x);
  MESSAGE("log_f64: worst error " << worst << " ulp");
  CHECK(worst <= 2.0);
  CHECK(log_f64(1.0) == 0.0);
  for (const double bad :
       {0.0, -1.0, 1e-310, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    CHECK(std::isnan(log_f64(bad)));
}

TEST_CASE("math: exp_f64 is within 2 ulp, and NaN beyond 700") {
  const unsigned seed = 8;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-700.0, 700.0), score(-10.0, 10.0), small(-1e-3, 1e-3);
  std::uniform_int_distribution<int> half(-2000, 2000);
  double worst = 0.0, worst_x = 0.0;
  const auto look = [&](double x) {
    const double error = ulps(exp_f64(x), std::exp(Wide(x)));
    if (error > worst) worst = error, worst_x = x;
  };
  for (int i = 0; i < 500000; ++i) {
    look(any(random));
    look(score(random));
    look(small(random));
    const double edge = (half(random) / 2 + 0.5) * 0.69314718055994531;  // where k changes
    look(std::nextafter(edge, 1e3));
    look(std::nextafter(edge, -1e3));
  }
  look(700.0);
  look(-700.0);
  CAPTURE(worst_x);
  MESSAGE("exp_f64: worst error " << worst << " ulp");
  CHECK(worst <= 2.0);
  CHECK(exp_f64(0.0) == 1.0);
  for (const double bad :
       {700.5, -701.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    CHECK(std::isnan(exp_f64(bad)));
}

TEST_CASE("math: wrap_angle gives (-pi, pi], keeps angles in this range, and changes only by whole turns") {
  CHECK(wrap_angle(kPi) == kPi);
  CHECK(wrap_angle(-kPi) == kPi);
  CHECK(wrap_angle(0.25) == 0.25);
  CHECK(wrap_angle(kPiF) == kPiF);
  CHECK(wrap_angle(-kPiF) == doctest::Approx(kPi));
  CHECK(wrap_angle(std::nextafter(-kPi, -4.0)) == doctest::Approx(kPi));
  CHECK(std::isnan(wrap_angle(std::numeric_limits<double>::infinity())));
  CHECK(std::isnan(wrap_angle(std::numeric_limits<double>::quiet_NaN())));
  const unsigned seed = 7;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> many(-1.6e6, 1.6e6), few(-20.0, 20.0);
  std::uniform_int_distribution<int> turn(-9, 9);
  for (int i = 0; i < 200000; ++i) {
    const double edge = (2 * turn(random) + 1) * kPi;
    for (const double a :
         {few(random), many(random), edge, std::nextafter(edge, 100.0), std::nextafter(edge, -100.0)}) {
      CAPTURE(a);
      const double r = wrap_angle(a);
      REQUIRE(r > -kPi);
      REQUIRE(r <= kPi);
      const Wide turns = (Wide(a) - Wide(r)) / (2 * std::acos(Wide(-1)));
      REQUIRE(double(std::fabs(turns - std::round(turns))) < 1e-15 + 3e-16 * std::fabs(a));
      const float f = wrap_angle(float(a));
      REQUIRE(f > -kPiF);
      REQUIRE(f <= kPiF);
      const double apart = std::fabs(double(f) - wrap_angle(double(float(a))));
      REQUIRE(std::min(apart, kTwoPi - apart) < 4e-7);
    }
  }
}

TEST_CASE("math: sinc is sin x / x, one at zero, without a step between its two forms") {
  CHECK(sinc(0.0) == 1.0);
  double worst = 0.0;
  for (int i = 1; i <= 400000; ++i) {
    const double x = i * 1e-5;
    const Wide want = std::sin(Wide(x)) / Wide(x);
    worst = std::max(worst, double(std::fabs(Wide(sinc(x)) - want)));
    REQUIRE(sinc(-x) == sinc(x));
  }
  MESSAGE("sinc: worst error " << worst);
  CHECK(worst < 3e-16);
  CHECK(sinc(1e-160) == 1.0);
}

TEST_CASE("math: hypot_f64 of a 3-4-5 triangle is exact") { CHECK(hypot_f64(3.0, 4.0) == 5.0); }

}  // namespace
}  // namespace overtake
