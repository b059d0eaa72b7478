// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/bag_reader.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>

#include "tools/io/error.h"
#include "tools/io/mcap_format.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSqliteMagic("SQLite format 3\0", 16);

std::string first_bytes(const std::string& path) {
  std::string bytes(16, '\0');
  std::error_code code;
  if (!fs::is_regular_file(path, code)) return "";
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) return "";
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file));
  std::fclose(file);
  return bytes;
}

bool is_mcap(const std::string& path) { return first_bytes(path).starts_with(kMcapMagic.substr(0, 5)); }
bool is_db3(const std::string& path) { return first_bytes(path) == kSqliteMagic; }

bool has_extension(const fs::path& path, const char* extension) {
  return lower_case(path.extension().string()) == extension;
}

// Topics are known when all channels are: the summary is not believed, so a first pass finds them.
class McapBag : public BagReader {
 public:
  explicit McapBag(const std::string& path) : reader_(path) {
    McapReader first(path);
    first.list_channels();
    damage_of_search_ = first.damage();
    for (const auto& [id, channel] : first.channels()) {
      index_of_[id] = int32_t(topics_.size());
      const auto schema = first.schemas().find(channel.schema_id);
      topics_.push_back(
          {channel.topic, schema == first.schemas().end() ? "" : schema->second.name, channel.message_encoding});
    }
  }

  bool next(BagMessage& out) override {
    McapMessage message;
    if (!reader_.next(message)) return false;
    const auto topic = index_of_.find(message.channel_id);
    if (topic == index_of_.end()) {  // the summary did not know it
      index_of_[message.channel_id] = int32_t(topics_.size());
      const McapChannel& channel = reader_.channels().at(message.channel_id);
      const auto schema = reader_.schemas().find(channel.schema_id);
      topics_.push_back(
          {channel.topic, schema == reader_.schemas().end() ? "" : schema->second.name, channel.message_encoding});
    }
    out.topic = index_of_[message.channel_id];
    out.log_ns = message.log_ns;
    out.number = number_++;
    out.data = message.data;
    return true;
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  const std::string& damage() const override { return reader_.damage(); }
  std::string damage_of_search() const override { return damage_of_search_; }
  double progress() const override {
    return double(reader_.position()) / double(std::max<uint64_t>(1, reader_.file_bytes()));
  }
  std::string describe() const override {
    std::string text = "MCAP";
    if (!reader_.profile().empty()) text += " of profile " + reader_.profile();
    std::vector<std::string> kinds;
    for (const auto& [name, count] : reader_.compressions()) kinds.push_back(std::to_string(count) + " " + name);
    text += kinds.empty() ? ", no chunks" : ", chunks: " + join(kinds, ", ");
    for (const McapAttachment& attachment : reader_.attachments())
      text += ", attachment " + attachment.name + " (" + std::to_string(attachment.data.size()) + " bytes)";
    return text;
  }

 private:
  McapReader reader_;
  std::vector<BagTopic> topics_;
  std::map<uint16_t, int32_t> index_of_;
  uint64_t number_ = 0;
  std::string damage_of_search_;
};

// The parts of a recording that was split, one after the other.
class SplitBag : public BagReader {
 public:
  explicit SplitBag(std::vector<std::string> files) : files_(std::move(files)) {
    for (const std::string& file : files_) {
      const auto part = open_bag(file);
      for (const BagTopic& topic : part->topics())
        if (find(topic.name) < 0) topics_.push_back(topic);
      if (damage_of_search_.empty() && !part->damage_of_search().empty())
        damage_of_search_ = file + ": " + part->damage_of_search();
    }
    open();
  }

  bool next(BagMessage& out) override {
    while (part_) {
      if (part_->next(out)) {
        out.topic = find(part_->topics()[std::size_t(out.topic)].name);
        out.number = number_++;
        return true;
      }
      if (!part_->damage().empty()) {
        damage_ = files_[at_] + ": " + part_->damage();
        return false;
      }
      ++at_;
      open();
    }
    return false;
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  const std::string& damage() const override { return damage_; }
  std::string damage_of_search() const override { return damage_of_search_; }
  double progress() const override { return part_ ? (double(at_) + part_->progress()) / double(files_.size()) : 1.0; }
  std::string describe() const override {
    return std::to_string(files_.size()) + " files, " + (part_ ? part_ : open_bag(files_.back()))->describe();
  }

 private:
  int32_t find(const std::string& name) const {
    for (std::size_t i = 0; i < topics_.size(); ++i)
      if (topics_[i].name == name) return int32_t(i);
    return -1;
  }
  void open() { part_ = at_ < files_.size() ? std::shared_ptr<BagReader>(open_bag(files_[at_])) : nullptr; }

  std::vector<std::string> files_;
  std::vector<BagTopic> topics_;
  std::shared_ptr<BagReader> part_;
  std::size_t at_ = 0;
  uint64_t number_ = 0;
  std::string damage_, damage_of_search_;
};

// Files of a rosbag2 folder: race_2.db3 before race_10.db3.
std::vector<std::string> bag_files(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    if (has_extension(at->path(), ".db3") || has_extension(at->path(), ".mcap")) files.push_back(at->path().string());
  std::sort(files.begin(), files.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return files;
}

}  // namespace

std::optional<std::string> read_attached(const std::string& path, const std::string& name) {
  if (!is_mcap(path)) return std::nullopt;
  McapReader reader(path);
  reader.list_attachments();
  for (const McapAttachment& attachment : reader.attachments())
    if (attachment.name == name) return attachment.data;
  return std::nullopt;
}

void check_one_kind(const std::string& folder) {
  std::map<std::string, std::string> first;  // by kind: the first name of it
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    for (const char* kind : {".pcd", ".bin", ".db3", ".mcap"}) {
      if (!has_extension(at->path(), kind)) continue;
      const std::string name = at->path().filename().string();
      const auto known = first.emplace(kind, name).first;
      known->second = std::min(known->second, name);
    }
  if (first.size() < 2) return;
  const std::string &one = first.begin()->first, &other = std::next(first.begin())->first;
  throw Error(folder, 0,
              "holds recordings of two kinds, " + one + " (" + first[one] + ") and " + other + " (" + first[other] +
                  "): move one of them away, or name a file");
}

bool is_bag(const std::string& path) {
  std::error_code code;
  if (fs::is_directory(path, code)) return !bag_files(path).empty();
  return is_mcap(path) || is_db3(path) || has_extension(path, ".mcap") || has_extension(path, ".db3");
}

std::unique_ptr<BagReader> open_mcap(const std::string& path) { return std::make_unique<McapBag>(path); }

std::unique_ptr<BagReader> open_bag(const std::string& path) {
  std::error_code code;
  if (fs::is_directory(path, code)) {
    check_one_kind(path);
    auto files = bag_files(path);
    if (files.empty()) throw Error(path, 0, "holds neither .db3 nor .mcap files");
    if (files.size() == 1) return open_bag(files[0]);
    return std::make_unique<SplitBag>(std::move(files));
  }
  if (is_mcap(path)) return open_mcap(path);
  if (is_db3(path)) return open_db3(path);
  if (!fs::exists(path, code)) throw Error(path, 0, "no such file");
  if (fs::is_regular_file(path, code) && fs::file_size(path, code) == 0) throw Error(path, 0, "is empty (0 bytes)");
  refuse_special_file(path);
  throw Error(path, 0, "is neither MCAP nor SQLite (rosbag2): its first bytes differ");
}

}  // namespace overtake::io
