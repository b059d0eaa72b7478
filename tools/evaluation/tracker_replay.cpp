// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/tracker_replay.h"

#include <algorithm>
#include <cmath>

#include "kernels/fit_rectangle.h"
#include "tools/client/circuit_file.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/io/error.h"

namespace overtake::evaluation {

TrackerReplay::TrackerReplay(const std::string& kind, const TruthLog& log, const cli::Config& config)
    : kind_(kind), log_(log), params_(config.params) {
  if (!config.map.empty()) map_ = cli::read_circuit(config.map);
  cli::Config alone = config;
  alone.has_rig = false;  // no LiDAR: only the tracker
  alone.rig = io::Rig();
  session_ = std::make_unique<cli::Session>(alone, nullptr, nullptr);
  cli::check(ovt_create_reader(session_->detector(), &reader_), "reader");
}

TrackerReplay::~TrackerReplay() { ovt_destroy_reader(reader_); }

void TrackerReplay::add_poses(const std::vector<io::EgoRow>& rows) {
  session_->add_ego(rows);
  if (!rows.empty()) session_->push_ego_until(rows.back().stamp_ns);
}

void TrackerReplay::Points::add(const std::array<double, 3>& at_m, int32_t sensor, int64_t stamp) {
  x_m.push_back(float(at_m[0])), y_m.push_back(float(at_m[1]));
  z_m += at_m[2], stamp_ns += double(stamp);
  if (of_sensor.size() <= std::size_t(sensor)) of_sensor.resize(std::size_t(sensor) + 1);
  ++of_sensor[std::size_t(sensor)];
}

// Stages 9 and 10 for one cluster: mean stamp and height, then the rectangle.
void TrackerReplay::add_row(const Points& points, int64_t stamp_ns, double heading_ref_rad, bool only_ref) {
  const std::size_t most =
      std::size_t(std::max_element(points.of_sensor.begin(), points.of_sensor.end()) - points.of_sensor.begin());
  const io::Mounting mounting(log_.rig().sensors[most]);
  FitRectangleParams params;
  params.length_m = float(params_.vehicle_length_m), params.width_m = float(params_.vehicle_width_m);
  params.margin_m = float(params_.pose_margin_m);
  params.min_var_points = only_ref ? INT32_MAX : params_.pose_min_var_points;
  const int32_t count = int32_t(points.x_m.size());
  const RectangleFit fit = ref::fit_rectangle(params, points.x_m.data(), points.y_m.data(), count,
                                              float(heading_ref_rad), float(mounting.x_m()), float(mounting.y_m()));
  stamp_ns_.push_back(stamp_ns);
  x_m_.push_back(fit.center_x_m), y_m_.push_back(fit.center_y_m), z_m_.push_back(float(points.z_m / count));
  heading_rad_.push_back(fit.heading_rad), source_.push_back(fit.from_var ? 1 : 0), point_count_.push_back(count);
}

// The non-ground points of each requested cluster; without requests, those of each car.
std::vector<TrackerReplay::Points> TrackerReplay::gather(ovt_reader* reader, const LogFrame& frame, int32_t count,
                                                         const std::vector<int32_t>& row_of_cluster) const {
  std::vector<Points> out(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < frame.scans.scans.size(); ++k) {
    const io::SensorScan& scan = frame.scans.scans[k];
    ovt_labels labels;
    cli::check(ovt_read_labels(reader, scan.sensor, &labels), "labels");
    const io::Mounting mounting(log_.rig().sensors[std::size_t(scan.sensor)]);
    for (int32_t i = 0; i < labels.count; ++i) {
      if (labels.label[i] <= 0) continue;
      int32_t row = -1;
      if (row_of_cluster.empty()) {
        row = car_of(frame.surface[k][std::size_t(i)]);
      } else {
        const int32_t cluster = labels.cluster_of_label[labels.label[i]];
        row = cluster < 0 ? -1 : row_of_cluster[std::size_t(cluster)];
      }
      if (row < 0 || row >= count) continue;
      const int64_t offset = scan.time_offset_ns.empty() ? 0 : scan.time_offset_ns[std::size_t(i)];
      out[std::size_t(row)].add(mounting.to_vehicle(labels.x_m[i], labels.y_m[i], labels.z_m[i]), scan.sensor,
                                scan.stamp_ns + offset - frame.scans.scans[0].stamp_ns);
    }
  }
  return out;
}

void TrackerReplay::change_headings(ovt_reader* reader, const LogFrame& frame, const ovt_frame_info& info,
                                    const ovt_detections& in) {
  ovt_clusters clusters;
  cli::check(ovt_read_clusters(reader, &clusters), "clusters");
  std::vector<int32_t> row_of_cluster(std::size_t(clusters.count) + 1, -1);
  std::vector<double> heading(std::size_t(in.count), 0.0);
  for (int32_t i = 0; i < in.count && kind_ == "heading"; ++i) {
    const MapPlace at = place_in_map(log_.poses(), info, in, i);
    const std::vector<CarTruth> cars = log_.cars_at(in.stamp_ns[i]);
    const int32_t c = nearest_car(cars, at.x_m, at.y_m);
    const CarTruth* ego = ego_of(cars);
    if (c < 0 || !ego || in.cluster[i] < 0 || is_debris(in, i)) continue;
    row_of_cluster[std::size_t(in.cluster[i])] = i;
    heading[std::size_t(i)] =
        heading_from_map(ego->roll_rad, ego->pitch_rad, ego->heading_rad, cars[std::size_t(c)].heading_rad);
  }
  const std::vector<Points> points = gather(reader, frame, in.count, row_of_cluster);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].x_m.empty()) {
      add_row(points[i], in.stamp_ns[i], heading[i], true);
      continue;
    }
    stamp_ns_.push_back(in.stamp_ns[i]);
    x_m_.push_back(in.x_m[i]), y_m_.push_back(in.y_m[i]), z_m_.push_back(in.z_m[i]);
    heading_rad_.push_back(in.heading_rad[i]), source_.push_back(in.heading_source[i]);
    point_count_.push_back(in.point_count[i]);
  }
}

