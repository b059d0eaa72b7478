// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A recording of any format (formats.def), read once from front to back. What a file is is found by looking at it; its
// name counts only where its bytes have no mark.
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
  // The next frame; false: the end, or damage. Frames of recordings with topics are numbered from 0 as they come, and
  // one holds the scans of half a period. Throws Error where what is read is no scan.
  virtual bool next(FrameScans& out) = 0;
  // Ego poses of the recording itself, in its order, at least up to a period behind the scans delivered so far (where
  // there are any); each is returned once.
  virtual std::vector<EgoRow> take_ego() { return {}; }
  virtual const std::string& damage() const = 0;  // why the end came too early; "": it did not
  virtual double progress() const = 0;            // 0 to 1
  virtual bool has_ego() const { return false; }  // whether take_ego may return any
  // Scans of their own files that could not be read and were left out; the first one's sentence.
  virtual int64_t lost_count() const { return 0; }
  virtual std::string first_loss() const { return ""; }
};

// Throws Error: not there, of no known kind, without a scan of the rig's sensors.
std::unique_ptr<ScanStream> open_scans(const std::string& path, const Rig& rig);

}  // namespace overtake::io
