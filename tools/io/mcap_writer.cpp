// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/mcap_writer.h"

#include <algorithm>
#include <cerrno>

#include "tools/io/bytes.h"
#include "tools/io/error.h"
#include "tools/io/mcap_format.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

void append_record(std::string& bytes, McapOp op, std::string_view content) {
  append_value(bytes, uint8_t(op));
  append_value(bytes, uint64_t(content.size()));
  bytes.append(content);
}

std::string format_map(const std::map<std::string, std::string>& entries) {
  std::string pairs, out;
  for (const auto& [key, value] : entries) {
    append_text(pairs, key);
    append_text(pairs, value);
  }
  append_text(out, pairs);
  return out;
}

}  // namespace

McapWriter::McapWriter(const std::string& path, const McapOptions& options) : path_(path), options_(options) {
  if (options_.compression == "none") options_.compression.clear();
  if (!options_.compression.empty() && options_.compression != "lz4" && options_.compression != "zstd")
    throw Error(path, 0, "unknown compression '" + options_.compression + "' (known: none, lz4, zstd)");
  add_group({options_.chunk_bytes, false});
  file_ = std::fopen(begin_output(path).c_str(), "wb");
  if (!file_) fail_write(path, errno);
  put(kMcapMagic);
  std::string header;
  append_text(header, options_.profile);
  append_text(header, "overtake");
  put_record(uint8_t(McapOp::kHeader), header);
}

McapWriter::~McapWriter() {
  try {
    close();
  } catch (...) {  // call close() to get the error
  }
  if (file_) std::fclose(file_);
}

void McapWriter::put(std::string_view bytes) {
  if (!file_) throw Error(path_, 0, "is closed already");
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail_write(path_, errno);
  if (options_.crc) data_crc_ = update_crc32(data_crc_, bytes);
  offset_ += bytes.size();
}

void McapWriter::put_record(uint8_t opcode, std::string_view content) {
  std::string head;
  append_value(head, opcode);
  append_value(head, uint64_t(content.size()));
  put(head);
  put(content);
}

uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding, std::string_view data) {
  std::string content;
  append_text(content, name);
  append_text(content, encoding);
  append_text(content, data);
  const auto same = std::find(schemas_.begin(), schemas_.end(), content);
  if (same != schemas_.end()) return uint16_t(same - schemas_.begin() + 1);
  if (schemas_.size() >= 65535) throw Error(path_, 0, "more than 65535 schemas");
  schemas_.push_back(std::move(content));
  return uint16_t(schemas_.size());
}

int32_t McapWriter::add_group(const McapGroup& group) {
  groups_.push_back({});
  groups_.back().shape = group;
  return int32_t(groups_.size() - 1);
}

uint16_t McapWriter::add_channel(uint16_t schema, const std::string& topic, const std::string& message_encoding,
                                 const std::map<std::string, std::string>& metadata, int32_t group) {
  if (group < 0 || std::size_t(group) >= groups_.size())
    throw Error(path_, 0, "topic " + topic + " names a group that was not added");
  if (schema > schemas_.size()) throw Error(path_, 0, "topic " + topic + " names a schema that was not added");
  if (channels_.size() >= 65535) throw Error(path_, 0, "more than 65535 topics");
  const auto id = uint16_t(channels_.size() + 1);
  Channel channel;
  channel.group = group;
  append_value(channel.record, id);
  append_value(channel.record, schema);
  append_text(channel.record, topic);
  append_text(channel.record, message_encoding);
  channel.record += format_map(metadata);
  channels_.push_back(std::move(channel));
  return id;
}

// A schema's content in the record follows its id.
static std::string schema_content(const std::vector<std::string>& schemas, uint16_t id) {
  std::string content;
  append_value(content, id);
  return content + schemas[std::size_t(id - 1)];
}

