// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/circuit_map.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Line {
  std::vector<double> x, y, left, right, banking;

  void add(double px, double py, double wl = 5.0, double wr = 4.0, double b = 0.0) {
    x.push_back(px);
    y.push_back(py);
    left.push_back(wl);
    right.push_back(wr);
    banking.push_back(b);
  }
  int32_t count() const { return int32_t(x.size()); }
  bool build(CircuitMap& map, bool closed, const char** error = nullptr, MapPoint* point = nullptr) const {
    return map.build(x.data(), y.data(), left.data(), right.data(), banking.data(), count(), closed, error, point);
  }
};

Line make_circle(double radius, int32_t points, double cx = 100.0, double cy = -50.0) {
  Line line;
  for (int32_t i = 0; i < points; ++i)
    line.add(cx + radius * std::cos(kTwoPi * i / points), cy + radius * std::sin(kTwoPi * i / points));
  return line;
}

bool is_same(const MapProjection& a, const MapProjection& b) {
  return a.s_m == b.s_m && a.d_m == b.d_m && a.heading_rad == b.heading_rad && a.curvature_per_m == b.curvature_per_m &&
         a.width_left_m == b.width_left_m && a.width_right_m == b.width_right_m && a.inside == b.inside &&
         a.segment == b.segment;
}

// Search over all segments; ties: the lower segment.
void check_against_brute_force(const Line& line, bool closed, const CircuitMap& map, double px, double py,
                               int32_t hint) {
  CAPTURE(px);
  CAPTURE(py);
  CAPTURE(hint);
  const int32_t segments = closed ? line.count() : line.count() - 1;
  SegmentFoot best{0, 0, 0, kInfinity};
  int32_t segment = -1;
  for (int32_t i = 0; i < segments; ++i) {
    const std::size_t a = std::size_t(i), b = std::size_t((i + 1) % line.count());
    const SegmentFoot f = find_foot(line.x[a], line.y[a], line.x[b], line.y[b], px, py);
    if (f.distance2 < best.distance2) best = f, segment = i;
  }
  const MapProjection p = map.project(px, py, hint);
  REQUIRE(p.segment == segment);
  REQUIRE(std::fabs(p.d_m) == std::sqrt(best.distance2));
  const MapPose foot = map.at(p.s_m);
  REQUIRE(hypot_f64(foot.x_m - best.x_m, foot.y_m - best.y_m) < 1e-8 * (1.0 + map.length_m()));
  REQUIRE(is_same(p, map.project(px, py)));
}

TEST_CASE("circuit map: project equals a search over all segments, near and far, with and without a hint") {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<int> size(3, 200), grid(-20, 20);
    std::uniform_real_distribution<double> step(-1.0, 1.0), size_log(-2.0, 7.0);
    const bool closed = seed % 2, on_grid = seed % 3 == 0;  // integer points give ties
    CAPTURE(closed);
    Line line;
    const int count = size(random);
    double x = 1000.0 * step(random), y = 1000.0 * step(random), heading = 3.0 * step(random);
    while (line.count() < count) {
      if (on_grid) {
        const double gx = grid(random), gy = grid(random);
        if (line.count() > 0 && gx == line.x.back() && gy == line.y.back()) continue;
        if (line.count() == count - 1 && gx == line.x[0] && gy == line.y[0]) continue;
        line.add(gx, gy);
      } else {
        heading += 0.6 * step(random);  // the line may cross itself
        const double length = 3.0 + 2.9 * step(random);
        line.add(x += length * std::cos(heading), y += length * std::sin(heading));
      }
    }
    CircuitMap map;
    const char* error = "";
    REQUIRE_MESSAGE(line.build(map, closed, &error), error);
    std::uniform_int_distribution<int> any_segment(-2, count + 1), vertex(0, count - 1);
    for (int i = 0; i < 400; ++i) {
      const std::size_t v = std::size_t(vertex(random));
      const double far = std::pow(10.0, size_log(random));
      const int32_t hint = any_segment(random);
      if (on_grid) check_against_brute_force(line, closed, map, 2 * grid(random), 0.5 * grid(random), hint);
      check_against_brute_force(line, closed, map, line.x[v], line.y[v], hint);
      check_against_brute_force(line, closed, map, line.x[v] + 9 * step(random), line.y[v] + 9 * step(random), hint);
      check_against_brute_force(line, closed, map, far * step(random), far * step(random), hint);
    }
  }
}

