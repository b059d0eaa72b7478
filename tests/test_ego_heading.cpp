// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The error of the ego heading that one frame shows: walls against the map's bounds, and noise between ego poses.
#include "pipeline/ego_heading.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "core/math.h"
#include "pipeline/stages.h"

namespace {

using namespace overtake;

constexpr double kDeg = kPi / 180;
constexpr int64_t kStart = 5'000'000'000;
constexpr double kLeft = 6, kRight = 7;  // widths of the track

struct Place {
  double x, y, z;
};

// A track, and walls at a distance from its bounds. The place at (s, d) of the track is the same for map and walls.
struct Course {
  double radius_m = 0;  // of a left turn; 0: straight
  CircuitMap map;

  explicit Course(double radius = 0) : radius_m(radius) {
    std::vector<double> x, y, left, right;
    const int32_t count = radius > 0 ? int32_t(kTwoPi * radius / 2) : 301;
    for (int32_t i = 0; i < count; ++i) {
      const Place p = at(radius > 0 ? kTwoPi * radius * i / count : 2.0 * i - 300, 0);
      x.push_back(p.x), y.push_back(p.y), left.push_back(kLeft), right.push_back(kRight);
    }
    const char* error = nullptr;
    REQUIRE(map.build(x.data(), y.data(), left.data(), right.data(), nullptr, count, radius > 0, &error));
  }
  Place at(double s, double d) const {
    if (radius_m <= 0) return {s, d, 0};
    const double a = s / radius_m;
    return {(radius_m - d) * std::sin(a), radius_m - (radius_m - d) * std::cos(a), 0};
  }
  double heading(double s) const { return radius_m > 0 ? s / radius_m : 0; }
};

// The ego vehicle at s = 0 at kStart, on the line d.
struct Drive {
  double speed_mps = 0, d_m = -1;
  double error_rad = 0;   // true heading minus published heading
  double swerve_rps = 0;  // yaw rate beyond that of the course

  double s_at(double t) const { return speed_mps * t; }
};

struct Rig {
  std::vector<double> mounting_error_rad = {0.0};  // true yaw minus nominal yaw of each sensor, about its origin
};

struct WallScene {
  const Course& course;
  Drive drive;
  Rig rig;
  StageContext context;
  std::unique_ptr<Frame> frame = std::make_unique<Frame>();
  std::vector<SensorModel> models;
  std::vector<int32_t> capacity;
  double begin_s = 0;   // of the scan, after its stamp
  double placed_s = 0;  // where a driver compensates to; read if the sensor is compensated

  void compensate(double to_s) {
    placed_s = to_s;
    context.sensors[0].is_compensated = true;
    context.sensors[0].compensated_to_ns = int64_t(std::llround(to_s * 1e9));
  }
  WallScene(const Course& track, const Drive& way, const Rig& sensors = {}) : course(track), drive(way), rig(sensors) {
    context.sensor_count = int32_t(rig.mounting_error_rad.size());
    context.map = &course.map;
    context.detect.walls = {12.0f, 100.0, 0.08};
    models.resize(rig.mounting_error_rad.size());
    capacity.assign(models.size(), 60000);
    FrameSizes sizes;
    sizes.sensors = models.data(), sizes.point_capacity = capacity.data(), sizes.sensor_count = context.sensor_count;
    sizes.cluster_capacity = 64, sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 16;
    REQUIRE(build_frame(*frame, sizes, default_allocator()));
    frame->stamp_ns = frame->first_stamp_ns = kStart;
    frame->uses_map = true;
    for (int32_t s = 0; s < context.sensor_count; ++s) {
      frame->sensors[s].present = true;
      frame->sensors[s].stamp_ns = kStart;
    }
    frame->ego.count = 0;
    for (int32_t k = -10; k <= 20; ++k) {
      const double t = 0.01 * k, s = drive.s_at(t);
      const Place p = course.at(s, drive.d_m);
      EgoPose& pose = frame->ego.poses[frame->ego.count++];
      pose = {};
      pose.stamp_ns = kStart + int64_t(k) * 10'000'000;
      pose.x_m = p.x, pose.y_m = p.y;
      pose.yaw_rad = wrap_angle(course.heading(s) + drive.swerve_rps * t - drive.error_rad);
      pose.speed_mps = drive.speed_mps;
      pose.yaw_rate_rps = (course.radius_m > 0 ? drive.speed_mps / course.radius_m : 0) + drive.swerve_rps;
    }
  }

