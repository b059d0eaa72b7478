// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Sinks that write files: tables, trace, the view's messages, the picture of one frame.
#pragma once

#include <optional>
#include <string>

#include "tools/cli/frame_sink.h"
#include "tools/cli/trace_file.h"
#include "tools/client/config.h"
#include "tools/io/csv.h"
#include "tools/view/mcap_view.h"

namespace overtake::cli {

// detections.csv, tracks.csv, timing.csv in a folder.
class CsvSink : public FrameSink {
 public:
  CsvSink(const std::string& folder, const io::Rig& rig);
  void add(const FinishedFrame& frame) override;
  void finish() override;

 private:
  void open_tables(const ovt_detections& detections, const ovt_tracks& tracks);

  const io::Rig& rig_;
  const std::string folder_;
  std::optional<io::CsvWriter> detections_, tracks_;  // from the first frame on, whose columns the headers name
  io::CsvWriter timing_;
};

class TraceSink : public FrameSink {
 public:
  TraceSink(const std::string& path, const io::Rig& rig) : trace_(path, rig) {}
  void add(const FinishedFrame& frame) override { trace_.add(frame.number, frame.reader); }
  void finish() override { trace_.finish(); }

 private:
  TraceFile trace_;
};

// The view's messages: a file, a live server, or both.
class ViewFrames : public FrameSink {
 public:
  // path: of the MCAP file, "": none. live: null: none.
  ViewFrames(const Config& config, const std::string& path, McapImages images, ViewSink* live);
  void add(const FinishedFrame& frame) override;
  bool reads_paths() const override { return true; }
  // Writes the counters with the last frame's stamp; nothing before the first frame. Read the counters outside of
  // add().
  void add_counters(const ovt_stats& stats);
  void close(const std::string& partial);

 private:
  std::optional<McapFile> file_;
  McapView view_;
  bool any_ = false;
  int64_t last_stamp_ns_ = 0;
};

// Draws one frame from above: FOLDER/frame_NUMBER.png.
class PictureSink : public FrameSink {
 public:
  static constexpr const char* kNameBegin = "frame_";
  PictureSink(int64_t number, const std::string& folder, const Config& config)
      : number_(number), path_(folder + "/" + kNameBegin + std::to_string(number) + ".png"), config_(config) {}
  void add(const FinishedFrame& frame) override;
  bool reads_paths() const override { return true; }
  bool drew() const { return drew_; }

 private:
  int64_t number_;
  std::string path_;
  const Config& config_;
  bool drew_ = false;
};

}  // namespace overtake::cli
