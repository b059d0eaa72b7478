// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/cluster_places.h"

#include <algorithm>
#include <limits>

#include "core/math.h"
#include "core/reduce.h"
#include "pipeline/body_look.h"

namespace overtake {
namespace {

// Bounds of a few values, as the lanes of core/reduce.h would give them.
constexpr int32_t kFewPoints = 4;
struct FewBounds {
  float v[kFewPoints];
  bool is_there[kFewPoints];

  template <class F>
  FewBounds(int32_t count, F&& value) {
    for (int32_t k = 0; k < kFewPoints; ++k) is_there[k] = k < count, v[k] = value(k < count ? k : 0);
  }
  float low() const {
    return fold(std::numeric_limits<float>::infinity(), [](float a, float b) { return min_of(a, b); });
  }
  float high() const {
    return fold(-std::numeric_limits<float>::infinity(), [](float a, float b) { return max_of(a, b); });
  }

 private:
  template <class F>
  float fold(float none, F&& f) const {
    const auto at = [&](int32_t k) { return is_there[k] ? v[k] : none; };
    return f(f(at(0), at(2)), f(at(1), at(3)));
  }
};

}  // namespace

void list_sides(const StageContext& context, const Frame& frame, SeamSide* sides) noexcept {
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    sides[s] = {part.present,      &context.sensors[s], &part.kept.images, &part.scan,
                &part.kept.points, &part.clusters,      part.row_of_label, part.stamp_ns};
  }
}

double find_outside(const StageContext& context, const Frame& frame) noexcept {
  return frame.ego_off_map_m > 0.0 ? frame.ego_off_map_m + context.detect.vehicle_width_m : 0.0;
}

ClusterReference find_reference(const StageContext& context, const Frame& frame, int32_t row, int32_t& hint) noexcept {
  const FrameClusterTable& merged = frame.merged;
  ClusterReference found;
  EgoState ego;
  const int64_t pose_ns = find_pose_time(context, frame, merged.main_sensor[row], merged.stamp_ns[row]);
  if (!frame.uses_map || !frame.ego.at(pose_ns, ego)) return found;
  double x, y;
  ego.to_map(double(merged.center_x_m[row]), double(merged.center_y_m[row]), double(merged.center_z_m[row]), x, y);
  const MapProjection place = context.map->project(x, y, hint);
  hint = place.segment;
  if (place.segment < 0) return found;  // beyond the coordinates of a map
  found.place = place;
  found.heading_rad = ego.heading_to_vehicle(found.place.heading_rad);
  found.on_map = true;
  found.fresh = ego.age_ns <= kEgoFreshNs;
  return found;
}

ClusterPoints gather_points(Frame& frame, int32_t row) noexcept {
  const int32_t first = frame.merged.first_member[row];
  if (frame.members.next_member[first] < 0) {
    const SensorPart& part = frame.sensors[frame.members.sensor[first]];
    const int32_t cluster = frame.members.cluster[first], begin = part.clusters.point_begin[cluster];
    return {part.cluster_points.x_m + begin, part.cluster_points.y_m + begin, part.clusters.point_count[cluster]};
  }
  int32_t count = 0;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const int32_t begin = part.clusters.point_begin[cluster];
    const int32_t points = std::min(part.clusters.point_count[cluster], frame.fit_capacity - count);
    std::copy_n(part.cluster_points.x_m + begin, points, frame.fit_x_m + count);
    std::copy_n(part.cluster_points.y_m + begin, points, frame.fit_y_m + count);
    count += points;
  });
  return {frame.fit_x_m, frame.fit_y_m, count};
}

ClusterHeights measure_heights(const Frame& frame, int32_t row) noexcept {
  const FrameClusterTable& merged = frame.merged;
  ClusterHeights heights = {1e9f, -1e9f, 0.0f};
  float sum_m = 0.0f;
  int32_t count = 0;
  for_each_height(frame, row, [&](float height_m, float z_m) {
    heights.low_m = min_of(heights.low_m, height_m);
    heights.high_m = max_of(heights.high_m, height_m);
    sum_m += z_m - height_m;
    ++count;
  });
  if (count == 0) return {0.0f, merged.max_z_m[row] - merged.min_z_m[row], merged.min_z_m[row]};
  heights.road_z_m = sum_m / float(count);
  return heights;
}

