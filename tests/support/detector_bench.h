// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A detector fed with the simulated overtake through the C API; records all its outputs as hashes, frame by frame.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "core/hash.h"
#include "pipeline/columns.h"
#include "pipeline/overtake.h"
#include "tests/support/scene.h"
#include "tests/support/test_method.h"

namespace overtake::test {

template <class T>
ovt_column column_of(const std::vector<T>& v, int32_t type) {
  return {v.data(), v.size() * sizeof(T), sizeof(T), type};
}

inline ovt_points points_of(const overtake::SceneScan& scan, int32_t sensor, int64_t stamp_ns) {
  ovt_points points;
  ovt_points_init(&points, sizeof points);
  points.sensor = sensor;
  points.count = int32_t(scan.x_m.size());
  points.stamp_ns = stamp_ns;
  points.x = column_of(scan.x_m, OVT_F32);
  points.y = column_of(scan.y_m, OVT_F32);
  points.z = column_of(scan.z_m, OVT_F32);
  points.layer = column_of(scan.layer, OVT_U16);
  points.intensity = column_of(scan.intensity, OVT_F32);
  points.time = column_of(scan.time_offset_s, OVT_F32);
  points.time_unit_ns = 1e9;
  return points;
}

// The same frames for every test case, made once.
inline const overtake::Scene& demo_scene() {
  static const overtake::Scene scene(7);
  return scene;
}
inline const overtake::SceneFrame& demo_frame(std::size_t index) {
  static std::vector<overtake::SceneFrame> frames;
  while (frames.size() <= index) frames.push_back(demo_scene().frame(int32_t(frames.size())));
  return frames[index];
}

inline std::array<ovt_sensor_def, 3> demo_sensors() {
  std::array<ovt_sensor_def, 3> sensors;
  for (int32_t s = 0; s < 3; ++s) {
    sensors[std::size_t(s)] = ovt_default_sensor_def();
    ovt_sensor_def& def = sensors[std::size_t(s)];
    const overtake::SceneMounting m = overtake::Scene::mounting(s);
    def.x_m = m.x_m, def.y_m = m.y_m, def.z_m = m.z_m, def.yaw_rad = m.yaw_rad;
  }
  return sensors;
}

struct FrameRecord {
  ovt_frame_info info;
  std::vector<int32_t> track_state;
  uint64_t detections = 0, tracks = 0, labels = 0, images = 0;  // hashes
  bool operator==(const FrameRecord& o) const {
    return std::memcmp(&info, &o.info, sizeof info) == 0 && track_state == o.track_state &&
           detections == o.detections && tracks == o.tracks && labels == o.labels && images == o.images;
  }
};

// Detections without the track column, which may depend on earlier frames. hash_tracks has that column.
inline uint64_t hash_detections(const ovt_detections& d) {
  overtake::Hash hash;
  hash.add_value(d.count);
  overtake::for_each_column(d, [&](const overtake::ColumnInfo& info, const auto* column, int64_t rows) {
    if (column && std::strcmp(info.name, "track") != 0) hash.add_bytes(column, std::size_t(rows) * sizeof *column);
  });
  return hash.value();
}

inline uint64_t hash_tracks(const ovt_tracks& t, const ovt_detections& d) {
  overtake::Hash hash;
  overtake::add_to_hash(hash, t);
  hash.add_bytes(d.track, std::size_t(d.count) * sizeof *d.track);
  return hash.value();
}

inline uint64_t hash_labels(ovt_reader* reader, int32_t sensor_count) {
  overtake::Hash hash;
  for (int32_t s = 0; s < sensor_count; ++s) {
    ovt_labels l;
    const ovt_status status = ovt_read_labels(reader, s, &l);
    hash.add_value(int32_t(status));
    if (status == OVT_OK) overtake::add_to_hash(hash, l);
  }
  return hash.value();
}

inline uint64_t hash_images(ovt_reader* reader, int32_t sensor_count) {
  overtake::Hash hash;
  for (int32_t s = 0; s < sensor_count; ++s)
    for (int32_t image = 0; image < OVT_IMAGE_COUNT; ++image) {
      ovt_image m;
      if (ovt_read_image(reader, s, ovt_image_id(image), &m) != OVT_OK) continue;
      const std::size_t bytes = std::size_t(m.type == OVT_IMAGE_BITS ? (m.cols + 63) / 64 * 8 : m.cols * 4);
      for (int32_t r = 0; r < m.rows; ++r)
        hash.add_bytes(static_cast<const char*>(m.data) + std::size_t(r) * m.stride_bytes, bytes);
    }
  return hash.value();
}

inline FrameRecord record_of(ovt_reader* reader, int32_t sensor_count, bool with_images = true) {
  FrameRecord record;
  ovt_read_info(reader, &record.info);
  record.info.latency_ns = 0;  // a duration: different in every run
  ovt_detections detections;
  ovt_tracks tracks;
  if (ovt_read_detections(reader, &detections) != OVT_OK ||
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) != OVT_OK)
    return record;
  record.detections = hash_detections(detections);
  record.tracks = hash_tracks(tracks, detections);
  record.labels = hash_labels(reader, sensor_count);
  if (with_images) record.images = hash_images(reader, sensor_count);
  record.track_state.assign(tracks.state, tracks.state + tracks.count);
  return record;
}