  // A cluster of one sensor: the points that a wall at (s, d(s)) shows during a scan of 50 ms from begin_s on, without
  // points beyond reach.
  template <class Distance>
  void add_wall(double from_s, double to_s, Distance&& d_of, int32_t sensor = 0, double step_m = 0.25) {
    std::vector<Place> points;
    std::vector<int32_t> offsets;
    const int32_t count = int32_t((to_s - from_s) / step_m);
    for (int32_t i = 0; i <= count; ++i) {
      const double s = from_s + (to_s - from_s) * i / std::max(count, 1);
      const double t = begin_s + 0.05 * i / std::max(count, 1);
      const double seen_s = context.sensors[sensor].is_compensated ? placed_s : t, ego_s = drive.s_at(seen_s);
      const Place p = course.at(s, d_of(s)), ego = course.at(ego_s, drive.d_m);
      const double yaw =
          course.heading(ego_s) + drive.swerve_rps * seen_s + rig.mounting_error_rad[std::size_t(sensor)];
      const double dx = p.x - ego.x, dy = p.y - ego.y, co = std::cos(yaw), si = std::sin(yaw);
      points.push_back({dx * co + dy * si, dy * co - dx * si, 0.5});
      offsets.push_back(int32_t(t * 1e9));
    }
    add_cluster(points, offsets, sensor);
  }
  void add_wall(double from_s, double to_s, double d, int32_t sensor = 0) {
    add_wall(
        from_s, to_s, [d](double) { return d; }, sensor);
  }

  void add_cluster(const std::vector<Place>& points, const std::vector<int32_t>& offsets, int32_t sensor) {
    SensorPart& part = frame->sensors[sensor];
    const int32_t row = frame->merged.count++, cluster = part.clusters.count++, member = frame->members.count++;
    part.clusters.point_begin[cluster] = part.cluster_points.count;
    part.clusters.point_count[cluster] = int32_t(points.size());
    frame->members.sensor[member] = sensor, frame->members.cluster[member] = cluster;
    frame->members.next_member[member] = -1, frame->members.merged[member] = row;
    frame->merged.first_member[row] = member;
    frame->merged.min_x_m[row] = frame->merged.min_y_m[row] = 1e9f;
    frame->merged.max_x_m[row] = frame->merged.max_y_m[row] = -1e9f;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int32_t k = part.cluster_points.count++;
      REQUIRE(k < part.cluster_points.capacity);
      const float x = float(points[i].x), y = float(points[i].y);
      part.cluster_points.x_m[k] = x, part.cluster_points.y_m[k] = y;
      part.cluster_points.z_m[k] = float(points[i].z), part.cluster_points.point[k] = k;
      part.scan.time_offset_ns[k] = offsets[i];
      frame->merged.min_x_m[row] = std::min(frame->merged.min_x_m[row], x);
      frame->merged.max_x_m[row] = std::max(frame->merged.max_x_m[row], x);
      frame->merged.min_y_m[row] = std::min(frame->merged.min_y_m[row], y);
      frame->merged.max_y_m[row] = std::max(frame->merged.max_y_m[row], y);
    }
  }
  const WallHeading& measure(int32_t sensor = 0) {
    measure_walls(context, *frame);
    return frame->walls[sensor];
  }
};

void check_offset(const WallHeading& walls, double expected_rad, double within_deg = 0.01) {
  CHECK(walls.valid);
  CHECK(walls.points >= 12);
  CHECK(walls.variance > 0);
  CHECK(std::sqrt(walls.variance) < 0.3 * kDeg);
  CAPTURE(walls.offset_rad / kDeg);
  CAPTURE(expected_rad / kDeg);
  CHECK(std::fabs(walls.offset_rad - expected_rad) < within_deg * kDeg);
}

