// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/evaluator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <set>
#include <stdexcept>

#include "tools/client/session.h"
#include "tools/evaluation/detection_columns.h"
#include "tools/evaluation/metrics/consistency.h"
#include "tools/evaluation/numbers.h"
#include "tools/io/error.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {

Kind kind_of(uint16_t surface) {
  using sim::Surface;
  if (surface >= uint16_t(Surface::car)) return Kind::kCar;
  switch (Surface(surface)) {
    case Surface::road:
    case Surface::apron_grass: return Kind::kGround;
    case Surface::none:
    case Surface::smoke_dust:
    case Surface::rain:
    case Surface::blooming:
    case Surface::own_car: return Kind::kNoise;
    default: return Kind::kObstacle;
  }
}

int32_t car_of(uint16_t surface) { return kind_of(surface) == Kind::kCar ? surface - int32_t(sim::Surface::car) : -1; }

Tables make_tables() {
  Tables t;
  t["scans"] = Table({"frame", "sensor", "tp", "fp", "fn", "tn", "unlabelled"});
  t["car_points"] = Table({"frame", "sensor", "car", "range_m", "points", "found"});
  t["cars"] = Table({"frame", "time_s", "car", "ahead_m", "left_m", "x_m", "y_m", "points", "clusters", "boxed",
                     "detections", "tentative", "confirmed"});
  t["clusters"] = Table({"frame", "clusters", "mixed_other", "mixed_cars"});
  t["detections"] = Table({"frame", "car", "ahead_m", "left_m", "points", "heading_source", "x_map_m", "y_map_m",
                           "x_veh_m", "y_veh_m", "heading_rad"});
  t["tracks"] =
      Table({"frame", "time_s", "id", "confirmed", "car", "ahead_m", "x_m", "y_m", "x_map_m", "y_map_m", "x_veh_m",
             "y_veh_m", "speed_mps", "heading_rad", "course_rad", "yaw_rate_rps", "nees", "age_s"});
  t["parked_tracks"] = Table({"frame", "id", "confirmed"});
  t["existence"] = Table({"frame", "time_s", "id", "existence", "confirmed", "car"});
  t["motion"] = Table({"frame", "car", "speed_mps", "accel_mps2", "yaw_rate_rps", "slip_rad"});
  t["paths"] = Table({"frame", "car", "horizon_s", "along_m", "across_m", "square", "speed_change_mps",
                      "offset_change_m", "steady_square"});
  t["centres"] = Table({"frame", "car", "along_m", "across_m", "square"});
  t["false_detections"] =
      Table({"frame", "ahead_m", "left_m", "range_m", "points", "surface", "map_s_m", "map_d_m", "bank_deg"});
  t["ego_heading"] = Table({"frame", "published_rad", "corrected_rad"});
  t["debris"] = Table({"frame", "points", "detections"});
  t["innovations"] = Table({"frame", "car", "nis"});
  t["innovations_own"] = Table({"frame", "car", "nis"});
  t["boxes"] = Table({"frame", "mixed_by_size"});
  t["seams"] = Table({"frame", "car", "sensors", "joined"});
  t["ego"] = Table({"frame", "time_s", "speed_mps", "yaw_rate_rps"});
  for (const char* name : {"grid", "auto_label", "scans_auto", "grid_auto"})
    t[name] = Table({"frame", "sensor", "tp", "fp", "fn", "tn"});
  t["euclid"] = Table({"frame", "radius_m", "car", "clusters", "boxed"});
  t["euclid_mixed"] = Table({"frame", "radius_m", "mixed_other", "mixed_cars", "mixed_by_size"});
  t["times"] = Table({"frame", "sensor", "stage", "ns"});
  t["cuts"] = Table({"frame", "id", "x_m", "y_m"});
  return t;
}

void write_tables(const std::string& folder, const Tables& tables) {
  for (const auto& [name, table] : tables) write_table(folder + "/" + name + ".csv", table);
}

