// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/file_sinks.h"

#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/io/output.h"
#include "tools/view/frame_picture.h"

namespace overtake::cli {
namespace {

// The folder of the tables, after a check that the two which the first frame opens can be written.
const std::string& checked(const std::string& folder) {
  if (io::OutputGuard* guard = io::OutputGuard::current())
    for (const char* name : {"/detections.csv", "/tracks.csv"}) guard->check(folder + name);
  return folder;
}

}  // namespace

CsvSink::CsvSink(const std::string& folder, const io::Rig& rig)
    : rig_(rig), folder_(checked(folder)), timing_(folder + "/timing.csv", kTimingHeader) {}

void CsvSink::open_tables(const ovt_detections& detections, const ovt_tracks& tracks) {
  if (detections_) return;
  detections_.emplace(folder_ + "/detections.csv", detections_header(detections));
  tracks_.emplace(folder_ + "/tracks.csv", tracks_header(tracks));
}

void CsvSink::add(const FinishedFrame& frame) {
  open_tables(frame.detections, frame.tracks);
  write_detections(*detections_, frame.number, frame.detections);
  write_tracks(*tracks_, frame.number, frame.info, frame.tracks);
  write_times(timing_, frame.number, frame.info.stamp_ns, rig_, frame.reader);
  finish();  // keeps the results so far after Ctrl-C or an error
}

void CsvSink::finish() {
  open_tables({}, {});  // without a frame the files have their headers only
  for (io::CsvWriter* table : {&*detections_, &*tracks_, &timing_}) table->flush();
}

void McapSink::add(const FinishedFrame& frame) {
  view_.add(frame.reader);
  any_ = true;
  last_stamp_ns_ = frame.info.stamp_ns;
}

void McapSink::add_counters(const ovt_stats& stats) {
  if (any_) view_.add_counters(last_stamp_ns_, stats);
}

void PictureSink::add(const FinishedFrame& frame) {
  if (frame.number != number_) return;
  const std::string caption = "frame " + std::to_string(number_) +
                              ", grid 10 m: points of detections and their "
                              "rectangles, confirmed tracks with id, speed, path over " +
                              fixed(frame.tracks.path_points * frame.tracks.path_step_s, 1) +
                              " s and its 95 % ellipses";
  io::write_png(path_, draw_frame(frame.reader, config_.rig, config_.params, caption));
  drew_ = true;
}

}  // namespace overtake::cli
