// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor.h"

#include <algorithm>
#include <cmath>

#include "tools/client/circuit_file.h"
#include "tools/client/console.h"
#include "tools/client/map_direction.h"
#include "tools/io/angles.h"
#include "tools/io/bag_stream.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

using io::counted;

std::string percent(int64_t part, int64_t whole) {
  return fixed(100.0 * double(part) / double(std::max<int64_t>(1, whole)), 0) + " %";
}

double seconds(int64_t ns) { return double(ns) * 1e-9; }

double wrap_deg(double angle) { return std::remainder(angle, 360.0); }

std::size_t bin_of(double azimuth_deg) { return std::min<std::size_t>(359, std::size_t(azimuth_deg + 180)); }

// Whether the azimuth lies in the image, with a tolerance of 3 degrees.
bool in_view(double azimuth_deg, const io::RigSensor& sensor) {
  if (sensor.wraps) return true;
  const double middle = (sensor.azimuth_left_deg + sensor.azimuth_right_deg) / 2;
  const double half = (sensor.azimuth_left_deg - sensor.azimuth_right_deg) / 2;
  return std::fabs(wrap_deg(azimuth_deg - middle)) <= half + 3;
}

std::string frame_names(const std::set<std::string>& names) {
  std::vector<std::string> words;
  for (const std::string& name : names) words.push_back("'" + name + "'");
  return io::join(words, ", ");
}

constexpr std::size_t kKept = 1'000'000;  // poses of an hour or more

// "; then: ...; ...; and 3 more" of `count` errors; "" for none.
std::string format_more(const std::vector<std::string>& errors, int64_t count) {
  if (errors.empty()) return "";
  const int64_t left_out = count - int64_t(errors.size());
  return "; then: " + io::join(errors, "; ") + (left_out > 0 ? "; and " + std::to_string(left_out) + " more" : "");
}

}  // namespace

Doctor::Doctor(const io::Rig& rig) : rig_(rig), sensors_(rig.sensors.size()), walls_(rig.sensors.size()) {}

void Doctor::add_error(int32_t sensor, const std::string& sentence) {
  Sensor& s = sensors_[std::size_t(sensor)];
  constexpr std::size_t kListed = 10;
  ++s.scans;
  s.lost = true;
  if (s.errors++ == 0)
    s.first_error = sentence;
  else if (s.more_errors.size() + 1 < kListed)
    s.more_errors.push_back(sentence);
}

void Doctor::add_ego(const io::EgoRow& row) {
  if (ego_.poses++ > 0) ego_.add_step(row);
  if (ego_.rows.size() < kKept) ego_.rows.push_back(row);
  ego_.first_ns = std::min(ego_.first_ns, row.stamp_ns);
  ego_.last_ns = std::max(ego_.last_ns, row.stamp_ns);
  ego_.newest = row;
}

