// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reading the output of `overtake simulate`, as a folder and as MCAP, gives the simulated data.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "tests/support/temp_folder.h"
#include "tools/io/csv.h"
#include "tools/io/ego_file.h"
#include "tools/io/formats.h"
#include "tools/io/map_file.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/pcd.h"
#include "tools/io/ros_messages.h"
#include "tools/sim/log_writer.h"

using namespace overtake;
using namespace overtake::sim;

TEST_CASE("sim: an MCAP log holds every cloud, its truth, ego poses and car states, in order of time") {
  const TempFolder folder;
  const std::string path = folder.path("race.mcap");
  Simulator simulator(load_scenario("three_cars"), 4, 0.3, 2);
  std::vector<SimFrame> frames;
  const auto log = make_mcap_log(path, simulator, 4);
  for (int32_t i = 0; i < simulator.frame_count(); ++i) {
    frames.push_back(simulator.frame(i));
    log->write(i, frames.back());
  }
  log->close();

  io::McapReader reader(path);
  io::McapMessage message;
  std::map<std::string, int32_t> counts;
  int64_t last_ns = 0;
  while (reader.next(message)) {
    CHECK(message.log_ns >= last_ns);
    last_ns = message.log_ns;
    const std::string topic = reader.channels().at(message.channel_id).topic;
    const int32_t number = counts[topic]++;
    if (topic == "/left/points" || topic == "/truth/left/surface") {
      const Scan& scan = frames[std::size_t(number)].scans[1];
      const io::PointCloud2 cloud = io::decode_point_cloud2(message.data);
      CHECK(cloud.header.stamp_ns == kEpochNs + frames[std::size_t(number)].stamp_ns[1]);
      CHECK(cloud.header.frame_id == "left");
      REQUIRE(cloud.width == scan.size());
      for (std::size_t i = 0; i < scan.size(); ++i) {
        const char* p = cloud.data.data() + i * cloud.point_step;
        if (topic == "/left/points") {
          float x;
          uint32_t t;
          std::memcpy(&x, p + cloud.fields[0].offset, 4), std::memcpy(&t, p + cloud.fields[5].offset, 4);
          REQUIRE(x == scan.x_m[i]);
          REQUIRE(t == scan.time_ns[i]);
        } else {
          uint16_t surface;
          std::memcpy(&surface, p + cloud.fields[0].offset, 2);
          REQUIRE(surface == scan.surface[i]);
        }
      }
    } else if (topic == "/opponent_2/odometry") {
      const io::Odometry o = io::decode_odometry(message.data);
      const TruthRow truth = truth_at(simulator.world(), double(o.header.stamp_ns - kEpochNs) * 1e-9)[2];
      CHECK(o.child_frame_id == "outside");
      CHECK(o.pose.x_m == doctest::Approx(truth.center.x));
      CHECK(io::rotation_of(o.pose).yaw_rad == doctest::Approx(truth.angles.yaw));
      CHECK(std::hypot(o.vx_mps, o.vy_mps) == doctest::Approx(truth.state.speed_mps));
    } else if (topic == "/tf_static") {
      const auto transforms = io::decode_transforms(message.data);
      REQUIRE(transforms.size() == 3);
      CHECK(transforms[1].pose.y_m == doctest::Approx(0.267));
      CHECK(io::rotation_of(transforms[1].pose).yaw_rad == doctest::Approx(120 * kDegree));
    }
  }
  CHECK(reader.damage() == "");
  for (const char* topic : {"/front/points", "/left/points", "/right/points", "/truth/front/surface", "/truth/cars",
                            "/opponent/odometry", "/opponent_2/odometry", "/truth/ego/odometry"})
    CHECK(counts[topic] == 6);
  CHECK(counts["/ego/odometry"] > 30);
  CHECK(counts["/tf_static"] == 1);
  CHECK(reader.metadata().at("overtake").at("scenario") == "three_cars");
}

TEST_CASE("sim: a folder holds the same data, and the readers of recordings accept it") {
  const TempFolder folder;
  Simulator simulator(load_scenario("overtake"), 2, 0.1, 2);
  const auto log = make_folder_log(folder.path("race"), simulator, 2);
  const SimFrame frame = simulator.frame(1);
  log->write(0, simulator.frame(0));
  log->write(1, frame);
  log->close();
  const io::Cloud points = io::read_cloud(folder.path("race/000001_right.pcd"));
  const Scan& scan = frame.scans[2];
  REQUIRE(points.find("x")->values() == scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    REQUIRE(points.find("z")->value(i) == double(scan.z_m[i]));
    REQUIRE(points.find("surface")->integer(i) == scan.surface[i]);
    REQUIRE(points.find("t")->integer(i) == kEpochNs + frame.stamp_ns[2] + scan.time_ns[i]);
  }
  const io::MapData map = io::read_map(folder.path("race/map.csv"));
  CHECK(map.closed);
  CHECK(map.banking_rad.size() == 1225);
  const auto ego = io::read_ego_file(folder.path("race/ego.csv"));
  CHECK(ego.size() > 20);
  CHECK(ego.front().stamp_ns == kEpochNs);
  CHECK(io::load_rig(folder.path("race/rig.toml")).sensors.size() == 3);
  const io::Csv truth = io::Csv::read(folder.path("race/truth.csv"));
  CHECK(truth.row_count() == 4);
  // The opponent's position in the ego's frame equals its position in the map.
  const CarState state = simulator.world().motions[0]->at(0.05);
  const Vec3 p =
      state.T_map_vehicle.inverse_times({truth.number(3, truth.need({"x_m"})), truth.number(3, truth.need({"y_m"})),
                                         truth.number(3, truth.need({"z_m"}))});
  CHECK(p.x == doctest::Approx(truth.number(3, truth.need({"ego_x_m"}))));
  CHECK(p.y == doctest::Approx(truth.number(3, truth.need({"ego_y_m"}))));
}