TEST_CASE("circuit map: on a circle s, d, heading and curvature have their closed form") {
  const double radius = 120.0;
  const int32_t points = 360;
  CircuitMap map;
  REQUIRE(make_circle(radius, points).build(map, true));
  const double chord = 2 * radius * std::sin(kPi / points);
  CHECK(map.length_m() == doctest::Approx(points * chord).epsilon(1e-12));
  const unsigned seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> turn(0.0, kTwoPi), off(-20.0, 20.0);
  for (int i = 0; i < 20000; ++i) {
    const double a = turn(random), d = off(random);
    // The nearest place on a polygon, seen from distance d, is off by up to d / radius of half a step.
    const double slack = std::fabs(d) / radius * kPi / points + 2e-4;
    const MapProjection p = map.project(100 + (radius - d) * std::cos(a), -50 + (radius - d) * std::sin(a));
    REQUIRE(std::fabs(p.s_m / map.length_m() * kTwoPi - a) < slack);
    REQUIRE(std::fabs(p.d_m - d) < 6e-3);  // the chord's sagitta, 4.6 mm
    REQUIRE(std::fabs(wrap_angle(p.heading_rad - (a + kHalfPi))) < slack);
    REQUIRE(std::fabs(p.curvature_per_m * radius - 1.0) < 1e-4);
    REQUIRE(p.heading_rad > -kPi);
    REQUIRE(p.heading_rad <= kPi);
    REQUIRE(p.inside == (p.d_m <= 5.0 && p.d_m >= -4.0));
  }
  for (int32_t k = 0; k < points; ++k) {  // exactly at the vertices
    const MapPose at = map.at(k * chord + 1e-9);
    const double a = kTwoPi * k / points;
    REQUIRE(std::fabs(wrap_angle(at.heading_rad - (a + kHalfPi))) < 1e-9);
    REQUIRE(at.curvature_per_m == doctest::Approx(kTwoPi / points / chord).epsilon(1e-9));
  }
}

TEST_CASE("circuit map: clockwise, a circle's curvature is negative and its inside is on the right") {
  Line line;
  for (int32_t i = 0; i < 200; ++i) line.add(80 * std::cos(kTwoPi * i / 200), -80 * std::sin(kTwoPi * i / 200));
  CircuitMap map;
  REQUIRE(line.build(map, true));
  const MapProjection p = map.project(70, 0);
  CHECK(p.d_m == doctest::Approx(-10).epsilon(1e-3));
  CHECK(p.curvature_per_m * 80 == doctest::Approx(-1.0).epsilon(1e-3));
  CHECK(p.heading_rad == doctest::Approx(-kHalfPi).epsilon(2e-3));
}

TEST_CASE("circuit map: unequal steps around a circle do not bend the heading") {
  Line line;
  double a = 0.0;
  const unsigned seed = 6;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> step(0.002, 0.02);
  std::vector<double> angle;
  for (; a < kTwoPi - 0.02; a += step(random)) {
    line.add(200 * std::cos(a), 200 * std::sin(a));
    angle.push_back(a);
  }
  CircuitMap map;
  REQUIRE(line.build(map, true));
  for (std::size_t i = 0; i < angle.size(); ++i) {
    const MapProjection p = map.project(line.x[i], line.y[i]);
    REQUIRE(std::fabs(wrap_angle(p.heading_rad - (angle[i] + kHalfPi))) < 1e-6);
    REQUIRE(p.curvature_per_m * 200 == doctest::Approx(1.0).epsilon(1e-3));
  }
}

TEST_CASE("circuit map: an open line clamps, and a point beyond its ends is not inside") {
  // (0,0) ---- (10,0) ---- (20,0) ---- (30,0), banking 0 .. 0.3
  Line line;
  for (int i = 0; i < 4; ++i) line.add(10.0 * i, 0.0, 2.0 + i, 3.0, 0.1 * i);
  CircuitMap map;
  REQUIRE(line.build(map, false));
  CHECK(map.length_m() == 30.0);
  CHECK_FALSE(map.closed());
  const MapProjection p = map.project(15.0, 2.5);
  CHECK(p.s_m == 15.0);
  CHECK(p.d_m == 2.5);
  CHECK(p.width_left_m == 3.5);
  CHECK(p.width_right_m == 3.0);
  CHECK(p.heading_rad == 0.0);
  CHECK(p.curvature_per_m == 0.0);
  CHECK(p.inside);
  CHECK(p.segment == 1);
  CHECK(map.project(15.0, 3.5).inside);
  CHECK_FALSE(map.project(15.0, 3.500001).inside);
  CHECK(map.project(15.0, -3.0).inside);
  CHECK_FALSE(map.project(15.0, -3.000001).inside);
  CHECK(map.project(0.0, 1.0).inside);
  CHECK(map.project(30.0, 1.0).inside);
  const MapProjection before = map.project(-0.5, 0.1), after = map.project(30.5, -0.1);
  CHECK_FALSE(before.inside);
  CHECK_FALSE(after.inside);
  CHECK(before.s_m == 0.0);
  CHECK(after.s_m == 30.0);
  CHECK(before.d_m > 0.0);
  CHECK(after.d_m < 0.0);
  CHECK(map.at(-5.0).x_m == 0.0);
  CHECK(map.at(99.0).x_m == 30.0);
  CHECK(map.at(12.0).x_m == 12.0);
  CHECK(map.at(12.0).banking_rad == doctest::Approx(0.12));
  CHECK(map.at(12.0).width_left_m == doctest::Approx(3.2));
  CHECK(map.at(kNan).x_m == 0.0);
}

