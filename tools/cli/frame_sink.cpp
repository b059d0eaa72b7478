// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/frame_sink.h"

#include "tools/client/session.h"
#include "tools/io/box_file.h"
#include "tools/io/error.h"
#include "tools/io/words.h"

namespace overtake::cli {

// The box is only shown, so an odd one ends no run.
std::optional<io::Box> FrameSinks::read_box(const io::FrameScans& frame) {
  try {
    return io::read_box_beside(frame);
  } catch (const io::Error& error) {
    if (odd_boxes_++ == 0) first_odd_box_ = error.what();
    return std::nullopt;
  }
}

std::string FrameSinks::note() const {
  if (odd_boxes_ == 0) return "";
  return io::counted(odd_boxes_, "box", "boxes") + " of the opponent could not be read; the first: " + first_odd_box_;
}

void FrameSinks::announce(const io::FrameScans& frame) {
  const std::lock_guard lock(mutex_);
  const Announced announced{frame.frame, frame.opponent ? frame.opponent : read_box(frame), frame.cars};
  for (const io::SensorScan& scan : frame.scans) announced_[scan.stamp_ns] = announced;
}

void FrameSinks::on_frame(ovt_reader* reader, void* self) {
  auto& sinks = *static_cast<FrameSinks*>(self);
  const std::lock_guard lock(sinks.mutex_);
  try {
    if (!sinks.failure_) sinks.add(reader);
  } catch (...) {
    sinks.failure_ = std::current_exception();
  }
}

void FrameSinks::add(ovt_reader* reader) {
  FinishedFrame frame{reader, 0, std::nullopt, {}, {}, {}};
  check(ovt_read_info(reader, &frame.info), "frame");
  if (!reads_paths_) check(ovt_set_path_horizon(reader, 0.0), "paths");
  check(ovt_read_detections(reader, &frame.detections), "detections");
  check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &frame.tracks), "tracks");
  frame.number = frame.info.sequence;
  const auto known = announced_.find(frame.info.first_stamp_ns);
  if (known != announced_.end()) {
    frame.number = known->second.number;
    frame.opponent = known->second.opponent;
    frame.cars = known->second.cars;
  }
  announced_.erase(announced_.begin(), known);
  for (FrameSink* sink : sinks_) sink->add(frame);
}

void FrameSinks::rethrow_failure() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
}

void FrameSinks::finish() {
  const std::lock_guard lock(mutex_);
  for (FrameSink* sink : sinks_) sink->finish();
}

}  // namespace overtake::cli
