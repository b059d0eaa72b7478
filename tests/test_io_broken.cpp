// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Mutated files of every format: an error, or the part before the damage; never a crash; memory within the limit.
#include <doctest/doctest.h>

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "core/hash.h"
#include "tests/support/bags.h"
#include "tests/support/peak_memory.h"
#include "tests/support/temp_folder.h"
#include "tools/client/config.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/io/box_file.h"
#include "tools/io/ego_file.h"
#include "tools/io/formats.h"
#include "tools/io/image.h"
#include "tools/io/kitti_tracking.h"
#include "tools/io/map_file.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/npy.h"
#include "tools/io/ros_messages.h"
#include "tools/io/scan_stream.h"
#include "tools/io/urdf.h"
#include "tools/sim/scenario.h"

using namespace overtake;
using namespace overtake::test;

namespace {

// Files per format: few in every run; 2,000 with a sanitizer and in the suite "long".
constexpr int32_t kSome = kMemoryIsOurs ? 200 : 2000, kMany = 2000;
constexpr uint64_t kLimit = uint64_t(64) << 20;  // no file may take more memory than that

constexpr int32_t kLines = 8, kShots = 20, kFrames = 6;

struct Random {
  uint64_t state;
  uint64_t next() {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
  }
  std::size_t below(std::size_t n) { return std::size_t(next() % n); }
};

// Changes one place at or after `from`: cuts the file, flips bits, enlarges a count, drops, doubles or zeroes a piece.
std::string mutate(std::string bytes, std::size_t from, Random& random) {
  const std::size_t at = from + random.below(bytes.size() - from);
  const std::size_t length = std::min(bytes.size() - at, 1 + random.below(random.below(8) ? 16 : 4096));
  switch (random.below(6)) {
    case 0: bytes.resize(at); break;
    case 1:
      for (std::size_t n = 1 + random.below(8); n > 0; --n) {
        const std::size_t place = std::min(bytes.size() - 1, at + random.below(32));
        bytes[place] = char(bytes[place] ^ (1 << random.below(8)));
      }
      break;
    case 2: {
      static constexpr unsigned char kHuge[4][8] = {{255, 255, 255, 255, 255, 255, 255, 255},
                                                    {255, 255, 255, 127, 0, 0, 0, 0},
                                                    {0, 0, 0, 128, 0, 0, 0, 0},
                                                    {255, 255, 255, 255, 255, 255, 255, 127}};
      const unsigned char* huge = kHuge[random.below(4)];
      for (std::size_t i = 0; i < (random.below(2) ? 8u : 4u) && at + i < bytes.size(); ++i)
        bytes[at + i] = char(huge[i]);
      break;
    }
    case 3: bytes.erase(at, length); break;
    case 4: bytes.insert(at, bytes.substr(at, length)); break;
    default: std::fill_n(bytes.begin() + std::ptrdiff_t(at), length, '\0');
  }
  return bytes;
}

uint64_t hash_of(const io::SensorScan& scan) {
  Hash hash;
  hash.add_value(scan.stamp_ns);
  for (const io::CloudColumn* column : {&scan.x, &scan.y, &scan.z, &scan.layer, &scan.intensity})
    hash.add_bytes(column->bytes.data(), column->bytes.size());
  return hash.value();
}

// Scans read before the end, the damage or the error.
std::vector<uint64_t> read_all(const std::string& path, const io::Rig& rig, bool& complained) {
  std::vector<uint64_t> scans;
  complained = false;
  try {
    const auto stream = io::open_scans(path, rig);
    io::FrameScans frame;
    while (stream->next(frame))
      for (const io::SensorScan& scan : frame.scans) scans.push_back(hash_of(scan));
    complained = !stream->damage().empty();
  } catch (const io::Error& error) {
    complained = true;
    CHECK(std::string(error.what()).size() > 10);
  }
  return scans;
}

// `checked`: the format detects any change of a message, so every delivered message is unchanged.
void break_files(const TempFolder& folder, const std::string& name, const std::string& whole, std::size_t header,
                 const io::Rig& rig, bool checked, int32_t files) {
  CAPTURE(name);
  const MemoryLimit limit(kLimit);
  const PeakMemory peak;
  bool complained = false;
  const auto intact = read_all(folder.write(name, whole), rig, complained);
  REQUIRE_FALSE(complained);
  REQUIRE(intact.size() > 0);
  const std::set<uint64_t> known(intact.begin(), intact.end());
  Random random{88172645463325252u + Hash(uint64_t(name.size())).value()};
  int32_t complaints = 0, behind_header = 0, partly = 0;
  for (int32_t k = 0; k < files; ++k) {
    CAPTURE(k);
    const bool behind = k % 4 != 0;
    behind_header += behind;
    const std::string path = folder.write(name, mutate(whole, behind ? header : 0, random));
    const auto scans = read_all(path, rig, complained);
    complaints += complained;
    partly += complained && !scans.empty();
    if (!checked) continue;
    for (const uint64_t scan : scans) REQUIRE(known.contains(scan));
  }
  CHECK(behind_header * 2 > files);
  CHECK(complaints * 10 > files);             // it detects damage
  CHECK((intact.size() == 1 || partly > 0));  // and delivers the part before it
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < kLimit);
}

