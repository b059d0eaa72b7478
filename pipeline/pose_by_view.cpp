// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pose of a car by the side that the sensor sees, with its covariance, its class and its height over the road.
#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/body_look.h"
#include "pipeline/cluster_places.h"
#include "pipeline/cut_ends.h"
#include "pipeline/free_heading.h"
#include "pipeline/pixel_view.h"

namespace overtake {
namespace {

// A car with the heading (c, s), in the vehicle frame.
struct Posed {
  float c, s;
  OrientedBox box;  // of its points, along and across the heading
  CarAnchor car;
  float x_m = 0.0f, y_m = 0.0f;
  void move_to(float center_1) {
    car.center_1 = center_1;
    x_m = center_1 * c - car.center_2 * s;
    y_m = center_1 * s + car.center_2 * c;
  }
};
Posed pose_at(const StageContext& context, const Frame& frame, int32_t row, float c, float s, const OrientedBox& box) {
  const DetectParams& params = context.detect;
  const CarSize size = {params.fit_rectangle.length_m, params.fit_rectangle.width_m,
                        params.pose_by_view.front_length_m};
  const float* const at_m = context.sensors[frame.merged.main_sensor[row]].T_vehicle_sensor.t;
  Posed pose = {c, s, box,
                anchor_car(size, box, at_m[0] * c + at_m[1] * s, at_m[1] * c - at_m[0] * s,
                           find_cut_ends(context, frame, row, c, s, box))};
  pose.move_to(pose.car.center_1);
  return pose;
}

// Calls f(pixel, place along the heading, height over the road) for each point of a cluster within the box.
template <class F>
void for_each_along(const Frame& frame, int32_t row, float c, float s, const OrientedBox& box, F&& f) {
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    const Plane<float>& image = part.kept.images.height_m;
    if (!image.data) return;
    const int32_t begin = part.clusters.point_begin[cluster], end = begin + part.clusters.point_count[cluster];
    for (int32_t k = begin; k < end; ++k) {
      const int32_t pixel = part.kept.points.pixel[part.cluster_points.point[k]];
      if (pixel < 0) continue;
      const float along_m = part.cluster_points.x_m[k] * c + part.cluster_points.y_m[k] * s;
      if (along_m >= box.low_1 && along_m <= box.high_1) f(pixel, along_m, image.data[pixel]);  // else of smoke
    }
  });
}

// Whether the cars are those that the profile and the free heading know.
bool knows_shape(const DetectParams& params) {
  return abs_of(params.fit_rectangle.length_m - CarProfile::kLength_m) <= CarProfile::kLengthTolerance_m;
}

// A car that is seen from ahead or from behind: its centre along the heading, by the heights of its parts. Of a car
// near ahead all rows show the rear end itself, whatever its shape.
CarProfile::Match match_profile(const StageContext& context, const Frame& frame, int32_t row, const Posed& pose,
                                float high_m) {
  constexpr float kTop_m = 1.35f;          // a higher one is not a race car
  constexpr float kRearEnd_m = 40.0f;      // nearer, the rear end is seen
  constexpr float kRoadOfRange = 0.0008f;  // of the range: deviation of the height of the road at the car
  const DetectParams& params = context.detect;
  const bool from_behind = pose.car.view == CarView::kRear;
  if (pose.car.view == CarView::kSide || (from_behind && frame.merged.nearest_m[row] < kRearEnd_m) ||
      !(params.pose_by_view.profile_points > 0.0f) || high_m > kTop_m || !knows_shape(params))
    return {};
  const CarProfile& profile = from_behind ? context.rear : context.front;
  PointsAlong points;
  for_each_along(frame, row, pose.c, pose.s, pose.box,
                 [&](int32_t pixel, float along_m, float height_m) { points.add(pixel, along_m, height_m); });
  return profile.match(points, pose.box.low_1, pose.box.high_1, params.pose_by_view.profile_points,
                       kRoadOfRange * frame.merged.nearest_m[row]);
}

