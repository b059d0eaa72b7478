// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The recording format MCAP (formats.def).
#include <algorithm>
#include <map>

#include "tools/io/bag_reader.h"
#include "tools/io/formats.h"
#include "tools/io/mcap_format.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

// topics() must be complete from the start: a first reader lists the channels (McapReader::list_channels).
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
    if (topic == index_of_.end()) {  // the summary lacked it
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

// The first bytes, which all versions of MCAP share.
bool looks_like_mcap(std::string_view head) { return head.starts_with(kMcapMagic.substr(0, 5)); }

std::optional<std::string> read_mcap_attached(const std::string& path, const std::string& name) {
  McapReader reader(path);
  reader.list_attachments();
  for (const McapAttachment& attachment : reader.attachments())
    if (attachment.name == name) return attachment.data;
  return std::nullopt;
}

}  // namespace

std::unique_ptr<BagReader> open_mcap(const std::string& path) { return std::make_unique<McapBag>(path); }

const BagFormat mcap_format = {looks_like_mcap, open_mcap, read_mcap_attached};

}  // namespace overtake::io
