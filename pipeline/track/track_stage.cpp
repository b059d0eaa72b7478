// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_stage.h"

#include <algorithm>
#include <limits>

#include "core/math.h"
#include "pipeline/stages.h"

namespace overtake {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

// Position uncertainty of an extrapolated ego pose: half the largest acceleration of the car times age squared. Up to
// 20 ms that is 5 mm and counts as none.
constexpr double kMaxAcceleration = 26.5;
constexpr int64_t kEgoExactNs = 20'000'000;

double ego_variance(const EgoState& ego) noexcept {
  if (ego.age_ns <= kEgoExactNs) return 0.0;
  const double age = double(ego.age_ns) * 1e-9;
  const double sigma = 0.5 * kMaxAcceleration * age * age;
  return sigma * sigma;
}

}  // namespace

TrackStage::TrackStage(const StageContext& context, const TrackerParams& params, const Allocator& allocator)
    : context_(context), params_(params), tracker_(context.method->make_tracker(params, context.map, allocator)) {}

void TrackStage::measure_detections(Frame& frame) noexcept {
  const DetectionTable& in = frame.detections;
  MeasurementTable& out = frame.measurements;
  out.count = in.count;
  EgoState ego;
  for (int32_t i = 0; i < in.count; ++i) {
    out.stamp_ns[i] = in.stamp_ns[i];
    out.x_m[i] = double(in.x_m[i]);
    out.y_m[i] = double(in.y_m[i]);
    out.heading_rad[i] = double(in.heading_rad[i]);
    out.length_m[i] = double(in.length_m[i]);
    out.width_m[i] = double(in.width_m[i]);
    out.var_x[i] = out.var_y[i] = out.cov_xy[i] = kNoValue;
    if (reference_ == OVT_REFERENCE_MAP && frame.ego.at(in.stamp_ns[i], ego)) {
      ego.to_map(double(in.x_m[i]), double(in.y_m[i]), double(in.z_m[i]), out.x_m[i], out.y_m[i]);
      out.heading_rad[i] = ego.heading_to_map(double(in.heading_rad[i]));
      const double variance = ego_variance(ego);
      if (variance > 0) {
        out.var_x[i] = params_.r_diag[0] + variance;
        out.var_y[i] = params_.r_diag[1] + variance;
        out.cov_xy[i] = 0.0;
      }
    }
  }
}

void TrackStage::measure_external(Frame& frame) noexcept {
  const ExternalTable& in = frame.external;
  MeasurementTable& out = frame.measurements;
  out.count = in.count;
  const bool turn = frame.external_reference == OVT_REFERENCE_VEHICLE && reference_ == OVT_REFERENCE_MAP;
  const EgoState& ego = frame.ego_state;
  const double variance = turn ? ego_variance(ego) : 0.0;
  for (int32_t i = 0; i < in.count; ++i) {
    out.stamp_ns[i] = frame.stamp_ns;
    out.x_m[i] = in.x_m[i];
    out.y_m[i] = in.y_m[i];
    out.heading_rad[i] = in.heading_rad[i];
    out.length_m[i] = out.width_m[i] = kNoValue;
    out.var_x[i] = in.var_x[i];
    out.var_y[i] = in.var_y[i];
    const bool variances_alone = in.var_x[i] == in.var_x[i] && in.cov_xy[i] != in.cov_xy[i];  // independent, then
    out.cov_xy[i] = variances_alone ? 0.0 : in.cov_xy[i];
    if (turn) {
      ego.to_map(in.x_m[i], in.y_m[i], 0.0, out.x_m[i], out.y_m[i]);
      if (in.heading_rad[i] == in.heading_rad[i]) out.heading_rad[i] = ego.heading_to_map(in.heading_rad[i]);
      const double c = ego.r[0], s = ego.r[3];  // rotate the covariance
      const double xx = out.var_x[i], yy = out.var_y[i], xy = out.cov_xy[i];
      out.var_x[i] = c * c * xx - 2 * c * s * xy + s * s * yy;
      out.var_y[i] = s * s * xx + 2 * c * s * xy + c * c * yy;
      out.cov_xy[i] = c * s * (xx - yy) + (c * c - s * s) * xy;
      if (variance > 0) {
        if (!is_position_covariance(out.var_x[i], out.var_y[i], out.cov_xy[i])) {  // the tracker's R stands in
          out.var_x[i] = params_.r_diag[0];
          out.var_y[i] = params_.r_diag[1];
          out.cov_xy[i] = 0.0;
        }
        out.var_x[i] += variance;
        out.var_y[i] += variance;
      }
    }
  }
}

