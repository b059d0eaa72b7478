// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Short scenarios of one difficulty each contain what their names say.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include "tests/support/temp_folder.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

namespace {

int32_t count_surface(const SimFrame& frame, uint16_t surface) {
  int32_t count = 0;
  for (const Scan& scan : frame.scans) count += int32_t(std::count(scan.surface.begin(), scan.surface.end(), surface));
  return count;
}
int32_t count_car(const SimFrame& frame, int32_t car) {
  return count_surface(frame, uint16_t(uint16_t(Surface::car) + car));
}

// Free distance between the bodies of two cars with nearly the same heading.
struct Gap {
  double along, across;
};
Gap gap_of(const TruthRow& a, const TruthRow& b) {
  const Vec3 off = b.center - a.center, ahead = a.state.T_map_vehicle.rotation.x,
             left = a.state.T_map_vehicle.rotation.y;
  return {std::fabs(dot(off, ahead)) - kCarLengthM, std::fabs(dot(off, left)) - kCarWidthM};
}

// The largest distance between rows in the middle of the front sensor's left head.
double row_step_deg(const std::string& name, int32_t rows) {
  Simulator simulator(load_scenario(name), 1, 0.1, 2);
  const Scan scan = simulator.frame(0).scans[0];
  CHECK(scan.lines == rows);
  CHECK(simulator.rig().sensors[0].rows == rows);
  CHECK(simulator.rig().sensors[0].point_capacity >= 2 * rows * simulator.rig().sensors[0].cols);  // two returns
  CHECK(*std::max_element(scan.time_ns.begin(), scan.time_ns.end()) < 50'000'000);
  double sum[2] = {0, 0};
  int32_t count[2] = {0, 0};
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double azimuth = std::atan2(double(scan.y_m[i]), double(scan.x_m[i])) / kDegree;
    const int32_t row = int32_t(scan.ring[i]) - rows * 5 / 8;
    if (azimuth < 20 || azimuth > 22 || row < 0 || row > 1) continue;
    sum[row] += std::asin(scan.z_m[i] / std::hypot(scan.x_m[i], scan.y_m[i], scan.z_m[i])) / kDegree, ++count[row];
  }
  return sum[0] / count[0] - sum[1] / count[1];
}

}  // namespace

TEST_CASE("scenarios: side_by_side: two cars 0.8 to 1.5 m apart for seconds, and the ego passes beside them") {
  const World world(load_scenario("side_by_side"));
  double abreast = 0, least = 9, most = 0, beside = 0;
  for (double t = 0; t < 10; t += 0.05) {
    const auto rows = truth_at(world, t);
    const Gap gap = gap_of(rows[1], rows[2]);
    if (gap.along < -4) abreast += 0.05, least = std::fmin(least, gap.across), most = std::fmax(most, gap.across);
    const Gap to_ego = gap_of(rows[0], rows[2]);
    CHECK((to_ego.along > 0 || to_ego.across > 0.8));
    if (t < 4) CHECK(std::fabs(to_ego.along - 30) < 1);
    beside += 0.05 * (to_ego.along < -2 && to_ego.across < 2);
  }
  CHECK(abreast > 9.5);
  CHECK(least == doctest::Approx(0.8).epsilon(0.05));
  CHECK(most == doctest::Approx(1.5).epsilon(0.05));
  CHECK(beside > 0.3);
}

TEST_CASE("scenarios: nose_to_tail: three cars 1 to 2 m apart, 20 to 60 m ahead") {
  const World world(load_scenario("nose_to_tail"));
  for (double t = 0; t < 10; t += 0.1) {
    const auto rows = truth_at(world, t);
    REQUIRE(rows.size() == 4);
    for (const int i : {1, 2}) {
      CHECK(gap_of(rows[std::size_t(i)], rows[std::size_t(i) + 1]).along > 1);
      CHECK(gap_of(rows[std::size_t(i)], rows[std::size_t(i) + 1]).along < 2);
    }
    CHECK(gap_of(rows[0], rows[1]).along > 15);
    CHECK(gap_of(rows[0], rows[1]).along < 61);
  }
  CHECK(gap_of(truth_at(world, 9.9)[0], truth_at(world, 9.9)[1]).along < 22);
}