constexpr double kOuter = -kRight - 0.5, kInner = kLeft + 9;  // walls behind the bounds

}  // namespace

TEST_CASE("walls: two walls beside a straight give the error of the heading, in both directions") {
  const Course course;
  for (const double degrees : {-1.0, -0.3, 0.0, 0.3, 1.0}) {
    WallScene scene(course, {.error_rad = degrees * kDeg});
    scene.add_wall(-80, 90, kOuter);
    scene.add_wall(-80, 90, kInner);
    check_offset(scene.measure(), degrees * kDeg);
  }
}

TEST_CASE("walls: one side is enough, left or right, at any distance from its bound") {
  const Course course;
  for (const double d : {kOuter, -kRight, -kRight - 4, kInner, kLeft + 0.2, kLeft + 20}) {
    CAPTURE(d);
    WallScene scene(course, {.error_rad = 0.4 * kDeg});
    scene.add_wall(-60, 90, d);
    const WallHeading walls = scene.measure();
    check_offset(walls, 0.4 * kDeg);
    const bool left = d > 0;
    CHECK(std::fabs(walls.beyond_m[left] - (left ? d - kLeft : -kRight - d)) < 0.1);
    CHECK(walls.beyond_m[!left] == WallHeading::kNoSide);
  }
}

TEST_CASE("walls: in a bend, and with the motion during the scan") {
  const Course course(220), straight;
  for (const double swerve : {0.0, 0.4, -0.4})
    for (const Course* track : {&course, &straight}) {
      WallScene scene(*track, {.speed_mps = 70, .error_rad = -0.7 * kDeg, .swerve_rps = swerve});
      scene.add_wall(-80, 90, kOuter);
      scene.add_wall(-40, 60, kInner);
      check_offset(scene.measure(), -0.7 * kDeg, 0.02);
    }
}

TEST_CASE("walls: points may be older than the scan's stamp") {
  for (const double radius : {300.0, 0.0}) {
    const Course course(radius);
    WallScene scene(course, {.speed_mps = 60, .error_rad = -0.7 * kDeg, .swerve_rps = radius > 0 ? 0.0 : 0.3});
    scene.begin_s = -0.05;
    scene.add_wall(-60, 90, kOuter);
    check_offset(scene.measure(), -0.7 * kDeg, 0.02);
  }
}

TEST_CASE("walls: points that a driver has compensated for the motion of the vehicle") {
  for (const double radius : {300.0, 0.0})
    for (const double to_s : {-0.05, 0.0, 0.05, 0.1}) {
      const Course course(radius);
      WallScene scene(course, {.speed_mps = 60, .error_rad = -0.7 * kDeg, .swerve_rps = radius > 0 ? 0.0 : 0.3});
      scene.compensate(to_s);
      scene.add_wall(-60, 90, kOuter);
      check_offset(scene.measure(), -0.7 * kDeg, 0.02);
    }
}

TEST_CASE("walls: points with an impossible time do not count") {
  const Course course;
  for (const int32_t wrong_ns : {INT32_MAX, INT32_MIN}) {
    WallScene scene(course, {.speed_mps = 60, .error_rad = 0.4 * kDeg});
    scene.add_wall(-60, 90, kOuter);
    for (int32_t k = 0; k < scene.frame->sensors[0].cluster_points.count; k += 50)
      scene.frame->sensors[0].scan.time_offset_ns[k] = wrong_ns;
    check_offset(scene.measure(), 0.4 * kDeg, 0.02);
  }
}

TEST_CASE("walls: none, cars alone, and a wall that is too short give no heading") {
  const Course course;
  {
    WallScene scene(course, {});
    CHECK_FALSE(scene.measure().valid);
  }
  {
    WallScene scene(course, {});
    for (double s = -80; s < 90; s += 12) {
      scene.add_wall(s, s + 4.9, -1.0);
      scene.add_wall(s, s + 4.9, kLeft + 3);  // parked
    }
    CHECK_FALSE(scene.measure().valid);
    CHECK(scene.measure().points == 0);
  }
  {
    WallScene scene(course, {});
    scene.add_wall(10, 35, kOuter);
    CHECK_FALSE(scene.measure().valid);
  }
}

