// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_stage.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "pipeline/frame_flags.h"
#include "pipeline/stages.h"
#include "pipeline/track/iteration.h"

namespace overtake {
namespace {

// Position uncertainty of an extrapolated ego pose: half the largest acceleration of the car times age squared. At 20
// ms that is 5 mm; up to there the function returns 0.
constexpr double kMaxAcceleration = 26.5;
constexpr int64_t kEgoExactNs = 20'000'000;

double ego_variance(const EgoState& ego) noexcept {
  if (ego.age_ns <= kEgoExactNs) return 0.0;
  const double age = double(ego.age_ns) * 1e-9;
  const double sigma = 0.5 * kMaxAcceleration * age * age;
  return sigma * sigma;
}

// Of the corrected ego heading, besides the covariance of what was learned.
constexpr double kModelSigma = 6e-4;    // rad: 0.034 deg
constexpr double kUnknownSigma = 5e-3;  // rad: 0.3 deg, as large as the error of the published heading
// Drift of the heading's error that the model does not explain: 0.3 deg/s.
constexpr double kDriftSigma_rps = 5e-3;

// Covariance of A v for a v with the covariance of `z`.
void turn_covariance(double a00, double a01, double a10, double a11, Measurement& z) noexcept {
  const double xx = z.var_x, yy = z.var_y, xy = z.cov_xy;
  z.var_x = a00 * a00 * xx + 2 * a00 * a01 * xy + a01 * a01 * yy;
  z.var_y = a10 * a10 * xx + 2 * a10 * a11 * xy + a11 * a11 * yy;
  z.cov_xy = a00 * a10 * xx + (a00 * a11 + a01 * a10) * xy + a01 * a11 * yy;
}

// An error of the ego heading moves a place across the line of sight.
void add_heading_variance(double sigma_rad, float x, float y, Measurement& z) noexcept {
  const double variance = sigma_rad * sigma_rad, x_m = double(x), y_m = double(y);
  z.var_x += variance * y_m * y_m;
  z.var_y += variance * x_m * x_m;
  z.cov_xy -= variance * x_m * y_m;
}

// Transforms a measurement in the vehicle's plane to the map.
void turn_to_map(const EgoState& ego, Measurement& z) noexcept {
  ego.to_map(z.x_m, z.y_m, 0.0, z.x_m, z.y_m);
  z.heading_rad = std::fabs(z.heading_rad) <= kMaxAngle_rad ? ego.heading_to_map(z.heading_rad) : kNotMeasured;
  turn_covariance(ego.r[0], ego.r[1], ego.r[3], ego.r[4], z);
}

// Adds the variance of the ego pose. A measurement without a valid covariance gets the tracker's R first.
void widen(const TrackerParams& params, double variance, Measurement& z) noexcept {
  if (!(variance > 0)) return;
  ensure_covariance(params.r_diag, z);
  z.var_x += variance;
  z.var_y += variance;
}

bool has_rule(const Method& method, void (*run)(const StageContext&, Frame&) noexcept) noexcept {
  return std::any_of(method.frame.begin(), method.frame.end(), [&](const FrameRule& rule) { return rule.run == run; });
}

}  // namespace

TrackStage::TrackStage(const StageContext& context, const TrackerParams& params, const Allocator& allocator)
    : context_(context),
      params_(params),
      lead_ns_(int64_t(params.lead_s * 1e9 + 0.5)),
      tracker_(context.method->make_tracker(params, context.map, allocator)) {
  if (has_rule(*context.method, &measure_walls))
    heading_ = std::make_unique<HeadingFilter>(context.detect.ego_heading, context.sensor_count, allocator, lead_ns_);
  if (has_rule(*context.method, &find_view_gaps)) gaps_ = std::make_unique<GapWatch>();
}

// Finds the correction for this frame, then gives the frame's walls to the filter.
void TrackStage::correct_heading(Frame& frame) noexcept {
  if (!heading_) return;
  corrected_.count = 0;
  if (!frame.ego_known) return;
  const int32_t sensors = heading_->sensor_count();
  follow_course(frame.ego, corrected_);  // its yaw rates become those of the vehicle again below
  EgoState turning;
  corrected_.at(frame.stamp_ns, turning);
  cause_ = cause_of(turning.pose);
  if (frame.kind == FrameKind::kScans && !frame.failed) heading_->add(frame.stamp_ns, cause_, frame.walls);
  // The same walls in any order of arrival: a scan may be late by more against detections that were ahead.
  const int64_t lead_ns = frame.kind == FrameKind::kExternal ? lead_ns_ : 0;
  learned_ = heading_->at(later_ns(frame.stamp_ns, -lead_ns));
  for (int32_t i = 0; i < corrected_.count; ++i) {
    EgoPose& pose = corrected_.poses[i];
    pose.yaw_rad = wrap_angle(pose.yaw_rad + learned_.offset_rad(cause_of(pose), HeadingFilter::kNoConstant, sensors));
    pose.yaw_rate_rps = frame.ego.poses[i].yaw_rate_rps;
  }
  smooth_headings(corrected_, corrected_, kDriftSigma_rps);
  EgoState ego;
  corrected_.at(frame.stamp_ns, ego);
  const double constant = learned_.offset_rad({}, HeadingFilter::kMean, sensors);
  EgoHeading& out = frame.ego_heading;
  out.offset_rad = wrap_angle(ego.pose.yaw_rad - frame.ego_state.pose.yaw_rad + constant);
  out.sigma_rad = heading_sigma(HeadingFilter::kMean);
  for (const WallHeading& walls : frame.walls)
    if (walls.valid) out.wall_points += walls.points;
  if (out.sigma_rad > kUnknownSigma || heading_->contradicts(learned_, cause_, frame.walls))
    frame.flags |= OVT_FLAG_EGO_HEADING;
}

double TrackStage::heading_sigma(int32_t sensor) const noexcept {
  return std::sqrt(learned_.variance(cause_, sensor, heading_->sensor_count()) + kModelSigma * kModelSigma);
}

void TrackStage::measure_detections(Frame& frame) const noexcept {
  DetectionTable& in = frame.detections;
  const int32_t rows = in.count + frame.faint_count;
  frame.measurements.count = rows;
  EgoState ego;
  for (int32_t i = 0; i < rows; ++i) {
    Measurement& z = frame.measurements.row[i];
    z = {.x_m = double(in.x_m[i]),
         .y_m = double(in.y_m[i]),
         .heading_rad = double(in.heading_rad[i]),
         .length_m = double(in.length_m[i]),
         .width_m = double(in.width_m[i]),
         .stamp_ns = in.stamp_ns[i]};
    double z_m = double(in.z_m[i]), offset_rad = 0;
    if (frame.views.capacity > 0) {  // the centre on the road: on a bank, a place above it is another place of the map
      const DetectionViewTable& views = frame.views;
      z.var_x = double(views.var_x[i]), z.var_y = double(views.var_y[i]), z.cov_xy = double(views.cov_xy[i]);
      z.faint = i >= in.count;
      z.debris = views.object_class[i] == int32_t(ObjectClass::kDebris);
      z.height_m = double(views.height_m[i]);
      z.object_class = views.object_class[i];
      z.view = views.view[i];
      z.free_heading = in.heading_source[i] == int32_t(HeadingSource::kVar);
      z.front = views.front[i];
      z.in_shadow = views.in_shadow[i];
      z.in_smoke = views.in_smoke[i];
      z.points = in.point_count[i];
      z_m = double(views.road_z_m[i]);
    }
    // The pose is known at the frame's stamp, so it may be somewhat older at that of a row, which is a part of a scan
    // later.
    constexpr int64_t kOldestNs = 2 * kEgoLostNs;
    const int32_t sensor = frame.merged.main_sensor[in.cluster[i]];
    const int64_t pose_ns = find_pose_time(context_, frame, sensor, in.stamp_ns[i]);
    if (reference_ == OVT_REFERENCE_MAP && frame.ego.at(pose_ns, ego, kOldestNs)) {
      EgoState used = ego;
      if (heading_) {
        corrected_.at(pose_ns, used, kOldestNs);
        used = turned(used, learned_.offset_rad({}, sensor, heading_->sensor_count()));
        offset_rad = wrap_angle(used.pose.yaw_rad - ego.pose.yaw_rad);
        add_heading_variance(heading_sigma(sensor), in.x_m[i], in.y_m[i], z);
        if (frame.views.capacity > 0) {
          frame.views.var_x[i] = float(z.var_x), frame.views.var_y[i] = float(z.var_y);
          frame.views.cov_xy[i] = float(z.cov_xy);
        }
      }
      // psi_REF was found on the map with the ego heading as published: in the vehicle frame it gets the correction.
      const bool by_map = frame.uses_map && in.heading_source[i] == int32_t(HeadingSource::kRef);
      z.heading_rad = (by_map ? ego : used).heading_to_map(z.heading_rad);
      if (by_map) in.heading_rad[i] = float(wrap_angle(double(in.heading_rad[i]) - offset_rad));
      used.to_map(z.x_m, z.y_m, z_m, z.x_m, z.y_m);
      turn_covariance(used.r[0], used.r[1], used.r[3], used.r[4], z);
      widen(params_, ego_variance(ego), z);
    } else if (reference_ == OVT_REFERENCE_MAP) {
      z.x_m = kNotMeasured;  // its place in the map is not known
    }
    if (frame.views.capacity > 0) frame.views.ego_offset_rad[i] = float(offset_rad);
  }
}

void TrackStage::measure_external(Frame& frame) const noexcept {
  const ExternalTable& in = frame.external;
  frame.measurements.count = in.count;
  const bool turn = frame.external_reference == OVT_REFERENCE_VEHICLE && reference_ == OVT_REFERENCE_MAP;
  const double variance = turn ? ego_variance(frame.ego_state) : 0.0;
  const EgoState ego = heading_ && turn ? turned(frame.ego_state, frame.ego_heading.offset_rad) : frame.ego_state;
  for (int32_t i = 0; i < in.count; ++i) {
    Measurement& z = frame.measurements.row[i];
    const bool variances_alone = in.var_x[i] == in.var_x[i] && in.cov_xy[i] != in.cov_xy[i];  // then cov_xy is 0
    z = {.x_m = in.x_m[i],
         .y_m = in.y_m[i],
         .var_x = in.var_x[i],
         .var_y = in.var_y[i],
         .cov_xy = variances_alone ? 0.0 : in.cov_xy[i],
         .heading_rad = in.heading_rad[i],
         .length_m = in.length_m[i],
         .width_m = in.width_m[i],
         .stamp_ns = frame.stamp_ns,
         .height_m = in.height_m[i],
         .free_heading = in.heading_rad[i] == in.heading_rad[i],
         .front = in.heading_rad[i] == in.heading_rad[i],
         .score = in.score[i]};
    frame.values_ignored += count_unusable(z, in.var_x[i] == in.var_x[i]);
    if (!has_covariance(z)) z.var_x = z.var_y = z.cov_xy = kNotMeasured;  // nor has it one after the turn
    if (turn) turn_to_map(ego, z);
    widen(params_, variance, z);
  }
}

void TrackStage::find_blocked(Frame& frame) noexcept {
  if (!gaps_ || frame.kind != FrameKind::kScans || frame.failed) return;
  gaps_->follow(context_.sensors, context_.sensor_count, frame);
  for (int32_t s = 0; s < context_.sensor_count; ++s)
    if (frame.blocked[s].count > 0) frame.flags |= OVT_FLAG_VIEW_BLOCKED;
}

int32_t TrackStage::observe(const Frame& frame, ObservedSector* sectors) const noexcept {
  if (frame.kind == FrameKind::kExternal) return -1;  // field of view unknown: assume everything
  int32_t count = 0;
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    // What an incomplete scan, or one without a usable point, does not show is not free.
    if (!((frame.sensor_mask & ~frame.incomplete_mask) >> s & 1u) || count_usable(frame.sensors[s]) == 0) continue;
    const SensorModel& model = context_.sensors[s];
    ObservedSector& sector = sectors[count++];
    const double span = model.wraps ? kTwoPi : double(model.pitch_rad) * model.cols;
    double yaw = double(model.mounting_yaw_rad);
    sector.x_m = double(model.T_vehicle_sensor.t[0]);
    sector.y_m = double(model.T_vehicle_sensor.t[1]);
    if (reference_ == OVT_REFERENCE_MAP) {
      const EgoState& ego = frame.ego_state;
      ego.to_map(sector.x_m, sector.y_m, double(model.T_vehicle_sensor.t[2]), sector.x_m, sector.y_m);
      yaw = ego.heading_to_map(yaw);
    }
    sector.view.left_rad = yaw + double(model.azimuth_left_rad);
    sector.view.right_rad = sector.view.left_rad - span;
    sector.range_min_m = double(model.range_min_m);
    sector.range_max_m = double(model.range_max_m);
    const ViewGaps& blocked = frame.blocked[s];
    sector.gap_count = blocked.count;
    for (int32_t i = 0; i < blocked.count; ++i) {
      const double left_rad = yaw + double(left_of(model, blocked.gap[i]));
      sector.gap[i] = {left_rad, left_rad - double(width_of(model, blocked.gap[i]))};
    }
  }
  return count;
}

