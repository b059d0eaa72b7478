// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// fuzz_seeds FOLDER: writes FOLDER/<target>/NN, the inputs every fuzzing run starts from. Made here, none recorded; the
// same bytes every time.
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>

#include "pipeline/overtake.h"
#include "tools/config.h"
#include "tools/io/error.h"
#include "tools/io/pcd.h"
#include "tools/io/text.h"

using namespace overtake;

namespace {

std::string folder;

void write_seed(const std::string& target, int32_t number, const std::string& bytes) {
  std::filesystem::create_directories(folder + "/" + target);
  io::write_whole_file(folder + "/" + target + "/" + std::to_string(number), bytes);
}

// Decisions are read byte by byte, so seeded noise of many lengths is a fair start for the targets that read them.
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

io::Pcd make_cloud(io::PcdEncoding encoding) {
  io::Pcd pcd;
  pcd.header.encoding = encoding;
  constexpr std::size_t kPoints = 12;
  const auto add = [&](const char* name, auto first) {
    io::PcdColumn column;
    using T = decltype(first);
    column.type = std::is_same_v<T, float>      ? io::PcdType::kFloat32
                  : std::is_same_v<T, double>   ? io::PcdType::kFloat64
                  : std::is_same_v<T, uint16_t> ? io::PcdType::kUint16
                                                : io::PcdType::kUint8;
    column.bytes.resize(kPoints * sizeof(T));
    for (std::size_t i = 0; i < kPoints; ++i) {
      const T value = T(first + T(i / 3));
      std::memcpy(column.bytes.data() + i * sizeof(T), &value, sizeof value);
    }
    pcd.header.fields.push_back({name, column.type, 1});
    pcd.columns.push_back(column);
  };
  add("x", 1.5f);
  add("y", -2.25f);
  add("z", 0.5f);
  add("intensity", uint8_t(7));
  add("ring", uint16_t(3));
  add("timestamp", 0.125);
  return pcd;
}

void write_clouds() {
  int32_t number = 0;
  for (const auto encoding : {io::PcdEncoding::kAscii, io::PcdEncoding::kBinary, io::PcdEncoding::kBinaryCompressed})
    write_seed("pcd", number++, '\0' + io::format_pcd(make_cloud(encoding)));
  write_seed("pcd", number++, std::string(1, '\1') + "\x40\x01" + std::string(3, '\0') + "\x1f" + std::string(32, 'a'));
  write_seed("pcd", number++, std::string(1, '\1') + std::string("\x20\0\0\0\0a\x20\x00", 8));
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
    uint32_t seed = 1;
    for (const char* target : {"scans", "stamps", "tracker", "kernels", "workers", "api"}) write_noise(target, seed++);
  } catch (const io::Error& error) {
    std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
    return 1;
  }
  return 0;
}
