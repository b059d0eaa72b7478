// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Files that declare more than they contain, or more than the memory limit, and inputs that are not files: an error,
// and no memory is allocated.
#include <doctest/doctest.h>
#include <sqlite3.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <string>

#include "tests/support/bags.h"
#include "tests/support/mcap_parts.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temp_folder.h"
#include "tools/client/config.h"
#include "tools/io/bag_stream.h"
#include "tools/io/csv.h"
#include "tools/io/ego_file.h"
#include "tools/io/formats.h"
#include "tools/io/image.h"
#include "tools/io/kitti_tracking.h"
#include "tools/io/map_file.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/npy.h"
#include "tools/io/pcd.h"
#include "tools/io/ros_messages.h"
#include "tools/io/scan_stream.h"
#include "tools/io/toml_reader.h"
#include "tools/io/urdf.h"
#include "tools/sim/scenario.h"

using namespace overtake;
using namespace overtake::test;

namespace {

constexpr uint64_t kMiB = uint64_t(1) << 20, kGiB = uint64_t(1) << 30;

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

// The reader's damage report; it must allocate less than `most` bytes.
std::string damage_of(const std::string& path, uint64_t most) {
  const PeakMemory peak;
  io::McapReader reader(path);
  io::McapMessage message;
  while (reader.next(message)) {
  }
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < most);
  return reader.damage();
}

// A column of zeros for each of x y z and ring.
io::Cloud zeros(std::size_t points) {
  io::Cloud cloud;
  cloud.points = int64_t(points);
  for (const char* name : {"x", "y", "z", "ring"}) {
    cloud.fields.push_back({name, io::ValueType::kFloat32, 1});
    cloud.columns.push_back({io::ValueType::kFloat32, 1, std::vector<unsigned char>(points * 4)});
  }
  return cloud;
}

}  // namespace

TEST_CASE("sizes: are printed in readable units") {
  uint64_t bytes = 0;
  for (const auto& [text, value] : std::vector<std::pair<const char*, uint64_t>>{{"4G", 4 * kGiB},
                                                                                 {"512M", 512 * kMiB},
                                                                                 {"1.5 GiB", 3 * kGiB / 2},
                                                                                 {"2048KB", 2 * kMiB},
                                                                                 {"1t", 1024 * kGiB},
                                                                                 {"3000000", 3000000},
                                                                                 {"3000000b", 3000000}}) {
    CAPTURE(text);
    CHECK(io::parse_size(text, bytes));
    CHECK(bytes == value);
  }
  for (const char* text : {"", "G", "4X", "-4G", "4GG", "1K", "0", "1000", "1e3M", "99999999T", "4G x"}) {
    CAPTURE(text);
    CHECK_FALSE(io::parse_size(text, bytes));
  }
  CHECK(io::format_size(37) == "37 bytes");
  CHECK(io::format_size(192 * 1024) == "192.0 KiB");
  CHECK(io::format_size(100 * kGiB) == "100.0 GiB");
  CHECK(io::memory_limit() > kMiB);
  const MemoryLimit limit(5 * kMiB);
  CHECK(io::memory_limit() == 5 * kMiB);
}