Tables read_tables(const std::string& folder) {
  Tables tables = make_tables();
  for (auto& [name, table] : tables) {
    const std::string path = folder + "/" + name + ".csv";
    if (!std::filesystem::exists(path))
      throw io::Error(path, 0, "no such file: the run is incomplete, or of a build without this table");
    Table found = read_table(path);
    for (const std::string& column : table.columns)
      if (std::find(found.columns.begin(), found.columns.end(), column) == found.columns.end())
        throw io::Error(path, 1, "has no column '" + column + "'");
    table = std::move(found);
  }
  return tables;
}

Evaluator::Evaluator(const TruthLog& log, const ovt_params& params, int64_t truth_shift_ns)
    : log_(log),
      truth_shift_ns_(truth_shift_ns),
      r_x_(params.tracker_r_x),
      r_y_(params.tracker_r_y),
      tables_(make_tables()) {}

void Evaluator::add(ovt_reader* reader, const Replayed* relayed) {
  ovt_frame_info info;
  cli::check(ovt_read_info(reader, &info), "frame");
  if (info.sensor_mask == 0) return;  // a prediction over a gap
  if (!frame_) throw std::runtime_error("received a frame that was not pushed");
  if (first_ns_ < 0) first_ns_ = info.first_stamp_ns;
  last_frame_ = frame_->scans.frame, last_tracks_.clear();
  if (frame_->scans.frame % compare_every_ != 0) {
    skip(info, relayed ? relayed->tracks : reader);
    return;
  }
  frame_number_ = double(frame_->scans.frame);
  const int64_t publish_ns = info.first_stamp_ns + log_.rig().period_ns();
  time_s_ = double(publish_ns - first_ns_) * 1e-9;
  points_.clear(), clusters_.clear(), surfaces_.clear(), debris_points_ = 0, debris_found_ = 0, boxed_.clear(),
                                                         detected_.clear(), tentative_.clear(), confirmed_.clear();
  const std::vector<CarTruth> cars = cars_at(publish_ns);
  const CarTruth* ego = ego_of(cars);
  if (!ego) return;  // after the end of the truth
  tables_["ego"].add({frame_number_, time_s_, ego->speed_mps, ego->yaw_rate_rps});
  add_motion(publish_ns, cars);
  paths_.advance(
      publish_ns, [&](int64_t stamp_ns) { return cars_at(stamp_ns); }, tables_["paths"]);
  add_ego_heading(info);
  add_labels(reader, info);
  ovt_detections detections;
  cli::check(ovt_read_detections(reader, &detections), "detections");
  if (relayed) detections = relayed->detections;
  add_detections(info, detections);
  ovt_tracks tracks{};
  if (ovt_reader* const of_tracks = relayed ? relayed->tracks : reader)
    cli::check(ovt_read_tracks(of_tracks, publish_ns, &tracks), "tracks");
  add_tracks(info, tracks, detections, cars);
  if (with_times_) add_times(reader);
  if (debris_points_ > 0) tables_["debris"].add({frame_number_, double(debris_points_), double(debris_found_)});
  const auto by_truth = [&](double count) { return frame_->surface.empty() ? kNan : count; };
  for (const CarTruth& c : cars) {
    if (c.is_ego) continue;
    const Seen seen = see(*ego, c.x_m, c.y_m, c.z_m);
    tables_["cars"].add({frame_number_, time_s_, double(c.car), seen.ahead_m, seen.left_m, c.x_m, c.y_m,
                         by_truth(double(points_[c.car])), by_truth(double(clusters_[c.car])), double(boxed_[c.car]),
                         double(detected_[c.car]), double(tentative_[c.car]), double(confirmed_[c.car])});
  }
}

// A frame that is not compared: only the innovations of the next one need its tracks.
void Evaluator::skip(const ovt_frame_info& info, ovt_reader* reader) {
  ovt_tracks tracks{};
  if (reader) cli::check(ovt_read_tracks(reader, info.first_stamp_ns + log_.rig().period_ns(), &tracks), "tracks");
  prior_.clear();
  if (info.reference == OVT_REFERENCE_MAP) return remember_tracks(info, tracks);
  const std::vector<CarTruth> cars = cars_at(tracks.publish_ns);
  if (ego_of(cars)) remember_tracks(info, tracks_in_map_.take(tracks, cars));
}

