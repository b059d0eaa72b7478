// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_filter.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "core/math.h"
#include "tests/support/covariance_steps.h"

namespace {

using namespace overtake;
using overtake::test::is_positive_definite;

constexpr int kN = kTrackStateSize;

ProcessNoise make_paper_noise() { return {{0.1, 0.1, 10.0, 0.1, 0.01}, 0.05}; }  // Q_diag per 50 ms

double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

TrackEstimate make_estimate(std::mt19937_64& random) {
  TrackEstimate e;
  e.mean = {uniform(random, -50, 50), uniform(random, -50, 50), uniform(random, 0, 80), uniform(random, -3, 3),
            uniform(random, -0.3, 0.3)};
  double a[kN][kN];
  const double scale[kN] = {1.5, 1.5, 2.0, 0.2, 0.1};
  for (auto& row : a)
    for (double& value : row) value = uniform(random, -1, 1);
  for (int r = 0; r < kN; ++r)
    for (int c = 0; c < kN; ++c)
      for (int k = 0; k < kN; ++k) e.covariance[r][c] += scale[r] * scale[c] * (a[r][k] * a[c][k] + 0.1 * (r == c));
  return e;
}

double largest_difference(const TrackEstimate& a, const TrackEstimate& b) {
  double most = std::fabs(a.mean.x_m - b.mean.x_m);
  most = std::max(most, std::fabs(a.mean.y_m - b.mean.y_m));
  most = std::max(most, std::fabs(a.mean.speed_mps - b.mean.speed_mps));
  most = std::max(most, std::fabs(wrap_angle(a.mean.course_rad - b.mean.course_rad)));
  most = std::max(most, std::fabs(a.mean.yaw_rate_rps - b.mean.yaw_rate_rps));
  for (int r = 0; r < kN; ++r)
    for (int c = 0; c < kN; ++c) most = std::max(most, std::fabs(a.covariance[r][c] - b.covariance[r][c]));
  return most;
}

}  // namespace

TEST_CASE("track filter: a prediction's covariance is F P F^T + Q dt") {
  std::mt19937_64 random(21);
  const ProcessNoise noise = make_paper_noise();
  for (int n = 0; n < 500; ++n) {
    const TrackEstimate before = make_estimate(random);
    const double dt = uniform(random, 0.001, 0.05);
    MotionJacobian j;
    advance(before.mean, dt, &j);
    const double f[kN][kN] = {{1, 0, j.x_v, j.x_phi, j.x_omega},
                              {0, 1, j.y_v, j.y_phi, j.y_omega},
                              {0, 0, 1, 0, 0},
                              {0, 0, 0, 1, j.phi_omega},
                              {0, 0, 0, 0, 1}};
    TrackEstimate after = before;
    predict(after, noise, dt);
    CAPTURE(n);
    for (int r = 0; r < kN; ++r)
      for (int c = 0; c < kN; ++c) {
        double expected = r == c ? noise.variance_per_s[r] * dt : 0.0;
        for (int k = 0; k < kN; ++k)
          for (int l = 0; l < kN; ++l) expected += f[r][k] * before.covariance[k][l] * f[c][l];
        REQUIRE(after.covariance[r][c] == doctest::Approx(expected).epsilon(1e-11));
      }
  }
}

TEST_CASE("track filter: process noise is the table's per 50 ms and scales with dt") {
  for (const double dt : {0.05, 0.1, 0.02, 1.0}) {
    TrackEstimate e;  // standing still: only noise
    predict(e, make_paper_noise(), dt);
    CAPTURE(dt);
    CHECK(e.covariance[0][0] >= 0.005 * dt / 0.05 * (1 - 1e-12));
    CHECK(e.covariance[2][2] == doctest::Approx(0.5 * dt / 0.05));
    CHECK(e.covariance[4][4] == doctest::Approx(0.0005 * dt / 0.05));
    if (dt <= 0.05) CHECK(e.covariance[3][3] == doctest::Approx(0.005 * dt / 0.05));
  }
}

TEST_CASE("track filter: a long prediction equals its steps of 50 ms") {
  std::mt19937_64 random(22);
  for (int n = 0; n < 50; ++n) {
    TrackEstimate once = make_estimate(random), stepped = once;
    predict(once, make_paper_noise(), 1.0);
    for (int k = 0; k < 20; ++k) predict(stepped, make_paper_noise(), 0.05);
    CAPTURE(n);
    REQUIRE(largest_difference(once, stepped) < 1e-8);
  }
}

TEST_CASE("track filter: the mean of a step of any length is exact") {
  std::mt19937_64 random(23);
  for (int n = 0; n < 200; ++n) {
    TrackEstimate e = make_estimate(random);
    const double dt = uniform(random, -4, 4);
    const MotionState exact = advance(e.mean, dt);
    predict(e, make_paper_noise(), dt);
    CAPTURE(n);
    REQUIRE(std::fabs(e.mean.x_m - exact.x_m) < 1e-9);
    REQUIRE(std::fabs(e.mean.y_m - exact.y_m) < 1e-9);
  }
}

