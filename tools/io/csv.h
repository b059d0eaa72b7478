// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tables in text files: one row per line, cells separated by ; or , or white space (detected), comment lines with #,
// with or without a header line. The header may also be the last comment line before the data.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::io {

class Csv {
 public:
  // Throws Error with file and line if a row's length differs from the others, or there is no row.
  static Csv read(const std::string& path);
  static Csv parse(const std::string& path_in_errors, std::string text);

  const std::string& path() const { return path_; }
  std::size_t row_count() const { return lines_.size(); }
  std::size_t column_count() const { return column_count_; }
  bool has_header() const { return !names_.empty(); }
  const std::vector<std::string>& names() const { return names_; }  // as written, trimmed

  // Column with one of `names` (the first that exists); ignores case and a unit in brackets as in `x(m)`. -1: none.
  // Throws Error where two columns have it; need() also where none has, and lists the names.
  int32_t find(std::initializer_list<std::string_view> names) const;
  int32_t need(std::initializer_list<std::string_view> names) const;
  // Adds "FILE has columns that are not read: NAME, ..." of those not in `read`, which may hold -1, if there are any.
  void note_unread(std::initializer_list<int32_t> read, std::vector<std::string>& notes) const;

  // Throws Error with file:line:column if the cell is not a finite number (number) or an integer (integer).
  double number(std::size_t row, int32_t column) const;
  int64_t integer(std::size_t row, int32_t column) const;
  std::string_view text(std::size_t row, int32_t column) const;
  int64_t line(std::size_t row) const { return lines_[row].number; }
  [[noreturn]] void fail(std::size_t row, int32_t column, const std::string& sentence) const;

  std::vector<double> numbers(int32_t column) const;  // the whole column

 private:
  struct Cell {
    std::size_t begin, size;  // in text_
  };
  struct Line {
    int64_t number;
    std::size_t begin;
  };
  std::string path_, text_;
  std::vector<std::string> names_;
  std::vector<Cell> cells_;  // row-major
  std::vector<Line> lines_;
  std::size_t column_count_ = 0;
};

// Writes a CSV file: numbers in their shortest text that reads back as the same value.
class CsvWriter {
 public:
  // Opens the file and writes the header. Throws Error.
  CsvWriter(std::string path, std::string_view header);
  ~CsvWriter();
  CsvWriter(const CsvWriter&) = delete;
  CsvWriter& operator=(const CsvWriter&) = delete;

  template <class T>
  CsvWriter& cell(T value);  // double, float, int32_t, int64_t, uint64_t, std::string_view
  void end_row();
  void flush();  // writes everything to the file. Throws Error when the disk is full.

 private:
  std::string path_, pending_;
  void* file_ = nullptr;
  bool row_open_ = false;
};

}  // namespace overtake::io