int32_t TrackStage::observe(const Frame& frame, ObservedSector* sectors) const noexcept {
  if (frame.kind == FrameKind::kExternal) return -1;  // who knows what it saw: everything
  int32_t count = 0;
  for (int32_t s = 0; s < context_.sensor_count; ++s) {
    if (!(frame.sensor_mask >> s & 1u)) continue;
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
    sector.left_rad = yaw + double(model.azimuth_left_rad);
    sector.right_rad = sector.left_rad - span;
    sector.range_min_m = double(model.range_min_m);
    sector.range_max_m = double(model.range_max_m);
  }
  return count;
}

void TrackStage::run(Frame& frame) noexcept {
  StageClock clock(frame.spans, {frame.sequence, frame.stamp_ns, -1});
  clock.begin(OVT_STAGE_TRACK);
  if (frame.restart) {
    tracker_->restart();
    newest_ns_ = INT64_MIN;
  }
  if (frame.kind != FrameKind::kPrediction) newest_ns_ = std::max(newest_ns_, frame.stamp_ns);
  frame.tracks_ns = frame.kind == FrameKind::kPrediction ? frame.stamp_ns : newest_ns_;
  frame.ego_known = frame.ego.at(frame.stamp_ns, frame.ego_state);
  // The tracker works in the map from the first ego pose on, in the vehicle frame until then. Changing over forgets the
  // tracks: they mean nothing in the other frame. A prediction changes nothing, so not that either.
  const bool in_map = frame.kind == FrameKind::kExternal && !frame.ego_known
                          ? frame.external_reference == OVT_REFERENCE_MAP
                          : frame.ego_known;
  if (in_map && reference_ == OVT_REFERENCE_VEHICLE && frame.kind != FrameKind::kPrediction) {
    tracker_->restart();
    reference_ = OVT_REFERENCE_MAP;
  }
  frame.reference = reference_;
  if (reference_ == OVT_REFERENCE_VEHICLE) frame.flags |= OVT_FLAG_NO_EGO;
  if (frame.ego_known && frame.ego_state.age_ns > kEgoFreshNs) frame.flags |= OVT_FLAG_EGO_STALE;
  if (!context_.map) frame.flags |= OVT_FLAG_NO_MAP;
  if (frame.failed) find_ego_on_map(context_, frame);
  if (context_.map && !frame.map_holds) frame.flags |= OVT_FLAG_EGO_OFF_MAP;

  // Once in the map, measurements of the vehicle frame are worth nothing without a pose: the tracks only predict.
  const bool measured_in_vehicle =
      frame.kind == FrameKind::kScans ||
      (frame.kind == FrameKind::kExternal && frame.external_reference == OVT_REFERENCE_VEHICLE);
  const bool lost = reference_ == OVT_REFERENCE_MAP && !frame.ego_known && measured_in_vehicle;
  if (lost) frame.flags |= OVT_FLAG_EGO_STALE;

  if (frame.kind == FrameKind::kPrediction || lost || frame.failed) {
    frame.measurements.count = 0;
    frame.lost_rows = frame.kind == FrameKind::kExternal ? frame.external.count : frame.detections.count;
    std::fill_n(frame.measurements.track, frame.detections.count, kNobody);
    tracker_->predict(frame.stamp_ns, frame.tracks);
    last_step_ = {};
  } else {
    if (frame.kind == FrameKind::kScans) {
      measure_detections(frame);
    } else {
      measure_external(frame);
    }
    const MeasurementTable& m = frame.measurements;
    ObservedSector sectors[kMaxSensors];
    TrackerFrame input;
    input.stamp_ns = frame.stamp_ns;
    input.detections = {m.count,    m.stamp_ns, m.x_m,   m.y_m,   m.heading_rad,
                        m.length_m, m.width_m,  m.var_x, m.var_y, m.cov_xy};
    if (frame.ego_known) {  // which puts the tracker into the map
      const EgoPose& pose = frame.ego_state.pose;
      input.ego = {true, pose.x_m, pose.y_m, pose.yaw_rad, pose.speed_mps};
    }
    input.in_map = reference_ == OVT_REFERENCE_MAP;
    input.ask_map = frame.map_holds;
    input.sectors = sectors;
    input.sector_count = observe(frame, sectors);
    last_step_ = tracker_->step(input, m.track);
    tracker_->snapshot(frame.tracks);
  }
  frame.refiltered = last_step_.refiltered;
  if (last_step_.limited) frame.flags |= OVT_FLAG_WORK_LIMIT;
  clock.end(OVT_STAGE_TRACK);
}

}  // namespace overtake