void Doctor::Ego::add_step(const io::EgoRow& row) {
  const int64_t step = row.stamp_ns - newest.stamp_ns;
  backward += step < 0;
  if (step <= 0 || step > 1'000'000'000) return;
  if (steps_ns.size() < kKept) steps_ns.push_back(step);
  const double dx = row.x_m - newest.x_m, dy = row.y_m - newest.y_m;
  const double speed = std::hypot(dx, dy) / seconds(step);
  if (speed < 5) return;
  ++moving;
  crooked += std::fabs(io::wrap_angle(std::atan2(dy, dx) - row.yaw_rad)) > 0.35;
  fast += std::fabs(speed - std::fabs(row.speed_mps)) > 0.2 * speed + 1;
}

void Doctor::add_scan(const io::SensorScan& scan) {
  Sensor& s = sensors_[std::size_t(scan.sensor)];
  if (s.scans == s.errors) {
    s.first_ns = scan.stamp_ns;
  } else {
    const int64_t step = int64_t(uint64_t(scan.stamp_ns) - uint64_t(s.last_ns));
    if (step < 0 && s.backward++ == 0) s.first_back_scan = s.scans, s.first_back_ns = -step;
    s.repeated += step == 0;
    if (step > 0 && !s.lost) s.steps_ns.push_back(step);  // a scan that could not be read came in between
    if (step > rig_.period_ns() * 3 / 2 && !s.lost) ++s.gaps, s.longest_gap_ns = std::max(s.longest_gap_ns, step);
  }
  s.lost = false;
  s.last_ns = scan.stamp_ns;
  ++s.scans;
  s.empty += scan.count == 0;
  s.most_points = std::max(s.most_points, scan.count);
  if (!scan.frame_id.empty()) s.frame_ids.insert(scan.frame_id);
  if (s.lines_how.empty()) s.lines_how = scan.lines_how;
  if (!scan.time_offset_ns.empty()) {
    const auto [low, high] = std::minmax_element(scan.time_offset_ns.begin(), scan.time_offset_ns.end());
    s.time_span_s = std::max(s.time_span_s, (double(*high) - double(*low)) * 1e-9);
  }
  if (s.scans > 20 && s.scans % 100 != 0) return;
  look_at_points(scan, rig_.sensors[std::size_t(scan.sensor)], s);
  s.shapes.add(scan);
  s.columns.add(scan);
  walls_[std::size_t(scan.sensor)].add(scan, rig_.sensors[std::size_t(scan.sensor)]);
}

void Doctor::look_at_points(const io::SensorScan& scan, const io::RigSensor& model, Sensor& s) const {
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    const double x = scan.x.value(i), y = scan.y.value(i), z = scan.z.value(i);
    const double range = std::sqrt(x * x + y * y + z * z);
    ++s.points;
    if (!(range > 0) || !std::isfinite(range)) {
      ++s.bad;
      continue;
    }
    const double azimuth = io::deg(std::atan2(y, x));
    s.outside += !in_view(azimuth, model);
    s.azimuth_low_deg = std::min(s.azimuth_low_deg, azimuth);
    s.azimuth_high_deg = std::max(s.azimuth_high_deg, azimuth);
    if (range >= model.range_min_m) s.seen[bin_of(azimuth)] = true;
    s.outside_if_vehicle += !in_view(io::deg(std::atan2(y - model.y_m, x - model.x_m)) - model.yaw_deg, model);
    s.far_points += range > model.range_max_m;
    s.near_points += range < model.range_min_m;
    if (i % 16 == 0) s.ranges_m.push_back(range);
    const double layer = scan.layer.value(i);
    if (layer != std::floor(layer)) {
      if (s.odd_layers++ == 0) s.odd_layer = layer;
    } else if (s.layers.size() < 5000 && layer >= 0 && layer < 65535) {
      s.layers.insert(int64_t(layer));
    }
  }
  if (const auto ground = fit_ground(scan, model)) s.grounds.push_back(*ground);
}

void Doctor::judge_presence(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  const std::string about = "sensor '" + model.name + "'";
  if (s.scans == 0)
    return out.push_back({true, about,
                          "there is no scan of it (looked for " + io::join(io::topics_of(model), ", ") + ", or FRAME_" +
                              model.name + ".pcd)",
                          "name its topic in the rig file (topics = [\"/...\"] in its [[sensor]]), or take it out of "
                          "the rig; overtake info lists the topics"});
  if (s.errors > 0)
    out.push_back(
        {true, about,
         std::to_string(s.errors) + " of " + counted(s.scans, "scan") + " cannot be read; the first: " + s.first_error +
             format_more(s.more_errors, s.errors - 1),
         s.first_error.find("no field gives the layer") != std::string::npos
             ? "record a ring field, or keep the order in which the points were taken; then lines are recovered"
             : "check the recording of these scans; the others can be used"});
  if (s.empty == s.scans)
    out.push_back({true, about,
                   s.scans == 1 ? "its scan is empty" : "all " + std::to_string(s.scans) + " scans are empty",
                   "check the sensor and its driver, and that this is the topic with its points"});
  else if (s.empty > 0)
    out.push_back(
        {false, about,
         std::to_string(s.empty) + " of " + counted(s.scans, "scan") + (s.empty == 1 ? " is empty" : " are empty"),
         ""});
  if (s.most_points > model.point_capacity)
    out.push_back(
        {true, about,
         "a scan has " + counted(s.most_points, "point") + ", the rig takes " + std::to_string(model.point_capacity),
         "set point_capacity = " + std::to_string(s.most_points + s.most_points / 4) + " in the rig file"});
  if (!model.frame_id.empty() && !s.frame_ids.empty() &&
      !(s.frame_ids.size() == 1 && s.frame_ids.contains(model.frame_id)))
    out.push_back({true, about,
                   "its clouds are in frame " + frame_names(s.frame_ids) + ", the rig expects '" + model.frame_id + "'",
                   "if topics of two sensors are swapped, swap them in the rig; if the cloud was transformed, record "
                   "the sensor's own; else set frame_id in the rig file"});
}

