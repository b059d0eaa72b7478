// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/outputs.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>

#include "messages.h"
#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/io/angles.h"
#include "tools/io/ros_messages.h"

namespace overtake::ros2 {
namespace {

using Header = std_msgs_msg_dds__Header_;
using Pose = geometry_msgs_msg_dds__Pose_;
using Marker = visualization_msgs_msg_dds__Marker_;

builtin_interfaces_msg_dds__Time_ to_time(int64_t stamp_ns) {
  constexpr int64_t kSecond = 1'000'000'000;
  const int64_t seconds = stamp_ns >= 0 ? stamp_ns / kSecond : -((kSecond - 1 - stamp_ns) / kSecond);
  return {int32_t(seconds), uint32_t(stamp_ns - seconds * kSecond)};
}

// The texts of a message; Cyclone DDS takes pointers to char and only reads them.
class Texts {
 public:
  char* keep(const std::string& text) {
    texts_.push_back(text);
    return texts_.back().data();
  }

 private:
  std::deque<std::string> texts_;
};

template <class Sequence, class Row>
void point_to(Sequence& sequence, std::vector<Row>& rows) {
  sequence._maximum = sequence._length = uint32_t(rows.size());
  sequence._buffer = rows.data();
  sequence._release = false;
}

Header make_header(Texts& texts, int64_t stamp_ns, const std::string& frame) {
  return {to_time(stamp_ns), texts.keep(frame)};
}

Pose make_pose(double x_m, double y_m, double z_m, double yaw_rad) {
  return {{x_m, y_m, z_m}, {0, 0, std::sin(yaw_rad / 2), std::cos(yaw_rad / 2)}};
}

// Of x, y and yaw in the 6 x 6 covariance of a pose.
void set_covariance(double* covariance, double var_x, double var_y, double cov_xy, double var_yaw) {
  covariance[0] = var_x;
  covariance[1] = covariance[6] = cov_xy;
  covariance[7] = var_y;
  covariance[35] = var_yaw;
}

const char* class_name(const int32_t* classes, int32_t i) {
  if (!classes) return "unknown";
  return classes[i] == OVT_CLASS_CAR ? "car" : classes[i] == OVT_CLASS_DEBRIS ? "debris" : "unknown";
}

bool has_readers(dds_entity_t writer) {
  dds_publication_matched_status_t status{};
  return dds_get_publication_matched_status(writer, &status) == DDS_RETCODE_OK && status.current_count > 0;
}

struct Colour {
  float r, g, b, a;
};
constexpr Colour kDetection{1.0f, 0.55f, 0.0f, 0.6f}, kConfirmed{0.1f, 0.45f, 1.0f, 0.6f},
    kTentative{0.6f, 0.6f, 0.6f, 0.4f}, kText{1, 1, 1, 1};

constexpr double kCarLength_m = 4.9, kCarWidth_m = 1.9, kCarHeight_m = 1.0;  // markers of tracks

}  // namespace

Outputs::Outputs(Participant& participant, Names& names, const std::string& map_frame, const std::string& vehicle_frame)
    : frames_{map_frame, vehicle_frame} {
  const auto add_topic = [&](const std::string& name, const dds_topic_descriptor_t& type, Qos qos) {
    return add(participant, names.resolve(name), type, qos);
  };
  detections_ = add_topic("~/detections", vision_msgs_msg_dds__Detection3DArray__desc, Qos::kResult);
  tracks_ = add_topic("~/tracks", overtake_msgs_msg_dds__Tracks__desc, Qos::kResult);
  markers_ = add_topic("~/markers", visualization_msgs_msg_dds__MarkerArray__desc, Qos::kResult);
  for (int32_t n = 0; n < kTrackTopics; ++n) {
    const std::string name = "~/track_" + std::to_string(n);
    odometry_[std::size_t(n)] = add_topic(name + "/odometry", nav_msgs_msg_dds__Odometry__desc, Qos::kResult);
    paths_[std::size_t(n)] = add_topic(name + "/path", nav_msgs_msg_dds__Path__desc, Qos::kResult);
  }
  transforms_ = add_topic("/tf_static", tf2_msgs_msg_dds__TFMessage__desc, Qos::kLatched);
  diagnostics_ = add_topic("/diagnostics", diagnostic_msgs_msg_dds__DiagnosticArray__desc, Qos::kResult);
}

dds_entity_t Outputs::add(Participant& participant, const std::string& name, const dds_topic_descriptor_t& type,
                          Qos qos) {
  writers_.push_back(participant.create_writer(name, type, qos));
  topics_.push_back(name);
  types_.push_back(ros_type_of(type.m_typename));
  return writers_.back();
}

void Outputs::set_frames(const std::string& map, const std::string& vehicle) {
  const std::lock_guard lock(mutex_);
  frames_ = {map, vehicle};
}

void Outputs::write(dds_entity_t writer, const void* message) {
  if (dds_write(writer, message) == DDS_RETCODE_OK) return;
  const std::lock_guard lock(mutex_);
  ++report_.not_sent;
  ++report_.all_not_sent;
}

void Outputs::publish_transforms(const io::Rig& rig, const std::string& vehicle_frame, int64_t stamp_ns) {
  Texts texts;
  std::vector<geometry_msgs_msg_dds__TransformStamped_> rows;
  for (const io::RigSensor& sensor : rig.sensors) {
    const std::string& frame = sensor.frame_id.empty() ? sensor.name : sensor.frame_id;
    if (frame == vehicle_frame) continue;
    io::RosPose turn;
    io::set_rotation(turn, io::rad(sensor.roll_deg), io::rad(sensor.pitch_deg), io::rad(sensor.yaw_deg));
    rows.push_back({make_header(texts, stamp_ns, vehicle_frame),
                    texts.keep(frame),
                    {{sensor.x_m, sensor.y_m, sensor.z_m}, {turn.qx, turn.qy, turn.qz, turn.qw}}});
  }
  tf2_msgs_msg_dds__TFMessage_ message{};
  point_to(message.transforms, rows);
  write(transforms_, &message);
}

void Outputs::publish_diagnostics(const std::vector<Status>& all, int64_t stamp_ns) {
  Texts texts;
  std::deque<std::vector<diagnostic_msgs_msg_dds__KeyValue_>> values;
  std::vector<diagnostic_msgs_msg_dds__DiagnosticStatus_> rows;
  for (const Status& status : all) {
    auto& pairs = values.emplace_back();
    for (const auto& [key, value] : status.values) pairs.push_back({texts.keep(key), texts.keep(value)});
    rows.push_back({uint8_t(status.level), texts.keep(status.name), texts.keep(status.message), texts.keep(""), {}});
    point_to(rows.back().values, pairs);
  }
  diagnostic_msgs_msg_dds__DiagnosticArray_ message{};
  message.header = make_header(texts, stamp_ns, "");
  point_to(message.status, rows);
  write(diagnostics_, &message);
}

void Outputs::on_frame(ovt_reader* reader, void* user) { static_cast<Outputs*>(user)->publish(reader); }

void Outputs::publish(ovt_reader* reader) {
  const auto begin = std::chrono::steady_clock::now();
  ovt_frame_info info;
  ovt_detections rows;
  ovt_tracks tracks;
  if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_detections(reader, &rows) != OVT_OK ||
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) != OVT_OK)
    return;
  Frames frames;
  {
    const std::lock_guard lock(mutex_);
    frames = frames_;
  }
  const std::string& frame = info.reference == OVT_REFERENCE_MAP ? frames.map : frames.vehicle;
  // An empty list says "all clear"; it has no flag that could say otherwise.
  const bool has_looked = info.sensor_mask != 0 && (info.flags & OVT_FLAG_NO_DATA) == 0;
  if (has_readers(detections_) && has_looked) publish_detections(info, rows, frames);
  if (has_readers(tracks_)) publish_tracks(info, tracks, frame);
  publish_numbered(tracks, frame);
  if (has_readers(markers_)) publish_markers(info, rows, tracks, frames);

  const auto end = std::chrono::steady_clock::now();
  const int64_t now_ns = end.time_since_epoch().count();
  const std::lock_guard lock(mutex_);
  ++report_.frames;
  ++report_.all_frames;
  report_.with_ego += (info.flags & OVT_FLAG_NO_EGO) == 0;
  if ((info.flags & OVT_FLAG_PREDICTION) == 0) report_.flags |= info.flags;
  report_.suspect_mask |= info.suspect_mask;
  report_.stale_mask |= info.stale_mask;
  report_.detections = info.detection_count;
  report_.tracks = tracks.count;
  report_.confirmed = int32_t(std::count(tracks.state, tracks.state + tracks.count, int32_t(OVT_CONFIRMED)));
  report_.unnumbered_tracks = std::max<int64_t>(report_.unnumbered_tracks, report_.confirmed - kTrackTopics);
  report_.newest = info;
  if (info.latency_ns >= 0) latency_ms_.add(now_ns, double(info.latency_ns) * 1e-6);
  publish_ms_.add(now_ns, std::chrono::duration<double, std::milli>(end - begin).count());
}

