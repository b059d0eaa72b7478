// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The surroundings of the simulated track and their materials, and each error of the sensors by its size.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "tools/io/error.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

Scenario without_errors(const std::string& name) {
  Scenario s = load_scenario(name);
  s.errors.range_noise_m = s.errors.clock_jitter_s = s.errors.mounting_error_m = s.errors.mounting_error_rad = 0;
  return s;
}

// Middles of one surface's triangles, in the order of the mesh.
std::vector<Vec3> middles(const Mesh& mesh, Surface surface) {
  std::vector<Vec3> out;
  for (const Triangle& t : mesh.triangles)
    if (t.surface == surface) out.push_back((t.a + t.b + t.c) * (1.0 / 3));
  return out;
}

int32_t count_surface(const SimFrame& frame, uint16_t surface) {
  int32_t count = 0;
  for (const Scan& scan : frame.scans) count += int32_t(std::count(scan.surface.begin(), scan.surface.end(), surface));
  return count;
}

}  // namespace

TEST_CASE("sim: fence posts stand every 6 m, the wall is 1.07 m high, and nothing stands on the road") {
  const Track track = Track::make("oval");
  const Mesh mesh = make_surroundings(track);
  // A post is a box of twelve triangles: their middles lie within its 0.14 m along the track.
  const std::vector<Vec3> posts = middles(mesh, Surface::fence_post);
  std::vector<Vec3> feet;
  for (std::size_t i = 0; i + 11 < posts.size(); i += 12) {
    Vec3 sum;
    for (std::size_t k = 0; k < 12; ++k) sum = sum + posts[i + k] * (1.0 / 12);
    if (feet.size() < 408) feet.push_back(sum);  // the cables follow; more posts would be closer together
  }
  REQUIRE(feet.size() == 408);
  for (std::size_t i = 0; i + 1 < feet.size(); ++i) {
    const double apart = std::hypot(feet[i + 1].x - feet[i].x, feet[i + 1].y - feet[i].y);
    REQUIRE(apart > 5.95);
    REQUIRE(apart < 6.35);  // they stand outside of the centre line in turns
  }
  const Bvh bvh(mesh);
  for (double s = 3; s < track.length_m(); s += 7.3) {
    const TrackPoint p = track.at(s);
    const double wall = -p.width_right_m - track.wall_behind_edge_m();
    const Vec3 road = track.place(s, -p.width_right_m + 1);
    // A ray straight down from 1 m above the road hits the road after 1 m.
    const Hit down = bvh.cast({road.x, road.y, road.z + 1}, {0, 0, -1}, 0.01, 50);
    REQUIRE(bvh.triangle(down.triangle).surface == Surface::road);
    REQUIRE(std::fabs(down.range_m - 1) < 0.03);
    // Towards the outside: the wall up to 1.07 m above its foot, the mesh of the fence above that.
    const Vec3 foot = track.place(s, wall), out = normalized({foot.x - road.x, foot.y - road.y, 0});
    const auto surface_at = [&](double above) {
      const Hit hit = bvh.cast({road.x, road.y, foot.z + above}, out, 0.01, 50);
      return hit.triangle < 0 ? Surface::none : bvh.triangle(hit.triangle).surface;
    };
    REQUIRE(surface_at(1.03) == Surface::outer_wall);
    const Surface over = surface_at(1.30);
    REQUIRE((over == Surface::fence_wire || over == Surface::fence_post || over == Surface::gantry_sign));
  }
}

TEST_CASE("sim: the oval has gantries, stands, an inner wall, grass, and a pit lane with parked cars and trucks") {
  const Mesh mesh = make_surroundings(Track::make("oval"));
  for (const Surface surface : {Surface::gantry_sign, Surface::building, Surface::inner_wall, Surface::apron_grass,
                                Surface::fence_wire, Surface::parked_vehicle})
    CHECK(middles(mesh, surface).size() > 50);
  std::set<MaterialId> parked;
  for (const Triangle& t : mesh.triangles)
    if (t.surface == Surface::parked_vehicle) parked.insert(t.material);
  CHECK(parked.contains(MaterialId::truck));
  CHECK(parked.contains(MaterialId::dark_carbon));
  Simulator pit(load_scenario("pit"), 1, 3, 2);
  CHECK(count_surface(pit.frame(40), uint16_t(Surface::parked_vehicle)) > 30);
  Simulator stopped(load_scenario("stopped_car"), 1, 8, 2);
  int32_t debris = 0;
  for (int32_t i = 120; i < 150; i += 5) debris += count_surface(stopped.frame(i), uint16_t(Surface::debris));
  CHECK(debris > 20);
}