// A prediction does not change the tracker, so it does not change the frame of reference either. Nor do pushed rows in
// the map after scans were tracked in the vehicle frame: only an ego pose tells where their cars are in the map.
// Without one, scans that come after such rows are tracked in the vehicle frame.
void TrackStage::choose_reference(Frame& frame) noexcept {
  const bool scans = frame.kind == FrameKind::kScans;
  if (frame.ego_known && frame.kind != FrameKind::kPrediction) rows_chose_map_ = false;
  if (scans && rows_chose_map_) {
    tracker_->restart();
    reference_ = OVT_REFERENCE_VEHICLE;
    rows_chose_map_ = false;
  }
  if (scans && reference_ == OVT_REFERENCE_VEHICLE) tracks_scans_ = true;
  const bool by_rows = frame.kind == FrameKind::kExternal && !frame.ego_known && !tracks_scans_ &&
                       frame.external.count > 0 && frame.external_reference == OVT_REFERENCE_MAP;
  if ((frame.ego_known || by_rows) && reference_ == OVT_REFERENCE_VEHICLE && frame.kind != FrameKind::kPrediction) {
    tracker_->restart();
    reference_ = OVT_REFERENCE_MAP;
    rows_chose_map_ = by_rows;
  }
  frame.reference = reference_;
  if (reference_ == OVT_REFERENCE_VEHICLE) frame.flags |= OVT_FLAG_NO_EGO;
  const bool lost = reference_ == OVT_REFERENCE_MAP && !rows_chose_map_ && !frame.ego_known;
  if (lost || (frame.ego_known && frame.ego_state.age_ns > kEgoFreshNs)) frame.flags |= OVT_FLAG_EGO_STALE;
  if (!context_.map) frame.flags |= OVT_FLAG_NO_MAP;
  if (frame.failed) find_ego_on_map(context_, frame);
  if (frame.ego_off_map_m > context_.detect.ego_margin_m) frame.flags |= OVT_FLAG_EGO_OFF_MAP;
}

