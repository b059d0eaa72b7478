// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Odometry and TF in CDR: any bytes give a message or an error. Writing and reading a message gives the same message,
// and the angles of a pose are finite. The first byte selects the message.
#include <cmath>
#include <stdexcept>

#include "tests/fuzz/bytes.h"
#include "tools/io/memory_limit.h"
#include "tools/io/ros_messages.h"

using namespace overtake;

namespace {

void check_angles(const io::RosPose& pose) {
  for (const double v : {pose.qx, pose.qy, pose.qz, pose.qw})
    if (!std::isfinite(v)) return;
  const io::RollPitchYaw angles = io::rotation_of(pose);
  for (const double v : {angles.roll_rad, angles.pitch_rad, angles.yaw_rad}) OVT_FUZZ_REQUIRE(std::isfinite(v));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  io::set_memory_limit(uint64_t(16) << 20);
  fuzz::Bytes in(data, size);
  const bool transforms = in.byte() % 2 == 1;
  try {
    if (transforms) {
      const auto read = io::decode_transforms(in.rest());
      for (const io::RosTransform& transform : read) check_angles(transform.pose);
      const std::string bytes = io::encode_transforms(read);
      OVT_FUZZ_REQUIRE(io::encode_transforms(io::decode_transforms(bytes)) == bytes);
    } else {
      const io::Odometry read = io::decode_odometry(in.rest());
      check_angles(read.pose);
      const std::string bytes = io::encode_odometry(read);
      OVT_FUZZ_REQUIRE(io::encode_odometry(io::decode_odometry(bytes)) == bytes);
    }
  } catch (const std::runtime_error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
