// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Errors that a localisation shows in its own poses: what is found, and what becomes of the pose.
#include "pipeline/pose_repair.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/math.h"
#include "tests/support/one_sensor_detector.h"

namespace {

using namespace overtake;
using test::Small;

constexpr double kDegree = kPi / 180;
using Found = PoseRepair::Found;
constexpr uint32_t kHeld = uint32_t(Found::kHeld), kLost = uint32_t(Found::kLost),
                   kWrongRate = uint32_t(Found::kWrongRate), kNoise = uint32_t(Found::kNoise);

// A vehicle at 60 m/s: straight on, in a bend from 1 to 4 s, and up a slope of 3 %.
EgoPose drive_at(int64_t ns) {
  EgoPose pose;
  pose.stamp_ns = ns;
  const double t = double(ns) * 1e-9, bend_s = std::clamp(t - 1.0, 0.0, 3.0), rate = 0.3;
  pose.yaw_rad = wrap_angle(3.0 + rate * bend_s);
  pose.yaw_rate_rps = t > 1.0 && t < 4.0 ? rate : 0.0;
  pose.speed_mps = 60.0;
  pose.pitch_rad = -std::asin(0.03);
  const double level_mps = 60.0 * std::cos(pose.pitch_rad), before_m = level_mps * std::min(t, 1.0);
  const double after_m = level_mps * std::max(t - 4.0, 0.0), radius_m = level_mps / rate;
  pose.x_m = before_m * std::cos(3.0) + radius_m * (std::sin(3.0 + rate * bend_s) - std::sin(3.0)) +
             after_m * std::cos(3.0 + rate * 3.0);
  pose.y_m = before_m * std::sin(3.0) - radius_m * (std::cos(3.0 + rate * bend_s) - std::cos(3.0)) +
             after_m * std::sin(3.0 + rate * 3.0);
  pose.z_m = 60.0 * 0.03 * t;
  return pose;
}

using Spoil = std::function<void(EgoPose&)>;
struct Repaired {
  EgoPose good, pose;  // without the error; after the repair
  uint32_t found;
};

// Six seconds of it.
std::vector<Repaired> run(int64_t step_ms, const Spoil& spoil) {
  PoseRepair repair;
  repair.build();
  std::vector<Repaired> out;
  for (int64_t ns = 0; ns < 6'000'000'000; ns += step_ms * 1'000'000) {
    Repaired r = {drive_at(ns), drive_at(ns), 0};
    spoil(r.pose);
    r.found = repair.repair(r.pose);
    out.push_back(r);
  }
  return out;
}

bool same(const EgoPose& a, const EgoPose& b) {
  return a.x_m == b.x_m && a.y_m == b.y_m && a.z_m == b.z_m && a.yaw_rad == b.yaw_rad &&
         a.yaw_rate_rps == b.yaw_rate_rps && a.speed_mps == b.speed_mps;
}

}  // namespace

TEST_CASE("pose repair: good poses, and those of another order than the stamps', stay as they are") {
  for (const int64_t step_ms : {1, 10, 50, 100, 200, 300})
    for (const Repaired& r : run(step_ms, [](EgoPose&) {})) {
      CHECK(r.found == 0);
      CHECK(same(r.good, r.pose));
    }
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto noise = [&](EgoPose& pose) {  // as good as a localisation with RTK, its heading off the course by 3 deg
    pose.x_m += 0.015 * normal(random), pose.y_m += 0.015 * normal(random), pose.z_m += 0.01 * normal(random);
    pose.yaw_rad += 0.05 + 0.2 * kDegree * normal(random);
    pose.yaw_rate_rps += 0.01 * normal(random);
    pose.speed_mps *= 1.03;
  };
  for (const int64_t step_ms : {10, 20, 50})
    for (const Repaired& r : run(step_ms, noise)) CHECK(r.found == 0);
  PoseRepair repair;
  repair.build();
  for (const int64_t ms : {100, 50, 100, 1000, 990, 20}) {
    EgoPose pose = drive_at(ms * 1'000'000);
    CHECK(repair.repair(pose) == 0);
    CHECK(same(pose, drive_at(ms * 1'000'000)));
  }
}