Outputs::Report Outputs::take_report(int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  latency_ms_.pass(now_ns);
  publish_ms_.pass(now_ns);
  Report report = report_;
  report.rate = publish_ms_.rate();
  report.latency_p50_ms = latency_ms_.quantile(0.5);
  report.latency_p99_ms = latency_ms_.quantile(0.99);
  report.publish_p50_ms = publish_ms_.quantile(0.5);
  report.publish_p99_ms = publish_ms_.quantile(0.99);
  report_.frames = report_.with_ego = report_.not_sent = report_.unnumbered_tracks = 0;
  report_.flags = report_.suspect_mask = report_.stale_mask = 0;
  return report;
}

void Outputs::publish_detections(const ovt_frame_info& info, const ovt_detections& rows, const Frames& frames) {
  Texts texts;
  std::deque<std::vector<vision_msgs_msg_dds__ObjectHypothesisWithPose_>> results;
  std::vector<vision_msgs_msg_dds__Detection3D_> out;
  for (int32_t i = 0; i < rows.count; ++i) {
    vision_msgs_msg_dds__Detection3D_ row{};
    row.header = make_header(texts, rows.stamp_ns[i], frames.vehicle);
    row.id = texts.keep(rows.track[i] ? cli::track_name(rows.track[i]) : "");
    const Pose pose =
        make_pose(double(rows.x_m[i]), double(rows.y_m[i]), double(rows.z_m[i]), double(rows.heading_rad[i]));
    auto& result = results.emplace_back(1);
    result[0].hypothesis = {texts.keep(class_name(rows.object_class, i)), 1};
    result[0].pose.pose = pose;
    if (rows.var_x)
      set_covariance(result[0].pose.covariance, double(rows.var_x[i]), double(rows.var_y[i]), double(rows.cov_xy[i]),
                     0);
    point_to(row.results, result);
    row.bbox.center = pose;
    row.bbox.size = {double(rows.length_m[i]), double(rows.width_m[i]), 0};
    if (rows.height_m && rows.height_m[i] > 0) {
      row.bbox.size.z = double(rows.height_m[i]);
      row.bbox.center.position.z = double(rows.road_z_m[i]) + double(rows.height_m[i]) / 2;
    }
    out.push_back(row);
  }
  vision_msgs_msg_dds__Detection3DArray_ message{};
  message.header = make_header(texts, info.stamp_ns, frames.vehicle);
  point_to(message.detections, out);
  write(detections_, &message);
}

