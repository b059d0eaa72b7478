// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// NumPy arrays (NPY v1.0, little-endian, row-major).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::io {

void write_npy(const std::string& path, const float* data, const std::vector<int64_t>& shape);
void write_npy(const std::string& path, const int32_t* data, const std::vector<int64_t>& shape);
void write_npy(const std::string& path, const uint8_t* data, const std::vector<int64_t>& shape);

struct Npy {
  std::string type;  // "<f4", "<i4" or "|u1"
  std::vector<int64_t> shape;
  std::string bytes;
  int64_t values() const;
};
// Reads the format of write_npy. Throws Error for any other.
Npy read_npy(const std::string& path);

}  // namespace overtake::io