TEST_CASE("limits: an MCAP chunk that declares more than it can hold, or than the limit, is not decompressed") {
  const TempFolder folder;
  constexpr std::size_t kBlocks = 49152;  // 6 GiB of zeros in 192 KiB
  const auto of_chunk = [&](const std::string& compression, uint64_t declared, const std::string& packed) {
    return folder.write("a.mcap", mcap_head() + mcap_chunk(compression, declared, packed) + mcap_tail());
  };
  const std::string bomb = of_chunk("zstd", 100 * kGiB, zstd_zeros(kBlocks));
  CHECK(std::filesystem::file_size(bomb) < 200'000);
  const std::string said = damage_of(bomb, 20 * kMiB);
  CHECK(has(said, "damaged at byte "));
  CHECK(has(said, ": a chunk cannot be unpacked: it declares 100.0 GiB, its 192.0 KiB cannot hold more than 6.0 GiB"));
  // Opening it for a run gives the same message, with the file's name.
  CHECK(error_of([&] { io::open_scans(bomb, swept_rig(8)); }) == bomb + ": " + said);

  CHECK(has(damage_of(of_chunk("zstd", 6 * kGiB, zstd_zeros(kBlocks)), 20 * kMiB),
            "it declares 6.0 GiB, chunks of at most 1.0 GiB are read"));
  const std::string lz4 = io::compress_chunk("lz4", 1, std::string(32 * kMiB, '\0'));
  CHECK(has(damage_of(of_chunk("lz4", 100 * kGiB, lz4), 20 * kMiB), "it declares 100.0 GiB, its "));
  CHECK(has(damage_of(of_chunk("", 100 * kGiB, "nothing"), 20 * kMiB), "it declares 100.0 GiB, chunks of at most"));
  {
    const MemoryLimit limit(16 * kMiB);
    for (const std::string& path :
         {of_chunk("lz4", 32 * kMiB, lz4),
          folder.write("b.mcap", mcap_head() + mcap_chunk("zstd", 32 * kMiB, zstd_zeros(256)))}) {
      const std::string refused = damage_of(path, 16 * kMiB);
      CHECK(has(refused, "a chunk cannot be unpacked: unpacking it needs 32."));
      CHECK(has(refused, ", the memory limit is 16.0 MiB (--max-memory)"));
    }
    // A record of the file itself, as long as it declares: sparse, so that it uses no disk space.
    const std::string path = of_chunk("", 64 * kMiB, "");
    std::string head = mcap_head();
    io::append_value(head, uint8_t(io::McapOp::kMessage));
    io::append_value(head, 64 * kMiB);
    folder.write("a.mcap", head);
    std::filesystem::resize_file(path, head.size() + 64 * kMiB);
    CHECK(has(damage_of(path, 8 * kMiB), "a record needs 64.0 MiB, the memory limit is 16.0 MiB (--max-memory)"));
  }
  // Content within the limits is decompressed: zeros are not a record.
  CHECK(has(damage_of(of_chunk("zstd", 32 * kMiB, zstd_zeros(256)), 64 * kMiB), "a record in a chunk does not end"));
  CHECK(has(damage_of(of_chunk("lz4", 32 * kMiB, lz4), 64 * kMiB), "a record in a chunk does not end"));
}

TEST_CASE("limits: schemas, attachments and metadata of an MCAP file stay within the limit") {
  const TempFolder folder;
  const MemoryLimit limit(32 * kMiB);
  std::string file = mcap_head();
  for (uint16_t id = 1; id <= 20; ++id) {
    const std::string schema = mcap_schema(id, "a", std::string(4 * kMiB, '\0'));
    file += mcap_chunk("zstd", schema.size(), io::compress_chunk("zstd", 1, schema));
  }
  const std::string path = folder.write("a.mcap", file + mcap_tail());
  CHECK(std::filesystem::file_size(path) < 100'000);
  CHECK(has(damage_of(path, 64 * kMiB),
            "keeping its schemas, channels and attachments needs 32.0 MiB, the memory limit is 32.0 MiB"));
  // A schema that is repeated in every chunk is stored once.
  std::string again = mcap_head();
  for (int32_t i = 0; i < 20; ++i) {
    const std::string schema = mcap_schema(1, "a", std::string(4 * kMiB, '\0'));
    again += mcap_chunk("zstd", schema.size(), io::compress_chunk("zstd", 1, schema));
  }
  CHECK(damage_of(folder.write("b.mcap", again + mcap_tail()), 64 * kMiB) == "");
}

TEST_CASE("limits: scans that wait for an ego pose stay within the limit") {
  const TempFolder folder;
  std::vector<Recorded> messages = straight_drive("/ego/odometry", 0, 20'000'000);
  const io::Cloud cloud = swept_cloud(8, 5000, 0);
  for (int64_t frame = 0; frame < 60; ++frame) messages.push_back(cloud_of(cloud, "/front/points", frame * 50'000'000));
  write_mcap(folder.path("a.mcap"), messages);
  const auto read_all = [&] {
    const auto stream = io::open_scans(folder.path("a.mcap"), swept_rig(8));
    io::FrameScans frame;
    int32_t frames = 0;
    while (stream->next(frame)) ++frames;
    return frames;
  };
  CHECK(read_all() == 60);
  const MemoryLimit limit(24 * kMiB);
  const PeakMemory peak;
  const std::string said = error_of(read_all);
  CHECK(has(said, folder.path("a.mcap") + ": scans and poses in work needs "));
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < 48 * kMiB);
}

TEST_CASE("limits: point clouds are checked before their points are decompressed") {
  const TempFolder folder;
  io::Cloud cloud = zeros(1'000'000);  // 16 MB
  const std::string packed = folder.write("c.pcd", io::format_pcd(cloud, io::PcdEncoding::kBinaryCompressed));
  CHECK(std::filesystem::file_size(packed) < kMiB);
  const std::string plain = folder.write("b.pcd", io::format_pcd(cloud));
  const std::string text = folder.write("a.pcd", io::format_pcd(cloud, io::PcdEncoding::kAscii));
  const std::string bin = folder.write("000001.bin", std::string(16'000'000, '\0'));
  const std::string line = folder.write("l.pcd", "VERSION " + std::string(2 * kMiB, '7'));
  CHECK(io::read_cloud(packed).points == 1'000'000);
  CHECK(error_of([&] { io::read_cloud(line); }) == line + ": no DATA line within the first MiB: not a PCD file");
  std::string one_line = "FIELDS x\nSIZE 4\nTYPE F\nWIDTH 1\nDATA ascii\n";
  for (int32_t i = 0; i < 3'000'000; ++i) one_line += " 1";
  const std::string wide = folder.write("w.pcd", one_line);
  const MemoryLimit limit(20 * kMiB);
  const PeakMemory peak;
  CHECK(error_of([&] { io::read_cloud(wide); }) == wide + ":6: point 0 has 3000000 values, the header declares 1");
  CHECK(has(error_of([&] { io::read_cloud(packed); }), "c.pcd: reading its 1000000 points needs 30."));
  CHECK(has(error_of([&] { io::read_cloud(plain); }), "b.pcd: reading its 1000000 points needs 30.5 MiB"));
  CHECK(has(error_of([&] { io::read_cloud(text); }), "a.pcd: reading its 1000000 points needs "));
  CHECK(has(error_of([&] { io::read_cloud(bin); }), "000001.bin: the scan needs 30.5 MiB, the memory limit is"));
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < 20 * kMiB);
}

