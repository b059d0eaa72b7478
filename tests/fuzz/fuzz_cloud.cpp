// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// PointCloud2 in CDR: any bytes give a cloud or an error message. Writing and reading a cloud gives the same cloud. A
// scan made of the cloud has all its points in every column. First byte: one sensor, or two that share the cloud.
#include <stdexcept>

#include "tests/fuzz/bytes.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_message.h"
#include "tools/io/memory_limit.h"

using namespace overtake;

namespace {

const io::Rig& rig_of(bool shared) {
  static const std::string kSensor =
      "x_m = 1.0\ny_m = 0.0\nz_m = 1.5\nrows = 4\ncols = 64\nazimuth_left_deg = 60.0\nazimuth_right_deg = -60.0\n";
  static const io::Rig kOne = io::parse_rig("one", "period_s = 0.05\n[[sensor]]\nname = \"front\"\n" + kSensor);
  static const io::Rig kTwo = io::parse_rig(
      "two",
      "period_s = 0.05\ncloud_frame = \"vehicle\"\nshared_cloud = true\n[[sensor]]\nname = \"a\"\nlayer_last = 3\n" +
          kSensor + "[[sensor]]\nname = \"b\"\nlayer_first = 4\n" + kSensor);
  return shared ? kTwo : kOne;
}

void check_scan(const io::SensorScan& scan) {
  OVT_FUZZ_REQUIRE(scan.count >= 0 && scan.count <= scan.input_count);
  for (const io::CloudColumn* column : {&scan.x, &scan.y, &scan.z, &scan.layer}) {
    OVT_FUZZ_REQUIRE(column->values() == std::size_t(scan.count));
    for (std::size_t i = 0; i < column->values(); ++i) column->value(i);
  }
  OVT_FUZZ_REQUIRE(scan.intensity.bytes.empty() || scan.intensity.values() == std::size_t(scan.count));
  OVT_FUZZ_REQUIRE(scan.time_offset_ns.empty() || scan.time_offset_ns.size() == std::size_t(scan.count));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  io::set_memory_limit(uint64_t(16) << 20);
  fuzz::Bytes in(data, size);
  const bool shared = in.byte() % 2 == 1;
  try {
    const io::PointCloud2 cloud = io::decode_point_cloud2(in.rest());
    const std::string bytes = io::encode_point_cloud2(cloud);
    OVT_FUZZ_REQUIRE(io::encode_point_cloud2(io::decode_point_cloud2(bytes)) == bytes);
    OVT_FUZZ_REQUIRE(!io::describe_layout(cloud).empty());
    for (int32_t s = 0; s <= int32_t(shared); ++s)
      check_scan(io::scan_of_message("fuzz", in.rest(), rig_of(shared), s));
  } catch (const std::runtime_error& error) {  // includes io::Error
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
