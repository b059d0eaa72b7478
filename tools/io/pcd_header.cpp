// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/pcd_header.h"

#include <algorithm>
#include <set>
#include <string_view>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr std::size_t kMaxHeaderBytes = 1 << 20;
constexpr int64_t kMaxFields = 1000, kMaxPointBytes = 1 << 20, kMaxPoints = INT32_MAX;

bool type_of(char letter, int64_t size, ValueType& out) {
  struct Row {
    char letter;
    int64_t size;
    ValueType type;
  };
  static constexpr Row kRows[] = {{'F', 4, ValueType::kFloat32}, {'F', 8, ValueType::kFloat64},
                                  {'I', 1, ValueType::kInt8},    {'U', 1, ValueType::kUint8},
                                  {'I', 2, ValueType::kInt16},   {'U', 2, ValueType::kUint16},
                                  {'I', 4, ValueType::kInt32},   {'U', 4, ValueType::kUint32},
                                  {'I', 8, ValueType::kInt64},   {'U', 8, ValueType::kUint64}};
  for (const Row& row : kRows)
    if (row.letter == letter && row.size == size) {
      out = row.type;
      return true;
    }
  return false;
}

// The header's lines before they are checked against each other. line_of_*: 0 when the line is missing.
struct RawHeader {
  std::vector<std::string> names, types;
  std::vector<int64_t> sizes, counts;
  int64_t fields_line = 0, size_line = 0, type_line = 0, count_line = 0, width_line = 0, height_line = 0,
          points_line = 0;
};

