// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What has the size of a car and is no solid body of one: rain, what drop_smoke leaves of smoke, a piece of road whose
// height was misjudged, and, where nothing else tells it, a sign beside the road.
#include <cmath>

#include "core/math.h"
#include "pipeline/body_look.h"

namespace overtake {
namespace {

constexpr float kTyres_m = 0.66f;  // height of a car's tyres
constexpr float kHigh_m = 0.25f;   // lower objects may lie on the road
constexpr float kTop_m = 0.6f;     // higher ones may be the level beam over the body of a car

// A candidate is as dark as smoke, but for a few points, which may be of what stands in the smoke; and its ranges jump
// from pixel to pixel. Dense smoke 50 m away lies on a surface: of many points it needs no jumps among other smoke, and
// no other smoke where it has jumps.
bool is_smoke(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr int32_t kBrightPart = 4, kMany = 10, kBrightOfMany = 10;
  constexpr float kApart = 0.5f, kDarkApart = 0.2f;
  const int32_t points = frame.merged.point_count[row], min_points = context.detect.gate_clusters.min_points;
  int32_t bright = 0;
  const auto are_many_dark = [&] { return points >= kMany && kBrightOfMany * bright <= points; };
  const auto are_few_bright = [&] { return bright < min_points && kBrightPart * bright <= points; };
  bool any_smoke = false, much_smoke = false;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const int32_t s = int32_t(&part - frame.sensors);
    any_smoke = any_smoke || part.reason_count[int32_t(Reason::kSmoke)] > 0;
    much_smoke = much_smoke || frame.smoke_limit[s].light > 0.0f;
    const GroundLight& road = part.ground_light;
    const float dark = context.segment[s].drop_smoke.dark_share * road.light;
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end && (are_many_dark() || are_few_bright()); ++k)
      bright += !(dark > 0.0f && road.of(part.scan, part.cluster_points.point[k]) < dark);
  });
  const bool is_dark = are_many_dark();
  if (!is_dark && !(any_smoke && are_few_bright())) return false;
  if (is_dark && much_smoke) return true;
  int32_t apart = 0;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const PixelView view(context.sensors[&part - frame.sensors], part);
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) apart += view.is_apart(part.cluster_points.point[k]);
  });
  return float(apart) > (is_dark || bright == 0 ? kDarkApart : kApart) * float(points);
}

// Whether a cluster lies as flat as ground along the line of sight.
bool is_flat(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kSlope = 0.1f;
  const FrameClusterTable& merged = frame.merged;
  const float* const at_m = context.sensors[merged.main_sensor[row]].T_vehicle_sensor.t;
  const float x = merged.center_x_m[row] - at_m[0], y = merged.center_y_m[row] - at_m[1];
  const float range_m = max_of(std::sqrt(x * x + y * y), 1e-3f);
  return merged.max_z_m[row] - merged.min_z_m[row] <
         kSlope * measure_box(frame, row, x / range_m, y / range_m).length();
}

// Whether for most points of a candidate the next row, above or below, returns from another range and the same height
// over the running ground, and counts(sensor, view, point, that return) is true.
template <class F>
bool goes_on_level(const StageContext& context, const Frame& frame, int32_t row, F&& counts) {
  int32_t level = 0;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const int32_t s = int32_t(&part - frame.sensors);
    const PixelView view(context.sensors[s], part);
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) {
      const int32_t point = part.cluster_points.point[k];
      const LevelPoints next = view.find_level(point, kHigh_m);
      level += (next.above >= 0 && counts(s, view, point, next.above)) ||
               (next.below >= 0 && counts(s, view, point, next.below));
    }
  });
  return 2 * level >= frame.merged.point_count[row];
}

// Whether a near candidate of one row is road: of a body so high over the road, the row below hits a lower part, or its
// foot, unless the rows are farther apart than that. From kTop_m on it may be a beam that goes level over the body of a
// car, and no road so near is misjudged by as much.
bool is_near_ground(const StageContext& context, const Frame& frame, int32_t row, float row_m) {
  const float high_m = measure_heights(frame, row).high_m;
  return high_m < kTop_m && row_m <= high_m &&
         goes_on_level(context, frame, row, [](int32_t, const PixelView&, int32_t, int32_t) { return true; });
}