TEST_CASE("sim: each part of a car has its material: carbon and tyres return almost only specular light") {
  std::map<MaterialId, int32_t> parts;
  for (const Triangle& t : make_race_car(Surface::car).triangles) ++parts[t.material];
  for (const MaterialId id : {MaterialId::paint, MaterialId::dark_carbon, MaterialId::tyre, MaterialId::alloy})
    CHECK(parts[id] > 20);
  const double slanted = std::cos(40 * kDegree);
  CHECK(returned_share(material_of(MaterialId::tyre), slanted) < 0.03);
  CHECK(returned_share(material_of(MaterialId::dark_carbon), slanted) < 0.03);
  CHECK(returned_share(material_of(MaterialId::dark_carbon), 1) > 0.5);  // the specular lobe
  CHECK(returned_share(material_of(MaterialId::paint), slanted) > 0.2);
  CHECK(returned_share(material_of(MaterialId::reflector), slanted) > 10);
}

TEST_CASE("sim: range noise, clock jitter and mounting errors have their specified sizes") {
  Scenario noisy = without_errors("overtake"), exact = noisy;
  noisy.errors.range_noise_m = 0.01;
  Simulator a(noisy, 3, 0.2, 2), b(exact, 3, 0.2, 2);
  const Scan with = a.frame(1).scans[0], without = b.frame(1).scans[0];
  REQUIRE(with.size() == without.size());  // the same random numbers: the same pulses are detected
  double squares = 0, sum = 0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const auto range = [i](const Scan& s) { return std::hypot(double(s.x_m[i]), double(s.y_m[i]), double(s.z_m[i])); };
    const double off = range(with) - range(without);
    sum += off, squares += off * off;
  }
  const double count = double(with.size());
  CHECK(std::sqrt(squares / count) / 0.01 == doctest::Approx(1).epsilon(0.015));
  CHECK(std::fabs(sum / count) < 3e-4);

  Scenario jittery = without_errors("overtake");
  jittery.errors.clock_jitter_s = 0.0002;
  jittery.errors.range_max_m = 1;  // nothing within range
  Simulator clock(jittery, 3, 2.6, 2);
  double jitter = 0;
  int32_t stamps = 0;
  for (int32_t i = 1; i < 50; ++i) {
    const SimFrame frame = clock.frame(i);
    for (const int64_t stamp : frame.stamp_ns) jitter += square(double(stamp - frame.begin_ns) * 1e-9), ++stamps;
  }
  CHECK(std::sqrt(jitter / stamps) / 0.0002 == doctest::Approx(1).epsilon(0.08));

  double places = 0, turns = 0;
  int32_t axes = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Simulator moved(load_scenario("overtake"), seed, 0.1, 1);
    for (int32_t s = 0; s < kSensors; ++s) {
      const Mounting& m = moved.mounting(s);
      const Vec3 off = m.real.place - m.nominal.place;
      const Mat3 turned{m.nominal.rotation.transposed_times(m.real.rotation.x),
                        m.nominal.rotation.transposed_times(m.real.rotation.y),
                        m.nominal.rotation.transposed_times(m.real.rotation.z)};
      const RollPitchYaw angles = angles_of(turned);
      places += dot(off, off), turns += square(angles.roll) + square(angles.pitch) + square(angles.yaw), axes += 3;
    }
  }
  CHECK(std::sqrt(places / axes) / 0.005 == doctest::Approx(1).epsilon(0.08));
  CHECK(std::sqrt(turns / axes) / (0.1 * kDegree) == doctest::Approx(1).epsilon(0.08));
  // The nominal mounting is the AV-21's.
  const Simulator nominal(load_scenario("overtake"), 1, 0.1, 1);
  CHECK(nominal.mounting(0).nominal.place.z == doctest::Approx(0.646));
  CHECK(nominal.mounting(1).nominal.place.z == doctest::Approx(0.741));
  CHECK(nominal.mounting(2).nominal.place.y == doctest::Approx(-0.267));
}

