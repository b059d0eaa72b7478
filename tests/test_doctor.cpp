// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// doctor on a wrong rig: sensors with exchanged yaws, several sensors in one cloud, the number of rings of another
// sensor; and no such finding on the right rig.
#include "tools/cli/doctor.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/recorded.h"
#include "tests/support/scene.h"
#include "tools/io/recording.h"

using namespace overtake;
using cli::Doctor;
using cli::Finding;

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

template <class T>
io::CloudColumn column_of(const std::vector<T>& values, io::ValueType type) {
  io::Cloud cloud;
  io::add_column(cloud, "c", type, values);
  return cloud.columns[0];
}

io::SensorScan scan_of(int32_t sensor, int64_t stamp_ns, const std::vector<float>& x, const std::vector<float>& y,
                       const std::vector<float>& z, const std::vector<uint16_t>& layer) {
  io::SensorScan scan;
  scan.sensor = sensor;
  scan.stamp_ns = stamp_ns;
  scan.count = scan.input_count = int32_t(x.size());
  scan.x = column_of(x, io::ValueType::kFloat32);
  scan.y = column_of(y, io::ValueType::kFloat32);
  scan.z = column_of(z, io::ValueType::kFloat32);
  scan.layer = column_of(layer, io::ValueType::kUint16);
  return scan;
}

// "sensor 'left': its sentence", of the findings WRONG.
std::vector<std::string> wrong_with(const Doctor& doctor) {
  std::vector<std::string> out;
  for (const Finding& finding : doctor.findings())
    if (finding.wrong) out.push_back(finding.about + ": " + finding.sentence);
  return out;
}

int32_t find_sentence(const std::vector<std::string>& sentences, const std::string& part) {
  return int32_t(
      std::count_if(sentences.begin(), sentences.end(), [&](const auto& s) { return s.find(part) != s.npos; }));
}

// A rig in which sensor i has the yaw of sensor owner[i], and the expected sentences.
struct Turned {
  io::Rig rig;
  std::vector<std::string> expected;
};
Turned turn(const io::Rig& rig, const std::vector<std::size_t>& owner) {
  Turned turned{rig, {}};
  for (std::size_t i = 0; i < owner.size(); ++i) turned.rig.sensors[i].yaw_deg = rig.sensors[owner[i]].yaw_deg;
  for (std::size_t i = 0; i < owner.size(); ++i)  // the sensor whose yaw sensor i has in this rig
    for (std::size_t j = 0; j < owner.size() && owner[i] != i; ++j)
      if (owner[j] == i)
        turned.expected.push_back("sensor '" + rig.sensors[i].name +
                                  "': it seems to be turned as the rig says of sensor '" + rig.sensors[j].name + "'");
  return turned;
}

// All orders of the yaws: doctor names exactly the exchanged sensors and their partners, and finds nothing else wrong.
template <class Feed>
void check_all_orders(const io::Rig& rig, Feed&& feed) {
  std::vector<std::size_t> owner = {0, 1, 2};
  int32_t orders = 0;
  do {
    const Turned turned = turn(rig, owner);
    Doctor doctor(turned.rig);
    feed(doctor);
    const auto wrong = wrong_with(doctor);
    INFO(owner[0], owner[1], owner[2]);
    REQUIRE(wrong.size() == turned.expected.size());
    for (std::size_t k = 0; k < wrong.size(); ++k) CHECK_MESSAGE(wrong[k].starts_with(turned.expected[k]), wrong[k]);
    ++orders;
  } while (std::next_permutation(owner.begin(), owner.end()));
  CHECK(orders == 6);
}

