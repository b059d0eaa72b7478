// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// URDF: any bytes give the sensors' mounting, or an error that names the file. A rig file may hold each such mounting.
// First byte: poses relative to the root, or to a link.
#include "tests/fuzz/memory_file.h"
#include "tools/io/error.h"
#include "tools/io/rig.h"
#include "tools/io/urdf.h"

using namespace overtake;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file;
  static const io::Rig kRig = io::parse_rig("r",
                                            "period_s = 0.05\n[[sensor]]\nname = \"front\"\nx_m = 0.0\ny_m = 0.0\nz_m "
                                            "= 0.0\nrows = 8\ncols = 64\nwraps = true\n");
  fuzz::Bytes in(data, size);
  const bool link = in.byte() % 2 == 1;
  const std::string path = file.write(in.rest());
  io::Rig rig = kRig;
  try {
    io::mount_by_urdf(rig, link ? path + ",base" : path);
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
    return 0;
  }
  const std::string text = io::format_rig(rig);
  OVT_FUZZ_REQUIRE(io::format_rig(io::parse_rig("again", text)) == text);
  return 0;
}
