// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/npy.h"

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr char kMagic[] = "\x93NUMPY\x01";  // with its terminating zero: version 1.0

int64_t size_of_type(const std::string& type) { return type == "<f4" || type == "<i4" ? 4 : type == "|u1" ? 1 : 0; }

void write(const std::string& path, const void* data, const std::string& type, const std::vector<int64_t>& shape) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (";
  int64_t values = 1;
  for (std::size_t i = 0; i < shape.size(); ++i) {
    header += (i ? ", " : "") + std::to_string(shape[i]);
    values *= shape[i];
  }
  if (shape.size() == 1) header += ',';
  header += "), }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';  // the data starts on a cache line
  header += '\n';
  std::string bytes(kMagic, 8);
  bytes += char(header.size() & 255);
  bytes += char(header.size() >> 8);
  bytes += header;
  if (values > 0) bytes.append(static_cast<const char*>(data), std::size_t(values * size_of_type(type)));
  write_whole_file(path, bytes);
}

// The text after 'key': in the header, up to the first of `ends`.
std::string value_of(const std::string& path, const std::string& header, const std::string& key, char begin, char end) {
  const auto at = header.find("'" + key + "':");
  const auto first = at == std::string::npos ? at : header.find(begin, at + key.size() + 3);
  const auto last = first == std::string::npos ? first : header.find(end, first + 1);
  if (last == std::string::npos) throw Error(path, 0, "the NPY header has no " + key);
  return header.substr(first + 1, last - first - 1);
}

}  // namespace

void write_npy(const std::string& path, const float* data, const std::vector<int64_t>& shape) {
  write(path, data, "<f4", shape);
}
void write_npy(const std::string& path, const int32_t* data, const std::vector<int64_t>& shape) {
  write(path, data, "<i4", shape);
}
void write_npy(const std::string& path, const uint8_t* data, const std::vector<int64_t>& shape) {
  write(path, data, "|u1", shape);
}

int64_t Npy::values() const {
  int64_t n = 1;
  for (const int64_t extent : shape) n *= extent;
  return n;
}

Npy read_npy(const std::string& path) {
  const std::string bytes = read_whole_file(path, memory_limit() / 2);
  if (bytes.size() < 10 || bytes.compare(0, 8, kMagic, 8) != 0) throw Error(path, 0, "not a NPY v1.0 file");
  const std::size_t length = std::size_t(uint8_t(bytes[8])) | std::size_t(uint8_t(bytes[9])) << 8;
  if (bytes.size() < 10 + length) throw Error(path, 0, "the NPY header is cut off");
  const std::string header = bytes.substr(10, length);
  Npy npy;
  npy.type = value_of(path, header, "descr", '\'', '\'');
  if (size_of_type(npy.type) == 0) throw Error(path, 0, "NPY type '" + npy.type + "' is not f4, i4 or u1");
  if (header.find("'fortran_order': False") == std::string::npos)
    throw Error(path, 0, "NPY arrays in Fortran order are not read");
  std::string shape = value_of(path, header, "shape", '(', ')');
  for (char& c : shape)
    if (c == ',') c = ' ';
  int64_t values = 1;
  for (const auto& word : split_words(shape)) {
    int64_t extent = 0;
    if (!parse_integer(word, extent) || extent < 0)
      throw Error(path, 0, "the NPY shape holds '" + std::string(word) + "'");
    if (extent > 0 && values > int64_t(bytes.size()) / extent)
      values = int64_t(bytes.size()) + 1;  // more than the file holds
    else
      values *= extent;
    npy.shape.push_back(extent);
  }
  npy.bytes = bytes.substr(10 + length);
  if (int64_t(npy.bytes.size()) != values * size_of_type(npy.type))
    throw Error(path, 0, "the NPY data is not as long as its shape says");
  return npy;
}

}  // namespace overtake::io
