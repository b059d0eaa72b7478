// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Point clouds in PCD files (v0.5 to v0.7; ASCII, binary, binary_compressed), in any field order, type and count.
// Little-endian machines.
#pragma once

#include <cstdint>
#include <string>

#include "tools/io/cloud.h"

namespace overtake::io {

enum class PcdEncoding : uint8_t { kAscii, kBinary, kBinaryCompressed };

// Throws Error with file and line (header, ASCII data) or field and point (binary data).
Cloud parse_pcd(const std::string& path_in_errors, const std::string& bytes);

// Both write as many points as the columns have.
std::string format_pcd(const Cloud& cloud, PcdEncoding encoding = PcdEncoding::kBinary);
void write_pcd(const std::string& path, const Cloud& cloud, PcdEncoding encoding = PcdEncoding::kBinary);

}  // namespace overtake::io