void Outputs::publish_tracks(const ovt_frame_info& info, const ovt_tracks& tracks, const std::string& frame) {
  constexpr uint8_t kUnknown = 255;
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  Texts texts;
  std::vector<overtake_msgs_msg_dds__Track_> out;
  for (int32_t i = 0; i < tracks.count; ++i) {
    overtake_msgs_msg_dds__Track_ row{};
    row.id = tracks.id[i];
    row.name = texts.keep(cli::track_name(tracks.id[i]));
    row.state = uint8_t(tracks.state[i]);
    row.measured = to_time(tracks.measured_ns[i]);
    row.x = tracks.x_m[i];
    row.y = tracks.y_m[i];
    row.speed = tracks.speed_mps[i];
    row.course = tracks.course_rad[i];
    row.yaw_rate = tracks.yaw_rate_rps[i];
    for (std::size_t k = 0; k < 15; ++k) row.covariance[k] = tracks.covariance[k][i];
    row.heading = tracks.heading_rad[i];
    row.heading_sigma = tracks.heading_sigma_rad ? tracks.heading_sigma_rad[i] : unknown;
    row.length = tracks.length_m[i];
    row.width = tracks.width_m[i];
    row.existence = tracks.existence ? tracks.existence[i] : unknown;
    row.unseen = tracks.unseen_s ? tracks.unseen_s[i] : unknown;
    row.object_class = tracks.object_class ? uint8_t(tracks.object_class[i]) : kUnknown;
    row.visibility = tracks.visibility ? uint8_t(tracks.visibility[i]) : kUnknown;
    row.flags = tracks.flags[i];
    row.age = tracks.age[i];
    row.hits = tracks.hits[i];
    row.detection = tracks.detection[i];
    out.push_back(row);
  }
  overtake_msgs_msg_dds__Tracks_ message{};
  message.header = make_header(texts, tracks.publish_ns, frame);
  message.frame_stamp = to_time(info.stamp_ns);
  message.sequence_number = uint64_t(info.sequence);
  message.frame_flags = info.flags;
  message.sensor_mask = info.sensor_mask;
  message.detection_count = info.detection_count;
  point_to(message.tracks, out);
  write(tracks_, &message);
}

