// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The simulator's tracks, its mathematics, and the map it writes.
#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

#include "tools/sim/random.h"
#include "tools/sim/simulator.h"

using namespace overtake::sim;

TEST_CASE("sim: the elementary functions agree with the C library's to 1e-13") {
  Random dice(7);
  for (int i = 0; i < 20000; ++i) {
    const double a = dice.uniform(-1000, 1000), v = dice.uniform(-20, 20), u = dice.uniform(1e-6, 1e6);
    REQUIRE(std::fabs(sin_of(a) - std::sin(a)) < 1e-12);
    REQUIRE(std::fabs(cos_of(a) - std::cos(a)) < 1e-12);
    REQUIRE(std::fabs(atan2_of(a, v) - std::atan2(a, v)) < 1e-14 * 10);
    REQUIRE(std::fabs(exp_of(v) / std::exp(v) - 1) < 1e-13);
    REQUIRE(std::fabs(log_of(u) - std::log(u)) < 1e-13 * (1 + std::fabs(std::log(u))));
    REQUIRE(std::fabs(asin_of(v / 20) - std::asin(v / 20)) < 1e-13);
  }
}

TEST_CASE("sim: random numbers are uniform and normal, and their streams are independent") {
  Random dice(3);
  double sum = 0, squares = 0, uniform = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    const double n = dice.normal();
    sum += n, squares += n * n, uniform += dice.uniform();
  }
  CHECK(std::fabs(sum / kDraws) < 0.01);
  CHECK(std::fabs(squares / kDraws - 1) < 0.02);
  CHECK(std::fabs(uniform / kDraws - 0.5) < 0.005);
  CHECK(Random(1).branch(2).bits() != Random(1).branch(3).bits());
  CHECK(Random(1).branch(2).bits() != Random(2).branch(2).bits());
  CHECK(Random(5).branch(9).bits() == Random(5).branch(9).bits());
}

TEST_CASE("sim: the oval is closed, 2,450 m long, and has its specified dimensions") {
  const Track track = Track::make("oval");
  CHECK(track.length_m() == doctest::Approx(2450));
  const TrackPoint begin = track.at(0), end = track.at(track.length_m() - 1e-6);
  CHECK(std::hypot(begin.x - end.x, begin.y - end.y) < 1e-3);
  double flattest = 1, steepest = 0, narrowest = 99, widest = 0, tightest = 0;
  for (double s = 0; s < track.length_m(); s += 1) {
    const TrackPoint p = track.at(s);
    flattest = std::fmin(flattest, p.banking_rad), steepest = std::fmax(steepest, p.banking_rad);
    narrowest = std::fmin(narrowest, p.width_left_m + p.width_right_m);
    widest = std::fmax(widest, p.width_left_m + p.width_right_m);
    tightest = std::fmax(tightest, p.curvature_pm);
    CHECK(p.curvature_pm > -1e-9);
  }
  CHECK(flattest / kDegree == doctest::Approx(6).epsilon(0.01));
  CHECK(steepest / kDegree == doctest::Approx(20).epsilon(0.01));
  CHECK(narrowest == doctest::Approx(12.5).epsilon(0.01));
  CHECK(widest == doctest::Approx(15.5).epsilon(0.01));
  CHECK(1 / tightest == doctest::Approx(223).epsilon(0.01));
  CHECK(track.at(0).banking_rad / kDegree == doctest::Approx(9).epsilon(0.01));
  CHECK(std::fabs(track.at(1225).curvature_pm) < 1e-6);  // the middle of the back stretch
}

TEST_CASE("sim: place, heading, curvature, banking and height of both tracks are smooth") {
  for (const char* name : {"oval", "road"}) {
    const Track track = Track::make(name);
    double right = 0, left = 0, low = 1e9, high = -1e9;
    for (double s = 0.13; s < track.length_m(); s += 0.37) {
      const TrackPoint a = track.at(s - 0.25), b = track.at(s), c = track.at(s + 0.25);
      const double dx = c.x - a.x, dy = c.y - a.y;
      REQUIRE(std::hypot(dx, dy) == doctest::Approx(0.5).epsilon(1e-3));          // s is the length along the line
      REQUIRE(std::fabs(wrap_angle(std::atan2(dy, dx) - b.heading_rad)) < 1e-4);  // the heading is the tangent's
      REQUIRE(std::fabs(wrap_angle(c.heading_rad - a.heading_rad) / 0.5 - b.curvature_pm) < 1e-4);
      REQUIRE(std::fabs(c.curvature_pm - a.curvature_pm) < 2e-4);
      REQUIRE(std::fabs(c.banking_rad - a.banking_rad) < 0.003);
      REQUIRE(std::fabs(track.height(s + 0.25, 3) - track.height(s - 0.25, 3)) < 0.1);
      left = std::fmax(left, b.curvature_pm), right = std::fmax(right, -b.curvature_pm);
      low = std::fmin(low, b.z), high = std::fmax(high, b.z);
    }
    if (std::string(name) == "road") {
      CHECK(left > 1 / 250.0);
      CHECK(right > 1 / 400.0);
      CHECK(high - low > 5);
    }
  }
  CHECK_THROWS_AS(Track::make("figure_eight"), std::invalid_argument);
}

