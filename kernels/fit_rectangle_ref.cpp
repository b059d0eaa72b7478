// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pose of a car of known size by two headings (eq. 5): the reference heading and the heading of least variance.
#include <limits>

#include "core/math.h"
#include "core/reduce.h"
#include "kernels/fit_rectangle_measures.h"
#include "kernels/heading_grid.h"

namespace overtake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Two corners count as equally near when the sensor is within this distance of the middle of the side between them.
// Without it, rounding noise would change the corner of a car seen from straight behind.
constexpr float kMiddle_m = 1.0e-3f;

float offset(float v, float origin) { return max_of(min_of(v - origin, kFitOffsetLimit_m), 0.0f - kFitOffsetLimit_m); }

// ---- the loops over the points --------------------------------------------------------------------------------------

struct Points {
  const float *x_m, *y_m;
  int32_t count;

  float x(int32_t k) const { return offset(x_m[k], x_m[0]); }
  float y(int32_t k) const { return offset(y_m[k], y_m[0]); }
};

HeadingBounds bound(const void* context, HeadingAxes axes) noexcept {
  const Points& points = *static_cast<const Points*>(context);
  Lanes<float> low_1(kInfinity), high_1(-kInfinity), low_2(kInfinity), high_2(-kInfinity);
  for_each_in_lanes(points.count, [&](int32_t k, int32_t l) {
    const float x = points.x(k), y = points.y(k);
    const float c1 = axes.first(x, y), c2 = axes.second(x, y);
    low_1[l] = min_of(low_1[l], c1);
    high_1[l] = max_of(high_1[l], c1);
    low_2[l] = min_of(low_2[l], c2);
    high_2[l] = max_of(high_2[l], c2);
  });
  return {lane_min(low_1), lane_max(high_1), lane_min(low_2), lane_max(high_2)};
}

EdgeSums sum_edges(const void* context, HeadingAxes axes) noexcept {
  const Points& points = *static_cast<const Points*>(context);
  const HeadingBounds b = bound(context, axes);
  Lanes<float> count_1(0.0f), sum_1(0.0f), square_1(0.0f), sum_2(0.0f), square_2(0.0f);
  for_each_in_lanes(points.count, [&](int32_t k, int32_t l) {
    const float x = points.x(k), y = points.y(k);
    const float c1 = axes.first(x, y), c2 = axes.second(x, y);
    const float d1 = min_of(c1 - b.low_1, b.high_1 - c1);
    const float d2 = min_of(c2 - b.low_2, b.high_2 - c2);
    const bool closer_2 = d2 < d1;
    const float in_1 = select(closer_2, 0.0f, d1), in_2 = select(closer_2, d2, 0.0f);
    count_1[l] = count_1[l] + select(closer_2, 0.0f, 1.0f);
    sum_1[l] = sum_1[l] + in_1;
    square_1[l] = square_1[l] + in_1 * in_1;
    sum_2[l] = sum_2[l] + in_2;
    square_2[l] = square_2[l] + in_2 * in_2;
  });
  return {lane_sum(count_1), lane_sum(sum_1), lane_sum(square_1), lane_sum(sum_2), lane_sum(square_2)};
}

void cost_degrees(const void* context, float* cost) noexcept {
  for (int32_t degree = 0; degree < kDegreeCount; ++degree) {
    const HeadingAxes axes = {kHeadingGrid.degree_cos[degree], kHeadingGrid.degree_sin[degree]};
    cost[degree] = edge_variance(sum_edges(context, axes), static_cast<const Points*>(context)->count);
  }
}

int32_t count_inside(const void* context, HeadingAxes axes, HeadingBox box) noexcept {
  const Points& points = *static_cast<const Points*>(context);
  int32_t inside = 0;
  for (int32_t k = 0; k < points.count; ++k) {
    const float x = points.x(k), y = points.y(k);
    const float off_1 = abs_of(axes.first(x, y) - box.center_1), off_2 = abs_of(axes.second(x, y) - box.center_2);
    inside += off_1 <= box.reach_1 && off_2 <= box.reach_2;
  }
  return inside;
}

// ---- the search and the choice --------------------------------------------------------------------------------------

// Index of the least cost in the heading grid: steps of 1 deg (ties: the smaller angle), then of 1/2, 1/4, 1/8 and
// 1/16 deg to both sides. A step is taken only where it lowers the cost (two equal sides: the lower angle).
int32_t find_heading(const RectangleMeasures& measures, int32_t count) {
  const auto cost = [&](int32_t i) {
    return edge_variance(measures.sum_edges(measures.points, {kHeadingGrid.cos[i], kHeadingGrid.sin[i]}), count);
  };
  float cost_of_degree[kDegreesPadded];
  measures.cost_degrees(measures.points, cost_of_degree);
  int32_t best = 0;
  float best_cost = kInfinity;
  for (int32_t degree = 0; degree < kDegreeCount; ++degree)
    if (cost_of_degree[degree] < best_cost) best = degree * kHeadingsPerDegree, best_cost = cost_of_degree[degree];
  for (int32_t step = kHeadingsPerDegree / 2; step > 0; step /= 2) {
    const int32_t below = (best + kHeadingCount - step) % kHeadingCount, above = (best + step) % kHeadingCount;
    const float at_below = cost(below), at_above = cost(above);
    const bool go_below = at_below <= at_above;
    const float at = go_below ? at_below : at_above;
    if (at < best_cost) best = go_below ? below : above, best_cost = at;
  }
  return best;
}

// The known car's rectangle at one heading.
struct Imposed {
  int32_t inliers;
  float center_x_m, center_y_m;
  float extent_length_m, extent_width_m;  // of the points
};