// Standard deviations of the centre, m, fitted to simulated races. A part of the car that the sensor does not see, and
// whose end is not known, leaves the centre uncertain by a share of that part: a uniform distribution would be 0.29
// of it. The farther the car, the fewer rows and columns hit it.
constexpr double kNear_m = 0.034;         // at the sensor, along and across
constexpr double kAlongOfRange = 0.0012;  // of the range: the end that is seen
constexpr double kAcrossOfRange = 7e-4;   // of the range
constexpr double kAlongOfUnseen = 0.23;   // of the length that is not seen,
constexpr double kMostOfUnseen_m = 0.55;  // at most: what is seen of a distant car is mostly its middle
constexpr double kAcrossOfUnseen = 0.18;  // of the width: mostly a part is missing on both sides
constexpr double kFewPoints_m2 = 0.32;    // variance over the number of points
constexpr double kFreeHeading_m = 0.25;   // at psi_VAR, which has an error of its own
// A box wider than the car, by kSlack_m at least, is seen at another heading or holds more than the car.
constexpr double kSlack_m = 0.1;
constexpr double kAcrossOfExcess = 0.5;  // of the width beyond both
// Of a car in smoke: an end or a side of the cluster is smoke now and then, as bright as the car.
constexpr double kAlongInSmoke_m = 0.8, kAcrossInSmoke_m = 0.25;

// Covariance of a centre in the vehicle frame.
struct Covariance {
  double xx, yy, xy;
};
Covariance find_covariance(const Posed& pose, const CarProfile::Match& match, bool from_var, float car_width_m,
                           int32_t points, bool in_smoke, double angle_sigma_rad) {
  const double c = double(pose.c), s = double(pose.s), x_m = double(pose.x_m), y_m = double(pose.y_m);
  const double of_unseen = kAlongOfUnseen * double(pose.car.unseen_1);
  const double unseen_1 = pose.car.knows_no_end ? of_unseen : std::min(of_unseen, kMostOfUnseen_m);
  const double unseen_2 = double(pose.car.unseen_2);
  const double excess_2 = std::max(double(pose.box.width()) - double(car_width_m) - kSlack_m, 0.0);
  const double range2 = x_m * x_m + y_m * y_m;
  const double least = kNear_m * kNear_m + (from_var ? kFreeHeading_m * kFreeHeading_m : 0.0);
  const double few = kFewPoints_m2 / double(std::max(points, 1));
  const double of_match = double(match.sigma_m);
  const double of_ends = match.fits ? of_match * of_match : unseen_1 * unseen_1 + few;
  double along = least + kAlongOfRange * kAlongOfRange * range2 + of_ends;
  double across = least + kAcrossOfRange * kAcrossOfRange * range2 +
                  kAcrossOfUnseen * kAcrossOfUnseen * unseen_2 * unseen_2 + kAcrossOfUnseen * kAcrossOfUnseen * few +
                  kAcrossOfExcess * kAcrossOfExcess * excess_2 * excess_2;
  if (in_smoke) {
    along += kAlongInSmoke_m * kAlongInSmoke_m;
    across += kAcrossInSmoke_m * kAcrossInSmoke_m;
  }
  const double turn = angle_sigma_rad * angle_sigma_rad;  // moves the centre across the line of sight
  return {c * c * along + s * s * across + turn * y_m * y_m, s * s * along + c * c * across + turn * x_m * x_m,
          c * s * (along - across) - turn * x_m * y_m};
}

// ---- class ----------------------------------------------------------------------------------------------------------

// The longer side of the tightest box around the points of a cluster.
float measure_longest(const Frame& frame, int32_t row, const OrientedBox& box) {
  float least_m = box.length() + box.width(), longest_m = max_of(box.length(), box.width());
  for (int32_t h = 0; h < kCoarseHeadingCount; ++h) {
    const auto [c, s] = coarse_heading(h);
    const OrientedBox b = measure_box(frame, row, c, s);
    if (!(b.length() + b.width() < least_m)) continue;
    least_m = b.length() + b.width();
    longest_m = max_of(b.length(), b.width());
  }
  return longest_m;
}

// The share of smoke in what returns around a cluster, and up to beside_m to its left and right. A sensor that sees
// little of it counts as one without.
float find_smoke_share(const StageContext& context, const Frame& frame, int32_t row, float beside_m) {
  SmokeCount all;
  for_each_member(frame, row, [&](const SensorPart& part, int32_t cluster) {
    if (3 * part.reason_count[int32_t(Reason::kSmoke)] < frame.merged.point_count[row]) {
      all.labelled += part.clusters.point_count[cluster];
      return;
    }
    const PixelView view(context.sensors[&part - frame.sensors], part);
    PixelBox pixels;
    view.add_pixels(cluster, pixels);
    if (pixels.row_high >= 0) view.count_smoke(pixels, frame.merged.nearest_m[row], beside_m, all);
  });
  return float(all.smoke) / float(std::max(all.smoke + all.labelled, 1));
}

// What is left of smoke looks like anything. A car in smoke is known from before, and its track needs no class.
bool is_among_smoke(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kSmokeShare = 0.4f;
  return find_smoke_share(context, frame, row, 0.0f) > kSmokeShare;
}

