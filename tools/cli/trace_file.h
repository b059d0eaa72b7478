// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A run as Chrome trace JSON, for ui.perfetto.dev or chrome://tracing. Each thread has a lane with the stages of each
// frame: sequence, frame number, sensor (the pushing thread and the intake share a lane). Above them are the frames,
// from the start of their first segmentation to their tracks. Times are microseconds after the first span of the file.
//
//   lane "frames"            |---- 7 ----|      |---- 8 ----|              async events: frames may overlap
//   lane "pushing thread"  load load load     load load load
//   lane "worker 0"               segment [project gaps ... clusters] merge gate pose track
//   lane "worker 1"               segment [...]   segment [...]
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/rig.h"

namespace overtake::cli {

class TraceFile {
 public:
  // Creates the file. Throws io::Error.
  TraceFile(std::string path, const io::Rig& rig);
  ~TraceFile();  // finishes the file as far as possible
  TraceFile(const TraceFile&) = delete;
  TraceFile& operator=(const TraceFile&) = delete;

  // Adds the reader's frame. `frame`: its number in the recording. Throws io::Error.
  void add(int64_t frame, ovt_reader* reader);
  // Names the lanes and ends the JSON. Throws io::Error when the disk is full.
  void finish();

 private:
  void add_span(const char* name, const ovt_span& span, int64_t sequence, int64_t frame, const char* sensor);
  void add_frame(const ovt_span& span, int64_t sequence, int64_t frame);
  void append_time(int64_t ns);  // as microseconds
  void write(bool last);

  std::string path_, pending_;
  std::vector<std::string> sensor_names_;  // as JSON strings
  void* file_ = nullptr;
  bool any_ = false;
  int64_t first_ns_ = 0;
  int32_t worker_count_ = 0;  // lanes seen, besides the pushing thread's
};

}  // namespace overtake::cli