TEST_CASE("scenarios: hidden and hidden_braking: a car shows few points for seconds, then many") {
  for (const char* name : {"hidden", "hidden_braking"}) {
    Simulator simulator(load_scenario(name), 1, 0, 2);
    const std::string which = name;
    CAPTURE(which);
    const double appears = which == "hidden" ? 7.5 : 5.5;
    int32_t hidden = 0, near = 0;
    for (const double t : {0.5, 1.5, 2.5}) {
      const SimFrame frame = simulator.frame(int32_t(t * 20));
      hidden += count_car(frame, 2), near += count_car(frame, 1);
    }
    CHECK(near > 300);
    CHECK(hidden < 45);  // three frames: between the wheels of the near car
    CHECK(count_car(simulator.frame(int32_t(appears * 20)), 2) > 45);
    const World& world = simulator.world();
    for (double t = 0; t < simulator.seconds(); t += 0.05) {  // nobody meets anybody
      const auto rows = truth_at(world, t);
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = i + 1; j < 3; ++j)
          CHECK((gap_of(rows[i], rows[j]).along > 0.5 || gap_of(rows[i], rows[j]).across > 0.5));
    }
    const double slowed = world.motions[2]->at(1.9).speed_mps - world.motions[2]->at(3.5).speed_mps;
    CHECK((which == "hidden_braking") == (slowed > 2));  // while it is still hidden
  }
}

TEST_CASE("scenarios: follower: the own rear wing leaves little of a car 14 m behind") {
  Simulator simulator(load_scenario("follower"), 3, 0, 2);
  for (const double t : {0.5, 5.0, 10.0}) {
    CAPTURE(t);
    const auto rows = truth_at(simulator.world(), t);
    CHECK(gap_of(rows[0], rows[1]).along > 5);
    CHECK(gap_of(rows[0], rows[1]).along < 15);
    const int32_t follower = count_car(simulator.frame(int32_t(t * 20)), 1);
    CHECK(follower >= 3);
    CHECK(follower < 100);  // beside the shadow, thousands
  }
}

TEST_CASE("scenarios: debris_on_track: boxes and tyres of 0.2 to 1 m on the racing line, near and far") {
  const Scenario scenario = load_scenario("debris_on_track");
  double least = 9, most = 0;
  int32_t tyres = 0;
  const World world(scenario);
  for (const Debris& piece : scenario.debris) {
    least = std::fmin(least, piece.size_m), most = std::fmax(most, piece.size_m), tyres += piece.tyre;
    CHECK(std::fabs(piece.d_m + 1) < 1.1);
    // From above: the piece at its height.
    const Vec3 place = world.track.place(piece.s_m, piece.d_m);
    const Hit hit = world.surroundings.cast({place.x, place.y, place.z + 3}, {0, 0, -1}, 0.01, 9);
    CHECK(world.surroundings.triangle(hit.triangle).surface == Surface::debris);
    CHECK(std::fabs(3 - hit.range_m - piece.height_m) < 0.05);
    CHECK((world.surroundings.triangle(hit.triangle).material == MaterialId::tyre) == piece.tyre);
  }
  CHECK(least == 0.2);
  CHECK(most == 1);
  CHECK(tyres >= 2);
  Simulator simulator(scenario, 1, 0, 2);
  int32_t frames = 0;
  for (int32_t k = 0; k < 150; k += 10) frames += count_surface(simulator.frame(k), uint16_t(Surface::debris)) >= 3;
  CHECK(frames >= 10);
  CHECK_THROWS_AS(parse_scenario("x", "[[car]]\nname = \"ego\"\n[[debris]]\ns_m = 1\nd_m = 0\nshape = \"cone\"\n"),
                  io::Error);
}

