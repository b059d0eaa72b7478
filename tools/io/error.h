// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The exception that all file readers and writers throw. what() is a sentence that starts with file:line.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace overtake::io {

class Error : public std::runtime_error {
 public:
  // line 0: the whole file; column 0: the whole line.
  Error(const std::string& file, int64_t line, const std::string& sentence, int64_t column = 0)
      : std::runtime_error(place(file, line, column) + sentence), file_(file), line_(line), column_(column) {}

  const std::string& file() const { return file_; }
  int64_t line() const { return line_; }
  int64_t column() const { return column_; }

 private:
  static std::string place(const std::string& file, int64_t line, int64_t column) {
    std::string text = file;
    if (line > 0) text += ':' + std::to_string(line);
    if (column > 0) text += ':' + std::to_string(column);
    return text.empty() ? text : text + ": ";
  }
  std::string file_;
  int64_t line_, column_;
};

}  // namespace overtake::io