// A spinning sensor `up` above the vehicle's frame that sees a road and walls on both sides, rings 0.75 degrees apart.
struct Spinning {
  double ahead_m, up_m;
  uint16_t first_line;
};
void add_spin(const Spinning& at, bool vehicle_frame, std::vector<float>& x, std::vector<float>& y,
              std::vector<float>& z, std::vector<uint16_t>& layer) {
  for (int32_t line = 0; line < 32; ++line)
    for (int32_t c = 0; c < 1440; ++c) {
      const double azimuth = 0.25 * kDegree * c, up = std::tan((10 - 0.75 * line) * kDegree);
      const double aside = std::sin(azimuth), wall = aside > 0 ? 4 : 9;
      double range = std::fabs(aside) > 0.02 ? wall / std::fabs(aside) : 1000;
      if (up < 0) range = std::min(range, -at.up_m / up);
      if (range > 100) continue;
      x.push_back(float(range * std::cos(azimuth) + (vehicle_frame ? at.ahead_m : 0)));
      y.push_back(float(range * std::sin(azimuth)));
      z.push_back(float(range * up + (vehicle_frame ? at.up_m : 0)));
      layer.push_back(uint16_t(at.first_line + line));
    }
}

std::vector<std::string> examine_spins(const std::string& rig, const std::vector<Spinning>& sensors,
                                       bool vehicle_frame) {
  std::vector<float> x, y, z;
  std::vector<uint16_t> layer;
  for (const Spinning& sensor : sensors) add_spin(sensor, vehicle_frame, x, y, z, layer);
  Doctor doctor(io::load_rig(rig));
  for (int32_t k = 0; k < 4; ++k) doctor.add_scan(scan_of(0, k * 100'000'000, x, y, z, layer));
  return wrong_with(doctor);
}

std::vector<std::string> examine_recorded(const char* folder, const char* name) {
  const io::Rig rig = io::load_rig(name);
  const io::Recording recording(recorded(folder), rig);
  Doctor doctor(rig);
  for (std::size_t i = 0; i < recording.frame_count(); ++i)
    for (const io::SensorScan& scan : recording.read(i).scans) doctor.add_scan(scan);
  return wrong_with(doctor);
}

}  // namespace

TEST_CASE("doctor: names exchanged yaws on a simulated road") {
  const Scene scene(1);
  std::vector<SceneFrame> frames;
  for (int32_t k = 0; k < 4; ++k) frames.push_back(scene.frame(k));
  check_all_orders(io::load_rig("av21"), [&](Doctor& doctor) {
    for (const SceneFrame& frame : frames)
      for (int32_t s = 0; s < kSceneSensors; ++s) {
        const SceneScan& from = frame.scan[s];
        doctor.add_scan(scan_of(s, frame.stamp_ns, from.x_m, from.y_m, from.z_m, from.layer));
      }
  });
}

TEST_CASE("doctor: names the parts of a view in which no scan has a point") {
  // Scans of the first sensor with a point each 0.1 deg, but for `empty` (from left to right).
  using Gaps = std::vector<std::pair<double, double>>;
  const auto notes = [](const io::Rig& rig, const Gaps& empty, const Gaps& empty_later) {
    Doctor doctor(rig);
    const io::RigSensor& model = rig.sensors[0];
    for (int32_t k = 0; k < 2; ++k) {
      std::vector<float> x, y, z;
      for (double a = model.azimuth_left_deg - 0.05; a > model.azimuth_right_deg; a -= 0.1) {
        const Gaps& gaps = k == 0 ? empty : empty_later;
        if (std::any_of(gaps.begin(), gaps.end(), [&](const auto& gap) { return a < gap.first && a > gap.second; }))
          continue;
        x.push_back(float(20 * std::cos(a * kDegree))), y.push_back(float(20 * std::sin(a * kDegree)));
        z.push_back(-0.5f);
      }
      doctor.add_scan(scan_of(0, k * 50'000'000, x, y, z, std::vector<uint16_t>(x.size(), 3)));
    }
    std::vector<std::string> out;
    for (const Finding& finding : doctor.findings())
      if (finding.sentence.find("none of its points is seen") != std::string::npos) out.push_back(finding.sentence);
    return out;
  };
  const io::Rig av21 = io::load_rig("av21"), hdl32 = io::load_rig("hdl32");
  CHECK(notes(av21, {}, {}).empty());
  CHECK(notes(av21, {{13, 10.2}}, {{13, 10.2}}).empty());
  CHECK(notes(av21, {{13, 7}}, {}).empty());  // one scan has points there
  const auto one = notes(av21, {{13, 7}}, {{20, 8}});
  REQUIRE(one.size() == 1);
  CHECK(one[0] == "none of its points is seen from 13 to 8 deg (left positive)");
  const auto two = notes(av21, {{60, 50}, {-56, -60}}, {{60, 50}, {-56, -60}});
  REQUIRE(two.size() == 1);
  CHECK(two[0] == "none of its points is seen from 60 to 50 deg, -56 to -60 deg (left positive)");
  CHECK(notes(hdl32, {}, {}).empty());
  const auto rear = notes(hdl32, {{-170, -175}}, {{-170, -175}});
  REQUIRE(rear.size() == 1);
  CHECK(rear[0] == "none of its points is seen from -170 to -175 deg (left positive)");
  CHECK(notes(av21, {{60, -32}}, {{60, -32}}).empty());  // most of the view: another rig
}

