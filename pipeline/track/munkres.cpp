// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/munkres.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace overtake {
namespace {
std::size_t at(int32_t i) { return std::size_t(i); }
}  // namespace

Munkres::Munkres(int32_t max_rows, int32_t max_columns, int32_t max_pairs, const Allocator& allocator)
    : max_rows_(max_rows), max_columns_(max_columns), max_pairs_(max_pairs) {
  arena_.build_or_throw(allocator, [this](Carver& carver) {
    pairs_ = carver.take<Pair>(at(max_pairs_));
    begin_ = carver.take<int32_t>(at(max_rows_) + 1);
    for (Cost** column : {&row_price_, &row_reach_, &alone_}) *column = carver.take<Cost>(at(max_rows_));
    for (Cost** column : {&column_price_, &reach_}) *column = carver.take<Cost>(at(max_columns_));
    for (int32_t** column : {&row_of_column_, &parent_row_, &touched_by_, &settled_by_, &open_})
      *column = carver.take<int32_t>(at(max_columns_));
    tree_rows_ = carver.take<int32_t>(at(max_rows_));
  });
}

void Munkres::clear(int32_t rows, int32_t columns) noexcept {
  OVT_CHECK(rows >= 0 && rows <= max_rows_ && columns >= 0 && columns <= max_columns_);
  rows_ = std::clamp(rows, 0, max_rows_);
  columns_ = std::clamp(columns, 0, max_columns_);
  pair_count_ = 0;
  std::fill_n(alone_, rows_, kNever);
}

void Munkres::leave_alone_for(int32_t row, double cost) noexcept {
  if (row >= 0 && row < rows_ && std::fabs(cost) <= 1e300) alone_[at(row)] = {0, cost};
}

bool Munkres::add(int32_t row, int32_t column, double cost) noexcept {
  if (row < 0 || row >= rows_ || column < 0 || column >= columns_ || !(std::fabs(cost) <= 1e300)) return false;
  if (pair_count_ == max_pairs_) return false;
  if (pair_count_ > 0) {
    const Pair& last = pairs_[pair_count_ - 1];
    if (row < last.row || (row == last.row && column <= last.column)) return false;
  }
  pairs_[pair_count_++] = {row, column, cost};
  return true;
}

void Munkres::index_rows() noexcept {
  int32_t i = 0;
  for (int32_t row = 0; row <= rows_; ++row) {
    while (i < pair_count_ && pairs_[i].row < row) ++i;
    begin_[at(row)] = i;
  }
}

int32_t Munkres::solve(int32_t* column_of_row, int64_t max_steps) noexcept {
  steps_ = 0;
  max_steps_ = max_steps;
  index_rows();
  std::fill_n(column_of_row, rows_, -1);
  std::fill_n(row_of_column_, columns_, -1);
  std::fill_n(column_price_, columns_, Cost{0, 0.0});
  std::fill_n(touched_by_, columns_, -1);
  std::fill_n(settled_by_, columns_, -1);

  // Most gated rows need no search: their cheapest column is free.
  take_cheapest(column_of_row);
  const auto needs_search = [&](int32_t row) {
    return column_of_row[row] < 0 && begin_[at(row)] < begin_[at(row + 1)] &&
           less(row_price_[at(row)], alone_[at(row)]);
  };
  for (search_ = 0; search_ < rows_; ++search_)
    if (needs_search(search_) && !augment(search_, column_of_row)) break;
  for (int32_t row = search_; row < rows_; ++row)
    if (needs_search(row)) take_free(row, column_of_row);

  return int32_t(std::count_if(column_of_row, column_of_row + rows_, [](int32_t c) { return c >= 0; }));
}

void Munkres::take_cheapest(int32_t* column_of_row) noexcept {
  for (int32_t r = 0; r < rows_; ++r) {
    const Pair* best = nullptr;
    for (int32_t i = begin_[at(r)]; i < begin_[at(r + 1)]; ++i)
      if (!best || pairs_[at(i)].cost < best->cost) best = &pairs_[at(i)];
    row_price_[at(r)] = {0, best ? best->cost : 0.0};
    if (!less(row_price_[at(r)], alone_[at(r)])) continue;  // needs no search, either
    if (best && row_of_column_[at(best->column)] < 0) {
      row_of_column_[at(best->column)] = r;
      column_of_row[r] = best->column;
    }
  }
}

