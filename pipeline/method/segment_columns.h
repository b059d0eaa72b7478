// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The columns of a segmentation: an enum, sets of columns, and a loop over all.
#pragma once

#include <cstdint>
#include <type_traits>

namespace overtake {

enum class Column : int32_t {
#define OVT_SEGMENT_COLUMN(name, view, extent) name,
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
  kCount
};
inline constexpr int32_t kColumnCount = int32_t(Column::kCount);

// How many elements a column has: see segment_columns.def.
enum class Extent { own, pixels, cells, labels, points, layers, rays, nodes };
template <Extent kExtent>
using ExtentIs = std::integral_constant<Extent, kExtent>;

// A set of columns, bit by bit.
using Columns = uint64_t;
static_assert(kColumnCount <= 64);
template <class... C>
constexpr Columns columns(C... column) {
  return (Columns(0) | ... | (Columns(1) << int32_t(column)));
}
constexpr bool has(Columns set, Column column) { return set >> int32_t(column) & 1; }

// Calls f(column, ExtentIs<...>, its view) for each column, in the order of segment_columns.def.
template <class Part, class Views, class F>
void for_each_segment_column(Part& part, Views& views, F&& f) {
#define OVT_SEGMENT_COLUMN(name, view, extent) f(Column::name, ExtentIs<Extent::extent>(), view);
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
}

inline const char* column_name(Column column) noexcept {
  constexpr const char* kName[] = {
#define OVT_SEGMENT_COLUMN(name, view, extent) #name,
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
  };
  return kName[int32_t(column)];
}

// The columns of one extent.
constexpr Columns columns_of(Extent wanted) {
  Columns set = 0;
#define OVT_SEGMENT_COLUMN(name, view, extent) \
  if (Extent::extent == wanted) set |= columns(Column::name);
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
  return set;
}

}  // namespace overtake
