// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/scan_stream.h"

#include <utility>

#include "tools/io/bag_reader.h"
#include "tools/io/bag_stream.h"
#include "tools/io/error.h"
#include "tools/io/recording.h"
#include "tools/io/words.h"

namespace overtake::io {
namespace {

class FolderStream : public ScanStream {
 public:
  FolderStream(const std::string& path, const Rig& rig) : recording_(path, rig) {}

  // Leaves out unreadable files and counts them. Throws Error, once, if no file was readable.
  bool next(FrameScans& out) override {
    while (at_ < recording_.frame_count()) {
      std::vector<LostFile> lost;
      out = recording_.read(at_++, &lost);
      if (lost_count_ == 0 && !lost.empty()) first_loss_ = lost[0].error;
      lost_count_ += int64_t(lost.size());
      if (out.scans.empty()) continue;
      any_ = true;
      return true;
    }
    if (!std::exchange(any_, true) && lost_count_ > 0) throw Error("", 0, first_loss_);
    return false;
  }
  const std::string& damage() const override { return none_; }
  int64_t lost_count() const override { return lost_count_; }
  std::string first_loss() const override { return first_loss_; }
  double progress() const override { return double(at_) / double(recording_.frame_count()); }

 private:
  const Recording recording_;
  const std::string none_;
  std::string first_loss_;
  std::size_t at_ = 0;
  int64_t lost_count_ = 0;
  bool any_ = false;
};

}  // namespace

std::string ScanStream::losses() const { return losses_text(lost_count(), lost_noun(), first_loss()); }

std::string losses_text(int64_t count, const char* noun, const std::string& first) {
  if (count == 0) return "";
  return counted(count, noun) + " could not be read, the others are done; the first: " + first;
}

std::unique_ptr<ScanStream> open_scans(const std::string& path, const Rig& rig) {
  if (is_bag(path)) return std::make_unique<BagStream>(path, rig);
  return std::make_unique<FolderStream>(path, rig);
}

}  // namespace overtake::io
