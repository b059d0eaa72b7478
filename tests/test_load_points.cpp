// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Any layout becomes columns, and every value is defined.
#include "kernels/load_points.h"

#include <doctest/doctest.h>

#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/arena.h"
#include "core/table.h"

namespace overtake {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

struct OwnedScan {
  explicit OwnedScan(int32_t capacity) {
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, scan, capacity); }));
  }
  Arena arena;
  ScanTable scan;
};

template <class T>
PointField field_of(const std::vector<T>& values, FieldType type) {
  return {values.data(), std::ptrdiff_t(sizeof(T)), type};
}

TEST_CASE("load_points: reads an interleaved, unaligned record in place") {
  // | pad 1 | x y z f32 | intensity u8 | ring u16 | t u32 |, 20 bytes per point, all unaligned
  constexpr std::size_t kStep = 20;
  std::vector<unsigned char> memory(1 + 3 * kStep);
  for (std::size_t i = 0; i < 3; ++i) {
    unsigned char* at = memory.data() + 1 + i * kStep;
    const float xyz[3] = {float(i) + 0.5f, -float(i), 10.0f * float(i)};
    const auto bright = uint8_t(200 + i);
    const auto ring = uint16_t(65535 - i);
    const auto time = uint32_t(1000 * i);
    std::memcpy(at, xyz, 12);
    std::memcpy(at + 12, &bright, 1);
    std::memcpy(at + 13, &ring, 2);
    std::memcpy(at + 15, &time, 4);
  }
  const unsigned char* first = memory.data() + 1;
  PointFields fields;
  fields.x = {first, kStep, FieldType::kFloat32};
  fields.y = {first + 4, kStep, FieldType::kFloat32};
  fields.z = {first + 8, kStep, FieldType::kFloat32};
  fields.intensity = {first + 12, kStep, FieldType::kUint8};
  fields.layer = {first + 13, kStep, FieldType::kUint16};
  fields.time = {first + 15, kStep, FieldType::kUint32};
  fields.time_unit_ns = 1000.0;

  OwnedScan own(3);
  ref::load_points(fields, 3, own.scan);
  CHECK(own.scan.count == 3);
  for (int32_t i = 0; i < 3; ++i) {
    CHECK(own.scan.x_m[i] == float(i) + 0.5f);
    CHECK(own.scan.y_m[i] == -float(i));
    CHECK(own.scan.z_m[i] == 10.0f * float(i));
    CHECK(own.scan.intensity[i] == 200.0f + float(i));
    CHECK(own.scan.layer[i] == 65535 - i);
    CHECK(own.scan.time_offset_ns[i] == 1000000 * i);
  }
}

TEST_CASE("load_points: converts every field type, and reads backwards with a negative stride") {
  OwnedScan own(2);
  PointFields fields;
  const std::vector<double> f64 = {1.25, -7.5};
  const std::vector<int8_t> i8 = {-128, 127};
  const std::vector<int16_t> i16 = {-32768, 32767};
  const std::vector<int32_t> i32 = {-2147483647 - 1, 2147483647};
  const std::vector<uint32_t> u32 = {0, 4294967295u};
  fields.x = field_of(f64, FieldType::kFloat64);
  fields.y = field_of(i8, FieldType::kInt8);
  fields.z = field_of(i16, FieldType::kInt16);
  fields.intensity = field_of(u32, FieldType::kUint32);
  fields.time = field_of(i32, FieldType::kInt32);
  ref::load_points(fields, 2, own.scan);
  CHECK(own.scan.x_m[1] == -7.5f);
  CHECK(own.scan.y_m[0] == -128.0f);
  CHECK(own.scan.z_m[1] == 32767.0f);
  CHECK(own.scan.intensity[1] == 4294967296.0f);
  CHECK(own.scan.time_offset_ns[0] == 0);
  CHECK(own.scan.time_offset_ns[1] == 0);

  fields.x = {f64.data() + 1, -std::ptrdiff_t(sizeof(double)), FieldType::kFloat64};
  ref::load_points(fields, 2, own.scan);
  CHECK(own.scan.x_m[0] == -7.5f);
  CHECK(own.scan.x_m[1] == 1.25f);
}

TEST_CASE("load_points: absent fields are zero, and an empty scan is valid") {
  OwnedScan own(4);
  own.scan.intensity[0] = 5.0f;
  own.scan.layer[0] = 5;
  own.scan.time_offset_ns[0] = 5;
  const std::vector<float> x = {1.0f};
  PointFields fields;
  fields.x = fields.y = fields.z = field_of(x, FieldType::kFloat32);
  ref::load_points(fields, 1, own.scan);
  CHECK(own.scan.intensity[0] == 0.0f);
  CHECK(own.scan.layer[0] == 0);
  CHECK(own.scan.time_offset_ns[0] == 0);
  ref::load_points(PointFields{}, 0, own.scan);
  CHECK(own.scan.count == 0);
}

