// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A folder of scans FRAME_SENSOR.EXT, or one such file; FRAME.EXT if the rig has one sensor or its clouds hold all
// sensors (shared_cloud). EXT is the extension of a cloud format (formats.def), but a file's first bytes determine its
// format. FRAME is the frame's number in all options and tables; it may also stand at the end, after an underscore
// (log7_000012.pcd).
//
// Stamps: absolute times in the cloud's time field, else FRAME x period. A FRAME of 12 or more digits is itself a time,
// in ms, us or ns by its magnitude. Per-point times become offsets after the scan's stamp.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::io {

// A scan, or with a shared cloud all scans of a frame, that could not be read.
struct LostFile {
  int32_t sensor;     // of a shared cloud: 0
  std::string error;  // a sentence with the path
};

class Recording {
 public:
  // Throws Error: the folder is missing or has no scan; a name has no frame number, a sensor that the rig lacks, or no
  // sensor although the rig has several; two files of one scan.
  Recording(const std::string& path, Rig rig);

  std::size_t frame_count() const { return frames_.size(); }
  int64_t frame_number(std::size_t i) const { return frames_[i].number; }
  // Reads the frame's files. At an unreadable file throws Error; with `lost`, leaves out its scans and appends it to
  // `lost`.
  FrameScans read(std::size_t i, std::vector<LostFile>* lost = nullptr) const;
  const Rig& rig() const { return rig_; }
  const std::string& path() const { return path_; }

 private:
  struct Entry {
    int64_t number;
    std::vector<std::string> paths;  // one per sensor, "": missing; a shared cloud: one
  };
  std::string path_;
  Rig rig_;
  std::vector<Entry> frames_;  // by number
};

// The sensors in the file names: {"front", "left"}; "" stands for names without a sensor. Throws Error if the folder is
// missing or has no scan.
std::set<std::string> sensor_names_in(const std::string& path);

// FRAME x period, or FRAME itself if it is a time. Throws Error if the stamp does not fit 64 bits.
int64_t stamp_of_frame(const std::string& path_in_errors, int64_t frame, int64_t period_ns);

}  // namespace overtake::io
