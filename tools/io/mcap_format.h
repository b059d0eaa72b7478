// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Shared by the writer and the reader of MCAP: record kinds, magic, checksums, compressions (https://mcap.dev/spec).
//
//   magic | Header | data section ... DataEnd | summary section | summary offset section | Footer | magic
//   a record is: opcode uint8, length uint64, content. A Chunk's content is again records, compressed or not.
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

// CRC-32 as in zip and PNG, continued from `crc`; start with 0.
uint32_t update_crc32(uint32_t crc, std::string_view bytes);

// compression: "" none, "lz4" (frame format), "zstd". Throw std::runtime_error on anything else.
std::string compress_chunk(const std::string& compression, int32_t level, std::string_view bytes);

// A larger chunk is not decompressed (writers make chunks of a few MiB), nor one beyond the memory limit.
inline constexpr uint64_t kMostMcapChunk = uint64_t(1) << 30;
// Why a chunk of `packed` bytes must not be decompressed to `size` bytes: it cannot contain them, or they are too many.
// "": no reason. `whole`: all compressed bytes exist.
std::string refuse_chunk(std::string_view compression, uint64_t packed, uint64_t size, bool whole);

// Decompresses until there are `size` bytes or the input ends or is damaged; `out` holds the output so far. Returns ""
// for exactly `size` bytes, else the reason; `damaged` unless the input just ends. Resident memory grows with the real
// output, not with `size`.
std::string decompress_chunk(std::string_view compression, std::string_view bytes, uint64_t size, std::string& out,
                             bool& damaged);

}  // namespace overtake::io
