// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/mcap_file.h"

namespace overtake::cli {
namespace {

// A chunk of numbers is some five frames: a seek reads one, and a log that was cut off lacks the numbers of as many.
constexpr uint64_t kNumbersBytes = 512 << 10, kCloudsBytes = 2 << 20, kImagesBytes = 2 << 20;

io::McapOptions options_of_view() {
  io::McapOptions options;
  options.profile = "";
  options.chunk_bytes = kNumbersBytes;
  return options;
}

}  // namespace

McapFile::McapFile(const std::string& path, McapImages images)
    : images_(images),
      log_(path, options_of_view()),
      numbers_(log_.add_group({kNumbersBytes, true})),
      clouds_(log_.add_group({kCloudsBytes, true})),
      pictures_(log_.add_group({kImagesBytes, true})) {}

void McapFile::add_channel(const ViewChannel& channel) {
  channels_.resize(channel.id);
  const bool is_image = channel.kind == ViewKind::kImage, is_labels = channel.kind == ViewKind::kLabelImage;
  if ((is_image && images_ != McapImages::kAll) || (is_labels && images_ == McapImages::kNone)) return;
  const int32_t group = channel.kind == ViewKind::kCloud ? clouds_ : is_image || is_labels ? pictures_ : numbers_;
  const uint16_t schema = log_.add_schema(channel.schema, channel.schema_encoding, channel.schema_data);
  channels_.back() = {log_.add_channel(schema, channel.topic, channel.encoding, {}, group), channel.once, false};
}

bool McapFile::wants(uint16_t channel) const {
  const Channel& c = channels_[std::size_t(channel - 1)];
  return c.id != 0 && !(c.once && c.written);
}

void McapFile::write(uint16_t channel, int64_t stamp_ns, std::string_view data) {
  Channel& c = channels_[std::size_t(channel - 1)];
  log_.write(c.id, stamp_ns, data);
  c.written = true;
}

}  // namespace overtake::cli
