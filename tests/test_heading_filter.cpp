// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The learned error of the ego heading: what it learns, when, and that the order of arrival has no effect.
#include "pipeline/track/heading_filter.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/math.h"

namespace {

using namespace overtake;

constexpr double kDeg = kPi / 180;
constexpr int64_t kMs = 1'000'000, kStart = 1000 * kMs;
constexpr int32_t kSensors = 3;

HeadingFilterParams params() { return {0.1 * kDeg, 0.5, 1 * kDeg, 0.2 * kDeg, 0.06 * kDeg, 1}; }

// A car with a slip of 0.08 deg per m/s^2, whose published course is that of a point 1.5 m before the rear axle.
struct Truth {
  double constant_rad[kSensors] = {0.5 * kDeg, 0.3 * kDeg, 0.4 * kDeg};
  static constexpr double kSlip = 0.08 * kDeg, kLever_m = -1.5;
  static HeadingCause cause_at(double t) {  // turns and straights, at changing speed
    const double speed = 60 + 15 * std::sin(0.31 * t), rate = 0.2 + 0.2 * std::sin(0.7 * t);
    return {speed * rate - 3, rate / speed};
  }
  double offset(const HeadingCause& cause, int32_t sensor) const {
    return kSlip * cause.accel_mps2 + kLever_m * cause.curvature_per_m + constant_rad[sensor];
  }
};

struct Frame {
  int64_t stamp_ns;
  HeadingCause cause;
  WallHeading walls[kSensors];
};

// 20 frames a second; noise as of a map with errors.
std::vector<Frame> frames_of(const Truth& truth, double seconds, double noise_deg = 0.05, double from_s = 0) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal(0, noise_deg * kDeg);
  std::vector<Frame> frames;
  for (int32_t k = 0; k < int32_t(20 * seconds); ++k) {
    const double t = from_s + 0.05 * k;
    Frame f{kStart + int64_t(t * 1e9), Truth::cause_at(t), {}};
    for (int32_t s = 0; s < kSensors; ++s) f.walls[s] = {true, truth.offset(f.cause, s) + normal(random), 1e-8, 50};
    frames.push_back(f);
  }
  return frames;
}
void add(HeadingFilter& filter, const Frame& f) { filter.add(f.stamp_ns, f.cause, f.walls); }

double error_deg(const HeadingFilter& filter, const Truth& truth, double t, int32_t sensor) {
  const HeadingCause cause = Truth::cause_at(t);
  const auto& state = filter.at(kStart + int64_t(t * 1e9));
  return std::fabs(state.offset_rad(cause, sensor, kSensors) - truth.offset(cause, sensor)) / kDeg;
}

}  // namespace

