// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/cloud_view.h"

#include <bit>

#include "tools/io/cloud_message.h"

namespace overtake::io {
namespace {

// The field of a role as a column; data stays null without such a field. Returns the reason if it cannot be read there.
std::string view_field(const PointCloud2& cloud, const std::vector<CloudField>& fields, CloudRole role,
                       ColumnView& view) {
  const int32_t index = find_role(fields, role);
  if (index < 0) return "";
  const PointField& field = cloud.fields[std::size_t(index)];
  const CloudField& known = fields[std::size_t(index)];
  const std::size_t size = size_of(known.type);
  if (uint64_t(field.offset) + size > cloud.point_step) return "field '" + field.name + "' lies outside of a point";
  view.data = cloud.data.data() + field.offset;
  view.stride = cloud.point_step;
  view.bytes = cloud.data.size() - field.offset;
  view.type = known.type;
  return "";
}

}  // namespace

std::string view_in_place(const PointCloud2& cloud, const Rig& rig, int32_t sensor, CloudView& view) {
  if (rig.shared_cloud && rig.sensors.size() > 1) return "the sensors share the cloud";
  if (rig.cloud_in_vehicle_frame) return "the points are in the vehicle frame";
  if (cloud.is_bigendian != (std::endian::native == std::endian::big)) return "it has another byte order";
  const uint64_t count = uint64_t(cloud.width) * cloud.height;
  const uint64_t row = uint64_t(cloud.width) * cloud.point_step;
  if (count == 0) return "it has no points";
  if (count > uint64_t(INT32_MAX) || count * cloud.point_step > cloud.data.size()) return "it lacks points";
  if (cloud.height > 1 && cloud.row_step != row) return "its rows have padding";
  view = CloudView();
  view.count = int32_t(count);
  view.stamp_ns = cloud.header.stamp_ns;
  const std::vector<CloudField> fields = fields_of(cloud);
  struct Wanted {
    CloudRole role;
    ColumnView CloudView::*column;
  };
  for (const Wanted& wanted : {Wanted{CloudRole::kX, &CloudView::x},
                               {CloudRole::kY, &CloudView::y},
                               {CloudRole::kZ, &CloudView::z},
                               {CloudRole::kLayer, &CloudView::layer},
                               {CloudRole::kIntensity, &CloudView::intensity},
                               {CloudRole::kTime, &CloudView::time}})
    if (const std::string why = view_field(cloud, fields, wanted.role, view.*wanted.column); !why.empty()) return why;
  for (const ColumnView* column : {&view.x, &view.y, &view.z})
    if (!column->data || !is_float(column->type)) return "it has no coordinates in floating point";
  if (!view.layer.data)
    return "it has no ring field: the " + std::to_string(rig.sensors[std::size_t(sensor)].rows) +
           " lines are recovered from the points";
  // The library takes neither 64-bit layers nor absolute times, and the reader of recordings narrows wide intensities.
  if (view.layer.type == ValueType::kFloat64) return "its ring field is float64";
  if (size_of(view.intensity.type) == 8) return "its intensity field has 64 bits";
  const bool nanoseconds = rig.time_unit == TimeUnit::kAuto || rig.time_unit == TimeUnit::kNanoseconds;
  if (view.time.data && (is_float(view.time.type) || !nanoseconds)) return "its time field is not in integer ns";
  return "";
}

}  // namespace overtake::io
