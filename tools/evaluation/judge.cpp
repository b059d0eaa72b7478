// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/evaluation/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "tools/metrics/consistency.h"
#include "tools/session.h"
#include "tools/sim/material.h"

namespace overtake::evaluation {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Rows are the axes of the vehicle in the map (roll, then pitch, then yaw).
std::array<std::array<double, 3>, 3> axes_of(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll), sr = std::sin(roll), cp = std::cos(pitch), sp = std::sin(pitch), cy = std::cos(yaw),
               sy = std::sin(yaw);
  return {{{cy * cp, sy * cp, -sp},
           {cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr},
           {cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr}}};
}

const CarTruth* ego_of(const std::vector<CarTruth>& cars) {
  for (const CarTruth& c : cars)
    if (c.is_ego) return &c;
  return nullptr;
}

}  // namespace

Kind kind_of(uint16_t surface) {
  using sim::Surface;
  if (surface >= uint16_t(Surface::car)) return Kind::kCar;
  switch (Surface(surface)) {
    case Surface::road:
    case Surface::apron_grass:
      return Kind::kGround;
    case Surface::none:
    case Surface::smoke_dust:
    case Surface::blooming:
      return Kind::kNoise;
    default:
      return Kind::kObstacle;
  }
}

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
  t["innovations"] = Table({"frame", "car", "nis"});
  t["grid"] = Table({"frame", "tp", "fp", "fn", "tn"});
  t["euclid"] = Table({"frame", "radius_m", "car", "clusters"});
  t["times"] = Table({"frame", "sensor", "stage", "ns"});
  return t;
}

void write_tables(const std::string& folder, const Tables& tables) {
  for (const auto& [name, table] : tables) write_table(folder + "/" + name + ".csv", table);
}

Tables read_tables(const std::string& folder) {
  Tables tables = make_tables();
  for (auto& [name, table] : tables) {
    const std::string path = folder + "/" + name + ".csv";
    if (std::filesystem::exists(path)) table = read_table(path);
  }
  return tables;
}

Seen see(const CarTruth& from, double x_m, double y_m, double z_m) {
  const auto axes = axes_of(from.roll_rad, from.pitch_rad, from.heading_rad);
  const double d[3] = {x_m - from.x_m, y_m - from.y_m, z_m - from.z_m};
  const auto along = [&](const std::array<double, 3>& axis) {
    return d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
  };
  return {along(axes[0]), along(axes[1])};
}

int32_t nearest_car(const std::vector<CarTruth>& cars, double x_m, double y_m) {
  int32_t best = -1;
  double best_m = kGateM;
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const double d = std::hypot(cars[i].x_m - x_m, cars[i].y_m - y_m);
    if (!cars[i].is_ego && d <= best_m) best = int32_t(i), best_m = d;
  }
  return best;
}

Judge::Judge(const SimulatedLog& log, const ovt_params& params, int64_t truth_shift_ns)
    : log_(log),
      truth_shift_ns_(truth_shift_ns),
      r_x_(params.tracker_r_x),
      r_y_(params.tracker_r_y),
      tables_(make_tables()) {}

void Judge::add(ovt_reader* reader) {
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;
  cli::check(ovt_read_info(reader, &info), "frame");
  if (info.sensor_mask == 0) return;  // a prediction over a gap
  if (!frame_) throw std::runtime_error("a frame came that nobody pushed");
  cli::check(ovt_read_detections(reader, &detections), "detections");
  if (first_ns_ < 0) first_ns_ = info.first_stamp_ns;
  frame_number_ = double(frame_->scans.frame);
  const int64_t publish_ns = info.first_stamp_ns + log_.rig().period_ns();
  time_s_ = double(publish_ns - first_ns_) * 1e-9;
  points_.clear(), clusters_.clear(), boxed_.clear(), detected_.clear(), tentative_.clear(), confirmed_.clear();
  const std::vector<CarTruth> cars = cars_at(publish_ns);
  const CarTruth* ego = ego_of(cars);
  if (!ego) return;  // past the end of the truth
  add_labels(reader, info, cars);
  add_detections(info, detections);
  cli::check(ovt_read_tracks(reader, publish_ns, &tracks), "tracks");
  add_tracks(info, tracks, cars);
  add_times(reader);
  for (const CarTruth& c : cars) {
    if (c.is_ego) continue;
    const Seen seen = see(*ego, c.x_m, c.y_m, c.z_m);
    tables_["cars"].add({frame_number_, time_s_, double(c.car), seen.ahead_m, seen.left_m, c.x_m, c.y_m,
                         double(points_[c.car]), double(clusters_[c.car]), double(boxed_[c.car]),
                         double(detected_[c.car]), double(tentative_[c.car]), double(confirmed_[c.car])});
  }
}