// Whether a near candidate of two rows is a part of a misjudged road: it lies flat, and the row above its upper row is
// as high, too, at another range. Above a body the row passes over it.
bool is_near_slab(const StageContext& context, const Frame& frame, int32_t row, int32_t upper) {
  if (!is_flat(context, frame, row) || measure_heights(frame, row).high_m >= kTop_m) return false;
  int32_t points = 0, level = 0;
  const SensorPart& main = frame.sensors[frame.merged.main_sensor[row]];
  const PixelView view(context.sensors[frame.merged.main_sensor[row]], main);
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    if (&part != &main) return;
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) {
      const int32_t point = part.cluster_points.point[k];
      if (part.kept.points.pixel[point] / part.kept.images.pixel_point.stride != upper) continue;
      ++points;
      level += view.find_level(point, kHigh_m).above >= 0;
    }
  });
  return 2 * level > points;
}

// Whether a farther candidate of one row is one of several rows of road, which a mounting that is wrong by half a
// degree lifts by 0.4 m at 45 m: a row next to it hits another object of one row, or ground more than a car's length
// away. Where a nearer car hides all but one row of another, the row below hits the nearer one, which has several rows.
// And a candidate lower than a car's tyres is no car if the row above passes over it, lower than over a car: rows are
// row_m apart there.
bool is_row_of_road(const StageContext& context, const Frame& frame, int32_t row, float row_m) {
  constexpr float kOverCar_m = 0.9f;
  const float length_m = context.detect.fit_rectangle.length_m, high_m = measure_heights(frame, row).high_m;
  const bool is_low = high_m < kTyres_m && high_m + row_m < kOverCar_m;
  return goes_on_level(context, frame, row, [&](int32_t s, const PixelView& view, int32_t point, int32_t next) {
    const SensorPart& part = frame.sensors[s];
    const bool is_above = part.kept.points.pixel[next] < part.kept.points.pixel[point];
    if (is_low && is_above) return true;
    const float x_m = part.scan.x_m[next] - part.scan.x_m[point], y_m = part.scan.y_m[next] - part.scan.y_m[point];
    const int32_t label = part.kept.points.label[next];
    if (label == kLabelGround) return x_m * x_m + y_m * y_m > length_m * length_m;
    const int32_t other = label > kLabelGround ? part.cluster_of_label[label] : -1;
    if (other < 0 || frame.merged.main_sensor[other] != s) return false;
    const PixelBox pixels = main_pixels(frame, other, view);
    return pixels.row_low == pixels.row_high;
  });
}

// Whether a candidate is a piece of the ground around it, which no map tells: ground beside each of its rows has the
// same range, and several rows lie flat. Beside a body the row passes on to what is farther away. Nor is one row a
// body that is not over the ground. Farther away the road returns less: there must be ground on both sides.
bool goes_on_as_ground(const StageContext& context, const Frame& frame, int32_t row, int32_t rows) {
  constexpr float kFar_m = 60.0f, kLow_m = 0.05f;
  if (has_bounds(frame.places, row) || (rows > 0 && !is_flat(context, frame, row))) return false;
  const LevelRows all = count_level_rows(context, frame, row);
  if (!(frame.merged.nearest_m[row] < kFar_m)) return all.enclosed == all.rows;
  if (rows > 0) return all.level == all.rows;
  return all.level > 0 || measure_heights(frame, row).high_m < kLow_m;
}

// Rows that hit an upright body are as far apart on it as the beams are; on flat ground they have one height. Of an
// object of one row, the next row went over it: far away on a road whose height is not known, what is lower than the
// tyres of a car is ground.
bool is_ground(const StageContext& context, const Frame& frame, int32_t row, const PixelView& view,
               const PixelBox& pixels) {
  constexpr float kRise = 0.4f;  // of what the rows span upright
  constexpr float kNear_m = 30.0f, kFar_m = 40.0f;
  const FrameClusterTable& merged = frame.merged;
  const int32_t rows = pixels.row_high - pixels.row_low;
  if (goes_on_as_ground(context, frame, row, rows)) return true;
  if (rows == 1 && merged.nearest_m[row] < kFar_m && is_near_slab(context, frame, row, pixels.row_low)) return true;
  const float row_m = merged.nearest_m[row] * view.find_row_pitch(pixels);
  if (rows == 0 && merged.nearest_m[row] < kNear_m) return is_near_ground(context, frame, row, row_m);
  if (rows == 0 && is_row_of_road(context, frame, row, row_m)) return true;
  if (rows == 0 && (has_bounds(frame.places, row) || merged.nearest_m[row] < kFar_m)) return false;
  if (rows == 0) return row_m > 0.0f && measure_heights(frame, row).high_m + row_m < kTyres_m;
  return merged.max_z_m[row] - merged.min_z_m[row] < kRise * row_m * float(rows) && is_flat(context, frame, row);
}