TEST_CASE("pose repair: without build nothing is found") {
  PoseRepair repair;
  for (int32_t k = 0; k < 20; ++k) {
    EgoPose pose = drive_at(0);
    pose.stamp_ns = k * 10'000'000;
    CHECK(repair.repair(pose) == 0);
  }
}

TEST_CASE("pose repair: a place that is held at speed moves on by speed and yaw for 0.15 s, then it is lost") {
  for (const int64_t step_ms : {1, 10, 50}) {
    CAPTURE(step_ms);
    PoseRepair repair;
    repair.build();
    EgoPose measured;
    int32_t held = 0, lost = 0;
    for (int64_t ms = 0; ms < 3000; ms += step_ms) {
      EgoPose pose = drive_at(ms * 1'000'000);
      const EgoPose good = pose;
      const bool hangs = ms > 2000 && ms < 2500;
      if (hangs) {
        pose = measured, pose.stamp_ns = good.stamp_ns;
      } else {
        measured = pose;
      }
      const uint32_t found = repair.repair(pose);
      CHECK(found == (!hangs ? 0 : ms <= 2150 ? kHeld : kHeld | kLost));
      held += found != 0, lost += (found & kLost) != 0;
      if (found & kLost) continue;
      CHECK(std::hypot(pose.x_m - good.x_m, pose.y_m - good.y_m) < 0.05);
      CHECK(std::fabs(pose.z_m - good.z_m) < 0.01);
      CHECK(std::fabs(wrap_angle(pose.yaw_rad - good.yaw_rad)) < 1e-6);
    }
    CHECK(held > lost);
    CHECK(lost > 0);
  }
}

TEST_CASE(
    "pose repair: a place that never moved, or at which the vehicle stands, is not held; a yaw goes on by itself") {
  for (const double speed_mps : {60.0, -60.0, 0.5}) {
    PoseRepair repair;
    repair.build();
    EgoPose pose = drive_at(0);
    pose.speed_mps = speed_mps;
    const auto after_10_ms = [&](double step_m, double turn_rad) {
      pose.stamp_ns += 10'000'000;
      pose.x_m += step_m, pose.yaw_rad += turn_rad;
      EgoPose out = pose;
      const uint32_t found = repair.repair(out);
      CHECK(out.yaw_rad == pose.yaw_rad);
      return found;
    };
    for (int32_t k = 0; k < 50; ++k) CHECK(after_10_ms(0.0, 0.0) == 0);  // on rollers
    CHECK(after_10_ms(0.6, 0.0) == 0);
    CHECK(repair.repair(pose) == 0);  // the same stamp: a duplicate, which the buffer refuses
    CHECK(after_10_ms(0.0, 0.001) == (std::fabs(speed_mps) > 1.0 ? kHeld : 0));
    CHECK(after_10_ms(0.6, 0.0) == 0);
  }
}

TEST_CASE("pose repair: a yaw rate of the wrong sign or unit, or never set, becomes that of the yaws") {
  const Spoil errors[] = {[](EgoPose& pose) { pose.yaw_rate_rps = -pose.yaw_rate_rps; },
                          [](EgoPose& pose) { pose.yaw_rate_rps = 0.0; },
                          [](EgoPose& pose) { pose.yaw_rate_rps /= kDegree; }};
  for (const int64_t step_ms : {1, 10, 20, 50, 100})
    for (const Spoil& error : errors) {
      CAPTURE(step_ms);
      bool any = false;
      for (const Repaired& r : run(step_ms, error)) {
        const double t = double(r.good.stamp_ns) * 1e-9;
        CHECK(r.pose.yaw_rad == r.good.yaw_rad);
        if (t < 1.0) CHECK(r.found == 0);
        any = any || r.found == kWrongRate;
        // Found within a second of the bend; from then on also on the straight, where the wrong one cannot be told.
        if (t > 2.0) CHECK(r.found == kWrongRate);
        if ((t > 2.0 && t < 4.0) || t > 4.4) CHECK(std::fabs(r.pose.yaw_rate_rps - r.good.yaw_rate_rps) < 1e-6);
      }
      CHECK(any);
    }
}

