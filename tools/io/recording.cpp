// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/recording.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>

#include "tools/io/bag_reader.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/output.h"
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

std::string extension_of(const std::string& path) {
  const Format* format = find_format_by_name(path);
  return format ? format->extension : fs::path(path).extension().string();
}

// The file itself, or the files of a folder with the extension of a cloud format. Does not look into the files.
std::vector<std::string> list_files(const std::string& path) {
  std::error_code code;
  const auto status = fs::status(path, code);
  if (!fs::exists(status)) throw Error(path, 0, "no such folder");
  refuse_special_file(path);
  if (!fs::is_directory(status)) return {path};
  check_one_kind(path);
  std::vector<std::string> files;
  for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code))
    if (const Format* format = find_format_by_name(at->path().string()); format && format->cloud)
      files.push_back(at->path().string());
  if (code) throw Error(path, 0, "cannot be listed: " + code.message());
  if (files.empty()) {
    const std::string partial = why_partial(path);
    throw Error(path, 0,
                "holds no recording: no " + list_extensions() + " file" + (partial.empty() ? "" : "; " + partial));
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Recording::Recording(const std::string& path, Rig rig) : path_(path), rig_(std::move(rig)) {
  const auto files = list_files(path);
  const bool single_file = files.size() == 1 && files[0] == path;
  const bool one_cloud = rig_.sensors.size() == 1 || rig_.shared_cloud;
  std::map<int64_t, Entry> frames;
  for (const std::string& file : files) {
    ScanName name = parse_scan_name(file, stem_of(file));
    if (name.frame < 0) {
      if (!single_file)
        throw Error(file, 0,
                    "its name has no frame number; FRAME_SENSOR" + extension_of(file) + " or FRAME" +
                        extension_of(file) + " is needed");
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
                      " (" + rig_.sensor_names() + "): FRAME_SENSOR" + extension_of(file) + " is needed");
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

FrameScans Recording::read(std::size_t i, std::vector<LostFile>* lost) const {
  const Entry& entry = frames_[i];
  FrameScans frame;
  frame.frame = entry.number;
  for (std::size_t p = 0; p < entry.paths.size(); ++p) {
    const std::string& path = entry.paths[p];
    if (path.empty()) continue;
    std::vector<SensorScan> scans;
    try {
      const int64_t stamp_ns = stamp_of_frame(path, entry.number, rig_.period_ns());
      const Cloud cloud = read_cloud(path);
      const int32_t first = rig_.shared_cloud ? 0 : int32_t(p);
      const int32_t last = rig_.shared_cloud ? int32_t(rig_.sensors.size()) - 1 : first;
      for (int32_t s = first; s <= last; ++s) scans.push_back(make_scan(path, cloud, rig_, s, stamp_ns));
    } catch (const Error& error) {
      if (!lost) throw;
      lost->push_back({int32_t(p), error.what()});
      continue;
    }
    std::move(scans.begin(), scans.end(), std::back_inserter(frame.scans));
  }
  return frame;
}

std::set<std::string> sensor_names_in(const std::string& path) {
  std::set<std::string> names;
  for (const std::string& file : list_files(path)) names.insert(parse_scan_name(file, stem_of(file)).sensor);
  return names;
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