TEST_CASE("circuit map: an open arc extrapolates its heading and curvature to the ends") {
  Line line;
  for (int i = 0; i <= 90; ++i) line.add(50 * std::cos(i * kPi / 180), 50 * std::sin(i * kPi / 180));
  CircuitMap map;
  REQUIRE(line.build(map, false));
  CHECK(map.at(0).heading_rad == doctest::Approx(kHalfPi).epsilon(1e-9));
  CHECK(std::fabs(wrap_angle(map.at(1e9).heading_rad - kPi)) < 1e-9);
  CHECK(map.at(0).curvature_per_m == doctest::Approx(0.02).epsilon(1e-3));
  CHECK(map.at(1e9).curvature_per_m == doctest::Approx(0.02).epsilon(1e-3));
}

TEST_CASE("circuit map: on a closed line s wraps: before the start is the end of the lap") {
  // square of 100 m, counter-clockwise from (0, 0)
  Line line;
  line.add(0, 0);
  line.add(100, 0);
  line.add(100, 100);
  line.add(0, 100);
  CircuitMap map;
  REQUIRE(line.build(map, true));
  CHECK(map.length_m() == 400.0);
  CHECK(map.segment_count() == 4);
  CHECK(map.at(-30.0).y_m == doctest::Approx(30.0));
  CHECK(map.at(370.0).y_m == doctest::Approx(30.0));
  CHECK(map.at(400.0 * 7 + 30.0).x_m == doctest::Approx(30.0));
  CHECK(map.at(400.0).x_m == 0.0);
  for (const double bad : {kNan, kInfinity, -1e300}) CHECK(map.at(bad).x_m == 0.0);
  const MapProjection p = map.project(2.0, 30.0);
  CHECK(p.s_m == doctest::Approx(370.0));
  CHECK(p.d_m == doctest::Approx(-2.0 + 4.0));  // 2 m left of the line that comes down from (0, 100)
  CHECK(map.project(0.0, 0.0).s_m == 0.0);
  CHECK(map.project(-1.0, -1.0).s_m == 0.0);
  CHECK(map.project(50.0, 50.0).segment == 0);  // four times 50 m: the lower segment
}

// Root mean squares, at the vertices.
struct LineErrors {
  double heading_rad = 0, curvature_per_m = 0;
};
template <class F>
LineErrors measure_errors(const CircuitMap& map, int32_t count, F&& truth) {
  LineErrors sum;
  for (int32_t i = 0; i < count; ++i) {
    const auto [heading_rad, curvature_per_m] = truth(i);
    const MapPose at = map.at(map.length_m() * i / count);  // the length counts the noise, too
    sum.heading_rad += std::pow(wrap_angle(at.heading_rad - heading_rad), 2);
    sum.curvature_per_m += std::pow(at.curvature_per_m - curvature_per_m, 2);
  }
  return {std::sqrt(sum.heading_rad / count), std::sqrt(sum.curvature_per_m / count)};
}

TEST_CASE("circuit map: noise of the points becomes no noise of heading and curvature") {
  struct {
    double step_m, noise_m, heading_deg, curvature_per_m;
  } const cases[] = {{0.25, 0.02, 0.2, 1e-3}, {0.5, 0.01, 0.2, 1e-3}, {0.5, 0.03, 0.25, 1e-3}, {2, 0.1, 1.0, 3e-3}};
  for (const auto& [step_m, noise_m, heading_deg, curvature_per_m] : cases)
    for (const double radius : {25.0, 150.0}) {
      CAPTURE(step_m);
      CAPTURE(noise_m);
      CAPTURE(radius);
      const int32_t points = int32_t(kTwoPi * radius / step_m);
      Line line = make_circle(radius, points);
      std::mt19937 random(5);
      std::normal_distribution<double> noise(0.0, noise_m);
      for (int32_t i = 0; i < points; ++i)
        line.x[std::size_t(i)] += noise(random), line.y[std::size_t(i)] += noise(random);
      CircuitMap map;
      REQUIRE(line.build(map, true));
      const LineErrors error = measure_errors(
          map, points, [&](int32_t i) { return std::pair(wrap_angle(kTwoPi * i / points + kHalfPi), 1.0 / radius); });
      CHECK(error.heading_rad < heading_deg * kPi / 180);
      CHECK(error.curvature_per_m < curvature_per_m);
      // The line itself is the caller's: places on it are its points.
      for (const std::size_t i : {std::size_t(0), std::size_t(points / 2)})
        CHECK(std::fabs(map.project(line.x[i], line.y[i]).d_m) < 1e-9);
    }
}

