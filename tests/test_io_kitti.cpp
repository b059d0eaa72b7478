// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/kitti_tracking.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tests/support/recorded.h"
#include "tests/support/temp_folder.h"

using namespace overtake;

namespace {

const std::string kLabel =
    "3 7 Car 0 0 -1.8 296.7 161.7 455.2 292.3 2.0 1.8 4.5 1.0 2.0 10.0 0.5\n"
    "3 -1 DontCare -1 -1 -10 0 0 1 1 -1000 -1000 -1000 -10 -1 -1 -1\n";
const std::string kPose = "1 0 0 0 0 1 0 0 0 0 1 0\n";
// The camera looks along the Velodyne's x, 0.3 m ahead of it and 0.1 m below:
// camera (x, y, z) = (-y, -z - 0.1, x - 0.3).
const std::string kCalib = "P0: 1 2 3\n\nR0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 -0.1 1 0 0 -0.3\n";

}  // namespace

TEST_CASE("kitti_tracking: a label's centre is transformed by pose and calibration into the world") {
  const TempFolder folder;
  folder.write("0042_labels.txt", kLabel);
  folder.write("0042_calib.txt", kCalib);
  // Frame 3: the camera 20 m farther ahead (z) and rotated by 90 degrees to the left (its z is the old -x).
  folder.write("0042_poses.txt", kPose + kPose + kPose + "0 0 -1 0 0 1 0 0 1 0 0 20\n");
  const io::KittiSequence sequence = io::read_kitti_sequence(folder.path(), "0042");
  REQUIRE(sequence.labels.size() == 2);
  const io::KittiLabel& car = sequence.labels[0];
  CHECK(car.frame == 3);
  CHECK(car.track == 7);
  CHECK(car.type == "Car");
  CHECK(car.height_m == 2.0);
  CHECK(car.width_m == 1.8);
  CHECK(car.length_m == 4.5);
  CHECK(car.rotation_y_rad == 0.5);
  CHECK(sequence.labels[1].track == -1);
  CHECK(sequence.labels[1].type == "DontCare");
  // Camera of frame 3: (1, 2 - 1, 10); of frame 0: (-10, 1, 21); Velodyne: (21 + 0.3, 10, -1 - 0.1).
  double world[3];
  sequence.place(car, world);
  CHECK(world[0] == doctest::Approx(21.3));
  CHECK(world[1] == doctest::Approx(10.0));
  CHECK(world[2] == doctest::Approx(-1.1));
}

