// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A frame whose clusters a test chooses, for the frame rules of preset `best`: points of the vehicle frame by hand, or
// what a sensor sees of boxes. Optionally a straight circuit along x, 12 m wide, with the ego vehicle on its middle.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/math.h"
#include "pipeline/cluster_places.h"
#include "pipeline/method/methods.h"

namespace overtake::test {

struct Spot {
  float x, y, z;
};
using Spots = std::vector<Spot>;

// The corners of a box, and `more` further points at its middle.
inline Spots corners(float x0, float x1, float y0, float y1, float z0, float z1, int32_t more = 0) {
  Spots spots;
  for (const float x : {x0, x1})
    for (const float y : {y0, y1})
      for (const float z : {z0, z1}) spots.push_back({x, y, z});
  for (int32_t i = 0; i < more; ++i) spots.push_back({0.5f * (x0 + x1), 0.5f * (y0 + y1), 0.5f * (z0 + z1)});
  return spots;
}

// A box on the road. Cluster 0 hides what is behind it, and is in no cluster; -1 does so as smoke; -2 returns nothing,
// as the own car.
struct Solid {
  double x_m, y_m, yaw_deg, length_m, width_m, low_m, high_m;
  int32_t cluster = 1;
  float intensity = 1.0f;  // of the road: 1
};

inline Solid car_at(double x_m, double y_m, double yaw_deg = 0) {
  return {x_m, y_m, yaw_deg, 4.921, 1.886, 0.1, 1.1, 1};
}

class RulesBench {
 public:
  static constexpr int32_t kRows = 64, kCols = 857;
  static constexpr double kTop = 0.05, kSensorHeight_m = 1.0;  // rad: 3 deg above the horizon

  explicit RulesBench(bool with_map = true, const ovt_params* given = nullptr, int32_t sensor_count = 2) {
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
    if (given) params = *given;
    context.method = find_method("best");
    context.kernels = find_kernels("ref");
    context.detect = make_detect_params(params);
    context.sensor_count = sensor_count;
    context.candidate_capacity = 64;
    for (int32_t s = 0; s < sensor_count; ++s) {
      const double half = 60 * kPi / 180, yaw = s * 120 * kPi / 180;
      context.sensors[s] = make_sensor_model(kRows, kCols, half, -half, false, 0.5, 400);
      context.sensors[s].T_vehicle_sensor = make_transform(0, 0, kSensorHeight_m, 0, 0, yaw);
      context.sensors[s].mounting_yaw_rad = float(yaw);
      context.segment[s] = make_segment_params(params, context.sensors[s]);
    }
    FrameSizes sizes;
    sizes.sensors = context.sensors;
    const std::vector<int32_t> points(std::size_t(sensor_count), kRows * kCols);
    sizes.point_capacity = points.data();
    sizes.sensor_count = sensor_count;
    sizes.cluster_capacity = 1024;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 64;
    sizes.track_state_bytes = 1024;
    sizes.merge_columns = context.detect.merge_seams.columns;
    sizes.method = context.method;
    REQUIRE(build_frame(frame, sizes, default_allocator()));
    if (with_map) {
      std::vector<double> x, zero, width;
      for (int32_t i = -40; i <= 40; ++i) x.push_back(10.0 * i), zero.push_back(0.0), width.push_back(6.0);
      const char* error = "";
      REQUIRE(map.build(x.data(), zero.data(), width.data(), width.data(), nullptr, int32_t(x.size()), false, &error));
      context.map = &map;
    }
    clear();
  }

  // An empty frame. `ego_y_m`: of the ego vehicle, to the left of the middle of the circuit.
  void clear(double ego_y_m = 0.0) {
    reset_frame(frame);
    frame.stamp_ns = frame.first_stamp_ns = 1'000'000'000;
    frame.ego.count = context.map ? 1 : 0;
    frame.ego.poses[0] = {};
    frame.ego.poses[0].stamp_ns = frame.stamp_ns;
    frame.ego.poses[0].y_m = ego_y_m;
    for (int32_t s = 0; s < context.sensor_count; ++s) {
      SensorPart& part = frame.sensors[s];
      part.present = true;
      part.stamp_ns = frame.stamp_ns;
      part.scan.count = 0;
      part.row_count = kRows;
      part.reason_count[int32_t(Reason::kSmoke)] = 0;
      part.ground_light = {};
      Plane<int32_t>& image = part.kept.images.pixel_point;
      for (int32_t r = 0; r < image.rows; ++r)
        for (int32_t c = 0; c < image.cols; ++c) image.at(r, c) = kNoPoint;
      part.row_of_label[0] = -1;
    }
  }

