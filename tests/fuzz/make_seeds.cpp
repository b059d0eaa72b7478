// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// fuzz_seeds FOLDER: writes FOLDER/<target>/NN, the first inputs of every fuzzing run. All are generated, none are
// recorded; the bytes are the same in every run.
#include <sqlite3.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>

#include "pipeline/overtake.h"
#include "tests/support/mcap_parts.h"
#include "tools/client/config.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/ros_messages.h"
#include "tools/io/text.h"

using namespace overtake;

namespace {

std::string folder;

void write_seed(const std::string& target, int32_t number, const std::string& bytes) {
  std::filesystem::create_directories(folder + "/" + target);
  io::write_whole_file(folder + "/" + target + "/" + std::to_string(number), bytes);
}

// Targets read decisions byte by byte, so seeded noise of many lengths is a good start for them.
void write_noise(const std::string& target, uint32_t seed) {
  std::mt19937 random(seed);
  int32_t number = 0;
  for (const std::size_t size : {16u, 64u, 200u, 600u, 1500u, 3000u})
    for (const int32_t limit : {16, 128, 256}) {
      std::string bytes(size, '\0');
      for (char& byte : bytes) byte = char(random() % uint32_t(limit));
      write_seed(target, number++, bytes);
    }
}

io::Cloud make_cloud() {
  io::Cloud cloud;
  cloud.points = 12;
  const auto points = std::size_t(cloud.points);
  const auto add = [&](const char* name, auto first) {
    io::CloudColumn column;
    using T = decltype(first);
    column.type = std::is_same_v<T, float>      ? io::ValueType::kFloat32
                  : std::is_same_v<T, double>   ? io::ValueType::kFloat64
                  : std::is_same_v<T, uint16_t> ? io::ValueType::kUint16
                                                : io::ValueType::kUint8;
    column.bytes.resize(points * sizeof(T));
    for (std::size_t i = 0; i < points; ++i) {
      const T value = T(first + T(i / 3));
      std::memcpy(column.bytes.data() + i * sizeof(T), &value, sizeof value);
    }
    cloud.fields.push_back({name, column.type, 1});
    cloud.columns.push_back(column);
  };
  add("x", 1.5f);
  add("y", -2.25f);
  add("z", 0.5f);
  add("intensity", uint8_t(7));
  add("ring", uint16_t(3));
  add("timestamp", 0.125);
  return cloud;
}

// The first byte is the format's place among those of clouds.
void write_clouds() {
  int32_t number = 0;
  char place = 0;
  for (const io::Format& format : io::formats()) {
    if (!format.cloud) continue;
    for (const io::CloudExample& example : format.cloud->write_examples(make_cloud()))
      write_seed("formats", number++, place + example.bytes);
    ++place;
  }
}

void write_tables() {
  const char* const tables[] = {"x_m;y_m\n1;2\n3;4\n", "# a,b\n1,2\n-3.5,4e2\n", "1 2 3\n4 5 6\n\n7 8 9\n",
                                "stamp_ns,x_m,y_m\n9223372036854775807,nan,inf\n"};
  int32_t number = 0;
  for (const char* table : tables) write_seed("csv", number++, '\0' + std::string(table));
  write_seed("csv", number++,
             std::string(1, '\4') + "stamp_ns,x_m,y_m,yaw_rad,speed_mps\n0,1,2,0.1,30\n10000000,1.3,2,0.1,30\n");
  write_seed("csv", number++, std::string(1, '\4') + "time,x,y,z,psi\n0.01,1,2,0,0.1\n0.02,1.3,2,0,0.1\n");
  write_seed("csv", number++,
             std::string(1, '\5') + "0 2 Car 0 1 -1.79 296 161 455 292 2.0 1.8 4.4 -4.5 1.8 13.4 -2.1\n");
  write_seed("csv", number++, std::string(1, '\6') + "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 1.25\n");
  write_seed("csv", number++,
             std::string(1, '\7') + "R0_rect: 1 0 0 0 1 0 0 0 1\nTr_velo_to_cam: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
}

void write_maps() {
  const std::string maps[] = {"x_m,y_m,w_tr_right_m,w_tr_left_m\n0,0,5,5\n10,0,5,5\n20,3,5,6\n30,9,5,6\n",
                              std::string("x_ref_m;y_ref_m;width_right_m;width_left_m;x_normvec_m;y_normvec_m\n") +
                                  "0;0;4;4;0;-1\n10;0;4;4;0;-1\n20;0;4;4;0;-1\n",
                              "0 0 5 5\n10 0 5 5\n20 5 5 5\n0 0 5 5\n"};
  int32_t number = 0;
  for (const std::string& map : maps) write_seed("maps", number++, "\1\1" + map);
  const char* const bounds = "x,y\n0,5\n10,5\n20,5\n30,5\n";
  write_seed("maps", number++, std::string("\1\4") + bounds + "x,y\n0,0\n10,0\n20,0\n30,0");
  std::mt19937 random(5);
  for (int32_t i = 0; i < 8; ++i) {
    std::string bytes(std::size_t(100 + 60 * i), '\0');
    for (char& byte : bytes) byte = char(random() % 256);
    bytes[0] = '\0';
    if (i % 2) bytes[4] = char(200);  // corners a few metres apart
    write_seed("maps", number++, bytes);
  }
}

void write_toml() {
  int32_t number = 0;
  for (const std::string& name : io::builtin_rig_names()) {
    const std::string rig = io::format_rig(io::load_rig(name));
    write_seed("toml", number++, '\1' + rig);
    cli::Options options;
    options.rig = name;
    write_seed("toml", number++, '\4' + cli::format_config(cli::load_config(options)));
  }
  write_seed("toml", number++, "\4preset = \"paper\"\nworkers = 2\n[tracker]\nconfirm_hits = 3\n");
}

std::string make_cloud_bytes() {
  io::PointCloud2 cloud;
  const std::string data = io::make_cloud_message(make_cloud(), {1'000'000'007, "front"}, cloud);
  cloud.data = data;
  return io::encode_point_cloud2(cloud);
}

std::string make_odometry() {
  io::Odometry odometry;
  odometry.header = {1'000'000'007, "map"};
  odometry.child_frame_id = "base_link";
  io::set_rotation(odometry.pose, 0.1, -0.2, 1.3);
  odometry.vx_mps = 30;
  return io::encode_odometry(odometry);
}

void write_messages() {
  write_seed("cloud", 0, '\0' + make_cloud_bytes());
  write_seed("cloud", 1, '\1' + make_cloud_bytes());
  write_seed("messages", 0, '\0' + make_odometry());
  io::RosTransform transform{{5, "base_link"}, "front", {}};
  io::set_rotation(transform.pose, 0, 0, 2);
  write_seed("messages", 1, '\1' + io::encode_transforms({transform, transform}));
}

// The first byte selects the target's mode: a file, or the records of a chunk.
void write_mcaps() {
  int32_t number = 0;
  const std::string path = folder + "/a.mcap";
  for (const char* compression : {"none", "lz4", "zstd"})
    for (const bool crc : {true, false}) {
      io::McapOptions options;
      options.compression = compression;
      options.crc = crc;
      options.chunk_bytes = crc ? 300 : 0;
      {
        io::McapWriter log(path, options);
        const uint16_t channel =
            log.add_channel(log.add_schema("a/msg/A", "ros2msg", "int32 a"), "/a", "cdr", {{"a", "b"}});
        const uint16_t other = log.add_channel(log.add_schema("a/msg/A", "ros2msg", "int32 a"), "/b", "cdr", {},
                                               log.add_group({200, true}));
        for (int32_t i = 0; i < 4; ++i)
          for (const uint16_t topic : {channel, other}) log.write(topic, i, std::string(100, char(i)));
        log.add_attachment("map.csv", "text/csv", "x,y\n");
        log.add_metadata("race", {{"track", "oval"}});
        log.close();
      }
      write_seed("mcap", number++, '\0' + io::read_whole_file(path));
    }
  const std::string records = test::mcap_schema(1, "a", "b") + test::mcap_channel(1, 1, "/a") +
                              test::mcap_message(1, 5, "hello") + test::mcap_message(1, 6, std::string(200, 'a'));
  for (int32_t kind = 1; kind <= 6; ++kind) write_seed("mcap", number++, char(kind) + records);
  for (const char* compression : {"lz4", "zstd"})
    write_seed("mcap", number++,
               (*compression == 'l' ? '\7' : '\10') + std::string("\0\4\0\0", 4) +
                   io::compress_chunk(compression, 1, records));
  std::filesystem::remove(path);
}

void write_bags() {
  for (const int32_t page : {512, 1024}) {
    const std::string path = folder + "/a.db3";
    std::filesystem::remove(path);
    sqlite3* db = nullptr;
    sqlite3_open(path.c_str(), &db);
    const std::string sql =
        "PRAGMA page_size = " + std::to_string(page) +
        "; CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format "
        "TEXT "
        "NOT NULL); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT "
        "NULL, "
        "data BLOB NOT NULL); INSERT INTO topics VALUES(1, '/a', 'b/msg/B', 'cdr'), (2, '/b', 'b/msg/B', 'cdr'); "
        "INSERT "
        "INTO messages VALUES(1, 1, 5, x'0001000001020304'), (2, 2, 6, zeroblob(700)), (3, 1, 7, x'');";
    if (sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw io::Error(path, 0, sqlite3_errmsg(db));
    sqlite3_close(db);
    write_seed("db3", page / 512, io::read_whole_file(path));
    std::filesystem::remove(path);
  }
}

void write_urdfs() {
  const std::string head = "<robot name=\"car\"><link name=\"base\"/><link name=\"front\"/><link name=\"axle\"/>";
  const auto joint = [](const std::string& parent, const std::string& child, const std::string& origin) {
    return "<joint><parent link=\"" + parent + "\"/><child link=\"" + child + "\"/>" + origin + "</joint>";
  };
  const std::string origin = "<origin xyz=\"1 2 3\" rpy=\"0.1 0 -0.2\"/>";
  write_seed("urdf", 0, '\0' + head + joint("base", "front", origin) + "</robot>");
  write_seed("urdf", 1, '\1' + head + joint("base", "axle", origin) + joint("axle", "front", origin) + "</robot>");
  write_seed("urdf", 2, '\0' + head + joint("front", "axle", "") + joint("axle", "front", "") + "</robot>");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  folder = argv[1];
  try {
    write_clouds();
    write_tables();
    write_maps();
    write_toml();
    std::filesystem::create_directories(folder);
    write_messages();
    write_mcaps();
    write_bags();
    write_urdfs();
    uint32_t seed = 1;
    for (const char* target : {"scans", "stamps", "tracker", "kernels", "workers", "api"}) write_noise(target, seed++);
  } catch (const io::Error& error) {
    std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