TEST_CASE("scenarios: reflectors bloom, dust lies beside the track") {
  Simulator posts(load_scenario("reflectors"), 1, 0, 2);
  int32_t blooming = 0, signs = 0;
  for (int32_t k = 10; k < 160; k += 15) {
    const SimFrame frame = posts.frame(k);
    blooming += count_surface(frame, uint16_t(Surface::blooming));
    signs += count_surface(frame, uint16_t(Surface::gantry_sign));
  }
  CHECK(blooming > 100);
  CHECK(signs > 100);
  Simulator cloud(load_scenario("dust"), 1, 0, 2);
  const SimFrame frame = cloud.frame(80);
  CHECK(count_surface(frame, uint16_t(Surface::smoke_dust)) > 1000);
  double left = 0, points = 0;
  for (int32_t s = 0; s < kSensors; ++s) {
    const Scan& scan = frame.scans[std::size_t(s)];
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.surface[i] != uint16_t(Surface::smoke_dust)) continue;
      const Vec3 p = cloud.mounting(s).nominal * Vec3{double(scan.x_m[i]), double(scan.y_m[i]), double(scan.z_m[i])};
      left += p.y > 6.25, points += 1;  // the ego drives 1.5 m right of the middle: the edge is 7.75 m to the left
    }
  }
  CHECK(left / points > 0.9);
}

TEST_CASE("scenarios: stopped_at_wall: a car stands parallel to the wall, 1 m from it, and is seen from 80 m on") {
  Simulator simulator(load_scenario("stopped_at_wall"), 1, 0, 2);
  const CarState state = simulator.world().motions[1]->at(3);
  CHECK(state.speed_mps == 0);
  const TrackPoint p = simulator.world().track.at(state.s_m);
  CHECK(std::fabs(wrap_angle(state.heading_rad - p.heading_rad)) < 1 * kDegree);
  const double wall = -p.width_right_m - simulator.world().track.wall_behind_edge_m();
  CHECK(std::fabs(state.d_m - kCarWidthM / 2 - wall - 1) < 0.05);
  double first = 0;
  for (int32_t k = 0; k < 140 && first == 0; k += 4)
    if (count_car(simulator.frame(k), 1) >= 3) first = truth_at(simulator.world(), k * 0.05)[1].in_ego.x;
  CHECK(first > 80);
}

TEST_CASE("scenarios: crashed_at_wall: a car across and one at 54 deg almost touch the wall") {
  Simulator simulator(load_scenario("crashed_at_wall"), 1, 0, 1);
  const Track& track = simulator.world().track;
  const double wanted_deg[] = {90, 54}, wanted_gap_m[] = {0.15, 0.3};
  for (int32_t car = 0; car < 2; ++car) {
    CAPTURE(car);
    const CarState state = simulator.world().motions[std::size_t(car) + 1]->at(3);
    CHECK(state.speed_mps == 0);
    const TrackPoint p = track.at(state.s_m);
    const double angle = std::fabs(wrap_angle(state.heading_rad - p.heading_rad));
    CHECK(angle == doctest::Approx(wanted_deg[car] * kDegree).scale(0).epsilon(0.01));
    const double half_m = 0.5 * (kCarLengthM * std::sin(angle) + kCarWidthM * std::cos(angle));
    CHECK(std::fabs(state.d_m - half_m + p.width_right_m + track.wall_behind_edge_m() - wanted_gap_m[car]) < 0.1);
  }
}

TEST_CASE("scenarios: wheel_to_wheel: two cars abreast with 0.6 m between them, which the ego comes up to") {
  Simulator simulator(load_scenario("wheel_to_wheel"), 1, 0, 1);
  for (const double at_s : {1.0, 7.5}) {
    CAPTURE(at_s);
    const auto cars = truth_at(simulator.world(), at_s);
    CHECK(std::fabs(cars[2].in_ego.y - cars[1].in_ego.y - kCarWidthM - 0.6) < 0.15);
    CHECK(std::fabs(cars[2].in_ego.x - cars[1].in_ego.x) < 1.0);
    CHECK(cars[1].in_ego.x > (at_s < 2 ? 14.0 : 2.0));
    CHECK(cars[1].in_ego.x < (at_s < 2 ? 18.0 : 5.0));
  }
}