void Munkres::take_free(int32_t row, int32_t* column_of_row) noexcept {
  const Pair* best = nullptr;
  for (int32_t i = begin_[at(row)]; i < begin_[at(row + 1)]; ++i)
    if (row_of_column_[at(pairs_[at(i)].column)] < 0 && (!best || pairs_[at(i)].cost < best->cost))
      best = &pairs_[at(i)];
  if (!best) return;
  row_of_column_[at(best->column)] = row;
  column_of_row[row] = best->column;
}

// Dijkstra over reduced costs from an unassigned row. The path ends at a free column, or at the row of the tree that is
// cheapest to leave unassigned; partners shift along the path.
bool Munkres::augment(int32_t from_row, int32_t* column_of_row) noexcept {
  open_count_ = tree_count_ = 0;
  Cost exit_length{INT32_MAX, 0.0};  // of the cheapest way to leave a row of the tree unassigned
  int32_t exit_row = -1, free_column = -1, row = from_row;
  Cost length{0, 0.0};

  for (;;) {
    tree_rows_[tree_count_++] = row;
    row_reach_[at(row)] = length;
    const Cost base = minus(length, row_price_[at(row)]);
    const Cost leave = plus(base, alone_[at(row)]);
    if (less(leave, exit_length)) exit_length = leave, exit_row = row;
    for (int32_t i = begin_[at(row)]; i < begin_[at(row + 1)]; ++i) {
      const std::size_t c = at(pairs_[at(i)].column);
      if (settled_by_[c] == search_) continue;
      const Cost via = minus(plus(base, {0, pairs_[at(i)].cost}), column_price_[c]);
      if (touched_by_[c] != search_) {
        touched_by_[c] = search_;
        open_[open_count_++] = int32_t(c);
      } else if (!less(via, reach_[c])) {
        continue;
      }
      reach_[c] = via;
      parent_row_[c] = row;
    }

    steps_ += begin_[at(row + 1)] - begin_[at(row)] + open_count_;
    if (steps_ > max_steps_) return false;
    int32_t nearest = open_count_;
    for (int32_t k = 0; k < open_count_; ++k) {
      if (nearest == open_count_) {
        nearest = k;
        continue;
      }
      const std::size_t a = at(open_[k]), b = at(open_[nearest]);
      if (less(reach_[a], reach_[b]) || (!less(reach_[b], reach_[a]) && a < b)) nearest = k;
    }
    if (nearest == open_count_ || less(exit_length, reach_[at(open_[nearest])])) break;
    const int32_t column = open_[nearest];
    open_[nearest] = open_[--open_count_];
    length = reach_[at(column)];
    if (row_of_column_[at(column)] < 0) {
      free_column = column;
      break;
    }
    settled_by_[at(column)] = search_;
    row = row_of_column_[at(column)];
  }

  // New prices: each row of the tree rises by the rest of the path's length after the row joined the tree.
  const Cost end = free_column >= 0 ? length : exit_length;
  for (int32_t k = 0; k < tree_count_; ++k) {
    const int32_t r = tree_rows_[k];
    const Cost rise = minus(end, row_reach_[at(r)]);
    row_price_[at(r)] = plus(row_price_[at(r)], rise);
    if (r != from_row) {
      Cost& price = column_price_[at(column_of_row[r])];
      price = minus(price, rise);
    }
  }

  // Shift partners along the path, from its end to from_row.
  int32_t column = free_column;
  if (column < 0) {
    if (exit_row == from_row) return true;
    column = column_of_row[exit_row];
    column_of_row[exit_row] = -1;
  }
  for (;;) {
    const int32_t r = parent_row_[at(column)];
    const int32_t given_up = column_of_row[r];
    column_of_row[r] = column;
    row_of_column_[at(column)] = r;
    if (r == from_row) return true;
    column = given_up;
  }
}

}  // namespace overtake
