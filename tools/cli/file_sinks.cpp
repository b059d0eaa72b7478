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

namespace {

std::vector<ViewSink*> sinks_of(std::optional<McapFile>& file, ViewSink* live) {
  std::vector<ViewSink*> sinks;
  if (file) sinks.push_back(&*file);
  if (live) sinks.push_back(live);
  return sinks;
}

}  // namespace

ViewFrames::ViewFrames(const Config& config, const std::string& path, McapImages images, ViewSink* live)
    : file_(path.empty() ? std::nullopt : std::optional<McapFile>(std::in_place, path, images)),
      view_(config, sinks_of(file_, live)) {}

void ViewFrames::add(const FinishedFrame& frame) {
  view_.add(frame.reader, {frame.number, frame.opponent, frame.cars});
  any_ = true;
  last_stamp_ns_ = frame.info.stamp_ns;
}

void ViewFrames::add_counters(const ovt_stats& stats) {
  if (any_) view_.add_counters(last_stamp_ns_, stats);
}

void ViewFrames::close(const std::string& partial) {
  if (file_) view_.close(*file_, partial);
}

void PictureSink::add(const FinishedFrame& frame) {
  if (frame.number != number_) return;
  const std::string caption = "frame " + std::to_string(number_) +
                              ", grid 10 m: points of detections and their "
                              "rectangles, confirmed tracks with id, speed, path over " +
                              fixed(frame.tracks.path_points * frame.tracks.path_step_s, 1) + " s and its " +
                              (frame.tracks.path_steady_along_m ? "70 and " : "") + "95 % ellipses";
  io::write_png(path_, draw_frame(frame.reader, config_.rig, config_.params, caption));
  drew_ = true;
}

}  // namespace overtake::cli
