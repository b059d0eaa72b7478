// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Builds one scan of one sensor from pieces that come in any cut and any order: each piece goes to its place in the
// scan's table, so that the table of a whole scan does not depend on the cut.
//
//   rows    0        40        90      120                 count() = 80, whole() = 40, end() = 120
//           [ piece ][ missing ][ piece ]
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/point_table.h"
#include "kernels/kernel_table.h"

namespace overtake {

// Rows of the table of a scan of `points` points: a piece may begin at any row, and kernels write whole vectors.
inline constexpr int32_t scan_rows(int32_t points) { return points + kRowAlign; }

class ScanBuilder {
 public:
  [[nodiscard]] bool build(int32_t point_capacity, const Allocator& allocator);

  // The scan has no point.
  void begin() noexcept;
  // Copies the piece to the rows from `first` on. kDuplicate: a row of it is there already; kTooMany: the scan has more
  // points than the capacity. Both change nothing.
  enum class Added : int32_t { kUsed, kDuplicate, kTooMany };
  Added add(const KernelTable& kernels, const PointFields& fields, int32_t first, int32_t count,
            ScanTable& scan) noexcept;
  // Moves the points behind a gap to the front, so that the table is that of a scan of only the points that came.
  void close_gaps(ScanTable& scan) noexcept;

  int32_t count() const noexcept { return count_; }  // points that came
  int32_t end() const noexcept { return end_; }      // row behind the last of them
  int32_t whole() const noexcept { return whole_; }  // rows [0, whole) all came
  bool has_gaps() const noexcept { return count_ < end_; }

 private:
  bool any_came(int32_t first, int32_t last) const noexcept;
  void mark_came(int32_t first, int32_t last) noexcept;
  int32_t find_missing(int32_t from) const noexcept;  // first row from `from` on that did not come
  int32_t find_came(int32_t from) const noexcept;     // first row from `from` on that came; end_ if none

  Arena arena_;
  uint64_t* came_ = nullptr;  // a bit for each row
  int32_t capacity_ = 0;
  int32_t count_ = 0, end_ = 0, whole_ = 0;
};

}  // namespace overtake
