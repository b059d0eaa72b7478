// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The simulated overtake: its points lie where geometry says, its truth belongs to its points.
#include "tests/support/scene.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace overtake;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Place {
  double x, y, z;
};

// Point i of a scan in the map frame, through the ego pose at the time of its measurement. Independent of the scene's
// code, from roll, pitch and yaw.
Place point_in_map(const Scene& scene, const SceneFrame& frame, int32_t sensor, size_t i) {
  const SceneScan& scan = frame.scan[sensor];
  const SceneMounting m = Scene::mounting(sensor);
  const double x = m.x_m + std::cos(m.yaw_rad) * scan.x_m[i] - std::sin(m.yaw_rad) * scan.y_m[i];
  const double y = m.y_m + std::sin(m.yaw_rad) * scan.x_m[i] + std::cos(m.yaw_rad) * scan.y_m[i];
  const double z = m.z_m + scan.z_m[i];
  const ScenePose ego = scene.ego_at(double(frame.stamp_ns) * 1e-9 + double(scan.time_offset_s[i]));
  const double across = std::cos(ego.roll_rad) * y - std::sin(ego.roll_rad) * z;
  const double up = std::sin(ego.roll_rad) * y + std::cos(ego.roll_rad) * z;
  return {ego.x_m + std::cos(ego.yaw_rad) * x - std::sin(ego.yaw_rad) * across,
          ego.y_m + std::sin(ego.yaw_rad) * x + std::cos(ego.yaw_rad) * across, ego.z_m + up};
}

SceneDef noiseless(double banking_rad) {
  SceneDef def;
  def.range_noise_m = 0;
  def.banking_rad = banking_rad;
  return def;
}

int32_t count_surface(const SceneScan& scan, SceneSurface surface) {
  return int32_t(std::count(scan.surface.begin(), scan.surface.end(), surface));
}

}  // namespace

TEST_CASE("scene: on a flat road every road point lies under its sensor by the mounting height") {
  const SceneFrame frame = Scene(1, noiseless(0)).frame(3);
  for (int32_t s = 0; s < kSceneSensors; ++s) {
    int32_t road = 0;
    for (size_t i = 0; i < frame.scan[s].x_m.size(); ++i) {
      if (frame.scan[s].surface[i] != SceneSurface::road) continue;
      ++road;
      REQUIRE(double(frame.scan[s].z_m[i]) == doctest::Approx(-Scene::mounting(s).z_m).epsilon(1e-5));
    }
    CHECK(road > 4000);
  }
}

TEST_CASE("scene: road, walls and fence lie on their cone and cylinders at the time of each point") {
  for (const double banking : {0.0, 0.0872664626, 0.3}) {
    CAPTURE(banking);
    const Scene scene(7, noiseless(banking));
    const SceneDef& def = scene.def();
    const double tan_banking = std::tan(banking);
    const SceneFrame frame = scene.frame(11);
    int32_t seen[7] = {};
    for (int32_t s = 0; s < kSceneSensors; ++s)
      for (size_t i = 0; i < frame.scan[s].x_m.size(); ++i) {
        const Place p = point_in_map(scene, frame, s, i);
        const double rho = std::hypot(p.x, p.y), inner = def.radius_m - def.width_left_m - def.wall_behind_edge_m;
        const double right = def.width_right_m + def.wall_behind_edge_m, outer = def.radius_m + right;
        const double over_edge = p.z - right * tan_banking;
        CAPTURE(s);
        CAPTURE(i);
        ++seen[int32_t(frame.scan[s].surface[i])];
        switch (frame.scan[s].surface[i]) {
          case SceneSurface::road:
            REQUIRE(std::fabs(p.z - (rho - def.radius_m) * tan_banking) < 1e-3);
            REQUIRE((rho > inner - 1e-3 && rho < outer + 1e-3));
            break;
          case SceneSurface::infield:
            REQUIRE(std::fabs(p.z + (def.radius_m - inner) * tan_banking) < 1e-3);
            REQUIRE(rho < inner + 1e-3);
            break;
          case SceneSurface::inner_wall: REQUIRE(std::fabs(rho - inner) < 1e-3); break;
          case SceneSurface::outer_wall:
            REQUIRE(std::fabs(rho - outer) < 1e-3);
            REQUIRE((over_edge > -1e-2 && over_edge < 1.1 + 1e-3));
            break;
          case SceneSurface::fence:
            REQUIRE(std::fabs(rho - outer) < 1e-3);
            REQUIRE((over_edge > 1.1 - 1e-3 && over_edge < 7.0 + 1e-3));
            break;
          case SceneSurface::building: REQUIRE((rho < inner - 29 || rho > outer + 21)); break;
          case SceneSurface::opponent: break;
        }
      }
    for (int32_t surface = 0; surface < 7; ++surface) {
      CAPTURE(surface);  // on a level road the inner wall hides the infield
      CHECK((seen[surface] > 0) == (banking > 0 || surface != int32_t(SceneSurface::infield)));
    }
  }
}