// A file that `read` reads completely, given its path: it succeeds, or throws an io::Error with a message.
template <class F>
void break_whole(const TempFolder& folder, const std::string& name, const std::string& whole, int32_t files, F&& read) {
  CAPTURE(name);
  const MemoryLimit limit(kLimit);
  const PeakMemory peak;
  REQUIRE(error_of([&] { read(folder.write(name, whole)); }) == "");
  Random random{88172645463325252u + Hash(uint64_t(whole.size())).value()};
  int32_t refused = 0;
  for (int32_t k = 0; k < files; ++k) {
    CAPTURE(k);
    const std::string path = folder.write(name, mutate(whole, 0, random));
    const std::string said = error_of([&] { read(path); });
    if (!said.empty()) CHECK(said.size() > path.size() + 3);  // the file name and a sentence
    refused += !said.empty();
  }
  CHECK(refused * 10 > files);
  if (kMemoryIsOurs) CHECK(peak.grown_bytes() < kLimit);
}

std::vector<Recorded> small_recording() {
  std::vector<Recorded> messages;
  for (int32_t frame = 0; frame < kFrames; ++frame) {
    messages.push_back(cloud_of(swept_cloud(kLines, kShots, 0.2 * frame), "/front/points", frame * 50'000'000));
    for (Recorded& pose : straight_drive("/ego/odometry", frame * 50'000'000, frame * 50'000'000 + 40'000'000))
      messages.push_back(std::move(pose));
  }
  return messages;
}

void break_mcap(int32_t files) {
  const TempFolder folder;
  for (const char* compression : {"none", "lz4", "zstd"}) {
    io::McapOptions options;
    options.compression = compression;
    options.chunk_bytes = 6000;
    write_mcap(folder.path("whole.mcap"), small_recording(), options);
    break_files(folder, std::string(compression) + ".mcap", io::read_whole_file(folder.path("whole.mcap")), 40,
                swept_rig(kLines), true, files);
  }
}

void break_unchecked_mcap(int32_t files) {
  const TempFolder folder;
  for (const uint64_t chunk_bytes : {0, 6000}) {
    io::McapOptions options;
    options.compression = chunk_bytes == 0 ? "none" : "zstd";
    options.chunk_bytes = chunk_bytes;
    options.crc = options.index = false;
    write_mcap(folder.path("whole.mcap"), small_recording(), options);
    break_files(folder, chunk_bytes == 0 ? "plain.mcap" : "unchecked.mcap",
                io::read_whole_file(folder.path("whole.mcap")), 40, swept_rig(kLines), false, files);
  }
}

