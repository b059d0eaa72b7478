// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Scenes across the seams between sensors. Objects are placed in the vehicle frame and seen through the sensors' true
// poses; the kernel may get other poses.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/arena.h"
#include "core/table.h"
#include "kernels/build_clusters.h"
#include "kernels/merge_seams.h"
#include "tests/support/paper_params.h"

namespace overtake::test {

constexpr double kDegree = M_PI / 180;
constexpr int32_t kRows = 32;
using Ints = std::vector<int32_t>;

struct Place {
  double x, y, z, yaw_deg;
};

inline Transform transform_of(const Place& p) {
  Transform T;
  const double c = std::cos(p.yaw_deg * kDegree), s = std::sin(p.yaw_deg * kDegree);
  const double r[9] = {c, -s, 0, s, c, 0, 0, 0, 1}, t[3] = {p.x, p.y, p.z};
  for (int i = 0; i < 9; ++i) T.r[i] = float(r[i]);
  for (int i = 0; i < 3; ++i) T.t[i] = float(t[i]);
  return T;
}

inline SensorModel model_of(const Place& p, int32_t cols = 857, double fov_deg = 120) {
  SensorModel m;
  m.rows = kRows, m.cols = cols;
  m.azimuth_left_rad = float(fov_deg / 2 * kDegree);
  m.pitch_rad = float(fov_deg * kDegree / cols);
  m.wraps = fov_deg == 360;
  m.T_vehicle_sensor = transform_of(p);
  m.mounting_yaw_rad = float(p.yaw_deg * kDegree);
  return m;
}

struct Point {
  float x, y, z;  // sensor frame
  int32_t label, row, column;
  bool wins;
  int32_t time_offset_ns;
};

struct Sensor {
  Place place;  // the true pose
  SensorModel model;
  bool present = true;
  int64_t stamp_ns = 0;
  int32_t cluster_capacity = 64;
  std::vector<Point> input;

  // Puts a point of the sensor frame on a pixel. `wins` false: another point holds the pixel.
  void put(int32_t row, int32_t column, float x, float y, float z, int32_t label, int32_t time_offset_ns = 0,
           bool wins = true) {
    input.push_back({x, y, z, label, row, column, wins, time_offset_ns});
  }
  // Puts a point of the vehicle frame, if the sensor can see it. The first point on a pixel keeps the pixel.
  bool see(double vx, double vy, double vz, int32_t row, int32_t label) {
    const double c = std::cos(place.yaw_deg * kDegree), s = std::sin(place.yaw_deg * kDegree);
    const double dx = vx - place.x, dy = vy - place.y;
    const double x = dx * c + dy * s, y = dy * c - dx * s;
    const double from_left = double(model.azimuth_left_rad) - std::atan2(y, x);
    const int32_t column = int32_t(std::floor(from_left / double(model.pitch_rad)));
    if (from_left < 0 || column >= model.cols) return false;
    for (const Point& p : input)
      if (p.row == row && p.column == column) return true;
    put(row, column, float(x), float(y), float(vz - place.z), label);
    return true;
  }
};

// The tables of a frame, filled by build_clusters and merge_seams.
struct Frame {
  std::vector<char> block;
  std::vector<RangeImages> images;
  std::vector<ScanTable> scan;
  std::vector<PointTable> points;
  std::vector<ClusterTable> clusters;
  std::vector<ClusterPointTable> cluster_points;
  std::vector<Ints> row_of_label;
  MemberTable members;
  FrameClusterTable merged;
  SeamScratch scratch;
  int32_t overflow = -1;

  Frame(const std::vector<Sensor>& rig, const MergeSeamsParams& params, int32_t merged_capacity = 64)
      : images(rig.size()),
        scan(rig.size()),
        points(rig.size()),
        clusters(rig.size()),
        cluster_points(rig.size()),
        row_of_label(rig.size()) {
    const auto carve = [&](Carver& carver) {
      for (size_t s = 0; s < rig.size(); ++s) {
        const int32_t n = int32_t(rig[s].input.size());
        carve_range_images(carver, images[s], kRows, rig[s].model.cols);
        carve_table(carver, scan[s], n);
        carve_table(carver, points[s], n);
        carve_table(carver, clusters[s], 256);
        carve_table(carver, cluster_points[s], n + kRowAlign);
      }
      carve_table(carver, members, 256 * int32_t(rig.size()));
      carve_table(carver, merged, merged_capacity);
      scratch.capacity = kRows * params.columns;
      for (int k = 0; k < 2; ++k) {
        for (float** v : {&scratch.x_m[k], &scratch.y_m[k], &scratch.z_m[k]})
          *v = carver.take<float>(size_t(scratch.capacity));
        scratch.member[k] = carver.take<int32_t>(size_t(scratch.capacity));
      }
      scratch.parent = carver.take<int32_t>(size_t(members.capacity));
      scratch.order = carver.take<int32_t>(size_t(merged_capacity));
    };
    Carver measure;
    carve(measure);
    block.assign(measure.bytes() + 64, 0x5a);
    Carver hand_out(reinterpret_cast<void*>((reinterpret_cast<uintptr_t>(block.data()) + 63) / 64 * 64));
    carve(hand_out);
    merged.capacity = merged_capacity;

    std::vector<SeamSide> sides(rig.size());
    for (size_t s = 0; s < rig.size(); ++s) {
      sides[s].sensor = &rig[s].model;
      if (!rig[s].present) continue;  // all other members of an absent sensor are null
      fill(rig[s], s);
      sides[s] = {true,         &rig[s].model,          &images[s],     &scan[s], &points[s],
                  &clusters[s], row_of_label[s].data(), rig[s].stamp_ns};
    }
    overflow = ref::merge_seams(params, sides.data(), int32_t(rig.size()), members, merged, scratch);
  }