void Doctor::judge_points(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  const std::string about = "sensor '" + model.name + "'";
  const int64_t good = s.points - s.bad;
  if (s.points == 0) return;
  if (s.bad * 2 > s.points)
    out.push_back({true, about,
                   percent(s.bad, s.points) + " of its points are NaN, infinite or at the sensor's own place",
                   "check the driver's handling of beams without return; such points are dropped"});
  const double range = median(s.ranges_m);
  if (good > 0 && range > 1000)
    out.push_back({true, about,
                   "half of its points are more than " + fixed(range, 0) +
                       " m away: the unit looks like "
                       "millimetres",
                   "convert the coordinates to metres"});
  else if (good > 0 && s.far_points * 5 > good)
    out.push_back(
        {true, about,
         percent(s.far_points, good) + " of its points are beyond range_max_m = " + fixed(model.range_max_m, 0),
         "check the unit of the coordinates, or raise range_max_m in the rig file"});
  else if (good > 0 && s.near_points * 2 > good)
    out.push_back(
        {true, about,
         percent(s.near_points, good) + " of its points are nearer than range_min_m = " + fixed(model.range_min_m, 1),
         "check the unit of the coordinates (kilometres?), or lower range_min_m in the rig file"});
  if (good > 0 && s.outside * 5 > good) {
    const bool turned = s.outside_if_vehicle * 20 < good;
    out.push_back(
        {true, about,
         percent(s.outside, good) + " of its points lie outside of its field of view (" +
             fixed(model.azimuth_right_deg, 0) + " to " + fixed(model.azimuth_left_deg, 0) + " deg); seen are " +
             fixed(s.azimuth_low_deg, 0) + " to " + fixed(s.azimuth_high_deg, 0) + " deg" +
             (turned ? ", which fits the mounting: the cloud is in the vehicle frame, not the sensor's" : ""),
         turned ? "record the sensor's own cloud, or give a rig with cloud_frame = \"vehicle\""
                : "check the sensor's axes (x forward, y left) and azimuth_left_deg, azimuth_right_deg of the rig"});
  }
  if (s.odd_layers > 0)
    out.push_back(
        {true, about,
         "its ring values are not integers (" + (std::isnan(s.odd_layer) ? "nan" : fixed(s.odd_layer, 2)) + ")",
         "check which field is taken for the ring: overtake info shows the layout"});
  if (!s.lines_how.empty())
    out.push_back(
        {false, about, "its clouds have no ring field: " + s.lines_how,
         "check that the sensor has about that many (the rig's image has " + std::to_string(model.rows) + " rows)"});
  else if (int64_t(s.layers.size()) > model.rows)
    out.push_back({true, about,
                   "its clouds have " + std::to_string(s.layers.size()) + " lines, the rig's image " +
                       std::to_string(model.rows) + " rows",
                   "set rows = " + std::to_string(s.layers.size()) + " in the rig file"});
  else if (s.layers.size() > 1 && int64_t(s.layers.size()) * 5 <= model.rows * 3)
    out.push_back({true, about,
                   "its clouds have " + std::to_string(s.layers.size()) + " lines only, the rig's image " +
                       std::to_string(model.rows) + " rows: this is another sensor's rig",
                   "give the rig of this sensor, or set rows = " + std::to_string(s.layers.size()) +
                       " in the rig file: rows without points break what hangs together"});
  const auto seen = std::count(s.seen.begin(), s.seen.end(), true);
  if (model.wraps && good > 0 && seen <= 180)
    out.push_back({false, about,
                   "its points cover " + std::to_string(seen) + " deg; the rig says that it sees a full turn",
                   "fine where the recording was cut to one side; else give the rig of this sensor"});
}