// Whether smoke near the cluster makes its ends doubtful: in front of a car or behind it, smoke may be bright. A near
// car stands out of it.
bool has_smoke_beside(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kSmokeShare = 0.1f, kBeside_m = 6.0f, kFrom_m = 12.0f;
  return frame.merged.nearest_m[row] > kFrom_m && find_smoke_share(context, frame, row, kBeside_m) > kSmokeShare;
}

// Whether the cluster is a part of the road: the ground beside most of its rows goes on at the same range. Behind the
// own wing, or where a sensor is tilted, the running ground does not know the road's height. Beside a car the road is
// farther away. Many points are more than such a piece of road has.
bool is_beside_ground(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr int32_t kMostPoints = 200;
  if (frame.merged.point_count[row] > kMostPoints) return false;
  const LevelRows all = count_level_rows(context, frame, row);
  return all.rows > 0 && 4 * all.level >= 3 * all.rows;
}

// The class of a cluster, by what a car would show at this distance. A car has kRows rows and kColumns columns at
// least on its body, which is as wide as the car; then an object smaller than debris_m is not a car, unless something
// hides the rest of it. Where a car has fewer rows or columns, its body may be missed: then the class is not debris.
ObjectClass classify(const StageContext& context, const Frame& frame, int32_t row, const OrientedBox& box,
                     float low_m) {
  constexpr float kBody_m = 0.7f, kRows = 3.0f, kColumns = 12.0f, kCarShare = 0.6f, kOnTheRoad_m = 0.2f;
  if (is_among_smoke(context, frame, row)) return ObjectClass::kUnknown;
  const FrameClusterTable& merged = frame.merged;
  const float width_m = context.detect.fit_rectangle.width_m, debris_m = context.detect.pose_by_view.debris_m;
  float longest_m = max_of(box.length(), box.width());
  // A box that stands at an angle to the heading is longer along it than its own side.
  if (longest_m >= kCarShare * width_m && longest_m < kSqrt2F * kCarShare * width_m)
    longest_m = measure_longest(frame, row, box);
  if (longest_m >= kCarShare * width_m)
    return is_beside_ground(context, frame, row) ? ObjectClass::kUnknown : ObjectClass::kCar;
  // The rest of a car may be missing.
  if (uint32_t(merged.sensor_mask[row]) & frame.incomplete_mask) return ObjectClass::kUnknown;
  const int32_t s = merged.main_sensor[row];
  const SensorModel& sensor = context.sensors[s];
  const PixelView view(sensor, frame.sensors[s]);
  const float range_m = max_of(merged.nearest_m[row], 0.1f);
  const float column_m = range_m * sensor.pitch_rad;
  if (column_m * kColumns > width_m) return ObjectClass::kUnknown;
  if (longest_m > debris_m + column_m || merged.max_z_m[row] - merged.min_z_m[row] > debris_m)
    return ObjectClass::kUnknown;
  const PixelBox pixels = main_pixels(frame, row, view);
  if (pixels.row_high < 0) return ObjectClass::kUnknown;
  const float row_m = range_m * view.find_row_pitch(pixels);
  if (!(row_m > 0.0f) || row_m * kRows > kBody_m) return ObjectClass::kUnknown;
  // Debris lies on the road. What stands out over a crest, or over something near, may be the top of a car.
  if (low_m > kOnTheRoad_m + row_m) return ObjectClass::kUnknown;
  return view.may_be_hidden(pixels, range_m) ? ObjectClass::kUnknown : ObjectClass::kDebris;
}

// ---- pose -----------------------------------------------------------------------------------------------------------

// A car that is seen from ahead or behind, and of which the shadow of the own car hides one side: its centre is half a
// width from the other side.
void anchor_to_seen_side(const StageContext& context, const Frame& frame, int32_t row, Posed& pose) {
  constexpr float kLeastUnseen_m = 0.2f;
  constexpr float kFarthest_m = 40.0f;  // farther, the ground has too few returns to show where none may come from
  CarAnchor& car = pose.car;
  const FrameClusterTable& merged = frame.merged;
  const int32_t s = merged.main_sensor[row];
  if (car.view == CarView::kSide || !(car.unseen_2 > kLeastUnseen_m) || merged.sensor_mask[row] != 1 << s ||
      merged.nearest_m[row] > kFarthest_m)
    return;
  const PixelView view(context.sensors[s], frame.sensors[s]);
  const PixelBox pixels = main_pixels(frame, row, view);
  if (pixels.row_high < 0) return;
  const GroundBeside ground = view.find_ground(pixels);
  const bool from_left = ground.left && ground.none_right, from_right = ground.right && ground.none_left;
  if (!from_left && !from_right) return;
  // The left of the image is the left of the car where the line of sight goes along its heading.
  const float half_m = 0.5f * context.detect.fit_rectangle.width_m;
  car.center_2 = from_left == (car.view == CarView::kRear) ? pose.box.high_2 - half_m : pose.box.low_2 + half_m;
  car.unseen_2 = 0.0f;
  pose.move_to(car.center_1);
}