// A log as overtake simulate writes it, without a map, of one sensor; `change` makes the clouds of the truth wrong.
void write_simulated(const std::string& path, const std::function<void(io::PointCloud2&)>& change) {
  io::McapOptions options;
  options.crc = options.index = false;  // changed bytes reach the decoders
  options.compression = "none";
  io::McapWriter log(path, options);
  log.add_metadata("overtake", {{"without", "map"}});
  log.add_attachment("rig.toml", "application/toml", io::format_rig(swept_rig(kLines)));
  const uint16_t mounting =
      log.add_channel(log.add_schema(io::kTransformsName, "ros2msg", io::kTransformsSchema), "/tf_static", "cdr");
  log.write(mounting, 0, io::encode_transforms({}));
  const uint16_t clouds = log.add_schema(io::kPointCloud2Name, "ros2msg", io::kPointCloud2Schema);
  const uint16_t scan = log.add_channel(clouds, "/front/points", "cdr");
  const uint16_t truth = log.add_channel(clouds, "/truth/front/surface", "cdr");
  const uint16_t ego =
      log.add_channel(log.add_schema(io::kOdometryName, "ros2msg", io::kOdometrySchema), "/ego/odometry", "cdr");
  const uint16_t cars = log.add_channel(0, "/truth/cars", "json");
  for (int32_t frame = 0; frame < kFrames; ++frame) {
    const int64_t stamp_ns = frame * 50'000'000;
    const io::Cloud points = swept_cloud(kLines, kShots, 0.2 * frame);
    log.write(scan, stamp_ns, cloud_of(points, "/front/points", stamp_ns).data);
    const std::string surfaces(2 * std::size_t(points.points), '\0');
    io::PointCloud2 cloud;
    cloud.header = {stamp_ns, "front"};
    cloud.width = uint32_t(points.points);
    cloud.fields = {{"surface", 0, io::PointField::kUint16, 1}};
    cloud.point_step = 2, cloud.row_step = uint32_t(surfaces.size());
    cloud.data = surfaces;
    change(cloud);
    log.write(truth, stamp_ns, io::encode_point_cloud2(cloud));
    log.write(ego, stamp_ns, straight_drive("/ego/odometry", stamp_ns, stamp_ns)[0].data);
    log.write(cars, stamp_ns,
              "{\"stamp_ns\":" + std::to_string(stamp_ns) + ",\"frame\":" + std::to_string(frame) + ",\"cars\":[]}");
  }
  log.close();
}

int64_t frames_of_simulated(const std::string& path) {
  evaluation::SimulatedLog log(path);
  evaluation::LogFrame frame;
  int64_t frames = 0;
  for (; log.next(frame); ++frames) CHECK(frame.surface.size() == frame.scans.scans.size());
  if (!log.damage().empty()) throw io::Error(path, 0, log.damage());
  return frames;
}

void break_simulated(int32_t files) {
  const TempFolder folder;
  write_simulated(folder.path("whole.mcap"), [](io::PointCloud2&) {});
  break_whole(folder, "a.mcap", io::read_whole_file(folder.path("whole.mcap")), files, frames_of_simulated);
}

void break_db3(int32_t files) {
  const TempFolder folder;
  write_db3(folder.path("whole.db3"), small_recording());
  break_files(folder, "a.db3", io::read_whole_file(folder.path("whole.db3")), 100, swept_rig(kLines), false, files);
}

// Every format of clouds in the table, in each of its encodings.
void break_clouds(int32_t files) {
  const TempFolder folder;
  for (const io::Format& format : io::formats()) {
    if (!format.cloud) continue;
    int32_t number = 0;
    for (const io::CloudExample& example : format.cloud->write_examples(swept_cloud(kLines, kShots, 0)))
      break_files(folder, "e" + std::to_string(number++) + "_000001" + format.extension, example.bytes,
                  example.header_bytes, swept_rig(kLines), false, files);
    CHECK(number > 0);
  }
}

void break_toml(int32_t files) {
  const TempFolder folder;
  const auto rig_of = [](const std::string& path) { io::load_rig(path); };
  break_whole(folder, "rig.toml", io::format_rig(io::load_rig("racecar")), files, rig_of);
  cli::Options options;
  options.rig = "av21";
  const std::string config = cli::format_config(cli::load_config(options));
  break_whole(folder, "config.toml", config, files, [](const std::string& path) {
    cli::Options by_file;
    by_file.config = path;
    cli::load_config(by_file);
  });
  break_whole(folder, "scenario.toml", io::read_whole_file("tools/sim/scenarios/three_cars.toml"), files,
              [](const std::string& path) { sim::load_scenario(path); });
}

void break_tables(int32_t files) {
  const TempFolder folder;
  std::string ego = "stamp_ns,x_m,y_m,z_m,yaw_rad,speed_mps\n", map = "x_m,y_m,w_tr_right_m,w_tr_left_m\n",
              bound = "x,y\n";
  for (int32_t i = 0; i < 40; ++i) {
    const std::string at = std::to_string(10 * i);
    ego += std::to_string(10'000'000 * i) + "," + at + ".25,2,0,0.1,30\n";
    map += at + ",0.5,5,6\n";
    bound += at + ",4.5\n";
  }
  break_whole(folder, "ego.csv", ego, files, [](const std::string& path) { io::read_ego_file(path); });
  break_whole(folder, "map.csv", map, files, [](const std::string& path) { io::read_map(path); });
  const std::string other = folder.write("other.csv", "x,y\n0,-4\n100,-4\n200,-4\n390,-4\n");
  break_whole(folder, "bound.csv", bound, files, [&](const std::string& path) { io::read_map(path + "," + other); });
  break_whole(folder, "000001_box.txt", "12.5 -3.25 0.5 4.9 1.9 1.0 0.1\n", files, [](const std::string& path) {
    io::FrameScans frame;
    frame.scans.resize(1);
    frame.scans[0].path = path.substr(0, path.rfind("_box.txt")) + ".pcd";
    const auto box = io::read_box_beside(frame);
    CHECK(box.has_value());
  });
  break_whole(folder, "labels.txt", "0 2 Car 0 1 -1.79 296 161 455 292 2.0 1.8 4.4 -4.5 1.8 13.4 -2.1\n", files,
              [](const std::string& path) { io::read_kitti_labels(path); });
  break_whole(folder, "poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0.5 0 1 0 0 0 0 1 1.25\n", files,
              [](const std::string& path) { io::read_kitti_poses(path); });
}