class DetectorBench {
 public:
  struct Options {
    int32_t workers = 1;
    int32_t push_policy = OVT_PUSH_WAIT;
    bool map = true;
    bool record = true;
  };
  explicit DetectorBench(const Options& options) {
    sensors = demo_sensors();
    def = ovt_default_detector_def();
    params = overtake::test::test_params();
    params.tracker_confirm_hits = 3;
    params.tracker_keep_hits = 2;
    def.sensors = sensors.data();
    def.sensor_count = 3;
    def.params = &params;
    def.worker_count = options.workers;
    def.push_policy = options.push_policy;
    if (options.map) {
      map = demo_scene().map();
      map_def = ovt_default_map_def();
      map_def.closed = 1;
      map_def.count = int32_t(map.x_m.size());
      map_def.x_m = map.x_m.data();
      map_def.y_m = map.y_m.data();
      map_def.width_left_m = map.width_left_m.data();
      map_def.width_right_m = map.width_right_m.data();
      map_def.banking_rad = map.banking_rad.data();
      def.map = &map_def;
    }
    def.user = this;
    if (options.record)
      def.on_frame = [](ovt_reader* reader, void* user) {
        auto* bench = static_cast<DetectorBench*>(user);
        bench->records.push_back(record_of(reader, bench->def.sensor_count));
      };
  }
  DetectorBench(const DetectorBench&) = delete;
  ~DetectorBench() { destroy(); }
  void create() {
    char error[256];
    const ovt_status status = ovt_create_detector_verbose(&def, &detector, error, sizeof error);
    CAPTURE(error);
    REQUIRE(status == OVT_OK);
  }
  void destroy() {
    ovt_destroy_detector(detector);
    detector = nullptr;
  }

  // Pushes the poses of a frame's scans, every 10 ms.
  void push_ego(std::size_t index) {
    for (int32_t i = 0; i < 5; ++i) {
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.stamp_ns = demo_frame(index).stamp_ns + i * 10'000'000;
      const overtake::ScenePose p = demo_scene().ego_at(double(pose.stamp_ns) * 1e-9);
      pose.x_m = p.x_m, pose.y_m = p.y_m, pose.z_m = p.z_m;
      pose.roll_rad = p.roll_rad, pose.pitch_rad = p.pitch_rad, pose.yaw_rad = p.yaw_rad;
      pose.speed_mps = p.speed_mps, pose.yaw_rate_rps = p.yaw_rate_rps;
      REQUIRE(ovt_push_ego_pose(detector, &pose) == OVT_OK);
    }
  }
  ovt_status push_scan(std::size_t index, int32_t sensor) {
    const overtake::SceneFrame& frame = demo_frame(index);
    const ovt_points points = points_of(frame.scan[sensor], sensor, frame.stamp_ns);
    return ovt_push_scan(detector, &points);
  }
  void push_frame(std::size_t index, const std::vector<int32_t>& order = {0, 1, 2}, bool ego = true) {
    if (ego) push_ego(index);
    for (const int32_t s : order) REQUIRE(push_scan(index, s) == OVT_OK);
  }
  void flush() { REQUIRE(ovt_flush(detector) == OVT_OK); }
  ovt_stats stats() const {
    ovt_stats out = ovt_default_stats();
    REQUIRE(ovt_read_stats(detector, &out) == OVT_OK);
    return out;
  }

  std::array<ovt_sensor_def, 3> sensors;
  ovt_params params;
  overtake::SceneMap map;
  ovt_map_def map_def;
  ovt_detector_def def;
  ovt_detector* detector = nullptr;
  std::vector<FrameRecord> records;
};

inline bool adds_up(const ovt_stats& s) { return s.pushed == s.used + s.dropped + s.late + s.dup; }

}  // namespace overtake::test