TEST_CASE("track filter: a backward step adds no noise, and a forward step without noise undoes it") {
  std::mt19937_64 random(24);
  const ProcessNoise none = {{}, 0.05};
  for (int n = 0; n < 200; ++n) {
    const TrackEstimate before = make_estimate(random);
    TrackEstimate e = before;
    predict(e, make_paper_noise(), -0.02);
    predict(e, none, 0.02);
    CAPTURE(n);
    REQUIRE(largest_difference(e, before) < 1e-9);
  }
}

TEST_CASE("track filter: the update equals the textbook's P - K S K^T") {
  std::mt19937_64 random(25);
  for (int n = 0; n < 500; ++n) {
    const TrackEstimate before = make_estimate(random);
    const Measurement z = {before.mean.x_m + uniform(random, -2, 2), before.mean.y_m + uniform(random, -2, 2),
                           uniform(random, 0.5, 5), uniform(random, 0.5, 5), uniform(random, -0.4, 0.4)};
    const auto& p = before.covariance;
    const double a = p[0][0] + z.var_x, b = p[0][1] + z.cov_xy, d = p[1][1] + z.var_y, det = a * d - b * b;
    const double inverse[2][2] = {{d / det, -b / det}, {-b / det, a / det}}, s[2][2] = {{a, b}, {b, d}};
    double gain[kN][2];
    for (int r = 0; r < kN; ++r)
      for (int c = 0; c < 2; ++c) gain[r][c] = p[r][0] * inverse[0][c] + p[r][1] * inverse[1][c];
    TrackEstimate expected = before;
    const double dx = z.x_m - before.mean.x_m, dy = z.y_m - before.mean.y_m;
    expected.mean.x_m += gain[0][0] * dx + gain[0][1] * dy;
    expected.mean.y_m += gain[1][0] * dx + gain[1][1] * dy;
    expected.mean.speed_mps += gain[2][0] * dx + gain[2][1] * dy;
    expected.mean.course_rad += gain[3][0] * dx + gain[3][1] * dy;
    expected.mean.yaw_rate_rps += gain[4][0] * dx + gain[4][1] * dy;
    for (int r = 0; r < kN; ++r)
      for (int c = 0; c < kN; ++c)
        for (int k = 0; k < 2; ++k)
          for (int l = 0; l < 2; ++l) expected.covariance[r][c] -= gain[r][k] * s[k][l] * gain[c][l];
    turn_round(expected);
    TrackEstimate e = before;
    REQUIRE(update(e, z));
    CAPTURE(n);
    REQUIRE(largest_difference(e, expected) < 1e-9);

    Innovation innovation;
    REQUIRE(innovate(before, z, &innovation));
    REQUIRE(innovation.d2 ==
            doctest::Approx(dx * dx * inverse[0][0] + 2 * dx * dy * inverse[0][1] + dy * dy * inverse[1][1]));
    REQUIRE(innovation.log_det == doctest::Approx(std::log(det)));
  }
}

TEST_CASE("track filter: a reversed state is the same motion with the same uncertainty") {
  std::mt19937_64 random(26);
  for (int n = 0; n < 200; ++n) {
    TrackEstimate reversing = make_estimate(random);
    reversing.mean.speed_mps = -uniform(random, 0.01, 20);
    TrackEstimate turned = reversing;
    turn_round(turned);
    CAPTURE(n);
    REQUIRE(turned.mean.speed_mps == -reversing.mean.speed_mps);
    REQUIRE(turned.mean.yaw_rate_rps == reversing.mean.yaw_rate_rps);
    REQUIRE(is_positive_definite(turned));
    predict(reversing, make_paper_noise(), 0.5);
    predict(turned, make_paper_noise(), 0.5);
    turn_round(reversing);
    REQUIRE(largest_difference(reversing, turned) < 1e-9);
  }
}

TEST_CASE("track filter: an update never leaves a negative speed") {
  TrackEstimate e;
  e.mean = {0, 0, 0.5, 0, 0};
  for (int i = 0; i < kN; ++i) e.covariance[i][i] = 1;
  e.covariance[0][2] = e.covariance[2][0] = 0.9;  // a measurement behind the car pulls v below 0
  REQUIRE(update(e, {-5, 0, 1, 1, 0}));
  CHECK(e.mean.speed_mps == doctest::Approx(1.75));
  CHECK(e.mean.course_rad == doctest::Approx(kPi));
  CHECK(e.covariance[0][2] < 0);
}

TEST_CASE("track filter: a measurement whose S is not positive definite changes nothing") {
  const TrackEstimate zero;
  Innovation innovation;
  CHECK_FALSE(innovate(zero, {1, 1, 0, 0, 0}, &innovation));
  CHECK_FALSE(innovate(zero, {1, 1, 1, 1, 1}, &innovation));
  CHECK_FALSE(innovate(zero, {1, 1, -1, -1, 0}, &innovation));
  TrackEstimate e = zero;
  CHECK_FALSE(update(e, {1, 1, 0, 0, 0}));
  CHECK(largest_difference(e, zero) == 0);
}