void Judge::add_labels(ovt_reader* reader, const ovt_frame_info& info, const std::vector<CarTruth>& cars) {
  struct Content {
    std::set<int32_t> cars;
    bool other = false;
  };
  std::map<int32_t, Content> of_cluster;
  std::map<int32_t, std::set<std::pair<int32_t, int32_t>>> of_car;  // clusters, and labels that fit none
  CloudPoints cloud;
  const bool baselines = baselines_every_ > 0 && frame_->scans.frame % baselines_every_ == 0;
  for (std::size_t k = 0; k < frame_->scans.scans.size(); ++k) {
    const int32_t sensor = frame_->scans.scans[k].sensor;
    if (!(info.sensor_mask >> sensor & 1)) continue;
    ovt_labels labels;
    cli::check(ovt_read_labels(reader, sensor, &labels), "labels");
    const std::vector<uint16_t>& surface = frame_->surface[k];
    if (labels.count == 0) continue;  // the library has no scan of this sensor
    if (std::size_t(labels.count) != surface.size()) throw std::runtime_error("labels and truth differ in length");
    const io::RigSensor& mount = log_.rig().sensors[std::size_t(sensor)];
    constexpr double kRadian = M_PI / 180;
    const auto turned = axes_of(mount.roll_deg * kRadian, mount.pitch_deg * kRadian, mount.yaw_deg * kRadian);
    double tp = 0, fp = 0, fn = 0, tn = 0, none = 0;
    std::map<std::pair<int32_t, int32_t>, std::pair<double, double>> found;  // (car, 10 m) -> points, found
    for (int32_t i = 0; i < labels.count; ++i) {
      const Kind kind = kind_of(surface[std::size_t(i)]);
      const int32_t label = labels.label[i];
      const bool positive = kind == Kind::kCar || kind == Kind::kObstacle;
      const int32_t car = kind == Kind::kCar ? surface[std::size_t(i)] - int32_t(sim::Surface::car) : -1;
      if (car >= 0) ++points_[car];
      if (label < 0) {
        ++none;
        continue;
      }
      (label > 0 ? (positive ? tp : fp) : (positive ? fn : tn)) += 1;
      if (baselines) {
        const double p[3] = {double(labels.x_m[i]), double(labels.y_m[i]), double(labels.z_m[i])};
        double v[3] = {mount.x_m, mount.y_m, mount.z_m};
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t b = 0; b < 3; ++b) v[b] += turned[a][b] * p[a];
        cloud.x_m.push_back(float(v[0])), cloud.y_m.push_back(float(v[1])), cloud.z_m.push_back(float(v[2]));
        cloud.surface.push_back(surface[std::size_t(i)]), cloud.found.push_back(label > 0);
      }
      if (car >= 0) {
        const float x = labels.x_m[i], y = labels.y_m[i], z = labels.z_m[i];
        auto& [points, hits] = found[{car, int32_t(std::sqrt(x * x + y * y + z * z) / 10)}];
        points += 1, hits += label > 0;
      }
      if (label <= 0) continue;
      const int32_t cluster = labels.cluster_of_label[label];
      if (car >= 0) of_car[car].insert(cluster >= 0 ? std::pair(-1, cluster) : std::pair(sensor, label));
      if (cluster < 0) continue;
      if (car >= 0)
        of_cluster[cluster].cars.insert(car);
      else if (kind == Kind::kObstacle)
        of_cluster[cluster].other = true;
    }
    tables_["scans"].add({frame_number_, double(sensor), tp, fp, fn, tn, none});
    for (const auto& [where, count] : found)
      tables_["car_points"].add(
          {frame_number_, double(sensor), double(where.first), 10.0 * where.second, count.first, count.second});
  }
  mixed_other_ = mixed_cars_ = 0;
  for (const auto& [cluster, content] : of_cluster) {
    mixed_other_ += !content.cars.empty() && content.other;
    mixed_cars_ += content.cars.size() > 1;
  }
  for (const CarTruth& c : cars) clusters_[c.car] = int64_t(of_car[c.car].size());
  ovt_clusters clusters;
  cli::check(ovt_read_clusters(reader, &clusters), "clusters");
  tables_["clusters"].add({frame_number_, double(clusters.count), double(mixed_other_), double(mixed_cars_)});
  add_boxed(clusters, cars);
  if (baselines) add_baselines(cloud);
}

