// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A detector with small images, and checks that hold for every finished frame of any detector.
#pragma once

#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>
#include <vector>

#include "pipeline/overtake.h"
#include "tests/fuzz/bytes.h"
#include "tests/support/frame_rules.h"

namespace overtake::fuzz {

// Reads all outputs; the address sanitizer detects a column that is too short.
inline void check_frame(ovt_reader* reader, int32_t sensor_count, bool has_map = false,
                        int64_t publish_ns = OVT_AT_FRAME_STAMP) {
  const char* broken =
      overtake::test::find_broken_rule(reader, sensor_count, has_map, {OVT_AT_FRAME_STAMP, publish_ns});
  if (broken) std::fprintf(stderr, "the rule: %s\n", broken);
  OVT_FUZZ_REQUIRE(broken == nullptr);
}

// Checks that frames finish in order, without gaps.
struct FrameWatch {
  int32_t sensor_count = 0;
  int64_t frames = 0;
  static void on_frame(ovt_reader* reader, void* user) {
    auto& watch = *static_cast<FrameWatch*>(user);
    ovt_frame_info info;
    OVT_FUZZ_REQUIRE(ovt_read_info(reader, &info) == OVT_OK);
    OVT_FUZZ_REQUIRE(info.sequence == watch.frames++);
    check_frame(reader, watch.sensor_count);
  }
};

// Keeps blocks from one input to the next, by exact size: the sanitizer's red zones stay in place, and creating a
// detector costs no page faults. The pool's total size is limited.
class BlockPool {
 public:
  static void* take(std::size_t bytes, std::size_t alignment, void*) {
    BlockPool& pool = instance();
    {
      const std::lock_guard<std::mutex> lock(pool.mutex_);
      std::vector<void*>& kept = pool.kept_[bytes];
      if (!kept.empty()) {
        void* block = kept.back();
        kept.pop_back();
        pool.kept_bytes_ -= bytes;
        return block;
      }
    }
    return std::aligned_alloc(alignment, bytes);
  }
  static void give(void* block, std::size_t bytes, void*) {
    BlockPool& pool = instance();
    const std::lock_guard<std::mutex> lock(pool.mutex_);
    if (pool.kept_bytes_ + bytes > (std::size_t(256) << 20)) {
      std::free(block);
      return;
    }
    pool.kept_[bytes].push_back(block);
    pool.kept_bytes_ += bytes;
  }

