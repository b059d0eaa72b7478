// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Terminal output: a progress bar, a table, text that is safe to print; Ctrl-C that ends a run in order.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace overtake::cli {

// Progress on stderr: a bar if stderr is a terminal, or lines (print_lines) on any stderr.
class Progress {
 public:
  Progress(int64_t total, bool quiet);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  // Prints lines "WHAT 12.5 %, 40 s so far" every every_s seconds instead of the bar, also with --quiet. Several
  // programs can share one terminal this way.
  void print_lines(const std::string& what, double every_s);
  void show(int64_t done);
  void clear();

 private:
  void show_line(int64_t done);

  int64_t total_, shown_percent_ = -1;
  bool visible_;
  std::string what_;  // empty: draw the bar
  double every_s_ = 0;
  std::chrono::steady_clock::time_point begin_, last_line_;
};

// Each column is as wide as its widest cell. Numbers are right-aligned.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : rows_{std::move(header)} {}
  void add(std::vector<std::string> row);
  std::size_t size() const { return rows_.size() - 1; }
  // Formats the last `most` rows; a line gives the number of omitted rows before them.
  std::string format(std::size_t most = SIZE_MAX) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

// Text of a file made safe for a terminal: control characters, invalid bytes and characters that change the writing
// direction become \x1b or \u202e. Every printed text that may come from a file must pass through here; the cells of a
// TextTable do.
std::string printable(std::string_view text);

std::string fixed(double value, int32_t digits);  // "-" for NaN

// After this call, the first Ctrl-C (or SIGTERM) only sets a flag; the second one ends the program at once.
void catch_interrupt();
bool interrupted();

// Makes the folder and its parents. Throws io::Error.
void make_folder(const std::string& path);

}  // namespace overtake::cli