// A part of the view in which no scan has a point.
void Doctor::judge_view(std::size_t i, std::vector<Finding>& out) const {
  constexpr int32_t kLeast_deg = 3;
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  const double width_deg = model.azimuth_left_deg - model.azimuth_right_deg;
  const auto seen = std::count(s.seen.begin(), s.seen.end(), true);
  if (width_deg > double(model.cols) || (model.wraps && seen <= 180) || s.outside * 5 > s.points) return;
  const auto is_seen = [&](int32_t from_left_deg) {
    return s.seen[bin_of(wrap_deg(model.azimuth_left_deg - from_left_deg - 0.5))];
  };
  std::string gaps;
  int32_t all_deg = 0;
  for (int32_t first = 0, end = 0; first < int32_t(width_deg); first = end + 1) {
    for (end = first; end < int32_t(width_deg) && !is_seen(end);) ++end;
    all_deg += end - first;
    if (end - first < kLeast_deg) continue;
    gaps += (gaps.empty() ? "" : ", ") + fixed(model.azimuth_left_deg - first, 0) + " to " +
            fixed(model.azimuth_left_deg - end, 0) + " deg";
  }
  if (gaps.empty() || 4 * all_deg > 3 * width_deg) return;
  out.push_back({false, "sensor '" + model.name + "'", "none of its points is seen from " + gaps + " (left positive)",
                 "look for dirt on its window; where the vehicle or the driver takes the view away, the frames say "
                 "view_blocked, and azimuth_left_deg, azimuth_right_deg of the rig may be narrower"});
}

void Doctor::judge_columns(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  const int32_t cols = s.columns.find_other_cols(model);
  if (cols == 0 || !s.lines_how.empty() || s.odd_layers > 0 || s.outside * 5 > s.points) return;
  const double step_deg = s.columns.median_deg(), wide_deg = column_deg(model);
  out.push_back({true, "sensor '" + model.name + "'",
                 "the points of a line are " + fixed(step_deg, 3) + " deg apart, the rig's columns " +
                     fixed(wide_deg, 3) + " deg: " +
                     (step_deg > wide_deg ? "most columns stay empty, and what hangs together falls apart"
                                          : "most points have no pixel of their own"),
                 "set cols = " + std::to_string(cols) + " in the rig file"});
}

bool Doctor::judge_lines(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  if (!model.wraps) return true;  // sensors of other rigs may have curved lines
  if (!s.lines_how.empty() || s.odd_layers > 0 || s.outside * 5 > s.points || s.shapes.one_sensor()) return true;
  const LineShapes::Spread spread = s.shapes.spread();
  std::string sentence = "along a line the elevation changes by " + fixed(spread.along_deg, 1) + " deg (lines are " +
                         fixed(spread.apart_deg, 1) + " deg apart): these are not the lines of one sensor at " +
                         (rig_.cloud_in_vehicle_frame ? "the place that the rig says" : "the cloud's origin");
  const auto sources = s.shapes.sources();
  for (const LineShapes::Source& source : sources) {
    const bool moved = rig_.cloud_in_vehicle_frame;  // the reader has subtracted the sensor's position from the points
    sentence += std::string(&source == sources.data() ? "; " : ", ") + "lines " + std::to_string(source.first_line) +
                " to " + std::to_string(source.last_line) +
                " are seen from x_m = " + fixed(source.x_m + (moved ? model.x_m : 0), 2) +
                " y_m = " + fixed(source.y_m + (moved ? model.y_m : 0), 2) +
                " z_m = " + fixed(source.z_m + (moved ? model.z_m : 0), 2);
  }
  out.push_back({true, "sensor '" + model.name + "'", sentence,
                 sources.size() == 2
                     ? "one cloud holds two sensors: give a rig with shared_cloud = true, cloud_frame = \"vehicle\" "
                       "and these places and lines (rig av2 is one)"
                 : sources.size() == 1 ? "record the sensor's own cloud, or give a rig with cloud_frame = \"vehicle\" "
                                         "and this place"
                                       : "give the rig of this sensor; overtake info shows the layout of the cloud"});
  return false;
}

void Doctor::judge_yaw(std::size_t i, std::size_t owner, std::vector<Finding>& out) const {
  const io::RigSensor &model = rig_.sensors[i], &other = rig_.sensors[owner];
  const auto share = [&](double yaw_deg) { return fixed(100 * walls_[i].share_along(yaw_deg), 0) + " %"; };
  out.push_back({true, "sensor '" + model.name + "'",
                 "it seems to be turned as the rig says of sensor '" + other.name +
                     "': of the upright surfaces that it "
                     "sees " +
                     share(model.yaw_deg) + " run along the vehicle by its own yaw_deg = " + fixed(model.yaw_deg, 1) +
                     ", " + share(other.yaw_deg) + " by yaw_deg = " + fixed(other.yaw_deg, 1),
                 "exchange the yaw of the two in the rig file, or their topics or files"});
}

