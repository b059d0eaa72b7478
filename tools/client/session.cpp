// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/session.h"

#include <algorithm>
#include <cmath>

#include "tools/client/circuit_file.h"
#include "tools/client/pieces.h"
#include "tools/io/angles.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

ovt_column to_column(const void* data, std::size_t bytes, std::size_t stride, io::ValueType type) {
  static constexpr int32_t kType[] = {OVT_F32, OVT_F64, OVT_I8,  OVT_U8,   OVT_I16,
                                      OVT_U16, OVT_I32, OVT_U32, OVT_NONE, OVT_NONE};
  if (!data) return {nullptr, 0, 0, OVT_NONE};
  return {data, bytes, stride, kType[std::size_t(type)]};
}
ovt_column to_column(const io::CloudColumn& column) {
  return to_column(column.bytes.empty() ? nullptr : column.data(), column.bytes.size(), io::size_of(column.type),
                   column.type);
}
ovt_column to_column(const io::ColumnView& view) { return to_column(view.data, view.bytes, view.stride, view.type); }

// All columns but the time.
template <class Scan>
ovt_points points_without_time(const Scan& scan, int32_t sensor) {
  ovt_points points = ovt_default_points();
  points.sensor = sensor;
  points.count = scan.count;
  points.stamp_ns = scan.stamp_ns;
  points.x = to_column(scan.x);
  points.y = to_column(scan.y);
  points.z = to_column(scan.z);
  points.layer = to_column(scan.layer);
  points.intensity = to_column(scan.intensity);
  points.time_unit_ns = 1;
  return points;
}

}  // namespace

ovt_sensor_def to_sensor_def(const io::RigSensor& sensor) {
  ovt_sensor_def def = ovt_default_sensor_def();
  def.x_m = sensor.x_m;
  def.y_m = sensor.y_m;
  def.z_m = sensor.z_m;
  def.roll_rad = io::rad(sensor.roll_deg);
  def.pitch_rad = io::rad(sensor.pitch_deg);
  def.yaw_rad = io::rad(sensor.yaw_deg);
  def.rows = sensor.rows;
  def.cols = sensor.cols;
  def.azimuth_left_rad = io::rad(sensor.azimuth_left_deg);
  def.azimuth_right_rad = io::rad(sensor.azimuth_right_deg);
  def.wraps = sensor.wraps;
  def.range_min_m = sensor.range_min_m;
  def.range_max_m = sensor.range_max_m;
  def.layer_first = sensor.layer_first;
  def.layer_last = sensor.layer_last;
  def.point_capacity = sensor.point_capacity;
  if (sensor.compensated_to_s) def.compensated_to_s = *sensor.compensated_to_s;
  return def;
}

ovt_map_def to_map_def(const io::MapData& map) {
  ovt_map_def def = ovt_default_map_def();
  def.closed = map.closed;
  if (map.is_bounds()) {
    def.left_count = int32_t(map.left_x_m.size());
    def.right_count = int32_t(map.right_x_m.size());
    def.left_x_m = map.left_x_m.data();
    def.left_y_m = map.left_y_m.data();
    def.right_x_m = map.right_x_m.data();
    def.right_y_m = map.right_y_m.data();
    return def;
  }
  def.count = int32_t(map.x_m.size());
  def.x_m = map.x_m.data();
  def.y_m = map.y_m.data();
  def.width_left_m = map.width_left_m.data();
  def.width_right_m = map.width_right_m.data();
  if (!map.banking_rad.empty()) def.banking_rad = map.banking_rad.data();
  return def;
}

ovt_points to_points(const io::SensorScan& scan) {
  ovt_points points = points_without_time(scan, scan.sensor);
  if (scan.count == 0)  // an empty scan is a scan: the columns that each one needs have a type, and no values
    for (ovt_column* column : {&points.x, &points.y, &points.z, &points.layer}) *column = {nullptr, 0, 4, OVT_F32};
  if (!scan.time_offset_ns.empty())
    points.time = {scan.time_offset_ns.data(), scan.time_offset_ns.size() * 4, 4, OVT_I32};
  return points;
}

ovt_points to_points(const io::CloudView& cloud, int32_t sensor) {
  ovt_points points = points_without_time(cloud, sensor);
  points.time = to_column(cloud.time);
  return points;
}

ovt_ego_pose to_pose(const io::EgoRow& row) {
  ovt_ego_pose pose;
  ovt_ego_pose_init(&pose, sizeof pose);
  pose.stamp_ns = row.stamp_ns;
  pose.x_m = row.x_m;
  pose.y_m = row.y_m;
  pose.z_m = row.z_m;
  pose.roll_rad = row.roll_rad;
  pose.pitch_rad = row.pitch_rad;
  pose.yaw_rad = row.yaw_rad;
  pose.speed_mps = row.speed_mps;
  pose.yaw_rate_rps = row.yaw_rate_rps;
  return pose;
}

