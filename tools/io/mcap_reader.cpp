// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/mcap_reader.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>

#include "tools/io/bytes.h"
#include "tools/io/error.h"
#include "tools/io/mcap_format.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr uint64_t kPerMapByte = 16;  // memory of a map's nodes per byte of a record

std::map<std::string, std::string> read_map(ByteReader& reader) {
  std::map<std::string, std::string> out;
  ByteReader pairs(reader.text());
  while (!pairs.empty() && pairs.ok()) {
    const std::string key(pairs.text());
    out[key] = std::string(pairs.text());
  }
  return out;
}

}  // namespace

McapReader::McapReader(const std::string& path) : path_(path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) throw Error(path, 0, "is a folder");
  refuse_special_file(path);
  file_bytes_ = std::filesystem::file_size(path, code);
  file_ = code ? nullptr : std::fopen(path.c_str(), "rb");
  if (!file_) throw Error(path, 0, "cannot be read: " + std::string(std::strerror(code ? code.value() : errno)));
  std::string magic;
  if (!read_file(kMcapMagic.size(), magic) || magic != kMcapMagic) {
    std::fclose(file_);
    file_ = nullptr;
    const bool other = magic.size() == 8 && magic.compare(0, 5, kMcapMagic.substr(0, 5)) == 0;
    throw Error(path, 0,
                other ? "is MCAP of another major version than 0" : "is not an MCAP file: its first bytes differ");
  }
}

McapReader::~McapReader() {
  if (file_) std::fclose(file_);
}

void McapReader::fail(uint64_t at, const std::string& sentence) {
  if (damage_.empty()) damage_ = "damaged at byte " + std::to_string(at) + ": " + sentence;
  ended_ = true;
}

// Counts the memory that is kept beyond a record: schemas, channels, attachments, metadata.
bool McapReader::hold(uint64_t bytes) {
  held_bytes_ += bytes;
  const std::string beyond = beyond_memory(held_bytes_, "keeping its schemas, channels and attachments");
  if (beyond.empty()) return true;
  fail(record_at_, beyond);
  return false;
}

bool McapReader::read_file(uint64_t size, std::string& out) {
  const uint64_t left = file_bytes_ - std::min(file_bytes_, offset_);
  out.resize(std::size_t(std::min(size, left)));  // declared lengths are first checked against the file
  const std::size_t got = out.empty() ? 0 : std::fread(out.data(), 1, out.size(), file_);
  out.resize(got);
  offset_ += got;
  return got == size;
}

// Reads one record of the file. take_record handles messages; next() opens a chunk and continues in it.
bool McapReader::next_record() {
  record_at_ = offset_;
  std::string head;
  if (!read_file(kMcapRecordHead, head)) {
    fail(record_at_, "the file ends in the middle, without its footer");
    return false;
  }
  ByteReader reader(head);
  const auto opcode = reader.value<uint8_t>();
  const auto size = reader.value<uint64_t>();
  if (McapOp(opcode) == McapOp::kDataEnd || McapOp(opcode) == McapOp::kFooter) {
    ended_ = true;  // the summary follows: it contains nothing new
    if (file_bytes_ - std::min(file_bytes_, offset_) < size) fail(record_at_, "the file ends in the middle");
    return false;
  }
  if (opcode == 0) {
    fail(record_at_, "a record of kind 0, which MCAP does not have");
    return false;
  }
  const uint64_t there = std::min(size, file_bytes_ - std::min(file_bytes_, offset_));
  if (const std::string beyond = beyond_memory(there, "a record"); !beyond.empty()) {
    fail(record_at_, beyond);
    return false;
  }
  const bool whole = read_file(size, record_);
  opcode_ = opcode;
  if (McapOp(opcode) == McapOp::kChunk) {
    open_chunk(record_, !whole);
    return !ended_;
  }
  if (!whole)
    fail(record_at_,
         "a record of " + std::to_string(size) + " bytes, of which " + std::to_string(record_.size()) + " are there");
  return whole;
}