void Outputs::publish_numbered(const ovt_tracks& tracks, const std::string& frame) {
  const std::vector<int32_t> numbers = numbers_.assign(tracks);
  for (int32_t n = 0; n < kTrackTopics; ++n) {
    const auto row = std::find(numbers.begin(), numbers.end(), n);
    const dds_entity_t odometry = odometry_[std::size_t(n)], path = paths_[std::size_t(n)];
    Texts texts;
    if (row == numbers.end()) {
      if (!numbers_.was_used(n) || !has_readers(path)) continue;
      nav_msgs_msg_dds__Path_ message{};  // the track is over: nothing to draw
      message.header = make_header(texts, tracks.publish_ns, frame);
      write(path, &message);
      continue;
    }
    const auto i = int32_t(row - numbers.begin());
    if (has_readers(odometry)) {
      nav_msgs_msg_dds__Odometry_ message{};
      message.header = make_header(texts, tracks.publish_ns, frame);
      message.child_frame_id = texts.keep("track_" + cli::track_name(tracks.id[i]));
      std::replace(message.child_frame_id,
                   message.child_frame_id + std::char_traits<char>::length(message.child_frame_id), ':', '_');
      message.pose.pose = make_pose(tracks.x_m[i], tracks.y_m[i], 0, tracks.heading_rad[i]);
      const double sigma = tracks.heading_sigma_rad ? tracks.heading_sigma_rad[i] : std::sqrt(tracks.covariance[9][i]);
      set_covariance(message.pose.covariance, tracks.covariance[0][i], tracks.covariance[2][i], tracks.covariance[1][i],
                     sigma * sigma);
      const double slip = tracks.course_rad[i] - tracks.heading_rad[i];
      message.twist.twist.linear = {tracks.speed_mps[i] * std::cos(slip), tracks.speed_mps[i] * std::sin(slip), 0};
      message.twist.twist.angular = {0, 0, tracks.yaw_rate_rps[i]};
      set_covariance(message.twist.covariance, tracks.covariance[5][i], 0, 0, tracks.covariance[14][i]);
      write(odometry, &message);
    }
    if (!has_readers(path)) continue;
    std::vector<geometry_msgs_msg_dds__PoseStamped_> poses;
    for (int32_t k = 0; k < tracks.path_points; ++k) {
      const int32_t at = i * tracks.path_points + k;
      const int64_t stamp_ns = tracks.publish_ns + std::llround(double(k + 1) * tracks.path_step_s * 1e9);
      poses.push_back({make_header(texts, stamp_ns, frame),
                       make_pose(tracks.path_x_m[at], tracks.path_y_m[at], 0, tracks.path_course_rad[at])});
    }
    nav_msgs_msg_dds__Path_ message{};
    message.header = make_header(texts, tracks.publish_ns, frame);
    point_to(message.poses, poses);
    write(path, &message);
  }
}

