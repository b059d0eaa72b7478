// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A folder of scans FRAME_SENSOR.EXT, or FRAME.EXT where there is one sensor or the rig says that one cloud holds all
// sensors; or one such file. EXT is that of a format of clouds (formats.def); what is in a file is found by looking at
// its first bytes. FRAME is a number and is what "frame" means everywhere; it may also stand at the end, after an
// underscore (log7_000012.pcd).
//
// Stamps: absolute times in the cloud's time field, else FRAME x period; a FRAME of 12 digits and more is a time
// itself, in ms, us or ns by its size. Per-point times become offsets after the scan's stamp.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::io {

class Recording {
 public:
  // Throws Error: no such folder, no scan in it, a name without a frame number, a sensor that the rig does not have, a
  // file without a sensor where the rig has several, two files of one scan.
  Recording(const std::string& path, Rig rig);

  std::size_t frame_count() const { return frames_.size(); }
  int64_t frame_number(std::size_t i) const { return frames_[i].number; }
  int64_t find_frame(int64_t number) const;  // index, -1: none
  // Reads the frame's files. A file that cannot be read throws Error, or costs its scans where `lost` is given: it
  // takes the sentences.
  FrameScans read(std::size_t i, std::vector<std::string>* lost = nullptr) const;
  const Rig& rig() const { return rig_; }
  const std::string& path() const { return path_; }

 private:
  struct Entry {
    int64_t number;
    std::vector<std::string> paths;  // one per sensor, "" where missing; a shared cloud: one
  };
  std::string path_;
  Rig rig_;
  std::vector<Entry> frames_;  // by number
};

// The sensors that the files' names name: {"front", "left"}, "" for a file that names none. Throws Error: no such
// folder, no scan in it.
std::set<std::string> sensor_names_in(const std::string& path);

// FRAME x period, or FRAME itself where it is a time. Throws when it does not fit 64 bits.
int64_t stamp_of_frame(const std::string& path_in_errors, int64_t frame, int64_t period_ns);

}  // namespace overtake::io
