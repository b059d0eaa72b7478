// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Copies the caller's layout to columns.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/point_table.h"

namespace overtake {

enum class FieldType : int32_t { kNone = 0, kFloat32, kFloat64, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32 };

// One field of a scan in the caller's memory: value i is at data + i * stride, at any address. kNone: the field is
// absent.
struct PointField {
  const void* data = nullptr;
  std::ptrdiff_t stride = 0;
  FieldType type = FieldType::kNone;
};

struct PointFields {
  PointField x, y, z, intensity, layer, time;
  double time_unit_ns = 1.0;  // offset after the scan's stamp = value of `time` times this
};

// Copies `count` points into columns, converting types.
//   reads    fields[count]              writes  all columns of scan, scan.count
//   values   subnormal coordinates become 0; NaN and infinite ones stay (project_points counts them)
//            NaN and subnormal intensity becomes 0; infinite intensity stays
//            a layer that is not an integer in 0..65535 becomes kNoLayer
//            time of 2^31 - 1 ns or more before or after the stamp, or NaN, is unknown and becomes 0
//   rows     columns may begin at any row of a table; up to kRowAlign - 1 rows behind the last may be written
//   cost     one pass                   agrees  exactly on every ISA
namespace ref {
void load_points(const PointFields& fields, int32_t count, ScanTable& scan) noexcept;
}

}  // namespace overtake
