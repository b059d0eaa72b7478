// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/scan_stream.h"

#include "tools/io/bag_reader.h"
#include "tools/io/bag_stream.h"
#include "tools/io/recording.h"

namespace overtake::io {
namespace {

class FolderStream : public ScanStream {
 public:
  FolderStream(const std::string& path, const Rig& rig) : recording_(path, rig) {}

  bool next(FrameScans& out) override {
    if (at_ == recording_.frame_count()) return false;
    out = recording_.read(at_++);
    return true;
  }
  const std::string& damage() const override { return none_; }
  double progress() const override { return double(at_) / double(recording_.frame_count()); }

 private:
  const Recording recording_;
  const std::string none_;
  std::size_t at_ = 0;
};

}  // namespace

std::unique_ptr<ScanStream> open_scans(const std::string& path, const Rig& rig) {
  if (is_bag(path)) return std::make_unique<BagStream>(path, rig);
  return std::make_unique<FolderStream>(path, rig);
}

}  // namespace overtake::io