// The pose of a cluster as a car with this heading, which is not that of its box in `places`.
Posed pose_along(const StageContext& context, const Frame& frame, int32_t row, double heading_rad) {
  double s, c;
  sin_cos_f64(heading_rad, s, c);
  const OrientedBox box = measure_box(frame, row, float(c), float(s));
  return pose_at(context, frame, row, float(c), float(s), trim_box(context, frame, row, float(c), float(s), box));
}

// Where the front of a car is: 1 along the heading of its pose, -1 the other way, 0 unknown. At psi_REF most cars drive
// forward, so it must be clear that one has turned round: smoke behind a car looks like a nose, and far away an end may
// not show its height.
int32_t find_front(const StageContext& context, const Frame& frame, int32_t row, bool from_var, const Posed& pose) {
  constexpr float kHigher_m = 0.08f, kClearlyHigher_m = 0.25f;
  constexpr float kClear_m = 50.0f, kClearOfSmoke = 0.05f;
  constexpr int32_t kClearPoints = 30;
  const FrameClusterTable& merged = frame.merged;
  if (!knows_shape(context.detect)) return 0;
  if (!from_var && (merged.nearest_m[row] > kClear_m || merged.point_count[row] < kClearPoints)) return 0;
  EndTops tops(pose.box.low_1, pose.box.high_1);
  for_each_along(frame, row, pose.c, pose.s, pose.box,
                 [&](int32_t, float along_m, float height_m) { tops.add(along_m, height_m); });
  const RearEnd rear = tops.rear(from_var ? kHigher_m : kClearlyHigher_m);
  if (rear == RearEnd::kUnknown) return 0;
  if (rear == RearEnd::kLow) return 1;
  return from_var || find_smoke_share(context, frame, row, 0.0f) <= kClearOfSmoke ? -1 : 0;
}

// psi_VAR, turned to the front of the car and without its error.
double turn_to_front(const StageContext& context, const Frame& frame, int32_t row, double heading_var_rad,
                     int32_t front, const Posed& pose) {
  const float* const at_m = context.sensors[frame.merged.main_sensor[row]].T_vehicle_sensor.t;
  const double along_rad = wrap_angle(heading_var_rad + (front < 0 ? kPi : 0.0));
  const double sight_rad = atan2_f64(double(pose.y_m - at_m[1]), double(pose.x_m - at_m[0]));
  return wrap_angle(along_rad - psi_var_error(wrap_angle(along_rad - sight_rad)));
}

struct ClusterPose {
  RectangleFit fit;
  Posed posed;
  ClusterHeights heights;
  CarProfile::Match match;
  int32_t front;  // 1 along the heading, -1 the other way, 0 unknown
};
ClusterPose find_pose(const StageContext& context, Frame& frame, int32_t row) {
  const FrameClusterTable& merged = frame.merged;
  const ClusterPlaceTable& places = frame.places;
  RectangleFit fit = fit_cluster(context, frame, row, places.heading_rad[row]);
  const Posed ref = pose_at(context, frame, row, places.cos[row], places.sin[row], box_of(places, row));
  Posed var = ref;
  if (fit.heading_var_rad != fit.heading_ref_rad) var = pose_along(context, frame, row, double(fit.heading_var_rad));
  // psi_VAR of a car that is seen in part has errors that psi_REF has not: it must explain clearly more points.
  constexpr int32_t kLeastGain = 3, kGainDivisor = 20;
  const int32_t gain = std::max(kLeastGain, (merged.point_count[row] + kGainDivisor - 1) / kGainDivisor);
  fit.from_var = fit.inliers_var >= fit.inliers_ref + gain;
  Posed best = fit.from_var ? var : ref;
  fit.heading_rad = fit.from_var ? fit.heading_var_rad : fit.heading_ref_rad;
  int32_t front = find_front(context, frame, row, fit.from_var, best);
  if (fit.from_var && front != 0) {
    const double heading_rad = turn_to_front(context, frame, row, double(fit.heading_var_rad), front, best);
    fit.heading_rad = float(heading_rad);
    best = pose_along(context, frame, row, heading_rad);
    front = 1;
  }
  anchor_to_seen_side(context, frame, row, best);
  const ClusterHeights heights = measure_heights(frame, row);
  const CarProfile::Match match = match_profile(context, frame, row, best, heights.high_m);
  if (match.fits) best.move_to(match.center_m);
  fit.center_x_m = best.x_m, fit.center_y_m = best.y_m;
  fit.extent_length_m = best.box.length(), fit.extent_width_m = best.box.width();
  fit.ref_x_m = ref.x_m, fit.ref_y_m = ref.y_m;
  fit.var_x_m = var.x_m, fit.var_y_m = var.y_m;
  return {fit, best, heights, match, front};
}