// Centre on one axis of a side of `size` that starts at the near corner and points away from the sensor.
float impose(bool near_is_high, float low, float high, float size) {
  return near_is_high ? high - 0.5f * size : low + 0.5f * size;
}

// (x_m, y_m) is the first point.
Imposed impose_rectangle(const RectangleMeasures& measures, const FitRectangleParams& params, HeadingAxes axes,
                         float x_m, float y_m, float sensor_x, float sensor_y) {
  const HeadingBounds b = measures.bound(measures.points, axes);
  // Offset of the sensor from the middle of each side. The corner on the sensor's side is the nearer one.
  const float from_middle_1 = axes.first(sensor_x, sensor_y) - 0.5f * (b.low_1 + b.high_1);
  const float from_middle_2 = axes.second(sensor_x, sensor_y) - 0.5f * (b.low_2 + b.high_2);
  // Ties: the corner on the left as the sensor looks at the rectangle. Looking along +axis 1, left is +axis 2; looking
  // along +axis 2, left is -axis 1.
  const bool tie_1 = abs_of(from_middle_1) <= kMiddle_m, tie_2 = abs_of(from_middle_2) <= kMiddle_m;
  const bool near_high_1 = tie_1 ? from_middle_2 > kMiddle_m : from_middle_1 > 0.0f;
  const bool near_high_2 = tie_2 ? from_middle_1 < 0.0f - kMiddle_m : from_middle_2 > 0.0f;
  const float center_1 = impose(near_high_1, b.low_1, b.high_1, params.length_m);
  const float center_2 = impose(near_high_2, b.low_2, b.high_2, params.width_m);
  const HeadingBox box = {center_1, center_2, 0.5f * params.length_m + params.margin_m,
                          0.5f * params.width_m + params.margin_m};
  return {measures.count_inside(measures.points, axes, box), x_m + (center_1 * axes.c - center_2 * axes.s),
          y_m + (center_1 * axes.s + center_2 * axes.c), b.high_1 - b.low_1, b.high_2 - b.low_2};
}

// Angle between two lines, 0 to pi/2.
double line_difference(double a, double b) {
  const double d = wrap_angle(a - b) < 0.0 ? -wrap_angle(a - b) : wrap_angle(a - b);
  return d > kHalfPi ? kPi - d : d;
}

// The direction of a line that is nearer to the reference, in (-pi, pi].
float direct(double line, double reference) {
  const double d = wrap_angle(line - reference);
  return wrap_angle(float(wrap_angle(d > kHalfPi || d < -kHalfPi ? line + kPi : line)));
}

}  // namespace

RectangleFit fit_rectangle_by(const RectangleMeasures& measures, const FitRectangleParams& params, const float* x_m,
                              const float* y_m, int32_t count, float heading_ref_rad, float sensor_x_m,
                              float sensor_y_m) noexcept {
  OVT_CHECK(count >= 1);
  const float sensor_x = offset(sensor_x_m, x_m[0]), sensor_y = offset(sensor_y_m, y_m[0]);
  const auto impose_at = [&](HeadingAxes axes) {
    return impose_rectangle(measures, params, axes, x_m[0], y_m[0], sensor_x, sensor_y);
  };

  const float wrapped = wrap_angle(heading_ref_rad);
  const float ref_rad = wrapped == wrapped ? wrapped : 0.0f;  // an angle above 1e15 has no direction
  double ref_sin, ref_cos;
  sin_cos_f64(double(ref_rad), ref_sin, ref_cos);
  const Imposed ref = impose_at({float(ref_cos), float(ref_sin)});

  Imposed var = ref;
  float var_rad = ref_rad;
  if (count >= params.min_var_points) {
    // The grid's angle does not tell which side is the length, nor where the front is.
    const int32_t i = find_heading(measures, count);
    const HeadingAxes along = {kHeadingGrid.cos[i], kHeadingGrid.sin[i]}, across = {0.0f - along.s, along.c};
    const double theta = grid_heading_rad(i), reference = double(ref_rad);
    var = impose_at(along);
    const Imposed turned = impose_at(across);
    const bool nearer = line_difference(theta + kHalfPi, reference) < line_difference(theta, reference);
    const bool turn = turned.inliers != var.inliers ? turned.inliers > var.inliers : nearer;
    if (turn) var = turned;
    var_rad = direct(turn ? theta + kHalfPi : theta, reference);
  }

  const bool from_var = ref.inliers < var.inliers;  // eq. 5
  const Imposed& best = from_var ? var : ref;
  RectangleFit fit;
  fit.heading_ref_rad = ref_rad;
  fit.heading_var_rad = var_rad;
  fit.inliers_ref = ref.inliers;
  fit.inliers_var = var.inliers;
  fit.from_var = from_var;
  fit.heading_rad = from_var ? var_rad : ref_rad;
  fit.center_x_m = best.center_x_m;
  fit.center_y_m = best.center_y_m;
  fit.ref_x_m = ref.center_x_m;
  fit.ref_y_m = ref.center_y_m;
  fit.var_x_m = var.center_x_m;
  fit.var_y_m = var.center_y_m;
  fit.extent_length_m = best.extent_length_m;
  fit.extent_width_m = best.extent_width_m;
  return fit;
}

RectangleFit ref::fit_rectangle(const FitRectangleParams& params, const float* x_m, const float* y_m, int32_t count,
                                float heading_ref_rad, float sensor_x_m, float sensor_y_m) noexcept {
  const Points points{x_m, y_m, count};
  return fit_rectangle_by({&points, &cost_degrees, &bound, &sum_edges, &count_inside}, params, x_m, y_m, count,
                          heading_ref_rad, sensor_x_m, sensor_y_m);
}

}  // namespace overtake