void Outputs::publish_markers(const ovt_frame_info& info, const ovt_detections& rows, const ovt_tracks& tracks,
                              const Frames& frames) {
  Texts texts;
  char* nothing = texts.keep("");
  std::vector<Marker> out;
  std::deque<std::vector<geometry_msgs_msg_dds__Point_>> lines;
  const auto add_marker = [&](const char* name, int32_t id, int32_t type, const std::string& frame, int64_t stamp_ns,
                              const Pose& pose, const Colour& colour) -> Marker& {
    Marker marker{};
    marker.header = make_header(texts, stamp_ns, frame);
    marker.ns = texts.keep(name);
    marker.id = id;
    marker.type = type;
    marker.pose = pose;
    marker.color = {colour.r, colour.g, colour.b, colour.a};
    marker.lifetime = {0, 500'000'000};
    marker.texture.header = make_header(texts, 0, "");
    for (char** text : {&marker.texture_resource, &marker.texture.format, &marker.text, &marker.mesh_resource,
                        &marker.mesh_file.filename})
      *text = nothing;
    out.push_back(marker);
    return out.back();
  };
  enum { kCube = 1, kLineStrip = 4, kTextFacing = 9 };
  enum { kDeleteAll = 3 };
  const std::string& frame = info.reference == OVT_REFERENCE_MAP ? frames.map : frames.vehicle;
  add_marker("", 0, kCube, frame, tracks.publish_ns, make_pose(0, 0, 0, 0), kText).action = kDeleteAll;
  for (int32_t i = 0; i < rows.count; ++i) {
    const Pose pose =
        make_pose(double(rows.x_m[i]), double(rows.y_m[i]), kCarHeight_m / 2, double(rows.heading_rad[i]));
    Marker& box = add_marker("detections", i, kCube, frames.vehicle, rows.stamp_ns[i], pose, kDetection);
    box.scale = {std::max(0.1, double(rows.length_m[i])), std::max(0.1, double(rows.width_m[i])), kCarHeight_m};
  }
  for (int32_t i = 0; i < tracks.count; ++i) {
    const bool confirmed = tracks.state[i] == OVT_CONFIRMED;
    const auto id = int32_t(tracks.id[i] & 0xffff);
    const Pose pose = make_pose(tracks.x_m[i], tracks.y_m[i], kCarHeight_m / 2, tracks.heading_rad[i]);
    Marker& box = add_marker("tracks", id, kCube, frame, tracks.publish_ns, pose, confirmed ? kConfirmed : kTentative);
    box.scale = {kCarLength_m, kCarWidth_m, kCarHeight_m};
    if (!confirmed) continue;
    Marker& label = add_marker("labels", id, kTextFacing, frame, tracks.publish_ns,
                               make_pose(tracks.x_m[i], tracks.y_m[i], 2.5 * kCarHeight_m, 0), kText);
    label.scale = {0, 0, 1.2};
    label.text = texts.keep(cli::track_name(tracks.id[i]) + "  " + cli::fixed(tracks.speed_mps[i], 1) + " m/s");
    if (tracks.path_points == 0) continue;
    auto& points = lines.emplace_back();
    for (int32_t k = 0; k < tracks.path_points; ++k) {
      const int32_t at = i * tracks.path_points + k;
      points.push_back({tracks.path_x_m[at], tracks.path_y_m[at], 0.2});
    }
    Marker& line = add_marker("paths", id, kLineStrip, frame, tracks.publish_ns, make_pose(0, 0, 0, 0), kConfirmed);
    line.scale = {0.3, 0, 0};
    point_to(line.points, points);
  }
  visualization_msgs_msg_dds__MarkerArray_ message{};
  point_to(message.markers, out);
  write(markers_, &message);
}

}  // namespace overtake::ros2