// The positions of the cars for the points of a frame: those at its middle, so that a point is off by at most the cars'
// motion relative to the ego in half a frame.
void Evaluator::add_labels(ovt_reader* reader, const ovt_frame_info& info) {
  const std::vector<CarTruth> cars = cars_at(info.first_stamp_ns + log_.rig().period_ns() / 2);
  const CarTruth* const ego = ego_of(cars);
  const std::vector<CarPlace> places = place_cars(cars);
  ClusterTally tally(places);
  SeamTally seams;
  is_due_ = baselines_every_ > 0 && frame_->scans.frame % baselines_every_ == 0;
  due_ = CloudPoints();
  due_.cars = places;
  for (std::size_t k = 0; k < frame_->scans.scans.size(); ++k) {
    const int32_t sensor = frame_->scans.scans[k].sensor;
    if (!(info.sensor_mask >> sensor & 1)) continue;
    ovt_labels labels;
    cli::check(ovt_read_labels(reader, sensor, &labels), "labels");
    if (labels.count > 0)  // else the library has no scan of this sensor
      add_scan(labels, sensor, k < frame_->surface.size() ? &frame_->surface[k] : nullptr, ego ? ego->car : -1, tally,
               seams);
  }
  for (const auto& [car, count] : tally.of_car()) clusters_[car] = count.clusters, boxed_[car] = count.inside;
  const ClusterTally::Mixed mixed = tally.mixed();
  ovt_clusters clusters;
  cli::check(ovt_read_clusters(reader, &clusters), "clusters");
  const bool known = !frame_->surface.empty();
  tables_["clusters"].add(
      {frame_number_, double(clusters.count), known ? double(mixed.other) : kNan, known ? double(mixed.cars) : kNan});
  tables_["boxes"].add({frame_number_, double(mixed.by_size)});
  for (const SeamTally::Car& c : seams.over_seams())
    tables_["seams"].add({frame_number_, double(c.car), double(c.sensors), c.joined ? 1.0 : 0.0});
}

void Evaluator::add_scan(const ovt_labels& labels, int32_t sensor, const std::vector<uint16_t>* surfaces, int32_t own,
                         ClusterTally& tally, SeamTally& seams) {
  if (surfaces && std::size_t(labels.count) != surfaces->size())
    throw std::runtime_error("labels and truth differ in length");
  const io::Mounting mounting(log_.rig().sensors[std::size_t(sensor)]);
  double tp = 0, fp = 0, fn = 0, tn = 0, none = 0;
  std::map<std::pair<int32_t, int32_t>, std::pair<double, double>> found;  // (car, 10 m) -> points, found
  for (int32_t i = 0; i < labels.count; ++i) {
    const uint16_t surface = surfaces ? (*surfaces)[std::size_t(i)] : uint16_t(0);
    const Kind kind = surfaces ? kind_of(surface) : Kind::kGround;
    const int32_t label = labels.label[i], car = surfaces ? car_of(surface) : -1;
    if (car >= 0) ++points_[car];
    debris_points_ += surface == uint16_t(sim::Surface::debris);
    if (label < 0) {
      ++none;
      continue;
    }
    (label > 0 ? (is_positive(kind) ? tp : fp) : (is_positive(kind) ? fn : tn)) += 1;
    const float x = labels.x_m[i], y = labels.y_m[i], z = labels.z_m[i];
    if (car >= 0) {
      auto& [points, hits] = found[{car, int32_t(std::sqrt(x * x + y * y + z * z) / 10)}];
      points += 1, hits += label > 0;
    }
    if (label == 0 && !is_due_) continue;
    const std::array<double, 3> at = mounting.to_vehicle(x, y, z);
    if (is_due_) {
      due_.x_m.push_back(float(at[0])), due_.y_m.push_back(float(at[1])), due_.z_m.push_back(float(at[2]));
      due_.found.push_back(label > 0), due_.sensor.push_back(sensor);
      if (surfaces) due_.surface.push_back(surface);
    }
    if (label == 0) continue;
    const int32_t row = labels.cluster_of_label[label];  // -1: the table was full; it still counts
    const int64_t cluster = row >= 0 ? row : -1 - (int64_t(sensor) << 32 | label);
    tally.add(cluster, at, kind, car);
    if (surfaces)
      ++surfaces_[cluster][car < 0 ? surface : uint16_t(car == own ? sim::Surface::own_car : sim::Surface::car)];
    if (car >= 0) seams.add(car, sensor, cluster);
  }
  if (surfaces) tables_["scans"].add({frame_number_, double(sensor), tp, fp, fn, tn, none});
  for (const auto& [where, count] : found)
    tables_["car_points"].add(
        {frame_number_, double(sensor), double(where.first), 10.0 * where.second, count.first, count.second});
}

