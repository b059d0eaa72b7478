// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Builders for Foxglove's messages.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "foxglove.pb.h"

namespace overtake::cli {

struct ScenePoint {
  double x, y, z;
};
struct SceneColor {
  double r, g, b, a;
};

// A FileDescriptorSet of the message ("foxglove.PointCloud") and all its dependencies, as MCAP requires.
std::string descriptor_of(const std::string& message);

void set_stamp(google::protobuf::Timestamp& stamp, int64_t stamp_ns);
void set_vector(foxglove::Vector3& vector, double x, double y, double z);
void set_rotation(foxglove::Quaternion& rotation, double roll_rad, double pitch_rad, double yaw_rad);

void delete_all(foxglove::SceneUpdate& update, int64_t stamp_ns);
foxglove::SceneEntity& add_entity(foxglove::SceneUpdate& update, int64_t stamp_ns, const std::string& frame,
                                  const std::string& id);
void add_cube(foxglove::SceneEntity& entity, ScenePoint center, double yaw_rad, double length_m, double width_m,
              double height_m, SceneColor color);
void add_arrow(foxglove::SceneEntity& entity, ScenePoint tail, double yaw_rad, SceneColor color);
void add_line(foxglove::SceneEntity& entity, const std::vector<ScenePoint>& points, bool closed, SceneColor color);
// An ellipse at two sigmas of the covariance.
void add_ellipse(foxglove::SceneEntity& entity, double x_m, double y_m, double var_x, double cov_xy, double var_y,
                 SceneColor color);
void add_text(foxglove::SceneEntity& entity, ScenePoint at, const std::string& text);

}  // namespace overtake::cli
