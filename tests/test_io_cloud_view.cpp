// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A cloud read in place gives the columns that a copy gives, and says why where it cannot.
#include <doctest/doctest.h>

#include <cstring>
#include <string>
#include <vector>

#include "tools/io/bag_stream.h"
#include "tools/io/cloud_view.h"

using namespace overtake::io;

namespace {

constexpr uint32_t kPoints = 40;

Rig one_sensor() { return load_rig("hdl64"); }

struct Field {
  const char* name;
  uint32_t offset;
  uint8_t datatype;
};
const std::vector<Field> kFields = {{"x", 0, PointField::kFloat32},    {"y", 4, PointField::kFloat32},
                                    {"z", 8, PointField::kFloat32},    {"intensity", 12, PointField::kFloat32},
                                    {"ring", 16, PointField::kUint16}, {"t", 20, PointField::kUint32}};

// The message lies at an address that is a multiple of 8, so its points at a multiple of 4.
struct MadeCloud {
  explicit MadeCloud(uint32_t step, const std::vector<Field>& fields = kFields) : points(step * kPoints / 4) {
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = float(i) * 0.25f;
    for (const Field& field : fields) cloud.fields.push_back({field.name, field.offset, field.datatype, 1});
    cloud.header = {1'700'000'000'000'000'000, "front"};
    cloud.width = kPoints;
    cloud.point_step = step;
    cloud.row_step = step * kPoints;
    cloud.data = {reinterpret_cast<const char*>(points.data()), step * kPoints};
  }
  std::vector<float> points;
  PointCloud2 cloud;
};

std::string why_not(const PointCloud2& cloud, const Rig& rig = one_sensor()) {
  CloudView view;
  return view_in_place(cloud, rig, 0, view);
}

void check_column(const ColumnView& view, const CloudColumn& copy) {
  REQUIRE(view.data != nullptr);
  REQUIRE(view.type == copy.type);
  const std::size_t size = size_of(view.type);
  REQUIRE(copy.bytes.size() == kPoints * size);
  CHECK(view.bytes >= (kPoints - 1) * view.stride + size);
  for (std::size_t i = 0; i < kPoints; ++i)
    CHECK(std::memcmp(view.data + i * view.stride, copy.bytes.data() + i * size, size) == 0);
}

}  // namespace

TEST_CASE("cloud in place: its columns are those of a copy, and lie in the message") {
  const MadeCloud made(32);
  CloudView view;
  REQUIRE(view_in_place(made.cloud, one_sensor(), 0, view) == "");
  CHECK(view.count == int32_t(kPoints));
  CHECK(view.stamp_ns == made.cloud.header.stamp_ns);
  CHECK(view.x.data == made.cloud.data.data());
  CHECK(view.layer.data == made.cloud.data.data() + 16);
  CHECK(view.time.data == made.cloud.data.data() + 20);
  const std::string bytes = encode_point_cloud2(made.cloud);
  const SensorScan scan = scan_of_message("message", bytes, one_sensor(), 0);
  check_column(view.x, scan.x);
  check_column(view.y, scan.y);
  check_column(view.z, scan.z);
  check_column(view.layer, scan.layer);
  check_column(view.intensity, scan.intensity);
}

TEST_CASE("cloud in place: packed points are read where they lie") {
  std::vector<Field> fields = kFields;
  fields[5].offset = 18;  // behind the ring, at no multiple of 4
  const MadeCloud made(22, fields);
  CloudView view;
  REQUIRE(view_in_place(made.cloud, one_sensor(), 0, view) == "");
  CHECK(view.time.data == made.cloud.data.data() + 18);
  CHECK(view.time.bytes == 22 * kPoints - 18);
  const SensorScan scan = scan_of_message("message", encode_point_cloud2(made.cloud), one_sensor(), 0);
  check_column(view.x, scan.x);
  check_column(view.layer, scan.layer);
  check_column(view.intensity, scan.intensity);
}

TEST_CASE("cloud in place: says why points must be copied") {
  CHECK(why_not(MadeCloud(32).cloud) == "");
  const auto with = [](std::size_t at, Field field) {
    std::vector<Field> fields = kFields;
    fields[at] = field;
    return MadeCloud(32, fields).cloud;
  };
  CHECK(why_not(with(4, {"ring", 31, PointField::kUint16})) == "field 'ring' lies outside of a point");
  CHECK(why_not(with(4, {"other", 16, PointField::kUint16})).find("no ring field: the 64 lines") != std::string::npos);
  CHECK(why_not(with(4, {"ring", 24, PointField::kFloat64})).find("float64") != std::string::npos);
  CHECK(why_not(with(3, {"intensity", 24, PointField::kFloat64})).find("64 bits") != std::string::npos);
  CHECK(why_not(with(5, {"t", 20, PointField::kFloat32})).find("not in integer ns") != std::string::npos);
  CHECK(why_not(with(0, {"x", 0, PointField::kInt32})).find("floating point") != std::string::npos);
  MadeCloud made(32);
  made.cloud.is_bigendian = true;
  CHECK(why_not(made.cloud).find("byte order") != std::string::npos);
  made.cloud.is_bigendian = false;
  made.cloud.width += 1;
  CHECK(why_not(made.cloud) == "it lacks points");
  made.cloud.width = kPoints / 2, made.cloud.height = 2;
  CHECK(why_not(made.cloud) == "its rows have padding");
  made.cloud.row_step /= 2;
  CHECK(why_not(made.cloud) == "");
  made.cloud.width = 0;
  CHECK(why_not(made.cloud) == "it has no points");
  Rig rig = one_sensor();
  rig.cloud_in_vehicle_frame = true;
  CHECK(why_not(MadeCloud(32).cloud, rig).find("vehicle frame") != std::string::npos);
  rig = one_sensor();
  rig.time_unit = TimeUnit::kMicroseconds;
  CHECK(why_not(MadeCloud(32).cloud, rig).find("not in integer ns") != std::string::npos);
}