void Evaluator::add_ego_heading(const ovt_frame_info& info) {
  const std::vector<CarTruth> cars = cars_at(info.stamp_ns);
  const CarTruth* const ego = ego_of(cars);
  if (!ego || !info.ego_known) return;
  const io::EgoRow pose = pose_at(poses(), info.stamp_ns);
  tables_["ego_heading"].add({frame_number_, wrap_angle(pose.yaw_rad - ego->heading_rad),
                              wrap_angle(corrected(pose, info).yaw_rad - ego->heading_rad)});
}

// The surface of most points of a cluster, the first one of equals; -1 unknown.
int32_t Evaluator::main_surface(int32_t cluster) const {
  const auto found = surfaces_.find(cluster);
  int32_t best = -1;
  int64_t most = 0;
  if (found == surfaces_.end()) return -1;
  for (const auto& [surface, points] : found->second)
    if (points > most) most = points, best = surface;
  return best;
}

void Evaluator::add_false_detection(const ovt_detections& d, int32_t i, const CarTruth* ego) {
  const bool on_map = d.map_s_m && d.map_d_m && (d.map_s_m[i] != 0 || d.map_d_m[i] != 0);
  tables_["false_detections"].add({frame_number_, double(d.x_m[i]), double(d.y_m[i]),
                                   std::hypot(double(d.x_m[i]), double(d.y_m[i])), double(d.point_count[i]),
                                   double(d.cluster ? main_surface(d.cluster[i]) : -1),
                                   on_map ? double(d.map_s_m[i]) : kNan, on_map ? double(d.map_d_m[i]) : kNan,
                                   ego ? io::deg(ego->roll_rad) : kNan});
}

