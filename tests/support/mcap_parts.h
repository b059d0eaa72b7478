// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// MCAP files record by record, for contents that McapWriter does not write: wrong sizes and checksums.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tools/io/bytes.h"
#include "tools/io/mcap_format.h"

namespace overtake::test {

inline std::string mcap_record(io::McapOp op, std::string_view content) {
  std::string out;
  io::append_value(out, uint8_t(op));
  io::append_value(out, uint64_t(content.size()));
  return out.append(content);
}

inline std::string mcap_head() {
  std::string content;
  io::append_text(content, "ros2");
  io::append_text(content, "");
  return std::string(io::kMcapMagic) + mcap_record(io::McapOp::kHeader, content);
}

inline std::string mcap_tail() {
  return mcap_record(io::McapOp::kDataEnd, std::string(4, '\0')) +
         mcap_record(io::McapOp::kFooter, std::string(20, '\0')) + std::string(io::kMcapMagic);
}

inline std::string mcap_schema(uint16_t id, std::string_view name, std::string_view data) {
  std::string content;
  io::append_value(content, id);
  io::append_text(content, name);
  io::append_text(content, "ros2msg");
  io::append_text(content, data);
  return mcap_record(io::McapOp::kSchema, content);
}

inline std::string mcap_channel(uint16_t id, uint16_t schema, std::string_view topic) {
  std::string content;
  io::append_value(content, id);
  io::append_value(content, schema);
  io::append_text(content, topic);
  io::append_text(content, "cdr");
  io::append_value(content, uint32_t(0));
  return mcap_record(io::McapOp::kChannel, content);
}

inline std::string mcap_message(uint16_t channel, int64_t log_ns, std::string_view data) {
  std::string content;
  io::append_value(content, channel);
  io::append_value(content, uint32_t(0));
  io::append_value(content, log_ns);
  io::append_value(content, log_ns);
  return mcap_record(io::McapOp::kMessage, content.append(data));
}

// A chunk with `packed` as its content. crc 0: none.
inline std::string mcap_chunk(std::string_view compression, uint64_t declared, std::string_view packed,
                              uint32_t crc = 0) {
  std::string content;
  io::append_value(content, uint64_t(0));
  io::append_value(content, uint64_t(0));
  io::append_value(content, declared);
  io::append_value(content, crc);
  io::append_text(content, compression);
  io::append_value(content, uint64_t(packed.size()));
  return mcap_record(io::McapOp::kChunk, content.append(packed));
}

// A Zstandard frame that decompresses to `blocks` times 128 KiB of zeros, with 4 bytes each.
inline std::string zstd_zeros(std::size_t blocks) {
  std::string out("\x28\xb5\x2f\xfd\x00\x38", 6);  // no size, a window of 128 KiB
  for (std::size_t i = 0; i < blocks; ++i) {
    const uint32_t head = uint32_t(1) << 20 | 1u << 1 | uint32_t(i + 1 == blocks);  // 2^17 times one byte
    for (uint32_t k = 0; k < 3; ++k) out += char(head >> (8 * k) & 255);
    out += '\0';
  }
  return out;
}

}  // namespace overtake::test