TEST_CASE("scenarios: pit_lane: the ego drives behind the pit wall past standing and driving cars") {
  Simulator simulator(load_scenario("pit_lane"), 1, 0, 2);
  const World& world = simulator.world();
  int32_t parked = 0, standing = 0, driving = 0;
  bool passed = false;
  for (int32_t k = 0; k < 240; k += 12) {
    const auto rows = truth_at(world, k * 0.05);
    const TrackPoint p = world.track.at(rows[0].state.s_m);
    CHECK(rows[0].state.d_m > p.width_left_m + world.track.apron_m() + 9.5 + 1.5);  // behind the wall
    CHECK(gap_of(rows[0], rows[1]).along > 10);
    CHECK((gap_of(rows[0], rows[2]).along > 0 || gap_of(rows[0], rows[2]).across > 1));
    passed = passed || rows[2].in_ego.x < -2;
    const SimFrame frame = simulator.frame(k);
    parked += count_surface(frame, uint16_t(Surface::parked_vehicle));
    driving += count_car(frame, 1) > 50, standing += count_car(frame, 2) > 50;
  }
  CHECK(passed);
  CHECK(world.motions[2]->at(5).speed_mps == 0);
  CHECK(parked > 2000);
  CHECK(driving >= 15);
  CHECK(standing >= 5);
}

TEST_CASE("scenarios: kerbs_and_grass: kerbs of 8 cm in the curves, rough grass from the edge on") {
  const Scenario scenario = load_scenario("kerbs_and_grass");
  Scenario bare = scenario;
  bare.verge = {};
  const World world(scenario), level(bare);
  const auto above = [](const World& w, double s, double d) {
    const Vec3 place = w.track.place(s, d);
    const Hit hit = w.surroundings.cast({place.x, place.y, place.z + 2}, {0, 0, -1}, 0.01, 9);
    return 2 - hit.range_m;
  };
  int32_t kerbs = 0, none = 0;
  double lowest = 9, highest = -9;
  for (double s = 300; s < 760; s += 2.7) {
    const TrackPoint p = world.track.at(s);
    for (const double d : {p.width_left_m + 0.5, -p.width_right_m - 0.35}) {
      CHECK(std::fabs(above(level, s, d)) < 0.01);
      const double kerb = above(world, s, d);
      if (std::fabs(p.curvature_pm) > 1 / 300.0) {
        CHECK(std::fabs(kerb - 0.08) < 0.01);
        ++kerbs;
      } else if (std::fabs(p.curvature_pm) < 1 / 450.0 && d < 0) {
        CHECK(std::fabs(kerb) < 0.01);
        ++none;
      }
    }
    const double grass = above(world, s, p.width_left_m + 3);
    CHECK(grass > -0.01);
    CHECK(grass < 0.121);
    lowest = std::fmin(lowest, grass), highest = std::fmax(highest, grass);
    CHECK(std::fabs(above(world, s, p.width_left_m - 0.3)) < 0.01);  // the road
  }
  CHECK(kerbs > 20);
  CHECK(none > 20);
  CHECK(lowest < 0.03);
  CHECK(highest > 0.09);
}

TEST_CASE("scenarios: uniform_045, rows_64 and rows_128 have these rows") {
  CHECK(std::fabs(row_step_deg("uniform_045", 32) - 0.45) < 0.02);
  CHECK(std::fabs(row_step_deg("rows_64", 64) - 20.0 / 64) < 0.02);
  CHECK(std::fabs(row_step_deg("rows_128", 128) - 24.0 / 128) < 0.02);
}