namespace {

// The filter of `paper`: updates of any accepted accuracy, with and without process noise.
class CvtrSteps {
 public:
  using Estimate = TrackEstimate;
  void draw_world(std::mt19937_64&, double noise) {
    noise_ = make_paper_noise();
    for (double& variance : noise_.variance_per_s) variance *= noise;
  }
  void predict(TrackEstimate& e, std::mt19937_64&, double dt_s) const { overtake::predict(e, noise_, dt_s); }
  bool update(TrackEstimate& e, const Measurement& z) const { return overtake::update(e, z); }

 private:
  ProcessNoise noise_;
};

}  // namespace

TEST_CASE("track filter: covariance stays symmetric and positive definite over 100,000 random steps") {
  test::run_random_steps(CvtrSteps{}, 100'000);
}

TEST_SUITE("long") {
  TEST_CASE("track filter: covariance stays symmetric and positive definite over ten million random steps") {
    test::run_random_steps(CvtrSteps{}, 10'000'000);
  }
}

TEST_CASE("track filter: a state that no car can have is not sound") {
  std::mt19937_64 random(28);
  const TrackEstimate good = make_estimate(random);
  CHECK(is_sound(good));
  TrackEstimate e = good;
  e.mean.x_m = std::nan("");
  CHECK_FALSE(is_sound(e));
  e = good;
  e.mean.speed_mps = 1001;
  CHECK_FALSE(is_sound(e));
  e = good;
  e.covariance[3][3] = -1e-9;
  CHECK_FALSE(is_sound(e));
  e = good;
  e.covariance[4][0] = INFINITY;
  CHECK_FALSE(is_sound(e));
}

TEST_CASE("track filter: the second measurement gives speed and course as a filter in velocities does") {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int32_t round = 0; round < 400; ++round) {
    // Truth drawn from the prior, two measurements: the errors are as large as the covariance says.
    const double sigma_mps = 20, dt_s = 0.1, sigma_m = round % 2 ? 0.2 : 1.0;
    TrackEstimate e;
    e.mean = {normal(random) * sigma_m, normal(random) * sigma_m, 0, 0, 0};
    for (int32_t i = 0; i < kTrackStateSize; ++i) e.covariance[i][i] = 1;
    e.covariance[0][0] = e.covariance[1][1] = sigma_m * sigma_m + sigma_mps * sigma_mps * dt_s * dt_s;
    e.covariance[2][2] = sigma_mps * sigma_mps;
    e.covariance[3][3] = kPi * kPi;
    if (round % 3 == 0) e.mean.speed_mps = 30, e.mean.course_rad = 2;  // a guess, which the place has followed
    const double guess_x_mps = e.mean.speed_mps * std::cos(2.0), guess_y_mps = e.mean.speed_mps * std::sin(2.0);
    e.mean.x_m += guess_x_mps * dt_s, e.mean.y_m += guess_y_mps * dt_s;
    const double x_m = e.mean.x_m, y_m = e.mean.y_m;
    const double vx = guess_x_mps + normal(random) * sigma_mps, vy = guess_y_mps + normal(random) * sigma_mps;
    Measurement z{};
    z.x_m = vx * dt_s + normal(random) * sigma_m, z.y_m = vy * dt_s + normal(random) * sigma_m;
    z.var_x = z.var_y = sigma_m * sigma_m;
    z.cov_xy = 0;
    REQUIRE(find_course(e, z, dt_s));
    CHECK(is_sound(e));
    // The innovation is shared between place and velocity.
    const double share = sigma_mps * sigma_mps * dt_s / (2 * z.var_x + sigma_mps * sigma_mps * dt_s * dt_s);
    const double x_mps = guess_x_mps + share * (z.x_m - x_m), y_mps = guess_y_mps + share * (z.y_m - y_m);
    const double speed_mps = std::hypot(x_mps, y_mps);
    CHECK(e.mean.speed_mps == doctest::Approx(speed_mps).epsilon(1e-9));
    CHECK(std::fabs(wrap_angle(e.mean.course_rad - std::atan2(y_mps, x_mps))) < 1e-9);
    const double var = sigma_mps * sigma_mps * (1 - share * dt_s);
    CHECK(e.covariance[2][2] == doctest::Approx(var).epsilon(1e-6));
    CHECK(e.covariance[3][3] == doctest::Approx(var / std::max(speed_mps * speed_mps, var)).epsilon(1e-6));
    CHECK(e.covariance[4][4] == doctest::Approx(1).epsilon(1e-6));
    // The covariance in map axes does not depend on the course.
    CHECK(e.covariance[0][0] == doctest::Approx(e.covariance[1][1]).epsilon(1e-6));
  }
  TrackEstimate e;
  for (int32_t i = 0; i < kTrackStateSize; ++i) e.covariance[i][i] = 1;
  const TrackEstimate before = e;
  Measurement z{};
  z.var_x = z.var_y = 1, z.cov_xy = 0;
  CHECK_FALSE(find_course(e, z, 0));
  z.var_x = -2;
  CHECK_FALSE(find_course(e, z, 0.1));
  CHECK(std::memcmp(&e, &before, sizeof e) == 0);
}