TEST_CASE(
    "sim: banking and its transitions differ by seed within published figures, and the map has the same banking") {
  constexpr double kTurn1 = 510, kTurn4 = 2450 - kTurn1, kBack = 1225;
  double least_over = 1e9, most_over = 0, least_growth = 1e9, most_growth = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const Track track = Track::make("oval", Random(seed));
    const auto deg = [&](double s) { return track.at(s).banking_rad / kDegree; };
    CHECK(std::fabs(deg(0) - 9) <= 1);
    CHECK(std::fabs(deg(kTurn1) - 20) <= 1);
    CHECK(std::fabs(deg(kTurn4) - 20) <= 1);
    CHECK(std::fabs(deg(kBack) - 6) <= 2);
    CHECK(std::fabs(deg(kTurn1) - deg(kTurn4)) > 1e-6);  // each turn by itself
    // From 5 to 95 % of the change into turn 1: 0.621 of the quintic step's length.
    double from = 0, to = 0;
    for (double s = 150; s < kTurn1; s += 0.25) {
      const double share = (deg(s) - deg(0)) / (deg(kTurn1) - deg(0));
      if (share < 0.05) from = s;
      if (share < 0.95) to = s;
    }
    least_over = std::fmin(least_over, (to - from) / 0.621), most_over = std::fmax(most_over, (to - from) / 0.621);
    const TrackPoint p = track.at(kTurn1);
    const auto slope = [&](double d) { return (track.height(kTurn1, d - 0.1) - track.height(kTurn1, d + 0.1)) / 0.2; };
    const double growth = (std::atan(slope(-p.width_right_m)) - std::atan(slope(p.width_left_m - 0.2))) / kDegree;
    least_growth = std::fmin(least_growth, growth), most_growth = std::fmax(most_growth, growth);
    CHECK(track.height(kTurn1, p.width_left_m) == doctest::Approx(0));  // the inner edge
  }
  CHECK(least_over > 158);
  CHECK(least_over < 185);
  CHECK(most_over > 215);
  CHECK(most_over < 242);
  CHECK(least_growth > -0.01);
  CHECK(most_growth > 2);
  CHECK(most_growth < 4.01);

  const Simulator one(load_scenario("overtake"), 1, 0.1, 1), two(load_scenario("overtake"), 2, 0.1, 1);
  const SurveyedMap map = one.map();
  double apart = 0;
  for (std::size_t i = 0; i < map.banking_rad.size(); ++i) {
    const double s = double(i) * 2;
    REQUIRE(map.banking_rad[i] == doctest::Approx(one.world().track.at(s).banking_rad).epsilon(1e-12));
    apart = std::fmax(apart, std::fabs(map.banking_rad[i] - two.world().track.at(s).banking_rad));
  }
  CHECK(apart / kDegree > 0.5);
}

TEST_CASE("sim: apron and infield fall by 3 to 5 degrees, along the track and by seed, and the ground has no cracks") {
  for (const char* name : {"oval", "road"}) {
    const Track other = Track::make(name, Random(99));
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      const Track track = Track::make(name, Random(seed));
      double least[2] = {90, 90}, most[2] = {0, 0}, apart = 0, differs = 0;
      for (double s = 0.3; s < track.length_m(); s += 3.1) {
        const double edge = track.at(s).width_left_m, apron = track.apron_m();
        const double fall[2] = {(track.height(s, edge) - track.height(s, edge + apron)) / apron,
                                (track.height(s, edge + apron) - track.height(s, edge + apron + 20)) / 20};
        for (int i = 0; i < 2; ++i) {
          least[i] = std::fmin(least[i], std::atan(fall[i]) / kDegree);
          most[i] = std::fmax(most[i], std::atan(fall[i]) / kDegree);
        }
        apart = std::fmax(apart, std::fabs(std::atan(fall[0]) - std::atan(fall[1])));
        differs = std::fmax(differs, std::fabs(other.at(s).apron_fall - track.at(s).apron_fall));
      }
      for (int i = 0; i < 2; ++i) {
        CHECK(least[i] > 2.999);
        CHECK(least[i] < 3.2);
        CHECK(most[i] > 4.8);
        CHECK(most[i] < 5.001);
      }
      CHECK(apart / kDegree > 0.5);  // apron and infield, at the same place
      CHECK(differs > 0.01);         // two seeds
    }
    // Rays straight down beside each joint between two strips of the mesh.
    const Track track = Track::make(name, Random(4));
    const Bvh bvh(make_surroundings(track));
    Random dice(8);
    for (int i = 0; i < 3000; ++i) {
      const double s = dice.uniform(0, track.length_m());
      const TrackPoint p = track.at(s);
      const double joints[] = {-p.width_right_m, -p.width_right_m + 0.15, p.width_left_m - 0.15, p.width_left_m,
                               p.width_left_m + track.apron_m()};
      const double d = joints[i % 5] + dice.uniform(-0.01, 0.01);
      const Vec3 above = track.place(s, d);
      const Hit hit = bvh.cast({above.x, above.y, above.z + 3}, {0, 0, -1}, 0.01, 9);
      REQUIRE(hit.triangle >= 0);
      REQUIRE(std::fabs(hit.range_m - 3) < 0.02);
    }
  }
}

TEST_CASE("sim: the written map has its specified survey error, no more and no less") {
  const Scenario scenario = load_scenario("overtake");
  double sum = 0, most = 0;
  int count = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const Simulator simulator(scenario, seed, 0.1, 1);
    const SurveyedMap map = simulator.map();
    REQUIRE(map.x_m.size() == 1225);
    for (std::size_t i = 0; i < map.x_m.size(); ++i) {
      const TrackPoint p = simulator.world().track.at(double(i) * 2);
      const double off = std::hypot(map.x_m[i] - p.x, map.y_m[i] - p.y);
      sum += off * off, most = std::fmax(most, off), ++count;
    }
  }
  const double rms = std::sqrt(sum / count);
  CHECK(rms > 0.5 * scenario.map_error_m);
  CHECK(rms < 1.6 * scenario.map_error_m);
  CHECK(most < 5 * scenario.map_error_m);
}
