// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_motion.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/math.h"
#include "tests/support/covariance_steps.h"

namespace {

using namespace overtake;

constexpr int kLaneN = kTrackStateSize;
constexpr CourseNoise kLaneNoise = {0.02, 0.006, 2.0, 2e-4, 8e-3, 2.0, 0.6};

double draw(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

MotionState draw_state(std::mt19937_64& random) {
  return {draw(random, -100, 100), draw(random, -100, 100), draw(random, 0, 90), draw(random, -3, 3),
          draw(random, -0.5, 0.5)};
}

constexpr int kAll = kLaneN + 1;  // with the acceleration

// Entry (r, c) of the covariance of all six elements.
double& covariance_of(LaneEstimate& e, int r, int c) {
  if (r == kLaneN && c == kLaneN) return e.accel_var;
  return r == kLaneN ? e.accel_cov[c] : c == kLaneN ? e.accel_cov[r] : e.covariance[r][c];
}

LaneEstimate draw_estimate(std::mt19937_64& random) {
  LaneEstimate e;
  e.mean = draw_state(random);
  e.accel_mps2 = draw(random, -10, 10);
  const double scale[kAll] = {1.5, 1.5, 2.0, 0.2, 0.1, 3.0};
  double a[kAll][kAll];
  for (auto& row : a)
    for (double& value : row) value = draw(random, -1, 1);
  for (int r = 0; r < kAll; ++r)
    for (int c = 0; c <= r; ++c) {
      double sum = 0;
      for (int k = 0; k < kAll; ++k) sum += scale[r] * scale[c] * (a[r][k] * a[c][k] + 0.1 * (r == c));
      covariance_of(e, r, c) = covariance_of(e, c, r) = sum;
    }
  return e;
}

double& entry_of(LaneEstimate& e, int i) {
  MotionState& s = e.mean;
  double* const all[kAll] = {&s.x_m, &s.y_m, &s.speed_mps, &s.course_rad, &s.yaw_rate_rps, &e.accel_mps2};
  return *all[i];
}

}  // namespace

TEST_CASE("lane motion: the yaw rate goes to the lane's, and the place follows its mean") {
  // Steps of a millisecond of the differential equation d omega / dt = (kappa v - omega) / tau.
  std::mt19937_64 random(71);
  for (int n = 0; n < 200; ++n) {
    MotionState s = draw_state(random);
    const LanePull lane = {draw(random, -0.01, 0.01), draw(random, 0.1, 2.0)};
    MotionState fine = s;
    for (int k = 0; k < 20000; ++k) {
      fine.yaw_rate_rps += 0.05 / 20000 * (lane.curvature_per_m * fine.speed_mps - fine.yaw_rate_rps) / lane.time_s;
      fine = advance(fine, 0.05 / 20000);
    }
    const MotionState next = advance_on_lane(s, lane, 0.05);
    CAPTURE(n);
    CHECK(std::fabs(next.x_m - fine.x_m) < 5e-3);
    CHECK(std::fabs(next.y_m - fine.y_m) < 5e-3);
    CHECK(std::fabs(wrap_angle(next.course_rad - fine.course_rad)) < 1e-3);
    CHECK(std::fabs(next.yaw_rate_rps - fine.yaw_rate_rps) < 0.02 * std::fabs(s.yaw_rate_rps) + 0.02);
    CHECK(next.speed_mps == s.speed_mps);
  }
  MotionState car;
  car.speed_mps = 60;
  for (int k = 0; k < 100; ++k) car = advance_on_lane(car, {0.003, 0.2}, 0.05);
  CHECK(car.yaw_rate_rps == doctest::Approx(0.18).epsilon(1e-6));
}

TEST_CASE("lane motion: the course of a car that is not seen goes to the lane's heading, which turns") {
  constexpr double kCurvature = 0.003, kTime_s = 0.3, kFirst_rad = 0.05, kStep_s = 0.05;
  MotionState car = {.speed_mps = 60, .course_rad = kFirst_rad, .yaw_rate_rps = 60 * kCurvature};
  double lane_rad = 0;
  for (int k = 1; k <= 60; ++k) {
    car = advance_on_lane(car, {kCurvature, 0.2, lane_rad, kTime_s}, kStep_s);
    lane_rad += kCurvature * 60 * kStep_s;
    CAPTURE(k);
    CHECK(car.course_rad - lane_rad ==
          doctest::Approx(kFirst_rad * std::exp(-k * kStep_s / kTime_s)).epsilon(0.02 * k));
  }
  CHECK(std::fabs(car.course_rad - lane_rad) < 1e-5);
  const MotionState seen = advance_on_lane(car, {kCurvature, 0.2, lane_rad - 1.0, 0}, kStep_s);
  CHECK(seen.course_rad == doctest::Approx(car.course_rad + kCurvature * 60 * kStep_s).epsilon(1e-6));
}

TEST_CASE("lane motion: without a lane it is CVTR, bit for bit") {
  std::mt19937_64 random(72);
  for (int n = 0; n < 1000; ++n) {
    const MotionState s = draw_state(random);
    const double dt_s = draw(random, -0.1, 0.1);
    const MotionState a = advance_on_lane(s, {}, dt_s), b = advance(s, dt_s);
    CHECK(a.x_m == b.x_m);
    CHECK(a.y_m == b.y_m);
    CHECK(a.course_rad == b.course_rad);
    CHECK(a.yaw_rate_rps == b.yaw_rate_rps);
  }
}

TEST_CASE("lane motion: the speed follows a decaying acceleration, and the place its mean") {
  // Steps of a millisecond of the differential equations d a / dt = -a / tau, d v / dt = a.
  LaneEstimate car;
  car.mean.speed_mps = 40, car.accel_mps2 = -8;
  double fine_mps2 = -8, fine_mps = 40, fine_m = 0;
  for (int k = 0; k < 20; ++k) {
    predict_on_lane(car, {}, kLaneNoise, 0.05);
    for (int i = 0; i < 5000; ++i) {
      fine_mps2 -= 1e-5 * fine_mps2 / kLaneNoise.accel_s;
      fine_m += 1e-5 * (fine_mps + 0.5e-5 * fine_mps2);
      fine_mps += 1e-5 * fine_mps2;
    }
  }
  CHECK(car.accel_mps2 == doctest::Approx(fine_mps2).epsilon(0.01));
  CHECK(car.mean.speed_mps == doctest::Approx(fine_mps).epsilon(1e-4));
  CHECK(car.mean.x_m == doctest::Approx(fine_m).epsilon(1e-4));
  // Who brakes comes to rest.
  LaneEstimate slow;
  slow.mean.speed_mps = 0.2, slow.accel_mps2 = -8;
  predict_on_lane(slow, {}, kLaneNoise, 0.05);
  CHECK(slow.mean.speed_mps == 0);
  CHECK(slow.accel_mps2 == 0);
  // A car that is only moved has its acceleration still.
  const LaneEstimate before = car;
  predict_on_lane(car, {}, {}, 0.05);
  CHECK(car.mean.speed_mps == before.mean.speed_mps);
  CHECK(car.accel_mps2 == before.accel_mps2);
  forget_acceleration(car);
  predict_on_lane(car, {}, kLaneNoise, 0.05);
  CHECK(car.mean.speed_mps == before.mean.speed_mps);
}

// The covariance of a x by that of what it has done: 0.5 t^2 along the course, t and 1.
TEST_CASE("lane motion: an acceleration that may have begun adds to place, speed and acceleration what it has done") {
  std::mt19937_64 random(12);
  for (int n = 0; n < 100; ++n) {
    const LaneEstimate before = draw_estimate(random);
    LaneEstimate after = before;
    const double sigma_mps2 = draw(random, 1, 10), since_s = draw(random, 0, 0.3), phi = before.mean.course_rad;
    begin_acceleration(after, sigma_mps2, since_s);
    const double way = 0.5 * since_s * since_s;
    const double by[kAll] = {way * std::cos(phi), way * std::sin(phi), since_s, 0, 0, 1};
    LaneEstimate old = before;
    for (int r = 0; r < kAll; ++r) {
      CHECK(entry_of(after, r) == entry_of(old, r));
      for (int c = 0; c < kAll; ++c)
        CHECK(covariance_of(after, r, c) ==
              doctest::Approx(covariance_of(old, r, c) + sigma_mps2 * sigma_mps2 * by[r] * by[c]).epsilon(1e-12));
    }
  }
}

TEST_CASE("lane motion: the mean of a prediction is advance_on_lane, its covariance F P F^T + Q with the derivatives") {
  std::mt19937_64 random(73);
  for (int n = 0; n < 300; ++n) {
    LaneEstimate before = draw_estimate(random);
    if (n % 2) forget_acceleration(before);
    LanePull lane;
    if (n % 3 != 0) lane = {draw(random, -0.01, 0.01), draw(random, 0.1, 2.0)};
    if (n % 3 == 2)
      lane.heading_rad = before.mean.course_rad + draw(random, -1, 1), lane.course_s = draw(random, 0.1, 2);
    const double dt_s = draw(random, 0.001, 0.1);
    double f[kAll][kAll];
    for (int c = 0; c < kAll; ++c) {
      constexpr double kShift = 1e-5;
      LaneEstimate low = before, high = before;
      entry_of(low, c) -= kShift;
      entry_of(high, c) += kShift;
      predict_on_lane(low, lane, kLaneNoise, dt_s), predict_on_lane(high, lane, kLaneNoise, dt_s);
      for (int r = 0; r < kAll; ++r) {
        const double change = entry_of(high, r) - entry_of(low, r);
        f[r][c] = (r == 3 ? wrap_angle(change) : change) / (2 * kShift);
      }
    }
    LaneEstimate after = before;
    predict_on_lane(after, lane, kLaneNoise, dt_s);
    CAPTURE(n);
    if (before.accel_mps2 == 0) {
      const MotionState mean = advance_on_lane(before.mean, lane, dt_s);
      CHECK(after.mean.x_m == mean.x_m);
      CHECK(after.mean.course_rad == mean.course_rad);
      CHECK(after.mean.yaw_rate_rps == mean.yaw_rate_rps);
    }
    const double cosine = std::cos(after.mean.course_rad), sine = std::sin(after.mean.course_rad);
    double q[kAll][kAll] = {};
    q[0][0] = cosine * cosine * kLaneNoise.along + sine * sine * kLaneNoise.across;
    q[1][1] = sine * sine * kLaneNoise.along + cosine * cosine * kLaneNoise.across;
    q[0][1] = q[1][0] = cosine * sine * (kLaneNoise.along - kLaneNoise.across);
    q[2][2] = kLaneNoise.speed, q[3][3] = kLaneNoise.course, q[4][4] = kLaneNoise.yaw_rate;
    q[kLaneN][kLaneN] = kLaneNoise.accel;
    for (int r = 0; r < kAll; ++r)
      for (int c = 0; c < kAll; ++c) {
        double expected = q[r][c] * dt_s;
        for (int i = 0; i < kAll; ++i)
          for (int k = 0; k < kAll; ++k) expected += f[r][i] * covariance_of(before, i, k) * f[c][k];
        REQUIRE(covariance_of(after, r, c) == doctest::Approx(expected).epsilon(1e-5));
        REQUIRE(covariance_of(after, r, c) == covariance_of(after, c, r));
      }
  }
}

TEST_CASE("lane motion: an update is that of a filter of six elements") {
  std::mt19937_64 random(77);
  for (int n = 0; n < 300; ++n) {
    LaneEstimate before = draw_estimate(random);
    before.mean.speed_mps += 30;
    const Measurement z = {before.mean.x_m + draw(random, -1, 1), before.mean.y_m + draw(random, -1, 1),
                           draw(random, 0.1, 1), draw(random, 0.1, 1), draw(random, -0.09, 0.09)};
    LaneEstimate after = before;
    REQUIRE(update_on_lane(after, z));
    const double xx = before.covariance[0][0] + z.var_x, yy = before.covariance[1][1] + z.var_y;
    const double xy = before.covariance[0][1] + z.cov_xy, det = xx * yy - xy * xy;
    const double inverse[2][2] = {{yy / det, -xy / det}, {-xy / det, xx / det}};
    const double innovation[2] = {z.x_m - before.mean.x_m, z.y_m - before.mean.y_m};
    if (std::fabs(wrap_angle(after.mean.course_rad - before.mean.course_rad)) > 1.0) continue;
    CAPTURE(n);
    for (int r = 0; r < kAll; ++r) {
      double gain[2], moved = entry_of(before, r);
      for (int k = 0; k < 2; ++k) {
        gain[k] = covariance_of(before, r, 0) * inverse[0][k] + covariance_of(before, r, 1) * inverse[1][k];
        moved += gain[k] * innovation[k];
      }
      CHECK(std::fabs(r == 3 ? wrap_angle(entry_of(after, r) - moved) : entry_of(after, r) - moved) < 1e-9);
      for (int c = 0; c < kAll; ++c) {
        const double expected =
            covariance_of(before, r, c) - gain[0] * covariance_of(before, 0, c) - gain[1] * covariance_of(before, 1, c);
        CHECK(std::fabs(covariance_of(after, r, c) - expected) < 1e-9);
      }
    }
  }
  // A measurement that no filter can use changes nothing.
  LaneEstimate e = draw_estimate(random);
  const double accel_mps2 = e.accel_mps2;
  CHECK_FALSE(update_on_lane(e, {0, 0, -1e3, -1e3, 0}));
  CHECK(e.accel_mps2 == accel_mps2);
}

TEST_CASE("lane motion: a car that has turned round has no acceleration, whatever the update does to its course") {
  for (const double turn_rad : {0.0, 1.0, 2.0, 2.6}) {
    CAPTURE(turn_rad);
    LaneEstimate e;
    e.mean = {0, 0, 5, 0, 0};
    for (int i = 0; i < kLaneN; ++i) e.covariance[i][i] = 1;
    e.covariance[0][2] = e.covariance[2][0] = 0.9;  // a place 20 m behind takes 9 m/s away
    e.covariance[1][3] = e.covariance[3][1] = 0.5;
    e.accel_mps2 = 3, e.accel_var = 1;
    REQUIRE(update_on_lane(e, {.x_m = -20, .y_m = 4 * turn_rad, .var_x = 1, .var_y = 1, .cov_xy = 0}));
    CHECK(e.mean.speed_mps == doctest::Approx(4));
    CHECK(wrap_angle(e.mean.course_rad - turn_rad - kPi) == doctest::Approx(0));
    CHECK(e.accel_mps2 == 0);
    CHECK(e.accel_var == 0);
  }
}

TEST_CASE("lane motion: a step back is CVTR, and adds no noise") {
  std::mt19937_64 random(74);
  for (int n = 0; n < 300; ++n) {
    const LaneEstimate before = draw_estimate(random);
    const LanePull lane = {draw(random, -0.01, 0.01), draw(random, 0.2, 2.0), draw(random, -3, 3), 0.3};
    const double dt_s = draw(random, 0.001, 0.05);
    LaneEstimate e = before, back = before;
    predict_on_lane(back, lane, kLaneNoise, -dt_s);
    CHECK(back.mean.yaw_rate_rps == before.mean.yaw_rate_rps);
    CHECK(advance_on_lane(before.mean, lane, -dt_s).x_m == back.mean.x_m);
    predict_on_lane(e, {}, {}, dt_s);
    predict_on_lane(e, lane, kLaneNoise, -dt_s);
    CAPTURE(n);
    CHECK(std::fabs(e.mean.x_m - before.mean.x_m) < 1e-9);
    CHECK(std::fabs(wrap_angle(e.mean.course_rad - before.mean.course_rad)) < 1e-12);
    for (int r = 0; r < kLaneN; ++r)
      CHECK(e.covariance[r][r] == doctest::Approx(before.covariance[r][r]).epsilon(1e-6));
  }
}

TEST_CASE("lane motion: without process noise the lane's pull leaves the covariance positive definite") {
  std::mt19937_64 random(76);
  for (int n = 0; n < 200; ++n) {
    LaneEstimate e = draw_estimate(random);
    const LanePull lane = {draw(random, -0.05, 0.05), 0.01, draw(random, -3, 3), n % 2 == 0 ? 0.0 : 0.01};
    for (int k = 0; k < 40; ++k) {
      predict_on_lane(e, lane, {}, 0.05);
      CAPTURE(n);
      CAPTURE(k);
      REQUIRE(test::is_positive_definite(e));
    }
  }
}

namespace {

// The motion of `best`: any lane or none, any process noise, and steps of at most 50 ms as its tracker takes them.
class LaneSteps {
 public:
  using Estimate = LaneEstimate;
  void draw_world(std::mt19937_64& random, double noise) {
    const auto of = [&](double usual) { return usual * noise * std::pow(10.0, draw(random, -1, 1)); };
    noise_ = {of(kLaneNoise.along),
              of(kLaneNoise.across),
              of(kLaneNoise.speed),
              of(kLaneNoise.course),
              of(kLaneNoise.yaw_rate),
              of(kLaneNoise.accel),
              std::pow(10.0, draw(random, -2, 1))};
  }
  bool update(LaneEstimate& e, const Measurement& z) const { return update_on_lane(e, z); }
  void predict(LaneEstimate& e, std::mt19937_64& random, double dt_s) const {
    LanePull lane;
    if (random() % 4) lane = {draw(random, -0.05, 0.05), std::pow(10.0, draw(random, -2, 1))};
    if (random() % 2) lane.heading_rad = draw(random, -3, 3), lane.course_s = std::pow(10.0, draw(random, -2, 1));
    const int32_t steps = 1 + int32_t(std::fabs(dt_s) / 0.05);
    for (int32_t k = 0; k < steps; ++k) predict_on_lane(e, lane, noise_, dt_s / steps);
  }

 private:
  CourseNoise noise_;
};

}  // namespace

TEST_CASE("lane motion: covariance stays symmetric and positive definite over 100,000 random steps") {
  test::run_random_steps(LaneSteps{}, 100'000);
}

TEST_SUITE("long") {
  TEST_CASE("lane motion: covariance stays symmetric and positive definite over ten million random steps") {
    test::run_random_steps(LaneSteps{}, 10'000'000);
  }
}
