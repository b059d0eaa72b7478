// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: write_log OUT.mcap COMPRESSION CHUNK_BYTES
//        write_log --speed FOLDER SECONDS
//
// The first form writes a small log of clouds, odometry, transforms, an attachment and metadata. The second measures
// the speed of reading clouds of three sensors at 20 Hz (27 thousand points each, noisy ranges) from db3 and MCAP, as a
// multiple of real time.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>

#include "tests/support/bags.h"
#include "tools/io/bag_stream.h"
#include "tools/io/scan_stream.h"

namespace {

using namespace overtake;
using namespace overtake::test;

void write_small(const std::string& path, const io::McapOptions& options) {
  io::McapWriter log(path, options);
  const uint16_t clouds = log.add_channel(log.add_schema(io::kPointCloud2Name, "ros2msg", io::kPointCloud2Schema),
                                          "/front/points", "cdr", {{"offered_qos_profiles", ""}});
  const uint16_t poses =
      log.add_channel(log.add_schema(io::kOdometryName, "ros2msg", io::kOdometrySchema), "/ego/odometry", "cdr");
  const uint16_t frames =
      log.add_channel(log.add_schema(io::kTransformsName, "ros2msg", io::kTransformsSchema), "/tf_static", "cdr");
  io::RosTransform transform;
  transform.header = {0, "base_link"};
  transform.child_frame_id = "front";
  log.write(frames, 0, io::encode_transforms({transform}));
  for (int32_t frame = 0; frame < 10; ++frame) {
    const int64_t stamp_ns = frame * 50'000'000;
    log.write(clouds, stamp_ns, cloud_of(swept_cloud(8, 40, 0.1 * frame), "/front/points", stamp_ns).data);
    for (const Recorded& pose : straight_drive("/ego/odometry", stamp_ns, stamp_ns + 40'000'000))
      log.write(poses, pose.stamp_ns, pose.data);
  }
  log.add_attachment("rig.toml", "application/toml", io::format_rig(swept_rig(8)));
  log.add_metadata("overtake", {{"made by", "write_log"}});
  log.close();
}

// Ranges that no compressor can predict, like real ones.
io::Cloud noisy_cloud(uint64_t seed) {
  io::Cloud cloud = swept_cloud(32, 857, 0);
  for (std::size_t c = 0; c < 4; ++c)
    for (std::size_t i = 0; i < std::size_t(cloud.points); ++i) {
      seed = seed * 6364136223846793005u + 1442695040888963407u;
      float value = 0;
      std::memcpy(&value, cloud.columns[c].bytes.data() + 4 * i, 4);
      value += float(seed >> 40) * 1e-9f;
      std::memcpy(cloud.columns[c].bytes.data() + 4 * i, &value, 4);
    }
  return cloud;
}

void measure(const std::string& path, double seconds) {
  const io::Rig rig = io::load_rig("av21");
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const auto stream = io::open_scans(path, rig);
  io::FrameScans frame;
  int64_t scans = 0, points = 0;
  while (stream->next(frame))
    for (const io::SensorScan& scan : frame.scans) ++scans, points += scan.count;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  const double cpu_s = double(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  std::printf("%-18s %lld scans of %lld points: %.3f s of CPU, %.0f times real time (%.3f s on the clock)\n",
              path.substr(path.rfind('/') + 1).c_str(), static_cast<long long>(scans),
              static_cast<long long>(points / scans), cpu_s, seconds / cpu_s, took.count());
}

void measure_all(const std::string& folder, double seconds) {
  std::vector<Recorded> messages;
  for (int32_t frame = 0; frame < int32_t(seconds * 20); ++frame)
    for (const char* sensor : {"front", "left", "right"})
      messages.push_back(
          cloud_of(noisy_cloud(uint64_t(frame % 7)), std::string("/") + sensor + "/points", frame * 50'000'000));
  write_db3(folder + "/speed.db3", messages);
  for (const char* compression : {"none", "lz4", "zstd"}) {
    io::McapOptions options;
    options.compression = compression;
    write_mcap(folder + "/speed_" + compression + ".mcap", messages, options);
  }
  messages.clear();
  for (int32_t round = 0; round < 3; ++round)
    for (const char* name : {"/speed.db3", "/speed_none.mcap", "/speed_lz4.mcap", "/speed_zstd.mcap"})
      measure(folder + name, seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: write_log OUT.mcap none|lz4|zstd CHUNK_BYTES, or write_log --speed FOLDER SECONDS\n");
    return 2;
  }
  if (std::string(argv[1]) == "--speed") {
    measure_all(argv[2], std::atof(argv[3]));
    return 0;
  }
  io::McapOptions options;
  options.compression = argv[2];
  options.chunk_bytes = uint64_t(std::atoll(argv[3]));
  write_small(argv[1], options);
  return 0;
}