bool TrackStage::may_measure(Frame& frame) const noexcept {
  const bool measured_in_vehicle =
      frame.kind == FrameKind::kScans ||
      (frame.kind == FrameKind::kExternal && frame.external_reference == OVT_REFERENCE_VEHICLE);
  const bool lost = reference_ == OVT_REFERENCE_MAP ? !frame.ego_known && measured_in_vehicle
                                                    : frame.kind == FrameKind::kExternal && !measured_in_vehicle;
  if (lost && reference_ == OVT_REFERENCE_MAP) frame.flags |= OVT_FLAG_EGO_STALE;
  return frame.kind != FrameKind::kPrediction && !lost && !frame.failed;
}

StepResult TrackStage::step(Frame& frame) noexcept {
  if (frame.kind == FrameKind::kScans)
    measure_detections(frame);
  else
    measure_external(frame);
  ObservedSector sectors[kMaxSensors];
  TrackerFrame input;
  input.stamp_ns = frame.stamp_ns;
  input.measurements = {frame.measurements.row, std::size_t(frame.measurements.count)};
  if (frame.ego_known) {  // then the tracker works in the map
    const EgoPose& pose = frame.ego_state.pose;
    input.ego = {true, pose.x_m, pose.y_m, pose.yaw_rad, pose.speed_mps, pose.yaw_rate_rps};
  }
  input.in_map = reference_ == OVT_REFERENCE_MAP;
  input.ask_map = frame.uses_map;
  input.sectors = sectors;
  input.sector_count = observe(frame, sectors);
  input.of_rows = frame.kind == FrameKind::kExternal;
  const StepResult result = tracker_->step(input, frame.measurements.track);
  tracker_->snapshot(frame.tracks, frame.track_states);
  return result;
}