TEST_CASE("heading filter: learns slip, lever and constants, and goes on where no wall is seen") {
  const Truth truth;
  HeadingFilter filter(params(), kSensors);
  constexpr HeadingCause none{};
  const double unknown = std::sqrt(filter.at(kStart).variance(none, 0, kSensors));
  CHECK(unknown > 1 * kDeg);
  CHECK(filter.at(kStart).offset_rad({10, 0.004}, 0, kSensors) == 0);
  for (const Frame& f : frames_of(truth, 30)) add(filter, f);
  for (const double t : {31.0, 33.0, 36.0, 45.0})
    for (int32_t s = 0; s < kSensors; ++s) CHECK(error_deg(filter, truth, t, s) < 0.05);
  const auto& state = filter.at(kStart + 40'000 * kMs);
  CHECK(state.x[0] / kDeg == doctest::Approx(0.08).scale(0).epsilon(0.1));
  CHECK(state.offset_rad(none, HeadingFilter::kMean, kSensors) == doctest::Approx(0.4 * kDeg).scale(0).epsilon(0.1));
  CHECK(state.offset_rad(none, HeadingFilter::kNoConstant, kSensors) == 0);
  CHECK(std::sqrt(state.variance(none, 0, kSensors)) < 0.1 * unknown);
  CHECK(state.variance(none, HeadingFilter::kMean, kSensors) <= state.variance(none, 0, kSensors));
}

TEST_CASE("heading filter: a constant error of 1 deg is found within two seconds") {
  Truth truth;
  for (double& c : truth.constant_rad) c = 1 * kDeg;
  HeadingFilter filter(params(), kSensors);
  for (const Frame& f : frames_of(truth, 2)) add(filter, f);
  CHECK(error_deg(filter, truth, 2, 0) < 0.15);
}

TEST_CASE("heading filter: a sensor without walls takes the constant of the others") {
  const Truth truth;
  HeadingFilter filter(params(), kSensors);
  for (Frame f : frames_of(truth, 20)) {
    f.walls[2].valid = false;
    add(filter, f);
  }
  const auto& state = filter.at(kStart + 30'000 * kMs);
  CHECK(state.offset_rad({}, 2, kSensors) ==
        doctest::Approx(0.4 * kDeg).scale(0).epsilon(0.15));  // middle of 0.5 and 0.3
  CHECK(state.variance({}, 2, kSensors) > 2 * state.variance({}, 0, kSensors));
}

TEST_CASE("heading filter: a frame uses only walls that are over 0.5 s older") {
  const Truth truth;
  const std::vector<Frame> frames = frames_of(truth, 5);
  HeadingFilter whole(params(), kSensors), part(params(), kSensors);
  for (const Frame& f : frames) add(whole, f);
  const int64_t asked_ns = frames[60].stamp_ns;
  for (const Frame& f : frames)
    if (f.stamp_ns < asked_ns - 500 * kMs) add(part, f);
  const HeadingFilter::State &a = whole.at(asked_ns), &b = part.at(asked_ns);
  CHECK(std::memcmp(a.x, b.x, sizeof a.x) == 0);
  CHECK(a.stamp_ns == frames[49].stamp_ns);
  CHECK(whole.at(asked_ns + 1).stamp_ns == frames[50].stamp_ns);
  CHECK(whole.at(kStart).stamp_ns == INT64_MIN);
}

TEST_CASE("heading filter: frames that come up to 0.5 s late change no bit of what any frame uses") {
  const Truth truth;
  int64_t step_ms = 50;
  SUBCASE("20 frames a second") {}
  SUBCASE("250 frames a second: eight sensors that are not in step") { step_ms = 4; }
  std::vector<Frame> frames = frames_of(truth, 40);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].stamp_ns = kStart + int64_t(i) * step_ms * kMs;
  HeadingFilter in_order(params(), kSensors);
  std::vector<HeadingFilter::State> expected;
  for (const Frame& f : frames) {
    add(in_order, f);
    expected.push_back(in_order.at(f.stamp_ns));
  }
  std::mt19937 random(2);
  for (int32_t run = 0; run < 5; ++run) {
    std::vector<std::pair<int64_t, std::size_t>> arrival;
    for (std::size_t i = 0; i < frames.size(); ++i)
      arrival.push_back({frames[i].stamp_ns + int64_t(random() % 500) * kMs, i});
    std::sort(arrival.begin(), arrival.end());
    HeadingFilter filter(params(), kSensors);
    int32_t differ = 0, late = 0;
    int64_t newest_ns = 0;
    for (const auto& [when, i] : arrival) {
      late += frames[i].stamp_ns < newest_ns;
      newest_ns = std::max(newest_ns, frames[i].stamp_ns);
      add(filter, frames[i]);
      const HeadingFilter::State got = filter.at(frames[i].stamp_ns);
      differ +=
          std::memcmp(got.x, expected[i].x, sizeof got.x) != 0 || std::memcmp(got.p, expected[i].p, sizeof got.p) != 0;
    }
    CHECK(late > 40);
    CHECK(differ == 0);
  }
}

TEST_CASE(
    "heading filter: pushed detections that come 0.5 s late use the walls of sorted order, however long their lead") {
  const Truth truth;
  for (const int64_t step_ms : {4, 50, 100}) {
    const int64_t lead_ns = (step_ms == 4 ? 50 : step_ms) * kMs * 3 / 2;  // a period and half of it as tolerance
    CAPTURE(step_ms);
    std::vector<Frame> frames = frames_of(truth, 60);
    for (std::size_t i = 0; i < frames.size(); ++i) frames[i].stamp_ns = kStart + int64_t(i) * step_ms * kMs;
    HeadingFilter filter(params(), kSensors, default_allocator(), lead_ns);
    std::vector<HeadingFilter::State> expected;
    int32_t differ = 0;
    const std::size_t back = std::size_t(500 / step_ms);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      add(filter, frames[i]);
      expected.push_back(filter.at(frames[i].stamp_ns - lead_ns));
      if (i < back) continue;
      const HeadingFilter::State &got = filter.at(frames[i - back].stamp_ns - lead_ns), &then = expected[i - back];
      differ += std::memcmp(got.x, then.x, sizeof got.x) != 0 || std::memcmp(got.p, then.p, sizeof got.p) != 0;
    }
    CHECK(differ == 0);
  }
}

