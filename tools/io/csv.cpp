// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/csv.h"

#include <algorithm>
#include <cmath>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

char find_delimiter(std::string_view line) {
  for (const char c : {';', ','})
    if (line.find(c) != std::string_view::npos) return c;
  return ' ';
}

std::vector<std::string_view> split(std::string_view line, char delimiter) {
  if (delimiter == ' ') return split_words(line);
  std::vector<std::string_view> cells;
  for (std::size_t at = 0;;) {
    const auto end = line.find(delimiter, at);
    cells.push_back(trim(line.substr(at, end == std::string_view::npos ? end : end - at)));
    if (end == std::string_view::npos) break;
    at = end + 1;
  }
  return cells;
}

bool all_numbers(const std::vector<std::string_view>& cells) {
  double value;
  for (const auto& cell : cells)
    if (!parse_number(cell, value)) return false;
  return true;
}

bool no_number(const std::vector<std::string_view>& cells) {
  double value;
  for (const auto& cell : cells)
    if (cell.empty() || parse_number(cell, value)) return false;
  return true;
}

// The column in front may have no name, as the index that pandas writes.
bool is_header(const std::vector<std::string_view>& cells) {
  const bool has_index = cells.size() > 1 && cells[0].empty();
  return no_number({cells.begin() + has_index, cells.end()});
}

std::string name_without_unit(std::string_view name) { return lower_case(trim(name.substr(0, name.find('(')))); }

std::vector<std::string> to_strings(const std::vector<std::string_view>& cells) { return {cells.begin(), cells.end()}; }

}  // namespace

Csv Csv::read(const std::string& path) { return parse(path, read_whole_file(path, text_limit())); }

Csv Csv::parse(const std::string& path_in_errors, std::string text) {
  check_memory(path_in_errors, text.size() * kMemoryPerText, "a table of " + format_size(text.size()));
  Csv csv;
  csv.path_ = path_in_errors;
  csv.text_ = std::move(text);
  const std::string_view all(csv.text_);
  std::string_view last_comment;
  char delimiter = 0;
  int64_t number = 0;
  std::size_t at = all.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0;  // byte order mark
  while (at < all.size()) {
    const auto end = std::min(all.find('\n', at), all.size());
    const std::string_view line = trim(all.substr(at, end - at));
    at = end + 1;
    ++number;
    if (line.empty()) continue;
    if (line[0] == '#') {
      if (csv.lines_.empty()) last_comment = trim(line.substr(1));
      continue;
    }
    if (!delimiter) delimiter = find_delimiter(line);
    auto cells = split(line, delimiter);
    const bool one_more = csv.column_count_ == 0 ? cells.size() > 1 : cells.size() == csv.column_count_ + 1;
    if (one_more && cells.back().empty()) cells.pop_back();  // a delimiter at the end of the line
    if (csv.column_count_ == 0) {
      csv.column_count_ = cells.size();
      if (is_header(cells)) {
        csv.names_ = to_strings(cells);
        continue;
      }
      const auto names = split(last_comment, delimiter);
      if (names.size() == cells.size() && no_number(names) && all_numbers(cells)) csv.names_ = to_strings(names);
    }
    if (cells.size() != csv.column_count_)
      throw Error(csv.path_, number,
                  std::to_string(cells.size()) + " cells, the lines before have " + std::to_string(csv.column_count_));
    csv.lines_.push_back({number, std::size_t(line.data() - all.data())});
    for (const auto& cell : cells) csv.cells_.push_back({std::size_t(cell.data() - all.data()), cell.size()});
  }
  if (csv.lines_.empty()) throw Error(csv.path_, 0, "holds no row");
  return csv;
}

int32_t Csv::find(std::initializer_list<std::string_view> names) const {
  for (const auto& wanted : names) {
    const auto has_it = [&](const std::string& name) { return name_without_unit(name) == wanted; };
    const auto first = std::find_if(names_.begin(), names_.end(), has_it);
    if (first == names_.end()) continue;
    if (std::any_of(first + 1, names_.end(), has_it))
      throw Error(path_, 0, "two columns are named " + std::string(wanted));
    return int32_t(first - names_.begin());
  }
  return -1;
}

int32_t Csv::need(std::initializer_list<std::string_view> names) const {
  const int32_t column = find(names);
  if (column >= 0) return column;
  if (names_.empty()) throw Error(path_, lines_[0].number, "no header line names the columns");
  std::string wanted;
  for (const auto& name : names) wanted.append(wanted.empty() ? "" : " or ").append(name);
  throw Error(path_, 0, "no column " + wanted + " (there are: " + join(names_, ", ") + ")");
}

void Csv::note_unread(std::initializer_list<int32_t> read, std::vector<std::string>& notes) const {
  std::vector<std::string> others;
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (!names_[i].empty() && std::find(read.begin(), read.end(), int32_t(i)) == read.end())
      others.push_back(names_[i]);
  if (others.empty()) return;
  notes.push_back(path_ +
                  (others.size() == 1 ? " has a column that is not read: " : " has columns that are not read: ") +
                  join(others, ", "));
}

std::string_view Csv::text(std::size_t row, int32_t column) const {
  const Cell& cell = cells_[row * column_count_ + std::size_t(column)];
  return std::string_view(text_).substr(cell.begin, cell.size);
}

void Csv::fail(std::size_t row, int32_t column, const std::string& sentence) const {
  const Cell& cell = cells_[row * column_count_ + std::size_t(column)];
  throw Error(path_, lines_[row].number, sentence, int64_t(cell.begin - lines_[row].begin) + 1);
}

double Csv::number(std::size_t row, int32_t column) const {
  double value = 0;
  const std::string name = names_.empty() ? "" : names_[std::size_t(column)] + " ";
  if (!parse_number(text(row, column), value))
    fail(row, column, name + "'" + std::string(text(row, column).substr(0, 32)) + "' is not a number");
  if (!std::isfinite(value)) fail(row, column, name + "is not finite");
  return value;
}

int64_t Csv::integer(std::size_t row, int32_t column) const {
  int64_t value = 0;
  const std::string name = names_.empty() ? "" : names_[std::size_t(column)] + " ";
  if (!parse_integer(text(row, column), value))
    fail(row, column, name + "'" + std::string(text(row, column).substr(0, 32)) + "' is not a whole number");
  return value;
}

std::vector<double> Csv::numbers(int32_t column) const {
  std::vector<double> values(row_count());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = number(i, column);
  return values;
}

}  // namespace overtake::io