TEST_CASE("doctor: names the number of columns that the steps between the points ask for") {
  // Advice of scans whose lines have a point each step_deg; `returns` of each beam, at one azimuth.
  const auto advice = [](const io::Rig& rig, double step_deg, int32_t returns = 1) {
    Doctor doctor(rig);
    const io::RigSensor& model = rig.sensors[0];
    std::vector<float> x, y, z;
    std::vector<uint16_t> layer;
    for (uint16_t line = 0; line < 4; ++line)
      for (double a = model.azimuth_left_deg - 0.03; a > model.azimuth_right_deg; a -= step_deg)
        for (int32_t k = 0; k < returns; ++k) {
          const double range_m = 20 + k;
          x.push_back(float(range_m * std::cos(a * kDegree))), y.push_back(float(range_m * std::sin(a * kDegree)));
          z.push_back(-0.5f), layer.push_back(line);
        }
    for (int32_t k = 0; k < 4; ++k) doctor.add_scan(scan_of(0, k * 50'000'000, {}, {}, {}, {}));  // at first, nothing
    for (int32_t k = 4; k < 6; ++k) doctor.add_scan(scan_of(0, k * 50'000'000, x, y, z, layer));
    std::string out;
    for (const Finding& finding : doctor.findings())
      if (finding.advice.find("set cols") != std::string::npos) {
        CHECK(finding.wrong);
        out += finding.advice;
      }
    return out;
  };
  const io::Rig av21 = io::load_rig("av21"), hdl32 = io::load_rig("hdl32");
  CHECK(advice(av21, 0.14) == "");
  CHECK(advice(av21, 0.2) == "");  // some points are missing
  CHECK(advice(av21, 0.28) == "set cols = 429 in the rig file");
  CHECK(advice(av21, 0.07) == "set cols = 1714 in the rig file");
  CHECK(advice(av21, 0.011, 1) == "set cols = 10909 in the rig file");
  CHECK(advice(hdl32, 0.02) == "set cols = 16384 in the rig file");  // a rig has no more
  CHECK(advice(hdl32, 0.332, 2) == "");
  CHECK(advice(hdl32, 1.0) == "set cols = 360 in the rig file");
  CHECK(advice(av21, 4.0) == "");  // too few points
}

TEST_CASE("doctor: scans that could not be read are named, and are no gap") {
  const Scene scene(1);
  io::Rig rig = io::load_rig("av21");
  Doctor doctor(rig);
  for (int32_t k = 0; k < 12; ++k) {
    const SceneScan& from = scene.frame(k).scan[0];
    if (k % 2 == 1)
      doctor.add_error(0, std::to_string(k) + "_front.pcd is empty");
    else
      doctor.add_scan(scan_of(0, scene.frame(k).stamp_ns, from.x_m, from.y_m, from.z_m, from.layer));
  }
  std::vector<std::string> front;
  for (const Finding& finding : doctor.findings())
    if (finding.about == "sensor 'front'") front.push_back(finding.sentence);
  REQUIRE(front.size() == 1);
  CHECK(front[0] ==
        "6 of 12 scans cannot be read; the first: 1_front.pcd is empty; then: 3_front.pcd is empty; 5_front.pcd is "
        "empty; 7_front.pcd is empty; 9_front.pcd is empty; 11_front.pcd is empty");
}