// As published up to now: between two poses linear, behind the last one driven on.
io::EgoRow Judge::published_pose(int64_t stamp_ns) const {
  const auto& poses = log_.poses();
  const auto above = std::lower_bound(poses.begin(), poses.end(), stamp_ns,
                                      [](const PublishedPose& p, int64_t t) { return p.row.stamp_ns < t; });
  if (poses.empty()) return {};
  if (above == poses.end() || above == poses.begin()) {
    io::EgoRow row = above == poses.end() ? poses.back().row : poses.front().row;
    const double dt = double(stamp_ns - row.stamp_ns) * 1e-9;
    row.x_m += row.speed_mps * dt * std::cos(row.yaw_rad), row.y_m += row.speed_mps * dt * std::sin(row.yaw_rad);
    row.yaw_rad += row.yaw_rate_rps * dt;
    return row;
  }
  const io::EgoRow &a = (above - 1)->row, &b = above->row;
  const double w = double(stamp_ns - a.stamp_ns) / double(b.stamp_ns - a.stamp_ns);
  io::EgoRow row = a;
  row.x_m += w * (b.x_m - a.x_m), row.y_m += w * (b.y_m - a.y_m), row.z_m += w * (b.z_m - a.z_m);
  row.roll_rad += w * wrap_angle(b.roll_rad - a.roll_rad), row.pitch_rad += w * wrap_angle(b.pitch_rad - a.pitch_rad);
  row.yaw_rad += w * wrap_angle(b.yaw_rad - a.yaw_rad);
  return row;
}

void Judge::add_detections(const ovt_frame_info& info, const ovt_detections& d) {
  for (int32_t i = 0; i < d.count; ++i) {
    const io::EgoRow pose = published_pose(d.stamp_ns[i]);
    const auto axes = axes_of(pose.roll_rad, pose.pitch_rad, pose.yaw_rad);
    const double in[3] = {d.x_m[i], d.y_m[i], d.z_m[i]};
    double x = pose.x_m, y = pose.y_m;
    for (std::size_t k = 0; k < 3; ++k) x += axes[k][0] * in[k], y += axes[k][1] * in[k];
    const double ch = std::cos(double(d.heading_rad[i])), sh = std::sin(double(d.heading_rad[i]));
    const double heading = std::atan2(axes[0][1] * ch + axes[1][1] * sh, axes[0][0] * ch + axes[1][0] * sh);
    const std::vector<CarTruth> cars = cars_at(d.stamp_ns[i]);
    const int32_t c = info.ego_known ? nearest_car(cars, x, y) : -1;
    const CarTruth* ego = ego_of(cars);
    double ex = kNan, ey = kNan, along = kNan, across = kNan, turn = kNan;
    if (c >= 0 && ego) {
      const CarTruth& car = cars[std::size_t(c)];
      ex = x - car.x_m, ey = y - car.y_m, turn = wrap_angle(heading - car.heading_rad);
      const double ce = std::cos(ego->heading_rad), se = std::sin(ego->heading_rad);
      along = ce * ex + se * ey, across = ce * ey - se * ex;
      ++detected_[car.car];
    }
    tables_["detections"].add({frame_number_, c < 0 ? -1.0 : double(cars[std::size_t(c)].car), double(d.x_m[i]),
                               double(d.y_m[i]), double(d.point_count[i]), double(d.heading_source[i]), ex, ey, along,
                               across, turn});
    const auto prior = prior_.find(d.track[i]);
    if (prior == prior_.end()) continue;
    const Prior& p = prior->second;
    const double dt = double(d.stamp_ns[i] - p.stamp_ns) * 1e-9;
    const double innovation[2] = {x - p.x_m - p.speed_mps * dt * std::cos(p.course_rad),
                                  y - p.y_m - p.speed_mps * dt * std::sin(p.course_rad)};
    const double s[3] = {p.xx + r_x_, p.xy, p.yy + r_y_};
    tables_["innovations"].add(
        {frame_number_, c < 0 ? -1.0 : double(cars[std::size_t(c)].car), metrics::normalized_square(innovation, s, 2)});
  }
}

