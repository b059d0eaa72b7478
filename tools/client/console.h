// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a person sees: a progress bar on a terminal, a table, and Ctrl-C that ends a run in order.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::cli {

// Drawn on stderr, only where that is a terminal; as lines where asked for, wherever that goes.
class Progress {
 public:
  Progress(int64_t total, bool quiet);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  // Instead of the bar, quiet or not: "WHAT 12.5 %, 40 s so far", a line of its own every so many seconds, so that
  // several programs may say so on one terminal.
  void print_lines(const std::string& what, double every_s);
  void show(int64_t done);
  void clear();

 private:
  void show_line(int64_t done);

  int64_t total_, shown_percent_ = -1;
  bool visible_;
  std::string what_;  // "": the bar
  double every_s_ = 0;
  std::chrono::steady_clock::time_point begin_, last_line_;
};

// Columns are as wide as their widest cell, numbers to the right.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row);
  std::size_t size() const { return rows_.size() - 1; }
  // The last `most` rows; says how many were left out before them.
  std::string format(std::size_t most = SIZE_MAX) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// Text of a file as it may go to a terminal: a control character, an invalid byte and what turns the direction of
// writing become \x1b or \u202e. Whatever is printed and may hold what a file says goes through here; a TextTable's
// cells do.
std::string printable(std::string_view text);

std::string fixed(double value, int32_t digits);  // "-" for NaN

// From now on the first Ctrl-C (or SIGTERM) only sets a flag; the second one ends the program at once.
void catch_interrupt();
bool interrupted();

// Makes the folder and its parents. Throws io::Error.
void make_folder(const std::string& path);

}  // namespace overtake::cli