class Parser {
 public:
  Parser(const std::string& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  PcdHeader run() {
    std::size_t at = 0;
    while (header_.data_line == 0) {
      const std::size_t end = bytes_.find('\n', at);
      if (std::min(end, bytes_.size()) > kMaxHeaderBytes)
        throw Error(path_, 0, "no DATA line within the first MiB: not a PCD file");
      if (end == std::string::npos) throw Error(path_, 0, "no DATA line: not a PCD file, or cut off in its header");
      ++line_;
      read_line(std::string_view(bytes_).substr(at, end - at));
      at = end + 1;
    }
    header_.data_offset = at;
    check_fields();
    check_counts();
    return header_;
  }

 private:
  [[noreturn]] void fail(int64_t line, const std::string& sentence) const { throw Error(path_, line, sentence); }

  void read_line(std::string_view line) {
    const auto words = split_words(line);
    if (words.empty() || words[0][0] == '#') return;
    const std::string key(words[0]);
    const std::vector<std::string_view> values(words.begin() + 1, words.end());
    if (key == "VERSION") {
      header_.version = values.size() == 1 ? std::string(values[0]) : "";
      static const std::set<std::string> kKnown = {".5", "0.5", ".6", "0.6", ".7", "0.7"};
      if (!kKnown.count(header_.version)) fail(line_, "VERSION is not 0.5, 0.6 or 0.7");
    } else if (key == "FIELDS" || key == "COLUMNS") {
      once(raw_.fields_line, key);
      for (const auto& name : values) raw_.names.emplace_back(name);
    } else if (key == "SIZE") {
      once(raw_.size_line, key);
      raw_.sizes = integers(key, values, 1, 8);
    } else if (key == "TYPE") {
      once(raw_.type_line, key);
      for (const auto& type : values) raw_.types.emplace_back(type);
    } else if (key == "COUNT") {
      once(raw_.count_line, key);
      raw_.counts = integers(key, values, 1, kMaxPointBytes);
    } else if (key == "WIDTH") {
      once(raw_.width_line, key);
      header_.width = one_integer(key, values);
    } else if (key == "HEIGHT") {
      once(raw_.height_line, key);
      header_.height = one_integer(key, values);
    } else if (key == "POINTS") {
      once(raw_.points_line, key);
      header_.points = one_integer(key, values);
    } else if (key == "VIEWPOINT") {
      if (values.size() != 7) fail(line_, "VIEWPOINT needs 7 numbers");
      for (std::size_t i = 0; i < 7; ++i)
        if (!parse_number(values[i], header_.viewpoint[i]))
          fail(line_, "VIEWPOINT holds '" + std::string(values[i]) + "', no number");
    } else if (key == "DATA") {
      header_.data_line = line_;
      const std::string encoding = values.size() == 1 ? lower_case(values[0]) : "";
      if (encoding == "ascii")
        header_.encoding = PcdEncoding::kAscii;
      else if (encoding == "binary")
        header_.encoding = PcdEncoding::kBinary;
      else if (encoding == "binary_compressed")
        header_.encoding = PcdEncoding::kBinaryCompressed;
      else
        fail(line_, "DATA is not ascii, binary or binary_compressed");
    } else {
      fail(line_, line_ == 1 ? "not a PCD file" : "'" + plain_word(key) + "' is not a line of a PCD header");
    }
  }

  void once(int64_t& line, const std::string& key) const {
    if (line) fail(line_, key + " is given twice");
    line = line_;
  }

  std::vector<int64_t> integers(const std::string& key, const std::vector<std::string_view>& words, int64_t low,
                                int64_t high) const {
    std::vector<int64_t> values;
    for (const auto& word : words) {
      int64_t value = 0;
      if (!parse_integer(word, value) || value < low || value > high)
        fail(line_, key + " holds '" + plain_word(word) + "', not a whole number from " + std::to_string(low) + " to " +
                        std::to_string(high));
      values.push_back(value);
    }
    return values;
  }

  int64_t one_integer(const std::string& key, const std::vector<std::string_view>& words) const {
    if (words.size() != 1) fail(line_, key + " needs one number");
    return integers(key, words, 0, kMaxPoints)[0];
  }

  void check_fields() {
    if (!raw_.fields_line) fail(0, "no FIELDS line");
    if (!raw_.size_line) fail(0, "no SIZE line");
    if (!raw_.type_line) fail(0, "no TYPE line");
    const std::size_t n = raw_.names.size();
    if (n == 0 || n > kMaxFields) fail(raw_.fields_line, "FIELDS names no field, or more than 1000");
    const auto same = [&](std::size_t got, int64_t line, const char* key) {
      if (got != n)
        fail(line, std::string(key) + " has " + std::to_string(got) + " entries, FIELDS has " + std::to_string(n));
    };
    same(raw_.sizes.size(), raw_.size_line, "SIZE");
    same(raw_.types.size(), raw_.type_line, "TYPE");
    if (raw_.count_line)
      same(raw_.counts.size(), raw_.count_line, "COUNT");
    else
      raw_.counts.assign(n, 1);
    std::set<std::string> seen;
    int64_t point_bytes = 0;
    for (std::size_t i = 0; i < n; ++i) {
      CloudField field{raw_.names[i], ValueType::kFloat32, raw_.counts[i]};
      if (field.name != "_" && !seen.insert(field.name).second)  // _ is padding and may repeat
        fail(raw_.fields_line, "field '" + plain_word(field.name) + "' is declared twice");
      if (raw_.types[i].size() != 1 || !type_of(raw_.types[i][0], raw_.sizes[i], field.type))
        fail(raw_.type_line, "field '" + plain_word(field.name) + "' has type " + plain_word(raw_.types[i]) +
                                 " of size " + std::to_string(raw_.sizes[i]) +
                                 "; known are F 4 8, I 1 2 4 8, U 1 2 4 8");
      point_bytes += raw_.sizes[i] * raw_.counts[i];
      header_.fields.push_back(field);
    }
    if (point_bytes > kMaxPointBytes) fail(raw_.count_line, "a point of more than 1 MiB");
    header_.point_bytes = std::size_t(point_bytes);
  }

  void check_counts() {
    if (!raw_.width_line && !raw_.points_line) fail(0, "neither WIDTH nor POINTS is given");
    if (!raw_.width_line) header_.width = header_.points;
    const int64_t product = header_.width * header_.height;  // both fit 31 bits
    if (!raw_.points_line) header_.points = product;
    if (product != header_.points)
      fail(raw_.points_line,
           "POINTS is " + std::to_string(header_.points) + ", WIDTH x HEIGHT is " + std::to_string(product));
    if (product > kMaxPoints) fail(raw_.width_line, "more than 2147483647 points");
  }

  const std::string& path_;
  const std::string& bytes_;
  int64_t line_ = 0;
  RawHeader raw_;
  PcdHeader header_;
};

}  // namespace

PcdHeader parse_pcd_header(const std::string& path_in_errors, const std::string& bytes) {
  return Parser(path_in_errors, bytes).run();
}

}  // namespace overtake::io