void McapReader::open_chunk(std::string_view content, bool cut) {
  ByteReader reader(content);
  reader.value<uint64_t>();  // first and last time: the messages contain them
  reader.value<uint64_t>();
  const auto size = reader.value<uint64_t>();
  const auto crc = reader.value<uint32_t>();
  const std::string compression(reader.text().substr(0, 64));
  const auto packed = reader.value<uint64_t>();
  if (!reader.ok()) return fail(record_at_, "a chunk ends in its head");
  std::string_view bytes = reader.rest();
  if (packed < bytes.size()) bytes = bytes.substr(0, std::size_t(packed));
  const bool short_of = bytes.size() < packed;
  const bool ends_early = cut || short_of;
  bool damaged = false;
  std::string wrong = refuse_chunk(compression, bytes.size(), size, !ends_early);
  if (!wrong.empty()) return fail(record_at_, "a chunk cannot be unpacked: " + wrong);
  wrong = decompress_chunk(compression, bytes, size, chunk_, damaged);
  if (!wrong.empty() && (damaged || !ends_early))  // the output before the detected damage may already be wrong
    return fail(record_at_, "a chunk cannot be unpacked: " + wrong);
  if (!ends_early && crc != 0 && update_crc32(0, chunk_) != crc) return fail(record_at_, "a chunk fails its checksum");
  if (ends_early)
    wrong = "a chunk of " + std::to_string(packed) + " bytes, of which " + std::to_string(bytes.size()) + " are there";
  chunk_damage_ = wrong;  // reported after the decompressed part is delivered
  chunk_rest_ = chunk_;
  ++chunk_count_;
  ++compressions_[compression.empty() ? "none" : compression];
}

bool McapReader::take_record(uint8_t opcode, std::string_view content, McapMessage* message) {
  ByteReader reader(content);
  switch (McapOp(opcode)) {
    case McapOp::kHeader:
      profile_ = std::string(reader.text());
      reader.text();
      break;
    case McapOp::kSchema: {
      const auto id = reader.value<uint16_t>();
      McapSchema schema;
      schema.name = std::string(reader.text());
      schema.encoding = std::string(reader.text());
      schema.data = std::string(reader.text());
      if (!reader.ok() || id == 0 || schemas_.contains(id)) break;  // writers may repeat them
      if (!hold(content.size())) return false;
      schemas_[id] = std::move(schema);
      break;
    }
    case McapOp::kChannel: {
      const auto id = reader.value<uint16_t>();
      McapChannel channel;
      channel.schema_id = reader.value<uint16_t>();
      channel.topic = std::string(reader.text());
      channel.message_encoding = std::string(reader.text());
      channel.metadata = read_map(reader);
      if (!reader.ok()) break;
      const auto known = channels_.find(id);
      if (known != channels_.end() && known->second.topic != channel.topic) {
        fail(record_at_, "topic " + std::to_string(id) + " is described twice, differently");
        return false;
      }
      if (known != channels_.end()) break;
      if (!hold(content.size() * kPerMapByte)) return false;
      channels_[id] = std::move(channel);
      break;
    }
    case McapOp::kMessage: {
      message->channel_id = reader.value<uint16_t>();
      message->sequence = reader.value<uint32_t>();
      message->log_ns = int64_t(reader.value<uint64_t>());
      message->publish_ns = int64_t(reader.value<uint64_t>());
      message->data = reader.rest();
      if (!reader.ok()) break;
      if (!channels_.contains(message->channel_id)) {
        fail(record_at_, "a message of topic " + std::to_string(message->channel_id) + ", which no record describes");
        return false;
      }
      return true;
    }
    case McapOp::kAttachment: {
      McapAttachment attachment;
      attachment.log_ns = int64_t(reader.value<uint64_t>());
      reader.value<uint64_t>();
      attachment.name = std::string(reader.text());
      attachment.media_type = std::string(reader.text());
      const std::string_view data = reader.take(reader.value<uint64_t>());
      const auto crc = reader.value<uint32_t>();
      if (!reader.ok()) break;
      if (crc != 0 && update_crc32(0, content.substr(0, content.size() - reader.rest().size() - 4)) != crc) {
        fail(record_at_, "attachment '" + attachment.name.substr(0, 64) + "' fails its checksum");
        return false;
      }
      if (!hold(content.size())) return false;
      attachment.data = std::string(data);
      attachments_.push_back(std::move(attachment));
      break;
    }
    case McapOp::kMetadata: {
      if (!hold(content.size() * kPerMapByte)) return false;
      const std::string name(reader.text());
      metadata_[name] = read_map(reader);
      break;
    }
    default: break;  // indexes, and kinds that later versions add
  }
  if (!reader.ok()) fail(record_at_, "a record of kind " + std::to_string(opcode) + " is shorter than its content");
  return false;
}

