// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/bag_reader.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>

#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::io {
namespace {

namespace fs = std::filesystem;

// Reads the parts of a split recording one after the other.
class SplitBag : public BagReader {
 public:
  explicit SplitBag(std::vector<std::string> files) : files_(std::move(files)) {
    for (const std::string& file : files_) {
      std::unique_ptr<BagReader> part;
      try {
        part = open_bag(file);
      } catch (const Error& error) {
        // A recorder that was stopped hard leaves an empty or a cut last file.
        if (file != files_.back()) throw;
        damage_of_end_ = error.what();
        break;
      }
      for (const BagTopic& topic : part->topics())
        if (find(topic.name) < 0) topics_.push_back(topic);
      if (damage_of_search_.empty() && !part->damage_of_search().empty())
        damage_of_search_ = file + ": " + part->damage_of_search();
    }
    if (!damage_of_end_.empty()) files_.pop_back();
    if (damage_of_search_.empty()) damage_of_search_ = damage_of_end_;
    open();
  }

  bool next(BagMessage& out) override {
    while (part_) {
      if (part_->next(out)) {
        const BagTopic& topic = part_->topics()[std::size_t(out.topic)];
        out.topic = find(topic.name);
        if (out.topic < 0) {  // the part's summary lacked it
          out.topic = int32_t(topics_.size());
          topics_.push_back(topic);
        }
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
    damage_ = damage_of_end_;
    return false;
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  const std::string& damage() const override { return damage_; }
  std::string damage_of_search() const override { return damage_of_search_; }
  double progress() const override { return part_ ? (double(at_) + part_->progress()) / double(files_.size()) : 1.0; }
  std::string describe() const override {
    return counted(int64_t(files_.size()), "file") + ", " + (part_ ? part_ : open_bag(files_.back()))->describe();
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
  std::string damage_of_end_;  // why the last file cannot be opened
};

// Files of a rosbag2 folder: race_2.db3 before race_10.db3.
std::vector<std::string> bag_files(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    if (const Format* format = find_format_by_name(at->path().string()); format && format->bag)
      files.push_back(at->path().string());
  std::sort(files.begin(), files.end(), [](const std::string& a, const std::string& b) {
    return a.size() != b.size() ? a.size() < b.size() : a < b;
  });
  return files;
}

// `ros2 bag record --compression-mode file` compresses whole files.
void refuse_compressed(const std::string& folder) {
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    if (const std::string name = at->path().string(); name.ends_with(".db3.zstd") || name.ends_with(".mcap.zstd"))
      throw Error(name, 0, "is compressed as a whole; decompress it first (zstd -d)");
}

}  // namespace

std::optional<std::string> read_attached(const std::string& path, const std::string& name) {
  const Format* format = find_format_by_mark(read_head(path));
  return format && format->bag && format->bag->read_attached ? format->bag->read_attached(path, name) : std::nullopt;
}

void check_one_kind(const std::string& folder) {
  std::map<std::string, std::string> first;  // by kind: name of its first file
  std::error_code code;
  for (fs::directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    const Format* format = find_format_by_name(at->path().string());
    if (!format) continue;
    const std::string name = at->path().filename().string();
    const auto known = first.emplace(format->extension, name).first;
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
  const Format* format = find_format(path);
  return format && format->bag;
}

std::unique_ptr<BagReader> open_bag(const std::string& path) {
  std::error_code code;
  std::string names, extensions;  // "MCAP nor SQLite (rosbag2)"
  for (const Format& format : formats()) {
    if (!format.bag) continue;
    names = format.name + (names.empty() ? "" : " nor " + names);
    extensions += (extensions.empty() ? "" : " nor ") + std::string(format.extension);
  }
  if (fs::is_directory(path, code)) {
    check_one_kind(path);
    auto files = bag_files(path);
    if (files.empty()) refuse_compressed(path);
    if (files.empty()) throw Error(path, 0, "holds neither " + extensions + " files");
    if (files.size() == 1) return open_bag(files[0]);
    return std::make_unique<SplitBag>(std::move(files));
  }
  const Format* format = find_format_by_mark(read_head(path));
  if (format && format->bag) return format->bag->open(path);
  if (!fs::exists(path, code)) throw Error(path, 0, "no such file");
  if (fs::is_regular_file(path, code) && fs::file_size(path, code) == 0) throw Error(path, 0, "is empty (0 bytes)");
  refuse_special_file(path);
  throw Error(path, 0, "is neither " + names + ": its first bytes differ");
}

}  // namespace overtake::io
