// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The gates of preset `best`: what can be a car, by its size along its heading, its place on the circuit and its range.
#include <cmath>

#include "core/math.h"
#include "pipeline/body_look.h"
#include "pipeline/cluster_places.h"
#include "pipeline/own_body.h"

namespace overtake {
namespace {

// A car that spins stands at any angle to the circuit.
bool fits_across(const StageContext& context, const Frame& frame, int32_t row) {
  return fits_at_any_heading(context.detect.gate_cars.limits, [&](float c, float s) {
    return trim_box(context, frame, row, c, s, measure_box(frame, row, c, s));
  });
}

// The car's centre by what is seen of it along psi_REF. A car across the circuit: the middle of what is seen.
CarAnchor anchor_cluster(const StageContext& context, const Frame& frame, int32_t row) {
  const DetectParams& params = context.detect;
  const ClusterPlaceTable& places = frame.places;
  const OrientedBox box = box_of(places, row);
  if (!fits(params.gate_cars.limits, box))
    return {0.5f * (box.low_1 + box.high_1), 0.5f * (box.low_2 + box.high_2), CarView::kSide, 0.0f, 0.0f};
  const float* const at_m = context.sensors[frame.merged.main_sensor[row]].T_vehicle_sensor.t;
  const float c = places.cos[row], s = places.sin[row];
  return anchor_car({params.fit_rectangle.length_m, params.fit_rectangle.width_m, params.pose_by_view.front_length_m},
                    box, at_m[0] * c + at_m[1] * s, at_m[1] * c - at_m[0] * s);
}

// Whether only a few points of a cluster are too high over the running ground, which errs in some columns, and its top
// is not too high over the mean ground below it.
bool is_top_misjudged(const Frame& frame, int32_t row, float mean_top_m, float top_m) {
  constexpr int32_t kPart = 10;
  if (!(mean_top_m <= top_m)) return false;
  int32_t higher = 0;
  for_each_height(frame, row, [&](float height_m, float) { higher += height_m > top_m; });
  return kPart * higher <= frame.merged.point_count[row];
}

// Keeps the candidates for which `keeps` is true; returns how many it removed.
template <class F>
int32_t filter(Frame& frame, F&& keeps) {
  int32_t count = 0;
  for (int32_t i = 0; i < frame.kept_count; ++i)
    if (keeps(frame.kept[i])) frame.kept[count++] = frame.kept[i];
  const int32_t removed = frame.kept_count - count;
  frame.kept_count = count;
  return removed;
}

bool is_car_sized(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kFadeReach_m = 70.0f, kMostFarther = 2.0f;
  const FrameClusterTable& merged = frame.merged;
  const CarGateParams& params = context.detect.gate_cars;
  if (!frame.places.known[row] || merged.max_z_m[row] - merged.min_z_m[row] > params.limits.height_m) return false;
  const bool along = fits(params.limits, box_of(frame.places, row));
  if (!along &&
      (merged.point_count[row] < context.detect.fit_rectangle.min_var_points || !fits_across(context, frame, row)))
    return false;
  const ClusterHeights heights = measure_heights(frame, row);  // a wall's top, a beam or a wire is no car
  // The running ground ends where the road fades: farther away its height errs more.
  const float x = merged.center_x_m[row], y = merged.center_y_m[row];
  const float farther = min_of(max_of((x * x + y * y) * (1.0f / (kFadeReach_m * kFadeReach_m)), 1.0f), kMostFarther);
  return heights.low_m <= params.lowest_m * farther &&
         (heights.high_m <= params.top_m ||
          is_top_misjudged(frame, row, merged.max_z_m[row] - heights.road_z_m, params.top_m));
}

// How far inside of the bounds a car's centre is, at least.
float find_inside(const StageContext& context, const Frame& frame) {
  const float outside_m = float(find_outside(context, frame)), inside_m = context.detect.gate_cars.inside_m;
  return outside_m > 0.0f ? min_of(inside_m, -outside_m) : inside_m;
}

// What the walls of this frame tell about the heading of each sensor (an error of its mounting is part of it) and about
// the bounds. A sensor that does not see enough of them takes what the one that sees most of them adds; a side takes
// what the one tells that sees most of this side. A small turn may be an error of the map's bounds instead, a
// small distance one of the ego pose.
class WallErrors {
 public:
  WallErrors(const StageContext& context, const Frame& frame) : reach_m_(float(context.detect.walls.reach_m)) {
    const WallHeading* most = nullptr;
    const WallHeading* of_side[2] = {};
    for (int32_t s = 0; s < context.sensor_count; ++s) {
      const WallHeading& walls = frame.walls[s];
      if (!walls.valid) continue;
      if (!most || walls.points > most->points) most = &walls;
      for (int32_t side = 0; side < 2; ++side)
        if (walls.beyond_m[side] < WallHeading::kNoSide &&
            (!of_side[side] || walls.side_points[side] > of_side[side]->side_points[side]))
          of_side[side] = &walls;
    }
    for (int32_t s = 0; most && s < context.sensor_count; ++s)
      turn_rad_[s] = doubted((frame.walls[s].valid ? frame.walls[s] : *most).offset_rad, kDoubt_rad);
    for (int32_t side = 0; side < 2; ++side)
      if (of_side[side] && of_side[side]->beyond_m[side] < 0.0)
        inside_m_[side] = 0.0f - doubted(of_side[side]->beyond_m[side], kDoubt_m);
  }
  float turn_of(int32_t sensor) const { return turn_rad_[sensor]; }
  // How far the walls stand inside of their bounds, right and left, near the ego vehicle.
  float inside_right_m(float along_m) const { return abs_of(along_m) <= reach_m_ ? inside_m_[0] : 0.0f; }
  float inside_left_m(float along_m) const { return abs_of(along_m) <= reach_m_ ? inside_m_[1] : 0.0f; }

