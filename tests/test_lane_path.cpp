// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Predicted paths of the tracker of `best`.
#include "pipeline/track/lane_path.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "core/math.h"
#include "core/table.h"

namespace overtake {
namespace {

constexpr double kPathSpeed = 60.0;

double draw(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

CircuitMap map_of(const std::vector<double>& x, const std::vector<double>& y, bool closed) {
  const std::vector<double> width(x.size(), 8.0);
  CircuitMap map;
  const char* error = nullptr;
  REQUIRE(map.build(x.data(), y.data(), width.data(), width.data(), nullptr, int32_t(x.size()), closed, &error));
  return map;
}

// Counterclockwise around the origin from (radius, 0).
CircuitMap circle(double radius_m, int32_t vertices) {
  std::vector<double> x, y;
  for (int32_t i = 0; i < vertices; ++i) {
    x.push_back(radius_m * std::cos(kTwoPi * i / vertices));
    y.push_back(radius_m * std::sin(kTwoPi * i / vertices));
  }
  return map_of(x, y, true);
}

// Along the x axis.
CircuitMap straight(double length_m) {
  std::vector<double> x, y;
  for (double at = 0; at <= length_m; at += 5.0) x.push_back(at), y.push_back(0.0);
  return map_of(x, y, false);
}

// 300 m straight along the x axis, then to the left on a circle of 150 m.
CircuitMap corner() {
  std::vector<double> x, y;
  for (double at = 0; at < 300.0; at += 3.0) x.push_back(at), y.push_back(0.0);
  for (double a = 0; a < kPi; a += 0.02)
    x.push_back(300.0 + 150.0 * std::sin(a)), y.push_back(150.0 * (1 - std::cos(a)));
  return map_of(x, y, false);
}

TrackEstimate car_at(double x_m, double y_m, double course_rad, double speed_mps = kPathSpeed) {
  TrackEstimate e;
  e.mean = {x_m, y_m, speed_mps, course_rad, 0.0};
  const double variance[kTrackStateSize] = {0.04, 0.02, 0.25, 1e-4, 1e-4};
  for (int i = 0; i < kTrackStateSize; ++i) e.covariance[i][i] = variance[i];
  e.covariance[0][1] = e.covariance[1][0] = 0.01;
  e.covariance[0][2] = e.covariance[2][0] = 0.03;
  e.covariance[1][3] = e.covariance[3][1] = 5e-4;
  return e;
}

class PathBench {
 public:
  explicit PathBench(const CircuitMap* map = nullptr, double step_s = 0.1, double horizon_s = 3.0,
                     const LaneTrackerParams& lane = {}) {
    params_.lane = lane;
    params_.horizon_step_s = step_s;
    params_.horizon_s = horizon_s;
    path_.emplace(params_, map);
    arena_.build_or_throw(default_allocator(), [&](Carver& carver) {
      path_->carve(carver);
      carve_table(carver, table, path_points(params_, horizon_s));
    });
    path_->fill();
    table.points_per_track = path_points(params_, horizon_s);
  }
  const PathTable& of(const TrackEstimate& e, PathKind kind, const PathNoise& noise = {}) {
    table.count = 0;
    path_->write(e, kind, -1, noise, table);
    return table;
  }
  PathTable table;

 private:
  TrackerParams params_;
  std::optional<LanePath> path_;
  Arena arena_;
};

constexpr PathKind kEveryKind[] = {PathKind::kLane, PathKind::kArc, PathKind::kStraight, PathKind::kRest};

}  // namespace

TEST_CASE("lane path: on a straight lane a car keeps its offset, course and speed") {
  const CircuitMap map = straight(600);
  PathBench bench(&map);
  const PathTable& t = bench.of(car_at(50, -3, 0), PathKind::kLane);
  REQUIRE(t.count == 30);
  for (int32_t k = 0; k < 30; ++k) {
    CAPTURE(k);
    CHECK(t.x_m[k] == doctest::Approx(50 + kPathSpeed * 0.1 * (k + 1)));
    CHECK(t.y_m[k] == doctest::Approx(-3.0));
    CHECK(t.course_rad[k] == doctest::Approx(0.0));
    CHECK(t.speed_mps[k] == kPathSpeed);
  }
}

TEST_CASE("lane path: on a circle a car keeps its offset for the whole path, across the seam of the map") {
  const CircuitMap map = circle(200, 600);
  PathBench bench(&map);
  for (const double radius : {195.0, 200.0, 206.0})
    for (const double start : {-0.4, 0.0, 2.0}) {  // -0.4: 80 m before the seam
      const TrackEstimate e = car_at(radius * std::cos(start), radius * std::sin(start), wrap_angle(start + kHalfPi));
      const PathTable& t = bench.of(e, PathKind::kLane);
      for (int32_t k = 0; k < t.count; ++k) {
        const double angle = start + kPathSpeed * 0.1 * (k + 1) / radius;
        CAPTURE(radius);
        CAPTURE(k);
        CHECK(std::hypot(t.x_m[k], t.y_m[k]) == doctest::Approx(radius).epsilon(1e-4));
        CHECK(std::hypot(t.x_m[k] - radius * std::cos(angle), t.y_m[k] - radius * std::sin(angle)) < 0.05);
        CHECK(std::fabs(wrap_angle(t.course_rad[k] - angle - kHalfPi)) < 1e-3);
      }
    }
}

TEST_CASE("lane path: where the lane begins to turn, a car drives its own way at its speed") {
  const CircuitMap map = corner();
  PathBench bench(&map, 0.1, 4.0);
  for (const double left : {-7.0, 0.0, 7.0}) {
    const TrackEstimate e = car_at(220, left, 0);
    const PathTable& t = bench.of(e, PathKind::kLane);
    double way = 0, x = 220, y = left;
    for (int32_t k = 0; k < t.count; ++k) {
      way += std::hypot(t.x_m[k] - x, t.y_m[k] - y);
      x = t.x_m[k], y = t.y_m[k];
      CAPTURE(left);
      CAPTURE(k);
      CHECK(way == doctest::Approx(kPathSpeed * 0.1 * (k + 1)).epsilon(2e-3));
    }
    CHECK(std::hypot(x - 300, y - 150) == doctest::Approx(150 - left).epsilon(1e-3));
  }
}

TEST_CASE("lane path: a known course that differs from the lane's goes back to it, and the place follows the course") {
  const CircuitMap map = straight(900);
  LaneTrackerParams params;
  params.path_turn_s = 1.0;
  PathBench bench(&map, 0.01, 3.0, params);
  const auto car = [] {
    TrackEstimate e = car_at(50, 1, 0.06);
    e.covariance[3][3] = 1e-12, e.covariance[1][3] = e.covariance[3][1] = 0.0;
    return e;
  };
  const PathTable& t = bench.of(car(), PathKind::kLane);
  double y = 1.0, course = 0.06;
  for (int32_t k = 0; k < t.count; ++k) {
    CAPTURE(k);
    CHECK(t.course_rad[k] < course);
    CHECK(t.course_rad[k] > 0.0);
    CHECK(t.y_m[k] - y == doctest::Approx(0.01 * kPathSpeed * 0.5 * (course + t.course_rad[k])).epsilon(1e-4));
    y = t.y_m[k], course = t.course_rad[k];
  }
  CHECK(t.course_rad[99] == doctest::Approx(0.06 / 2.5));   // after path_turn_s
  CHECK(t.course_rad[299] == doctest::Approx(0.06 / 8.5));  // after three times as long
  LaneTrackerParams soon;
  soon.path_turn_s = 0.5;
  PathBench quick(&map, 0.01, 3.0, soon);
  CHECK(quick.of(car(), PathKind::kLane).course_rad[49] == doctest::Approx(0.06 / 2.5));
}

TEST_CASE("lane path: a course that may be the lane's is an error, and so is the part of the place that goes with it") {
  const CircuitMap map = straight(900);
  PathBench bench(&map, 0.05, 3.0), start(&map, 1e-3, 1e-3);
  // The car keeps its place at y = 1; course and place of the estimate are wrong together.
  constexpr double kSigma_rad = 0.005, kMeters_per_rad = 20.0;
  const auto end_of = [&](double turn_rad) {
    TrackEstimate e = car_at(50, 1 + kMeters_per_rad * turn_rad, turn_rad);
    auto& p = e.covariance;
    p[3][3] = kSigma_rad * kSigma_rad, p[1][3] = p[3][1] = kMeters_per_rad * p[3][3];
    p[1][1] = 1.1 * kMeters_per_rad * p[1][3];
    CAPTURE(turn_rad);
    const PathTable& first = start.of(e, PathKind::kLane);
    CHECK(std::fabs(first.y_m[0] - e.mean.y_m) < 0.01);
    CHECK(std::fabs(first.course_rad[0] - turn_rad) < 1e-3);
    const PathTable& t = bench.of(e, PathKind::kLane);
    return t.y_m[t.count - 1];
  };
  CHECK(end_of(0.0) == doctest::Approx(1.0));
  for (const double sign : {-1.0, 1.0}) {
    CHECK(std::fabs(end_of(sign * kSigma_rad) - 1.0) < 0.09);      // 0.23 if every turn were its own
    CHECK(std::fabs(end_of(sign * 2 * kSigma_rad) - 1.0) < 0.28);  // 0.45
    CHECK(sign * (end_of(sign * 8 * kSigma_rad) - 1.0) > 1.7);     // 1.8: it changes its place
  }
}

TEST_CASE("lane path: whether a car changes its place is uncertain at a turn of some deviations only") {
  const CircuitMap map = straight(900);
  PathBench bench(&map, 0.1, 1.0);
  const auto var_of = [&](double turn_rad) {
    TrackEstimate e = car_at(50, 1, turn_rad);
    e.covariance[3][3] = 0.005 * 0.005, e.covariance[1][3] = e.covariance[3][1] = 0.0;
    const PathTable& t = bench.of(e, PathKind::kLane);
    return t.var_x[9] + t.var_y[9];
  };
  CHECK(var_of(0.0125) - var_of(0.0) > 0.01);
  CHECK(std::fabs(var_of(0.03) - var_of(0.0)) < 1e-3);
}

TEST_CASE("lane path: a course without an error is the car's own") {
  const CircuitMap map = straight(900);
  PathBench bench(&map);
  TrackEstimate e = car_at(50, 1, 0.001);
  for (int i = 0; i < kTrackStateSize; ++i) e.covariance[3][i] = e.covariance[i][3] = 0.0;
  const PathTable& t = bench.of(e, PathKind::kLane);
  CHECK(t.y_m[29] > 1.0);
  CHECK(t.y_m[29] < 1.0 + 0.001 * kPathSpeed);
}

TEST_CASE("lane path: a path starts at the estimate, with its covariance") {
  const CircuitMap coarse = circle(100, 40);  // corners of 9 degrees, 15 m apart
  PathBench bench(&coarse, 1e-3, 1e-3);
  for (const PathKind kind : kEveryKind)
    for (double angle = 0.0; angle < 0.5; angle += 0.01) {
      const TrackEstimate e = car_at(104 * std::cos(angle), 104 * std::sin(angle), angle + kHalfPi + 0.05);
      const PathTable& t = bench.of(e, kind);
      CAPTURE(int(kind));
      CAPTURE(angle);
      CHECK(std::hypot(t.x_m[0] - e.mean.x_m, t.y_m[0] - e.mean.y_m) < 1.2e-3 * kPathSpeed);
      CHECK(std::hypot(t.x_m[0] - e.mean.x_m, t.y_m[0] - e.mean.y_m) > 0.8e-3 * kPathSpeed);
      CHECK(std::fabs(wrap_angle(t.course_rad[0] - e.mean.course_rad)) < 2e-3);
      CHECK(t.var_x[0] == doctest::Approx(e.covariance[0][0]).epsilon(0.01));
      CHECK(t.var_y[0] == doctest::Approx(e.covariance[1][1]).epsilon(0.01));
      CHECK(t.cov_xy[0] == doctest::Approx(e.covariance[0][1]).epsilon(0.01));
    }
}

TEST_CASE("lane path: the variances along and across grow as documented") {
  const CircuitMap map = straight(600);
  LaneTrackerParams p;
  p.q_along = 0.03, p.q_across = 0.007, p.path_speed = 1.5, p.path_across = 0.2, p.path_turn_s = 0.8;
  PathBench bench(&map, 0.1, 3.0, p);
  const TrackEstimate e = car_at(50, 1, 0);
  const auto& c = e.covariance;
  {
    const PathTable& t = bench.of(e, PathKind::kLane);
    double reach = 0;  // the integral of the decay
    for (int32_t k = 0; k < 30; ++k) {
      const double at = 0.1 * (k + 1);
      for (int i = 0; i < 1000; ++i) {
        const double h = (0.1 * k + 1e-4 * (i + 0.5)) / 0.8;
        reach += 1e-4 / (1 + h + h * h / 2);
      }
      CAPTURE(k);
      CHECK(t.var_x[k] ==
            doctest::Approx(c[0][0] + 2 * at * c[0][2] + at * at * c[2][2] + 0.03 * at + at * at * at / 2));
      const double lever = reach * kPathSpeed;
      CHECK(t.var_y[k] ==
            doctest::Approx(c[1][1] + 2 * lever * c[1][3] + lever * lever * c[3][3] + 0.007 * at + 0.04 * at * at));
    }
  }
  // A car that changes its speed or its place: more noise of one or the other, of a car that drives.
  for (const PathKind kind : kEveryKind) {
    const auto vars = [&](const PathNoise& noise) {
      const PathTable& t = bench.of(e, kind, noise);
      return std::pair(t.var_x[19], t.var_y[19]);
    };
    const auto [along, across] = vars({});
    const bool drives = kind != PathKind::kRest;
    CAPTURE(int(kind));
    CHECK(vars({.along = 5}).first == doctest::Approx(along + (drives ? 4 * 1.5 * 8.0 / 3.0 : 0.0)));
    CHECK(vars({.along = 5}).second == across);
    CHECK(vars({.across = 3}).first == along);
    CHECK(vars({.across = 3}).second == doctest::Approx(across + (drives ? 2 * 0.2 * 0.2 * 4.0 : 0.0)));
  }
  // A steady car: its own shares of the estimate's variances and of the noise, whatever the noise of all cars is.
  for (const PathKind kind : kEveryKind) {
    CAPTURE(int(kind));
    const auto steady = [&](const PathNoise& noise) {
      const PathTable& t = bench.of(e, kind, noise);
      return std::pair(t.steady_along_m[19] * t.steady_along_m[19], t.steady_across_m[19] * t.steady_across_m[19]);
    };
    const PathTable& none = bench.of(e, kind, {.along = 0, .across = 0});
    const double along = none.var_x[19], across = none.var_y[19];  // the courses are 0 here
    const bool drives = kind != PathKind::kRest;
    const auto half = steady({.along = 9, .across = 9, .steady_along = 0.5, .steady_across = 0.25});
    CHECK(half.first == doctest::Approx(0.5 * along));
    CHECK(half.second == doctest::Approx(0.25 * across));
    const auto noisy = steady({.along = 9, .across = 9, .steady_speed = 0.5, .steady_drift = 0.25});
    CHECK(noisy.first == doctest::Approx(along + (drives ? 0.5 * 1.5 * 8.0 / 3.0 : 0.0)));
    CHECK(noisy.second == doctest::Approx(across + (drives ? 0.25 * 0.2 * 0.2 * 4.0 : 0.0)));
  }
  for (const PathKind kind : kEveryKind) {
    const PathTable& t = bench.of(e, kind);
    for (int32_t k = 1; k < 30; ++k) {
      CAPTURE(int(kind));
      CHECK(t.var_x[k] > t.var_x[k - 1]);
      CHECK(t.var_y[k] > t.var_y[k - 1]);
    }
  }
}

TEST_CASE("lane path: without a lane a car drives on the arc of its yaw rate, which its tyres limit") {
  PathBench bench;
  TrackEstimate e = car_at(10, 20, 3.0);
  e.mean.yaw_rate_rps = 0.3;
  for (const PathKind kind : {PathKind::kArc, PathKind::kLane}) {  // there is no map
    const PathTable& t = bench.of(e, kind);
    for (int32_t k = 0; k < t.count; ++k) {
      const MotionState then = advance(e.mean, 0.1 * (k + 1));
      CAPTURE(k);
      CHECK(t.x_m[k] == doctest::Approx(then.x_m).epsilon(1e-9));
      CHECK(t.y_m[k] == doctest::Approx(then.y_m).epsilon(1e-9));
      CHECK(t.course_rad[k] == doctest::Approx(then.course_rad).epsilon(1e-9));
    }
  }
  const auto last_var = [&](PathKind kind) { return bench.of(e, kind).var_x[29] + bench.of(e, kind).var_y[29]; };
  const double across = 0.5 * 3.0 * 3.0 * kPathSpeed;  // the yaw rate is uncertain too
  CHECK(last_var(PathKind::kArc) == doctest::Approx(last_var(PathKind::kStraight) + across * across * 1e-4));
  e.mean.yaw_rate_rps = 5.0;
  const PathTable& t = bench.of(e, PathKind::kArc);
  CHECK(std::fabs(wrap_angle(t.course_rad[0] - 3.0)) == doctest::Approx(0.1 * 40.0 / kPathSpeed));
}

TEST_CASE("lane path: far from every lane a path of kind lane still starts at the car") {
  const CircuitMap map = straight(600);
  PathBench bench(&map);
  const PathTable& t = bench.of(car_at(1e9, 0, 0), PathKind::kLane);  // beyond what a map can hold
  CHECK(t.x_m[0] == doctest::Approx(1e9 + 0.1 * kPathSpeed).epsilon(1e-12));
}

TEST_CASE("lane path: a slow car drives straight on, and one that stands stays where it is") {
  PathBench bench;
  TrackEstimate e = car_at(10, 20, kHalfPi, 4.0);
  e.mean.yaw_rate_rps = 0.5;
  CHECK(bench.of(e, PathKind::kStraight).y_m[29] == doctest::Approx(20 + 3 * 4.0));
  CHECK(bench.of(e, PathKind::kStraight).x_m[29] == doctest::Approx(10.0));
  e.mean.speed_mps = 0.2;
  const PathTable& t = bench.of(e, PathKind::kRest);
  for (int32_t k = 0; k < 30; ++k) {
    CHECK(std::hypot(t.x_m[k] - 10, t.y_m[k] - 20) < 0.16);
    CHECK(t.speed_mps[k] < 0.2);
  }
  CHECK(t.speed_mps[29] < 0.01);
  CHECK(t.var_y[29] < 1.0);  // it does not drive away
}

TEST_CASE("lane path: beyond the end of an open line a car drives straight on") {
  const CircuitMap map = straight(300);
  PathBench bench(&map);
  for (const double x : {200.0, 299.0, 310.0}) {
    const PathTable& t = bench.of(car_at(x, 2, 0), PathKind::kLane);
    CHECK(t.x_m[29] == doctest::Approx(x + 3 * kPathSpeed));
    CHECK(t.y_m[29] == doctest::Approx(2.0));
  }
}

TEST_CASE("lane path: fewer points are the first points of the whole path, in any number of blocks") {
  const CircuitMap map = circle(200, 600);
  PathBench bench(&map, 0.03, 3.0);
  for (const PathKind kind : kEveryKind) {
    const TrackEstimate e = car_at(196, 0, kHalfPi - 0.02);
    bench.table.points_per_track = 100;
    bench.of(e, kind);
    const std::vector<double> x(bench.table.x_m, bench.table.x_m + 100),
        var(bench.table.var_y, bench.table.var_y + 100);
    for (const int32_t points : {0, 1, 31, 32, 33, 64, 99}) {
      bench.table.points_per_track = points;
      const PathTable& t = bench.of(e, kind);
      REQUIRE(t.count == points);
      CHECK(std::memcmp(t.x_m, x.data(), std::size_t(points) * sizeof(double)) == 0);
      CHECK(std::memcmp(t.var_y, var.data(), std::size_t(points) * sizeof(double)) == 0);
    }
  }
}

TEST_CASE("lane path: with points far apart a car stays on its lane too") {
  const CircuitMap map = circle(200, 600);
  PathBench bench(&map, 5.0, 20.0);
  const PathTable& t = bench.of(car_at(195, 0, kHalfPi), PathKind::kLane);
  REQUIRE(t.count == 4);
  for (int32_t k = 0; k < 4; ++k) {
    const double angle = kPathSpeed * 5.0 * (k + 1) / 195;
    CHECK(std::hypot(t.x_m[k] - 195 * std::cos(angle), t.y_m[k] - 195 * std::sin(angle)) < 0.3);
  }
}

TEST_CASE("lane path: points far apart are the points of a fine path, also where the lane begins to turn") {
  const CircuitMap map = corner();
  PathBench coarse(&map, 2.0, 6.0), fine(&map, 0.1, 6.0);
  const TrackEstimate e = car_at(200, 7, 0.02);
  const PathTable &a = coarse.of(e, PathKind::kLane), &b = fine.of(e, PathKind::kLane);
  REQUIRE(a.count == 3);
  for (int32_t k = 0; k < 3; ++k) {
    const int32_t same = 20 * (k + 1) - 1;
    CAPTURE(k);
    CHECK(std::hypot(a.x_m[k] - b.x_m[same], a.y_m[k] - b.y_m[same]) < 0.3);
    CHECK(a.var_x[k] == doctest::Approx(b.var_x[same]).epsilon(0.01));
  }
}

TEST_CASE("lane path: covariances are positive definite for any state and any parameters") {
  std::mt19937_64 random(81);
  const CircuitMap map = circle(80, 50);
  int32_t off = 0, infinite = 0;
  for (int n = 0; n < 3000; ++n) {
    LaneTrackerParams p;
    const auto choose = [&](double least, double usual, double most) {
      const auto third = random() % 3;
      return third == 0 ? least : third == 1 ? usual : most;
    };
    p.path_turn_s = choose(0.01, 1.0, 1e6);
    p.path_speed = choose(0, 2.0, 1e6);
    p.path_across = choose(0, 0.1, 1e3);
    p.q_along = choose(0, 0.02, 1e6);
    p.q_across = choose(0, 0.006, 1e6);
    PathBench bench(n % 3 == 0 ? nullptr : &map, random() % 8 == 0 ? 1.0 : 0.1, random() % 8 == 0 ? 60.0 : 3.0, p);
    for (int i = 0; i < 20; ++i) {
      TrackEstimate e;
      e.mean = {draw(random, -120, 120), draw(random, -120, 120), draw(random, 0, 100), draw(random, -kPi, kPi),
                draw(random, -3, 3)};
      if (random() % 16 == 0) e.mean.x_m *= 1e6, e.mean.speed_mps *= 10, e.mean.yaw_rate_rps *= 33;
      double scale[kTrackStateSize], root[kTrackStateSize][kTrackStateSize];
      for (double& s : scale) s = std::pow(10.0, draw(random, -6, random() % 4 == 0 ? 9 : 1));
      for (auto& row : root)
        for (double& value : row) value = draw(random, -1, 1);
      for (int r = 0; r < kTrackStateSize; ++r)
        for (int c = 0; c < kTrackStateSize; ++c)
          for (int k = 0; k < kTrackStateSize; ++k)
            e.covariance[r][c] += scale[r] * scale[c] * (root[r][k] * root[c][k] + 1e-9 * (r == c));
      const PathTable& t = bench.of(e, kEveryKind[random() % 4]);
      for (int32_t k = 0; k < t.count; ++k) {
        const double det = t.var_x[k] * t.var_y[k] - t.cov_xy[k] * t.cov_xy[k];
        off += !(t.var_x[k] > 0 && t.var_y[k] > 0 && det > 0);
        infinite += !(std::isfinite(t.x_m[k]) && std::isfinite(t.y_m[k]) && std::isfinite(t.var_x[k]) &&
                      std::isfinite(t.var_y[k]) && std::fabs(t.course_rad[k]) <= kPi && std::isfinite(t.speed_mps[k]));
      }
    }
  }
  CHECK(off == 0);
  CHECK(infinite == 0);
}

TEST_CASE("lane path: the same bytes on every ISA") {
  const CircuitMap map = circle(80, 50);
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  std::mt19937_64 random(82);
  for (int n = 0; n < 100; ++n) {
    TrackEstimate e = car_at(draw(random, 70, 90), draw(random, -9, 9), kHalfPi + draw(random, -0.3, 0.3));
    e.mean.yaw_rate_rps = draw(random, -0.5, 0.5);
    uint64_t hash = 0;
    for (int32_t t = 0; t < table_count; ++t) {
      TrackerParams params;
      params.kernels = tables[t];
      LanePath path(params, &map);
      Arena arena;
      PathTable table;
      REQUIRE(arena.build(default_allocator(), [&](Carver& carver) {
        path.carve(carver);
        carve_table(carver, table, 30);
      }));
      path.fill();
      table.points_per_track = 30;
      path.write(e, kEveryKind[n % 4], -1, {}, table);
      if (t == 0) hash = hash_table(table, 0);
      CAPTURE(std::string(tables[t]->isa));
      CHECK(hash_table(table, 0) == hash);
    }
  }
}

}  // namespace overtake
