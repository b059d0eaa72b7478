// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads and writes whole files, and converts numbers to text independent of the locale.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/io/memory_limit.h"

namespace overtake::io {

// The file's bytes. Throws Error if the file is missing, not a regular file (a folder, a device, a pipe: it never
// blocks), not readable, or longer than `most`.
std::string read_whole_file(const std::string& path, uint64_t most = memory_limit());
// Throws Error unless the path is a regular file, a folder if allowed, or does not exist.
void refuse_special_file(const std::string& path);
// Throws the Error of a file that cannot be written; `reason`: errno.
[[noreturn]] void fail_write(const std::string& path, int reason);
// Replaces the file. Throws Error if the folder does not exist or the disk is full.
void write_whole_file(const std::string& path, std::string_view bytes);

std::string_view trim(std::string_view text);
std::string lower_case(std::string_view text);
std::string join(const std::vector<std::string>& words, std::string_view separator);
// Splits at runs of white space, into the first `most` words.
std::vector<std::string_view> split_words(std::string_view line, std::size_t most = SIZE_MAX);
std::size_t count_words(std::string_view line);
// A word of a file for an error text: its first 32 bytes, with ? for each that is not printable ASCII.
std::string plain_word(std::string_view word);

// Parses all of `text` as one number (a leading + is allowed), else returns false. "nan" and "inf" are numbers. A
// number too small for a double is 0; one too large is not a number.
bool parse_number(std::string_view text, double& out);
bool parse_integer(std::string_view text, int64_t& out);

// `value` in units of unit_ns as nanoseconds; keeps the digits that value * unit_ns would lose. Needs |result| < 2^63.
int64_t to_nanoseconds(double value, int64_t unit_ns);

// Shortest text that reads back as the same value; "nan", "inf", "-inf".
void append_number(std::string& text, double value);
void append_number(std::string& text, float value);
void append_number(std::string& text, int64_t value);
void append_number(std::string& text, uint64_t value);
inline void append_number(std::string& text, int32_t value) { append_number(text, int64_t(value)); }

}  // namespace overtake::io
