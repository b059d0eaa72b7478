// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/sensor_scan.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/io/error.h"
#include "tools/io/line_recovery.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

int64_t unit_ns(TimeUnit unit, const CloudColumn& column) {
  switch (unit) {
    case TimeUnit::kSeconds: return 1e9;
    case TimeUnit::kMilliseconds: return 1e6;
    case TimeUnit::kMicroseconds: return 1e3;
    case TimeUnit::kNanoseconds: return 1;
    case TimeUnit::kAuto: break;
  }
  if (!is_float(column.type)) return 1;
  // Floating-point times of a clock that counts from 1970 show their unit.
  double most = 0.0;
  for (std::size_t i = 0; i < column.values(); ++i)
    if (const double value = column.value(i); value > most && value < 9.2e18) most = value;
  return most > 1e17 ? 1 : most > 1e14 ? 1'000 : most > 1e11 ? 1'000'000 : 1'000'000'000;
}

// Times above eleven days are absolute: the earliest becomes the scan's stamp. Smaller times are offsets; beside
// absolute ones they belong to pixels without a return. These, and a NaN, become offset 0.
void read_times(const CloudColumn& column, int64_t unit, SensorScan& scan) {
  constexpr int64_t kAbsolute = 1'000'000'000'000'000;
  const std::size_t count = column.values();
  std::vector<int64_t> times(count);
  std::vector<bool> known(count);
  int64_t first = INT64_MAX;  // absolute
  for (std::size_t i = 0; i < count; ++i) {
    const double value = column.value(i);
    known[i] = std::fabs(value) * double(unit) < 9.2e18;  // also not NaN
    if (!known[i]) continue;
    times[i] = !is_float(column.type) && unit == 1 ? column.integer(i) : to_nanoseconds(value, unit);
    if (times[i] > kAbsolute) first = std::min(first, times[i]);
  }
  const int64_t base = first != INT64_MAX ? first : 0;
  if (base) {
    scan.stamp_ns = base;
    for (std::size_t i = 0; i < count; ++i) known[i] = known[i] && times[i] >= base;
  }
  scan.time_offset_ns.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    scan.time_offset_ns[i] = known[i] ? int32_t(std::clamp<int64_t>(times[i] - base, -INT32_MAX, INT32_MAX)) : 0;
}

// The whole column, or only the given rows.
CloudColumn take(CloudColumn& column, const std::vector<int32_t>* rows) {
  if (!rows) return std::move(column);
  const std::size_t size = size_of(column.type);
  CloudColumn out{column.type, 1, std::vector<unsigned char>(rows->size() * size)};
  for (std::size_t i = 0; i < rows->size(); ++i)
    std::memcpy(out.bytes.data() + i * size, column.bytes.data() + std::size_t((*rows)[i]) * size, size);
  return out;
}

// Converts 64-bit layers to 32 bits, which the library accepts; -1 (no layer) if a value is too large.
CloudColumn narrow_integers(CloudColumn column) {
  if (size_of(column.type) < 8 || is_float(column.type)) return column;
  CloudColumn out{ValueType::kInt32, 1, std::vector<unsigned char>(column.values() * 4)};
  for (std::size_t i = 0; i < column.values(); ++i) {
    const int64_t wide = column.integer(i);
    const int32_t narrow = wide >= 0 && wide <= INT32_MAX ? int32_t(wide) : -1;
    std::memcpy(out.bytes.data() + i * 4, &narrow, 4);
  }
  return out;
}

// Converts the column to float, after subtracting `origin` in double.
CloudColumn shift(const CloudColumn& column, double origin) {
  CloudColumn out{ValueType::kFloat32, 1, std::vector<unsigned char>(column.values() * 4)};
  for (std::size_t i = 0; i < column.values(); ++i) {
    const float value = float(column.value(i) - origin);
    std::memcpy(out.bytes.data() + i * 4, &value, 4);
  }
  return out;
}

std::string missing_role(const Cloud& cloud, CloudRole role, const char* what) {
  std::vector<std::string> names;
  for (const CloudField& f : cloud.fields) names.push_back(f.name);
  return std::string("no field gives ") + what + " (looked for " + role_aliases(role) + "; there are " +
         join(names, ", ") + ")";
}

CloudColumn& need_role(const std::string& path, Cloud& cloud, CloudRole role, const char* what) {
  const int32_t field = find_role(cloud.fields, role);
  if (field < 0) throw Error(path, 0, missing_role(cloud, role, what));
  return cloud.columns[std::size_t(field)];
}

