// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/bags.h"
#include "tests/support/temp_folder.h"
#include "tools/io/bag_reader.h"
#include "tools/io/bag_stream.h"
#include "tools/io/bytes.h"
#include "tools/io/cloud_message.h"
#include "tools/io/formats.h"
#include "tools/io/mcap_format.h"
#include "tools/io/pcd.h"
#include "tools/io/recording.h"
#include "tools/io/scan_stream.h"

using namespace overtake;
using namespace overtake::test;

namespace {

constexpr int32_t kLines = 16, kShots = 200, kFrames = 10;
constexpr int64_t kPeriodNs = 50'000'000;

// The same scans as PCD files, as KITTI's files and as messages.
std::vector<Recorded> write_scans(const TempFolder& folder) {
  std::vector<Recorded> messages;
  for (int32_t frame = 0; frame < kFrames; ++frame) {
    const io::Cloud cloud = swept_cloud(kLines, kShots, 0.2 * frame);
    char name[32];
    std::snprintf(name, sizeof name, "%06d", frame);
    io::write_pcd(folder.path(std::string("pcd/") + name + ".pcd"), cloud);
    folder.write(std::string("bin/") + name + ".bin", kitti_bytes(cloud));
    messages.push_back(cloud_of(cloud, "/front/points", frame * kPeriodNs));
  }
  return messages;
}

std::vector<Recorded> with_ego(std::vector<Recorded> messages) {
  for (Recorded& pose : straight_drive("/ego/odometry", 0, (kFrames + 2) * kPeriodNs))
    messages.push_back(std::move(pose));
  std::stable_sort(messages.begin(), messages.end(),
                   [](const Recorded& a, const Recorded& b) { return a.stamp_ns < b.stamp_ns; });
  return messages;
}

}  // namespace

TEST_CASE("bags: PCD, KITTI, db3 and MCAP of the same scans give one hash, with any chunks and compression") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  const auto messages = write_scans(folder);
  const io::Rig rig = swept_rig(kLines);
  int64_t frames = 0, detections = 0;
  const uint64_t expected = hash_of_run(folder.path("pcd"), rig, "", &frames, &detections);
  CHECK(frames == kFrames);
  CHECK(detections >= kFrames);  // at least the car
  CHECK(hash_of_run(folder.path("bin"), rig) == expected);
  write_db3(folder.path("a.db3"), messages);
  CHECK(hash_of_run(folder.path("a.db3"), rig) == expected);
  for (const char* compression : {"none", "lz4", "zstd"})
    for (const uint64_t chunk : {uint64_t(0), uint64_t(1), uint64_t(100'000), uint64_t(1) << 22})
      for (const bool index : {true, false}) {
        CAPTURE(compression);
        CAPTURE(chunk);
        io::McapOptions options;
        options.compression = compression;
        options.chunk_bytes = chunk;
        options.index = index;
        write_mcap(folder.path("a.mcap"), messages, options);
        CHECK(hash_of_run(folder.path("a.mcap"), rig) == expected);
      }
  auto other = messages;
  other[3] = cloud_of(swept_cloud(kLines, kShots, 0.7), "/front/points", 3 * kPeriodNs);
  write_db3(folder.path("b.db3"), other);
  CHECK(hash_of_run(folder.path("b.db3"), rig) != expected);
}

TEST_CASE("bags: the recording's ego poses are used, wherever their messages are") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  const auto clouds = write_scans(folder);
  const auto messages = with_ego(clouds);
  const io::Rig rig = swept_rig(kLines);
  write_db3(folder.path("a.db3"), messages);
  write_mcap(folder.path("a.mcap"), messages);
  const uint64_t expected = hash_of_run(folder.path("a.db3"), rig);
  CHECK(hash_of_run(folder.path("a.mcap"), rig) == expected);
  write_db3(folder.path("none.db3"), clouds);
  CHECK(hash_of_run(folder.path("none.db3"), rig) != expected);
  // Poses that the recorder wrote 200 ms late change nothing.
  auto late = messages;
  for (Recorded& message : late)
    if (message.type == io::kOdometryName) message.stamp_ns += 200'000'000;
  std::stable_sort(late.begin(), late.end(),
                   [](const Recorded& a, const Recorded& b) { return a.stamp_ns < b.stamp_ns; });
  write_db3(folder.path("late.db3"), late);
  CHECK(hash_of_run(folder.path("late.db3"), rig) == expected);
}

TEST_CASE("bags: rosbag2 folders are read file by file, in the order of their numbers") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  const auto messages = write_scans(folder);
  const io::Rig rig = swept_rig(kLines);
  std::filesystem::create_directories(folder.path("bag"));
  folder.write("bag/metadata.yaml", "rosbag2_bagfile_information: {}\n");
  for (std::size_t part = 0; part < 11; ++part)  // race_10 comes after race_2
    write_db3(folder.path("bag/race_" + std::to_string(part) + ".db3"),
              part < 10 ? std::vector<Recorded>{messages[part]} : std::vector<Recorded>{});
  std::filesystem::remove(folder.path("bag/race_10.db3"));
  CHECK(hash_of_run(folder.path("bag"), rig) == hash_of_run(folder.path("pcd"), rig));
}