void Doctor::judge_time(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const std::string about = "sensor '" + rig_.sensors[i].name + "'";
  if (s.backward > 0)
    out.push_back(
        {true, about,
         "its stamps go back " + counted(s.backward, "time") + ", first at scan " + std::to_string(s.first_back_scan) +
             " by " + fixed(seconds(s.first_back_ns), 3) + " s",
         "sort the recording by header stamp, or check the sensor's clock; late scans are used only within 0.5 s"});
  if (s.repeated > 0)
    out.push_back({true, about, counted(s.repeated, "scan") + " with the stamp of the scan before",
                   "each scan needs its own stamp; repeated ones are not used"});
  const int64_t step = median(s.steps_ns);
  if (step > 0 && std::fabs(seconds(step) / rig_.period_s - 1) > 0.2)
    out.push_back(
        {true, about,
         "its scans come every " + fixed(seconds(step), 4) + " s, the rig says " + fixed(rig_.period_s, 4) + " s",
         "set period_s = " + fixed(seconds(step), 4) + " in the rig file"});
  else if (s.gaps > 0)
    out.push_back({false, about,
                   counted(s.gaps, "gap") + " between scans, the longest " + fixed(seconds(s.longest_gap_ns), 2) + " s",
                   ""});
  if (s.time_span_s > 3 * rig_.period_s) {
    const double factor = s.time_span_s / rig_.period_s;
    const char* unit = factor > 3e5 ? "a millionth" : "a thousandth";
    out.push_back({true, about,
                   "the times of its points span " + fixed(s.time_span_s, 2) + " s within a scan of " +
                       fixed(rig_.period_s, 3) + " s",
                   std::string("set time_unit in the rig file; ") + unit + " of what is taken now would fit"});
  }
  // Too short by a unit: microseconds that are taken for nanoseconds, say. Another factor may be a cut scan.
  for (const auto& [factor, name] : {std::pair(1e3, "1000"), std::pair(1e6, "1000000")}) {
    const double share = factor * s.time_span_s / rig_.period_s;
    if (share < 0.05 || share > 1.5) continue;
    out.push_back({true, about,
                   "the times of its points span " + fixed(1e6 * s.time_span_s, 2) + " us within a scan of " +
                       fixed(rig_.period_s, 3) + " s",
                   std::string("set time_unit in the rig file; times ") + name + " times as long would fit"});
  }
}

void Doctor::judge_mounting(std::size_t i, std::vector<Finding>& out) const {
  const Sensor& s = sensors_[i];
  const io::RigSensor& model = rig_.sensors[i];
  const std::string about = "sensor '" + model.name + "'";
  if (s.grounds.size() < 3 || s.outside * 5 > s.points || median(s.ranges_m) > 1000) return;
  std::vector<double> height, pitch, roll;
  for (const Ground& ground : s.grounds) {
    height.push_back(ground.height_m);
    pitch.push_back(ground.pitch_rad);
    roll.push_back(ground.roll_rad);
  }
  const double off = median(height), nose = io::deg(median(pitch)), side = io::deg(median(roll));
  if (std::fabs(off) > 0.3)
    out.push_back(
        {true, about,
         "the road lies " + fixed(std::fabs(off), 2) + " m " + (off > 0 ? "above" : "below") +
             " where its mounting puts it",
         "z_m = " + fixed(model.z_m - off, 2) + " would fit (heights count from the road, not from the axle)"});
  if (std::fabs(nose) > 3.5 || std::fabs(side) > 3.5)
    out.push_back(
        {true, about,
         "the road is tilted by " + fixed(nose, 1) + " deg along and " + fixed(side, 1) + " deg across the vehicle",
         "check roll_deg and pitch_deg of its mounting (a banked road alone does not tilt in the vehicle's frame)"});
}