 private:
  static BlockPool& instance() {
    static BlockPool* pool = new BlockPool;  // must outlive every detector
    return *pool;
  }
  std::mutex mutex_;
  std::map<std::size_t, std::vector<void*>> kept_;
  std::size_t kept_bytes_ = 0;
};

struct SmallDef {
  std::vector<ovt_sensor_def> sensors;
  ovt_params params;
  ovt_detector_def def;
  SmallDef() = default;
  SmallDef(const SmallDef&) = delete;
};

// The length of an input chooses the preset: no byte does, so that seeds keep their meaning.
inline const char* draw_preset(const Bytes& in) { return in.left() % 2 == 1 ? "best" : "paper"; }

// Sensors of up to 12 x 70 pixels, side by side; small capacities, so that inputs reach them.
inline void draw_def(Bytes& in, int32_t sensor_count, SmallDef& out) {
  out.def = ovt_default_detector_def();
  ovt_params_init(&out.params, sizeof out.params, draw_preset(in));
  out.params.tracker_confirm_hits = 3, out.params.tracker_keep_hits = 2;
  out.params.tracker_horizon_s = 0.3;
  for (int32_t s = 0; s < sensor_count; ++s) {
    ovt_sensor_def sensor = ovt_default_sensor_def();
    sensor.yaw_rad = 2.0943951023931953 * s;
    sensor.z_m = 1.0;
    static constexpr int32_t kRows[] = {1, 2, 5, 12}, kCols[] = {1, 17, 40, 70};
    sensor.rows = kRows[in.in(0, 3)], sensor.cols = kCols[in.in(0, 3)];
    sensor.wraps = in.chance(64);
    if (sensor.wraps) sensor.azimuth_left_rad = 3.141592653589793;
    sensor.point_capacity = 200;
    out.sensors.push_back(sensor);
  }
  out.def.sensors = out.sensors.data();
  out.def.sensor_count = sensor_count;
  out.def.params = &out.params;
  static constexpr int32_t kCapacity[] = {1, 5, 20, 40};
  out.def.cluster_capacity = kCapacity[in.in(0, 3)];
  out.def.candidate_capacity = kCapacity[in.in(0, 2)];
  out.def.track_capacity = kCapacity[in.in(0, 2)];
  out.def.frames_in_flight = 1;
  out.def.alloc = BlockPool::take;
  out.def.free = BlockPool::give;
  out.def.reader_capacity = 1;
  out.def.ego_pose_capacity = in.in(1, 30);
}

inline ovt_stats stats_of(ovt_detector* detector) {
  ovt_stats stats = ovt_default_stats();
  OVT_FUZZ_REQUIRE(ovt_read_stats(detector, &stats) == OVT_OK);
  return stats;
}

inline ovt_ego_pose draw_ego(Bytes& in, int64_t stamp_ns) {
  ovt_ego_pose pose;
  ovt_ego_pose_init(&pose, sizeof pose);
  pose.stamp_ns = stamp_ns;
  pose.x_m = in.chance(8) ? in.raw<double>() : in.in(-100, 100);
  pose.y_m = in.in(-10, 10);
  pose.yaw_rad = in.chance(8) ? in.raw<double>() : 0.1 * in.in(-31, 31);
  pose.speed_mps = in.chance(8) ? in.raw<double>() : in.in(0, 90);
  return pose;
}

// Rows of pushed detections: near, far, and with any numbers.
struct Rows {
  double x[8] = {}, y[8] = {}, heading[8] = {}, var_x[8] = {}, var_y[8] = {}, cov[8] = {};
  ovt_external_detections draw(Bytes& in, int64_t stamp_ns) {
    ovt_external_detections d;
    ovt_external_detections_init(&d, sizeof d);
    d.stamp_ns = stamp_ns;
    d.count = in.in(0, 8);
    d.reference = in.in(0, 1);
    const bool wild = in.chance(40), covariance = in.chance(80);
    for (int32_t i = 0; i < d.count; ++i) {
      x[i] = wild ? in.raw<double>() : 0.5 * in.in(-120, 120);
      y[i] = wild ? in.raw<double>() : 0.5 * in.in(-20, 20);
      heading[i] = wild ? in.raw<double>() : std::nan("");
      if (!covariance) continue;
      var_x[i] = wild ? in.raw<double>() : 0.1 * in.in(0, 20);
      var_y[i] = wild ? in.raw<double>() : 0.1 * in.in(0, 20);
      cov[i] = wild ? in.raw<double>() : 0.1 * in.in(-10, 10);
    }
    d.x_m = x, d.y_m = y;
    if (wild) d.heading_rad = d.length_m = heading, d.width_m = x, d.height_m = y, d.score = var_x;
    if (covariance) d.var_x = var_x, d.var_y = var_y, d.cov_xy = in.chance(128) ? cov : nullptr;
    return d;
  }
};

// A wall of posts plus noise from the input: gives clusters, detections and tracks.
struct Cloud {
  std::vector<float> x, y, z;
  std::vector<uint16_t> layer;
  void draw(Bytes& in, int32_t count, const ovt_sensor_def& sensor) {
    x.clear(), y.clear(), z.clear(), layer.clear();
    const double half = sensor.wraps ? 3.141592653589793 : 1.0471975511965976;
    const int32_t post = in.in(2, 12), near = in.in(3, 30), drift = in.in(0, 20);
    const bool wild = in.chance(40);
    for (int32_t i = 0; i < count; ++i) {
      const int32_t row = i % sensor.rows, column = i / sensor.rows;
      const double azimuth = half - 2 * half * (column + 0.5) / sensor.cols;
      const double elevation = 0.1 - 0.03 * row;
      double range = column % post < post - 1 ? near + 0.05 * drift + 3 * (column / post % 5) : 60;
      const uint8_t noise = in.byte();
      if (noise < 8) range += 0.5 * noise;
      float point[3] = {float(range * std::cos(azimuth)), float(range * std::sin(azimuth)), float(range * elevation)};
      if (wild && noise % 8 == 0) point[noise / 8 % 3] = in.raw<float>();
      x.push_back(point[0]), y.push_back(point[1]), z.push_back(point[2]);
      layer.push_back(uint16_t(wild && noise == 255 ? in.raw<uint16_t>() : row));
    }
  }
  ovt_points points(int32_t sensor, int64_t stamp_ns) const {
    ovt_points out;
    ovt_points_init(&out, sizeof out);
    out.sensor = sensor;
    out.stamp_ns = stamp_ns;
    out.count = int32_t(x.size());
    out.x = {x.data(), x.size() * 4, 4, OVT_F32};
    out.y = {y.data(), y.size() * 4, 4, OVT_F32};
    out.z = {z.data(), z.size() * 4, 4, OVT_F32};
    out.layer = {layer.data(), layer.size() * 2, 2, OVT_U16};
    return out;
  }
};

}  // namespace overtake::fuzz