void break_urdf(int32_t files) {
  const TempFolder folder;
  break_whole(folder, "a.urdf",
              "<robot name=\"car\"><link name=\"base\"/><link name=\"front\"/>"
              "<joint name=\"j\" type=\"fixed\"><parent link=\"base\"/><child link=\"front\"/>"
              "<origin xyz=\"1 2 3\" rpy=\"0.1 0 -0.2\"/></joint></robot>",
              files, [](const std::string& path) {
                io::Rig mounted = swept_rig(kLines);
                io::mount_by_urdf(mounted, path);
              });
}

void break_images(int32_t files) {
  const TempFolder folder;
  io::Picture picture(60, 20);
  for (int32_t i = 0; i < 1200; ++i) picture.at(i % 60, i / 60) = io::label_color(i / 7);
  break_whole(folder, "a.png", io::encode_png(picture), files, [](const std::string& path) { io::read_png(path); });
  std::vector<float> values(600);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i) * 0.5f;
  io::write_npy(folder.path("whole.npy"), values.data(), {20, 30});
  break_whole(folder, "a.npy", io::read_whole_file(folder.path("whole.npy")), files, [](const std::string& path) {
    const io::Npy npy = io::read_npy(path);
    CHECK(npy.values() * (npy.type == "|u1" ? 1 : 4) == int64_t(npy.bytes.size()));
  });
}

}  // namespace

TEST_CASE("broken files: MCAP, each compression, gives an error or unchanged messages before the damage") {
  break_mcap(kSome);
}
TEST_CASE("broken files: MCAP without checksums and index, with and without chunks, does not crash") {
  break_unchecked_mcap(kSome);
}
TEST_CASE("broken files: a simulated log gives its frames or an error") { break_simulated(kSome); }
TEST_CASE("broken files: surfaces of a simulated log outside of their message are an error") {
  const TempFolder folder;
  const std::string path = folder.path("a.mcap"), said = "the surfaces of a scan do not fit their message";
  const auto error = [&](const std::function<void(io::PointCloud2&)>& change) {
    write_simulated(path, change);
    return error_of([&] { frames_of_simulated(path); });
  };
  CHECK(error([](io::PointCloud2&) {}) == "");
  CHECK(frames_of_simulated(path) == kFrames);
  for (const uint32_t offset : {1u, 0xfffffffdu, 0xfffffffeu, 0xffffffffu})
    CHECK_MESSAGE(error([&](io::PointCloud2& cloud) { cloud.fields[0].offset = offset; }).ends_with(said), offset);
  // 2^62 points of 4 bytes: 0 bytes in 64 bits.
  CHECK(error([](io::PointCloud2& cloud) {
          cloud.width = cloud.height = uint32_t(1) << 31, cloud.point_step = 4;
        }).ends_with(said));
}
TEST_CASE("broken files: db3 gives an error or messages before the damage") { break_db3(kSome); }
TEST_CASE("broken files: clouds of every format, each encoding, are read or give an error") { break_clouds(kSome); }
TEST_CASE("broken files: rigs, configurations and scenarios are read or give an error") { break_toml(kSome); }
TEST_CASE("broken files: tables are read or give an error") { break_tables(kSome); }
TEST_CASE("broken files: URDF is read or gives an error") { break_urdf(kSome); }
TEST_CASE("broken files: pictures and arrays are read or give an error") { break_images(kSome); }

TEST_SUITE("long") {
  TEST_CASE("broken files: 2,000 of each format are read or give an error") {
    for (const auto& of_format : {break_mcap, break_unchecked_mcap, break_simulated, break_db3, break_clouds,
                                  break_toml, break_tables, break_urdf, break_images})
      of_format(kMany);
  }
}