void TrackStage::predict(Frame& frame) noexcept {
  frame.measurements.count = 0;
  frame.lost_rows = frame.kind == FrameKind::kExternal ? frame.external.count : frame.detections.count;
  std::fill_n(frame.measurements.track, frame.detections.count, kNobody);
  tracker_->predict(frame.stamp_ns, frame.tracks, frame.track_states);
}

void TrackStage::run(Frame& frame) noexcept {
  StageClock clock(frame.spans, {frame.sequence, frame.stamp_ns, -1});
  clock.begin(OVT_STAGE_TRACK);
  if (frame.restart) {
    tracker_->restart();
    if (heading_) heading_->restart();
    if (gaps_) gaps_->restart();
    newest_ns_ = INT64_MIN;
  }
  if (frame.kind != FrameKind::kPrediction) newest_ns_ = std::max(newest_ns_, frame.stamp_ns);
  frame.tracks_ns = frame.kind == FrameKind::kPrediction ? frame.stamp_ns : newest_ns_;
  frame.ego_known = frame.ego.at(frame.stamp_ns, frame.ego_state);
  choose_reference(frame);
  if (frame.views.count > 0) std::fill_n(frame.views.ego_offset_rad, frame.views.count, 0.0f);
  correct_heading(frame);
  find_blocked(frame);
  StepResult result;
  if (may_measure(frame))
    result = step(frame);
  else
    predict(frame);
  frame.refiltered = result.refiltered;
  if (result.limited) frame.flags |= OVT_FLAG_WORK_LIMIT;
  if (result.ego_jumped) frame.flags |= OVT_FLAG_EGO_JUMP;
  clock.end(OVT_STAGE_TRACK);
}

}  // namespace overtake
