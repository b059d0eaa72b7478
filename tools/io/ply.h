// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Point clouds in PLY files (1.0): the scalar properties of element "vertex", in ASCII or binary of either byte order.
// List properties of a vertex and elements before it are skipped; what comes behind the vertices is not looked at.
// CloudCompare's names lose their prefix: scalar_Intensity is Intensity.
#pragma once

#include <cstdint>
#include <string>

#include "tools/io/cloud.h"

namespace overtake::io {

enum class PlyEncoding : uint8_t { kAscii, kLittleEndian, kBigEndian };

// Throws Error with file and line (header, ASCII data) or with the byte where the data ends (binary data).
Cloud parse_ply(const std::string& path_in_errors, const std::string& bytes);

// Without arrays and 64-bit integers: PLY has no such properties.
std::string format_ply(const Cloud& cloud, PlyEncoding encoding);

}  // namespace overtake::io