void Evaluator::add_detections(const ovt_frame_info& info, const ovt_detections& d) {
  for (int32_t i = 0; i < d.count; ++i) {
    const std::vector<CarTruth> cars = cars_at(d.stamp_ns[i]);
    const CarTruth* ego = ego_of(cars);
    const bool has_pose = info.ego_known || poses_;  // else the true one
    const MapPlace at =
        has_pose || !ego ? place_in_map(poses(), info, d, i) : place_in_map(true_pose(*ego, d.stamp_ns[i]), d, i);
    const double x = at.x_m, y = at.y_m, heading = at.heading_rad;
    const int32_t c = (has_pose || ego) && !is_debris(d, i) ? nearest_car(cars, x, y) : -1;
    if (is_debris(d, i)) {  // neither finds a car nor is false where debris or a car is
      const int32_t surface = d.cluster ? main_surface(d.cluster[i]) : -1;
      debris_found_ += surface == int32_t(sim::Surface::debris);
      if (surface == int32_t(sim::Surface::debris) || surface == int32_t(sim::Surface::car)) continue;
    }
    if (c < 0 && d.cluster && is_on_obstacle(d, i, main_surface(d.cluster[i]))) continue;
    double ex = kNan, ey = kNan, along = kNan, across = kNan, turn = kNan;
    if (c >= 0 && ego) {
      const CarTruth& car = cars[std::size_t(c)];
      ex = x - car.x_m, ey = y - car.y_m, turn = wrap_angle(heading - car.heading_rad);
      const double ce = std::cos(ego->heading_rad), se = std::sin(ego->heading_rad);
      along = ce * ex + se * ey, across = ce * ey - se * ex;
      ++detected_[car.car];
      const double cc = std::cos(car.heading_rad), sc = std::sin(car.heading_rad);
      const io::Rotation axes = io::axes_of(ego->roll_rad, ego->pitch_rad, ego->heading_rad);
      tables_["centres"].add(
          {frame_number_, double(car.car), cc * ex + sc * ey, cc * ey - sc * ex, square_of(d, i, axes, ex, ey)});
    }
    if (c < 0) add_false_detection(d, i, ego);
    tables_["detections"].add({frame_number_, c < 0 ? -1.0 : double(cars[std::size_t(c)].car), double(d.x_m[i]),
                               double(d.y_m[i]), double(d.point_count[i]), double(d.heading_source[i]), ex, ey, along,
                               across, turn});
    const auto prior = prior_.find(d.track[i]);
    if (prior == prior_.end() || !has_pose) continue;
    const Prior& p = prior->second;
    const double dt = double(d.stamp_ns[i] - p.stamp_ns) * 1e-9;
    const double innovation[2] = {x - p.x_m - p.speed_mps * dt * std::cos(p.course_rad),
                                  y - p.y_m - p.speed_mps * dt * std::sin(p.course_rad)};
    const double s[3] = {p.xx + r_x_, p.xy, p.yy + r_y_};
    tables_["innovations"].add(
        {frame_number_, c < 0 ? -1.0 : double(cars[std::size_t(c)].car), metrics::normalized_square(innovation, s, 2)});
    if (!d.var_x || !ego) continue;
    const auto r = covariance_in_map(d, i, io::axes_of(ego->roll_rad, ego->pitch_rad, ego->heading_rad));
    const double own[3] = {p.xx + r[0], p.xy + r[1], p.yy + r[2]};
    tables_["innovations_own"].add({frame_number_, c < 0 ? -1.0 : double(cars[std::size_t(c)].car),
                                    metrics::normalized_square(innovation, own, 2)});
  }
}

// Acceleration and rate of the course are means over a period with this time in its middle.
void Evaluator::add_motion(int64_t publish_ns, const std::vector<CarTruth>& cars) {
  const int64_t half = log_.rig().period_ns() / 2;
  const std::vector<CarTruth> before = cars_at(publish_ns - half), after = cars_at(publish_ns + half);
  for (const CarTruth& c : cars) {
    if (c.is_ego) continue;
    course_rate_[c.car] = mean_course_rate(c.car, before, after, 2e-9 * double(half));
    tables_["motion"].add({frame_number_, double(c.car), c.speed_mps,
                           mean_acceleration(c.car, before, after, 2e-9 * double(half)), c.yaw_rate_rps,
                           wrap_angle(c.heading_rad - c.course_rad)});
  }
}

