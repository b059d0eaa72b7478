// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Assignment: as many pairs as the gates allow, then the least total cost (Munkres 1957). Solves independent blocks
// separately.
//
// Shortest augmenting paths (Jonker & Volgenant 1987) on the sparse list of pairs. A row whose cheapest column is not
// free searches its own block only, so 256 x 256 gated pairs cost little more than adding them. Leaving a row
// unassigned is an edge too, of a cost above any sum of costs. So a Cost has two digits, (unassigned rows, cost), and
// no big number rounds off the low digit.
//
// A dense block of n rows takes about n^3 steps. The caller can limit the steps; they are counted, never timed, so the
// answer is the same on every machine.
#pragma once

#include <cstdint>

#include "core/arena.h"

namespace overtake {

// Gated pairs as a sparse list, rows x columns, in ascending order of row, then column. Solves exactly; deterministic
// for ties (the answer depends on the costs and the indices only).
class Munkres {
 public:
  // The only place that allocates. Throws std::bad_alloc when the allocator has no memory.
  Munkres(int32_t max_rows, int32_t max_columns, int32_t max_pairs, const Allocator& allocator = default_allocator());

  void clear(int32_t rows, int32_t columns) noexcept;
  // Adds a feasible pair behind the last one. Costs are finite, any sign. False when max_pairs is reached, or for an
  // invalid pair (index out of range, cost not finite, not behind the last one in the order of row and column).
  bool add(int32_t row, int32_t column, double cost) noexcept;
  // The row may also stay without a partner at this cost. Other rows do so only where no assignment has a partner for
  // them.
  void leave_alone_for(int32_t row, double cost) noexcept;
  // column_of_row[rows]: the partner or -1. Returns the number of pairs. When the searches take more than max_steps,
  // the rows that are still unassigned take their cheapest free column, in the order of rows.
  int32_t solve(int32_t* column_of_row, int64_t max_steps = INT64_MAX) noexcept;
  int64_t steps() const noexcept { return steps_; }                  // pairs and columns that the last solve examined
  bool was_limited() const noexcept { return steps_ > max_steps_; }  // whether max_steps cut it short

 private:
  struct Pair {
    int32_t row, column;
    double cost;
  };
  struct Cost {
    int32_t alone;
    double cost;
  };
  static Cost plus(Cost a, Cost b) { return {a.alone + b.alone, a.cost + b.cost}; }
  static Cost minus(Cost a, Cost b) { return {a.alone - b.alone, a.cost - b.cost}; }
  static bool less(Cost a, Cost b) { return a.alone != b.alone ? a.alone < b.alone : a.cost < b.cost; }

  static constexpr Cost kNever = {1, 0.0};

  void index_rows() noexcept;
  void take_cheapest(int32_t* column_of_row) noexcept;
  bool augment(int32_t from_row, int32_t* column_of_row) noexcept;  // false, nothing changed: max_steps is reached
  void take_free(int32_t row, int32_t* column_of_row) noexcept;

  Arena arena_;
  int32_t rows_ = 0, columns_ = 0, max_rows_, max_columns_, max_pairs_;
  int32_t pair_count_ = 0;
  int64_t steps_ = 0, max_steps_ = INT64_MAX;
  Pair* pairs_ = nullptr;
  int32_t* begin_ = nullptr;                             // row -> first of its pairs
  Cost *row_price_ = nullptr, *column_price_ = nullptr;  // duals: cost >= their sum, equal for assigned pairs
  Cost* alone_ = nullptr;                                // row -> of leaving it unassigned
  int32_t* row_of_column_ = nullptr;
  // State of one search. touched_by_ and settled_by_ name the last search that touched or settled a column, so no
  // search clears them.
  Cost* reach_ = nullptr;  // column -> length of the shortest path to it
  int32_t *parent_row_ = nullptr, *touched_by_ = nullptr, *settled_by_ = nullptr;
  int32_t *open_ = nullptr, *tree_rows_ = nullptr;  // columns touched and not settled; rows in the tree
  int32_t open_count_ = 0, tree_count_ = 0;
  Cost* row_reach_ = nullptr;  // length at which a row joined the tree
  int32_t search_ = 0;
};

}  // namespace overtake