TEST_CASE("sim: a scenario may shift the field of view by up to 15 degrees, at 1 to 30 scans per second") {
  const std::string car = "[[car]]\nname = \"ego\"\n";
  const auto refused = [&](const std::string& sensors) {
    try {
      parse_scenario("race.toml", car + "[sensors]\n" + sensors);
    } catch (const io::Error&) {
      return true;
    }
    return false;
  };
  CHECK_FALSE(refused("fov_top_deg = 15\nfov_bottom_deg = -15\n"));
  CHECK_FALSE(refused("fov_top_deg = -3\nfov_bottom_deg = -15\n"));
  CHECK(refused("fov_top_deg = 15.1\n"));
  CHECK(refused("fov_bottom_deg = -15.1\n"));
  CHECK_FALSE(refused("rate_hz = 1\n"));
  CHECK_FALSE(refused("rate_hz = 30\n"));
  CHECK(refused("rate_hz = 31\n"));
  CHECK(refused("rate_hz = 0.9\n"));
}

TEST_CASE("sim: the scenarios contain what their names say, and the test seeds do not change") {
  const auto cars = [](const char* name) { return load_scenario(name).cars.size(); };
  CHECK(cars("empty_track") == 1);
  CHECK(cars("three_cars") == 3);
  CHECK(cars("las_vegas_15") == 2);
  CHECK(cars("race_start") == 12);
  CHECK(cars("pack") == 12);
  CHECK_FALSE(load_scenario("smoke").puffs.empty());
  CHECK_FALSE(load_scenario("spin").puffs.empty());
  CHECK_FALSE(load_scenario("stopped_car").debris.empty());
  CHECK(load_scenario("road_course").track == "road");
  for (const std::string& name : builtin_scenario_names())
    CHECK(load_scenario(name).test_seeds == std::vector<int64_t>{1001, 1002, 1003, 1004, 1005});

  const World spin(load_scenario("spin")), stopped(load_scenario("stopped_car")), three(load_scenario("three_cars")),
      blind(load_scenario("blind_zone"));
  double most_slip = 0, abreast = 0, behind = 0, slowest = 99;
  for (double t = 0; t < 12; t += 0.05) {
    const CarState state = spin.motions[1]->at(t);
    if (state.speed_mps > 5)
      most_slip = std::fmax(most_slip, std::fabs(wrap_angle(state.heading_rad - state.course_rad)));
    slowest = std::fmin(slowest, state.speed_mps);
    const auto rows = truth_at(three, t);
    const auto beside = [](const TruthRow& r) { return std::fabs(r.in_ego.x - kCarCenterXM) < kCarLengthM; };
    abreast += 0.05 * (beside(rows[1]) && beside(rows[2]) && rows[1].in_ego.y > 1.9 && rows[2].in_ego.y < -1.9);
    const TruthRow follower = truth_at(blind, t)[1];
    if (follower.in_ego.x < -18 && std::fabs(follower.in_ego.y) < 1.5) behind += 0.05;
  }
  CHECK(most_slip / kDegree > 150);  // it slides backwards
  CHECK(slowest < 0.5);
  CHECK(stopped.motions[1]->at(5).speed_mps < 0.01);
  CHECK(abreast > 0.5);  // seconds with a car on either side
  CHECK(behind > 5);     // seconds in the blind zone
}

TEST_CASE("sim: no two cars of a scenario touch each other") {
  // Discs of a car's width along it, in the frame of the ego. Their gap is the cars' where they drive side by side, and
  // up to half a car's width more at the corners.
  struct Disc {
    int32_t car;
    double x, y;
  };
  const double gap_m = 0.2, reach_m = (kCarLengthM - kCarWidthM) / 2;
  for (const std::string& name : builtin_scenario_names()) {
    const Scenario scenario = load_scenario(name);
    const World world(scenario);
    double least_m = 99, least_at_s = 0;
    for (double t = 0; t <= scenario.seconds; t += 0.1) {
      std::vector<Disc> discs;
      for (const TruthRow& row : truth_at(world, t))
        for (double at : {-1.0, -0.5, 0.0, 0.5, 1.0})
          discs.push_back({row.car, row.in_ego.x + at * reach_m * std::cos(row.heading_in_ego),
                           row.in_ego.y + at * reach_m * std::sin(row.heading_in_ego)});
      for (const Disc& a : discs)
        for (const Disc& b : discs) {
          const double apart_m = std::hypot(a.x - b.x, a.y - b.y) - kCarWidthM;
          if (a.car < b.car && apart_m < least_m) least_m = apart_m, least_at_s = t;
        }
    }
    INFO(name << " at " << least_at_s << " s: " << least_m << " m");
    CHECK(least_m > gap_m);
  }
}
