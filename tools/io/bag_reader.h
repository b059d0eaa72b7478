// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Recordings with topics, read from front to back: files of a BagFormat (formats.h), rosbag2 folders of them.
// Messages before a damage are delivered; damage() then says where and what it is.
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
  virtual bool next(BagMessage& out) = 0;                   // false: the end, or damage
  virtual const std::vector<BagTopic>& topics() const = 0;  // all of them, from the start on
  virtual const std::string& damage() const = 0;            // "": none so far
  // What ended the search for topics, before next() was called: those behind it are not in topics().
  virtual std::string damage_of_search() const { return ""; }
  virtual double progress() const = 0;       // share of the recording read, 0 to 1
  virtual std::string describe() const = 0;  // "MCAP, 12 chunks (zstd)": of what was read so far
};

// Throws Error where a folder holds recordings of two formats (formats.h): one would be left out.
void check_one_kind(const std::string& folder);
// Whether open_bag takes it: by its first bytes, or by what the folder holds.
bool is_bag(const std::string& path);
// What is attached to a file under a name: the log's own rig.toml or map.csv. Nothing where files of its format have
// no attachments, or this one has none of that name.
std::optional<std::string> read_attached(const std::string& path, const std::string& name);

// Throws Error.
std::unique_ptr<BagReader> open_bag(const std::string& path);

std::unique_ptr<BagReader> open_db3(const std::string& path);
std::unique_ptr<BagReader> open_mcap(const std::string& path);

}  // namespace overtake::io
