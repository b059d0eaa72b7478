// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/recording.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

namespace fs = std::filesystem;

bool is_digits(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

struct ScanName {
  int64_t frame = -1;
  std::string sensor;  // "": none in the name
};

// FRAME_SENSOR, FRAME, or ANYTHING_FRAME.
ScanName parse_scan_name(const std::string& path, const std::string& stem) {
  const auto first = stem.find('_'), last = stem.rfind('_');
  ScanName name;
  std::string digits;
  if (is_digits(stem.substr(0, first))) {
    digits = stem.substr(0, first);
    if (first != std::string::npos) name.sensor = stem.substr(first + 1);
  } else if (last != std::string::npos && is_digits(stem.substr(last + 1))) {
    digits = stem.substr(last + 1);
  } else {
    return name;
  }
  if (!parse_integer(digits, name.frame)) throw Error(path, 0, "its frame number does not fit 64 bits");
  return name;
}

int64_t unit_ns(TimeUnit unit, const PcdColumn& column) {
  switch (unit) {
    case TimeUnit::kSeconds:
      return 1e9;
    case TimeUnit::kMilliseconds:
      return 1e6;
    case TimeUnit::kMicroseconds:
      return 1e3;
    case TimeUnit::kNanoseconds:
      return 1;
    case TimeUnit::kAuto:
      break;
  }
  return is_float(column.type) ? 1'000'000'000 : 1;
}

// Times larger than eleven days are points in time: the earliest becomes the scan's stamp. Smaller ones are offsets. A
// NaN is no time: offset 0.
void read_times(const PcdColumn& column, int64_t unit, const std::vector<int32_t>& rows, SensorScan& scan) {
  constexpr int64_t kAbsolute = 1'000'000'000'000'000;
  std::vector<int64_t> times(rows.size());
  std::vector<bool> known(rows.size());
  int64_t first = INT64_MAX;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::size_t row = std::size_t(rows[i]);
    const double value = column.value(row);
    known[i] = std::fabs(value) * double(unit) < 9.2e18;  // also not NaN
    if (!known[i]) continue;
    times[i] = !is_float(column.type) && unit == 1 ? column.integer(row) : to_nanoseconds(value, unit);
    first = std::min(first, times[i]);
  }
  const int64_t base = first != INT64_MAX && first > kAbsolute ? first : 0;
  if (base) scan.stamp_ns = base;
  scan.time_offset_ns.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    scan.time_offset_ns[i] = known[i] ? int32_t(std::clamp<int64_t>(times[i] - base, -INT32_MAX, INT32_MAX)) : 0;
}

PcdColumn take_rows(const PcdColumn& column, const std::vector<int32_t>& rows) {
  const std::size_t size = size_of(column.type);
  PcdColumn out{column.type, 1, std::vector<unsigned char>(rows.size() * size)};
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::memcpy(out.bytes.data() + i * size, column.bytes.data() + std::size_t(rows[i]) * size, size);
  return out;
}

// 64-bit layers do not fit the library's types: as 32 bits, -1 (no layer) where they are too large.
PcdColumn narrow_integers(const PcdColumn& column) {
  if (size_of(column.type) < 8 || is_float(column.type)) return column;
  PcdColumn out{PcdType::kInt32, 1, std::vector<unsigned char>(column.values() * 4)};
  for (std::size_t i = 0; i < column.values(); ++i) {
    const int64_t wide = column.integer(i);
    const int32_t narrow = wide >= 0 && wide <= INT32_MAX ? int32_t(wide) : -1;
    std::memcpy(out.bytes.data() + i * 4, &narrow, 4);
  }
  return out;
}

// The column as float, `origin` subtracted in double.
PcdColumn shift(const PcdColumn& column, double origin) {
  PcdColumn out{PcdType::kFloat32, 1, std::vector<unsigned char>(column.values() * 4)};
  for (std::size_t i = 0; i < column.values(); ++i) {
    const float value = float(column.value(i) - origin);
    std::memcpy(out.bytes.data() + i * 4, &value, 4);
  }
  return out;
}

const PcdColumn& need_role(const std::string& path, const Pcd& pcd, PcdRole role, const char* what) {
  const int32_t field = find_role(pcd.header, role);
  if (field >= 0) return pcd.columns[std::size_t(field)];
  std::vector<std::string> names;
  for (const PcdField& f : pcd.header.fields) names.push_back(f.name);
  throw Error(path, 0,
              std::string("no field gives ") + what + " (looked for " + role_aliases(role) + "; there are " +
                  join(names, ", ") + ")");
}

