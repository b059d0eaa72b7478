// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The results of a run are rows of numbers. Runs write tables, reports read them: so runs may be made in any order, on
// any machine, and combined later.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::evaluation {

struct Table {
  std::vector<std::string> columns;
  std::vector<double> cells;  // row-major; NaN: unknown

  explicit Table(std::vector<std::string> names = {}) : columns(std::move(names)) {}
  std::size_t rows() const { return columns.empty() ? 0 : cells.size() / columns.size(); }
  double at(std::size_t row, std::size_t column) const { return cells[row * columns.size() + column]; }
  std::size_t column(const std::string& name) const;  // throws std::out_of_range with the name
  void add(const std::vector<double>& row);           // throws std::invalid_argument: another length than columns
};

using Rows = std::vector<std::vector<std::string>>;  // a table of text for people; the first row is the header

void write_table(const std::string& path, const Table& table);  // CSV. Throws io::Error
Table read_table(const std::string& path);  // Throws io::Error with file and line; also for a last line without an end

}  // namespace overtake::evaluation
