// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/foxglove_scene.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <cmath>
#include <set>

#include "tools/io/angles.h"
#include "tools/io/ros_messages.h"

namespace overtake::cli {
namespace {

using google::protobuf::FileDescriptor;

// Adds the imported files before the file itself.
void add_file(const FileDescriptor& file, std::set<std::string>& added, google::protobuf::FileDescriptorSet& set) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), added, set);
  file.CopyTo(set.add_file());
}

void set_pose(foxglove::Pose& pose, ScenePoint at, double yaw_rad) {
  set_vector(*pose.mutable_position(), at.x, at.y, at.z);
  set_rotation(*pose.mutable_orientation(), 0, 0, yaw_rad);
}

void set_color(foxglove::Color& out, SceneColor color) {
  out.set_r(color.r);
  out.set_g(color.g);
  out.set_b(color.b);
  out.set_a(color.a);
}

}  // namespace

std::string descriptor_of(const std::string& message) {
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> added;
  const auto* descriptor = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(message);
  if (descriptor) add_file(*descriptor->file(), added, set);
  return set.SerializeAsString();
}

void set_stamp(google::protobuf::Timestamp& stamp, int64_t stamp_ns) {
  constexpr int64_t kSecond = 1'000'000'000;
  int64_t seconds = stamp_ns / kSecond, rest = stamp_ns % kSecond;
  if (rest < 0) rest += kSecond, --seconds;
  stamp.set_seconds(seconds);
  stamp.set_nanos(int32_t(rest));
}

void set_vector(foxglove::Vector3& vector, double x, double y, double z) {
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
}

void set_rotation(foxglove::Quaternion& q, double roll_rad, double pitch_rad, double yaw_rad) {
  io::RosPose pose;
  io::set_rotation(pose, roll_rad, pitch_rad, yaw_rad);
  q.set_x(pose.qx);
  q.set_y(pose.qy);
  q.set_z(pose.qz);
  q.set_w(pose.qw);
}

void delete_all(foxglove::SceneUpdate& update, int64_t stamp_ns) {
  foxglove::SceneEntityDeletion& deletion = *update.add_deletions();
  set_stamp(*deletion.mutable_timestamp(), stamp_ns);
  deletion.set_type(foxglove::SceneEntityDeletion::ALL);
}

foxglove::SceneEntity& add_entity(foxglove::SceneUpdate& update, int64_t stamp_ns, const std::string& frame,
                                  const std::string& id) {
  foxglove::SceneEntity& entity = *update.add_entities();
  set_stamp(*entity.mutable_timestamp(), stamp_ns);
  entity.set_frame_id(frame);
  entity.set_id(id);
  entity.mutable_lifetime();  // 0: until it is deleted
  return entity;
}

void add_cube(foxglove::SceneEntity& entity, ScenePoint center, double yaw_rad, double length_m, double width_m,
              double height_m, SceneColor color) {
  foxglove::CubePrimitive& cube = *entity.add_cubes();
  set_pose(*cube.mutable_pose(), center, yaw_rad);
  set_vector(*cube.mutable_size(), length_m, width_m, height_m);
  set_color(*cube.mutable_color(), color);
}

void add_arrow(foxglove::SceneEntity& entity, ScenePoint tail, double yaw_rad, SceneColor color) {
  foxglove::ArrowPrimitive& arrow = *entity.add_arrows();
  set_pose(*arrow.mutable_pose(), tail, yaw_rad);
  arrow.set_shaft_length(2.5);
  arrow.set_shaft_diameter(0.12);
  arrow.set_head_length(0.5);
  arrow.set_head_diameter(0.35);
  set_color(*arrow.mutable_color(), color);
}

void add_line(foxglove::SceneEntity& entity, const std::vector<ScenePoint>& points, bool closed, SceneColor color) {
  foxglove::LinePrimitive& line = *entity.add_lines();
  line.set_type(closed ? foxglove::LinePrimitive::LINE_LOOP : foxglove::LinePrimitive::LINE_STRIP);
  set_pose(*line.mutable_pose(), {0, 0, 0}, 0);
  line.set_thickness(2);
  line.set_scale_invariant(true);
  for (const ScenePoint& point : points) {
    foxglove::Point3& out = *line.add_points();
    out.set_x(point.x);
    out.set_y(point.y);
    out.set_z(point.z);
  }
  set_color(*line.mutable_color(), color);
}

void add_ellipse(foxglove::SceneEntity& entity, double x_m, double y_m, double var_x, double cov_xy, double var_y,
                 SceneColor color) {
  const double middle = (var_x + var_y) / 2, half = std::hypot((var_x - var_y) / 2, cov_xy);
  const double a = 2 * std::sqrt(std::max(0.0, middle + half)), b = 2 * std::sqrt(std::max(0.0, middle - half));
  const double turn = 0.5 * std::atan2(2 * cov_xy, var_x - var_y), c = std::cos(turn), s = std::sin(turn);
  std::vector<ScenePoint> points;
  for (int k = 0; k < 24; ++k) {
    const double angle = 2 * io::kPi * k / 24, u = a * std::cos(angle), v = b * std::sin(angle);
    points.push_back({x_m + c * u - s * v, y_m + s * u + c * v, 0.05});
  }
  add_line(entity, points, true, color);
}

void add_text(foxglove::SceneEntity& entity, ScenePoint at, const std::string& text) {
  foxglove::TextPrimitive& out = *entity.add_texts();
  set_pose(*out.mutable_pose(), at, 0);
  out.set_billboard(true);
  out.set_font_size(14);
  out.set_scale_invariant(true);
  set_color(*out.mutable_color(), {1, 1, 1, 1});
  out.set_text(text);
}

}  // namespace overtake::cli
