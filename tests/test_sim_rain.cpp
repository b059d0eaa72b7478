// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Simulated rain: how many drops return, where and how brightly; what the rest of a scan loses.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/sim/link_budget.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

constexpr Fan kFan = {kShotStep, 0.0015, kShots};

// Returns in one beam from 0.5 to 15 m, by integrals over range and distance from the beam's middle: a drop returns if
// its share of the beam is large enough, and drops of at least that size are so many.
double expected_returns(const Rain& rain) {
  const double slope = 4100 * std::pow(rain.mm_per_h, -0.21);
  const double needed = (kThreshold - 3.5) / (received_signal(1, kFullGain) * rain.drop_reflectivity);
  double sum = 0;
  for (double range = 0.505; range < 15; range += 0.01) {
    const double width = kAperture + kFan.beam_rad * range, step = width / 400;
    for (double off = step / 2; off < width; off += step) {
      const double diameter = width * std::sqrt(needed / 2) * std::exp(4 * off * off / (width * width));
      sum += 0.01 * 2 * kPi * off * step * 8e6 / slope * std::exp(-slope * diameter);
    }
  }
  return sum;
}

struct Counts {
  double rain = 0, far_road = 0, far_wall = 0, bright = 0;
};
Counts count(const Scenario& scenario) {
  Simulator simulator(scenario, 3, 1, 2);
  Counts counts;
  for (int32_t k = 0; k < 4; ++k)
    for (const Scan& scan : simulator.frame(k).scans)
      for (std::size_t i = 0; i < scan.size(); ++i) {
        const float range = std::hypot(scan.x_m[i], scan.y_m[i], scan.z_m[i]);
        const Surface surface = Surface(scan.surface[i]);
        counts.far_road += surface == Surface::road && range > 25;
        counts.far_wall += surface == Surface::outer_wall && range > 100;
        if (surface != Surface::rain) continue;
        counts.rain += 1;
        counts.bright += scan.intensity[i] > 0.005f;
        CHECK(range < 15.5f);
      }
  return counts;
}

}  // namespace

TEST_CASE("sim: drops in the beams are as many as the distribution of their sizes says") {
  for (const double mm_per_h : {2.0, 20.0, 80.0})
    for (const double reflectivity : {0.02, 0.3}) {
      CAPTURE(mm_per_h);
      CAPTURE(reflectivity);
      Rain rain;
      rain.mm_per_h = mm_per_h, rain.drop_reflectivity = reflectivity;
      const double expected = expected_returns(rain);
      const int32_t lines = int32_t(std::clamp(20000 / (expected * kShots), 40.0, 4000.0));
      std::vector<DropReturn> drops;
      double returns = 0;
      for (int32_t line = 0; line < lines; ++line) {
        drops.clear();
        catch_drops(rain, kFan, 0.5, Random(uint64_t(line)), drops);
        returns += double(drops.size());
        CHECK(std::is_sorted(drops.begin(), drops.end(), [](const DropReturn& a, const DropReturn& b) {
          return a.shot != b.shot ? a.shot < b.shot : a.range_m < b.range_m;
        }));
        for (const DropReturn& drop : drops) {
          REQUIRE((drop.shot >= 0 && drop.shot < kShots));
          REQUIRE((drop.range_m >= 0.5 && drop.range_m < 15));
          REQUIRE((drop.share > 0 && drop.share <= 1));
        }
      }
      CHECK(returns / (lines * kShots) == doctest::Approx(expected).epsilon(0.04));
    }
  std::vector<DropReturn> none;
  catch_drops(Rain(), kFan, 0.5, Random(1), none);
  CHECK(none.empty());
}

TEST_CASE("sim: rain returns near the sensors, darkens the road and hides what is far") {
  Scenario wet = load_scenario("rain"), dry = wet;
  wet.puffs.clear(), dry.puffs.clear();
  dry.rain.mm_per_h = 0;
  CHECK(wet.rain.extinction_pm() == doctest::Approx(8.0 / 4343).epsilon(0.01));  // 8 dB/km
  const Counts rain = count(wet), none = count(dry);
  const double beams = 4 * 3 * 32 * 2 * kShots;
  CHECK(none.rain == 0);
  CHECK(rain.rain > 0.01 * beams);
  CHECK(rain.rain < 0.04 * beams);
  CHECK(rain.bright < 0.01 * rain.rain);
  CHECK(rain.far_road < 0.9 * none.far_road);
  CHECK(rain.far_wall < 0.9 * none.far_wall);
  wet.rain.drop_reflectivity = 0.3;
  const Counts bright = count(wet);
  CHECK(bright.rain > 1.5 * rain.rain);
  CHECK(bright.bright > 0.03 * bright.rain);
  wet.rain.mm_per_h = 2;
  CHECK(count(wet).rain < 0.5 * bright.rain);
}

TEST_CASE("sim: rain is the same with any number of workers") {
  const Scenario scenario = load_scenario("rain");
  Simulator one(scenario, 5, 1, 1), two(scenario, 5, 1, 2);
  const SimFrame a = one.frame(7), b = two.frame(7);
  for (int32_t s = 0; s < kSensors; ++s) {
    CHECK(a.scans[std::size_t(s)].x_m == b.scans[std::size_t(s)].x_m);
    CHECK(a.scans[std::size_t(s)].surface == b.scans[std::size_t(s)].surface);
  }
}
