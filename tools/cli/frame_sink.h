// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A sink receives the frames that a detector finishes and makes one kind of output. A run has a list of sinks.
#pragma once

#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

struct FinishedFrame {
  ovt_reader* reader;               // positioned at this frame
  int64_t number;                   // in the recording
  std::optional<io::Box> opponent;  // its position, if the recording has it
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;                    // at the frame's stamp
  std::vector<io::KnownCar> cars = {};  // true states, if the recording has them
};

class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual bool reads_paths() const { return false; }  // of the tracks; they are not computed where no sink does
  // Receives one frame after the other, on the thread that finished the frame. Throws io::Error.
  virtual void add(const FinishedFrame& frame) = 0;
  // Called after the last frame: writes everything to the files. Throws io::Error.
  virtual void finish() {}
};

// Gives each finished frame to every sink. A sink's exception must not pass through the library: FrameSinks stores it,
// and no sink gets another frame.
class FrameSinks {
 public:
  // The sinks get each frame in this order. They must outlive this object.
  explicit FrameSinks(std::vector<FrameSink*> sinks) : sinks_(std::move(sinks)) {
    for (const FrameSink* sink : sinks_) reads_paths_ |= sink->reads_paths();
  }

  // Records which frame a stamp belongs to. Call it before pushing the frame's scans.
  void announce(const io::FrameScans& frame);
  static void on_frame(ovt_reader* reader, void* self);  // an ovt_frame_fn
  void rethrow_failure();                                // throws the stored exception, if any
  // The box files that could not be read, in words: their frames show no opponent; "": none.
  std::string note() const;
  void finish();

  // Runs `work`; no sink gets a frame meanwhile.
  template <class Work>
  void between_frames(Work&& work) {
    const std::lock_guard lock(mutex_);
    work();
  }

 private:
  struct Announced {
    int64_t number = 0;
    std::optional<io::Box> opponent;
    std::vector<io::KnownCar> cars;
  };
  void add(ovt_reader* reader);
  std::optional<io::Box> read_box(const io::FrameScans& frame);

  std::vector<FrameSink*> sinks_;
  bool reads_paths_ = false;
  std::mutex mutex_;
  std::map<int64_t, Announced> announced_;  // by stamp
  std::exception_ptr failure_;
  int64_t odd_boxes_ = 0;
  std::string first_odd_box_;
};

}  // namespace overtake::cli