TEST_CASE("heading filter: a frame over 0.5 s late changes nothing") {
  const Truth truth;
  const std::vector<Frame> frames = frames_of(truth, 3);
  HeadingFilter filter(params(), kSensors), other(params(), kSensors);
  for (const Frame& f : frames) add(filter, f), add(other, f);
  Frame wrong = frames[20];
  wrong.stamp_ns += 7 * kMs;
  for (WallHeading& w : wrong.walls) w.offset_rad += 0.1 * kDeg;
  add(filter, wrong);
  const HeadingFilter::State &a = filter.at(kStart + 5000 * kMs), &b = other.at(kStart + 5000 * kMs);
  CHECK(std::memcmp(a.x, b.x, sizeof a.x) == 0);
}

TEST_CASE("heading filter: single wrong walls are not used; a lasting change is, and contradicts until then") {
  Truth truth;
  HeadingFilter filter(params(), kSensors);
  for (const Frame& f : frames_of(truth, 20)) add(filter, f);
  const HeadingFilter::State before = filter.at(kStart + 25'000 * kMs);

  Frame wrong{kStart + 20'100 * kMs, Truth::cause_at(20.1), {}};
  for (int32_t s = 0; s < kSensors; ++s) wrong.walls[s] = {true, truth.offset(wrong.cause, s) + 1.5 * kDeg, 1e-8, 50};
  CHECK(filter.contradicts(before, wrong.cause, wrong.walls));
  add(filter, wrong);
  CHECK(filter.at(kStart + 25'000 * kMs).x[2] == before.x[2]);
  wrong.walls[0].valid = wrong.walls[1].valid = wrong.walls[2].valid = false;
  CHECK_FALSE(filter.contradicts(before, wrong.cause, wrong.walls));

  for (double& c : truth.constant_rad) c += 1.5 * kDeg;  // the localisation starts again
  for (const Frame& f : frames_of(truth, 5, 0.05, 20.2)) add(filter, f);
  CHECK(error_deg(filter, truth, 26, 0) < 0.15);
}

TEST_CASE(
    "heading filter: a sensor whose mounting changes is learned anew, also while the others agree with the model") {
  Truth truth;
  HeadingFilter filter(params(), kSensors);
  for (const Frame& f : frames_of(truth, 20)) add(filter, f);
  truth.constant_rad[1] += 1 * kDeg;
  for (const Frame& f : frames_of(truth, 12, 0.05, 20.05)) {
    add(filter, f);
    CHECK(error_deg(filter, truth, 20.05, 0) < 0.15);
  }
  CHECK(error_deg(filter, truth, 33, 1) < 0.15);
  CHECK(error_deg(filter, truth, 33, 0) < 0.1);
  CHECK(error_deg(filter, truth, 33, 2) < 0.1);
}

TEST_CASE("heading filter: frames of one second count as one, however many they are") {
  const Truth truth;
  HeadingFilterParams independent = params();
  independent.wall_memory_s = 0;
  HeadingFilter filter(params(), kSensors), naive(independent, kSensors);
  for (const Frame& f : frames_of(truth, 4)) add(filter, f), add(naive, f);
  const int64_t end_ns = kStart + 10'000 * kMs;
  const double sigma = std::sqrt(filter.at(end_ns).variance(Truth::cause_at(4), 0, kSensors));
  const double small = std::sqrt(naive.at(end_ns).variance(Truth::cause_at(4), 0, kSensors));
  CHECK(sigma > 2 * small);
  CHECK(sigma > 0.02 * kDeg);
}

TEST_CASE("heading filter: after a jump of the clock it keeps what it learned, and takes older stamps") {
  const Truth truth;
  HeadingFilter filter(params(), kSensors);
  for (const Frame& f : frames_of(truth, 20)) add(filter, f);
  const HeadingFilter::State before = filter.at(kStart + 30'000 * kMs);
  filter.restart();
  CHECK(std::memcmp(filter.at(kStart - 900 * kMs).x, before.x, sizeof before.x) == 0);
  Truth changed = truth;
  changed.constant_rad[0] += 0.1 * kDeg;
  for (const Frame& f : frames_of(changed, 5)) add(filter, f);
  CHECK(filter.at(kStart + 6000 * kMs).x[2] > before.x[2]);
}

TEST_CASE("heading filter: the slip's cause is the force across the vehicle's plane") {
  EgoPose pose;
  pose.speed_mps = 60;
  pose.yaw_rate_rps = 0.25;
  CHECK(cause_of(pose).accel_mps2 == doctest::Approx(15));
  CHECK(cause_of(pose).curvature_per_m == doctest::Approx(0.25 / 60));
  pose.roll_rad = -20 * kDeg;  // a left turn banked to the inside: gravity helps
  CHECK(cause_of(pose).accel_mps2 == doctest::Approx(15 * std::cos(20 * kDeg) - 9.81 * std::sin(20 * kDeg)));
}

TEST_CASE("heading filter: turns and straights at several speeds tell the lever from the slip") {
  const Truth truth;
  HeadingFilter filter(params(), kSensors);
  for (const Frame& f : frames_of(truth, 240)) add(filter, f);
  CHECK(filter.at(kStart + 250'000 * kMs).x[1] == doctest::Approx(Truth::kLever_m).epsilon(0.2));
}

TEST_CASE("heading filter: the course of a car with tyres turns later than the car") {
  // A bicycle whose rear tyres slip by 0.001 rad per m/s^2: course - heading = -slip * speed * (rate of the course).
  constexpr double kSlip = 1e-3, kSpeed = 72, kFine_s = 1e-4;
  EgoWindow in, out;
  std::vector<double> course_rate;
  double heading = 0, course = 0;
  for (int32_t k = 0; k < 10'000; ++k) {
    const double t = k * kFine_s, rate = t < 0.5 ? 0 : std::min(0.3, 0.6 * (t - 0.5));
    const double course_rps = (heading - course) / (kSlip * kSpeed);
    if (k % 100 == 0) {
      EgoPose& pose = in.poses[in.count++] = {};
      pose.stamp_ns = kStart + int64_t(t * 1e9);
      pose.speed_mps = kSpeed;
      pose.yaw_rate_rps = rate;
      course_rate.push_back(course_rps);
    }
    heading += rate * kFine_s;
    course += course_rps * kFine_s;
  }
  follow_course(in, out);
  REQUIRE(out.count == in.count);
  double worst = 0, worst_of_yaw = 0;
  for (int32_t i = 0; i < out.count; ++i) {
    worst = std::max(worst, std::fabs(out.poses[i].yaw_rate_rps - course_rate[std::size_t(i)]));
    worst_of_yaw = std::max(worst_of_yaw, std::fabs(in.poses[i].yaw_rate_rps - course_rate[std::size_t(i)]));
  }
  CHECK(worst_of_yaw > 0.04);
  CHECK(worst < 0.1 * worst_of_yaw);

  for (int32_t i = 0; i < in.count; ++i) in.poses[i].yaw_rate_rps = 0.2;  // steady: at once
  follow_course(in, out);
  for (int32_t i = 0; i < out.count; ++i) CHECK(out.poses[i].yaw_rate_rps == doctest::Approx(0.2));
  in.count = 0;
  follow_course(in, out);
  CHECK(out.count == 0);
}
