// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A PointCloud2 as columns, in whatever layout it comes: fields by name, offset and type, rows with padding, either
// byte order.
#pragma once

#include <string>
#include <vector>

#include "tools/io/cloud.h"
#include "tools/io/ros_messages.h"

namespace overtake::io {

// The fields that mean something to a scan (find_role); others are not copied, so theirs are empty columns. Throws
// Error where the layout does not fit the data; `path` names the message.
Cloud read_cloud_message(const std::string& path, const PointCloud2& cloud);

// The other way: the columns of `points` one behind the other in each point, without padding. Returns the data the
// message borrows.
std::string make_cloud_message(const Cloud& points, const RosHeader& header, PointCloud2& cloud);

// "x float32 at 0, y float32 at 4, ...; 22 bytes a point"
std::string describe_layout(const PointCloud2& cloud);

}  // namespace overtake::io