void check(ovt_status status, const std::string& what) {
  if (status != OVT_OK) throw io::Error(what, 0, ovt_status_text(status));
}

Session::Session(const Config& config, ovt_frame_fn* on_frame, void* user)
    : period_ns_(config.has_rig ? config.rig.period_ns() : 0),
      capacities_(effective_capacities(config)),
      in_pieces_(config.in_pieces),
      map_margin_m_(std::max(config.params.gate_ego_margin_m, config.params.gate_map_margin_m)),
      rig_(config.rig) {
  if (!config.ego.empty()) ego_ = io::read_ego_file(config.ego, &file_notes_);
  io::MapData map;
  ovt_map_def map_def;
  if (!config.map.empty()) {
    map = io::read_map(config.map);
    circuit_ = to_circuit(map, config.map);
    map_def = to_map_def(map);
    file_notes_.insert(file_notes_.end(), map.notes.begin(), map.notes.end());
  }
  std::vector<ovt_sensor_def> sensors;
  for (const io::RigSensor& sensor : rig_.sensors) sensors.push_back(to_sensor_def(sensor));

  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = int32_t(sensors.size());
  def.params = &config.params;
  def.cluster_capacity = capacities_.clusters;
  def.candidate_capacity = capacities_.candidates;
  def.track_capacity = capacities_.tracks;
  def.ego_pose_capacity = capacities_.ego_poses;
  def.map = config.map.empty() ? nullptr : &map_def;
  def.worker_count = config.workers;
  def.isa = config.isa.empty() ? nullptr : config.isa.c_str();
  def.push_policy = config.live ? OVT_PUSH_REPLACE : OVT_PUSH_WAIT;
  def.deadline_ns = config.deadline_ns;
  def.keep_images = config.keep_images;
  def.stream = in_pieces_;
  def.on_frame = on_frame;
  def.user = user;
  char error[256] = "";
  const ovt_status status = ovt_create_detector_verbose(&def, &detector_, error, sizeof error);
  if (status == OVT_UNKNOWN_NAME) {
    ovt_build_info build;
    ovt_read_build_info(&build);
    throw io::Error("--isa " + config.isa, 0, "unknown, or this CPU lacks it; it has " + std::string(build.isas));
  }
  if (status != OVT_OK) throw io::Error("", 0, *error ? error : ovt_status_text(status));
}

Session::~Session() { ovt_destroy_detector(detector_); }

void Session::push_ego_until(int64_t stamp_ns) {
  while (next_ego_ < ego_.size() && (next_ego_ == 0 || ego_[next_ego_ - 1].stamp_ns < stamp_ns)) {
    const io::EgoRow& row = ego_[next_ego_++];
    const ovt_ego_pose pose = to_pose(row);
    const ovt_status pushed = ovt_push_ego_pose(detector_, &pose);
    if (pushed == OVT_OK) direction_.add(circuit_, row, map_margin_m_);
    // Pushes the recording's poses in their recorded order; the library counts those whose stamps it rejects.
    if (pushed == OVT_BAD_ARGUMENT && bad_poses_++ == 0) first_bad_pose_ns_ = row.stamp_ns;
    if (pushed != OVT_DUPLICATE && pushed != OVT_LATE && pushed != OVT_BAD_ARGUMENT)
      check(pushed, "ego pose " + std::to_string(row.stamp_ns));
  }
}

std::string Session::why_no_data(const std::string& damage) const {
  const int64_t scans = stats().pushed;
  return (scans == 0 ? "holds no scan" : "holds no usable point in " + io::counted(scans, "scan")) +
         (damage.empty() ? "" : "; " + damage);
}

std::string Session::bad_poses() const {
  if (bad_poses_ == 0) return "";
  return io::counted(bad_poses_, "ego pose") +
         " with a value that is not finite or out of bounds: not used; the first has stamp " +
         std::to_string(first_bad_pose_ns_);
}