  void fill(const Sensor& sensor, size_t s) {
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < sensor.model.cols; ++c) images[s].pixel_point.at(r, c) = kNoPoint;
    int32_t label_count = 0;
    for (const Point& p : sensor.input) {
      const int32_t i = scan[s].count++;
      scan[s].x_m[i] = p.x, scan[s].y_m[i] = p.y, scan[s].z_m[i] = p.z;
      scan[s].time_offset_ns[i] = p.time_offset_ns;
      points[s].range_m[i] = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
      points[s].label[i] = p.label;
      if (p.wins) images[s].pixel_point.at(p.row, p.column) = i;
      label_count = std::max(label_count, p.label);
    }
    points[s].count = scan[s].count;
    clusters[s].capacity = sensor.cluster_capacity;
    row_of_label[s].resize(size_t(label_count) + 1);
    Ints cursor(row_of_label[s].size()), order(row_of_label[s].size());
    ref::build_clusters(sensor.model.T_vehicle_sensor, scan[s], points[s], label_count, clusters[s], cluster_points[s],
                        row_of_label[s].data(), cursor.data(), order.data());
  }

  Ints row_members(int32_t row) const {
    Ints list;
    for (int32_t m = merged.first_member[row]; m >= 0; m = members.next_member[m]) list.push_back(m);
    return list;
  }
};

// Front, left and right sensor of the AV-21, x y z yaw.
const Place kAv21[3] = {{2.342, 0, 0.646, 0}, {1.549, 0.267, 0.741, 120}, {1.549, -0.267, 0.741, -120}};
// The same, but at each of the three seams the edges are parallel and 0.40 m apart.
const Place kPaper[3] = {{0, 0, 0.7, 0}, {-0.34641, 0.2, 0.7, 120}, {-0.34641, -0.2, 0.7, -120}};

inline std::vector<Sensor> rig_of(const Place* places, int count = 3) {
  std::vector<Sensor> rig;
  for (int s = 0; s < count; ++s) rig.push_back({places[s], model_of(places[s]), true, 0, 64, {}});
  return rig;
}

// A wall straight across the seam between two sensors, at `distance` along the seam's direction from the origin; every
// sensor gives its points of the wall the label 1.
inline void see_wall_across(std::vector<Sensor>& rig, double seam_deg, double distance) {
  const double c = std::cos(seam_deg * kDegree), s = std::sin(seam_deg * kDegree);
  for (double t = -2.5; t <= 2.5; t += 0.002)
    for (Sensor& sensor : rig) sensor.see(distance * c - t * s, distance * s + t * c, 0.7, 5, 1);
}

// An arc of radius 6 m around (1.8, 0), counter-clockwise.
inline void see_arc(std::vector<Sensor>& rig, double from_deg, double to_deg, int32_t label) {
  for (double a = from_deg; a <= to_deg; a += 0.05)
    for (Sensor& sensor : rig) sensor.see(1.8 + 6 * std::cos(a * kDegree), 6 * std::sin(a * kDegree), 0.7, 9, label);
}

inline const MergeSeamsParams kMerge = paper_frame_params().merge_seams;  // 1.80 m, one column
inline MergeSeamsParams closer_than(float distance_m, int32_t columns = 1) { return {distance_m, columns}; }

// Two sensors that face apart, both with the vehicle's frame: points on edge pixels keep their coordinates.
inline std::vector<Sensor> plain_rig(int32_t cols = 20, int sensors = 2) {
  std::vector<Sensor> rig;
  for (int s = 0; s < sensors; ++s) {
    const Place place{0, 0, 0, 90.0 - 360.0 / sensors * s};
    Sensor sensor{place, model_of(place, cols, 360.0 / sensors), true, 0, 64, {}};
    sensor.model.wraps = false;
    sensor.model.T_vehicle_sensor = Transform{};
    rig.push_back(sensor);
  }
  return rig;
}

}  // namespace overtake::test