namespace {

// Takes the channel of a topic out of a file's summary: its record there gets an opcode that readers skip.
void hide_channel(const std::string& path, const std::string& topic) {
  constexpr std::size_t kTail = 20 + 8;  // content of the footer, magic
  std::string bytes = io::read_whole_file(path);
  io::ByteReader footer(std::string_view(bytes).substr(bytes.size() - kTail));
  const auto summary = std::size_t(footer.value<uint64_t>());
  int32_t hidden = 0;
  for (std::size_t at = summary; at < bytes.size() - kTail - io::kMcapRecordHead;) {
    io::ByteReader head(std::string_view(bytes).substr(at + 1));
    const auto size = std::size_t(head.value<uint64_t>());
    const std::string_view content = std::string_view(bytes).substr(at + io::kMcapRecordHead, size);
    if (io::McapOp(bytes[at]) == io::McapOp::kChannel && content.find(topic) != std::string_view::npos)
      bytes[at] = '\x7f', ++hidden;
    at += io::kMcapRecordHead + size;
  }
  REQUIRE(hidden == 1);
  const uint32_t crc = io::update_crc32(0, std::string_view(bytes).substr(summary, bytes.size() - 12 - summary));
  std::memcpy(bytes.data() + bytes.size() - 12, &crc, sizeof crc);
  io::write_whole_file(path, bytes);
}

}  // namespace

TEST_CASE("bags: a topic that the summaries of a folder's files lack is added when its first message comes") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("bag"));
  for (const int32_t part : {0, 1}) {
    const std::string path = folder.path("bag/race_" + std::to_string(part) + ".mcap");
    std::vector<Recorded> messages = straight_drive("/ego/odometry", part * kPeriodNs, part * kPeriodNs + 20'000'000);
    messages.push_back(straight_drive("/hidden", part * kPeriodNs, part * kPeriodNs)[0]);
    write_mcap(path, messages);
    hide_channel(path, "/hidden");
  }
  const auto bag = io::open_bag(folder.path("bag"));
  CHECK(bag->topics().size() == 1);
  std::map<std::string, int32_t> messages;
  io::BagMessage message;
  while (bag->next(message)) {
    REQUIRE(std::size_t(message.topic) < bag->topics().size());
    const io::BagTopic& topic = bag->topics()[std::size_t(message.topic)];
    CHECK(topic.type == io::kOdometryName);
    ++messages[topic.name];
  }
  CHECK(bag->damage() == "");
  CHECK(bag->topics().size() == 2);  // one entry for both files
  CHECK(messages == std::map<std::string, int32_t>{{"/ego/odometry", 6}, {"/hidden", 2}});
}

namespace {

struct Read {
  std::vector<std::size_t> scans;  // of each frame
  std::string first_loss, damage;
  int64_t lost = 0;
};
Read read_all(const std::string& path, const io::Rig& rig) {
  const auto stream = io::open_scans(path, rig);
  Read read;
  for (io::FrameScans frame; stream->next(frame);) {
    CHECK(frame.frame == int64_t(read.scans.size()));
    read.scans.push_back(frame.scans.size());
  }
  read.lost = stream->lost_count(), read.first_loss = stream->first_loss(), read.damage = stream->damage();
  return read;
}

// Clouds of sensors front and left at the same stamps; those of left are recorded later.
std::vector<Recorded> two_sensors(int32_t frames, int64_t late_ns) {
  const io::Cloud cloud = swept_cloud(kLines, 20, 0);
  std::vector<Recorded> messages;
  for (int32_t frame = 0; frame < frames; ++frame)
    for (const char* topic : {"/front/points", "/left/points"}) {
      messages.push_back(cloud_of(cloud, topic, frame * kPeriodNs));
      if (std::string(topic) == "/left/points") messages.back().stamp_ns += late_ns;
    }
  std::stable_sort(messages.begin(), messages.end(),
                   [](const Recorded& a, const Recorded& b) { return a.stamp_ns < b.stamp_ns; });
  return messages;
}

}  // namespace

