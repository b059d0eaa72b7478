// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A view's messages as an MCAP file: numbers, clouds and images in chunks of their own, so that a reader of one kind
// skips the bytes of the others. All messages of a frame and a kind are in one chunk. README.md describes the log.
#pragma once

#include <string>
#include <vector>

#include "tools/io/mcap_writer.h"
#include "tools/view/view_sink.h"

namespace overtake::cli {

enum class McapImages { kNone, kLabels, kAll };

class McapFile : public ViewSink {
 public:
  explicit McapFile(const std::string& path, McapImages images = McapImages::kAll);

  void add_channel(const ViewChannel& channel) override;
  bool wants(uint16_t channel) const override;
  void write(uint16_t channel, int64_t stamp_ns, std::string_view data) override;
  bool keeps_frames() const override { return true; }
  io::McapWriter& log() { return log_; }  // for attachments, metadata, close

 private:
  struct Channel {
    uint16_t id = 0;  // in the file; 0: not in it
    bool once = false, written = false;
  };
  McapImages images_;
  io::McapWriter log_;
  int32_t numbers_, clouds_, pictures_;  // groups of chunks
  std::vector<Channel> channels_;        // by the view's id - 1
};

}  // namespace overtake::cli