// Writes schema and channel before their first message, into the group's chunk or the file.
void McapWriter::describe_channel(uint16_t channel) {
  Channel& c = channels_[std::size_t(channel - 1)];
  if (c.described) return;
  c.described = true;
  const bool in_chunk = options_.chunk_bytes > 0;
  Group& group = groups_[in_chunk ? std::size_t(c.group) : 0];
  uint16_t schema = 0;
  std::memcpy(&schema, c.record.data() + 2, 2);
  std::string records;
  group.schema_described.resize(schemas_.size());
  if (schema > 0 && !group.schema_described[std::size_t(schema - 1)]) {
    group.schema_described[std::size_t(schema - 1)] = true;
    append_record(records, McapOp::kSchema, schema_content(schemas_, schema));
  }
  append_record(records, McapOp::kChannel, c.record);
  if (in_chunk)
    group.chunk += records;
  else
    put(records);
}

void McapWriter::write(uint16_t channel, int64_t log_ns, std::string_view data, int64_t publish_ns) {
  if (channel == 0 || channel > channels_.size()) throw Error(path_, 0, "a message on a topic that was not added");
  if (log_ns < 0) throw Error(path_, 0, "a message's time is negative");
  Channel& c = channels_[std::size_t(channel - 1)];
  Group& group = groups_[std::size_t(c.group)];
  const auto time = uint64_t(log_ns);
  const auto is_full = [&] { return group.chunk.size() >= group.shape.chunk_bytes; };
  if (group.shape.whole_times && group.newest_ns != time && is_full()) end_chunk(c.group);
  describe_channel(channel);
  std::string head;
  append_value(head, uint8_t(McapOp::kMessage));
  append_value(head, uint64_t(22 + data.size()));
  append_value(head, channel);
  append_value(head, c.sequence++);
  append_value(head, time);
  append_value(head, publish_ns < 0 ? time : uint64_t(publish_ns));
  first_ns_ = message_count_ == 0 ? time : std::min(first_ns_, time);
  last_ns_ = std::max(last_ns_, time);
  ++message_count_;
  ++c.count;
  if (options_.chunk_bytes == 0) {
    put(head);
    put(data);
    return;
  }
  append_value(c.index, time);
  append_value(c.index, uint64_t(group.chunk.size()));
  group.chunk += head;
  group.chunk += data;
  group.first_ns = group.messages == 0 ? time : std::min(group.first_ns, time);
  group.last_ns = group.messages == 0 ? time : std::max(group.last_ns, time);
  group.newest_ns = time;
  ++group.messages;
  if (!group.shape.whole_times && is_full()) end_chunk(c.group);
}

void McapWriter::end_chunks() {
  for (int32_t group = 0; group < int32_t(groups_.size()); ++group) end_chunk(group);
}

void McapWriter::end_chunk(int32_t group_index) {
  Group& group = groups_[std::size_t(group_index)];
  if (group.chunk.empty()) return;
  const uint64_t chunk_start = offset_;
  const std::string records = compress_chunk(options_.compression, options_.level, group.chunk);
  std::string head;
  append_value(head, group.first_ns);
  append_value(head, group.last_ns);
  append_value(head, uint64_t(group.chunk.size()));
  append_value(head, options_.crc ? update_crc32(0, group.chunk) : 0u);
  append_text(head, options_.compression);
  append_value(head, uint64_t(records.size()));
  std::string frame;
  append_value(frame, uint8_t(McapOp::kChunk));
  append_value(frame, uint64_t(head.size() + records.size()));
  put(frame + head);
  put(records);
  const uint64_t chunk_length = offset_ - chunk_start;

  const uint64_t index_start = offset_;
  std::string index_offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    std::string& index = channels_[i].index;
    if (index.empty() || channels_[i].group != group_index) continue;
    if (options_.index) {
      append_value(index_offsets, uint16_t(i + 1));
      append_value(index_offsets, offset_);
      std::string content;
      append_value(content, uint16_t(i + 1));
      append_text(content, index);
      put_record(uint8_t(McapOp::kMessageIndex), content);
    }
    index.clear();
  }
  std::string content;
  append_value(content, group.first_ns);
  append_value(content, group.last_ns);
  append_value(content, chunk_start);
  append_value(content, chunk_length);
  append_text(content, index_offsets);
  append_value(content, offset_ - index_start);
  append_text(content, options_.compression);
  append_value(content, uint64_t(records.size()));
  append_value(content, uint64_t(group.chunk.size()));
  append_record(chunk_indexes_, McapOp::kChunkIndex, content);
  ++chunk_count_;
  group.chunk.clear();
  group.messages = 0;
  group.first_ns = group.last_ns = 0;
}