TEST_CASE("circuit map: points so noisy that the line turns back have the direction and the bends of the line") {
  Line line;
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0.0, 0.15);
  {
    constexpr double kRadius = 60;
    constexpr int32_t kAround = 1900;
    Line circle = make_circle(kRadius, kAround);
    for (std::size_t i = 0; i < kAround; ++i) circle.x[i] += noise(random), circle.y[i] += noise(random);
    CircuitMap map;
    REQUIRE(circle.build(map, true));
    CHECK(map.length_m() > 1.3 * kTwoPi * kRadius);  // it counts the noise
    double sum = 0;
    for (int32_t i = 0; i < kAround; ++i) sum += map.at(map.length_m() * i / kAround).curvature_per_m;
    CHECK(std::fabs(sum / kAround * kRadius - 1) < 0.15);
  }
  constexpr int32_t kPoints = 1000;
  for (int32_t i = 0; i < kPoints; ++i) line.add(0.2 * i + noise(random), noise(random));
  CircuitMap map;
  REQUIRE(line.build(map, false));
  const LineErrors error = measure_errors(map, kPoints, [](int32_t) { return std::pair(0.0, 0.0); });
  CHECK(error.heading_rad < 3 * kPi / 180);
  CHECK(error.curvature_per_m < 0.02);
}

TEST_CASE("circuit map: noise of a part of the line is smoothed there, and only there") {
  // A straight with a bend of 15 m radius, and 10 % of the points noisy.
  Line exact, line;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 0.02);
  const auto add = [&](double x, double y, bool is_noisy) {
    exact.add(x, y);
    line.add(x + (is_noisy ? noise(random) : 0.0), y + (is_noisy ? noise(random) : 0.0));
  };
  constexpr int32_t kStraight = 2000, kBend = 94;
  for (int32_t i = 0; i < kStraight; ++i) add(0.5 * i, 0, i >= 600 && i < 800);
  for (int32_t i = 0; i < kBend; ++i) add(1000 + 15 * std::sin(0.5 * i / 15), 15 - 15 * std::cos(0.5 * i / 15), false);
  for (int32_t i = 0; i < 200; ++i) add(1000 - 0.5 * i, 30, false);
  CircuitMap map, without;
  REQUIRE(line.build(map, false));
  REQUIRE(exact.build(without, false));
  double worst_heading = 0, worst_curvature = 0;
  for (double x = 310; x < 390; x += 0.5) {
    const MapProjection at = map.project(x, 0);
    worst_heading = std::max(worst_heading, std::fabs(at.heading_rad));
    worst_curvature = std::max(worst_curvature, std::fabs(at.curvature_per_m));
  }
  CHECK(worst_heading < 0.01);
  CHECK(worst_curvature < 0.003);
  for (double s = 500; s < without.length_m(); s += 0.25) {
    const MapPose a = map.at(map.length_m() - without.length_m() + s), b = without.at(s);
    REQUIRE(std::fabs(wrap_angle(a.heading_rad - b.heading_rad)) < 1e-6);
    REQUIRE(std::fabs(a.curvature_per_m - b.curvature_per_m) < 1e-6);
  }
}

TEST_CASE("circuit map: where a vehicle stood, a line that it recorded has no heading of its own") {
  Line line;
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (int32_t i = 0; i < 800; ++i) {
    const int32_t times = i == 300 ? 400 : 1;
    for (int32_t k = 0; k < times; ++k) line.add(0.5 * i + noise(random), noise(random));
  }
  CircuitMap map;
  REQUIRE(line.build(map, false));
  for (double x = 5; x < 395; x += 0.5) {
    const MapProjection at = map.project(x, 0);
    CAPTURE(x);
    REQUIRE(std::fabs(at.heading_rad) < 0.02);
    REQUIRE(std::fabs(at.curvature_per_m) < 0.005);
  }
}

TEST_CASE("circuit map: the ends of a noisy open line go on as the line does") {
  double worst_heading = 0, worst_curvature = 0;
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    Line line;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 0.01);
    for (int32_t i = 0; i < 400; ++i) line.add(0.5 * i + noise(random), noise(random));
    CircuitMap map;
    REQUIRE(line.build(map, false));
    for (const double s : {0.0, 1.0, map.length_m() - 1, map.length_m()}) {
      worst_heading = std::max(worst_heading, std::fabs(map.at(s).heading_rad));
      worst_curvature = std::max(worst_curvature, std::fabs(map.at(s).curvature_per_m));
    }
  }
  CHECK(worst_heading < 0.008);
  CHECK(worst_curvature < 0.0015);
}

