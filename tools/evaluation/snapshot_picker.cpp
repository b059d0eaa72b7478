// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/snapshot_picker.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/evaluation/evaluator.h"
#include "tools/io/angles.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {
namespace {

constexpr double kNearM = 10, kFarM = 25;
constexpr int32_t kSeamPoints = 15;  // fewer points on one side are no evidence
constexpr double kSlipDeg[] = {2, 25, 60}, kSlipWindowDeg = 15, kFastMps = 5;
constexpr int32_t kFitPoints = 6;
constexpr std::size_t kSlips = std::size(kSlipDeg);

}  // namespace

SnapshotPicker::SnapshotPicker(const TruthLog& log, const ovt_params& params, const std::string& map_file)
    : log_(log), params_(params), map_file_(map_file), fits_(kSlips) {
  for (const io::RigSensor& s : log.rig().sensors) mountings_.emplace_back(s);
  const auto said = log.about().find("simulated");
  race_.simulated = said == log.about().end() || said->second != "false";
}

SnapshotPicker::Cars SnapshotPicker::cars_at(int64_t stamp_ns) const {
  Cars cars{log_.cars_at(stamp_ns), nullptr};
  cars.ego = ego_of(cars.all);
  return cars;
}

void SnapshotPicker::look(ovt_reader* reader) {
  ovt_frame_info info;
  cli::check(ovt_read_info(reader, &info), "frame");
  if (info.sensor_mask == 0 || !frame_) return;
  if (first_ns_ < 0) first_ns_ = info.first_stamp_ns;
  now_ = {frame_->scans.frame, double(info.first_stamp_ns - first_ns_) * 1e-9, info.stamp_ns};
  const Cars cars = cars_at(info.first_stamp_ns);
  if (!cars.ego) return;
  double nearest = std::numeric_limits<double>::quiet_NaN();
  for (const CarTruth& c : cars.all) {
    const double ahead = see(*cars.ego, c.x_m, c.y_m, c.z_m).ahead_m;
    if (!c.is_ego && !(std::fabs(nearest) <= std::fabs(ahead))) nearest = ahead;
  }
  race_.steps.push_back({now_.time_s, cars.ego->x_m, cars.ego->y_m, nearest});
  if (frame_->surface.size() == frame_->scans.scans.size()) {  // else it is unknown which points belong to a car
    look_at_scans(reader, cars);
    look_at_seams(reader, cars);
  }
  look_at_fits(reader);
}

void SnapshotPicker::look_at_scans(ovt_reader* reader, const Cars& cars) {
  for (std::size_t k = 0; k < frame_->scans.scans.size(); ++k) {
    std::map<int32_t, int64_t> points;
    for (const uint16_t surface : frame_->surface[k])
      if (const int32_t car = car_of(surface); car >= 0) ++points[car];
    for (const CarTruth& c : cars.all) {
      const auto found = points.find(c.car);
      const double range = std::hypot(c.x_m - cars.ego->x_m, c.y_m - cars.ego->y_m);
      if (c.is_ego || found == points.end() || range < kNearM || range > kFarM) continue;
      if (found->second > strip_.car_points) keep_strip(reader, frame_->scans.scans[k], range, found->second);
    }
  }
}

void SnapshotPicker::keep_strip(ovt_reader* reader, const io::SensorScan& scan, double car_m, int64_t car_points) {
  ovt_labels labels;
  cli::check(ovt_read_labels(reader, scan.sensor, &labels), "labels");
  if (labels.count == 0) return;
  auto images = cli::read_images(reader, scan.sensor);
  for (const int32_t id :
       {OVT_IMAGE_RANGE, OVT_IMAGE_ANGLE, OVT_IMAGE_ANGLE_SMOOTH, OVT_IMAGE_RANGE_REPAIRED, OVT_IMAGE_LABELS})
    if (!images.contains(id)) return;  // the method has no such step: there is no strip of its steps
  const io::RigSensor& sensor = log_.rig().sensors[std::size_t(scan.sensor)];
  strip_ = StripMoment();
  strip_.at = now_, strip_.sensor = sensor.name, strip_.car_m = car_m, strip_.car_points = car_points;
  strip_.azimuth_left_deg = sensor.azimuth_left_deg, strip_.azimuth_right_deg = sensor.azimuth_right_deg;
  strip_.range = images[OVT_IMAGE_RANGE];
  strip_.angle = images[OVT_IMAGE_ANGLE];
  strip_.smooth = images[OVT_IMAGE_ANGLE_SMOOTH];
  strip_.repaired = images[OVT_IMAGE_RANGE_REPAIRED];
  strip_.labels = images[OVT_IMAGE_LABELS];
  for (int32_t i = 0; i < labels.count; ++i) {
    const float x = labels.x_m[i], y = labels.y_m[i], z = labels.z_m[i], flat = std::hypot(x, y);
    strip_.points.push_back({std::atan2(y, x), std::atan2(z, flat), std::hypot(flat, z), labels.label[i]});
  }
}

