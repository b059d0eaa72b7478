// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "tests/support/temp_folder.h"
#include "tools/io/bag_reader.h"
#include "tools/io/bytes.h"
#include "tools/io/error.h"
#include "tools/io/mcap_format.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/text.h"

namespace io = overtake::io;
using overtake::TempFolder;

namespace {

struct Line {
  std::string topic, data;
  int64_t log_ns;
  uint32_t sequence;
  bool operator==(const Line&) const = default;
};

// 40 messages on two topics, of 0 to 900 bytes.
std::vector<Line> write_log(const std::string& path, const io::McapOptions& options) {
  io::McapWriter log(path, options);
  const uint16_t schema = log.add_schema("a/msg/A", "ros2msg", "uint8 x\n");
  const uint16_t topics[] = {log.add_channel(schema, "/one", "cdr", {{"offered", "yes"}}),
                             log.add_channel(0, "/two", "json")};
  std::vector<Line> lines;
  for (int i = 0; i < 40; ++i) {
    std::string data(std::size_t(i * 23 % 900), char('a' + i % 26));
    for (std::size_t k = 0; k < data.size(); k += 3) data[k] = char(k * 7 + std::size_t(i));
    log.write(topics[i % 2], 1000 + i * 10, data);
    lines.push_back({i % 2 ? "/two" : "/one", data, 1000 + i * 10, uint32_t(i / 2)});
  }
  log.add_attachment("config.toml", "application/toml", "a = 1\n", 77);
  log.add_metadata("race", {{"track", "oval"}});
  log.close();
  return lines;
}

std::vector<Line> read_log(io::McapReader& reader) {
  std::vector<Line> lines;
  io::McapMessage message;
  while (reader.next(message))
    lines.push_back(
        {reader.channels().at(message.channel_id).topic, std::string(message.data), message.log_ns, message.sequence});
  return lines;
}

std::vector<io::McapOptions> all_options() {
  std::vector<io::McapOptions> all;
  for (const char* compression : {"none", "lz4", "zstd"})
    for (const uint64_t chunk : {uint64_t(0), uint64_t(1), uint64_t(2000), uint64_t(1) << 20})
      for (const bool index : {true, false}) {
        io::McapOptions options;
        options.compression = compression;
        options.chunk_bytes = chunk;
        options.index = index;
        options.crc = chunk != 2000 || index;
        all.push_back(options);
      }
  return all;
}

// A chunk of an uncompressed file: the opcodes of its records, and its messages.
struct ChunkPart {
  std::vector<io::McapOp> ops;
  std::vector<std::pair<uint16_t, uint64_t>> messages;           // channel, log time
  std::vector<uint64_t> offsets;                                 // of these
  std::multimap<uint16_t, std::pair<uint64_t, uint64_t>> index;  // by the records behind it: channel, log time, offset
  uint64_t first_ns = 0, last_ns = 0;
};

template <class T>
T value_at(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

template <class F>
void for_each_record(std::string_view bytes, F&& f) {
  while (bytes.size() >= io::kMcapRecordHead) {
    const auto size = std::size_t(value_at<uint64_t>(bytes, 1));
    f(io::McapOp(bytes[0]), bytes.substr(io::kMcapRecordHead, size));
    if (io::McapOp(bytes[0]) == io::McapOp::kFooter) return;
    bytes.remove_prefix(io::kMcapRecordHead + size);
  }
}

std::vector<ChunkPart> chunks_of(const std::string& file) {
  std::vector<ChunkPart> chunks;
  for_each_record(std::string_view(file).substr(io::kMcapMagic.size()), [&](io::McapOp op, std::string_view content) {
    if (op == io::McapOp::kMessageIndex)
      for (std::size_t at = 6; at + 16 <= content.size(); at += 16)
        chunks.back().index.emplace(value_at<uint16_t>(content, 0),
                                    std::pair(value_at<uint64_t>(content, at), value_at<uint64_t>(content, at + 8)));
    if (op != io::McapOp::kChunk) return;
    ChunkPart part;
    part.first_ns = value_at<uint64_t>(content, 0), part.last_ns = value_at<uint64_t>(content, 8);
    constexpr std::size_t kHead = 8 + 8 + 8 + 4 + 4 + 8;  // with compression ""
    const std::string_view records = content.substr(kHead);
    for_each_record(records, [&](io::McapOp inner, std::string_view record) {
      part.ops.push_back(inner);
      if (inner != io::McapOp::kMessage) return;
      part.messages.emplace_back(value_at<uint16_t>(record, 0), value_at<uint64_t>(record, 6));
      part.offsets.push_back(uint64_t(record.data() - records.data()) - io::kMcapRecordHead);
    });
    chunks.push_back(part);
  });
  return chunks;
}

// 60 frames of three messages: channel 1 small, 2 and 3 large, by one schema; groups as the flag says.
void write_groups(const std::string& path, const char* compression, bool whole_times) {
  io::McapOptions options;
  options.compression = compression;
  options.chunk_bytes = 1000;
  io::McapWriter log(path, options);
  const int32_t large = log.add_group({4000, whole_times});
  const uint16_t schema = log.add_schema("a/msg/A", "ros2msg", "uint8 x\n");
  const uint16_t topics[] = {log.add_channel(schema, "/small", "cdr"),
                             log.add_channel(schema, "/large", "cdr", {}, large),
                             log.add_channel(schema, "/larger", "cdr", {}, large)};
  for (int32_t i = 0; i < 60; ++i)
    for (std::size_t k = 0; k < 3; ++k) log.write(topics[k], 100 + i, std::string(k == 0 ? 30 : 900, char(i)));
  log.add_attachment("config.toml", "application/toml", "a = 1\n");
  log.close();
}

}  // namespace

TEST_CASE("mcap: each group has its own chunks, and each chunk can be read without those of other groups") {
  const TempFolder folder;
  for (const bool whole_times : {false, true}) {
    write_groups(folder.path("a.mcap"), "none", whole_times);
    const auto chunks = chunks_of(io::read_whole_file(folder.path("a.mcap")));
    int64_t small = 0, large = 0, split = 0;
    uint64_t last_large_ns = 0;
    std::map<bool, bool> described;  // group: its first chunk begins with schema and channel
    for (const ChunkPart& chunk : chunks) {
      REQUIRE_FALSE(chunk.messages.empty());
      const bool is_small = chunk.messages[0].first == 1;
      for (const auto& [channel, time] : chunk.messages) {
        REQUIRE((channel == 1) == is_small);
        CHECK(time >= chunk.first_ns);
        CHECK(time <= chunk.last_ns);
      }
      REQUIRE(chunk.index.size() == chunk.messages.size());
      std::multimap<uint16_t, std::pair<uint64_t, uint64_t>> right;
      for (std::size_t i = 0; i < chunk.messages.size(); ++i)
        right.emplace(chunk.messages[i].first, std::pair(chunk.messages[i].second, chunk.offsets[i]));
      CHECK(chunk.index == right);
      CHECK(chunk.first_ns == chunk.messages.front().second);
      CHECK(chunk.last_ns == chunk.messages.back().second);
      if (!described[is_small]) {
        CHECK(chunk.ops[0] == io::McapOp::kSchema);
        CHECK(chunk.ops[1] == io::McapOp::kChannel);
        described[is_small] = true;
      }
      if (!is_small) split += chunk.first_ns == last_large_ns;
      if (!is_small) last_large_ns = chunk.last_ns;
      (is_small ? small : large) += int64_t(chunk.messages.size());
    }
    CHECK(small == 60);
    CHECK(large == 120);
    CHECK((split == 0) == whole_times);
    CHECK(chunks.size() > 20);
  }
}

TEST_CASE("mcap: a file with groups of chunks is read back whole, by index and by order, and is the same twice") {
  const TempFolder folder;
  for (const char* compression : {"none", "lz4", "zstd"}) {
    write_groups(folder.path("a.mcap"), compression, true);
    write_groups(folder.path("b.mcap"), compression, true);
    CHECK(io::read_whole_file(folder.path("a.mcap")) == io::read_whole_file(folder.path("b.mcap")));
    io::McapReader reader(folder.path("a.mcap"));
    std::map<std::string, std::vector<Line>> lines;
    for (const Line& line : read_log(reader)) lines[line.topic].push_back(line);
    CHECK(reader.damage() == "");
    REQUIRE(lines.size() == 3);
    for (const auto& [topic, of_topic] : lines) {
      REQUIRE(of_topic.size() == 60);
      for (std::size_t i = 0; i < 60; ++i)
        CHECK(of_topic[i] ==
              Line{topic, std::string(topic == "/small" ? 30 : 900, char(i)), 100 + int64_t(i), uint32_t(i)});
    }
    CHECK(io::read_attached(folder.path("a.mcap"), "config.toml") == "a = 1\n");
    // Cut anywhere, the messages of each topic are a beginning of those that were written.
    const std::string whole = io::read_whole_file(folder.path("a.mcap"));
    for (std::size_t size = 8; size < whole.size(); size += 997) {
      io::write_whole_file(folder.path("cut.mcap"), std::string_view(whole).substr(0, size));
      io::McapReader cut(folder.path("cut.mcap"));
      std::map<std::string, std::size_t> count;
      for (const Line& line : read_log(cut)) CHECK(line == lines.at(line.topic)[count[line.topic]++]);
    }
  }
}

TEST_CASE("mcap: a channel of a group that was not added is refused") {
  const TempFolder folder;
  io::McapWriter log(folder.path("a.mcap"));
  CHECK(overtake::error_of([&] { log.add_channel(0, "/a", "json", {}, 1); }).find("names a group that was not added") !=
        std::string::npos);
  CHECK(log.add_group({}) == 1);
  CHECK(log.add_channel(0, "/a", "json", {}, 1) == 1);
  log.close();
}

TEST_CASE("mcap: seek goes on with the first chunk that has a message of that time; without an index nothing changes") {
  const TempFolder folder;
  const std::string path = folder.path("log.mcap");
  io::McapOptions options;
  options.chunk_bytes = 2000;
  const std::vector<Line> lines = write_log(path, options);
  for (const int64_t time : {1000, 1005, 1200, 1390}) {
    CAPTURE(time);
    io::McapReader reader(path);
    io::McapMessage message;
    for (int32_t k = 0; k < 7; ++k) REQUIRE(reader.next(message));
    bool is_first = false;
    REQUIRE(reader.seek(time, is_first));
    CHECK(is_first == (time <= 1005));
    const std::vector<Line> rest = read_log(reader);
    CHECK(reader.damage() == "");
    REQUIRE(rest.size() <= lines.size());
    CHECK(std::equal(rest.begin(), rest.end(), lines.end() - int64_t(rest.size())));  // the end of the log
    CHECK(rest.front().log_ns <= std::max<int64_t>(time, lines.front().log_ns + 9));
    CHECK(rest.front().log_ns >= time - 150);  // not a whole chunk too early
  }
  io::McapReader reader(path);
  io::McapMessage message;
  bool is_first = false;
  REQUIRE(reader.next(message));
  CHECK(!reader.seek(1391, is_first));  // later than the last message
  CHECK(read_log(reader).size() == lines.size() - 1);
  options.index = false;
  write_log(path, options);
  io::McapReader plain(path);
  REQUIRE(plain.next(message));
  CHECK(!plain.seek(1200, is_first));
  CHECK(read_log(plain).size() == lines.size() - 1);
}

TEST_CASE("mcap: every message, attachment and metadata is read back, with any chunks and compression") {
  const TempFolder folder;
  for (const io::McapOptions& options : all_options()) {
    const std::string path = folder.path("a.mcap");
    const auto written = write_log(path, options);
    CAPTURE(options.compression);
    CAPTURE(options.chunk_bytes);
    io::McapReader reader(path);
    CHECK(read_log(reader) == written);
    CHECK(reader.damage() == "");
    CHECK(reader.profile() == "ros2");
    REQUIRE(reader.attachments().size() == 1);
    CHECK(reader.attachments()[0].data == "a = 1\n");
    CHECK(reader.metadata().at("race").at("track") == "oval");
    CHECK(reader.channels().at(1).metadata.at("offered") == "yes");
    CHECK(reader.schemas().at(1).name == "a/msg/A");
    CHECK((reader.chunk_count() > 0) == (options.chunk_bytes > 0));
  }
}

TEST_CASE("mcap: attachments are found anywhere in the file, and a missing one is reported as missing") {
  const TempFolder folder;
  for (const io::McapOptions& options : all_options()) {
    const std::string path = folder.path("a.mcap");
    {
      io::McapWriter log(path, options);
      const uint16_t channel = log.add_channel(log.add_schema("a/msg/A", "ros2msg", "int32 a"), "/a", "cdr");
      log.add_attachment("first", "text/plain", "before");
      for (int32_t i = 0; i < 50; ++i) log.write(channel, i, std::string(200, char(i)));
      log.add_attachment("last", "text/plain", "behind");
      log.close();
    }
    CHECK(io::read_attached(path, "first") == "before");
    CHECK(io::read_attached(path, "last") == "behind");
    CHECK_FALSE(io::read_attached(path, "rig.toml").has_value());
    std::string bytes = io::read_whole_file(path);
    bytes[bytes.rfind("behind")] = 'B';
    io::write_whole_file(path, bytes);
    CHECK(io::read_attached(path, "first") == "before");
    CHECK(io::read_attached(path, "last").has_value() ==
          !options.crc);  // an attachment with a wrong checksum does not count
    io::write_whole_file(path, std::string_view(bytes).substr(0, bytes.size() / 2));
    CHECK(io::read_attached(path, "first") == "before");
    CHECK_FALSE(io::read_attached(path, "last").has_value());
  }
  CHECK_FALSE(io::read_attached(folder.write("a.txt", "no MCAP"), "first").has_value());
  CHECK_FALSE(io::read_attached(folder.path("nothing"), "first").has_value());
}

TEST_CASE("mcap: a truncated file gives its first messages and a damage report") {
  const TempFolder folder;
  for (const char* compression : {"none", "lz4", "zstd"})
    for (const uint64_t chunk : {uint64_t(0), uint64_t(4000)}) {
      io::McapOptions options;
      options.compression = compression;
      options.chunk_bytes = chunk;
      const auto written = write_log(folder.path("whole.mcap"), options);
      const std::string whole = io::read_whole_file(folder.path("whole.mcap"));
      std::size_t data_end = whole.size(), most = 0;
      for (std::size_t size = 8; size < whole.size(); size += 97) {
        io::write_whole_file(folder.path("cut.mcap"), std::string_view(whole).substr(0, size));
        io::McapReader reader(folder.path("cut.mcap"));
        const auto read = read_log(reader);
        REQUIRE(read.size() <= written.size());
        CHECK(std::equal(read.begin(), read.end(), written.begin()));
        CHECK(read.size() >= most);  // a longer part never gives fewer messages
        most = read.size();
        if (read.size() < written.size()) {
          CHECK(reader.damage().find("damaged at byte") == 0);
          data_end = size;
        }
      }
      CHECK(most == written.size());
      CHECK(data_end < whole.size());
      if (chunk == 4000 && std::string(compression) == "none") {
        // Cut within a chunk: complete messages are delivered.
        io::write_whole_file(folder.path("cut.mcap"), std::string_view(whole).substr(0, 2500));
        io::McapReader reader(folder.path("cut.mcap"));
        CHECK(read_log(reader).size() > 3);
        CHECK(reader.damage().find("are there") != std::string::npos);
      }
    }
}

TEST_CASE("mcap: the checksum detects a flipped bit in a chunk; earlier chunks are delivered") {
  const TempFolder folder;
  io::McapOptions options;
  options.compression = "none";
  options.chunk_bytes = 2000;
  const auto written = write_log(folder.path("a.mcap"), options);
  std::string bytes = io::read_whole_file(folder.path("a.mcap"));
  const std::size_t at = bytes.find(written[20].data.substr(1, 40));
  REQUIRE(at != std::string::npos);
  bytes[at + 5] = char(bytes[at + 5] ^ 4);
  io::write_whole_file(folder.path("a.mcap"), bytes);
  io::McapReader reader(folder.path("a.mcap"));
  const auto read = read_log(reader);
  CHECK(read.size() > 5);
  CHECK(read.size() <= 20);
  CHECK(std::equal(read.begin(), read.end(), written.begin()));
  CHECK(reader.damage().find("a chunk fails its checksum") != std::string::npos);
}

TEST_CASE("mcap: the summary has statistics, index and checksum that fit the messages") {
  const TempFolder folder;
  io::McapOptions options;
  options.chunk_bytes = 2000;
  write_log(folder.path("a.mcap"), options);
  const std::string bytes = io::read_whole_file(folder.path("a.mcap"));
  REQUIRE(bytes.size() > 37);
  io::ByteReader footer(std::string_view(bytes).substr(bytes.size() - 37, 29));
  CHECK(footer.value<uint8_t>() == 2);
  CHECK(footer.value<uint64_t>() == 20);
  const auto summary = footer.value<uint64_t>(), offsets = footer.value<uint64_t>();
  const auto crc = footer.value<uint32_t>();
  CHECK(io::update_crc32(0, std::string_view(bytes).substr(summary, bytes.size() - 12 - summary)) == crc);
  io::ByteReader records(std::string_view(bytes).substr(summary, offsets - summary));
  std::map<uint8_t, int> kinds;
  uint64_t indexed = 0, messages = 0;
  while (!records.empty() && records.ok()) {
    const auto opcode = records.value<uint8_t>();
    io::ByteReader content(records.take(records.value<uint64_t>()));
    ++kinds[opcode];
    if (opcode == uint8_t(io::McapOp::kStatistics)) messages = content.value<uint64_t>();
    if (opcode != uint8_t(io::McapOp::kChunkIndex)) continue;
    content.value<uint64_t>();
    content.value<uint64_t>();
    const auto at = content.value<uint64_t>(), length = content.value<uint64_t>();
    CHECK(uint8_t(bytes[at]) == uint8_t(io::McapOp::kChunk));
    const uint8_t behind = uint8_t(bytes[at + length]);
    CHECK(behind == uint8_t(io::McapOp::kMessageIndex));
    io::ByteReader map(content.text());
    while (!map.empty()) {
      const auto channel = map.value<uint16_t>();
      io::ByteReader index(std::string_view(bytes).substr(map.value<uint64_t>() + 9));
      CHECK(index.value<uint16_t>() == channel);
      indexed += index.value<uint32_t>() / 16;
    }
  }
  CHECK(records.ok());
  CHECK(messages == 40);
  CHECK(indexed == 40);
  CHECK(kinds[uint8_t(io::McapOp::kAttachmentIndex)] == 1);
  CHECK(kinds[uint8_t(io::McapOp::kMetadataIndex)] == 1);
  CHECK(kinds[uint8_t(io::McapOp::kChannel)] == 2);
}

TEST_CASE("mcap: a file of another format is refused with an error") {
  const TempFolder folder;
  io::write_whole_file(folder.path("a.mcap"), "hello there, this is text");
  CHECK_THROWS_WITH_AS(io::McapReader(folder.path("a.mcap")), doctest::Contains("is not an MCAP file"), io::Error);
  io::write_whole_file(folder.path("b.mcap"), std::string("\x89MCAP1\r\n", 8));
  CHECK_THROWS_WITH_AS(io::McapReader(folder.path("b.mcap")), doctest::Contains("another major version"), io::Error);
  CHECK_THROWS_AS(io::McapReader(folder.path("none.mcap")), io::Error);
}