TEST_CASE("circuit map: a line without noise keeps the headings of its chords") {
  const auto check = [](const Line& line) {
    CircuitMap map;
    REQUIRE(line.build(map, false));
    double s = 0.0;
    for (std::size_t i = 1; i + 1 < line.x.size(); ++i) {
      const double before_m = hypot_f64(line.x[i] - line.x[i - 1], line.y[i] - line.y[i - 1]);
      const double after_m = hypot_f64(line.x[i + 1] - line.x[i], line.y[i + 1] - line.y[i]);
      const double before = atan2_f64(line.y[i] - line.y[i - 1], line.x[i] - line.x[i - 1]);
      const double after = atan2_f64(line.y[i + 1] - line.y[i], line.x[i + 1] - line.x[i]);
      s += before_m;
      CAPTURE(i);
      const double heading = wrap_angle(before + before_m / (before_m + after_m) * wrap_angle(after - before));
      REQUIRE(std::fabs(wrap_angle(map.at(s).heading_rad - heading)) < 1e-9);
    }
  };
  Line bends, corners, sparse;
  double x = 0, y = 0, heading = 0;
  for (int32_t i = 0; i < 3200; ++i, heading += 0.015 * std::sin(0.005 * i) * std::sin(0.005 * i))
    bends.add(x += 0.25 * std::cos(heading), y += 0.25 * std::sin(heading));
  for (int32_t i = 0; i < 100; ++i) corners.add(i, 0);
  for (int32_t i = 0; i < 100; ++i) corners.add(100, i);
  for (int32_t i = 0; i < 100; ++i) corners.add(100 - i, 100);
  for (int32_t i = 0; i < 60; ++i) sparse.add(5 * i, i % 2);  // points far apart mean what they say
  for (const Line& line : {bends, corners, sparse}) check(line);
}

TEST_CASE("circuit map: the heading is smooth where angles wrap, and over the start") {
  CircuitMap map;
  REQUIRE(make_circle(60.0, 90).build(map, true));
  double last = map.at(0.0).heading_rad;
  for (double s = 0.0; s < 1.01 * map.length_m(); s += 0.05) {
    const double heading = map.at(s).heading_rad;
    REQUIRE(std::fabs(wrap_angle(heading - last)) < 0.05 / 60.0 * 1.01 + 1e-9);
    last = heading;
  }
}

TEST_CASE("circuit map: a hint does not change the place at s, and receives its segment") {
  for (const bool closed : {true, false}) {
    CircuitMap map;
    REQUIRE(make_circle(60.0, 90).build(map, closed));
    const int32_t n = map.segment_count();
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-0.2 * map.length_m(), 1.2 * map.length_m());
    std::vector<double> places = {0.0, map.length_m(), -1.0, kNan};
    for (int32_t i = 0; i < n; ++i) places.push_back(map.project(map.at(4.0 * i).x_m, map.at(4.0 * i).y_m).s_m);
    for (int32_t i = 0; i < 200; ++i) places.push_back(any(random));
    for (const double s : places) {
      CAPTURE(s);
      const MapPose wanted = map.at(s);
      int32_t segment = -1;
      map.at(s, &segment);
      REQUIRE((segment >= 0 && segment < n));
      for (const int32_t from :
           {-1, 0, 1, segment - 9, segment - 2, segment, segment + 1, segment + 10, n - 1, n, 1000}) {
        int32_t hint = from;
        const MapPose at = map.at(s, &hint);
        CHECK(std::memcmp(&at, &wanted, sizeof at) == 0);
        CHECK(hint == segment);
      }
    }
  }
}

TEST_CASE("circuit map: behind a sharp corner the side is right") {
  // A hairpin that turns left by 170 degrees at (10, 0): every point beyond the tip is on its right.
  const double back = 170.0 / 180.0 * kPi;
  Line line;
  line.add(0, 0);
  line.add(10, 0);
  line.add(10 + 10 * std::cos(back), 10 * std::sin(back));
  CircuitMap map;
  REQUIRE(line.build(map, false));
  for (double a = -89.0; a <= 79.0; a += 1.0) {
    CAPTURE(a);
    const MapProjection p = map.project(10 + 2 * std::cos(a * kPi / 180), 2 * std::sin(a * kPi / 180));
    CHECK(p.s_m == doctest::Approx(10.0));
    CHECK(p.d_m == doctest::Approx(-2.0));
  }
}