TEST_CASE("kitti_tracking: inverse and after satisfy their definitions") {
  io::RigidTransform t;
  const double c = std::cos(0.3), s = std::sin(0.3);
  const double rotation[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
  std::copy(&rotation[0][0], &rotation[0][0] + 9, &t.rotation[0][0]);
  t.translation_m[0] = 5;
  t.translation_m[2] = -2;
  const double p[3] = {1, 2, 3};
  double there[3], back[3], at_once[3];
  t.apply(p, there);
  t.inverse().apply(there, back);
  t.inverse().after(t).apply(p, at_once);
  for (int i = 0; i < 3; ++i) {
    CHECK(back[i] == doctest::Approx(p[i]));
    CHECK(at_once[i] == doctest::Approx(p[i]));
  }
  t.after(t).apply(p, at_once);
  t.apply(there, there);
  for (int i = 0; i < 3; ++i) CHECK(at_once[i] == doctest::Approx(there[i]));
}

TEST_CASE("kitti_tracking: the calibration's alternative spelling is accepted") {
  const TempFolder folder;
  const std::string path =
      folder.write("c", "R_rect 0 1 0 -1 0 0 0 0 1\nTr_velo_cam 1 0 0 1 0 1 0 2 0 0 1 3\nTr_imu_velo 1\n");
  // Camera = R_rect (velodyne + (1, 2, 3)), so the camera's origin is at (-1, -2, -3), and (0, -1, 0) is its x rotated
  // back.
  const io::RigidTransform t = io::read_kitti_camera_mounting(path);
  const double p[3] = {0, -1, 0};
  double out[3];
  t.apply(p, out);
  CHECK(out[0] == doctest::Approx(0.0));
  CHECK(out[1] == doctest::Approx(-2.0));
  CHECK(out[2] == doctest::Approx(-3.0));
}

TEST_CASE("kitti_tracking: bad files give an error with file and line") {
  const TempFolder folder;
  const auto error_of_labels = [&](const std::string& text) {
    return error_of([&] { io::read_kitti_labels(folder.write("l", text)); });
  };
  const auto error_of_poses = [&](const std::string& text) {
    return error_of([&] { io::read_kitti_poses(folder.write("p", text)); });
  };
  const auto error_of_calib = [&](const std::string& text) {
    return error_of([&] { io::read_kitti_camera_mounting(folder.write("c", text)); });
  };
  const std::string l = folder.path("l"), p = folder.path("p"), c = folder.path("c");
  CHECK(error_of_labels(kLabel + "0 1 Car\n") == l + ":3: 3 words, but a label of the tracking benchmark has 17");
  CHECK(error_of_labels("x" + kLabel) == l + ":1: 'x3' is not an integer from 0");
  CHECK(error_of_labels("3 -2 Car 0 0 0 0 0 0 0 1 1 1 0 0 0 0\n") == l + ":1: '-2' is not an integer from -1");
  CHECK(error_of_labels("3 1 Car 0 0 0 0 0 0 0 1 1 1 0 nan 0 0\n") == l + ":1: 'nan' is not a finite number");
  CHECK(error_of_poses(kPose + "1 2 3\n") == p + ":2: 3 numbers, but a transform has 12");
  CHECK(error_of_poses("1 0 0 0 0 1 0 0 0 0 1 a\n") == p + ":1: 'a' is not a finite number");
  CHECK(error_of_poses("1 0 0 0 0 2 0 0 0 0 1 0\n") == p + ":1: this is not a rotation matrix");
  CHECK(error_of_poses("\n") == p + ": no pose in it");
  CHECK(error_of_poses(kPose + "\n" + kPose) == "");
  CHECK(error_of_calib("R0_rect: 1 0 0 0 1 0 0 0 1\n") == c + ": Tr_velo_to_cam is missing");
  CHECK(error_of_calib("Tr_velo_to_cam: 1 0 0 0 0 1 0 0 0 0 1 0\n") == c + ": R0_rect is missing");
  CHECK(error_of_calib("R0_rect: 1 0\n") == c + ":1: 2 numbers, but a transform has 9");
  CHECK(error_of([&] { io::read_kitti_labels(folder.path("none")); }) == folder.path("none") + ": no such file");

  folder.write("0001_labels.txt", kLabel);
  folder.write("0001_poses.txt", kPose + kPose + kPose);
  folder.write("0001_calib.txt", kCalib);
  CHECK(error_of([&] { io::read_kitti_sequence(folder.path(), "0001"); }) ==
        folder.path("0001_labels.txt") + ": frame 3 has no pose");
}

// The whole chain, label to world: labels of a parked car, taken from a car that drives by, must not move.
TEST_CASE("kitti_tracking: parked cars do not move in the world while the ego drives by") {
  OVT_NEED_RECORDED("kitti/tracking");
  struct Parked {
    const char* sequence;
    std::vector<int32_t> tracks;  // parked at the roadside, seen for 16 to 50 frames
  };
  double farthest_m = 0;
  for (const Parked& parked :
       {Parked{"0000", {5, 6, 7, 8, 9, 10, 11, 13, 14}}, Parked{"0010", {7, 18, 19, 21, 22, 23}}}) {
    CAPTURE(parked.sequence);
    const io::KittiSequence sequence = io::read_kitti_sequence(recorded("kitti/tracking"), parked.sequence);
    for (const int32_t track : parked.tracks) {
      CAPTURE(track);
      std::vector<std::array<double, 3>> world;
      std::vector<double> ahead_m;  // of the camera
      double mean[3] = {0, 0, 0};
      for (const io::KittiLabel& label : sequence.labels) {
        if (label.track != track) continue;
        world.emplace_back();
        sequence.place(label, world.back().data());
        ahead_m.push_back(label.z_m);
        for (std::size_t a = 0; a < 3; ++a) mean[a] += world.back()[a];
      }
      REQUIRE(world.size() >= 16);
      const auto [near, far] = std::minmax_element(ahead_m.begin(), ahead_m.end());
      CHECK(*far - *near > 8.0);
      double spread_m = 0;
      for (const auto& p : world) {
        spread_m = std::max(spread_m,
                            std::hypot(p[0] - mean[0] / double(world.size()), p[1] - mean[1] / double(world.size())));
        CHECK(std::fabs(p[2] - mean[2] / double(world.size())) < 1.0);
      }
      CHECK(spread_m < 1.0);
      farthest_m = std::max(farthest_m, spread_m);
    }
  }
  MESSAGE("a parked car's label is at most " << farthest_m << " m from their mean");
}