TEST_CASE("bags: scans of one time are one frame, also where one is recorded up to half a second later") {
  const TempFolder folder;
  io::Rig rig = swept_rig(kLines);
  rig.sensors.push_back(rig.sensors[0]);
  rig.sensors[1].name = "left";
  for (const int64_t late_ns : {0, 60'000'000, 130'000'000, 480'000'000}) {
    CAPTURE(late_ns);
    write_mcap(folder.path("a.mcap"), two_sensors(30, late_ns));
    CHECK(read_all(folder.path("a.mcap"), rig).scans == std::vector<std::size_t>(30, 2));
  }
  write_mcap(folder.path("a.mcap"), two_sensors(30, 700'000'000));  // the reader does not hold frames for ever
  CHECK(read_all(folder.path("a.mcap"), rig).scans.size() > 40);
}

TEST_CASE("bags: a frame that a late scan opens comes out in the order of the stamps") {
  const TempFolder folder;
  io::Rig rig = swept_rig(kLines);
  for (const char* name : {"left", "right"}) {
    rig.sensors.push_back(rig.sensors[0]);
    rig.sensors.back().name = name;
  }
  const io::Cloud cloud = swept_cloud(kLines, kShots, 0);
  uint64_t expected = 0;
  for (const bool late : {false, true}) {
    std::vector<Recorded> messages;
    for (int32_t frame = 0; frame < 30; ++frame)
      for (const std::string name : {"front", "left", "right"}) {
        if (name == "front" && frame == 12) continue;
        messages.push_back(cloud_of(cloud, "/" + name + "/points", frame * kPeriodNs));
        if (late) messages.back().stamp_ns += name == "left" ? 420'000'000 : name == "right" ? 300'000'000 : 0;
      }
    std::stable_sort(messages.begin(), messages.end(),
                     [](const Recorded& a, const Recorded& b) { return a.stamp_ns < b.stamp_ns; });
    write_mcap(folder.path("a.mcap"), messages);
    std::vector<std::size_t> scans(30, 3);
    scans[12] = 2;
    CHECK(read_all(folder.path("a.mcap"), rig).scans == scans);
    const uint64_t hash = hash_of_run(folder.path("a.mcap"), rig);
    if (!late) expected = hash;
    CHECK(hash == expected);
  }
}

TEST_CASE("bags: a message that cannot be decoded is left out and named; a topic of such messages is an error") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  const io::Rig rig = swept_rig(kLines);
  const auto good = write_scans(folder);
  auto messages = good;
  for (const std::size_t bad : {std::size_t(3), std::size_t(7)}) messages[bad].data.resize(40);
  write_db3(folder.path("a.db3"), messages);
  write_mcap(folder.path("a.mcap"), messages);
  for (const char* name : {"a.db3", "a.mcap"}) {
    const Read read = read_all(folder.path(name), rig);
    CHECK(read.scans.size() == kFrames - 2);
    CHECK(read.lost == 2);
    CHECK(read.first_loss.starts_with("message 3 on /front/points (log time 0.150 s): is not a sensor_msgs/msg/"));
  }
  messages = with_ego(good);
  const auto pose =
      std::find_if(messages.begin(), messages.end(), [](const Recorded& m) { return m.type == io::kOdometryName; });
  pose->data.resize(10);
  write_mcap(folder.path("b.mcap"), messages);
  const Read read = read_all(folder.path("b.mcap"), rig);
  CHECK(read.scans.size() == kFrames);
  CHECK(read.lost == 1);
  CHECK(read.first_loss.find(" on /ego/odometry (log time 0.000 s): ") != std::string::npos);

  io::Rig two = rig;  // a sensor whose only message is bad ends no run, because the other one has scans
  two.sensors.push_back(two.sensors[0]);
  two.sensors[1].name = "left";
  messages = good;
  messages.push_back(good.back());
  messages.back().topic = "/left/points";
  messages.back().data.resize(40);
  write_mcap(folder.path("e.mcap"), messages);
  const Read others = read_all(folder.path("e.mcap"), two);
  CHECK(others.scans.size() == kFrames);
  CHECK(others.lost == 1);

  messages = good;
  for (Recorded& message : messages) message.data.resize(40);
  write_mcap(folder.path("c.mcap"), messages);
  CHECK(
      error_of([&] {
        read_all(folder.path("c.mcap"), rig);
      }).starts_with(folder.path("c.mcap") + ": no message on /front/points can be read, of 10; the first: message 0"));
  while (messages.size() < 100) messages.push_back(messages[0]);
  for (const Recorded& message : good) messages.push_back(message);
  write_mcap(folder.path("d.mcap"), messages);  // nobody waits an hour for the error
  CHECK(error_of([&] { read_all(folder.path("d.mcap"), rig); }).find("can be read, of 100 so far; the first: ") !=
        std::string::npos);
}

