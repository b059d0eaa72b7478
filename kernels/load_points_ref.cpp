// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Copies the caller's layout to columns.
//
// The loop over a field reads its type and converts to double, which holds every accepted type exactly. So each rule
// below (subnormals, layers) is written once. No comparison sees a NaN, so the loop also runs with floating-point traps
// on.
#include "kernels/load_points.h"

#include <cfloat>
#include <cstring>
#include <limits>
#include <type_traits>

#include "core/check.h"

namespace overtake::ref {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_nan(double v) { return v != v; }

// Value i of a field. The address may be unaligned. A signalling NaN becomes quiet.
template <class T>
double value_at(const PointField& field, int32_t i) {
  const auto* at = static_cast<const char*>(field.data) + std::ptrdiff_t(i) * field.stride;
  if constexpr (std::is_same_v<T, float>) {
    uint32_t bits;
    std::memcpy(&bits, at, sizeof bits);
    if ((bits & 0x7fffffffu) > 0x7f800000u) return kNan;
  } else if constexpr (std::is_same_v<T, double>) {
    uint64_t bits;
    std::memcpy(&bits, at, sizeof bits);
    if ((bits & 0x7fffffffffffffffu) > 0x7ff0000000000000u) return kNan;
  }
  T value;
  std::memcpy(&value, at, sizeof value);
  return double(value);
}

template <class Out, class Convert>
void load_column(const PointField& field, int32_t count, Out* out, Out absent, Convert convert) {
  auto walk = [&](auto type) {
    for (int32_t i = 0; i < count; ++i) out[i] = convert(value_at<decltype(type)>(field, i));
  };
  switch (field.type) {
    case FieldType::kNone:
      for (int32_t i = 0; i < count; ++i) out[i] = absent;
      break;
    case FieldType::kFloat32: walk(float()); break;
    case FieldType::kFloat64: walk(double()); break;
    case FieldType::kInt8: walk(int8_t()); break;
    case FieldType::kUint8: walk(uint8_t()); break;
    case FieldType::kInt16: walk(int16_t()); break;
    case FieldType::kUint16: walk(uint16_t()); break;
    case FieldType::kInt32: walk(int32_t()); break;
    case FieldType::kUint32: walk(uint32_t()); break;
  }
}

// Subnormal and -0 become +0. Values beyond float become infinite (a plain cast would be undefined behaviour).
float narrow(double v) {
  if (is_nan(v)) return float(kNan);
  const double size = v < 0 ? -v : v;
  if (size < double(FLT_MIN)) return 0.0f;
  if (size > double(FLT_MAX)) return float(v < 0 ? -kInfinity : kInfinity);
  return float(v);
}

float intensity_of(double v) { return is_nan(v) ? 0.0f : narrow(v); }

int32_t layer_of(double v) {
  if (is_nan(v) || v < 0.0 || v > 65535.0) return kNoLayer;
  const auto layer = int32_t(v);
  return double(layer) == v ? layer : kNoLayer;
}

// To the nearest nanosecond, halves away from zero. 0, as for an absent time, if that does not fit: such a value is a
// time since 1970, for instance, and no offset.
int32_t offset_of(double v, double unit_ns) {
  if (is_nan(v)) return 0;
  constexpr double kLimit = 2147483647.0;
  constexpr double kHuge = 1e200;  // keeps the product finite for any sensible unit
  v = v > kHuge ? kHuge : v < -kHuge ? -kHuge : v;
  const double offset = v * unit_ns;
  if (offset >= kLimit - 0.5 || offset <= 0.5 - kLimit) return 0;
  return int32_t(offset + (offset < 0 ? -0.5 : 0.5));
}

}  // namespace

void load_points(const PointFields& fields, int32_t count, ScanTable& scan) noexcept {
  OVT_CHECK(count >= 0 && count <= scan.capacity);
  load_column(fields.x, count, scan.x_m, 0.0f, narrow);
  load_column(fields.y, count, scan.y_m, 0.0f, narrow);
  load_column(fields.z, count, scan.z_m, 0.0f, narrow);
  load_column(fields.intensity, count, scan.intensity, 0.0f, intensity_of);
  load_column(fields.layer, count, scan.layer, int32_t(0), layer_of);
  const double unit_ns = fields.time_unit_ns;
  load_column(fields.time, count, scan.time_offset_ns, int32_t(0),
              [unit_ns](double v) { return offset_of(v, unit_ns); });
  scan.count = count;
}

}  // namespace overtake::ref
