// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads a recording of any format (formats.def) once from start to end. A file's first bytes determine its format; its
// extension counts only if no format recognises the bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/io/ego_file.h"
#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::io {

class ScanStream {
 public:
  virtual ~ScanStream() = default;
  // Reads the next frame; false: the end, or damage. Recordings with topics have frame numbers from 0 in their order,
  // and a frame holds the scans of half a period. Throws Error if a cloud is not a valid scan.
  virtual bool next(FrameScans& out) = 0;
  // Returns each ego pose of the recording once, in its order. If the recording has later poses, the result reaches at
  // least one period beyond the scans delivered so far.
  virtual std::vector<EgoRow> take_ego() { return {}; }
  virtual const std::string& damage() const = 0;  // why reading ended early; "": it did not
  virtual double progress() const = 0;            // 0 to 1
  virtual bool has_ego() const { return false; }  // whether take_ego may return any
  // What could not be read so far and changes no result, in words; "": nothing.
  virtual std::string note() const { return ""; }
  // Number of files or messages that were unreadable and left out; the error of the first one.
  virtual int64_t lost_count() const { return 0; }
  virtual std::string first_loss() const { return ""; }
  virtual const char* lost_noun() const { return "file"; }
  // "2 files could not be read, the others are done; the first: ..."; "": all could be read.
  std::string losses() const;
};

std::string losses_text(int64_t count, const char* noun, const std::string& first);  // as ScanStream::losses

// Throws Error: the path is missing, has no known format, or has no scan of the rig's sensors.
std::unique_ptr<ScanStream> open_scans(const std::string& path, const Rig& rig);

}  // namespace overtake::io