TEST_CASE("scene: opponent points lie in its box at the time of each point, from first sight until it is behind") {
  const Scene scene(3, noiseless(0.0872664626));
  for (int32_t index = 0; index < 80; index += 5) {
    CAPTURE(index);
    const SceneFrame frame = scene.frame(index);
    int32_t hits = 0;
    for (int32_t s = 0; s < kSceneSensors; ++s)
      for (size_t i = 0; i < frame.scan[s].x_m.size(); ++i) {
        if (frame.scan[s].surface[i] != SceneSurface::opponent) continue;
        ++hits;
        const Place p = point_in_map(scene, frame, s, i);
        const ScenePose car = scene.opponent_at(double(frame.stamp_ns) * 1e-9 + double(frame.scan[s].time_offset_s[i]));
        const double dx = p.x - car.x_m, dy = p.y - car.y_m;
        const double along = std::cos(car.yaw_rad) * dx + std::sin(car.yaw_rad) * dy;
        const double level = -std::sin(car.yaw_rad) * dx + std::cos(car.yaw_rad) * dy, up = p.z - car.z_m;
        const double across = std::cos(car.roll_rad) * level + std::sin(car.roll_rad) * up;
        REQUIRE(std::fabs(along) < Scene::kOpponentLengthM / 2 + 1e-3);
        REQUIRE(std::fabs(across) < Scene::kOpponentWidthM / 2 + 1e-3);
      }
    CHECK(hits >= 40);
  }
}

TEST_CASE("scene: the truth in the vehicle frame equals the truth in the map frame seen from the ego") {
  const Scene scene(1);
  const SceneFrame first = scene.frame(0);
  CHECK(std::hypot(first.opponent_x_m, first.opponent_y_m) == doctest::Approx(45.2).epsilon(0.01));
  for (int32_t index = 0; index < 80; index += 13) {
    const SceneFrame frame = scene.frame(index);
    CHECK(frame.stamp_ns == int64_t(index) * 50'000'000);
    const double dx = frame.opponent.x_m - frame.ego.x_m, dy = frame.opponent.y_m - frame.ego.y_m,
                 dz = frame.opponent.z_m - frame.ego.z_m;
    CHECK(frame.opponent_x_m == doctest::Approx(std::cos(frame.ego.yaw_rad) * dx + std::sin(frame.ego.yaw_rad) * dy));
    CHECK(std::hypot(frame.opponent_x_m, frame.opponent_y_m, frame.opponent_z_m) ==
          doctest::Approx(std::hypot(dx, dy, dz)));
  }
}

TEST_CASE("scene: the ego passes within four seconds, both cars at their speed along their heading") {
  const Scene scene(1);
  CHECK(scene.frame(0).opponent_x_m > 40);
  CHECK(scene.frame(80).opponent_x_m < -5);
  for (const double t : {0.0, 1.7, 3.9}) {
    const double h = 1e-4;
    for (const bool ego : {true, false}) {
      const ScenePose a = ego ? scene.ego_at(t - h) : scene.opponent_at(t - h);
      const ScenePose b = ego ? scene.ego_at(t + h) : scene.opponent_at(t + h);
      const ScenePose now = ego ? scene.ego_at(t) : scene.opponent_at(t);
      CHECK((b.x_m - a.x_m) / (2 * h) == doctest::Approx(now.speed_mps * std::cos(now.yaw_rad)).epsilon(1e-6));
      CHECK((b.y_m - a.y_m) / (2 * h) == doctest::Approx(now.speed_mps * std::sin(now.yaw_rad)).epsilon(1e-6));
      CHECK(std::remainder(b.yaw_rad - a.yaw_rad, 2 * kPi) / (2 * h) ==
            doctest::Approx(now.yaw_rate_rps).epsilon(1e-6));
    }
  }
}

TEST_CASE("scene: a frame depends only on seed and index") {
  const Scene scene(42), same(42), other(43);
  (void)same.frame(9);
  const SceneFrame a = scene.frame(4), b = same.frame(4), c = other.frame(4);
  for (int32_t s = 0; s < kSceneSensors; ++s) {
    CHECK(a.scan[s].x_m == b.scan[s].x_m);
    CHECK(a.scan[s].z_m == b.scan[s].z_m);
    CHECK(a.scan[s].intensity == b.scan[s].intensity);
    CHECK(a.scan[s].layer == b.scan[s].layer);
    CHECK(a.scan[s].time_offset_s == b.scan[s].time_offset_s);
    CHECK(a.scan[s].x_m != c.scan[s].x_m);
  }
  CHECK(a.scan[0].x_m.size() != a.scan[1].x_m.size());
}