TEST_CASE("scenarios: mounting_errors, map_shifted and ego_heading_off have errors of these sizes") {
  double place = 0, turn = 0;
  int32_t count = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Simulator run(load_scenario("mounting_errors"), seed, 0.1, 1);
    for (int32_t s = 0; s < kSensors; ++s, count += 3) {
      const Mounting& m = run.mounting(s);
      const Vec3 off = m.real.place - m.nominal.place;
      place += dot(off, off);
      for (const double cosine :
           {dot(m.real.rotation.x, m.nominal.rotation.x), dot(m.real.rotation.y, m.nominal.rotation.y),
            dot(m.real.rotation.z, m.nominal.rotation.z)})
        turn += 1 - cosine;  // their sum is the angle squared
    }
  }
  CHECK(std::sqrt(place / count) == doctest::Approx(0.02).scale(0).epsilon(0.2));
  CHECK(std::sqrt(turn / count) / kDegree == doctest::Approx(0.5).epsilon(0.2));

  Scenario shifted = load_scenario("map_shifted"), right = shifted;
  right.map_shift_m = 0;
  const Simulator a(shifted, 3, 0.1, 1), b(right, 3, 0.1, 1);
  const SurveyedMap moved = a.map(), own = b.map();
  for (std::size_t i = 0; i < own.x_m.size(); i += 50) {
    const double heading = a.world().track.at(double(i) * 2).heading_rad;
    CHECK(moved.x_m[i] - own.x_m[i] == doctest::Approx(-0.3 * std::sin(heading)).epsilon(1e-6));
    CHECK(moved.y_m[i] - own.y_m[i] == doctest::Approx(0.3 * std::cos(heading)).epsilon(1e-6));
    CHECK(moved.width_left_m[i] == own.width_left_m[i]);
  }

  const Simulator heading(load_scenario("ego_heading_off"), 1, 4, 1);
  double sum = 0;
  const auto poses = heading.ego_poses();
  for (const EgoPose& p : poses)
    sum += wrap_angle(p.yaw_rad - heading.world().motions[0]->at(double(p.stamp_ns) * 1e-9).course_rad);
  CHECK(sum / double(poses.size()) / kDegree == doctest::Approx(1).epsilon(0.05));
}

TEST_CASE("scenarios: the poses of poses_in_plane are those of demo without height, roll and pitch") {
  const auto flat = Simulator(load_scenario("poses_in_plane"), 1, 1, 1).ego_poses();
  const auto whole = Simulator(load_scenario("demo"), 1, 1, 1).ego_poses();
  REQUIRE(flat.size() == whole.size());
  for (std::size_t i = 0; i < flat.size(); ++i) {
    CHECK(std::fabs(flat[i].z_m) + std::fabs(flat[i].roll_rad) + std::fabs(flat[i].pitch_rad) == 0);
    CHECK(std::fabs(whole[i].roll_rad) > 0);
    CHECK(flat[i].x_m == whole[i].x_m);
    CHECK(flat[i].yaw_rad == whole[i].yaw_rad);
  }
}

TEST_CASE("scenarios: logs of no_map and no_poses lack these and say so, as files and as folders") {
  const TempFolder folder;
  for (const char* name : {"no_map", "no_poses", "demo"}) {
    const std::string which = name, path = folder.path(which + ".mcap");
    CAPTURE(which);
    Simulator simulator(load_scenario(name), 1, 0.1, 2);
    const auto log = make_mcap_log(path, simulator, 1), files = make_folder_log(folder.path(which), simulator, 1);
    for (int32_t k = 0; k < simulator.frame_count(); ++k)
      log->write(k, simulator.frame(k)), files->write(k, simulator.frame(k));
    log->close(), files->close();
    io::McapReader reader(path);
    io::McapMessage message;
    int32_t poses = 0, scans = 0;
    while (reader.next(message)) {
      const std::string& topic = reader.channels().at(message.channel_id).topic;
      poses += topic == "/ego/odometry", scans += topic == "/front/points";
    }
    bool map = false;
    for (const io::McapAttachment& a : reader.attachments()) map = map || a.name == "map.csv";
    CHECK(scans == 2);
    CHECK(map == (which != "no_map"));
    CHECK((poses > 0) == (which != "no_poses"));
    CHECK(std::filesystem::exists(folder.path(which + "/map.csv")) == (which != "no_map"));
    CHECK(std::filesystem::exists(folder.path(which + "/ego.csv")) == (which != "no_poses"));
    const auto& about = reader.metadata().at("overtake");
    CHECK(about.count("without") == (which == "demo" ? 0u : 1u));
    if (which != "demo") CHECK(about.at("without") == which.substr(3));
  }
  const Scenario neither = parse_scenario("x", "without = [\"map\", \"poses\"]\n[[car]]\nname = \"ego\"\n");
  CHECK((neither.without_map && neither.without_poses));
  CHECK_THROWS_AS(parse_scenario("x", "without = [\"rig\"]\n[[car]]\nname = \"ego\"\n"), io::Error);
}
