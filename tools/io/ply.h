// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Point clouds in PLY files (1.0): the scalar properties of element "vertex", in ASCII or binary of either byte order.
// The reader skips list properties of a vertex and elements before the vertices; it does not read what follows them.
// It removes the prefix of CloudCompare's names: scalar_Intensity becomes Intensity.
#pragma once

#include <cstdint>
#include <string>

#include "tools/io/cloud.h"

namespace overtake::io {

enum class PlyEncoding : uint8_t { kAscii, kLittleEndian, kBigEndian };

// Throws Error with file and line (header, ASCII data) or with the byte where the data ends (binary data).
Cloud parse_ply(const std::string& path_in_errors, const std::string& bytes);

// Omits arrays and 64-bit integers, because PLY has no such properties.
std::string format_ply(const Cloud& cloud, PlyEncoding encoding);

}  // namespace overtake::io