TEST_CASE("walls: gaps, posts before the wall, a fence behind it and a recess do not count") {
  const Course course;
  WallScene scene(course, {.error_rad = 0.6 * kDeg});
  const auto wall = [](double s) {
    if (std::fmod(s + 300, 24.0) < 0.3) return kOuter + 0.5;  // posts
    if (s > 30 && s < 48) return kOuter - 4;                  // recess
    return kOuter;
  };
  scene.add_wall(-80, -25, wall);
  scene.add_wall(-5, 90, wall);
  for (const double behind : {0.45, 0.5, 0.55}) scene.add_wall(-80, 90, kOuter - behind);
  check_offset(scene.measure(), 0.6 * kDeg, 0.03);

  WallScene before_stands(course, {.error_rad = 0.6 * kDeg});
  before_stands.add_wall(
      -80, 90, [](double s) { return kOuter - 4 - 0.03 * s; }, 0, 0.05);
  before_stands.add_wall(-80, 90, kOuter);
  check_offset(before_stands.measure(), 0.6 * kDeg);
}

TEST_CASE("walls: a car beside the wall, in the wall's cluster, does not count") {
  const Course course;
  for (const double car_s : {-50.0, 0.0, 25.0, 70.0}) {
    CAPTURE(car_s);
    WallScene scene(course, {.error_rad = -0.5 * kDeg});
    scene.add_wall(-80, 90, [car_s](double s) { return std::fabs(s - car_s) < 2.5 ? kOuter + 1.2 : kOuter; });
    check_offset(scene.measure(), -0.5 * kDeg, 0.03);
  }
}

TEST_CASE("walls: a map of another place gives no heading") {
  const Course straight;
  {  // the walls bend, the map does not
    WallScene scene(straight, {});
    scene.add_wall(-80, 90, [](double s) { return kOuter + s * s / 440; });
    scene.add_wall(-80, 90, [](double s) { return kInner + s * s / 440; });
    CHECK_FALSE(scene.measure().valid);
  }
  {  // one side comes nearer, the other one too: no turn explains both
    WallScene scene(straight, {});
    scene.add_wall(-80, 90, [](double s) { return kOuter + 0.02 * s; });
    scene.add_wall(-80, 90, [](double s) { return kInner - 0.02 * s; });
    CHECK_FALSE(scene.measure().valid);
  }
  {  // most of the wall is at other distances
    WallScene scene(straight, {});
    scene.add_wall(-80, 90, [](double s) { return s < -15 ? kOuter : kOuter - 1 - std::floor((s + 15) / 10); });
    CHECK_FALSE(scene.measure().valid);
  }
  {  // a turn of 4 deg is no error of a heading
    WallScene scene(straight, {});
    scene.add_wall(-30, 30, [](double s) { return kOuter - 0.07 * s; });
    CHECK_FALSE(scene.measure().valid);
  }
}

TEST_CASE("walls: each sensor has its own heading, which contains the error of its mounting") {
  const Course course;
  WallScene scene(course, {.error_rad = 0.3 * kDeg}, {{0.2 * kDeg, -0.1 * kDeg}});
  for (const int32_t sensor : {0, 1}) scene.add_wall(-80, 90, kOuter, sensor);
  measure_walls(scene.context, *scene.frame);
  check_offset(scene.frame->walls[0], 0.5 * kDeg);
  check_offset(scene.frame->walls[1], 0.2 * kDeg);
  scene.frame->sensors[0].present = false;
  measure_walls(scene.context, *scene.frame);
  CHECK_FALSE(scene.frame->walls[0].valid);
  check_offset(scene.frame->walls[1], 0.2 * kDeg);
}

