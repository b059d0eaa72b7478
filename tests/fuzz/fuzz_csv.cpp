// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tables in text files, and every reader based on them: any bytes give a table, or an error with a line. The first byte
// selects the reader.
#include "tests/fuzz/memory_file.h"
#include "tools/io/csv.h"
#include "tools/io/ego_file.h"
#include "tools/io/error.h"
#include "tools/io/kitti_tracking.h"

using namespace overtake;

namespace {

void read_table(std::string_view text) {
  const io::Csv csv = io::Csv::parse("fuzz.csv", std::string(text));
  OVT_FUZZ_REQUIRE(csv.row_count() > 0 && csv.column_count() > 0);
  OVT_FUZZ_REQUIRE(!csv.has_header() || csv.names().size() == csv.column_count());
  csv.find({"stamp_ns", "time"});
  for (std::size_t r = 0; r < csv.row_count(); ++r)
    for (int32_t c = 0; c < int32_t(csv.column_count()); ++c) {
      csv.text(r, c);
      OVT_FUZZ_REQUIRE(csv.line(r) > 0);
      try {
        const double number = csv.number(r, c);
        OVT_FUZZ_REQUIRE(number - number == 0);
        csv.integer(r, c);
      } catch (const io::Error& error) {
        OVT_FUZZ_REQUIRE(error.line() == csv.line(r));
      }
    }
}

void read_ego(const std::string& path) {
  const auto rows = io::read_ego_file(path);
  for (std::size_t i = 1; i < rows.size(); ++i) OVT_FUZZ_REQUIRE(rows[i - 1].stamp_ns < rows[i].stamp_ns);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  static fuzz::MemoryFile file;
  fuzz::Bytes in(data, size);
  const int32_t reader = in.byte() % 8;
  try {
    switch (reader) {
      case 4: read_ego(file.write(in.rest())); break;
      case 5: io::read_kitti_labels(file.write(in.rest())); break;
      case 6: io::read_kitti_poses(file.write(in.rest())); break;
      case 7: io::read_kitti_camera_mounting(file.write(in.rest())); break;
      default: read_table(in.rest());
    }
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
