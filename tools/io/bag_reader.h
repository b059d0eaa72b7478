// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads recordings with topics from start to end: files of a BagFormat (formats.h), and rosbag2 folders of such files.
// The reader delivers all messages before a damage; then damage() describes the damage and its position.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

struct BagTopic {
  std::string name, type, encoding;  // "/front/points", "sensor_msgs/msg/PointCloud2", "cdr"
};

struct BagMessage {
  int32_t topic = 0;  // of topics()
  int64_t log_ns = 0;
  uint64_t number = 0;    // of the message in the recording, from 0
  std::string_view data;  // until the next call of next()
};

class BagReader {
 public:
  virtual ~BagReader() = default;
  virtual bool next(BagMessage& out) = 0;  // false: the end, or damage
  // All of them, from the start on; next() appends a topic that the file's summary lacks.
  virtual const std::vector<BagTopic>& topics() const = 0;
  virtual const std::string& damage() const = 0;  // "": none so far
  // The damage that ended the search for topics when the file was opened: topics() lacks the topics after it.
  virtual std::string damage_of_search() const { return ""; }
  virtual double progress() const = 0;       // share of the recording read, 0 to 1
  virtual std::string describe() const = 0;  // "MCAP, 12 chunks (zstd)", counted so far
};

// Throws Error if a folder holds recordings of two formats (formats.h), because the reader would ignore one of them.
void check_one_kind(const std::string& folder);
// Whether open_bag accepts the path: by the file's first bytes, or by the files in the folder.
bool is_bag(const std::string& path);
// The attachment `name` of a file, for example a log's rig.toml or map.csv. Nothing if the format has no attachments,
// or the file has none of that name.
std::optional<std::string> read_attached(const std::string& path, const std::string& name);

// Throws Error.
std::unique_ptr<BagReader> open_bag(const std::string& path);

std::unique_ptr<BagReader> open_db3(const std::string& path);
std::unique_ptr<BagReader> open_mcap(const std::string& path);

}  // namespace overtake::io