OrientedBox measure_box(const Frame& frame, int32_t row, float cos, float sin) noexcept {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  OrientedBox box = {kInfinity, -kInfinity, kInfinity, -kInfinity};
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const float* const x_m = part.cluster_points.x_m + part.clusters.point_begin[cluster];
    const float* const y_m = part.cluster_points.y_m + part.clusters.point_begin[cluster];
    const int32_t count = part.clusters.point_count[cluster];
    const auto along = [&](int32_t k) { return x_m[k] * cos + y_m[k] * sin; };
    const auto across = [&](int32_t k) { return y_m[k] * cos - x_m[k] * sin; };
    if (count <= kFewPoints) {  // most clusters
      const FewBounds bounds_1(count, along), bounds_2(count, across);
      box = {min_of(box.low_1, bounds_1.low()), max_of(box.high_1, bounds_1.high()), min_of(box.low_2, bounds_2.low()),
             max_of(box.high_2, bounds_2.high())};
      return;
    }
    Lanes<float> low_1(kInfinity), high_1(-kInfinity), low_2(kInfinity), high_2(-kInfinity);
    for_each_in_lanes(count, [&](int32_t k, int32_t l) {
      low_1[l] = min_of(low_1[l], along(k));
      high_1[l] = max_of(high_1[l], along(k));
      low_2[l] = min_of(low_2[l], across(k));
      high_2[l] = max_of(high_2[l], across(k));
    });
    box = {min_of(box.low_1, lane_min(low_1)), max_of(box.high_1, lane_max(high_1)), min_of(box.low_2, lane_min(low_2)),
           max_of(box.high_2, lane_max(high_2))};
  });
  return box;
}

void locate_cluster(const StageContext& context, Frame& frame, int32_t row, int32_t& hint) noexcept {
  ClusterPlaceTable& places = frame.places;
  const ClusterReference reference = find_reference(context, frame, row, hint);
  const float wrapped = wrap_angle(float(reference.heading_rad));
  places.heading_rad[row] = wrapped == wrapped ? wrapped : 0.0f;
  double sin, cos;
  sin_cos_f64(double(places.heading_rad[row]), sin, cos);
  places.sin[row] = float(sin);
  places.cos[row] = float(cos);
  places.s_m[row] = reference.on_map ? float(reference.place.s_m) : 0.0f;
  places.d_m[row] = reference.on_map ? float(reference.place.d_m) : 0.0f;
  places.width_left_m[row] = reference.fresh ? float(reference.place.width_left_m) : kNoBound_m;
  places.width_right_m[row] = reference.fresh ? float(reference.place.width_right_m) : kNoBound_m;
  const MapProjection& place = reference.place;
  const bool is_between = place.d_m <= place.width_left_m && place.d_m >= 0.0 - place.width_right_m;
  if (reference.fresh && is_between && !place.inside && !(frame.ego_off_map_m > 0.0))
    places.width_left_m[row] = places.width_right_m[row] = 0.0f - kNoBound_m;  // beyond the end of an open circuit
  const OrientedBox all = measure_box(frame, row, places.cos[row], places.sin[row]);
  const OrientedBox box = trim_box(context, frame, row, places.cos[row], places.sin[row], all);
  places.low_1_m[row] = box.low_1, places.high_1_m[row] = box.high_1;
  places.low_2_m[row] = box.low_2, places.high_2_m[row] = box.high_2;
  places.known[row] = 1;
}

void locate_clusters(const StageContext& context, Frame& frame) noexcept {
  const FrameClusterTable& merged = frame.merged;
  constexpr float kWithMore =
      2.0f;  // a car and the smoke and strays that are joined with it: at most so many cars long
  const float most_m = context.detect.gate_cars.limits.length_m;
  find_smoke_limits(context, frame);
  frame.places.count = merged.count;
  int32_t hint = -1;
  for (int32_t row = 0; row < merged.count; ++row) {
    const float x_m = merged.max_x_m[row] - merged.min_x_m[row], y_m = merged.max_y_m[row] - merged.min_y_m[row];
    frame.places.known[row] = 0;
    if (max_of(x_m, y_m) > kWithMore * most_m) continue;
    if (merged.max_z_m[row] - merged.min_z_m[row] > most_m) continue;
    if (max_of(x_m, y_m) > most_m) {
      const OrientedBox all = {merged.min_x_m[row], merged.max_x_m[row], merged.min_y_m[row], merged.max_y_m[row]};
      const OrientedBox box = trim_box(context, frame, row, 1.0f, 0.0f, all);
      if (max_of(box.length(), box.width()) > most_m) continue;
    }
    locate_cluster(context, frame, row, hint);
  }
}

RectangleFit fit_cluster(const StageContext& context, Frame& frame, int32_t row, float heading_ref_rad) noexcept {
  const ClusterPoints points = gather_points(frame, row);
  const Transform& mounting = context.sensors[frame.merged.main_sensor[row]].T_vehicle_sensor;
  return context.kernels->fit_rectangle(context.detect.fit_rectangle, points.x_m, points.y_m, points.count,
                                        heading_ref_rad, mounting.t[0], mounting.t[1]);
}

