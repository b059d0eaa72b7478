// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Encodes and decodes the ROS 2 messages of recordings as CDR bytes (with encapsulation), and has their definitions in
// MCAP's encoding "ros2msg": sensor_msgs/msg/PointCloud2, nav_msgs/msg/Odometry, tf2_msgs/msg/TFMessage. Decoders
// accept either byte order and throw std::runtime_error with a sentence for invalid bytes.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

struct RosHeader {
  int64_t stamp_ns = 0;
  std::string frame_id;
};

struct PointField {
  enum Type : uint8_t { kInt8 = 1, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
  std::string name;
  uint32_t offset = 0;  // bytes from the start of the point
  uint8_t datatype = kFloat32;
  uint32_t count = 1;
};

inline constexpr std::size_t kMostPointFields = 1000;

struct PointCloud2 {
  RosHeader header;
  uint32_t height = 1, width = 0;  // points: height * width
  std::vector<PointField> fields;
  bool is_bigendian = false;
  uint32_t point_step = 0, row_step = 0;
  std::string_view data;  // points into the decoded message, or into the encoder's memory
  bool is_dense = false;
};

struct RosPose {
  double x_m = 0, y_m = 0, z_m = 0;
  double qx = 0, qy = 0, qz = 0, qw = 1;
};

struct Odometry {
  RosHeader header;
  std::string child_frame_id;
  RosPose pose;  // of the child frame in header.frame_id
  std::array<double, 36> pose_covariance{};
  double vx_mps = 0, vy_mps = 0, vz_mps = 0, wx_rps = 0, wy_rps = 0, wz_rps = 0;  // in the child frame
  std::array<double, 36> twist_covariance{};
};

struct RosTransform {
  RosHeader header;
  std::string child_frame_id;
  RosPose pose;  // of the child frame in header.frame_id
};

// The quaternion of roll, pitch and yaw (about z, then y, then x), and the inverse.
void set_rotation(RosPose& pose, double roll_rad, double pitch_rad, double yaw_rad);
struct RollPitchYaw {
  double roll_rad, pitch_rad, yaw_rad;
};
RollPitchYaw rotation_of(const RosPose& pose);
double known_yaw_rad(const RosPose& pose);  // NaN for a quaternion of zeros: no orientation is given

std::string encode_point_cloud2(const PointCloud2& cloud);
PointCloud2 decode_point_cloud2(std::string_view bytes);  // data points into `bytes`
std::string encode_odometry(const Odometry& odometry);
Odometry decode_odometry(std::string_view bytes);
std::string encode_transforms(const std::vector<RosTransform>& transforms);
std::vector<RosTransform> decode_transforms(std::string_view bytes);

inline constexpr const char* kPointCloud2Name = "sensor_msgs/msg/PointCloud2";
inline constexpr const char* kOdometryName = "nav_msgs/msg/Odometry";
inline constexpr const char* kTransformsName = "tf2_msgs/msg/TFMessage";
extern const char* const kPointCloud2Schema;
extern const char* const kOdometrySchema;
extern const char* const kTransformsSchema;

}  // namespace overtake::io
