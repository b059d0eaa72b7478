// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The AV-21's LiDARs: four recorded frames, the opponent about 49 m ahead (data: RACECAR, CC BY-NC 4.0).
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <vector>

#include "tests/support/recorded.h"
#include "tools/client/session.h"
#include "tools/evaluation/racecar_wall.h"

namespace overtake {
namespace {

struct Box {
  double x, y, z, length, width, height, yaw;
};

Box read_box(int64_t frame) {
  char name[32];
  std::snprintf(name, sizeof name, "racecar/%06d_box.txt", int(frame));
  std::ifstream file(recorded(name));
  Box b{};
  file >> b.x >> b.y >> b.z >> b.length >> b.width >> b.height >> b.yaw;
  REQUIRE(file);
  return b;
}

struct Seen {
  int64_t frame = 0;
  int32_t near_box = 0;                 // detections within 3 m of the box's centre
  double ahead_m = 0, aside_m = 0;      // of the last of these: offset from the box's centre along and across its yaw
  int32_t points = 0, behind_wall = 0;  // of its cluster
  int32_t wall_points = 0;              // of the whole frame, up to a metre behind the wall's inner side
};

struct Run {
  std::vector<Seen> frames;
  int32_t confirmed_on_opponent = 0;  // after the last frame
  const io::Rig rig = io::load_rig("av21");
  int64_t next = 0;
  static constexpr int64_t kFrames[] = {2, 3, 4, 5};

  static void on_frame(ovt_reader* reader, void* self) { static_cast<Run*>(self)->add(reader); }

  void add(ovt_reader* reader) {
    Seen seen;
    seen.frame = kFrames[next++];
    const Box box = read_box(seen.frame);
    ovt_detections detections;
    REQUIRE(ovt_read_detections(reader, &detections) == OVT_OK);
    int32_t cluster = -1;
    for (int32_t i = 0; i < detections.count; ++i) {
      const double dx = double(detections.x_m[i]) - box.x, dy = double(detections.y_m[i]) - box.y;
      if (std::hypot(dx, dy) > 3.0) continue;
      ++seen.near_box;
      seen.ahead_m = dx * std::cos(box.yaw) + dy * std::sin(box.yaw);
      seen.aside_m = dy * std::cos(box.yaw) - dx * std::sin(box.yaw);
      cluster = detections.cluster[i];
    }
    for (int32_t s = 0; s < 3; ++s) {
      ovt_labels labels;
      REQUIRE(ovt_read_labels(reader, s, &labels) == OVT_OK);
      const io::RigSensor& sensor = rig.sensors[std::size_t(s)];
      const double yaw = sensor.yaw_deg * 3.14159265358979323846 / 180.0;
      for (int32_t i = 0; i < labels.count; ++i) {
        const double px = double(labels.x_m[i]), py = double(labels.y_m[i]), z = double(labels.z_m[i]) + sensor.z_m;
        const double x = std::cos(yaw) * px - std::sin(yaw) * py + sensor.x_m;
        const double y = std::sin(yaw) * px + std::cos(yaw) * py + sensor.y_m;
        const double behind = evaluation::behind_racecar_wall(x, y);
        if (behind > 0 && behind < 1 && z > 0.3) ++seen.wall_points;
        if (labels.label[i] > 0 && cluster >= 0 && labels.cluster_of_label[labels.label[i]] == cluster) {
          ++seen.points;
          if (behind > -0.3) ++seen.behind_wall;
        }
      }
    }
    frames.push_back(seen);

    ovt_tracks tracks;
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
    confirmed_on_opponent = 0;
    for (int32_t i = 0; i < tracks.count; ++i)
      if (tracks.state[i] == OVT_CONFIRMED && std::hypot(tracks.x_m[i] - box.x, tracks.y_m[i] - box.y) < 2.0)
        ++confirmed_on_opponent;
  }
};

void run_racecar(Run& run, int32_t workers) {
  cli::Options options;
  options.command = "run";
  options.input = recorded("racecar");
  options.rig = "av21";
  options.workers = workers;
  const cli::Config config = cli::load_config(options);
  cli::Session session(config, &Run::on_frame, &run);
  const io::Recording recording(config.input, config.rig);
  REQUIRE(recording.frame_count() == 4);
  for (std::size_t i = 0; i < recording.frame_count(); ++i) session.push(recording.read(i));
  session.flush();
}

}  // namespace

TEST_CASE("recorded: racecar: one detection on the opponent, centred, without a point of the wall") {
  OVT_NEED_RECORDED("racecar");
  for (int32_t workers : {1, 2}) {
    CAPTURE(workers);
    Run run;
    run_racecar(run, workers);
    REQUIRE(run.frames.size() == 4);
    for (const Seen& seen : run.frames) {
      CAPTURE(seen.frame);
      CHECK(seen.wall_points > 2500);  // the planes are on the wall
      if (seen.frame == 3) continue;   // its box is 2.2 m too far ahead
      CHECK(seen.near_box == 1);
      CHECK(std::fabs(seen.aside_m) < 0.6);
      CHECK(std::fabs(seen.ahead_m) < 1.0);
      CHECK(seen.points >= 30);
      CHECK(seen.behind_wall == 0);
      MESSAGE("frame " << seen.frame << ": " << seen.points << " points, off by " << seen.ahead_m << " m along and "
                       << seen.aside_m << " m across");
    }
    CHECK(run.confirmed_on_opponent == 1);
  }
}

}  // namespace overtake
