// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "tools/io/ros_messages.h"

using namespace overtake::io;

namespace {

PointCloud2 small_cloud(const std::string& data) {
  PointCloud2 cloud;
  cloud.header = {1'700'000'000'123'456'789, "luminar_front"};
  cloud.width = 2;
  cloud.fields = {{"x", 0, PointField::kFloat32, 1}, {"ring", 12, PointField::kUint16, 1}};
  cloud.point_step = 14;
  cloud.row_step = 28;
  cloud.data = data;
  cloud.is_dense = true;
  return cloud;
}

}  // namespace

TEST_CASE("ros messages: a PointCloud2 is read back from its CDR bytes") {
  const std::string data(28, 'q');
  const std::string bytes = encode_point_cloud2(small_cloud(data));
  const PointCloud2 cloud = decode_point_cloud2(bytes);
  CHECK(cloud.header.stamp_ns == 1'700'000'000'123'456'789);
  CHECK(cloud.header.frame_id == "luminar_front");
  CHECK(cloud.height == 1);
  CHECK(cloud.width == 2);
  REQUIRE(cloud.fields.size() == 2);
  CHECK(cloud.fields[1].name == "ring");
  CHECK(cloud.fields[1].offset == 12);
  CHECK(cloud.fields[1].datatype == PointField::kUint16);
  CHECK(cloud.point_step == 14);
  CHECK(cloud.row_step == 28);
  CHECK(cloud.data == data);
  CHECK(cloud.is_dense);
}

TEST_CASE("ros messages: the CDR bytes of a PointCloud2 follow the wire format") {
  PointCloud2 cloud;
  cloud.header = {2'000'000'003, "a"};
  cloud.data = "xyz";
  const unsigned char expected[] = {0, 1, 0, 0,                     // CDR, little-endian
                                    2, 0, 0, 0, 3,   0,   0,   0,   // stamp
                                    2, 0, 0, 0, 'a', 0,   0,   0,   // string with its zero, padded to 4
                                    1, 0, 0, 0, 0,   0,   0,   0,   // height, width
                                    0, 0, 0, 0,                     // no fields
                                    0, 0, 0, 0,                     // is_bigendian, padding
                                    0, 0, 0, 0, 0,   0,   0,   0,   // point_step, row_step
                                    3, 0, 0, 0, 'x', 'y', 'z', 0};  // data, is_dense
  const std::string bytes = encode_point_cloud2(cloud);
  REQUIRE(bytes.size() == sizeof expected);
  CHECK(std::memcmp(bytes.data(), expected, sizeof expected) == 0);
}

TEST_CASE("ros messages: big-endian CDR is read, too") {
  const unsigned char bytes[] = {0, 0, 0, 0, 0, 0,   0,   1,   0, 0, 0, 2, 0, 0,   0,
                                 3, 0, 0, 0, 4, 'm', 'a', 'p', 0, 0, 0, 0, 2, 'c', 0};
  std::string text(reinterpret_cast<const char*>(bytes), sizeof bytes);
  text.resize(4 + 20 + 8 + 72, '\0');
  const auto transforms = decode_transforms(text);
  REQUIRE(transforms.size() == 1);
  CHECK(transforms[0].header.stamp_ns == 2'000'000'003);
  CHECK(transforms[0].header.frame_id == "map");
  CHECK(transforms[0].child_frame_id == "c");
}

TEST_CASE("ros messages: a quaternion of any finite numbers gives finite angles") {
  for (const double size : {1e300, 1e154, 1.0, 1e-100, 1e-154, 1e-160, 5e-324, 0.0}) {
    CAPTURE(size);
    for (int32_t which = 0; which < 16; ++which) {
      CAPTURE(which);
      RosPose pose;
      pose.qx = which & 1 ? size : 0, pose.qy = which & 2 ? -size : 0;
      pose.qz = which & 4 ? size : 0, pose.qw = which & 8 ? size : 0;
      const RollPitchYaw angles = rotation_of(pose);
      for (const double angle : {angles.roll_rad, angles.pitch_rad, angles.yaw_rad}) CHECK(std::isfinite(angle));
    }
  }
}

TEST_CASE("ros messages: a quaternion of zeros gives no yaw") {
  RosPose pose;
  set_rotation(pose, 0, 0, 2.5);
  CHECK(known_yaw_rad(pose) == doctest::Approx(2.5));
  pose.qx = pose.qy = pose.qz = pose.qw = 0;
  CHECK(std::isnan(known_yaw_rad(pose)));
}

TEST_CASE("ros messages: odometry, transforms and rotations are read back from their CDR bytes") {
  Odometry o;
  o.header = {-1, "map"};
  o.child_frame_id = "base_link";
  o.pose.x_m = 1.5;
  set_rotation(o.pose, 0.1, -0.2, 3.0);
  o.pose_covariance[35] = 0.25;
  o.vx_mps = 77;
  o.wz_rps = -0.3;
  o.twist_covariance[0] = 9;
  const Odometry back = decode_odometry(encode_odometry(o));
  CHECK(back.header.stamp_ns == -1);
  CHECK(back.child_frame_id == "base_link");
  CHECK(back.pose.x_m == 1.5);
  CHECK(back.pose_covariance == o.pose_covariance);
  CHECK(back.twist_covariance == o.twist_covariance);
  CHECK(back.vx_mps == 77);
  CHECK(back.wz_rps == -0.3);
  const RollPitchYaw angles = rotation_of(back.pose);
  CHECK(angles.roll_rad == doctest::Approx(0.1));
  CHECK(angles.pitch_rad == doctest::Approx(-0.2));
  CHECK(angles.yaw_rad == doctest::Approx(3.0));

  RosTransform t;
  t.header = {5, "base_link"};
  t.child_frame_id = "luminar_left";
  t.pose.z_m = 0.7;
  const auto transforms = decode_transforms(encode_transforms({t, t}));
  REQUIRE(transforms.size() == 2);
  CHECK(transforms[1].child_frame_id == "luminar_left");
  CHECK(transforms[1].pose.z_m == 0.7);
}

TEST_CASE("ros messages: invalid bytes are refused with an error, wherever they end") {
  const std::string data(28, 'q');
  const std::string cloud = encode_point_cloud2(small_cloud(data)), odometry = encode_odometry({});
  for (std::size_t size = 0; size < cloud.size(); ++size)
    CHECK_THROWS_AS(decode_point_cloud2(std::string_view(cloud).substr(0, size)), std::runtime_error);
  for (std::size_t size = 0; size < odometry.size(); ++size)
    CHECK_THROWS_AS(decode_odometry(std::string_view(odometry).substr(0, size)), std::runtime_error);
  std::string huge = cloud;
  const std::size_t count_at = cloud.find("luminar_front") + 14 + 2 + 8;
  huge.replace(count_at, 4, "\xff\xff\xff\xff");
  CHECK_THROWS_WITH_AS(decode_point_cloud2(huge), doctest::Contains("declares 4294967295 elements"),
                       std::runtime_error);
}