void Session::push(const io::FrameScans& frame) {
  for (const io::SensorScan& scan : frame.scans)
    push_ego_until(scan.stamp_ns + period_ns_);  // points lie up to a period later
  for (const io::SensorScan& scan : frame.scans) {
    const io::RigSensor& sensor = rig_.sensors[std::size_t(scan.sensor)];
    if (scan.count > sensor.point_capacity)
      throw io::Error(scan.path, 0,
                      std::to_string(scan.count) + " points, but sensor '" + sensor.name + "' has point_capacity " +
                          std::to_string(sensor.point_capacity) + " (--capacity points=" + std::to_string(scan.count) +
                          " raises it)");
    if (in_pieces_) continue;
    const ovt_points points = to_points(scan);
    const ovt_status status = ovt_push_scan(detector_, &points);
    if (status != OVT_DUPLICATE && status != OVT_LATE) check(status, scan.path);
    count_overflows();
  }
  if (in_pieces_) push_pieces(frame);
}

ovt_status Session::push_scan(const ovt_points& scan) {
  const ovt_status status = ovt_push_scan(detector_, &scan);
  count_overflows();
  return status;
}

// The pieces of all sensors' scans, in the order of the times at which their points were measured.
void Session::push_pieces(const io::FrameScans& frame) {
  constexpr int64_t kPiece_ns = 1'000'000;
  constexpr int32_t kPieces = 50;  // of a scan without times
  struct Piece {
    int64_t due_ns;
    std::size_t scan;
    int32_t first, last;
  };
  std::vector<Piece> pieces;
  std::vector<ovt_points> points;
  for (const io::SensorScan& scan : frame.scans) {
    const auto time_of = [&](int32_t i) {
      return scan.time_offset_ns.empty() ? int64_t(i) * kPieces * kPiece_ns / scan.count
                                         : int64_t(scan.time_offset_ns[std::size_t(i)]);
    };
    for (int32_t first = 0; first < scan.count;) {
      int32_t last = first + 1;
      while (last < scan.count && std::abs(time_of(last) - time_of(first)) < kPiece_ns) ++last;
      pieces.push_back({scan.stamp_ns + time_of(last - 1), points.size(), first, last});
      first = last;
    }
    if (scan.count == 0) pieces.push_back({scan.stamp_ns, points.size(), 0, 0});
    points.push_back(to_points(scan));
  }
  std::stable_sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.due_ns < b.due_ns; });
  const auto accept = [&](ovt_status status, std::size_t scan) {
    if (status != OVT_DUPLICATE && status != OVT_LATE) check(status, frame.scans[scan].path);
  };
  std::vector<int32_t> pushed(points.size(), 0);
  for (const Piece& piece : pieces) {
    const ovt_points& scan = points[piece.scan];
    const ovt_points part = piece_of(scan, piece.first, piece.last);
    accept(ovt_push_points(detector_, &part), piece.scan);
    pushed[piece.scan] += part.count;
    if (pushed[piece.scan] < scan.count) continue;
    accept(ovt_end_scan(detector_, scan.sensor, scan.stamp_ns, scan.count), piece.scan);
    count_overflows();
  }
}

void Session::flush() {
  check(ovt_flush(detector_), "finishing the last frames");
  count_overflows();
}

void Session::count_overflows() {
  const ovt_stats now = stats();
  const int64_t finished = now.frames - frames_;
  const int64_t rows[] = {now.overflow_clusters, now.overflow_candidates, now.overflow_tracks};
  for (std::size_t i = 0; i < std::size(rows); ++i) {
    Overflow& seen = overflows_[i];
    const int64_t grown = rows[i] - seen.rows;  // a replay may lower the tracks'
    if (grown > 0) seen.frames += std::max<int64_t>(1, std::min(grown, finished));
    seen.rows = rows[i];
  }
  frames_ = now.frames;
}

std::vector<std::string> Session::full_capacities(std::string_view remedy) const {
  std::vector<std::string> sentences;
  for (const Overflow& seen : overflows_) {
    if (seen.frames == 0) continue;
    for (const io::CapacityKey& key : io::kCapacityKeys) {
      if (std::string_view(key.name) != seen.capacity) continue;
      const int32_t rows = capacities_.*key.rows;
      const bool tracks = key.rows == &io::Capacities::tracks;
      sentences.push_back("capacity " + std::string(key.name) + " (" + std::to_string(rows) + ") was reached in " +
                          std::to_string(seen.frames) + " of " + std::to_string(frames_) + " frames: " +
                          (tracks ? "confirmed first, then nearest first" : "nearest first") + " were kept; " +
                          (rows < key.most ? "raise it with " + std::string(remedy) + std::string(key.name) + "=" +
                                                 std::to_string(std::min(2 * rows, key.most))
                                           : "this is the maximum"));
    }
  }
  return sentences;
}

ovt_stats Session::stats() const {
  ovt_stats stats = ovt_default_stats();
  check(ovt_read_stats(detector_, &stats), "counters");
  return stats;
}

}  // namespace overtake::cli
