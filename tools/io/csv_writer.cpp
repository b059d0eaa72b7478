// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstdio>
#include <utility>

#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/text.h"

namespace overtake::io {

CsvWriter::CsvWriter(std::string path, std::string_view header) : path_(std::move(path)), pending_(header) {
  pending_ += '\n';
  file_ = std::fopen(begin_output(path_).c_str(), "wb");
  if (!file_) fail_write(path_, errno);
}

CsvWriter::~CsvWriter() {
  auto* file = static_cast<std::FILE*>(file_);
  std::fwrite(pending_.data(), 1, pending_.size(), file);
  std::fclose(file);
}

template <class T>
CsvWriter& CsvWriter::cell(T value) {
  if (row_open_) pending_ += ',';
  row_open_ = true;
  if constexpr (std::is_same_v<T, std::string_view>)
    pending_ += value;
  else
    append_number(pending_, value);
  return *this;
}
template CsvWriter& CsvWriter::cell(double);
template CsvWriter& CsvWriter::cell(float);
template CsvWriter& CsvWriter::cell(int32_t);
template CsvWriter& CsvWriter::cell(int64_t);
template CsvWriter& CsvWriter::cell(uint64_t);
template CsvWriter& CsvWriter::cell(std::string_view);

void CsvWriter::end_row() {
  pending_ += '\n';
  row_open_ = false;
}

void CsvWriter::flush() {
  auto* file = static_cast<std::FILE*>(file_);
  const std::string rows = std::exchange(pending_, "");
  if (std::fwrite(rows.data(), 1, rows.size(), file) != rows.size() || std::fflush(file) != 0) fail_write(path_, errno);
}

}  // namespace overtake::io