TEST_CASE("scene: scans resemble recorded ones: about 25,000 points, 32 rings, a centimetre of noise") {
  const Scene scene(5);
  const SceneFrame frame = scene.frame(0), exact = Scene(5, noiseless(scene.def().banking_rad)).frame(0);
  for (int32_t s = 0; s < kSceneSensors; ++s) {
    const SceneScan &scan = frame.scan[s], &without_noise = exact.scan[s];
    CAPTURE(s);
    CHECK(scan.x_m.size() > 20'000);
    CHECK(scan.x_m.size() < 28'000);
    for (uint16_t layer = 0; layer < kSceneLayers; ++layer)
      CHECK(std::find(scan.layer.begin(), scan.layer.end(), layer) != scan.layer.end());
    CHECK(scan.time_offset_s.front() >= 0);
    CHECK(scan.time_offset_s.back() < 0.045f);
    CHECK(std::is_sorted(scan.time_offset_s.begin(), scan.time_offset_s.end()));

    REQUIRE(scan.x_m.size() == without_noise.x_m.size());
    double sum = 0, sum_of_squares = 0;
    for (size_t i = 0; i < scan.x_m.size(); ++i) {
      const double r = std::hypot(double(scan.x_m[i]), double(scan.y_m[i]), double(scan.z_m[i]));
      const double r0 =
          std::hypot(double(without_noise.x_m[i]), double(without_noise.y_m[i]), double(without_noise.z_m[i]));
      sum += r - r0;
      sum_of_squares += (r - r0) * (r - r0);
      REQUIRE(std::fabs(std::atan2(double(scan.y_m[i]), double(scan.x_m[i]))) < kPi / 3);
    }
    const double n = double(scan.x_m.size());
    CHECK(std::fabs(sum / n) < 0.0003);
    CHECK(std::fabs(std::sqrt(sum_of_squares / n) - 0.01) < 0.0002);
  }
  CHECK(count_surface(frame.scan[0], SceneSurface::opponent) >= 40);  // at 45 m
  CHECK(count_surface(frame.scan[1], SceneSurface::opponent) == 0);
}

TEST_CASE("scene: ring spacing is 0.25 degrees near the horizon, 2 degrees at the edges, symmetric") {
  const double degree = kPi / 180;
  for (int32_t layer = 0; layer + 1 < kSceneLayers; ++layer) {
    const double spacing = Scene::layer_elevation_rad(layer) - Scene::layer_elevation_rad(layer + 1);
    CHECK(spacing >= 0.25 * degree - 1e-12);
    CHECK(Scene::layer_elevation_rad(layer) == doctest::Approx(-Scene::layer_elevation_rad(kSceneLayers - 1 - layer)));
  }
  CHECK(Scene::layer_elevation_rad(15) - Scene::layer_elevation_rad(16) == doctest::Approx(0.25 * degree));
  CHECK(Scene::layer_elevation_rad(0) - Scene::layer_elevation_rad(1) == doctest::Approx(2 * degree));
}

TEST_CASE("scene: without an opponent no point is labelled as one, and every other ray has the same hit") {
  SceneDef def;
  def.has_opponent = false;
  const SceneFrame empty_frame = Scene(5, def).frame(0), full_frame = Scene(5).frame(0);
  const SceneScan &empty = empty_frame.scan[0], &full = full_frame.scan[0];
  CHECK(count_surface(empty, SceneSurface::opponent) == 0);
  size_t next = 0;
  for (size_t i = 0; i < full.x_m.size(); ++i) {
    if (full.surface[i] == SceneSurface::opponent) continue;
    while (next < empty.x_m.size() && (empty.x_m[next] != full.x_m[i] || empty.y_m[next] != full.y_m[i])) ++next;
    REQUIRE(next < empty.x_m.size());
    REQUIRE(empty.z_m[next] == full.z_m[i]);
    REQUIRE(empty.surface[next] == full.surface[i]);
  }
}

TEST_CASE("scene: the map is the closed centre line with the track's widths") {
  const Scene scene(1);
  const SceneMap map = scene.map();
  const size_t count = map.x_m.size();
  CHECK(count > 1000);
  for (size_t i = 0; i < count; ++i) {
    const size_t next = (i + 1) % count;
    REQUIRE(std::hypot(map.x_m[i], map.y_m[i]) == doctest::Approx(scene.def().radius_m));
    REQUIRE(std::hypot(map.x_m[next] - map.x_m[i], map.y_m[next] - map.y_m[i]) == doctest::Approx(2.0).epsilon(0.01));
    REQUIRE(map.x_m[i] * map.y_m[next] - map.y_m[i] * map.x_m[next] > 0);  // counter-clockwise, as both cars drive
    REQUIRE(map.width_left_m[i] == 8);
    REQUIRE(map.width_right_m[i] == 6);
  }
}