TEST_CASE("circuit map: an invalid point is not inside and causes no error") {
  CircuitMap map;
  CHECK_FALSE(map.project(0, 0).inside);  // an empty map
  CHECK(map.project(0, 0).segment == -1);
  CHECK(map.at(3.0).x_m == 0.0);
  CHECK(map.empty());
  REQUIRE(make_circle(50.0, 10).build(map, true));
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e300, -1e300, 1.1e8}) {
    CAPTURE(bad);
    for (const MapProjection& p : {map.project(bad, 0), map.project(0, bad), map.project(bad, bad, 3)}) {
      CHECK_FALSE(p.inside);
      CHECK(p.segment == -1);
      CHECK(p.d_m == kInfinity);
      CHECK(p.s_m == 0.0);
      CHECK(p.heading_rad == 0.0);
    }
  }
  CHECK_FALSE(map.project(-1e8, 1e8).inside);
  CHECK(map.project(-1e8, 1e8).segment >= 0);
  for (const int32_t hint : {-5, 10, 2147483647, -2147483647})
    CHECK(is_same(map.project(150, -50, hint), map.project(150, -50)));
  CHECK(std::isfinite(map.at(1e300).x_m));
}

TEST_CASE("circuit map: a bad map is refused with a sentence and keeps the old one") {
  CircuitMap map;
  const Line good = make_circle(50.0, 20);
  REQUIRE(good.build(map, true));
  const auto refuse = [&](const Line& line, bool closed, const char* sentence, int32_t index = -1) {
    const char* error = "";
    MapPoint point;
    CHECK_FALSE(line.build(map, closed, &error, &point));
    CHECK(std::string(error) == sentence);
    CHECK(point.index == index);
    CHECK_FALSE(line.build(map, closed, nullptr));
    CHECK(map.segment_count() == 20);
    CHECK(map.closed());
  };
  Line bad;
  refuse(bad, true, "a track map needs at least 3 points");
  bad.add(0, 0);
  bad.add(1, 0);
  refuse(bad, false, "a track map needs at least 3 points");
  bad.add(0, 0);
  refuse(bad, true, "a track map needs at least 3 points");  // the last point repeats the first
  for (std::vector<double> Line::*column : {&Line::x, &Line::y, &Line::left, &Line::right, &Line::banking})
    for (const double value : {kNan, kInfinity}) {
      bad = good;
      (bad.*column)[7] = value;
      refuse(bad, true, "a track map's value is not a finite number", 7);
    }
  bad = good;
  bad.y[19] = -1.1e8;
  refuse(bad, true, "a track map's point lies more than 1e8 m from the origin", 19);
  bad = good;
  bad.x[4] = bad.x[3];
  bad.y[4] = bad.y[3];
  refuse(bad, true, "two neighbouring points of a track map are the same", 4);
  for (std::vector<double> Line::*column : {&Line::left, &Line::right}) {
    bad = good;
    (bad.*column)[0] = -0.1;
    refuse(bad, true, "a track map's width is negative", 0);
    (bad.*column)[0] = 4.1e8;
    refuse(bad, true, "a track map's width is over 4e8 m", 0);
  }
  for (const double degrees : {8.5, -8.5}) {
    bad = good;
    bad.banking[11] = degrees;
    refuse(bad, true, "a track map's banking_rad is beyond 1 rad (degrees?)", 11);
  }
  CHECK(describe_fault("it is wrong", {}) == "it is wrong");
  CHECK(describe_fault("it is wrong", {7, ""}) == "it is wrong (point 7, from 0)");
  CHECK(describe_fault("it is wrong", {7, "left bound"}) == "it is wrong (left bound, point 7, from 0)");
  CHECK(describe_fault("it is short", {-1, "right bound"}) == "it is short (right bound)");
  bad = good;
  bad.left.assign(20, 0.4);
  bad.right.assign(20, 0.5);
  refuse(bad, true, "a track map is nowhere 1 m wide: no car fits between its bounds");
  bad.right[7] = 3.0;  // a narrow place is the caller's matter
  CHECK(map.build(bad.x.data(), bad.y.data(), bad.left.data(), bad.right.data(), nullptr, 20, true, nullptr));
  const char* error = "";
  CHECK_FALSE(map.build(good.x.data(), nullptr, good.left.data(), good.right.data(), nullptr, 20, true, &error));
  CHECK(std::string(error) == "a track map needs columns x, y, width left and width right");
  CHECK(map.build(good.x.data(), good.y.data(), good.left.data(), good.right.data(), nullptr, 20, true, &error));
  CHECK(map.at(10.0).banking_rad == 0.0);
}