TEST_CASE("bags: of a split recording whose last file is empty or cut, the others are read") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  const io::Rig rig = swept_rig(kLines);
  const auto messages = write_scans(folder);
  for (const std::string kind : {"db3", "mcap"})
    for (const std::size_t bytes : {std::size_t(0), std::size_t(5), std::size_t(200)}) {
      const std::string bag = kind + std::to_string(bytes);
      CAPTURE(bag);
      const auto file = [&](int32_t part) { return folder.path(bag + "/race_" + std::to_string(part) + "." + kind); };
      std::filesystem::create_directories(folder.path(bag));
      for (const int32_t part : {0, 1, 2}) {
        const std::vector<Recorded> some(messages.begin() + 3 * part, messages.begin() + 3 * part + 3);
        kind == "db3" ? write_db3(file(part), some) : write_mcap(file(part), some);
      }
      std::filesystem::resize_file(file(2), bytes);
      const Read read = read_all(folder.path(bag), rig);
      CHECK(read.scans.size() == 6);
      CHECK_MESSAGE(read.damage.find(file(2) + ": ") == 0, read.damage);
      if (bytes == 0) CHECK(read.damage == file(2) + ": is empty (0 bytes)");
      if (bytes > 0) continue;
      std::filesystem::resize_file(file(0), 0);  // only the end of a recording is expected to be cut
      CHECK(error_of([&] { read_all(folder.path(bag), rig); }) == file(0) + ": is empty (0 bytes)");
    }
}

namespace {

// Without the right to write, also for root. `folder` gets its rights back at the end.
class WithoutWriting {
 public:
  explicit WithoutWriting(std::string folder) : folder_(std::move(folder)) {
    namespace fs = std::filesystem;
    fs::permissions(folder_, fs::perms(0555));
    if (geteuid() == 0) was_root_ = seteuid(65534) == 0;
  }
  ~WithoutWriting() {
    if (was_root_) CHECK(seteuid(0) == 0);
    std::filesystem::permissions(folder_, std::filesystem::perms(0755));
  }
  WithoutWriting(const WithoutWriting&) = delete;
  WithoutWriting& operator=(const WithoutWriting&) = delete;
  bool holds() const { return geteuid() != 0; }

 private:
  std::string folder_;
  bool was_root_ = false;
};

// Runs SQL on a file in WAL mode, then calls `meanwhile` before SQLite merges the log into the file.
template <class F>
void change_in_wal_mode(const std::string& path, const char* sql, F&& meanwhile) {
  sqlite3* db = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &db) == SQLITE_OK);
  REQUIRE(sqlite3_exec(db, "PRAGMA journal_mode=WAL", nullptr, nullptr, nullptr) == SQLITE_OK);
  REQUIRE(sqlite3_exec(db, sql, nullptr, nullptr, nullptr) == SQLITE_OK);
  meanwhile();
  sqlite3_close(db);
}

}  // namespace

TEST_CASE("bags: a db3 in WAL mode is read where nobody can write; with an unmerged log it is refused") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  std::filesystem::create_directories(folder.path("read_only"));
  const io::Rig rig = swept_rig(kLines);
  const std::string whole = folder.path("read_only/100%3f#?.db3"), open = folder.path("read_only/open.db3");
  write_db3(whole, write_scans(folder));
  change_in_wal_mode(whole, "DELETE FROM messages WHERE id = 1", [&] {
    std::filesystem::copy_file(whole, open);
    std::filesystem::copy_file(whole + "-wal", open + "-wal");
  });
  REQUIRE(std::filesystem::file_size(open + "-wal") > 0);
  REQUIRE(!std::filesystem::exists(whole + "-wal"));
  std::string scans, error;
  {
    const WithoutWriting without(folder.path("read_only"));
    if (!without.holds()) {
      MESSAGE("skipped: root cannot give up its rights here");
      return;
    }
    scans = std::to_string(read_all(whole, rig).scans.size());
    error = error_of([&] { read_all(open, rig); });
  }
  CHECK(scans == std::to_string(kFrames - 1));
  CHECK(error == open + ": is in SQLite's WAL mode, and a part of it is still in " + open +
                     "-wal: SQLite must write beside the file to read both. Copy them to a folder that can be written");
  CHECK(read_all(open, rig).scans.size() == kFrames - 1);  // where it can write
}