TEST_CASE("walls: not without map, nor without fresh ego poses, and near the end of an open map") {
  const Course course;
  WallScene scene(course, {});
  scene.add_wall(-80, 90, kOuter);
  CHECK(scene.measure().valid);
  scene.frame->uses_map = false;
  CHECK_FALSE(scene.measure().valid);
  scene.frame->uses_map = true;
  for (int32_t i = 0; i < scene.frame->ego.count; ++i) scene.frame->ego.poses[i].stamp_ns -= 400'000'000;
  CHECK_FALSE(scene.measure().valid);

  const Course early;
  WallScene at_end(early, {.error_rad = 0.2 * kDeg});
  for (int32_t i = 0; i < at_end.frame->ego.count; ++i) at_end.frame->ego.poses[i].x_m += 260;  // the map ends at 300
  at_end.add_wall(-60, 38, kOuter);
  at_end.add_wall(42, 95, [](double s) { return kOuter - 0.05 * (s - 42); });  // leaves the straight behind the end
  check_offset(at_end.measure(), 0.2 * kDeg);
}

TEST_CASE("walls: the order of the points has no effect") {
  const Course course(300);
  WallScene scene(course, {.speed_mps = 50, .error_rad = 0.3 * kDeg});
  scene.add_wall(-80, 90, kOuter);
  scene.add_wall(-80, 90, kInner);
  const WallHeading before = scene.measure();
  REQUIRE(before.valid);
  std::mt19937 random(3);
  ClusterPointTable& points = scene.frame->sensors[0].cluster_points;
  for (int32_t c = 0; c < 2; ++c) {
    const int32_t begin = scene.frame->sensors[0].clusters.point_begin[c];
    for (int32_t n = scene.frame->sensors[0].clusters.point_count[c]; n > 1; --n) {
      const int32_t a = begin + n - 1, b = begin + int32_t(random() % uint32_t(n));
      std::swap(points.x_m[a], points.x_m[b]), std::swap(points.y_m[a], points.y_m[b]);
      std::swap(points.z_m[a], points.z_m[b]), std::swap(points.point[a], points.point[b]);
    }
  }
  const WallHeading after = scene.measure();
  CHECK(after.offset_rad == before.offset_rad);
  CHECK(after.variance == before.variance);
  CHECK(after.points == before.points);
}

TEST_CASE("walls: a scan of many points gives the same heading") {
  const Course course;
  WallScene scene(course, {.error_rad = 0.25 * kDeg});
  scene.add_wall(
      -80, 90, [](double) { return kOuter; }, 0, 0.004);
  REQUIRE(scene.frame->sensors[0].cluster_points.count > 40000);
  check_offset(scene.measure(), 0.25 * kDeg);
}

TEST_CASE("walls: the variance grows with the scatter and falls with the length") {
  const Course course;
  const auto sigma_of = [&](double from, double to, double ripple_m) {
    WallScene scene(course, {});
    scene.add_wall(from, to, [&](double s) { return kOuter + ripple_m * std::sin(1.7 * s); });
    REQUIRE(scene.measure().valid);
    return std::sqrt(scene.measure().variance);
  };
  CHECK(sigma_of(-40, 40, 0.0) > 1.8 * sigma_of(-80, 80, 0.0));
  CHECK(sigma_of(-80, 80, 0.05) > 1.3 * sigma_of(-80, 80, 0.0));
  WallScene rough(course, {});
  rough.add_wall(-80, 80, [](double s) { return kOuter + 0.2 * std::sin(0.4 * s); });
  CHECK_FALSE(rough.measure().valid);
}

// ---- headings over time ---------------------------------------------------------------------------------------------