void TrackerReplay::make_clusters(ovt_reader* reader, const LogFrame& frame, const ovt_frame_info& info) {
  if (frame.surface.empty()) throw io::Error("perfect clusters", 0, "the log does not say what each point lies on");
  const int64_t first_ns = frame.scans.scans[0].stamp_ns;
  const std::vector<CarTruth> cars = log_.cars_at(first_ns);
  int32_t count = 0;
  for (const CarTruth& c : cars) count = std::max(count, c.car + 1);
  for (const Points& points : gather(reader, frame, count, {})) {
    const double n = double(points.x_m.size());
    if (n < 3) continue;
    const int64_t stamp_ns = first_ns + int64_t(points.stamp_ns / n);
    const io::EgoRow pose = corrected(pose_at(log_.poses(), stamp_ns), info);
    double x = 0, y = 0, heading_ref = 0;
    for (const float v : points.x_m) x += double(v) / n;
    for (const float v : points.y_m) y += double(v) / n;
    if (!map_.empty()) {
      const MapPlace at = to_map(pose, x, y, points.z_m / n, 0);
      heading_ref =
          heading_in_vehicle(pose.roll_rad, pose.pitch_rad, pose.yaw_rad, map_.project(at.x_m, at.y_m).heading_rad);
    }
    add_row(points, stamp_ns, heading_ref, false);
  }
}

const Replayed& TrackerReplay::run(ovt_reader* reader, const LogFrame& frame) {
  stamp_ns_.clear(), x_m_.clear(), y_m_.clear(), z_m_.clear(), heading_rad_.clear();
  source_.clear(), point_count_.clear();
  ovt_frame_info info, own;
  cli::check(ovt_read_info(reader, &info), "frame");
  ovt_detections detections;
  cli::check(ovt_read_detections(reader, &detections), "detections");
  if (kind_ == "clusters")
    make_clusters(reader, frame, info);
  else
    change_headings(reader, frame, info, detections);
  const std::size_t count = stamp_ns_.size();
  out_.detections = {};
  if (kind_ != "clusters") out_.detections = detections;  // the same rows: unused columns keep the pipeline's values
  out_.detections.count = int32_t(count);
  out_.detections.stamp_ns = stamp_ns_.data();
  out_.detections.x_m = x_m_.data(), out_.detections.y_m = y_m_.data(), out_.detections.z_m = z_m_.data();
  out_.detections.heading_rad = heading_rad_.data(), out_.detections.heading_source = source_.data();
  out_.detections.point_count = point_count_.data();

  std::vector<double> x(count), y(count), heading(count);
  for (std::size_t i = 0; i < count; ++i) {
    const MapPlace at = place_in_map(log_.poses(), info, out_.detections, int32_t(i));
    x[i] = at.x_m, y[i] = at.y_m, heading[i] = at.heading_rad;
    const std::vector<CarTruth> cars = log_.cars_at(stamp_ns_[i]);
    if (const int32_t c = nearest_car(cars, x[i], y[i]); c >= 0) {
      const double drive_m = cars[std::size_t(c)].speed_mps * double(info.stamp_ns - stamp_ns_[i]) * 1e-9;
      x[i] += drive_m * std::cos(cars[std::size_t(c)].course_rad);
      y[i] += drive_m * std::sin(cars[std::size_t(c)].course_rad);
    }
  }
  ovt_external_detections in;
  ovt_external_detections_init(&in, sizeof in);
  in.stamp_ns = info.stamp_ns, in.count = int32_t(count), in.reference = OVT_REFERENCE_MAP;
  in.x_m = x.data(), in.y_m = y.data(), in.heading_rad = heading.data();
  cli::check(ovt_push_detections(session_->detector(), &in), "detections given on");
  session_->flush();
  cli::check(ovt_next_frame(reader_, &own), "tracks of what was given on");

  track_.assign(count, 0);
  ovt_tracks tracks;
  cli::check(ovt_read_tracks(reader_, info.stamp_ns, &tracks), "tracks");
  for (int32_t i = 0; i < tracks.count; ++i)
    if (tracks.detection[i] >= 0 && std::size_t(tracks.detection[i]) < count)
      track_[std::size_t(tracks.detection[i])] = tracks.id[i];
  out_.detections.track = track_.data();
  out_.tracks = reader_;
  return out_;
}

}  // namespace overtake::evaluation
