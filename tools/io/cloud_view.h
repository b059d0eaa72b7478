// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The columns of a PointCloud2 where they lie in the message, for a live sensor: no copy of the points.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/cloud.h"
#include "tools/io/rig.h"
#include "tools/io/ros_messages.h"

namespace overtake::io {

struct ColumnView {
  const char* data = nullptr;  // null: the cloud has no such field
  std::size_t bytes = 0, stride = 0;
  ValueType type = ValueType::kFloat32;
};

// One scan, with the meaning that make_scan (sensor_scan.h) gives it. Valid as long as the message.
struct CloudView {
  int32_t count = 0;
  int64_t stamp_ns = 0;
  ColumnView x, y, z, layer, intensity, time;  // time: integer ns after the stamp
};

// Returns "" if the sensor's points can be read in place, else the reason; then make_scan copies and converts them, or
// throws what is wrong with them.
std::string view_in_place(const PointCloud2& cloud, const Rig& rig, int32_t sensor, CloudView& view);

}  // namespace overtake::io