// Whether the sensor looks through a near candidate: most returns between its points come from behind it, or nearly all
// pixels between them are empty. So it is with drops of rain or spray that are one cluster. What is not seen of a body
// is hidden by a nearer one, or by the own wing, which returns nothing.
bool is_see_through(const Frame& frame, int32_t row, const PixelView& view, const PixelBox& pixels) {
  constexpr float kNear_m = 40.0f;                        // farther away, dark parts of a car may return nothing
  constexpr float kOfReturns = 0.15f, kOfPixels = 0.04f;  // of a body, at least
  const FrameClusterTable& merged = frame.merged;
  if (!(merged.nearest_m[row] < kNear_m)) return false;
  int32_t points = 0;
  float nearest_m = kNear_m;
  const SensorPart& part = frame.sensors[merged.main_sensor[row]];
  for_each_member(frame, row, [&](const SensorPart& own, int32_t cluster) {
    if (&own != &part) return;
    points += own.clusters.point_count[cluster];
    nearest_m = min_of(nearest_m, own.clusters.nearest_m[cluster]);
  });
  if (float(points) >= kOfReturns * float(pixels.area())) return false;
  const BoxFill fill = view.find_fill(pixels, points, nearest_m);
  return fill.of_returns < kOfReturns || fill.of_pixels < kOfPixels;
}

bool is_no_body(const StageContext& context, const Frame& frame, int32_t row) {
  const int32_t s = frame.merged.main_sensor[row];
  const PixelView view(context.sensors[s], frame.sensors[s]);
  const PixelBox pixels = main_pixels(frame, row, view);
  const bool has_pixels = pixels.row_high >= 0;
  return (has_pixels && is_see_through(frame, row, view, pixels)) || is_smoke(context, frame, row) ||
         (has_pixels && is_ground(context, frame, row, view, pixels));
}

// Whether a candidate is smaller than half of a car that is seen from its side: a body of that size may be white, and
// the road dark.
bool is_small(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kLength = 0.5f;
  const OrientedBox box = box_of(frame.places, row);
  return max_of(box.length(), box.width()) < kLength * context.detect.fit_rectangle.length_m;
}

}  // namespace

void keep_solid(const StageContext& context, Frame& frame) noexcept {
  constexpr float kFar_m = 70.0f;  // the road returns nothing: its height does not tell a sign
  constexpr float kReflectorFrom_m = 50.0f, kBesideBound_m = 1.6f, kNearBound_m = 3.0f;
  constexpr float kBareShare = 0.4f;  // of the points of a reflector that is near, or where no bound tells its place
  int32_t count = 0;
  for (int32_t i = 0; i < frame.kept_count; ++i) {
    const int32_t row = frame.kept[i];
    const bool bounded = has_bounds(frame.places, row);
    const bool may_be_sign = !bounded && frame.merged.nearest_m[row] > kFar_m;
    const float inside_m = bounded ? measure_inside(frame.places, row, 0.0f) : 0.0f;
    const bool may_be_dim = bounded && inside_m < kBesideBound_m && frame.merged.nearest_m[row] > kReflectorFrom_m;
    const float bare_share = may_be_dim ? 0.0f : kBareShare;
    const bool may_be_bare = inside_m < kNearBound_m && is_small(context, frame, row);
    if (is_no_body(context, frame, row) || (may_be_sign && is_sign(frame, row)) ||
        ((may_be_dim || may_be_bare) && is_reflector(frame, row, bare_share)))
      continue;
    frame.kept[count++] = row;
  }
  frame.gated_size += frame.kept_count - count;
  frame.candidate_count -= frame.kept_count - count;
  frame.kept_count = count;
}

}  // namespace overtake
