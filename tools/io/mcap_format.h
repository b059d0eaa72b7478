// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What writer and reader of MCAP share: record kinds, magic, checksums, compressions (https://mcap.dev/spec).
//
//   magic | Header | data section ... DataEnd | summary section | summary offset section | Footer | magic
//   a record is: opcode uint8, length uint64, content. A Chunk's content holds records again, compressed or not.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace overtake::io {

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);
inline constexpr uint64_t kMcapRecordHead = 9;  // opcode and length

enum class McapOp : uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd
};

// CRC-32 as in zip and PNG, continued from `crc`; 0 starts.
uint32_t update_crc32(uint32_t crc, std::string_view bytes);

// compression: "" none, "lz4" (frame format), "zstd". Throw std::runtime_error on anything else.
std::string compress_chunk(const std::string& compression, int32_t level, std::string_view bytes);

// A chunk of more bytes is not unpacked (writers make chunks of a few MiB), nor one beyond the memory limit.
inline constexpr uint64_t kMostMcapChunk = uint64_t(1) << 30;
// Why a chunk of `packed` bytes is not to be unpacked into `size` bytes: it cannot hold them, or they are too many. "":
// it may be. `whole`: all packed bytes are there.
std::string refuse_chunk(std::string_view compression, uint64_t packed, uint64_t size, bool whole);

// Decompresses until `size` bytes are there or the input ends or is damaged: what came out until then is in `out`.
// Returns "" when exactly `size` bytes came out, else why not; `damaged` when that is not just that the input ends.
// Resident memory grows with what really comes out, not with `size`.
std::string decompress_chunk(std::string_view compression, std::string_view bytes, uint64_t size, std::string& out,
                             bool& damaged);

}  // namespace overtake::io
