// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/motion_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "core/math.h"

namespace {

using overtake::advance;
using overtake::MotionJacobian;
using overtake::MotionState;

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

MotionState make_state(std::mt19937_64& random, double max_omega) {
  return {uniform(random, -100, 100), uniform(random, -100, 100), uniform(random, -20, 90),
          uniform(random, -3.14, 3.14), uniform(random, -max_omega, max_omega)};
}

double& entry(MotionState& s, int i) {
  double* const all[5] = {&s.x_m, &s.y_m, &s.speed_mps, &s.course_rad, &s.yaw_rate_rps};
  return *all[i];
}

double wrapped(double a) { return std::remainder(a, 2 * 3.14159265358979323846); }

}  // namespace

TEST_CASE("motion model: equals the textbook form in long double") {
  std::mt19937_64 random(11);
  for (int n = 0; n < 20000; ++n) {
    MotionState s = make_state(random, 2.0);
    if (std::fabs(s.yaw_rate_rps) < 1e-3) s.yaw_rate_rps = 1e-3;  // the textbook form needs a turn
    const double dt = uniform(random, -1, 1);
    using Real = long double;
    const Real v = s.speed_mps, w = s.yaw_rate_rps, phi = s.course_rad;
    const Real x = s.x_m + v / w * (std::sin(phi + w * dt) - std::sin(phi));
    const Real y = s.y_m - v / w * (std::cos(phi + w * dt) - std::cos(phi));
    const MotionState next = advance(s, dt);
    CAPTURE(n);
    REQUIRE(next.x_m == doctest::Approx(double(x)).epsilon(1e-12));
    REQUIRE(next.y_m == doctest::Approx(double(y)).epsilon(1e-12));
    REQUIRE(std::fabs(wrapped(next.course_rad - double(phi + w * dt))) < 1e-12);
    REQUIRE(next.speed_mps == s.speed_mps);
    REQUIRE(next.yaw_rate_rps == s.yaw_rate_rps);
  }
}

TEST_CASE("motion model: equals numerical integration of eq. 6") {
  std::mt19937_64 random(12);
  for (int n = 0; n < 200; ++n) {
    const MotionState s = make_state(random, n % 2 ? 1.0 : 1e-7);
    const double dt = uniform(random, -1, 1);
    // Simpson over 200 intervals: x' = v cos(phi + w t).
    const int intervals = 200;
    double x = 0, y = 0;
    for (int k = 0; k <= intervals; ++k) {
      const double weight = k == 0 || k == intervals ? 1 : k % 2 ? 4 : 2, t = dt * k / intervals;
      x += weight * s.speed_mps * std::cos(s.course_rad + s.yaw_rate_rps * t);
      y += weight * s.speed_mps * std::sin(s.course_rad + s.yaw_rate_rps * t);
    }
    const MotionState next = advance(s, dt);
    CAPTURE(n);
    REQUIRE(std::fabs(next.x_m - (s.x_m + x * dt / intervals / 3)) < 1e-8);
    REQUIRE(std::fabs(next.y_m - (s.y_m + y * dt / intervals / 3)) < 1e-8);
  }
}

TEST_CASE("motion model: drives straight with yaw rate zero") {
  const MotionState next = advance({1, 2, 10, 0, 0}, 0.5);
  CHECK(next.x_m == 6.0);
  CHECK(next.y_m == 2.0);
  CHECK(next.course_rad == 0.0);
}

TEST_CASE("motion model: the Jacobian equals finite differences, also near yaw rate zero") {
  std::mt19937_64 random(13);
  const double omega_limits[] = {0.0, 1e-12, 1e-6, 1e-3, 0.05, 2.0, 20.0};  // 20 rad/s: beyond the series
  for (const double limit : omega_limits)
    for (int n = 0; n < 500; ++n) {
      const MotionState s = make_state(random, limit);
      const double dt = uniform(random, -0.2, 0.2);
      MotionJacobian f;
      advance(s, dt, &f);
      const double expected[5][5] = {{1, 0, f.x_v, f.x_phi, f.x_omega},
                                     {0, 1, f.y_v, f.y_phi, f.y_omega},
                                     {0, 0, 1, 0, 0},
                                     {0, 0, 0, 1, f.phi_omega},
                                     {0, 0, 0, 0, 1}};
      for (int c = 0; c < 5; ++c) {
        const double h = 1e-4;
        MotionState low = s, high = s;
        entry(low, c) -= h;
        entry(high, c) += h;
        low = advance(low, dt);
        high = advance(high, dt);
        for (int r = 0; r < 5; ++r) {
          double difference = entry(high, r) - entry(low, r);
          if (r == 3) difference = wrapped(difference);
          CAPTURE(limit);
          CAPTURE(n);
          CAPTURE(r);
          CAPTURE(c);
          REQUIRE(std::fabs(difference / (2 * h) - expected[r][c]) < 1e-6);
        }
      }
    }
}

TEST_CASE("motion model: the Jacobian has no step where the series takes over") {
  for (const double sign : {-1.0, 1.0})
    for (const double dt : {0.05, -0.05}) {
      const double omega = sign * 0.5 / 0.05;  // half turn 1/4
      MotionJacobian below, above;
      advance({0, 0, 50, 0.3, omega * (1 - 1e-13)}, dt, &below);
      advance({0, 0, 50, 0.3, omega * (1 + 1e-13)}, dt, &above);
      CHECK(std::fabs(below.x_omega - above.x_omega) < 1e-12);
      CHECK(std::fabs(below.y_omega - above.y_omega) < 1e-12);
    }
}

TEST_CASE("motion model: one step equals many small ones") {
  std::mt19937_64 random(14);
  for (int n = 0; n < 200; ++n) {
    const MotionState s = make_state(random, 1.0);
    const double dt = uniform(random, -4, 4);
    MotionState many = s;
    for (int k = 0; k < 1000; ++k) many = advance(many, dt / 1000);
    const MotionState once = advance(s, dt);
    CAPTURE(n);
    REQUIRE(std::fabs(once.x_m - many.x_m) < 1e-9);
    REQUIRE(std::fabs(once.y_m - many.y_m) < 1e-9);
    REQUIRE(std::fabs(wrapped(once.course_rad - many.course_rad)) < 1e-9);
  }
}

TEST_CASE("motion model: backward undoes forward") {
  std::mt19937_64 random(15);
  for (int n = 0; n < 1000; ++n) {
    const MotionState s = make_state(random, 1.0);
    const double dt = uniform(random, -1, 1);
    const MotionState back = advance(advance(s, dt), -dt);
    CAPTURE(n);
    REQUIRE(std::fabs(back.x_m - s.x_m) < 1e-11);
    REQUIRE(std::fabs(back.y_m - s.y_m) < 1e-11);
    REQUIRE(std::fabs(wrapped(back.course_rad - s.course_rad)) < 1e-12);
  }
}

TEST_CASE("motion model: keeps the course in (-pi, pi]") {
  std::mt19937_64 random(16);
  for (int n = 0; n < 2000; ++n) {
    const MotionState next = advance(make_state(random, 50.0), uniform(random, -4, 4));
    CAPTURE(n);
    REQUIRE(next.course_rad > -overtake::kPi);
    REQUIRE(next.course_rad <= overtake::kPi);
  }
}