void McapWriter::add_attachment(const std::string& name, const std::string& media_type, std::string_view data,
                                int64_t log_ns) {
  end_chunks();
  std::string content;
  append_value(content, uint64_t(log_ns));
  append_value(content, uint64_t(log_ns));
  append_text(content, name);
  append_text(content, media_type);
  append_value(content, uint64_t(data.size()));
  content += data;
  append_value(content, options_.crc ? update_crc32(0, content) : 0u);
  std::string index;
  append_value(index, offset_);
  append_value(index, uint64_t(content.size()) + kMcapRecordHead);
  append_value(index, uint64_t(log_ns));
  append_value(index, uint64_t(log_ns));
  append_value(index, uint64_t(data.size()));
  append_text(index, name);
  append_text(index, media_type);
  append_record(attachment_indexes_, McapOp::kAttachmentIndex, index);
  put_record(uint8_t(McapOp::kAttachment), content);
  ++attachment_count_;
}

void McapWriter::add_metadata(const std::string& name, const std::map<std::string, std::string>& entries) {
  end_chunks();
  std::string content;
  append_text(content, name);
  content += format_map(entries);
  std::string index;
  append_value(index, offset_);
  append_value(index, uint64_t(content.size()) + kMcapRecordHead);
  append_text(index, name);
  append_record(metadata_indexes_, McapOp::kMetadataIndex, index);
  put_record(uint8_t(McapOp::kMetadata), content);
  ++metadata_count_;
}

void McapWriter::write_summary() {
  std::string data_end;
  append_value(data_end, options_.crc ? data_crc_ : 0u);
  put_record(uint8_t(McapOp::kDataEnd), data_end);
  const uint64_t summary_start = offset_;
  uint64_t offset_start = 0;
  std::string summary, offsets;
  if (options_.index) {
    const auto add_records = [&](McapOp op, const std::string& records) {
      if (records.empty()) return;
      std::string content;
      append_value(content, uint8_t(op));
      append_value(content, summary_start + summary.size());
      append_value(content, uint64_t(records.size()));
      append_record(offsets, McapOp::kSummaryOffset, content);
      summary += records;
    };
    std::string records;
    for (std::size_t i = 0; i < schemas_.size(); ++i)
      append_record(records, McapOp::kSchema, schema_content(schemas_, uint16_t(i + 1)));
    add_records(McapOp::kSchema, records);
    records.clear();
    for (const Channel& channel : channels_) append_record(records, McapOp::kChannel, channel.record);
    add_records(McapOp::kChannel, records);
    std::string statistics, counts;
    append_value(statistics, message_count_);
    append_value(statistics, uint16_t(schemas_.size()));
    append_value(statistics, uint32_t(channels_.size()));
    append_value(statistics, attachment_count_);
    append_value(statistics, metadata_count_);
    append_value(statistics, uint32_t(chunk_count_));
    append_value(statistics, first_ns_);
    append_value(statistics, last_ns_);
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      append_value(counts, uint16_t(i + 1));
      append_value(counts, channels_[i].count);
    }
    append_text(statistics, counts);
    records.clear();
    append_record(records, McapOp::kStatistics, statistics);
    add_records(McapOp::kStatistics, records);
    add_records(McapOp::kChunkIndex, chunk_indexes_);
    add_records(McapOp::kAttachmentIndex, attachment_indexes_);
    add_records(McapOp::kMetadataIndex, metadata_indexes_);
    offset_start = summary_start + summary.size();
  }
  std::string end = summary + offsets;
  append_value(end, uint8_t(McapOp::kFooter));
  append_value(end, uint64_t(20));
  append_value(end, options_.index ? summary_start : uint64_t(0));
  append_value(end, offset_start);
  append_value(end, options_.crc ? update_crc32(0, end) : 0u);
  end += kMcapMagic;
  put(end);
}

void McapWriter::close() {
  if (!file_) return;
  end_chunks();
  write_summary();
  std::FILE* file = file_;
  file_ = nullptr;
  if (std::fclose(file) != 0) fail_write(path_, errno);
}

}  // namespace overtake::io