TEST_CASE("limits: a PointCloud2 with too many fields or points is refused") {
  io::PointCloud2 cloud;
  for (std::size_t i = 0; i <= io::kMostPointFields; ++i) cloud.fields.push_back({"f", 0, io::PointField::kUint8, 1});
  const std::string bytes = io::encode_point_cloud2(cloud);
  CHECK_THROWS_WITH(io::decode_point_cloud2(bytes),
                    "is not a sensor_msgs/msg/PointCloud2: it declares 1001 fields a point, at most 1000 are read");
  const Recorded large = cloud_of(zeros(1'000'000), "/front/points", 0);
  const MemoryLimit limit(32 * kMiB);
  CHECK(has(error_of([&] { io::scan_of_message("place", large.data, swept_rig(8), 0); }),
            "place: reading its 1000000 points needs"));
}

TEST_CASE("limits: pictures and arrays are checked against the file's size and the limit") {
  const TempFolder folder;
  io::write_png(folder.path("a.png"), io::Picture(2000, 2000));
  std::string small = io::encode_png(io::Picture(8, 8));
  for (const std::size_t at : {16, 20}) small.replace(at, 4, std::string("\0\0\x75\x30", 4));  // 30000 pixels
  const uint32_t crc = io::update_crc32(0, std::string_view(small).substr(12, 17));
  for (std::size_t k = 0; k < 4; ++k) small[29 + k] = char(crc >> (24 - 8 * k) & 255);
  folder.write("b.png", small);
  const PeakMemory peak;
  CHECK(has(error_of([&] { io::read_png(folder.path("b.png")); }), "b.png: declares 30000 x 30000 pixels, which its "));
  CHECK(io::read_png(folder.path("a.png")).width == 2000);
  const MemoryLimit limit(16 * kMiB);
  CHECK(has(error_of([&] { io::read_png(folder.path("a.png")); }), "a.png: unpacking it needs 22.9 MiB"));
  io::write_npy(folder.path("a.npy"), std::vector<uint8_t>(10 * kMiB).data(), {int64_t(10 * kMiB)});
  CHECK(
      has(error_of([&] { io::read_npy(folder.path("a.npy")); }), "a.npy: is 10.0 MiB long, at most 8.0 MiB are read"));
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < 64 * kMiB);
}