TEST_CASE("circuit map: measure_outside gives the distance from the track's edge or the end of an open line") {
  Line line;
  for (int i = 0; i <= 10; ++i) line.add(10.0 * i, 0.0);  // 5 m to the left, 4 m to the right
  CircuitMap open;
  REQUIRE(line.build(open, false));
  struct Row {
    double x, y, outside;
  };
  for (const Row& row : {Row{50, 0, 0}, Row{50, 5, 0}, Row{50, -4, 0}, Row{50, 6.5, 1.5}, Row{50, -6.5, 2.5},
                         Row{0, 0, 0}, Row{100, 5, 0}, Row{-3, 0, 3}, Row{-3, 5, 3}, Row{-3, -4, 3}, Row{-3, 9, 5},
                         Row{-3, -8, 5}, Row{103, 9, 5}, Row{103, -8, 5}, Row{103, 2, 3}, Row{1e8, 0, 1e8 - 100}}) {
    CAPTURE(row.x);
    CAPTURE(row.y);
    int32_t hint = -1;
    CHECK(open.measure_outside(row.x, row.y, &hint) == doctest::Approx(row.outside).epsilon(1e-12));
    CHECK(open.measure_outside(row.x, row.y, &hint) == doctest::Approx(row.outside).epsilon(1e-12));  // its own hint
  }
  CircuitMap ring, none;
  REQUIRE(make_circle(50.0, 400, 0, 0).build(ring, true));  // counterclockwise: left is inside
  int32_t hint = -1;
  CHECK(ring.measure_outside(44.0, 0, &hint) == doctest::Approx(1.0).epsilon(1e-3));
  CHECK(ring.measure_outside(57.0, 0, &hint) == doctest::Approx(3.0).epsilon(1e-3));
  CHECK(ring.measure_outside(0, 0, &hint) == doctest::Approx(45.0).epsilon(1e-3));
  CHECK(ring.measure_outside(49.0, 0, &hint) == 0.0);
  CHECK(ring.measure_outside(kNan, 0, &hint) == kInfinity);
  CHECK(ring.measure_outside(2e8, 0, &hint) == kInfinity);
  hint = -1;
  CHECK(none.measure_outside(0, 0, &hint) == kInfinity);
}

TEST_CASE("circuit map: a closed line may repeat its first point at the end") {
  Line line = make_circle(50.0, 20);
  line.add(line.x[0], line.y[0] + 1e-9);
  CircuitMap map;
  REQUIRE(line.build(map, true));
  CHECK(map.segment_count() == 20);
}

TEST_CASE("circuit map: two concentric bounds with different point counts give the circle between them") {
  const Line inner = make_circle(90.0, 300, 0, 0), outer = make_circle(110.0, 170, 0, 0);
  CircuitMap map;
  const char* error = "";
  const auto build = [&](const Line& left, const Line& right) {
    return map.build_from_bounds(left.x.data(), left.y.data(), left.count(), right.x.data(), right.y.data(),
                                 right.count(), true, &error);
  };
  REQUIRE_MESSAGE(build(inner, outer), error);
  CHECK(map.closed());
  CHECK(map.length_m() == doctest::Approx(kTwoPi * 100.0).epsilon(1e-3));
  for (double a = -3.0; a < 3.0; a += 0.01) {
    const MapProjection p = map.project(100 * std::cos(a), 100 * std::sin(a));
    REQUIRE(std::fabs(p.d_m) < 0.05);
    REQUIRE(std::fabs(p.width_left_m - 10.0) < 0.05);
    REQUIRE(p.width_left_m == p.width_right_m);
    REQUIRE(std::fabs(wrap_angle(p.heading_rad - (a + kHalfPi))) < 0.01);
  }
  // The coarse bound on the left: driven clockwise.
  Line left = make_circle(110.0, 170, 0, 0), right = make_circle(90.0, 300, 0, 0);
  for (double& y : left.y) y = -y;
  for (double& y : right.y) y = -y;
  REQUIRE_MESSAGE(build(left, right), error);
  CHECK(map.project(100, 0).heading_rad == doctest::Approx(-kHalfPi).epsilon(1e-3));
  CHECK(std::fabs(map.project(100, 0).d_m) < 0.05);

  MapPoint point;
  Line gap = inner;
  gap.x[9] = kNan;
  for (const bool is_left : {false, true}) {
    const Line &l = is_left ? gap : inner, &r = is_left ? outer : gap;
    CHECK_FALSE(map.build_from_bounds(l.x.data(), l.y.data(), l.count(), r.x.data(), r.y.data(), r.count(), true,
                                      &error, &point));
    CHECK(point.index == 9);
    CHECK(std::string(point.line) == (is_left ? "left bound" : "right bound"));
  }
  CHECK_FALSE(build(outer, inner));
  CHECK(std::string(error) == "a track map's left bound must lie left of its right bound in driving direction");
  Line reversed = inner;
  std::reverse(reversed.x.begin(), reversed.x.end());
  std::reverse(reversed.y.begin(), reversed.y.end());
  CHECK_FALSE(build(reversed, outer));
  CHECK(std::string(error) == "a track map's two bounds must run in the same direction");
  CHECK_FALSE(build(Line{}, outer));
  CHECK(std::string(error) == "a track map needs at least 3 points");
  CHECK(map.project(100, 0).heading_rad == doctest::Approx(-kHalfPi).epsilon(1e-3));  // unchanged
}

