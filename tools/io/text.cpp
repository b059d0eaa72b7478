// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/text.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include "tools/io/error.h"
#include "tools/io/output.h"

namespace overtake::io {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

struct Descriptor {
  int number;
  ~Descriptor() { close(number); }
};

[[noreturn]] void fail_special(const std::string& path, mode_t mode) {
  const char* kind = S_ISFIFO(mode) ? "a pipe" : S_ISSOCK(mode) ? "a socket" : "a device";
  throw Error(path, 0, std::string("is ") + kind + ", a regular file is needed");
}

template <class T>
void append_shortest(std::string& text, T value) {
  char digits[40];
  const auto end = std::to_chars(digits, digits + sizeof digits, value);
  text.append(digits, end.ptr);
}

std::string_view without_plus(std::string_view text) {
  return text.size() > 1 && text[0] == '+' && text[1] != '-' && text[1] != '+' ? text.substr(1) : text;
}

}  // namespace

std::string read_whole_file(const std::string& path, uint64_t most) {
  // O_NONBLOCK: opening a pipe without a writer would block.
  const int opened = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY);
  if (opened < 0 && (errno == ENOENT || errno == ENOTDIR)) throw Error(path, 0, "no such file");
  if (opened < 0) throw Error(path, 0, "cannot be read: " + std::string(std::strerror(errno)));
  const Descriptor file{opened};
  struct stat status {};
  if (fstat(file.number, &status) != 0) throw Error(path, 0, "cannot be read");
  if (S_ISDIR(status.st_mode)) throw Error(path, 0, "is a folder, a file is needed");
  if (!S_ISREG(status.st_mode)) fail_special(path, status.st_mode);
  const auto refuse = [&](uint64_t size) {
    throw Error(path, 0,
                "is " + format_size(size) + " long, at most " + format_size(most) + " are read" +
                    (most < memory_limit() && most != text_limit()
                         ? std::string()
                         : "; the memory limit is " + format_size(memory_limit()) + " (--max-memory)"));
  };
  if (uint64_t(status.st_size) > most) refuse(uint64_t(status.st_size));
  std::string bytes;
  bytes.reserve(std::size_t(status.st_size));
  char block[1 << 16];
  while (true) {
    const ssize_t n = read(file.number, block, sizeof block);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw Error(path, 0, "cannot be read to its end");
    if (n == 0) return bytes;
    bytes.append(block, std::size_t(n));
    if (bytes.size() > most) refuse(bytes.size());  // the file grew, or its size was unknown
  }
}

void refuse_special_file(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode))
    fail_special(path, status.st_mode);
}

void fail_write(const std::string& path, int reason) {
  throw Error(path, 0, "cannot be written: " + std::string(std::strerror(reason)));
}

void write_whole_file(const std::string& path, std::string_view bytes) {
  File file(std::fopen(begin_output(path).c_str(), "wb"));
  if (!file) fail_write(path, errno);
  if (std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) fail_write(path, errno);
  if (std::fclose(file.release()) != 0) fail_write(path, errno);
}

std::string_view trim(std::string_view text) {
  const char* white = " \t\r\n";
  const auto first = text.find_first_not_of(white);
  if (first == std::string_view::npos) return text.substr(text.size());
  return text.substr(first, text.find_last_not_of(white) - first + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return lower;
}

std::string join(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) text.append(i ? separator : "").append(words[i]);
  return text;
}

namespace {

constexpr const char* kWhite = " \t\r\n";

// Takes the next word off the front; "" at the end.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kWhite), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kWhite));
  line.remove_prefix(word.size());
  return word;
}

}  // namespace

std::vector<std::string_view> split_words(std::string_view line, std::size_t most) {
  std::vector<std::string_view> words;
  while (words.size() < most) {
    const std::string_view word = take_word(line);
    if (word.empty()) break;
    words.push_back(word);
  }
  return words;
}

std::size_t count_words(std::string_view line) {
  std::size_t count = 0;
  while (!take_word(line).empty()) ++count;
  return count;
}

std::string plain_word(std::string_view word) {
  std::string out(word.substr(0, 32));
  for (char& c : out)
    if (c < 32 || c > 126) c = '?';
  return out;
}

bool parse_number(std::string_view text, double& out) {
  text = without_plus(text);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (end != text.data() + text.size()) return false;
  if (error == std::errc::result_out_of_range) {
    const auto exponent = text.find_first_of("eE");  // from_chars reports underflow and overflow alike
    if (exponent != std::string_view::npos && exponent + 1 < text.size() && text[exponent + 1] != '-') return false;
    if (exponent == std::string_view::npos && text.find("0.0") > 1) return false;
    out = 0;
    return true;
  }
  return error == std::errc();
}

bool parse_integer(std::string_view text, int64_t& out) {
  text = without_plus(text);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size();
}

int64_t to_nanoseconds(double value, int64_t unit_ns) {
  const double whole = std::floor(value);
  return int64_t(whole) * unit_ns + std::llround((value - whole) * double(unit_ns));
}

void append_number(std::string& text, double value) { append_shortest(text, value); }
void append_number(std::string& text, float value) { append_shortest(text, value); }
void append_number(std::string& text, int64_t value) { append_shortest(text, value); }
void append_number(std::string& text, uint64_t value) { append_shortest(text, value); }

}  // namespace overtake::io