void Evaluator::add_tracks(const ovt_frame_info& info, const ovt_tracks& tracks, const ovt_detections& detections,
                           const std::vector<CarTruth>& cars) {
  prior_.clear();
  note_parked(
      tracks, detections, [this](int32_t cluster) { return main_surface(cluster); }, parked_);
  const bool in_map = info.reference == OVT_REFERENCE_MAP;  // else paths and covariance are not compared
  const ovt_tracks& t = in_map ? tracks : tracks_in_map_.take(tracks, cars);
  const CarTruth& ego = *ego_of(cars);
  const double ce = std::cos(ego.heading_rad), se = std::sin(ego.heading_rad);
  for (int32_t i = 0; i < t.count; ++i) {
    const int32_t c = nearest_car(cars, t.x_m[i], t.y_m[i]);
    const bool confirmed = t.state[i] == OVT_CONFIRMED;
    if (c < 0 && parked_.count(t.id[i])) {
      tables_["parked_tracks"].add({frame_number_, double(t.id[i]), double(confirmed)});
      continue;
    }
    std::array<double, 5> e = {kNan, kNan, kNan, kNan, kNan};
    double along = kNan, across = kNan, heading = kNan, nees = kNan;
    if (c >= 0) {
      const CarTruth& car = cars[std::size_t(c)];
      e = state_error(t, i, car, course_rate_[car.car]);
      heading = wrap_angle(t.heading_rad[i] - car.heading_rad);
      along = ce * e[0] + se * e[1], across = ce * e[1] - se * e[0];
      double covariance[15];
      for (int32_t k = 0; k < 15; ++k) covariance[k] = t.covariance[k][i];
      if (in_map) nees = metrics::normalized_square(e.data(), covariance, 5);
      ++(confirmed ? confirmed_ : tentative_)[car.car];
      if (confirmed && in_map) paths_.add(frame_number_, t, i, car);
    }
    if (t.existence)
      tables_["existence"].add({frame_number_, time_s_, double(t.id[i]), t.existence[i], double(confirmed),
                                c < 0 ? -1.0 : double(cars[std::size_t(c)].car)});
    const Seen seen = see(ego, t.x_m[i], t.y_m[i], ego.z_m);
    tables_["tracks"].add({frame_number_, time_s_, double(t.id[i]), double(confirmed),
                           c < 0 ? -1.0 : double(cars[std::size_t(c)].car), seen.ahead_m, t.x_m[i], t.y_m[i], e[0],
                           e[1], along, across, e[2], heading, e[3], e[4], nees,
                           double(t.publish_ns - t.measured_ns[i]) * 1e-9});
  }
  remember_tracks(info, t);
}

void Evaluator::remember_tracks(const ovt_frame_info& info, const ovt_tracks& t) {
  for (int32_t i = 0; i < t.count; ++i) last_tracks_.push_back({double(t.id[i]), t.x_m[i], t.y_m[i]});
  if (info.reference != OVT_REFERENCE_MAP) return;
  for (int32_t i = 0; i < t.count; ++i)
    prior_[t.id[i]] = {t.x_m[i],           t.y_m[i],           t.speed_mps[i],     t.course_rad[i],
                       t.covariance[0][i], t.covariance[1][i], t.covariance[2][i], t.publish_ns};
}

void Evaluator::note_cut() {
  for (const Place& p : last_tracks_) tables_["cuts"].add({double(last_frame_), p.id, p.x_m, p.y_m});
}

void Evaluator::begin_piece() {
  tables_ = make_tables();
  paths_.forget();
  note_cut();
}

void Evaluator::look_ahead(const LogFrame& frame) {
  if (frame.scans.frame % compare_every_ != 0) return;
  int64_t first_ns = INT64_MAX;
  for (const io::SensorScan& scan : frame.scans.scans) first_ns = std::min(first_ns, scan.stamp_ns);
  const int64_t publish_ns = first_ns + log_.rig().period_ns();
  if (!ego_of(cars_at(publish_ns))) return;  // after the end of the truth
  paths_.advance(
      publish_ns, [&](int64_t stamp_ns) { return cars_at(stamp_ns); }, tables_["paths"]);
}

const Tables& Evaluator::tables() {
  // In the order of the frames, as all others: a piece of a log has the same rows in another order.
  Table& paths = tables_["paths"];
  const std::size_t width = paths.columns.size();
  std::vector<std::size_t> order(paths.rows());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return paths.at(a, 0) < paths.at(b, 0); });
  std::vector<double> cells;
  cells.reserve(paths.cells.size());
  for (const std::size_t row : order)
    for (std::size_t c = 0; c < width; ++c) cells.push_back(paths.at(row, c));
  paths.cells = std::move(cells);
  return tables_;
}

void Evaluator::add_times(ovt_reader* reader) {
  for (int32_t sensor = -1; sensor < int32_t(log_.rig().sensors.size()); ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      ovt_span span;
      if (ovt_read_span(reader, sensor, ovt_stage(stage), &span) != OVT_OK || span.duration_ns < 0) continue;
      tables_["times"].add({frame_number_, double(sensor), double(stage), double(span.duration_ns)});
    }
}

}  // namespace overtake::evaluation