namespace {

EgoWindow window_of(int32_t count, const std::function<double(double)>& yaw,
                    const std::function<double(double)>& rate) {
  EgoWindow window;
  window.count = count;
  for (int32_t i = 0; i < count; ++i) {
    window.poses[i] = {};
    window.poses[i].stamp_ns = kStart + int64_t(i) * 10'000'000;
    window.poses[i].x_m = i;
    window.poses[i].yaw_rad = wrap_angle(yaw(0.01 * i));
    window.poses[i].yaw_rate_rps = rate(0.01 * i);
  }
  return window;
}
double rms_of(const EgoWindow& window, const std::function<double(double)>& yaw) {
  double sum = 0;
  for (int32_t i = 0; i < window.count; ++i) {
    const double e = wrap_angle(window.poses[i].yaw_rad - yaw(0.01 * i));
    sum += e * e;
  }
  return std::sqrt(sum / window.count);
}

}  // namespace

TEST_CASE("headings: the noise between poses goes, the turn stays, across the seam at 180 deg") {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.1 * kDeg);
  const auto yaw = [](double t) { return kPi - 0.02 + 0.35 * t; };
  const auto rate = [](double) { return 0.35; };
  const EgoWindow in = window_of(
      25, [&](double t) { return yaw(t) + noise(random); }, rate);
  EgoWindow out;
  smooth_headings(in, out, kAnyDrift);
  REQUIRE(out.count == 25);
  CHECK(rms_of(out, yaw) < 0.5 * rms_of(in, yaw));
  CHECK(out.poses[7].x_m == 7);  // all else is copied
  CHECK(out.poses[7].stamp_ns == in.poses[7].stamp_ns);

  const EgoWindow no_rate = window_of(
      25, [&](double t) { return yaw(t) + noise(random); }, [](double) { return 0.0; });
  smooth_headings(no_rate, out, kAnyDrift);
  CHECK(rms_of(out, yaw) < 0.6 * rms_of(no_rate, yaw));
}

TEST_CASE("headings: a change of the yaw rate stays, because the rates tell it") {
  const auto yaw = [](double t) { return t * t; };
  EgoWindow out;
  smooth_headings(window_of(25, yaw, [](double t) { return 2.0 * t; }), out, kAnyDrift);
  CHECK(rms_of(out, yaw) < 1e-6);
}

TEST_CASE("headings: a jump, and a window of two poses, are copied as they are") {
  EgoWindow out;
  const EgoWindow jump = window_of(
      20, [](double t) { return t < 0.1 ? 0.0 : 0.1; }, [](double) { return 0.0; });
  smooth_headings(jump, out, kAnyDrift);
  for (int32_t i = 0; i < 20; ++i) CHECK(out.poses[i].yaw_rad == jump.poses[i].yaw_rad);
  const EgoWindow two = window_of(
      2, [](double t) { return 7 * t; }, [](double) { return 0.0; });
  smooth_headings(two, out, kAnyDrift);
  CHECK(out.count == 2);
  CHECK(out.poses[1].yaw_rad == two.poses[1].yaw_rad);
}

TEST_CASE("headings: where the error drifts little, the line is flatter and the noise at its end smaller") {
  std::mt19937 random(8);
  std::normal_distribution<double> noise(0, 0.1 * kDeg);
  const auto rate = [](double) { return 0.3; };
  const auto yaw = [](double t) { return 1 + 0.3 * t; };
  double any = 0, little = 0;
  for (int32_t run = 0; run < 100; ++run) {
    EgoWindow window = window_of(
                  14, [&](double t) { return yaw(t) + noise(random); }, rate),
              out;
    smooth_headings(window, out, kAnyDrift);
    any += std::pow(out.poses[13].yaw_rad - yaw(0.13), 2);
    smooth_headings(window, window, 0.3 * kDeg);  // in place
    little += std::pow(window.poses[13].yaw_rad - yaw(0.13), 2);
  }
  CHECK(std::sqrt(any / 100) > 0.045 * kDeg);
  CHECK(std::sqrt(little / 100) < 0.035 * kDeg);

  // A drift that stands out of the noise stays.
  EgoWindow out;
  smooth_headings(window_of(
                      14, [](double t) { return 1 + 0.35 * t; }, rate),
                  out, 0.3 * kDeg);
  CHECK(out.poses[13].yaw_rad == doctest::Approx(1 + 0.35 * 0.13).epsilon(1e-6));
}
