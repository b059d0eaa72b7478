// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Converts a PointCloud2 of any layout to columns: fields by name, offset and type, rows with padding, either byte
// order.
#pragma once

#include <string>
#include <vector>

#include "tools/io/cloud.h"
#include "tools/io/ros_messages.h"

namespace overtake::io {

// The fields as those of a Cloud, in the same order, so that find_role finds their roles. A field of an unknown type or
// of several values has a count that no role accepts.
std::vector<CloudField> fields_of(const PointCloud2& cloud);

// Copies the fields that have a role (find_role); the columns of other fields stay empty. Throws Error if the layout
// does not fit the data; `path` names the message in errors.
Cloud read_cloud_message(const std::string& path, const PointCloud2& cloud);

// The inverse: packs the columns of `points` into points without padding and describes them in `cloud`. Returns the
// bytes that cloud.data must point to.
std::string make_cloud_message(const Cloud& points, const RosHeader& header, PointCloud2& cloud);

// "x float32 at 0, y float32 at 4, ...; 22 bytes a point"
std::string describe_layout(const PointCloud2& cloud);

}  // namespace overtake::io