TEST_CASE("bags: a db3 whose writer was stopped in a transaction is refused where nobody can write") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  std::filesystem::create_directories(folder.path("read_only"));
  const io::Rig rig = swept_rig(kLines);
  const std::string path = folder.path("a.db3"), hot = folder.path("read_only/hot.db3");
  write_db3(path, write_scans(folder));
  sqlite3* db = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &db) == SQLITE_OK);
  const auto execute = [&](const char* sql) { REQUIRE(sqlite3_exec(db, sql, nullptr, nullptr, nullptr) == SQLITE_OK); };
  execute("PRAGMA cache_size=1; PRAGMA cache_spill=1; BEGIN");
  execute("DELETE FROM messages WHERE id > 3");
  execute("INSERT INTO messages SELECT id + 100, topic_id, timestamp, zeroblob(2000000) FROM messages");
  std::filesystem::copy_file(path, hot);  // what a killed writer leaves
  std::filesystem::copy_file(path + "-journal", hot + "-journal");
  execute("ROLLBACK");
  sqlite3_close(db);
  REQUIRE(std::filesystem::file_size(hot + "-journal") > 0);
  REQUIRE(io::read_whole_file(hot) != io::read_whole_file(path));
  std::string error;
  {
    const WithoutWriting without(folder.path("read_only"));
    if (!without.holds()) {
      MESSAGE("skipped: root cannot give up its rights here");
      return;
    }
    error = error_of([&] { read_all(hot, rig); });
  }
  CHECK(error == hot + ": its writer was stopped in a transaction, which " + hot +
                     "-journal undoes: open the file once with sqlite3, in a folder that can be written");
}

TEST_CASE("bags: a db3 whose messages are all in its write-ahead log is read") {
  const TempFolder folder;
  const std::string path = folder.path("a.db3");
  write_db3(path, {});
  const char* sql =
      "INSERT INTO topics VALUES (1, '/a', 'b', 'cdr', '');"
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 20000) "
      "INSERT INTO messages SELECT i, 1, i, x'00' FROM n";
  change_in_wal_mode(path, sql, [&] {
    const auto bag = io::open_bag(path);
    int64_t count = 0;
    for (io::BagMessage message; bag->next(message);) ++count;
    CHECK(bag->damage() == "");
    CHECK(count == 20000);
  });
}

TEST_CASE("bags: topics are found by the rig's names; one * stands for the ego vehicle in all of them") {
  const std::vector<io::BagTopic> topics = {{"/vehicle_5/local_odometry", io::kOdometryName, "cdr"},
                                            {"/vehicle_3/local_odometry", io::kOdometryName, "cdr"},
                                            {"/vehicle_3/luminar_left_points", io::kPointCloud2Name, "cdr"},
                                            {"/vehicle_3/luminar_front_points", io::kPointCloud2Name, "cdr"},
                                            {"/vehicle_3/luminar_right_points", "sensor_msgs/msg/Image", "cdr"}};
  const io::TopicRoles roles = io::find_topic_roles(topics, io::load_rig("racecar"));
  CHECK(roles.sensor_of == std::vector<int32_t>{-1, -1, 1, 0, -1});
  CHECK(roles.ego == 1);
  CHECK(roles.opponent == 0);
  const io::TopicRoles none = io::find_topic_roles(topics, io::load_rig("hdl64"));
  CHECK(none.sensor_of == std::vector<int32_t>{-1, -1, -1, -1, -1});  // two clouds: the reader does not guess
}

