// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::evaluation {

std::size_t Table::column(const std::string& name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) throw std::out_of_range("a table has no column '" + name + "'");
  return std::size_t(found - columns.begin());
}

void Table::add(const std::vector<double>& row) {
  if (row.size() != columns.size())
    throw std::invalid_argument("a row of " + std::to_string(row.size()) + " cells for " +
                                std::to_string(columns.size()) + " columns");
  cells.insert(cells.end(), row.begin(), row.end());
}

void write_table(const std::string& path, const Table& table) {
  std::string text = io::join(table.columns, ",") + "\n";
  for (std::size_t r = 0; r < table.rows(); ++r)
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      io::append_number(text, table.at(r, c));
      text += c + 1 == table.columns.size() ? '\n' : ',';
    }
  io::write_whole_file(path, text);
}

// Csv refuses tables without rows and cells that are not finite; both are valid here.
Table read_table(const std::string& path) {
  const std::string text = io::read_whole_file(path);
  Table table;
  int64_t line_number = 0;
  for (std::size_t at = 0; at < text.size(); ++line_number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::vector<double> row;
    for (std::size_t from = at; from <= end;) {
      const std::size_t to = std::min(text.find(',', from), end);
      const std::string_view cell(text.data() + from, to - from);
      double value = 0;
      if (line_number == 0)
        table.columns.emplace_back(cell);
      else if (io::parse_number(cell, value))
        row.push_back(value);
      else
        throw io::Error(path, line_number + 1, "'" + std::string(cell) + "' is not a number");
      from = to + 1;
    }
    if (line_number > 0) {
      if (row.size() != table.columns.size())
        throw io::Error(path, line_number + 1,
                        std::to_string(row.size()) + " cells instead of " + std::to_string(table.columns.size()));
      table.add(row);
    }
    at = end + 1;
  }
  if (table.columns.empty()) throw io::Error(path, 1, "no header line");
  // What is left of a number that was cut off is a number, too.
  if (text.back() != '\n') throw io::Error(path, line_number, "the line has no end: the file was cut off");
  return table;
}

}  // namespace overtake::evaluation
