// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads MCAP files in the order they were written, from start to end, or from a time on by the index of chunks. A file
// may be truncated, have flipped bits or wrong counts: every message before the damage is delivered, then damage()
// describes the damage and its position. A chunk with a wrong checksum is damaged as a whole.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

struct McapSchema {
  std::string name, encoding, data;
};

struct McapChannel {
  std::string topic, message_encoding;
  uint16_t schema_id = 0;  // 0: none
  std::map<std::string, std::string> metadata;
};

struct McapMessage {
  uint16_t channel_id = 0;
  uint32_t sequence = 0;
  int64_t log_ns = 0, publish_ns = 0;
  std::string_view data;  // until the next call of next()
};

struct McapAttachment {
  std::string name, media_type, data;
  int64_t log_ns = 0;
};

class McapReader {
 public:
  // Throws Error if the file is missing, not MCAP, or of another major version.
  explicit McapReader(const std::string& path);
  ~McapReader();
  McapReader(const McapReader&) = delete;
  McapReader& operator=(const McapReader&) = delete;

  bool next(McapMessage& out);  // false: the end, or damage
  // The next message is the first one of the first chunk that has a message of this log time or later; `is_first`: no
  // chunk is before it. Attachments and metadata before it are not read. False, and nothing changes: the file has no
  // index, or no such chunk.
  bool seek(int64_t log_ns, bool& is_first);
  // Finds every channel and schema: in the summary if its checksum is right, else by reading the whole file. No message
  // can be read afterwards.
  void list_channels();
  // Finds every attachment and all metadata without reading the data between them; damage ends the search. No message
  // can be read afterwards.
  void list_attachments();
  // Why reading ended before the end of the file's data: "" if it did not.
  const std::string& damage() const { return damage_; }
  const std::string& path() const { return path_; }
  const std::string& profile() const { return profile_; }
  // Channels known so far; a delivered message's channel is always known.
  const std::map<uint16_t, McapChannel>& channels() const { return channels_; }
  const std::map<uint16_t, McapSchema>& schemas() const { return schemas_; }
  const std::vector<McapAttachment>& attachments() const { return attachments_; }
  const std::map<std::string, std::map<std::string, std::string>>& metadata() const { return metadata_; }
  uint64_t chunk_count() const { return chunk_count_; }
  const std::map<std::string, uint64_t>& compressions() const { return compressions_; }  // number of chunks of each
  uint64_t position() const { return offset_; }
  uint64_t file_bytes() const { return file_bytes_; }

 private:
  bool read_file(uint64_t size, std::string& out);  // false: fewer bytes remain; `out` holds those
  bool next_record();
  void open_chunk(std::string_view content, bool cut);
  bool take_record(uint8_t opcode, std::string_view content, McapMessage* message);
  bool read_summary();  // also chunks_
  void fail(uint64_t at, const std::string& sentence);
  bool hold(uint64_t bytes);  // false, and damage: it would keep more than the memory limit

  std::string path_, profile_, damage_;
  std::FILE* file_ = nullptr;
  uint64_t file_bytes_ = 0, offset_ = 0, record_at_ = 0, held_bytes_ = 0;
  bool ended_ = false;
  uint8_t opcode_ = 0;                         // of record_
  std::string record_, chunk_, chunk_damage_;  // of the file; content of its chunk
  std::string_view chunk_rest_;
  std::map<uint16_t, McapChannel> channels_;
  std::map<uint16_t, McapSchema> schemas_;
  std::vector<McapAttachment> attachments_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::map<std::string, uint64_t> compressions_;
  uint64_t chunk_count_ = 0;
  struct ChunkPlace {
    int64_t last_ns;
    uint64_t offset;
  };
  std::vector<ChunkPlace> chunks_;  // in the order of the file
  bool knows_chunks_ = false;
};

}  // namespace overtake::io