TEST_CASE("pose repair: a late pose changes nothing, after a gap or a jump of the clock the window begins anew") {
  PoseRepair repair;
  repair.build();
  const auto push = [&](int64_t ms, int64_t offset_ms = 0) {
    EgoPose pose = drive_at(ms * 1'000'000);
    pose.stamp_ns += offset_ms * 1'000'000;
    pose.yaw_rate_rps = 0.0;
    return repair.repair(pose);
  };
  uint32_t found = 0;
  for (int64_t ms = 0; ms < 2500; ms += 10) {
    found = push(ms);
    if (ms % 100 == 0) CHECK(push(ms - 30) == 0);
    CHECK(push(ms) == 0);  // a duplicate
  }
  CHECK(found == kWrongRate);
  for (const int64_t offset_ms : {500, -60'000}) {
    repair = {};
    repair.build();
    for (int64_t ms = 1500; ms < 2200; ms += 10) CHECK(push(ms) == 0);
    for (int64_t ms = 2200; ms < 2900; ms += 10) CHECK(push(ms, offset_ms) == 0);  // 0.7 s are too few
  }
}

TEST_CASE("pose repair: a step of the yaw is no wrong rate, and a rate is right again when a bend shows it") {
  for (const Repaired& r : run(10, [](EgoPose& pose) {
         if (pose.stamp_ns > 2'500'000'000) pose.yaw_rad += 3 * kDegree;
       }))
    CHECK(r.found == 0);
  // A vehicle on a bank: the rate about its axis is smaller by the cosine of the roll.
  for (const bool about_axis : {true, false})
    for (const Repaired& r : run(10, [about_axis](EgoPose& pose) {
           pose.roll_rad = -0.6;
           if (about_axis) pose.yaw_rate_rps *= std::cos(0.6);
         }))
      CHECK(r.found == 0);
  // After a jump of the place, and after a gap, a rate that is known to be wrong is replaced at once.
  int64_t last_ns = 0;
  PoseRepair repair;
  repair.build();
  for (int64_t ms = 0; ms < 3500; ms += ms == 2800 ? 300 : 10) {
    EgoPose pose = drive_at(ms * 1'000'000);
    if (ms > 2500) pose.x_m += 30.0;
    pose.yaw_rate_rps = 0.0;
    const uint32_t found = repair.repair(pose);
    if (ms < 2200) continue;
    CHECK((found & kWrongRate) != 0);
    CHECK(std::fabs(pose.yaw_rate_rps - 0.3) < 1e-6);
    last_ns = pose.stamp_ns;
  }
  CHECK(last_ns > 3'400'000'000);
  const std::vector<Repaired> all = run(10, [](EgoPose& pose) {
    if (pose.stamp_ns < 2'200'000'000) pose.yaw_rate_rps = 0.0;
  });
  CHECK(all[219].found == kWrongRate);
  for (const Repaired& r : all)
    if (r.good.stamp_ns > 3'300'000'000) CHECK(same(r.good, r.pose));
}

TEST_CASE("pose repair: noise of a place is smoothed, a jump is not") {
  for (const int32_t axis : {0, 1, 2})
    for (const int64_t step_ms : {10, 20, 50}) {
      CAPTURE(axis);
      CAPTURE(step_ms);
      std::mt19937 random(7);
      std::normal_distribution<double> normal;
      const auto place = [axis](EgoPose& p) -> double& { return axis == 0 ? p.x_m : axis == 1 ? p.y_m : p.z_m; };
      double before = 0, after = 0;
      int32_t count = 0, found = 0;
      for (Repaired r : run(step_ms, [&](EgoPose& pose) { place(pose) += 0.12 * normal(random); })) {
        if (r.good.stamp_ns < 1'200'000'000) continue;
        ++count;
        found += r.found == kNoise;
        const double error = place(r.pose) - place(r.good);
        after += error * error, before += 0.12 * 0.12;
        EgoPose &good = r.good, &pose = r.pose;
        if (axis != 0) CHECK(pose.x_m == good.x_m);
        if (axis != 2) CHECK(pose.z_m == good.z_m);
        CHECK(pose.yaw_rad == good.yaw_rad);
      }
      CHECK(found > 0.95 * count);
      CHECK(after < (step_ms == 50 ? 0.5 : 0.2) * before);
    }
  // 3 m to the side, with noise: at once, and with the noise of one pose until the line is long enough.
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const Repaired& r :
       run(10, [&](EgoPose& pose) { pose.y_m += 0.12 * normal(random) + (pose.stamp_ns > 3'000'000'000 ? 3.0 : 0.0); }))
    CHECK(std::fabs(r.pose.y_m - r.good.y_m - (r.good.stamp_ns > 3'000'000'000 ? 3.0 : 0.0)) < 0.5);
}

// Accelerations that speed, yaw and pitch do not tell: a slide whose angle grows, a spin that slides straight on, a
// crest with pitch 0, and a speed that was never set.
TEST_CASE("pose repair: a steady acceleration that the pose does not tell is no noise") {
  const auto poses = [](int64_t step_ms, const std::function<void(EgoPose&, double)>& make) {
    PoseRepair repair;
    repair.build();
    int32_t found = 0;
    for (int64_t ms = 0; ms < 4000; ms += step_ms) {
      EgoPose pose;
      pose.stamp_ns = ms * 1'000'000;
      make(pose, double(ms) * 1e-3);
      const EgoPose given = pose;
      found += repair.repair(pose) != 0;
      CHECK(same(given, pose));
    }
    return found;
  };
  for (const int64_t step_ms : {10, 20, 50}) {
    CHECK(poses(step_ms, [](EgoPose& p, double t) {
            p.x_m = 70 * t, p.speed_mps = 70, p.yaw_rad = 0.07 * t, p.yaw_rate_rps = 0.07;
          }) == 0);
    CHECK(poses(step_ms, [](EgoPose& p, double t) {
            p.x_m = 50 * t - 4 * t * t, p.speed_mps = 50 - 8 * t, p.yaw_rad = 0.3 * t, p.yaw_rate_rps = 0.3;
          }) == 0);
    CHECK(poses(step_ms, [](EgoPose& p, double t) {
            p.x_m = 60 * t, p.z_m = -3.6 * t * t, p.speed_mps = 60, p.roll_rad = 0.01;
          }) == 0);
    CHECK(poses(step_ms, [](EgoPose& p, double t) {
            p.x_m = 200 * std::sin(0.3 * t), p.y_m = 200 * (1 - std::cos(0.3 * t)), p.yaw_rad = 0.3 * t;
            p.yaw_rate_rps = 0.3;
          }) == 0);
  }
}

TEST_CASE("pose repair: preset best counts what it finds, tells a wrong rate once, and paper looks at nothing") {
  for (const bool best : {true, false}) {
    Small small(best ? 1 : 0);
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, best ? "best" : "paper") == OVT_OK);
    small.def.params = &params;
    static int32_t of_rate, of_place;
    of_rate = of_place = 0;
    small.def.log = [](ovt_log_level level, const char* text, void*) {
      of_rate += level == OVT_LOG_WARNING && std::string(text).find("yaw_rate_rps") != std::string::npos;
      of_place += level == OVT_LOG_WARNING && std::string(text).find("stay the same") != std::string::npos;
    };
    small.create();
    int32_t pushed = 0;
    for (int64_t ns = 0; ns < 3'000'000'000; ns += 10'000'000, ++pushed) {
      const EgoPose at = drive_at(ns);
      ovt_ego_pose pose;
      REQUIRE(ovt_ego_pose_init(&pose, sizeof pose) == OVT_OK);
      pose.stamp_ns = ns;
      pose.x_m = at.x_m, pose.y_m = at.y_m, pose.z_m = at.z_m, pose.yaw_rad = at.yaw_rad, pose.pitch_rad = at.pitch_rad;
      pose.speed_mps = at.speed_mps;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
      pose.stamp_ns += 1'000'000;
      REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
      if (ns != 2'990'000'000) continue;
      for (int32_t k = 0; k < 20; ++k) {  // 0.2 s
        pose.stamp_ns += 10'000'000;
        REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
      }
    }
    const ovt_stats stats = small.stats();
    CHECK(stats.ego_held == (best ? pushed - 1 + 20 : 0));  // the first two show no motion
    CHECK(stats.ego_poses == 2 * pushed + 20 - (best ? 6 : 0));
    CHECK(stats.ego_dropped == (best ? 6 : 0));
    CHECK((stats.ego_rates_wrong > 100) == best);
    CHECK(stats.ego_noisy == 0);
    CHECK(of_rate == (best ? 1 : 0));
    CHECK(of_place == (best ? 1 : 0));
  }
}