void Judge::add_tracks(const ovt_frame_info& info, const ovt_tracks& t, const std::vector<CarTruth>& cars) {
  prior_.clear();
  if (info.reference != OVT_REFERENCE_MAP) return;  // without ego: nothing to compare with
  const CarTruth& ego = *ego_of(cars);
  const double ce = std::cos(ego.heading_rad), se = std::sin(ego.heading_rad);
  for (int32_t i = 0; i < t.count; ++i) {
    const int32_t c = nearest_car(cars, t.x_m[i], t.y_m[i]);
    const bool confirmed = t.state[i] == OVT_CONFIRMED;
    double e[5] = {kNan, kNan, kNan, kNan, kNan}, along = kNan, across = kNan, heading = kNan, nees = kNan;
    if (c >= 0) {
      const CarTruth& car = cars[std::size_t(c)];
      e[0] = t.x_m[i] - car.x_m, e[1] = t.y_m[i] - car.y_m, e[2] = t.speed_mps[i] - car.speed_mps;
      e[3] = wrap_angle(t.course_rad[i] - car.course_rad), e[4] = t.yaw_rate_rps[i] - car.yaw_rate_rps;
      heading = wrap_angle(t.heading_rad[i] - car.heading_rad);
      along = ce * e[0] + se * e[1], across = ce * e[1] - se * e[0];
      double covariance[15];
      for (int32_t k = 0; k < 15; ++k) covariance[k] = t.covariance[k][i];
      nees = metrics::normalized_square(e, covariance, 5);
      ++(confirmed ? confirmed_ : tentative_)[car.car];
    }
    const Seen seen = see(ego, t.x_m[i], t.y_m[i], ego.z_m);
    tables_["tracks"].add({frame_number_, time_s_, double(t.id[i]), double(confirmed),
                           c < 0 ? -1.0 : double(cars[std::size_t(c)].car), seen.ahead_m, t.x_m[i], t.y_m[i], e[0],
                           e[1], along, across, e[2], heading, e[3], e[4], nees,
                           double(t.publish_ns - t.measured_ns[i]) * 1e-9});
    prior_[t.id[i]] = {t.x_m[i],           t.y_m[i],           t.speed_mps[i],     t.course_rad[i],
                       t.covariance[0][i], t.covariance[1][i], t.covariance[2][i], t.publish_ns};
  }
}

void Judge::add_times(ovt_reader* reader) {
  for (int32_t sensor = -1; sensor < int32_t(log_.rig().sensors.size()); ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      ovt_span span;
      if (ovt_read_span(reader, sensor, ovt_stage(stage), &span) != OVT_OK || span.duration_ns < 0) continue;
      tables_["times"].add({frame_number_, double(sensor), double(stage), double(span.duration_ns)});
    }
}

}  // namespace overtake::evaluation