TEST_CASE("doctor: poses beyond the first million count") {
  Doctor doctor(io::load_rig("av21"));
  const Scene scene(1);
  const SceneScan& from = scene.frame(0).scan[0];
  for (int32_t k = 0; k < 40; ++k)
    doctor.add_scan(scan_of(0, k * 50'000'000, from.x_m, from.y_m, from.z_m, from.layer));
  io::EgoRow row{};
  for (; row.stamp_ns < 1'000'000; ++row.stamp_ns) doctor.add_ego(row);
  for (; row.stamp_ns < 2'000'000'000; row.stamp_ns += 10'000'000) doctor.add_ego(row);
  row.stamp_ns -= 20'000'000;
  doctor.add_ego(row);
  std::vector<std::string> of_poses = wrong_with(doctor);
  std::erase_if(of_poses, [](const std::string& s) { return !s.starts_with("ego: "); });
  CHECK(of_poses == std::vector<std::string>{"ego: the stamps of its poses go back 1 time"});
}

TEST_CASE("doctor: a map whose points run against the drive is wrong") {
  io::MapData map;
  map.closed = true;
  for (int32_t i = 0; i < 100; ++i) {
    const double turn = 3.6 * kDegree * i;
    map.x_m.push_back(200 * std::cos(turn)), map.y_m.push_back(200 * std::sin(turn));
  }
  map.width_left_m = map.width_right_m = std::vector<double>(100, 5);
  io::MapData reversed = map;
  std::reverse(reversed.x_m.begin(), reversed.x_m.end());
  std::reverse(reversed.y_m.begin(), reversed.y_m.end());
  const auto said = [&](const io::MapData& data, int32_t crosswise, double speed_mps) {
    Doctor doctor(io::load_rig("av21"));
    doctor.set_map(data, "map.csv", ovt_default_params());
    for (int32_t i = 0; i < 41; ++i) {
      const double turn = 2 * kDegree * i;
      io::EgoRow row{};
      row.stamp_ns = i * 10'000'000;
      row.x_m = 200 * std::cos(turn), row.y_m = 200 * std::sin(turn);
      row.yaw_rad = turn + (i < crosswise ? -90 : 90) * kDegree;
      row.speed_mps = i < 5 ? 1 : speed_mps;
      doctor.add_ego(row);
    }
    std::vector<std::string> found = wrong_with(doctor);
    std::erase_if(found, [](const std::string& s) { return !s.starts_with("map: "); });
    return found.empty() ? std::string() : found[0];
  };
  CHECK(said(map, 0, 30) == "");
  CHECK(said(reversed, 0, 30) == "map: the ego vehicle drives against map.csv in 36 of 36 poses");
  CHECK(said(map, 20, 30) == "");
  CHECK(said(map, 30, 30) == "map: the ego vehicle drives against map.csv in 25 of 36 poses");
  CHECK(said(reversed, 0, 4) == "");
}

TEST_CASE("doctor: judges no yaw where nothing stands along the road") {
  const io::Rig rig = io::load_rig("av21");
  const Turned turned = turn(rig, {0, 2, 1});
  Doctor doctor(turned.rig);
  const SceneFrame frame = Scene(1).frame(0);
  for (int32_t s = 0; s < kSceneSensors; ++s) {
    const SceneScan& from = frame.scan[s];
    SceneScan road;
    for (std::size_t i = 0; i < from.x_m.size(); ++i) {
      if (from.surface[i] != SceneSurface::road) continue;
      road.x_m.push_back(from.x_m[i]), road.y_m.push_back(from.y_m[i]), road.z_m.push_back(from.z_m[i]);
      road.layer.push_back(from.layer[i]);
    }
    for (int32_t k = 0; k < 4; ++k)
      doctor.add_scan(scan_of(s, k * 50'000'000, road.x_m, road.y_m, road.z_m, road.layer));
  }
  CHECK(find_sentence(wrong_with(doctor), "turned as the rig says") == 0);
}

TEST_CASE("doctor: two sensors in one cloud are not one sensor of 64 rings, and their places are reported") {
  const auto wrong = examine_spins("hdl64", {{1.35, 1.64, 0}, {1.35, 1.52, 32}}, true);
  REQUIRE(wrong.size() == 1);
  CHECK_MESSAGE(wrong[0].find("along a line the elevation changes by") != std::string::npos, wrong[0]);
  CHECK_MESSAGE(wrong[0].find("lines 0 to 31 are seen from x_m = 1.3") != std::string::npos, wrong[0]);
  CHECK_MESSAGE(wrong[0].find("z_m = 1.64, lines 32 to 63 are seen from") != std::string::npos, wrong[0]);
  CHECK_MESSAGE(wrong[0].ends_with("z_m = 1.52"), wrong[0]);
}

TEST_CASE("doctor: finds a sensor's cloud in the vehicle frame by its rings, and reports the sensor's place") {
  const auto wrong = examine_spins("hdl32", {{0.94, 1.84, 0}}, true);
  REQUIRE(find_sentence(wrong, "along a line the elevation changes by") == 1);
  CHECK(find_sentence(wrong, "lines 0 to 31 are seen from x_m = 0.9") == 1);
  CHECK(find_sentence(wrong, "the road lies") == 0);  // which is the same fault
  for (const std::string& sentence : examine_spins("hdl32", {{0.94, 1.84, 0}}, false))
    CHECK_MESSAGE(sentence.find("its scans come every") != std::string::npos, sentence);
}

TEST_CASE("doctor: a rig with twice the rings of the clouds belongs to another sensor") {
  const auto wrong = examine_spins("hdl64", {{0.76, 1.73, 0}}, false);
  REQUIRE(wrong.size() == 1);
  CHECK(wrong[0].starts_with("sensor 'top': its clouds have 32 lines only, the rig's image 64 rows"));
}

TEST_CASE("recorded: doctor separates Argoverse's two sensors in one cloud from a sensor of 64 rings") {
  OVT_NEED_RECORDED("av2");
  CHECK(examine_recorded("av2", "av2").empty());
  const auto wrong = examine_recorded("av2", "hdl64");
  REQUIRE(wrong.size() == 1);
  const char* places = "lines 0 to 31 are seen from x_m = 1.3";
  CHECK_MESSAGE(wrong[0].find(places) != std::string::npos, wrong[0]);
  CHECK_MESSAGE(wrong[0].find("z_m = 1.64, lines 32 to 63 are seen from") != std::string::npos, wrong[0]);
}

TEST_CASE("recorded: doctor accepts KITTI for its sensor, and by its rings rejects two rigs in the vehicle frame") {
  OVT_NEED_RECORDED("kitti");
  CHECK(examine_recorded("kitti", "hdl64").empty());
  const auto wrong = examine_recorded("kitti", "av2");
  CHECK(find_sentence(wrong, "along a line the elevation changes by") > 0);
  CHECK(find_sentence(wrong, "the road lies") == 0);
}

TEST_CASE("recorded: doctor accepts nuScenes for its sensor, and rejects one of 64 rings") {
  OVT_NEED_RECORDED("nuscenes");
  CHECK(examine_recorded("nuscenes", "nuscenes").empty());
  CHECK(find_sentence(examine_recorded("nuscenes", "hdl64"), "32 lines only") == 1);
}

TEST_CASE("recorded: doctor names exchanged yaws of the race car's three sensors") {
  OVT_NEED_RECORDED("racecar");
  const io::Rig rig = io::load_rig("av21");
  const io::Recording recording(recorded("racecar"), rig);
  std::vector<io::FrameScans> frames;
  for (std::size_t i = 0; i < recording.frame_count(); ++i) frames.push_back(recording.read(i));
  check_all_orders(rig, [&](Doctor& doctor) {
    for (const io::FrameScans& frame : frames)
      for (const io::SensorScan& scan : frame.scans) doctor.add_scan(scan);
  });
}