void SnapshotPicker::look_at_seams(ovt_reader* reader, const Cars& cars) {
  std::map<std::pair<int32_t, int32_t>, std::map<int32_t, int64_t>> parts;  // (car, cluster) -> sensor -> points
  for (std::size_t k = 0; k < frame_->scans.scans.size(); ++k) {
    const int32_t sensor = frame_->scans.scans[k].sensor;
    const std::vector<uint16_t>& surface = frame_->surface[k];
    ovt_labels labels;
    if (std::none_of(surface.begin(), surface.end(), [](uint16_t s) { return car_of(s) >= 0; })) continue;
    cli::check(ovt_read_labels(reader, sensor, &labels), "labels");
    for (int32_t i = 0; i < std::min(labels.count, int32_t(surface.size())); ++i) {
      const int32_t car = car_of(surface[std::size_t(i)]);
      if (car < 0 || labels.label[i] <= 0) continue;
      const int32_t cluster = labels.cluster_of_label[labels.label[i]];
      if (cluster >= 0) ++parts[{car, cluster}][sensor];
    }
  }
  for (const auto& [where, of_sensor] : parts) {
    std::vector<int64_t> counts;
    for (const auto& [sensor, count] : of_sensor) counts.push_back(count);
    std::sort(counts.rbegin(), counts.rend());
    if (counts.size() < 2 || counts[1] < kSeamPoints || counts[1] <= clouds_score_) continue;
    clouds_score_ = counts[1];
    keep_clouds(reader, cars, where.first);
    for (const auto& [sensor, count] : of_sensor) {
      clouds_.sensors += (clouds_.sensors.empty() ? "" : " and ") + log_.rig().sensors[std::size_t(sensor)].name;
      clouds_.parts.push_back(count);
    }
  }
}

void SnapshotPicker::keep_clouds(ovt_reader* reader, const Cars& cars, int32_t car) {
  clouds_ = CloudMoment();
  clouds_.at = now_;
  for (const CarTruth& c : cars.all) {
    if (c.car != car) continue;
    const Seen at = see(*cars.ego, c.x_m, c.y_m, c.z_m);
    clouds_.car = {at.ahead_m, at.left_m, wrap_angle(c.heading_rad - cars.ego->heading_rad), params_.vehicle_length_m,
                   params_.vehicle_width_m};
  }
  for (const io::SensorScan& scan : frame_->scans.scans) {
    ovt_labels labels;
    cli::check(ovt_read_labels(reader, scan.sensor, &labels), "labels");
    for (int32_t i = 0; i < labels.count; ++i) {
      const auto v = mountings_[std::size_t(scan.sensor)].to_vehicle(labels.x_m[i], labels.y_m[i], labels.z_m[i]);
      const int32_t label = labels.label[i], cluster = label > 0 ? labels.cluster_of_label[label] : label - 1;
      clouds_.points.push_back({float(v[0]), float(v[1]), float(v[2]), labels.intensity[i], cluster});
    }
  }
}