TEST_CASE("limits: text inputs that are too long are refused with their length") {
  const TempFolder folder;
  const std::string longer = folder.write("long.toml", std::string(5 * kMiB, '\n'));
  CHECK(has(error_of([&] { io::load_rig(longer); }), "long.toml: is 5.0 MiB long, at most 4.0 MiB are read"));
  CHECK(has(error_of([&] { io::parse_rig("log: rig.toml", std::string(5 * kMiB, '\n')); }),
            "log: rig.toml: is 5.0 MiB long, at most 4.0 MiB of TOML are read"));
  const MemoryLimit limit(32 * kMiB);
  std::string rows = "stamp_ns,x_m,y_m,yaw_rad,speed_mps\n";
  while (rows.size() < 2 * kMiB) rows += std::to_string(rows.size()) + ",1,2,0,30\n";
  const std::string table = folder.write("ego.csv", rows);
  for (const std::string& said : {error_of([&] { io::read_ego_file(table); }), error_of([&] { io::read_map(table); }),
                                  error_of([&] { io::read_kitti_labels(table); })})
    CHECK(has(said, "ego.csv: is 2.0 MiB long, at most 1.0 MiB are read; the memory limit is 32.0 MiB (--max-memory)"));
  CHECK(
      has(error_of([&] { io::Csv::parse("log: map.csv", rows); }), "log: map.csv: a table of 2.0 MiB needs 64.0 MiB"));
}

TEST_CASE("limits: every reader refuses a device, a pipe and a socket without waiting") {
  const TempFolder folder;
  const std::string pipe = folder.path("pipe.mcap");
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  io::Rig rig = swept_rig(8);
  for (const std::string& path : {std::string("/dev/zero"), pipe}) {
    CAPTURE(path);
    const std::string said = path + ": is a " + (path == pipe ? "pipe" : "device") + ", a regular file is needed";
    CHECK(error_of([&] { io::load_rig(path); }) == said);
    CHECK(error_of([&] { io::read_ego_file(path); }) == said);
    CHECK(error_of([&] { io::read_kitti_poses(path); }) == said);
    CHECK(error_of([&] { io::read_cloud(path); }) == said);
    CHECK(error_of([&] { io::read_png(path); }) == said);
    CHECK(error_of([&] { io::read_npy(path); }) == said);
    CHECK(error_of([&] { io::mount_by_urdf(rig, path); }) == said);
    CHECK(error_of([&] { sim::load_scenario(path); }) == said);
    CHECK(error_of([&] { io::open_mcap(path); }) == said);
    CHECK(error_of([&] { io::open_db3(path); }) == said);
    CHECK(error_of([&] {
            io::FrameScans frame;
            io::open_scans(path, rig)->next(frame);
          }) == said);
    CHECK(error_of([&] { io::read_map(path); }) == said);
    cli::Options options;
    options.config = path;
    CHECK(error_of([&] { cli::load_config(options); }) == said);
  }
}

TEST_CASE("limits: a db3 blob beyond the limit is damage, a view instead of a table is refused") {
  const TempFolder folder;
  const auto make = [&](const std::string& name, const std::string& sql) {
    sqlite3* db = nullptr;
    REQUIRE(sqlite3_open(folder.path(name).c_str(), &db) == SQLITE_OK);
    CHECK(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
    sqlite3_close(db);
  };
  const std::string topics =
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
      "INSERT INTO topics VALUES(1, '/a', 'b', 'cdr');";
  const std::string columns = "(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);";
  make("blob.db3", topics + "CREATE TABLE messages" + columns +
                       "INSERT INTO messages VALUES(1, 1, 5, x'00010000'), (2, 1, 6, zeroblob(20000000));");
  make("view.db3", topics +
                       "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
                       "SELECT i AS id, 1 AS topic_id, 5 AS timestamp, x'00' AS data FROM n WHERE i < 0;");
  io::BagMessage message;
  {
    const auto bag = io::open_bag(folder.path("blob.db3"));
    CHECK(bag->next(message));
    CHECK(bag->next(message));
    CHECK(message.data.size() == 20'000'000);
  }
  CHECK(has(error_of([&] { io::open_bag(folder.path("view.db3")); }), "view.db3: is not a rosbag2 recording"));
  const MemoryLimit limit(32 * kMiB);
  const PeakMemory peak;
  const auto bag = io::open_bag(folder.path("blob.db3"));
  CHECK(bag->next(message));
  CHECK_FALSE(bag->next(message));
  CHECK(has(bag->damage(), "damaged after message 1: SQLite says string or blob too big"));
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < 16 * kMiB);
}