void Doctor::judge_ego(std::vector<Finding>& out) const {
  const int64_t first = ego_.first_ns, last = ego_.last_ns;
  if (ego_.poses == 0)
    return out.push_back({false, "ego",
                          "there are no ego poses: tracks will be in the vehicle frame, and no map can be used",
                          "name their topic in the rig file ([topics] ego = [\"/...\"]), or give --ego FILE"});
  if (ego_.backward > 0)
    out.push_back({true, "ego", "the stamps of its poses go back " + counted(ego_.backward, "time"),
                   "sort them by stamp; poses that are late are not used"});
  if (ego_.moving > 10 && ego_.crooked * 2 > ego_.moving)
    out.push_back({true, "ego",
                   "its yaw does not fit its motion: they differ by more than 20 deg in " +
                       percent(ego_.crooked, ego_.moving) + " of the time",
                   "check the unit (radians) and the convention of the yaw (0 along x, growing to the left)"});
  if (ego_.moving > 10 && ego_.fast * 2 > ego_.moving)
    out.push_back({true, "ego",
                   "its speed does not fit its motion in " + percent(ego_.fast, ego_.moving) + " of the time",
                   "check the unit of the twist (m/s, along x of the vehicle) and of the stamps"});
  const int64_t step = median(ego_.steps_ns);
  if (step > 100'000'000)
    out.push_back({false, "ego", "its poses come every " + fixed(seconds(step), 2) + " s; 100 Hz is better", ""});
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    const Sensor& s = sensors_[i];
    if (s.scans == s.errors) continue;
    if (s.first_ns <= last && first <= s.last_ns) {
      const double whole = seconds(s.last_ns) - seconds(s.first_ns);
      const double covered =
          std::min(seconds(s.last_ns), seconds(last)) - std::max(seconds(s.first_ns), seconds(first));
      if (whole <= 0 || 2 * covered >= whole) continue;
      out.push_back({true, "ego",
                     "its poses cover only " + fixed(100 * covered / whole, 0) + " % of the time of the scans (" +
                         fixed(seconds(first), 2) + " to " + fixed(seconds(last), 2) + " s of " +
                         fixed(seconds(s.first_ns), 2) + " to " + fixed(seconds(s.last_ns), 2) + " s)",
                     "give the poses of the whole recording"});
      break;
    }
    out.push_back({true, "ego",
                   "its poses (" + fixed(seconds(first), 2) + " to " + fixed(seconds(last), 2) +
                       " s) and the scans of sensor '" + rig_.sensors[i].name + "' (" + fixed(seconds(s.first_ns), 2) +
                       " to " + fixed(seconds(s.last_ns), 2) + " s) are of different times",
                   "bring both to one clock"});
    break;
  }
}

void Doctor::set_map(const io::MapData& map, const std::string& file, const ovt_params& params) {
  map_ = to_circuit(map, file);
  map_file_ = file;
  map_margin_m_ = std::max(params.gate_ego_margin_m, params.gate_map_margin_m);
}

void Doctor::judge_place(std::vector<Finding>& out) const {
  if (map_.empty() || ego_.rows.empty()) return;
  int64_t off = 0;
  double farthest_m = 0;
  int32_t hint = -1;
  for (const io::EgoRow& row : ego_.rows) {
    const double m = map_.measure_outside(row.x_m, row.y_m, &hint);
    off += m > map_margin_m_;
    farthest_m = std::max(farthest_m, std::min(m, 1e9));
  }
  if (off == 0) return;
  const bool most = 2 * off > int64_t(ego_.rows.size());
  out.push_back({most, "map",
                 "the ego vehicle is outside of " + map_file_ + " in " + std::to_string(off) + " of " +
                     counted(int64_t(ego_.rows.size()), "pose") + ", by up to " + fixed(farthest_m, 1) + " m",
                 most ? "give the map of this course, in the frame of reference of the poses (east, north)"
                      : "the map is not used there; where it is no pit lane and no run-off, check the poses"});
}

void Doctor::judge_direction(std::vector<Finding>& out) const {
  MapDirection direction;
  for (const io::EgoRow& row : ego_.rows) direction.add(map_, row, map_margin_m_);
  if (direction.is_against())
    out.push_back({true, "map", direction.sentence(map_file_),
                   "turn its lines round: the points of a map are in driving direction"});
}

std::vector<Finding> Doctor::findings() const {
  std::vector<Finding> out;
  const std::vector<std::size_t> owner = find_swapped_yaws(rig_, walls_);
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    judge_presence(i, out);
    judge_points(i, out);
    judge_view(i, out);
    judge_columns(i, out);
    judge_time(i, out);
    if (!judge_lines(i, out)) continue;
    if (owner[i] != i)  // a wrong yaw tilts the road, too
      judge_yaw(i, owner[i], out);
    else
      judge_mounting(i, out);
  }
  judge_ego(out);
  judge_place(out);
  judge_direction(out);
  return out;
}

}  // namespace overtake::cli