void write_pose(Frame& frame, int32_t i, int32_t row, const RectangleFit& fit) noexcept {
  const FrameClusterTable& merged = frame.merged;
  DetectionTable& out = frame.detections;
  out.cluster[i] = row;
  out.stamp_ns[i] = merged.stamp_ns[row];
  out.x_m[i] = fit.center_x_m;
  out.y_m[i] = fit.center_y_m;
  out.z_m[i] = merged.center_z_m[row];
  out.heading_rad[i] = fit.heading_rad;
  out.heading_source[i] = int32_t(fit.from_var ? HeadingSource::kVar : HeadingSource::kRef);
  out.length_m[i] = fit.extent_length_m;
  out.width_m[i] = fit.extent_width_m;
  out.point_count[i] = merged.point_count[row];
  out.inliers_ref[i] = fit.inliers_ref;
  out.inliers_var[i] = fit.inliers_var;
  out.heading_ref_rad[i] = fit.heading_ref_rad;
  out.heading_var_rad[i] = fit.heading_var_rad;
  out.ref_x_m[i] = fit.ref_x_m;
  out.ref_y_m[i] = fit.ref_y_m;
  out.var_x_m[i] = fit.var_x_m;
  out.var_y_m[i] = fit.var_y_m;
  out.sensor_mask[i] = merged.sensor_mask[row];
}

CarAnchor anchor_car(const CarSize& size, const OrientedBox& seen, float sensor_1, float sensor_2,
                     const CutEnds& cut) noexcept {
  constexpr float kMostOfFlank = 0.6f, kMostOfEnd = 0.5f, kUnseenOfFarEnd = 0.3f;
  // Far away few rows and columns hit a car, and the seen end lies inside the real one: by 0.2 m at 90 m, 0.4 m at
  // 110 m in simulated races.
  constexpr float kInset = 0.012f, kNoInset_m = 75.0f, kMostInset_m = 0.4f;
  const float middle_1 = 0.5f * (seen.low_1 + seen.high_1), middle_2 = 0.5f * (seen.low_2 + seen.high_2);
  const float ahead = sensor_1 - middle_1, left = sensor_2 - middle_2;  // of the sensor, from the middle
  const bool beside = abs_of(ahead) <= 0.5f * size.length_m;
  CarAnchor car = {middle_1, middle_2,
                   beside         ? CarView::kSide
                   : ahead < 0.0f ? CarView::kRear
                                  : CarView::kFront,
                   max_of(size.length_m - seen.length(), 0.0f), max_of(size.width_m - seen.width(), 0.0f)};
  const bool is_beside = abs_of(left) > 0.5f * size.width_m;  // and sees a flank, with both of its ends
  const bool is_cut = cut.low_1 || cut.high_1;
  if (car.unseen_1 > 0.0f && is_cut) {
    const bool sees_low = !cut.low_1 && (is_beside || ahead < 0.0f);
    const bool sees_high = !cut.high_1 && (is_beside || ahead >= 0.0f);
    if (sees_low) car.center_1 = seen.low_1 + 0.5f * size.length_m;
    if (sees_high) car.center_1 = seen.high_1 - 0.5f * size.length_m;
    car.knows_no_end = !sees_low && !sees_high;
    // The end that is farther away may show little of itself.
    if (!car.knows_no_end) car.unseen_1 *= sees_low == (ahead < 0.0f) ? 0.0f : kUnseenOfFarEnd;
  } else if (car.unseen_1 > 0.0f) {
    if (ahead < 0.0f) {
      const float inset_m = min_of(max_of(kInset * (-ahead - kNoInset_m), 0.0f), kMostInset_m);
      car.center_1 = seen.low_1 - inset_m + 0.5f * size.length_m;
      if (!beside) car.unseen_1 = 0.0f;
    } else if (seen.length() >= size.front_length_m) {
      car.center_1 = seen.high_1 - 0.5f * size.length_m;
    }
  }
  if (car.unseen_2 > 0.0f && cut.low_2 != cut.high_2 && seen.width() >= kMostOfEnd * size.width_m) {
    car.center_2 = cut.high_2 ? seen.low_2 + 0.5f * size.width_m : seen.high_2 - 0.5f * size.width_m;
    car.unseen_2 *= kUnseenOfFarEnd;
    return car;
  }
  const bool sees_flank = beside || (abs_of(ahead) <= size.length_m && is_beside);
  const bool sees_most = sees_flank && seen.length() >= kMostOfFlank * size.length_m;
  if (car.unseen_2 > 0.0f && (sees_most || (is_cut && is_beside))) {
    car.center_2 = left < 0.0f ? seen.low_2 + 0.5f * size.width_m : seen.high_2 - 0.5f * size.width_m;
    car.unseen_2 = 0.0f;
  }
  return car;
}

}  // namespace overtake
