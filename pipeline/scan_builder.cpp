// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/scan_builder.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/table.h"

namespace overtake {
namespace {

// Calls f(word, mask of the bits of rows [first, last) in it).
template <class F>
void for_each_word(int32_t first, int32_t last, F&& f) noexcept {
  for (int32_t row = first; row < last;) {
    const int32_t word = row >> 6, next = std::min((word + 1) << 6, last);
    const int32_t bits = next - row;
    const uint64_t mask = bits == 64 ? ~uint64_t(0) : ((uint64_t(1) << bits) - 1) << (row & 63);
    f(word, mask);
    row = next;
  }
}

// The rows that a kernel may write behind a piece, kept and put back.
class RowsBehind {
 public:
  RowsBehind(ScanTable& scan, int32_t first) noexcept : scan_(rows_from(scan, first)) {
    int32_t n = 0;
    for_each_column(scan_, [&](const char*, auto* column) { std::memcpy(kept_[n++], column, sizeof kept_[0]); });
  }
  void put_back() noexcept {
    int32_t n = 0;
    for_each_column(scan_, [&](const char*, auto* column) { std::memcpy(column, kept_[n++], sizeof kept_[0]); });
  }

 private:
  ScanTable scan_;
  int32_t kept_[6][kRowAlign];  // six columns of four bytes
};

}  // namespace

bool ScanBuilder::build(int32_t point_capacity, const Allocator& allocator) {
  capacity_ = point_capacity;
  return arena_.build(allocator, [&](Carver& carver) {
    came_ = carver.take<uint64_t>(std::size_t(round_up(point_capacity, 64) / 64));
  });
}

void ScanBuilder::begin() noexcept {
  std::fill_n(came_, (end_ + 63) / 64, uint64_t(0));
  count_ = end_ = whole_ = 0;
}

bool ScanBuilder::any_came(int32_t first, int32_t last) const noexcept {
  uint64_t any = 0;
  for_each_word(first, std::min(last, end_), [&](int32_t word, uint64_t mask) { any |= came_[word] & mask; });
  return any != 0;
}

void ScanBuilder::mark_came(int32_t first, int32_t last) noexcept {
  for_each_word(first, last, [&](int32_t word, uint64_t mask) { came_[word] |= mask; });
}

int32_t ScanBuilder::find_missing(int32_t from) const noexcept {
  while (from < end_) {
    const uint64_t missing = ~came_[from >> 6] >> (from & 63);
    if (missing != 0) return std::min(from + std::countr_zero(missing), end_);
    from = ((from >> 6) + 1) << 6;
  }
  return end_;
}

int32_t ScanBuilder::find_came(int32_t from) const noexcept {
  while (from < end_) {
    const uint64_t came = came_[from >> 6] >> (from & 63);
    if (came != 0) return std::min(from + std::countr_zero(came), end_);
    from = ((from >> 6) + 1) << 6;
  }
  return end_;
}

ScanBuilder::Added ScanBuilder::add(const KernelTable& kernels, const PointFields& fields, int32_t first, int32_t count,
                                    ScanTable& scan) noexcept {
  if (count == 0) return Added::kUsed;
  if (int64_t(first) + count > capacity_) return Added::kTooMany;
  const int32_t last = first + count;
  if (any_came(first, last)) return Added::kDuplicate;
  ScanTable rows = rows_from(scan, first);
  if (last < end_) {
    RowsBehind behind(scan, last);
    kernels.load_points(fields, count, rows);
    behind.put_back();
  } else {
    kernels.load_points(fields, count, rows);
  }
  mark_came(first, last);
  count_ += count;
  end_ = std::max(end_, last);
  if (first <= whole_) whole_ = find_missing(whole_);
  scan.count = end_;
  return Added::kUsed;
}

void ScanBuilder::close_gaps(ScanTable& scan) noexcept {
  int32_t to = whole_;
  for (int32_t from = find_came(whole_); from < end_;) {
    const int32_t next = find_missing(from);
    for_each_column(scan, [&](const char*, auto* column) {
      std::memmove(column + to, column + from, std::size_t(next - from) * sizeof *column);
    });
    to += next - from;
    from = find_came(next);
  }
  scan.count = to;
}

}  // namespace overtake
