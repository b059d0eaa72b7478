// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Writes MCAP files (https://mcap.dev/spec): chunks, checksums, message and chunk index, statistics, attachments,
// metadata. tools/io/README.md lists the topics, schemas and encodings of an Overtake log.
//
//   McapWriter log("race.mcap");
//   const uint16_t schema = log.add_schema("nav_msgs/msg/Odometry", "ros2msg", kOdometrySchema);
//   const uint16_t ego = log.add_channel(schema, "/ego/odometry", "cdr");
//   log.write(ego, stamp_ns, encode_odometry(odometry));
//   log.close();
//
// A channel belongs to a group, and each group has its own open chunk: a reader of one group's topics skips the chunks
// of the others. Group 0 is there; add_group makes further ones.
//
// The same calls give the same bytes. One thread. Throws Error when the disk is full or a name is wrong.
#pragma once

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

struct McapOptions {
  std::string profile = "ros2";      // "" if the messages are not those of ROS 2
  std::string compression = "zstd";  // of chunks: "none", "lz4", "zstd"
  int32_t level = 1;                 // of the compression
  uint64_t chunk_bytes = 4 << 20;    // a chunk ends with the message that fills it; 0: no chunks, hence no index
  bool index = true;                 // false: neither message index nor summary
  bool crc = true;
};

// A group's chunks. whole_times: all messages of one log time are in one chunk, which ends with the last of them.
struct McapGroup {
  uint64_t chunk_bytes = 4 << 20;  // of messages, before compression
  bool whole_times = false;
};

class McapWriter {
 public:
  explicit McapWriter(const std::string& path, const McapOptions& options = {});
  ~McapWriter();  // closes the file; call close() yourself to detect a full disk
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  // encoding: "ros2msg", "protobuf" (a FileDescriptorSet), "jsonschema". Equal schemas get the same id.
  uint16_t add_schema(const std::string& name, const std::string& encoding, std::string_view data);
  // The number of a new group of chunks. Without chunks (chunk_bytes 0 of the options) it has no effect.
  int32_t add_group(const McapGroup& group);
  // message_encoding: "cdr", "protobuf", "json". schema 0: none.
  uint16_t add_channel(uint16_t schema, const std::string& topic, const std::string& message_encoding,
                       const std::map<std::string, std::string>& metadata = {}, int32_t group = 0);
  // Times in ns, not negative. publish_ns < 0: log_ns. Sequence numbers count per channel from 0.
  void write(uint16_t channel, int64_t log_ns, std::string_view data, int64_t publish_ns = -1);
  void add_attachment(const std::string& name, const std::string& media_type, std::string_view data,
                      int64_t log_ns = 0);
  void add_metadata(const std::string& name, const std::map<std::string, std::string>& entries);
  void close();  // ends the chunk and writes the summary; must be the last call

 private:
  struct Channel {
    std::string record;
    int32_t group = 0;
    bool described = false;  // already in the data section
    uint32_t sequence = 0;
    uint64_t count = 0;
    std::string index;  // of the group's open chunk: pairs of time and offset
  };
  struct Group {
    McapGroup shape;
    std::string chunk;                                                // the open one; empty: none
    uint64_t first_ns = 0, last_ns = 0, newest_ns = 0, messages = 0;  // of it; newest_ns: of the last message written
    std::vector<bool> schema_described;                               // a chunk is read without those of other groups
  };
  void put(std::string_view bytes);
  void put_record(uint8_t opcode, std::string_view content);
  void describe_channel(uint16_t channel);
  void end_chunk(int32_t group);
  void end_chunks();
  void write_summary();

  std::string path_;
  McapOptions options_;
  std::FILE* file_ = nullptr;
  uint64_t offset_ = 0;
  uint32_t data_crc_ = 0;
  std::vector<std::string> schemas_;  // content of record id - 1
  std::vector<Channel> channels_;     // id - 1
  std::vector<Group> groups_;
  uint64_t message_count_ = 0, chunk_count_ = 0, first_ns_ = 0, last_ns_ = 0;
  uint32_t attachment_count_ = 0, metadata_count_ = 0;
  std::string chunk_indexes_, attachment_indexes_, metadata_indexes_;  // records
};

}  // namespace overtake::io
