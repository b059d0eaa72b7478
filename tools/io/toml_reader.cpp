// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/toml_reader.h"

#include <algorithm>
#include <string_view>

#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::io {

namespace {

// Line of the first byte that TOML forbids, 0 if there is none. Outside of strings and comments, and after a backslash,
// TOML is ASCII; control characters are forbidden, and a quote may only start a key or a value. toml++ has undefined
// behaviour for some letters there. A line's end ends comments and single-line strings.
int64_t find_stray_byte(std::string_view text) {
  int64_t line = 1;
  std::size_t i = text.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0;  // a byte order mark
  std::string_view end;                                         // closes what is open: a quote, three of them, or '#'

  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\r' && c != '\t') return line;
    if (c == '\n') {
      ++line;
      if (end.size() == 1) end = {};
    } else if (end == "#") {
      continue;
    } else if (!end.empty()) {
      if (c == '\\' && end[0] == '"' && i + 1 < text.size() && text[i + 1] != '\n') {
        if (static_cast<unsigned char>(text[++i]) >= 0x80) return line;
      } else if (text.substr(i, end.size()) == end) {
        i += end.size() - 1;
        for (int more = 0; end.size() == 3 && more < 2 && text.substr(i + 1, 1) == end.substr(0, 1); ++more) ++i;
        end = {};  // up to two quotes of the string may precede the three
      }
    } else if (c == '#') {
      end = "#";
    } else if (c == '"' || c == '\'') {
      if (i > 0 && std::string_view(" \t\r\n=[{,.\xbf").find(text[i - 1]) == std::string_view::npos) return line;
      const std::string_view three = c == '"' ? R"(""")" : "'''";
      end = text.substr(i, 3) == three ? three : three.substr(0, 1);
      i += end.size() - 1;
    } else if (static_cast<unsigned char>(c) >= 0x80) {
      return line;
    }
  }
  return 0;
}

}  // namespace

void throw_toml_broken() { throw TomlBroken(); }

toml::table parse_toml(const std::string& path_in_errors, std::string_view text) {
  if (text.size() > kMostToml)
    throw Error(path_in_errors, 0,
                "is " + format_size(text.size()) + " long, at most " + format_size(kMostToml) + " of TOML are read");
  if (const int64_t line = find_stray_byte(text))
    throw Error(path_in_errors, line,
                "holds a character where none such may be: not ASCII outside of strings and comments, a control "
                "character, or a quote within a word");
  try {
    return toml::parse(text, path_in_errors);
  } catch (const toml::parse_error& error) {
    throw Error(path_in_errors, int64_t(error.source().begin.line), std::string(error.description()),
                int64_t(error.source().begin.column));
  } catch (const TomlBroken&) {
    throw Error(path_in_errors, 0, "is not TOML: a key, a table's name or a value is malformed");
  }
}

TomlReader::TomlReader(std::string path, const toml::table& table, std::string where)
    : path_(std::move(path)), table_(table), where_(std::move(where)) {}

void TomlReader::fail(int64_t line, const std::string& sentence) const {
  throw Error(path_, line, where_.empty() ? sentence : where_ + ": " + sentence);
}

int64_t TomlReader::line_of(const std::string& key) const {
  const toml::node* node = table_.get(key);
  return node ? int64_t(node->source().begin.line) : line();
}

const toml::node* TomlReader::find(const std::string& key, bool required) {
  read_.insert(key);
  const toml::node* node = table_.get(key);
  if (!node && required) fail(line(), "'" + key + "' is missing");
  return node;
}

double TomlReader::any_number(const std::string& key) {
  const toml::node* node = find(key, true);
  if (!node->is_number()) fail(line_of(key), "'" + key + "' is not a number");
  return node->is_integer() ? double(node->as_integer()->get()) : node->as_floating_point()->get();
}

double TomlReader::number(const std::string& key, double low, double high, const double* fallback) {
  if (fallback && !has(key)) return read_.insert(key), *fallback;
  const double value = any_number(key);
  if (!(value >= low && value <= high))
    fail(line_of(key), "'" + key + "' is " + toml_number(value) + ", its limits are " + toml_number(low) + " to " +
                           toml_number(high));
  return value;
}

int64_t TomlReader::integer(const std::string& key, int64_t low, int64_t high, const int64_t* fallback) {
  const toml::node* node = find(key, !fallback);
  if (!node) return *fallback;
  if (!node->is_integer()) fail(line_of(key), "'" + key + "' is not a whole number");
  const int64_t value = node->as_integer()->get();
  if (value < low || value > high)
    fail(line_of(key), "'" + key + "' is " + std::to_string(value) + ", its limits are " + std::to_string(low) +
                           " to " + std::to_string(high));
  return value;
}

bool TomlReader::boolean_or(const std::string& key, bool fallback) {
  const toml::node* node = find(key, false);
  if (!node) return fallback;
  if (!node->is_boolean()) fail(line_of(key), "'" + key + "' is neither true nor false");
  return node->as_boolean()->get();
}

bool TomlReader::is_text(const std::string& key) const {
  const toml::node* node = table_.get(key);
  return node && node->is_string();
}

std::string TomlReader::text(const std::string& key, const std::string* fallback) {
  const toml::node* node = find(key, !fallback);
  if (!node) return *fallback;
  if (!node->is_string()) fail(line_of(key), "'" + key + "' is not text in quotes");
  return node->as_string()->get();
}

std::vector<std::string> TomlReader::texts(const std::string& key) {
  const toml::node* node = find(key, false);
  if (!node) return {};
  if (node->is_string()) return {text(key)};
  std::vector<std::string> out;
  const toml::array* array = node->as_array();
  if (!array) fail(line_of(key), "'" + key + "' is neither a text nor a list of texts");
  for (const toml::node& element : *array) {
    if (!element.is_string()) fail(line_of(key), "'" + key + "' holds an element that is not text in quotes");
    out.push_back(element.as_string()->get());
  }
  return out;
}

std::vector<const toml::table*> TomlReader::tables(const std::string& key) {
  std::vector<const toml::table*> out;
  const toml::node* node = find(key, false);
  if (!node) return out;
  if (const toml::table* one = node->as_table()) return {one};
  const toml::array* array = node->as_array();
  if (!array || array->empty()) fail(line_of(key), "'" + key + "' is not a table");
  for (const toml::node& element : *array) {
    if (!element.is_table()) fail(line_of(key), "'" + key + "' is not an array of tables");
    out.push_back(element.as_table());
  }
  return out;
}

const toml::table* TomlReader::only_table(const std::string& key) {
  const std::vector<const toml::table*> found = tables(key);
  if (found.size() > 1)
    fail(int64_t(found[1]->source().begin.line), "a second table [[" + key + "]]: only one is read, as [" + key + "]");
  return found.empty() ? nullptr : found[0];
}

std::vector<std::string> TomlReader::unread() const {
  std::vector<std::pair<toml::source_position, std::string>> keys;
  for (const auto& [key, node] : table_)
    if (!read_.count(std::string(key.str()))) keys.emplace_back(node.source().begin, std::string(key.str()));
  std::sort(keys.begin(), keys.end());
  std::vector<std::string> names;
  for (const auto& entry : keys) names.push_back(entry.second);
  return names;
}

void TomlReader::finish() const {
  const auto keys = unread();
  if (keys.empty()) return;
  const std::vector<std::string> known(read_.begin(), read_.end());
  fail(line_of(keys[0]), "unknown key '" + keys[0] + "'" + did_you_mean(keys[0], known));
}

std::string toml_string(std::string_view text) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (uint8_t(c) >= 32 && c != 127)
      out += c;
    else
      out.append("\\u00") += {kHex[uint8_t(c) >> 4], kHex[c & 15]};
  }
  return out + '"';
}

std::string toml_number(double value) {
  std::string text;
  append_number(text, value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";  // e: exponent; n: nan, inf
  return text;
}

}  // namespace overtake::io
