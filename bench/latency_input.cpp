// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/latency_input.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "bench/clouds.h"
#include "tools/client/session.h"
#include "tools/io/error.h"

namespace overtake::bench {
namespace {

constexpr std::size_t kMaxRecordedFrames = 200;  // all of them stay in memory
constexpr int32_t kPosesPerFrame = 5;            // in the scene: 100 Hz

// The format of a driver: records of 24 bytes.
std::vector<char> to_records(const SceneScan& scan) {
  std::vector<char> bytes(scan.x_m.size() * sizeof(CloudPoint));
  for (std::size_t i = 0; i < scan.x_m.size(); ++i) {
    const CloudPoint point{scan.x_m[i],
                           scan.y_m[i],
                           scan.z_m[i],
                           scan.intensity[i],
                           scan.layer[i],
                           0,
                           uint32_t(std::lround(double(scan.time_offset_s[i]) * 1e9))};
    std::memcpy(bytes.data() + i * sizeof point, &point, sizeof point);
  }
  return bytes;
}

ovt_points to_points(int32_t sensor, const std::vector<char>& records) {
  ovt_points points;
  ovt_points_init(&points, sizeof points);
  points.sensor = sensor;
  points.count = int32_t(records.size() / sizeof(CloudPoint));
  const auto column = [&](std::size_t offset, ovt_type type) {
    return ovt_column{records.data() + offset, records.size() - std::min(offset, records.size()), sizeof(CloudPoint),
                      type};
  };
  points.x = column(offsetof(CloudPoint, x_m), OVT_F32);
  points.y = column(offsetof(CloudPoint, y_m), OVT_F32);
  points.z = column(offsetof(CloudPoint, z_m), OVT_F32);
  points.intensity = column(offsetof(CloudPoint, intensity), OVT_F32);
  points.layer = column(offsetof(CloudPoint, layer), OVT_U16);
  points.time = column(offsetof(CloudPoint, time_ns), OVT_U32);
  points.time_unit_ns = 1;
  return points;
}

ovt_ego_pose to_pose(int64_t stamp_ns, const ScenePose& at) {
  return cli::to_pose(
      {stamp_ns, at.x_m, at.y_m, at.z_m, at.roll_rad, at.pitch_rad, at.yaw_rad, at.speed_mps, at.yaw_rate_rps});
}

}  // namespace

LatencyInput::LatencyInput(const ReplayDef& def) {
  def.recording.empty() ? load_scene(def) : load_recording(def);
  if (has_map_) map_def_ = cli::to_map_def(map_);
}

void LatencyInput::load_scene(const ReplayDef& def) {
  scene_ = std::make_unique<Scene>(def.scene_seed);
  for (const io::RigSensor& sensor : io::load_rig("av21").sensors) sensors_.push_back(cli::to_sensor_def(sensor));
  period_ns_ = int64_t(scene_->def().period_s * 1e9 + 0.5);
  const SceneMap map = scene_->map();
  map_.closed = true;
  map_.x_m = map.x_m;
  map_.y_m = map.y_m;
  map_.width_left_m = map.width_left_m;
  map_.width_right_m = map.width_right_m;
  map_.banking_rad = map.banking_rad;
  has_map_ = true;
  std::size_t points = 0;
  scene_points_.reserve(std::size_t(def.scene_frames) * kSceneSensors);  // other structs point to the records
  for (int32_t i = 0; i < def.scene_frames; ++i) {
    const SceneFrame frame = scene_->frame(i);
    std::vector<ReplayScan> scans;
    for (int32_t s = 0; s < kSceneSensors; ++s) {
      scene_points_.push_back(to_records(frame.scan[s]));
      scans.push_back({0, to_points(s, scene_points_.back())});
      points += frame.scan[s].x_m.size();
    }
    frames_.push_back(std::move(scans));
  }
  source_ = "simulated overtake, " + std::to_string(def.scene_frames) + " frames of 3 sensors, " +
            std::to_string(points / frames_.size()) + " points a frame, repeated";
}

void LatencyInput::load_recording(const ReplayDef& def) {
  const io::Recording recording(def.recording, io::load_rig(def.rig));
  for (const io::RigSensor& sensor : recording.rig().sensors) sensors_.push_back(cli::to_sensor_def(sensor));
  period_ns_ = recording.rig().period_ns();
  if (!def.map.empty()) {
    map_ = io::read_map(def.map);
    has_map_ = true;
  }
  if (!def.ego.empty()) ego_ = io::read_ego_file(def.ego);
  std::size_t points = 0;
  recorded_.reserve(std::min(recording.frame_count(), kMaxRecordedFrames));
  for (std::size_t i = 0; i < std::min(recording.frame_count(), kMaxRecordedFrames); ++i) {
    recorded_.push_back(recording.read(i));
    int64_t first_ns = INT64_MAX;
    for (const io::SensorScan& scan : recorded_.back().scans) first_ns = std::min(first_ns, scan.stamp_ns);
    recorded_stamp_ns_.push_back(first_ns);
    std::vector<ReplayScan> scans(sensors_.size(), ReplayScan{});
    for (const io::SensorScan& scan : recorded_.back().scans) {
      if (scan.count > sensors_[std::size_t(scan.sensor)].point_capacity)
        throw io::Error(scan.path, 0, std::to_string(scan.count) + " points are more than the rig's point_capacity");
      // Limits offsets to a quarter of a period, however the recording was cut, so that a frame's scans stay in one
      // frame.
      const int64_t offset_ns = std::min(scan.stamp_ns - first_ns, period_ns_ / 4);
      scans[std::size_t(scan.sensor)] = {offset_ns, cli::to_points(scan)};
      points += std::size_t(scan.count);
    }
    frames_.push_back(std::move(scans));
  }
  source_ = "recording, " + std::to_string(frames_.size()) + " frames of " + std::to_string(sensors_.size()) +
            " sensors, " + std::to_string(points / frames_.size()) + " points a frame, repeated";
}

void LatencyInput::fill(ovt_detector_def& def) const {
  def.sensors = sensors_.data();
  def.sensor_count = sensor_count();
  def.map = has_map_ ? &map_def_ : nullptr;
}

const ReplayScan* LatencyInput::scan(int64_t k, int32_t sensor) const {
  const ReplayScan& scan = frames_[std::size_t(k) % frames_.size()][std::size_t(sensor)];
  return scan.points.struct_size ? &scan : nullptr;
}

void LatencyInput::poses(int64_t k, std::vector<ovt_ego_pose>& out) const {
  out.clear();
  const int64_t from_ns = frame_stamp_ns(k);
  if (scene_) {  // the road is a circle: the ego continues where the scans start again
    for (int32_t j = k == 0 ? 0 : 1; j <= kPosesPerFrame; ++j) {
      const int64_t stamp_ns = from_ns + j * period_ns_ / kPosesPerFrame;
      out.push_back(to_pose(stamp_ns, scene_->ego_at(double(stamp_ns) * 1e-9)));
    }
    return;
  }
  const int64_t recorded_ns = recorded_stamp_ns_[std::size_t(k) % frames_.size()];
  const auto later = [](int64_t stamp_ns, const io::EgoRow& row) { return stamp_ns < row.stamp_ns; };
  auto row = std::upper_bound(ego_.begin(), ego_.end(), recorded_ns, later);
  if (k == 0 && row != ego_.begin()) --row;
  for (; row != ego_.end() && row->stamp_ns <= recorded_ns + period_ns_; ++row) {
    out.push_back(cli::to_pose(*row));
    out.back().stamp_ns += from_ns - recorded_ns;
  }
}

}  // namespace overtake::bench
