// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What becomes of the frames that a detector finishes: each kind of output is a sink, a run is a list of sinks.
#pragma once

#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

struct FinishedFrame {
  ovt_reader* reader;               // stands on it
  int64_t number;                   // in the recording
  std::optional<io::Box> opponent;  // where the recording says that it is
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;  // at the frame's stamp
};

class FrameSink {
 public:
  virtual ~FrameSink() = default;
  // One frame after the other, on whichever thread finished it. Throws io::Error.
  virtual void add(const FinishedFrame& frame) = 0;
  // No frame follows: everything is in the files. Throws io::Error.
  virtual void finish() {}
};

// Gives each finished frame to every sink. What a sink throws must not travel through the library: it is kept, and no
// further frame is given to any.
class FrameSinks {
 public:
  // In the order in which they get a frame. They outlive this.
  explicit FrameSinks(std::vector<FrameSink*> sinks) : sinks_(std::move(sinks)) {}

  // Before its scans are pushed: which frame a stamp belongs to.
  void announce(const io::FrameScans& frame);
  static void on_frame(ovt_reader* reader, void* self);  // an ovt_frame_fn
  void rethrow_failure();
  void finish();

  // Runs `work` while no sink gets a frame.
  template <class Work>
  void between_frames(Work&& work) {
    const std::lock_guard lock(mutex_);
    work();
  }

 private:
  struct Announced {
    int64_t number = 0;
    std::optional<io::Box> opponent;
  };
  void add(ovt_reader* reader);

  std::vector<FrameSink*> sinks_;
  std::mutex mutex_;
  std::map<int64_t, Announced> announced_;  // by stamp
  std::exception_ptr failure_;
};

}  // namespace overtake::cli