// Rows of a shared cloud that do not belong to another sensor.
std::vector<int32_t> own_rows(const CloudColumn& layer, const Rig& rig, int32_t sensor) {
  std::vector<int32_t> rows;
  for (int32_t i = 0; i < int32_t(layer.values()); ++i) {
    bool foreign = false;
    const int64_t id = layer.integer(std::size_t(i));
    for (int32_t s = 0; s < int32_t(rig.sensors.size()); ++s)
      if (s != sensor && id >= rig.sensors[std::size_t(s)].layer_first && id <= rig.sensors[std::size_t(s)].layer_last)
        foreign = true;
    if (!foreign) rows.push_back(i);
  }
  return rows;
}

void recover_layer(const std::string& path, const RigSensor& model, const std::string& otherwise, SensorScan& scan) {
  const CloudColumn x = shift(scan.x, 0), y = shift(scan.y, 0), z = shift(scan.z, 0);
  const auto floats = [](const CloudColumn& column) { return static_cast<const float*>(column.data()); };
  const RecoveredLines lines = recover_lines(floats(x), floats(y), floats(z), scan.count, model);
  if (lines.line.empty() && scan.count > 0)
    throw Error(path, 0, otherwise + "; neither the order nor the elevations of the points show lines");
  scan.layer = {ValueType::kUint16, 1, std::vector<unsigned char>(lines.line.size() * 2)};
  if (scan.count > 0) std::memcpy(scan.layer.bytes.data(), lines.line.data(), scan.layer.bytes.size());
  scan.lines_how = lines.how;
}

}  // namespace

SensorScan make_scan(const std::string& path, Cloud cloud, const Rig& rig, int32_t sensor, int64_t stamp_ns) {
  const RigSensor& model = rig.sensors[std::size_t(sensor)];
  SensorScan scan;
  scan.sensor = sensor;
  scan.path = path;
  scan.stamp_ns = stamp_ns;
  scan.input_count = int32_t(cloud.points);
  const bool shared = rig.shared_cloud && rig.sensors.size() > 1;
  const int32_t layer = find_role(cloud.fields, CloudRole::kLayer);
  const std::string no_layer = layer < 0 ? missing_role(cloud, CloudRole::kLayer, "the layer") : "";
  if (shared && layer < 0) throw Error(path, 0, no_layer);
  std::vector<int32_t> own;
  if (shared) own = own_rows(cloud.columns[std::size_t(layer)], rig, sensor);
  const std::vector<int32_t>* rows = shared ? &own : nullptr;
  scan.count = shared ? int32_t(own.size()) : scan.input_count;
  scan.x = take(need_role(path, cloud, CloudRole::kX, "x"), rows);
  scan.y = take(need_role(path, cloud, CloudRole::kY, "y"), rows);
  scan.z = take(need_role(path, cloud, CloudRole::kZ, "z"), rows);
  for (const CloudColumn* column : {&scan.x, &scan.y, &scan.z})
    if (!is_float(column->type)) throw Error(path, 0, "the coordinates are not floating-point numbers (TYPE F)");
  if (rig.cloud_in_vehicle_frame) {
    scan.x = shift(scan.x, model.x_m);
    scan.y = shift(scan.y, model.y_m);
    scan.z = shift(scan.z, model.z_m);
  }
  if (layer >= 0)
    scan.layer = narrow_integers(take(cloud.columns[std::size_t(layer)], rows));
  else
    recover_layer(path, model, no_layer, scan);
  if (scan.layer.type == ValueType::kFloat64) scan.layer = shift(scan.layer, 0);
  const int32_t intensity = find_role(cloud.fields, CloudRole::kIntensity);
  if (intensity >= 0) {
    scan.intensity = take(cloud.columns[std::size_t(intensity)], rows);
    if (size_of(scan.intensity.type) == 8) scan.intensity = shift(scan.intensity, 0);
  }
  const int32_t time = find_role(cloud.fields, CloudRole::kTime);
  if (time >= 0) {
    const CloudColumn column = take(cloud.columns[std::size_t(time)], rows);
    read_times(column, unit_ns(rig.time_unit, column), scan);
  }
  if (scan.count != scan.input_count) scan.input_index = std::move(own);
  return scan;
}

}  // namespace overtake::io