TEST_CASE(
    "load_points: subnormal coordinates become zero, NaN and infinity stay, doubles beyond float become infinite") {
  const std::vector<float> x = {FLT_MIN / 2, -FLT_MIN / 2, -0.0f, FLT_MIN, kNan, -kInf, FLT_MAX};
  const std::vector<double> y = {1e300, -1e300, 1e-300, double(FLT_MAX), double(kNan), double(kInf), -double(FLT_MAX)};
  OwnedScan own(7);
  PointFields fields;
  fields.x = field_of(x, FieldType::kFloat32);
  fields.y = field_of(y, FieldType::kFloat64);
  ref::load_points(fields, 7, own.scan);
  for (int32_t i = 0; i < 3; ++i) {
    CHECK(own.scan.x_m[i] == 0.0f);
    CHECK_FALSE(std::signbit(own.scan.x_m[i]));
  }
  CHECK(own.scan.x_m[3] == FLT_MIN);
  CHECK(std::isnan(own.scan.x_m[4]));
  CHECK(own.scan.x_m[5] == -kInf);
  CHECK(own.scan.x_m[6] == FLT_MAX);
  CHECK(own.scan.y_m[0] == kInf);
  CHECK(own.scan.y_m[1] == -kInf);
  CHECK(own.scan.y_m[2] == 0.0f);
  CHECK(own.scan.y_m[3] == FLT_MAX);
  CHECK(std::isnan(own.scan.y_m[4]));
  CHECK(own.scan.y_m[5] == kInf);
  CHECK(own.scan.y_m[6] == -FLT_MAX);
}

TEST_CASE("load_points: a layer that is not an integer in 0..65535 becomes kNoLayer") {
  const std::vector<float> layer = {0.0f, 65535.0f, 3.0f, 3.5f, -1.0f, 65536.0f, kNan, kInf, -kInf, 1e30f};
  OwnedScan own(10);
  PointFields fields;
  fields.layer = field_of(layer, FieldType::kFloat32);
  ref::load_points(fields, 10, own.scan);
  const int32_t expected[10] = {0, 65535, 3, kNoLayer, kNoLayer, kNoLayer, kNoLayer, kNoLayer, kNoLayer, kNoLayer};
  for (int32_t i = 0; i < 10; ++i) {
    CAPTURE(i);
    CHECK(own.scan.layer[i] == expected[i]);
  }
  const std::vector<int32_t> wide = {-5, 70000, 12};
  fields.layer = field_of(wide, FieldType::kInt32);
  ref::load_points(fields, 3, own.scan);
  CHECK(own.scan.layer[0] == kNoLayer);
  CHECK(own.scan.layer[1] == kNoLayer);
  CHECK(own.scan.layer[2] == 12);
}

TEST_CASE("load_points: NaN intensity becomes 0; time is scaled and rounded; one that is no offset is 0") {
  std::vector<float> bright(12, 0.0f);
  bright[0] = kNan;
  bright[1] = 7.0f;
  const std::vector<double> time = {0.05,   -1e-9,   3.0,          -3.0,          double(kNan), 1e308,
                                    1.6e-9, -1.6e-9, 2.1474836464, -2.1474836464, 2.1474836467, 1.7e9};
  OwnedScan own(12);
  PointFields fields;
  fields.intensity = field_of(bright, FieldType::kFloat32);
  fields.time = field_of(time, FieldType::kFloat64);
  fields.time_unit_ns = 1e9;
  ref::load_points(fields, 12, own.scan);
  CHECK(own.scan.intensity[0] == 0.0f);
  CHECK(own.scan.intensity[1] == 7.0f);
  CHECK(own.scan.time_offset_ns[0] == 50000000);
  CHECK(own.scan.time_offset_ns[1] == -1);
  for (const int32_t i : {2, 3, 4, 5, 10, 11}) CHECK(own.scan.time_offset_ns[i] == 0);
  CHECK(own.scan.time_offset_ns[6] == 2);
  CHECK(own.scan.time_offset_ns[7] == -2);
  CHECK(own.scan.time_offset_ns[8] == 2147483646);
  CHECK(own.scan.time_offset_ns[9] == -2147483646);
}

}  // namespace
}  // namespace overtake
