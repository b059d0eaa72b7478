// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Functions for all tables. A table is a struct of columns with `count` and `capacity`. It lists its columns once, in
// for_each_column(table, f), which calls f(name, pointer); carving, hashing and dumping use that list.
// A row is an entity, a column a component, a stage a system.
#pragma once

#include <cstring>
#include <type_traits>

#include "core/arena.h"
#include "core/hash.h"

namespace overtake {

// Sizes every column for `capacity` rows, rounded up so that kernels may write whole vectors.
template <class Table>
void carve_table(Carver& carver, Table& table, int32_t capacity) {
  table.count = 0;
  table.capacity = round_up(capacity, kRowAlign);
  for_each_column(table, [&](const char*, auto*& column) {
    column = carver.take<std::remove_reference_t<decltype(*column)>>(std::size_t(table.capacity));
  });
}

// The rows of a table from `first` on, as a table. Columns without memory stay so.
template <class Table>
Table rows_from(const Table& table, int32_t first) noexcept {
  Table rows = table;
  for_each_column(rows, [&](const char*, auto*& column) {
    if (column) column += first;
  });
  rows.capacity -= first;
  return rows;
}

// The rows of a table that are in use and in the span, as a table.
template <class Table, class Span>
Table rows_of(const Table& table, Span span) noexcept {
  const int32_t last = span.last < table.count ? span.last : table.count;
  Table rows = rows_from(table, span.first);
  rows.count = last > span.first ? last - span.first : 0;
  return rows;
}

// Copies the rows in use. `to` must have capacity for them.
template <class Table>
void copy_table(const Table& from, Table& to) {
  OVT_CHECK(to.capacity >= from.count);
  to.count = from.count;
  constexpr std::size_t kMostColumns = 64;
  const void* columns[kMostColumns];
  std::size_t n = 0;
  for_each_column(const_cast<Table&>(from), [&](const char*, auto* column) { columns[n++] = column; });
  OVT_CHECK(n <= kMostColumns);
  n = 0;
  for_each_column(to, [&](const char*, auto* column) {
    std::memcpy(column, columns[n++], std::size_t(from.count) * sizeof(*column));
  });
}

// Hash of the rows in use, column by column, names included.
template <class Table>
uint64_t hash_table(const Table& table, uint64_t seed) {
  Hash hash(seed);
  hash.add_value(table.count);
  for_each_column(const_cast<Table&>(table), [&](const char* name, auto* column) {
    hash.add_text(name);
    hash.add_bytes(column, std::size_t(table.count) * sizeof(*column));
  });
  return hash.value();
}

}  // namespace overtake
