// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the messages of a view (mcap_view.h) go: into a file, or to the clients of a live run.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace overtake::cli {

enum class ViewKind {
  kNumbers,  // small: transforms, scenes, JSON
  kCloud,
  kImage,
  kLabelImage
};

struct ViewChannel {
  uint16_t id = 0;                                                    // from 1, in the order of add_channel
  std::string topic, encoding, schema, schema_encoding, schema_data;  // as in MCAP
  ViewKind kind = ViewKind::kNumbers;
  bool once = false;  // one message is enough: a sink wants it until it has it
};

class ViewSink {
 public:
  virtual ~ViewSink() = default;
  // Called once per channel, before its first message.
  virtual void add_channel(const ViewChannel& channel) = 0;
  // False: nobody takes this channel's next message, so that it need not be encoded.
  virtual bool wants(uint16_t channel) const = 0;
  // Called only for a channel that the sink wants. Throws io::Error.
  virtual void write(uint16_t channel, int64_t stamp_ns, std::string_view data) = 0;
  // The messages between these two calls are those of one frame.
  virtual void begin_frame() {}
  virtual void end_frame() {}
  // Whether the record of all frames (frames_record.h) is written to this sink at the end.
  virtual bool keeps_frames() const { return false; }
};

}  // namespace overtake::cli