// The points of one sensor out of a cloud. Layers that belong to another sensor of a shared cloud are left out; layers
// that belong to none stay in, so that they are counted as bad.
SensorScan make_scan(const std::string& path, const Pcd& pcd, const Rig& rig, int32_t sensor, int64_t stamp_ns) {
  const RigSensor& model = rig.sensors[std::size_t(sensor)];
  const PcdColumn& layer = need_role(path, pcd, PcdRole::kLayer, "the layer");
  SensorScan scan;
  scan.sensor = sensor;
  scan.path = path;
  scan.stamp_ns = stamp_ns;
  scan.input_count = int32_t(pcd.header.points);
  std::vector<int32_t> rows;
  for (int32_t i = 0; i < scan.input_count; ++i) {
    bool foreign = false;
    if (rig.shared_cloud && rig.sensors.size() > 1) {
      const int64_t id = layer.integer(std::size_t(i));
      for (int32_t s = 0; s < int32_t(rig.sensors.size()); ++s)
        if (s != sensor && id >= rig.sensors[std::size_t(s)].layer_first &&
            id <= rig.sensors[std::size_t(s)].layer_last)
          foreign = true;
    }
    if (!foreign) rows.push_back(i);
  }
  scan.count = int32_t(rows.size());
  scan.x = take_rows(need_role(path, pcd, PcdRole::kX, "x"), rows);
  scan.y = take_rows(need_role(path, pcd, PcdRole::kY, "y"), rows);
  scan.z = take_rows(need_role(path, pcd, PcdRole::kZ, "z"), rows);
  for (const PcdColumn* column : {&scan.x, &scan.y, &scan.z})
    if (!is_float(column->type)) throw Error(path, 0, "the coordinates are no floating-point numbers (TYPE F)");
  if (rig.cloud_in_vehicle_frame) {
    scan.x = shift(scan.x, model.x_m);
    scan.y = shift(scan.y, model.y_m);
    scan.z = shift(scan.z, model.z_m);
  }
  scan.layer = narrow_integers(take_rows(layer, rows));
  if (scan.layer.type == PcdType::kFloat64) scan.layer = shift(scan.layer, 0);
  const int32_t intensity = find_role(pcd.header, PcdRole::kIntensity);
  if (intensity >= 0) {
    scan.intensity = take_rows(pcd.columns[std::size_t(intensity)], rows);
    if (size_of(scan.intensity.type) == 8) scan.intensity = shift(scan.intensity, 0);
  }
  const int32_t time = find_role(pcd.header, PcdRole::kTime);
  if (time >= 0) {
    const PcdColumn& column = pcd.columns[std::size_t(time)];
    read_times(column, unit_ns(rig.time_unit, column), rows, scan);
  }
  if (scan.count != scan.input_count) scan.input_index = std::move(rows);
  return scan;
}

std::vector<std::string> list_pcd_files(const std::string& path) {
  std::error_code code;
  const auto status = fs::status(path, code);
  if (!fs::exists(status)) throw Error(path, 0, "no such folder");
  if (!fs::is_directory(status)) return {path};
  std::vector<std::string> files;
  for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code))
    if (lower_case(at->path().extension().string()) == ".pcd") files.push_back(at->path().string());
  if (code) throw Error(path, 0, "cannot be listed: " + code.message());
  if (files.empty()) throw Error(path, 0, "holds no .pcd file");
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Recording::Recording(const std::string& path, Rig rig) : path_(path), rig_(std::move(rig)) {
  const auto files = list_pcd_files(path);
  const bool single_file = files.size() == 1 && files[0] == path;
  const bool one_cloud = rig_.sensors.size() == 1 || rig_.shared_cloud;
  std::map<int64_t, Entry> frames;
  for (const std::string& file : files) {
    ScanName name = parse_scan_name(file, fs::path(file).stem().string());
    if (name.frame < 0) {
      if (!single_file) throw Error(file, 0, "its name has no frame number; FRAME_SENSOR.pcd or FRAME.pcd is needed");
      name = {0, ""};
    }
    int32_t sensor = 0;
    if (!name.sensor.empty() && !rig_.shared_cloud) {
      sensor = rig_.find(name.sensor);
      if (sensor < 0)
        throw Error(file, 0,
                    "rig " + rig_.name + " has no sensor '" + name.sensor + "' (it has " + rig_.sensor_names() + ")");
    } else if (!one_cloud) {
      throw Error(file, 0,
                  "its name has no sensor, and rig " + rig_.name + " has " + std::to_string(rig_.sensors.size()) +
                      " (" + rig_.sensor_names() + "): FRAME_SENSOR.pcd is needed");
    }
    Entry& entry = frames[name.frame];
    entry.number = name.frame;
    entry.paths.resize(one_cloud ? 1 : rig_.sensors.size());
    std::string& slot = entry.paths[std::size_t(sensor)];
    if (!slot.empty()) throw Error(file, 0, "is the same scan as " + slot);
    slot = file;
  }
  for (auto& [number, entry] : frames) frames_.push_back(std::move(entry));
}

int64_t Recording::find_frame(int64_t number) const {
  for (std::size_t i = 0; i < frames_.size(); ++i)
    if (frames_[i].number == number) return int64_t(i);
  return -1;
}

FrameScans Recording::read(std::size_t i) const {
  const Entry& entry = frames_[i];
  FrameScans frame;
  frame.frame = entry.number;
  for (std::size_t p = 0; p < entry.paths.size(); ++p) {
    const std::string& path = entry.paths[p];
    if (path.empty()) continue;
    const int64_t stamp_ns = stamp_of_frame(path, entry.number, rig_.period_ns());
    const Pcd pcd = read_pcd(path);
    if (!rig_.shared_cloud) {
      frame.scans.push_back(make_scan(path, pcd, rig_, int32_t(p), stamp_ns));
      continue;
    }
    for (int32_t s = 0; s < int32_t(rig_.sensors.size()); ++s)
      frame.scans.push_back(make_scan(path, pcd, rig_, s, stamp_ns));
  }
  return frame;
}

int64_t stamp_of_frame(const std::string& path_in_errors, int64_t frame, int64_t period_ns) {
  int64_t factor = period_ns;
  if (frame >= 100'000'000'000'000'000)
    factor = 1;  // ns since 1970 has 19 digits
  else if (frame >= 100'000'000'000'000)
    factor = 1'000;  // us
  else if (frame >= 100'000'000'000)
    factor = 1'000'000;  // ms
  int64_t stamp_ns = 0;
  if (__builtin_mul_overflow(frame, factor, &stamp_ns))
    throw Error(path_in_errors, 0, "its frame number is too large for a stamp");
  return stamp_ns;
}

}  // namespace overtake::io