 private:
  static constexpr double kDoubt_rad = 0.15 * kPi / 180, kDoubt_m = 0.5;
  static float doubted(double value, double doubt) {
    if (!(std::fabs(value) > doubt)) return 0.0f;
    const double share = doubt / value;
    return float((1.0 - share * share) * value);
  }
  float reach_m_, turn_rad_[kMaxSensors] = {}, inside_m_[2] = {};
};

// One degree of the heading is 2 m at 120 m.
bool is_inside(const Frame& frame, int32_t row, const CarAnchor& car, const WallErrors& walls, float inside_m) {
  const ClusterPlaceTable& places = frame.places;
  const FrameClusterTable& merged = frame.merged;
  const float centroid_2 = merged.center_y_m[row] * places.cos[row] - merged.center_x_m[row] * places.sin[row];
  const float turned_m = car.center_1 * walls.turn_of(merged.main_sensor[row]);
  const float across_m = car.center_2 - centroid_2 + turned_m;
  return measure_inside(places, row, across_m, walls.inside_right_m(car.center_1), walls.inside_left_m(car.center_1)) >=
         inside_m;
}

// Farther than free_range_m, only the circuit tells what stands on the road.
bool is_in_range(const StageContext& context, const Frame& frame, int32_t row, const CarAnchor& car) {
  const CarGateParams& gate = context.detect.gate_cars;
  const float range_m = has_bounds(frame.places, row) ? gate.range_m : gate.free_range_m;
  return car.center_1 * car.center_1 + car.center_2 * car.center_2 <= range_m * range_m;
}

}  // namespace

void keep_car_shaped(const StageContext& context, Frame& frame) noexcept {
  const FrameClusterTable& merged = frame.merged;
  frame.kept_count = frame.gated_points = frame.gated_own = frame.gated_size = 0;
  for (int32_t row = 0; row < merged.count; ++row) {
    if (merged.point_count[row] < context.detect.gate_clusters.min_points)
      ++frame.gated_points;
    else if (is_own_body(context.detect.gate_cars.own, merged, row))
      ++frame.gated_own;
    else if (is_car_sized(context, frame, row))
      frame.kept[frame.kept_count++] = row;
    else
      ++frame.gated_size;
  }
  frame.candidate_count = frame.kept_count;
}

void keep_inside_bounds(const StageContext& context, Frame& frame) noexcept {
  const float inside_m = find_inside(context, frame);
  const WallErrors walls(context, frame);
  frame.gated_map = filter(frame, [&](int32_t row) {
    const CarAnchor car = anchor_cluster(context, frame, row);
    return is_inside(frame, row, car, walls, inside_m) ||
           (is_inside(frame, row, car, walls, 0.0f - kApron_m) && is_surely_car(context, frame, row));
  });
}

void keep_in_range(const StageContext& context, Frame& frame) noexcept {
  frame.gated_range =
      filter(frame, [&](int32_t row) { return is_in_range(context, frame, row, anchor_cluster(context, frame, row)); });
}

void list_faint(const StageContext& context, Frame& frame) noexcept {
  constexpr float kFrom_m = 40.0f;  // nearer, a car shows 50 points: one or two are something else
  const FrameClusterTable& merged = frame.merged;
  frame.faint_count = 0;
  const float inside_m = find_inside(context, frame);
  const WallErrors walls(context, frame);
  const int32_t room = context.candidate_capacity - frame.kept_count;
  for (int32_t row = 0; row < merged.count && frame.faint_count < room; ++row) {
    if (merged.point_count[row] >= context.detect.gate_clusters.min_points) continue;
    if (!frame.places.known[row] || !has_bounds(frame.places, row) || merged.nearest_m[row] < kFrom_m) continue;
    const CarAnchor car = anchor_cluster(context, frame, row);
    const bool is_on_road = is_inside(frame, row, car, walls, inside_m) && is_in_range(context, frame, row, car);
    if (is_on_road && is_car_sized(context, frame, row)) frame.kept[frame.kept_count + frame.faint_count++] = row;
  }
}

}  // namespace overtake