bool McapReader::read_summary() {
  constexpr uint64_t kFooter = kMcapRecordHead + 20, kTail = kFooter + 8;
  std::string tail;
  if (file_bytes_ < offset_ + kTail || std::fseek(file_, -long(kTail), SEEK_END) != 0) return false;
  tail.resize(kTail);
  if (std::fread(tail.data(), 1, tail.size(), file_) != tail.size()) return false;
  ByteReader footer(tail);
  if (McapOp(footer.value<uint8_t>()) != McapOp::kFooter || footer.value<uint64_t>() != 20) return false;
  const auto start = footer.value<uint64_t>();
  footer.value<uint64_t>();
  const auto crc = footer.value<uint32_t>();
  if (start < kMcapMagic.size() || start > file_bytes_ - kTail || crc == 0) return false;
  const uint64_t most = std::min(uint64_t(1) << 28, memory_limit() / 2);
  if (file_bytes_ - kTail - start > most || std::fseek(file_, long(start), SEEK_SET) != 0) return false;
  offset_ = start;
  std::string summary;
  if (!read_file(file_bytes_ - 12 - start, summary) || update_crc32(0, summary) != crc) return false;
  ByteReader records(std::string_view(summary).substr(0, summary.size() - (kFooter - 4)));
  McapMessage none;
  while (!records.empty()) {
    const auto opcode = records.value<uint8_t>();
    const std::string_view content = records.take(records.value<uint64_t>());
    if (!records.ok()) break;
    if (McapOp(opcode) == McapOp::kSchema || McapOp(opcode) == McapOp::kChannel) take_record(opcode, content, &none);
    if (McapOp(opcode) == McapOp::kChunkIndex) {
      ByteReader index(content);
      index.value<uint64_t>();  // the first time
      const auto last_ns = int64_t(index.value<uint64_t>());
      chunks_.push_back({last_ns, index.value<uint64_t>()});
      if (!index.ok() || chunks_.back().offset >= start) return false;
    }
  }
  std::stable_sort(chunks_.begin(), chunks_.end(),
                   [](const ChunkPlace& a, const ChunkPlace& b) { return a.offset < b.offset; });
  return records.ok() && damage_.empty() && !channels_.empty();
}

bool McapReader::seek(int64_t log_ns, bool& is_first) {
  if (!damage_.empty()) return false;
  const uint64_t here = offset_;
  if (!knows_chunks_) {
    knows_chunks_ = true;
    if (!read_summary()) chunks_.clear();
    damage_.clear();
    offset_ = here;
    std::fseek(file_, long(here), SEEK_SET);
  }
  const auto chunk =
      std::find_if(chunks_.begin(), chunks_.end(), [&](const ChunkPlace& c) { return c.last_ns >= log_ns; });
  if (chunk == chunks_.end() || std::fseek(file_, long(chunk->offset), SEEK_SET) != 0) return false;
  is_first = chunk == chunks_.begin();
  offset_ = chunk->offset;
  ended_ = false;
  chunk_rest_ = {};
  chunk_damage_.clear();
  return true;
}

void McapReader::list_channels() {
  if (read_summary()) return;
  channels_.clear();
  schemas_.clear();
  held_bytes_ = 0;
  damage_.clear();
  ended_ = false;
  offset_ = kMcapMagic.size();
  std::fseek(file_, long(offset_), SEEK_SET);
  McapMessage message;
  while (next(message)) {
  }
}

void McapReader::list_attachments() {
  attachments_.clear();
  held_bytes_ = 0;
  offset_ = kMcapMagic.size();
  std::fseek(file_, long(offset_), SEEK_SET);
  std::string head;
  McapMessage none;
  for (;;) {
    record_at_ = offset_;
    if (!read_file(kMcapRecordHead, head)) return;
    ByteReader reader(head);
    const auto opcode = reader.value<uint8_t>();
    const auto size = reader.value<uint64_t>();
    if (McapOp(opcode) == McapOp::kDataEnd || McapOp(opcode) == McapOp::kFooter) return;
    if (size > file_bytes_ - offset_) return;
    const bool is_wanted = McapOp(opcode) == McapOp::kAttachment || McapOp(opcode) == McapOp::kMetadata;
    if (is_wanted && 2 * size > memory_limit()) return;
    if (is_wanted) {
      if (!read_file(size, record_)) return;
      take_record(opcode, record_, &none);
      if (!damage_.empty()) return;
    } else {
      offset_ += size;
      if (std::fseek(file_, long(offset_), SEEK_SET) != 0) return;
    }
  }
}

bool McapReader::next(McapMessage& out) {
  while (true) {
    if (chunk_rest_.empty()) {
      if (!chunk_damage_.empty()) {
        fail(record_at_, chunk_damage_);
        chunk_damage_.clear();
      }
      if (ended_ || !next_record()) return false;
      if (McapOp(opcode_) == McapOp::kChunk) continue;
      if (take_record(opcode_, record_, &out)) return true;
      if (ended_) return false;
      continue;
    }
    ByteReader reader(chunk_rest_);
    const auto opcode = reader.value<uint8_t>();
    const auto size = reader.value<uint64_t>();
    const std::string_view content = reader.take(size);
    if (!reader.ok() || opcode == 0) {
      chunk_rest_ = {};
      if (chunk_damage_.empty()) chunk_damage_ = "a record in a chunk does not end within it";
      continue;
    }
    chunk_rest_ = reader.rest();
    if (take_record(opcode, content, &out)) return true;
    if (ended_) {
      chunk_rest_ = {};
      chunk_damage_.clear();
      return false;
    }
  }
}

}  // namespace overtake::io