  // Sensor 0 looks to the rear from now on.
  void turn_to_rear() {
    context.sensors[0].T_vehicle_sensor = make_transform(0, 0, kSensorHeight_m, 0, 0, kPi);
    context.sensors[0].mounting_yaw_rad = float(kPi);
    view_yaw_rad_ = kPi;
  }

  // The columns of what sensor 0 sees are those of a sensor with a full turn from now on, `by` columns farther right.
  void roll_columns(int32_t by) {
    context.sensors[0].wraps = true;
    SegmentViews& views = frame.sensors[0].kept;
    const Plane<int32_t>& image = views.images.pixel_point;
    for (int32_t r = 0; r < image.rows; ++r) {
      int32_t* const row = image.row(r);
      std::rotate(row, row + (image.cols - by % image.cols), row + image.cols);
      for (int32_t c = 0; c < image.cols; ++c)
        if (row[c] >= 0) views.points.pixel[row[c]] = r * image.stride + c;
    }
  }

  // A cluster of a sensor, from points of the vehicle frame. The rules that read pixels see none of them.
  void add(const Spots& spots, int32_t s = 0) {
    std::vector<int32_t> rows;
    for (const Spot& spot : spots) rows.push_back(add_point(s, spot, -1));
    add_cluster(s, rows);
  }

  // What sensor 0 sees of the solids and of the level road, whose points are ground.
  void look(const std::vector<Solid>& solids, double row_pitch_rad = 0.0035) {
    std::vector<std::vector<int32_t>> clusters(16);
    const SensorModel& sensor = context.sensors[0];
    Plane<int32_t>& image = frame.sensors[0].kept.images.pixel_point;
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        const double e = kTop - (r + 0.5) * row_pitch_rad;
        const double a = view_yaw_rad_ + double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
        const double d[3] = {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
        double range_m = d[2] < 0 ? -kSensorHeight_m / d[2] : 1e9;
        int32_t hit = 0;
        float intensity = 1.0f;
        bool is_road = true;
        for (const Solid& solid : solids) {
          const double t = cast(solid, d);
          if (t < range_m) range_m = t, hit = solid.cluster, intensity = solid.intensity, is_road = false;
        }
        if (range_m > 200.0 || hit == -2) continue;
        const Spot spot = {float(range_m * d[0]), float(range_m * d[1]), float(range_m * d[2] + kSensorHeight_m)};
        const int32_t point = add_point(0, spot, r * image.stride + c);
        image.at(r, c) = point;
        frame.sensors[0].scan.intensity[point] = intensity;
        if (is_road) frame.sensors[0].kept.points.label[point] = kLabelGround;
        frame.sensors[0].kept.images.height_m.at(r, c) = spot.z;  // the road is level
        if (hit > 0) clusters[std::size_t(hit)].push_back(point);
        if (hit < 0) {
          frame.sensors[0].kept.points.reason[point] = uint8_t(Reason::kSmoke);
          ++frame.sensors[0].reason_count[int32_t(Reason::kSmoke)];
        }
      }
    frame.sensors[0].ground_light = {.light = 1.0f};
    frame.sensors[0].reason_count[int32_t(Reason::kLabelled)] = frame.sensors[0].scan.count;
    for (const std::vector<int32_t>& rows : clusters)
      if (!rows.empty()) add_cluster(0, rows);
  }

  // Runs the rules of `best` up to the named one, which is the last to run; all of them without a name.
  void run(const char* last = nullptr) {
    for (const FrameRule& rule : context.method->frame) {
      rule.run(context, frame);
      if (last && std::string(rule.name) == last) return;
    }
  }

  StageContext context;
  Frame frame;
  CircuitMap map;