TEST_CASE("circuit map: two open bounds of different lengths end with the shorter") {
  Line left, right;
  for (int i = 0; i <= 100; ++i) left.add(1.0 * i, 6.0);
  for (int i = 0; i <= 12; ++i) right.add(20.0 + 5.0 * i, -2.0);
  CircuitMap map;
  const char* error = "";
  REQUIRE_MESSAGE(map.build_from_bounds(left.x.data(), left.y.data(), left.count(), right.x.data(), right.y.data(),
                                        right.count(), false, &error),
                  error);
  CHECK(map.length_m() == doctest::Approx(60.0));
  const MapProjection p = map.project(50.0, 3.0);
  CHECK(p.s_m == doctest::Approx(30.0));
  CHECK(p.d_m == doctest::Approx(1.0));
  CHECK(p.width_left_m == doctest::Approx(4.0));
  CHECK_FALSE(map.project(10.0, 2.0).inside);
}

// ---- recorded -------------------------------------------------------------------------------------------------------

std::string recorded(const std::string& name) {
  const char* root = std::getenv("OVERTAKE_DATA");
  return std::string(root ? root : "recordings") + "/lvms/" + name;
}

std::vector<std::vector<double>> read_numbers(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    for (char& c : line)
      if (c == ';' || c == ',') c = ' ';
    std::istringstream text(line);
    std::vector<double> row;
    for (double v; text >> v;) row.push_back(v);
    rows.push_back(row);
  }
  return rows;
}

TEST_CASE("recorded: the map of Las Vegas has the heading, curvature and s of its file") {
  const auto rows = read_numbers(recorded("traj_ltpl_cl_LVMS_GPS.csv"));
  if (rows.empty()) {
    MESSAGE(
        "skipped: lvms/traj_ltpl_cl_LVMS_GPS.csv is not there (tools/README.md, \"Recorded data\", says where to get "
        "it)");
    return;
  }
  Line line;
  for (const auto& r : rows) {
    REQUIRE(r.size() == 17);
    line.add(r[0], r[1], r[3], r[2], r[12]);
  }
  CircuitMap map;
  const char* error = "";
  REQUIRE_MESSAGE(line.build(map, true, &error), error);
  CHECK(map.length_m() == doctest::Approx(2454.0).epsilon(1e-3));
  double worst_heading = 0.0, worst_curvature = 0.0, worst_s = 0.0;
  int32_t hint = -1;
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    const MapProjection p = map.project(rows[i][0], rows[i][1], hint);
    hint = p.segment;
    REQUIRE(std::fabs(p.d_m) < 1e-9);
    worst_heading = std::max(worst_heading, std::fabs(wrap_angle(p.heading_rad - rows[i][14] - kHalfPi)));
    worst_curvature = std::max(worst_curvature, std::fabs(p.curvature_per_m - rows[i][15]));
    worst_s = std::max(worst_s, std::fabs(p.s_m - rows[i][13]));
    const MapProjection left = map.project(rows[i][0] - 2 * rows[i][4], rows[i][1] - 2 * rows[i][5]);
    REQUIRE(std::fabs(left.d_m - 2.0) < 1e-3);  // left = ref - normal
    REQUIRE(left.inside);
  }
  MESSAGE("against the file: heading " << worst_heading << " rad, curvature " << worst_curvature << " 1/m, s "
                                       << worst_s << " m");
  CHECK(worst_heading < 0.005);
  CHECK(worst_curvature < 1e-3);
  CHECK(worst_s < 0.5);
}

TEST_CASE("recorded: the bounds of Las Vegas give a centre line with both bounds on its edges") {
  const auto inner = read_numbers(recorded("lvms_inner_bound.csv")),
             outer = read_numbers(recorded("lvms_outer_bound.csv"));
  if (inner.empty() || outer.empty()) {
    MESSAGE(
        "skipped: lvms/lvms_inner_bound.csv or lvms_outer_bound.csv is not there (tools/README.md, \"Recorded data\", "
        "says "
        "where to get it)");
    return;
  }
  Line left, right;
  for (const auto& r : inner) left.add(r[0], r[1]);
  for (const auto& r : outer) right.add(r[0], r[1]);
  CircuitMap map;
  const char* error = "";
  REQUIRE_MESSAGE(map.build_from_bounds(left.x.data(), left.y.data(), left.count(), right.x.data(), right.y.data(),
                                        right.count(), true, &error),
                  error);
  double worst = 0.0;
  for (const Line* bound : {&left, &right})
    for (std::size_t i = 0; i < bound->x.size(); ++i) {
      const MapProjection p = map.project(bound->x[i], bound->y[i]);
      worst = std::max(worst, std::fabs(bound == &left ? p.d_m - p.width_left_m : p.d_m + p.width_right_m));
    }
  MESSAGE("bounds against widths: " << worst << " m");
  CHECK(worst < 0.2);
  CHECK(map.length_m() == doctest::Approx(2454.0).epsilon(0.02));
}

}  // namespace
}  // namespace overtake