TEST_CASE("bags: the opponent's odometry gives its position in the vehicle frame") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  auto messages = with_ego(write_scans(folder));
  io::Odometry other;
  for (int32_t k = 0; k < 12; ++k) {
    other.header = {k * kPeriodNs, "map"};
    other.pose.x_m = 25 + 30 * 0.05 * k;
    other.pose.y_m = -2;
    messages.push_back({"/opponent/odometry", io::kOdometryName, io::encode_odometry(other), k * kPeriodNs});
  }
  std::stable_sort(messages.begin(), messages.end(),
                   [](const Recorded& a, const Recorded& b) { return a.stamp_ns < b.stamp_ns; });
  write_mcap(folder.path("a.mcap"), messages);
  const auto stream = io::open_scans(folder.path("a.mcap"), swept_rig(kLines));
  io::FrameScans frame;
  int32_t seen = 0;
  while (stream->next(frame)) {
    if (!frame.opponent) continue;
    ++seen;
    CHECK(frame.opponent->x_m == doctest::Approx(25).epsilon(1e-6));
    CHECK(frame.opponent->y_m == doctest::Approx(-2));
  }
  CHECK(seen >= kFrames - 1);
}

TEST_CASE("bags: a recording without the rig's topics is refused, and the error lists its topics") {
  const TempFolder folder;
  std::filesystem::create_directories(folder.path("pcd"));
  write_db3(folder.path("a.db3"), write_scans(folder));
  const std::string error = error_of([&] { io::open_scans(folder.path("a.db3"), io::load_rig("racecar")); });
  CHECK(error.find("no topic of the rig's sensors is in it") != std::string::npos);
  CHECK(error.find("/front/points (sensor_msgs/msg/PointCloud2)") != std::string::npos);
  folder.write("b.db3", "SQLite format 3");
  CHECK(error_of([&] { io::open_scans(folder.path("b.db3"), swept_rig(kLines)); }).find("is neither MCAP nor SQLite") !=
        std::string::npos);
  folder.write("c.db3", std::string("SQLite format 3\0", 16) + std::string(5000, 'x'));
  CHECK(error_of([&] { io::open_scans(folder.path("c.db3"), swept_rig(kLines)); }).find("SQLite says") !=
        std::string::npos);
}

TEST_CASE("cloud messages: rows with padding and big-endian values are read, invalid layouts are refused") {
  std::string data(2 * 3 * 12, '\0');  // 2 rows of 2 points of 12 bytes and 12 bytes of padding
  io::PointCloud2 cloud;
  cloud.height = cloud.width = 2;
  cloud.point_step = 12;
  cloud.row_step = 36;
  cloud.is_bigendian = true;
  cloud.fields = {{"x", 0, io::PointField::kFloat32, 1},
                  {"Ring", 4, io::PointField::kUint16, 1},
                  {"cov", 6, io::PointField::kUint8, 3}};
  for (std::size_t i = 0; i < 4; ++i) {
    const float x = float(i) + 0.5f;
    const std::size_t at = i / 2 * 36 + i % 2 * 12;
    for (std::size_t b = 0; b < 4; ++b) data[at + b] = reinterpret_cast<const char*>(&x)[3 - b];
    data[at + 5] = char(7 + i);
  }
  cloud.data = data;
  const io::Cloud points = io::read_cloud_message("m", cloud);
  const int32_t ring = io::find_role(points.fields, io::CloudRole::kLayer);
  REQUIRE(ring == 1);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(points.columns[0].value(i) == double(i) + 0.5);
    CHECK(points.columns[1].integer(i) == int64_t(7 + i));
  }
  io::PointCloud2 wrong = cloud;
  wrong.row_step = 20;
  CHECK(error_of([&] { io::read_cloud_message("m", wrong); }) ==
        "m: its rows are shorter than their points: row_step is too small");
  wrong = cloud;
  wrong.height = 3;
  CHECK(error_of([&] { io::read_cloud_message("m", wrong); }) ==
        "m: declares 6 points of 12 bytes, but holds 72 bytes");
  wrong = cloud;
  wrong.fields[0].offset = 9;
  CHECK(error_of([&] { io::read_cloud_message("m", wrong); }) ==
        "m: field 'x' lies at byte 9, outside of a point of 12 bytes");
  wrong = cloud;
  wrong.width = wrong.height = 0xffffffff;
  CHECK(error_of([&] { io::read_cloud_message("m", wrong); }).find("m: declares ") == 0);
}

TEST_CASE("KITTI files: an incomplete point is reported") {
  const TempFolder folder;
  const std::string path = folder.write("000000.bin", std::string(37, 'a'));
  CHECK(error_of([&] { io::read_cloud(path); }).find("ends within point 2") != std::string::npos);
}
