// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How simulated cars drive, the errors of the localisation, and the limits of scenario files.
#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "tools/io/error.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

CarPlan passing_plan() {
  CarPlan plan;
  plan.name = "a";
  plan.start_s_m = 500, plan.start_d_m = -2, plan.start_speed_mps = 60;
  plan.speed = {{2, 72, 4}};
  plan.lane = {{3, 2.5, 2.6}};
  return plan;
}

std::string refusal(const CarPlan& plan) {
  const Track track = Track::make("oval");
  try {
    const Motion motion(track, plan, 8);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("sim: a car's centre of gravity moves by its speed and course, its body like a bicycle with slip") {
  const Track track = Track::make("oval");
  const Motion motion(track, passing_plan(), 12);
  constexpr double kDt = 0.004;
  double most_slip = 0;
  for (double t = 1; t < 11; t += 0.0377) {
    const auto cg = [&](double at) { return motion.at(at).T_map_vehicle * Vec3{kRearAxleToCg, 0, 0}; };
    const Vec3 v = (cg(t + kDt) - cg(t - kDt)) * (0.5 / kDt);
    const CarState state = motion.at(t);
    REQUIRE(std::hypot(v.x, v.y) == doctest::Approx(state.speed_mps).epsilon(2e-3));
    REQUIRE(std::fabs(wrap_angle(std::atan2(v.y, v.x) - state.course_rad)) < 1e-3);
    // The rear wheels roll along the body, except for their slip, which cornering in the road's plane explains.
    const double side = state.course_rad - state.heading_rad;
    const TrackPoint p = track.at(state.s_m);
    const double in_plane = state.accel_across_mps2 * std::cos(p.banking_rad) - kGravity * std::sin(p.banking_rad);
    const double rolling = state.speed_mps / kRearAxleToCg * (side + in_plane / kSlipStiffness);
    REQUIRE(std::fabs(rolling - state.yaw_rate_rps) < 0.02);
    most_slip = std::fmax(most_slip, std::fabs(in_plane / kSlipStiffness));
    // The car stands on the road: all four wheels within 5 cm of the surface (a rigid car on a twisted bank).
    for (const double x : {0.0, kWheelBase})
      for (const double y : {-0.8, 0.8}) {
        const Vec3 foot = state.T_map_vehicle * Vec3{x, y, 0};
        const Vec3 road = track.place(state.s_m + (x - kRearAxleToCg) / (1 - p.curvature_pm * state.d_m),
                                      state.d_m + y * std::cos(p.banking_rad));
        REQUIRE(std::fabs(foot.z - road.z) < 0.05);
      }
  }
  CHECK(most_slip > 0.005);
}

TEST_CASE("sim: a spin rotates the body and does not change the path") {
  const Track track = Track::make("oval");
  CarPlan plan = passing_plan();
  plan.spin = {{4, 1.5, 4}};
  const Motion spinning(track, plan, 12), straight(track, passing_plan(), 12);
  for (double t = 0; t < 11; t += 0.5) {
    CHECK(spinning.at(t).course_rad == doctest::Approx(straight.at(t).course_rad));
    CHECK(spinning.at(t).s_m == doctest::Approx(straight.at(t).s_m));
  }
  CHECK(spinning.at(10).heading_rad - straight.at(10).heading_rad == doctest::Approx(3 * kPi));
  CHECK(spinning.at(6).yaw_rate_rps > 3);
}

TEST_CASE("sim: a plan that no car can drive is refused with name, time and value") {
  CHECK(refusal(passing_plan()) == "");
  CarPlan brake = passing_plan();
  brake.speed = {{1, 10, 2}};
  CHECK(refusal(brake).find("car 'a' at ") == 0);
  CHECK(refusal(brake).find("acceleration along") != std::string::npos);
  CarPlan swerve = passing_plan();
  swerve.lane = {{1, 5, 0.5}};
  CHECK(refusal(swerve).find("acceleration across") != std::string::npos);
  CarPlan fast = passing_plan();
  fast.start_speed_mps = 98;
  CHECK(refusal(fast).find("speed in m/s 98.0 is beyond 97.2") != std::string::npos);
  CarPlan overlap = passing_plan();
  overlap.speed = {{1, 62, 2}, {2, 64, 2}};
  CHECK(refusal(overlap).find("overlap") != std::string::npos);
}

TEST_CASE("sim: the localisation has the given errors: noise, course for heading, a jump, a silence, latency") {
  const Track track = Track::make("oval");
  const Motion motion(track, passing_plan(), 12);
  LocalisationErrors errors;
  errors.jumps = {{4, 1.5, 0, 2}};
  errors.drop_outs = {{8, 1}};
  const auto poses = localise(motion, errors, 10, Random(5));
  CHECK(poses.size() == 901);
  double squares = 0, heading_off = 0, slip = 0;
  int count = 0, jumped = 0;
  for (const EgoPose& p : poses) {
    const double t = double(p.stamp_ns) * 1e-9;
    CHECK((t < 8 || t >= 9));
    CHECK(p.publish_ns - p.stamp_ns == 20'000'000);
    const CarState state = motion.at(t);
    const double off = p.x_m - state.T_map_vehicle.place.x;
    if (t >= 4 && t < 6) {
      jumped += std::fabs(off - 1.5) < 0.2;
      continue;
    }
    squares += off * off, ++count;
    heading_off += wrap_angle(p.yaw_rad - state.heading_rad), slip += state.course_rad - state.heading_rad;
  }
  CHECK(jumped == 200);
  CHECK(std::sqrt(squares / count) < 0.08);
  CHECK(std::sqrt(squares / count) > 0.005);
  CHECK(std::fabs(heading_off - slip) / count < 5e-4);
  CHECK(std::fabs(slip / count) > 0.005);
}

TEST_CASE("sim: every built-in scenario can be driven, and no seed is used for both tuning and testing") {
  const auto names = builtin_scenario_names();
  CHECK(names.size() >= 14);
  for (const std::string& name : names) {
    CAPTURE(name);
    const Scenario scenario = load_scenario(name);
    CHECK(scenario.name == name);
    CHECK(scenario.tune_seeds.size() >= 3);
    CHECK(scenario.test_seeds.size() >= 3);
    const World world(scenario);
    const bool beside = name == "dust" || name == "pit_lane";
    double most = 0, least_gap = 1e9;
    for (double t = 0; t < scenario.seconds; t += 0.05) {
      const auto rows = truth_at(world, t);
      for (const TruthRow& r : rows) {
        most = std::fmax(most, r.state.speed_mps);
        const TrackPoint p = world.track.at(r.state.s_m);
        REQUIRE(r.state.d_m < p.width_left_m + (beside ? 28 : -0.9));  // on the road, or on the ground beside it
        REQUIRE(r.state.d_m > -p.width_right_m + 0.9);
        if (r.is_ego) continue;
        // No two cars overlap: side by side they are 1.9 m apart, else a car's length.
        const double along = std::fabs(r.in_ego.x - kCarCenterXM), across = std::fabs(r.in_ego.y);
        least_gap = std::fmin(least_gap, std::fmax(along - 4.95, across - 1.9));
      }
    }
    CHECK(most * 3.6 < (name == "full_speed" ? 320.001 : 278.001));
    CHECK(least_gap > 0);
  }
}

TEST_CASE("sim: the fifteen overtakes happen, on both sides, by both cars") {
  const World world(load_scenario("las_vegas_15"));
  int by_ego = 0, by_other = 0, left = 0, right = 0;
  double before = 0;
  for (double t = 0; t < load_scenario("las_vegas_15").seconds; t += 0.02) {
    const auto rows = truth_at(world, t);
    const TruthRow& other = rows[1];
    const double ahead = other.state.s_m - rows[0].state.s_m;
    if (t > 0 && before > 0 && ahead <= 0) ++by_ego, ++(other.in_ego.y > 0 ? right : left);
    if (t > 0 && before < 0 && ahead >= 0) ++by_other, ++(other.in_ego.y > 0 ? left : right);
    before = ahead;
  }
  CHECK(by_ego == 8);
  CHECK(by_other == 7);
  CHECK(left == 8);
  CHECK(right == 7);
}

TEST_CASE("sim: a wrong scenario file is refused with file and line") {
  const auto refused = [](const std::string& text) {
    try {
      parse_scenario("race.toml", text);
    } catch (const io::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string car = "[[car]]\nname = \"ego\"\n";
  CHECK(refused(car) == "");
  CHECK(refused("seconds = 5\ntrack = \"moon\"\n" + car).find("race.toml:2: ") == 0);
  CHECK(refused(car + "colour = 3\n").find("race.toml:3: ") == 0);
  CHECK(refused("ego = \"b\"\n" + car).find("no car is named 'b'") != std::string::npos);
  CHECK(refused(car + car).find("two cars have this name") != std::string::npos);
  CHECK(refused("tune_seeds = [1, 2]\ntest_seeds = [2]\n" + car).find("race.toml:2: ") == 0);
  CHECK(refused(car + "[sensors]\npattern = \"spiral\"\n").find("race.toml:4: sensors: no scan pattern is named") == 0);
  CHECK(refused(car + "[sensors]\nfov_top_deg = 1\nfov_bottom_deg = 2\n").find("must be above") != std::string::npos);
  CHECK(refused(car + "[[smoke]]\ncar = \"x\"\nfrom_s = 1\nto_s = 2\n").find("race.toml:4: ") == 0);
  CHECK(refused(car + "[rain]\nwet_floor = 0.5\n").find("mm_per_h") != std::string::npos);
  CHECK(refused(car + "[rain]\nmm_per_h = 20\nwet_floor = 2\n").find("race.toml:5: ") == 0);
  CHECK(refused(car + "[rain]\nmm_per_h = 0\n").find("race.toml:4: ") == 0);
  CHECK(refused(car + "[rain]\nmm_per_h = 20\ndrops = 1\n").find("race.toml:5: ") == 0);
  CHECK(refused("[[car]]\nname = 'e\"go'\n").find("race.toml:2: ") == 0);
  CHECK(refused(car + "[[car]]\nname = \"b\"\n[[overtake]]\npasser = \"egoo\"\npasser_kmh = 250\n"
                      "passed_kmh = 200\nside = \"left\"\n")
            .find("race.toml:6: overtake: no car is named 'egoo'") == 0);
  CHECK_THROWS_AS(load_scenario("no_such_race"), io::Error);
}

TEST_CASE("sim: an overtake's passer is the car of that name, in any order of the cars and with any name of the ego") {
  for (const bool ego_first : {true, false})
    for (const bool ego_passes : {true, false}) {
      const std::string hero = "[[car]]\nname = \"hero\"\n", other = "[[car]]\nname = \"other\"\n";
      const Scenario scenario =
          parse_scenario("race.toml", "ego = \"hero\"\n" + (ego_first ? hero + other : other + hero) +
                                          "[[overtake]]\npasser = \"" + (ego_passes ? "hero" : "other") +
                                          "\"\npasser_kmh = 250\npassed_kmh = 150\nside = \"left\"\n");
      const CarPlan& ego = scenario.cars[std::size_t(scenario.find_car("hero"))];
      const CarPlan& rival = scenario.cars[std::size_t(scenario.find_car("other"))];
      CHECK((ego.start_speed_mps > rival.start_speed_mps) == ego_passes);
    }
}