 private:
  int32_t add_point(int32_t s, const Spot& spot, int32_t pixel) {
    SensorPart& part = frame.sensors[s];
    const Transform& t = context.sensors[s].T_vehicle_sensor;
    const float v[3] = {spot.x - t.t[0], spot.y - t.t[1], spot.z - t.t[2]};
    const int32_t row = part.scan.count++;
    float* const of_sensor[3] = {part.scan.x_m, part.scan.y_m, part.scan.z_m};
    for (int32_t k = 0; k < 3; ++k) of_sensor[k][row] = t.r[k] * v[0] + t.r[3 + k] * v[1] + t.r[6 + k] * v[2];
    part.scan.intensity[row] = 1.0f;
    part.kept.points.pixel[row] = pixel;
    part.kept.points.label[row] = -1;
    part.kept.points.reason[row] = uint8_t(Reason::kLabelled);
    part.kept.points.count = part.scan.count;
    if (std::size_t(row) >= spots_[std::size_t(s)].size()) spots_[std::size_t(s)].resize(std::size_t(row) + 1);
    spots_[std::size_t(s)][std::size_t(row)] = spot;
    return row;
  }

  void add_cluster(int32_t s, const std::vector<int32_t>& rows) {
    SensorPart& part = frame.sensors[s];
    ClusterTable& table = part.clusters;
    ClusterPointTable& points = part.cluster_points;
    const int32_t c = table.count++;
    table.label[c] = part.label_count = c + 1;
    part.row_of_label[c + 1] = c;
    table.point_begin[c] = points.count;
    table.point_count[c] = int32_t(rows.size());
    float* const low[3] = {table.min_x_m, table.min_y_m, table.min_z_m};
    float* const high[3] = {table.max_x_m, table.max_y_m, table.max_z_m};
    float* const sum[3] = {table.sum_x_m, table.sum_y_m, table.sum_z_m};
    for (int32_t k = 0; k < 3; ++k) low[k][c] = 1e9f, high[k][c] = -1e9f, sum[k][c] = 0.0f;
    table.sum_offset_ns[c] = 0;
    table.nearest_m[c] = 1e9f;
    for (const int32_t row : rows) {
      const Spot& spot = spots_[std::size_t(s)][std::size_t(row)];
      const float at[3] = {spot.x, spot.y, spot.z};
      for (int32_t k = 0; k < 3; ++k) {
        low[k][c] = std::min(low[k][c], at[k]);
        high[k][c] = std::max(high[k][c], at[k]);
        sum[k][c] += at[k];
      }
      const int32_t i = points.count++;
      points.x_m[i] = spot.x, points.y_m[i] = spot.y, points.z_m[i] = spot.z;
      points.point[i] = row;
      table.nearest_m[c] = std::min(table.nearest_m[c], std::hypot(spot.x, spot.y));
      part.kept.points.label[row] = c + 1;
    }
  }

  // Range along a ray from the sensor to a solid; 1e9 beside it.
  static double cast(const Solid& b, const double d[3]) {
    const double yaw = b.yaw_deg * kPi / 180, c = std::cos(yaw), s = std::sin(yaw);
    const double from[3] = {c * (0.0 - b.x_m) + s * (0.0 - b.y_m), c * (0.0 - b.y_m) - s * (0.0 - b.x_m),
                            kSensorHeight_m};
    const double to[3] = {c * d[0] + s * d[1], c * d[1] - s * d[0], d[2]};
    const double low[3] = {-0.5 * b.length_m, -0.5 * b.width_m, b.low_m};
    const double high[3] = {0.5 * b.length_m, 0.5 * b.width_m, b.high_m};
    double first = 0.0, last = 1e9;
    for (int32_t k = 0; k < 3; ++k) {
      if (to[k] == 0.0) {
        if (from[k] < low[k] || from[k] > high[k]) return 1e9;
        continue;
      }
      const double t0 = (low[k] - from[k]) / to[k], t1 = (high[k] - from[k]) / to[k];
      first = std::max(first, std::min(t0, t1));
      last = std::min(last, std::max(t0, t1));
    }
    return first <= last ? first : 1e9;
  }

  double view_yaw_rad_ = 0.0;  // of sensor 0
  std::array<std::vector<Spot>, kMaxSensors> spots_;
};

// Runs the gates, and checks that each candidate is counted once.
inline void gate(RulesBench& bench) {
  bench.run("keep_nearest");
  const Frame& f = bench.frame;
  CHECK(f.merged.count == f.gated_points + f.gated_size + f.gated_own + f.candidate_count);
  CHECK(f.candidate_count == f.gated_map + f.gated_range + f.candidate_overflow + f.kept_count);
}

// The bench after all rules; each solid must give one detection, in the order of their clusters.
struct Looked : RulesBench {
  explicit Looked(const std::vector<Solid>& solids, double row_pitch_rad = 0.0035) {
    look(solids, row_pitch_rad);
    run();
  }
};

}  // namespace overtake::test
