// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads a TOML table key by key: every error has file and line, and finish() refuses keys that were not read.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tools/io/error.h"
#include "tools/io/toml_parser.h"

namespace overtake::io {

// Throws Error with the line if the text is not TOML.
inline constexpr uint64_t kMostToml = uint64_t(4) << 20;  // bytes of a document; its nodes take several times as much
toml::table parse_toml(const std::string& path_in_errors, std::string_view text);

class TomlReader {
 public:
  // The table must outlive the reader. `where` names it in errors: "", "sensor 'front'".
  TomlReader(std::string path, const toml::table& table, std::string where = "");

  bool has(const std::string& key) const { return table_.contains(key); }
  const std::string& path() const { return path_; }
  const std::string& where() const { return where_; }
  void name_it(std::string where) { where_ = std::move(where); }
  int64_t line() const { return int64_t(table_.source().begin.line); }
  int64_t line_of(const std::string& key) const;

  double any_number(const std::string& key);  // also NaN and infinite; the key is required
  // Without a fallback the key is required.
  double number(const std::string& key, double low, double high, const double* fallback = nullptr);
  double number_or(const std::string& key, double low, double high, double fallback) {
    return number(key, low, high, &fallback);
  }
  int64_t integer(const std::string& key, int64_t low, int64_t high, const int64_t* fallback = nullptr);
  int64_t integer_or(const std::string& key, int64_t low, int64_t high, int64_t fallback) {
    return integer(key, low, high, &fallback);
  }
  bool boolean_or(const std::string& key, bool fallback);
  std::string text(const std::string& key, const std::string* fallback = nullptr);
  std::string text_or(const std::string& key, const std::string& fallback) { return text(key, &fallback); }
  bool is_text(const std::string& key) const;
  // A text or an array of texts; empty when the key is missing.
  std::vector<std::string> texts(const std::string& key);

  // Tables of an array of tables ([[key]]), or of one table; empty when the key is missing.
  std::vector<const toml::table*> tables(const std::string& key);
  // The table of a key, nullptr when the key is missing. A second [[key]] is an error: nobody would read it.
  const toml::table* only_table(const std::string& key);

  // Keys in file order that were not read yet.
  std::vector<std::string> unread() const;
  void mark_read(const std::string& key) { read_.insert(key); }
  void finish() const;  // throws at the first unread key

  [[noreturn]] void fail(int64_t line, const std::string& sentence) const;

 private:
  const toml::node* find(const std::string& key, bool required);
  std::string path_;
  const toml::table& table_;
  std::string where_;
  std::set<std::string> read_;
};

std::string toml_string(std::string_view text);  // quoted and escaped
// A number in the text that TOML reads back as the same float: 1.0, not 1.
std::string toml_number(double value);

}  // namespace overtake::io
