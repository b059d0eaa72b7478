// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Mutated files of every format: an error or what came before the damage, never a crash. 2,000 a format where a
// sanitizer watches, 200 elsewhere.
#include <doctest/doctest.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/hash.h"
#include "tests/support/bags.h"
#include "tests/support/temp_folder.h"
#include "tools/io/scan_stream.h"
#include "tools/io/urdf.h"

using namespace overtake;
using namespace overtake::test;

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr int32_t kFiles = 2000;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
constexpr int32_t kFiles = 2000;
#else
constexpr int32_t kFiles = 200;
#endif
#else
constexpr int32_t kFiles = 200;
#endif

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

// Changes one place at or behind `from`: cut off, bits flipped, a count made huge, a piece left out, doubled or zeroed.
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
  for (const io::PcdColumn* column : {&scan.x, &scan.y, &scan.z, &scan.layer, &scan.intensity})
    hash.add_bytes(column->bytes.data(), column->bytes.size());
  return hash.value();
}

// Scans that can be read before the end, the damage or the error.
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

// `checked`: the format notices any change of a message, so that all that is delivered is true.
void break_files(const TempFolder& folder, const std::string& name, const std::string& whole, std::size_t header,
                 const io::Rig& rig, bool checked) {
  CAPTURE(name);
  bool complained = false;
  const auto intact = read_all(folder.write(name, whole), rig, complained);
  REQUIRE_FALSE(complained);
  REQUIRE(intact.size() > 0);
  const std::set<uint64_t> known(intact.begin(), intact.end());
  Random random{88172645463325252u + Hash(uint64_t(name.size())).value()};
  int32_t complaints = 0, behind_header = 0, partly = 0;
  for (int32_t k = 0; k < kFiles; ++k) {
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
  CHECK(behind_header * 2 > kFiles);
  CHECK(complaints * 10 > kFiles);            // it does notice
  CHECK((intact.size() == 1 || partly > 0));  // and delivers what came before
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

}  // namespace

TEST_CASE("broken files: MCAP, each compression, gives an error or true messages before the damage") {
  const TempFolder folder;
  for (const char* compression : {"none", "lz4", "zstd"}) {
    io::McapOptions options;
    options.compression = compression;
    options.chunk_bytes = 6000;
    write_mcap(folder.path("whole.mcap"), small_recording(), options);
    break_files(folder, std::string(compression) + ".mcap", io::read_whole_file(folder.path("whole.mcap")), 40,
                swept_rig(kLines), true);
  }
}

TEST_CASE("broken files: MCAP without chunks, checksums and index") {
  const TempFolder folder;
  io::McapOptions options;
  options.chunk_bytes = 0;
  options.crc = options.index = false;
  write_mcap(folder.path("whole.mcap"), small_recording(), options);
  break_files(folder, "plain.mcap", io::read_whole_file(folder.path("whole.mcap")), 40, swept_rig(kLines), false);
}

TEST_CASE("broken files: db3") {
  const TempFolder folder;
  write_db3(folder.path("whole.db3"), small_recording());
  break_files(folder, "a.db3", io::read_whole_file(folder.path("whole.db3")), 100, swept_rig(kLines), false);
}

TEST_CASE("broken files: PCD, each encoding") {
  const TempFolder folder;
  for (const io::PcdEncoding encoding :
       {io::PcdEncoding::kAscii, io::PcdEncoding::kBinary, io::PcdEncoding::kBinaryCompressed}) {
    io::Pcd pcd = swept_cloud(kLines, kShots, 0);
    pcd.header.encoding = encoding;
    const std::string whole = io::format_pcd(pcd);
    break_files(folder, "e" + std::to_string(int(encoding)) + "_000001.pcd", whole, whole.find("DATA"),
                swept_rig(kLines), false);
  }
}

TEST_CASE("broken files: KITTI") {
  const TempFolder folder;
  const io::Pcd pcd = swept_cloud(kLines, kShots, 0);
  std::string bin;
  for (std::size_t i = 0; i < std::size_t(pcd.header.points); ++i)
    for (std::size_t c = 0; c < 4; ++c)
      bin.append(reinterpret_cast<const char*>(pcd.columns[c].bytes.data()) + 4 * i, 4);
  break_files(folder, "000001.bin", bin, 16, swept_rig(kLines), false);
}

TEST_CASE("broken files: rigs and URDF") {
  const TempFolder folder;
  const std::string rig = io::format_rig(io::load_rig("racecar"));
  const std::string urdf =
      "<robot name=\"car\"><link name=\"base\"/><link name=\"front\"/>"
      "<joint name=\"j\" type=\"fixed\"><parent link=\"base\"/><child link=\"front\"/>"
      "<origin xyz=\"1 2 3\" rpy=\"0.1 0 -0.2\"/></joint></robot>";
  Random random{7};
  int32_t refused = 0;
  for (int32_t k = 0; k < kFiles; ++k) {
    CAPTURE(k);
    refused += !error_of([&] { io::parse_rig("rig", mutate(rig, 0, random)); }).empty();
    io::Rig mounted = swept_rig(kLines);
    refused += !error_of([&] { io::mount_by_urdf(mounted, folder.write("a.urdf", mutate(urdf, 0, random))); }).empty();
  }
  CHECK(refused > kFiles / 2);
}