void SnapshotPicker::look_at_fits(ovt_reader* reader) {
  ovt_detections d;
  cli::check(ovt_read_detections(reader, &d), "detections");
  for (int32_t i = 0; i < d.count; ++i) {
    const Cars cars = cars_at(d.stamp_ns[i]);
    if (!cars.ego || d.point_count[i] < kFitPoints) continue;
    for (const CarTruth& c : cars.all) {
      const double slip = wrap_angle(c.heading_rad - c.course_rad), slip_deg = io::deg(std::fabs(slip));
      const Seen at = see(*cars.ego, c.x_m, c.y_m, c.z_m);
      if (c.is_ego || c.speed_mps < kFastMps ||
          std::hypot(at.ahead_m - double(d.x_m[i]), at.left_m - double(d.y_m[i])) > kGateM)
        continue;
      double& most_slip_deg = most_slip_deg_[c.car];
      most_slip_deg = std::max(most_slip_deg, slip_deg);
      for (std::size_t k = 0; k < kSlips; ++k) {
        FitMoment& kept = fits_[k];
        if (slip_deg < most_slip_deg ||  // the slip angle decreases again
            slip_deg < kSlipDeg[k] || slip_deg > kSlipDeg[k] + kSlipWindowDeg ||
            d.point_count[i] <= int32_t(kept.points.size()))
          continue;
        const double l = params_.vehicle_length_m, w = params_.vehicle_width_m;
        kept.at = now_, kept.slip_rad = slip, kept.points.clear();
        kept.truth = {at.ahead_m, at.left_m, wrap_angle(c.heading_rad - cars.ego->heading_rad), l, w};
        kept.by_map = {double(d.ref_x_m[i]), double(d.ref_y_m[i]), double(d.heading_ref_rad[i]), l, w};
        kept.by_points = {double(d.var_x_m[i]), double(d.var_y_m[i]), double(d.heading_var_rad[i]), l, w};
        kept.inside_map = d.inliers_ref[i], kept.inside_points = d.inliers_var[i];
        kept.points_chosen = d.heading_source[i] == 1;
        for (const io::SensorScan& scan : frame_->scans.scans) {
          ovt_labels labels;
          cli::check(ovt_read_labels(reader, scan.sensor, &labels), "labels");
          for (int32_t p = 0; p < labels.count; ++p) {
            if (labels.label[p] <= 0 || labels.cluster_of_label[labels.label[p]] != d.cluster[i]) continue;
            const auto v = mountings_[std::size_t(scan.sensor)].to_vehicle(labels.x_m[p], labels.y_m[p], labels.z_m[p]);
            kept.points.emplace_back(float(v[0]), float(v[1]));
          }
        }
      }
    }
  }
}

std::vector<NamedPicture> SnapshotPicker::finish() const {
  std::vector<NamedPicture> out;
  const auto when = [](const PictureTime& at) {
    return "frame " + std::to_string(at.frame) + ", " + cli::fixed(at.time_s, 2) + " s";
  };
  if (strip_.at.frame >= 0)
    out.push_back({"strip",
                   draw_strip(strip_),
                   when(strip_.at) + ", sensor " + strip_.sensor + ": the scan with most points (" +
                       std::to_string(strip_.car_points) + ") on a car " + cli::fixed(kNearM, 0) + " to " +
                       cli::fixed(kFarM, 0) + " m away",
                   double(strip_.car_points),
                   {strip_.at.stamp_ns}});
  if (clouds_.at.frame >= 0)
    out.push_back({"clouds",
                   draw_clouds(clouds_, log_.rig()),
                   when(clouds_.at) + ": the frame with most points of one car on both sides of a seam",
                   double(clouds_score_),
                   {clouds_.at.stamp_ns}});
  std::vector<FitMoment> fits;
  for (const FitMoment& m : fits_)
    if (m.at.frame >= 0) fits.push_back(m);
  if (fits.size() == kSlips)
    out.push_back({"fits",
                   draw_fits(fits, race_.simulated),
                   "both rectangles of a car that begins to slide",
                   double(fits[1].points.size()),
                   {fits[0].at.stamp_ns, fits[1].at.stamp_ns, fits[2].at.stamp_ns}});
  out.push_back(
      {"sensors", draw_rig(log_.rig(), params_.vehicle_length_m, params_.vehicle_width_m), log_.rig().name, 0});
  if (map_file_.empty()) return out;
  const io::MapData map = io::read_map(map_file_);
  if (!map.is_bounds())
    out.push_back({"race", draw_race(map, race_),
                   cli::fixed(race_.steps.empty() ? 0 : race_.steps.back().time_s, 0) + " s",
                   double(race_.steps.size())});
  return out;
}

}  // namespace overtake::evaluation