// Whether a candidate straight behind is upright, and so a part of a car in the shadow of the own rear wing, which may
// leave a strip of it. Far away on the circuit two rows hit it, which on a misjudged road are many metres apart. Near,
// where the own car has just driven, three rows do, and it does not lie flat. In smoke it may be smoke.
bool is_upright_behind(const StageContext& context, const Frame& frame, int32_t row) {
  constexpr float kFrom_m = 30.0f, kWing = 0.2f;  // the shadow's width to either side, per metre
  constexpr float kDriven_m = 1.5f;               // to either side
  constexpr float kUpright_m = 0.15f, kSlope = 0.1f;
  constexpr int32_t kRowSteps = 2;  // from the highest row to the lowest
  const FrameClusterTable& merged = frame.merged;
  const float behind_m = -merged.center_x_m[row], beside_m = abs_of(merged.center_y_m[row]);
  const int32_t s = merged.main_sensor[row];
  if (!(beside_m < kWing * behind_m) || frame.smoke_limit[s].light > 0.0f) return false;
  const PixelBox pixels = main_pixels(frame, row, PixelView(context.sensors[s], frame.sensors[s]));
  const int32_t rows = pixels.row_high - pixels.row_low;
  if (behind_m > kFrom_m) return has_bounds(frame.places, row) && rows > 0;
  const float high_m = merged.max_z_m[row] - merged.min_z_m[row];
  return beside_m < kDriven_m && rows >= kRowSteps &&
         high_m >= max_of(kUpright_m, kSlope * box_of(frame.places, row).length());
}

// Row i of the detections and their views, but for the class.
void write_row(const StageContext& context, Frame& frame, int32_t i, int32_t row, const ClusterPose& pose) {
  DetectionViewTable& views = frame.views;
  write_pose(frame, i, row, pose.fit);
  frame.detections.map_s_m[i] = frame.places.s_m[row];
  frame.detections.map_d_m[i] = frame.places.d_m[row];
  const bool in_smoke = has_smoke_beside(context, frame, row);
  const DetectParams& params = context.detect;
  const Covariance p = find_covariance(pose.posed, pose.match, pose.fit.from_var, params.fit_rectangle.width_m,
                                       frame.merged.point_count[row], in_smoke, params.pose_by_view.angle_sigma_rad);
  views.var_x[i] = float(p.xx), views.var_y[i] = float(p.yy), views.cov_xy[i] = float(p.xy);
  views.view[i] = int32_t(pose.posed.car.view);
  views.road_z_m[i] = pose.heights.road_z_m;
  views.height_m[i] = pose.heights.high_m;
  views.front[i] = pose.front;
  views.in_smoke[i] = in_smoke;
  views.in_shadow[i] = is_in_own_shadow(context, frame, row) || is_upright_behind(context, frame, row);
}

}  // namespace

void pose_by_view(const StageContext& context, Frame& frame) noexcept {
  DetectionTable& out = frame.detections;
  out.count = frame.views.count = frame.kept_count;
  for (int32_t i = 0; i < out.count; ++i) {
    const int32_t row = frame.kept[i];
    const ClusterPose pose = find_pose(context, frame, row);
    write_row(context, frame, i, row, pose);
    frame.views.object_class[i] = int32_t(classify(context, frame, row, pose.posed.box, pose.heights.low_m));
  }
  const int32_t* const faint = frame.kept + frame.kept_count;
  int32_t count = 0;
  for (int32_t k = 0; k < frame.faint_count; ++k) {
    if (is_among_smoke(context, frame, faint[k])) continue;
    const int32_t i = out.count + count++;
    write_row(context, frame, i, faint[k], find_pose(context, frame, faint[k]));
    frame.views.object_class[i] = int32_t(ObjectClass::kUnknown);
  }
  frame.faint_count = count;
}

}  // namespace overtake
