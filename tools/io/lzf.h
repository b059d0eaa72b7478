// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// LZF, the compression of PCD's binary_compressed.
//
//   000LLLLL <L+1 bytes>              literal run of 1..32 bytes
//   LLLooooo oooooooo                 copy L+2 bytes (L = 1..6) from o+1 bytes back
//   111ooooo LLLLLLLL oooooooo        copy L+9 bytes (L = 0..255) from o+1 bytes back; may overlap what it writes
#pragma once

#include <cstddef>
#include <vector>

namespace overtake::io {

// A copy of 3 bytes yields at most 264.
inline constexpr std::size_t kLzfMaxExpansion = 88;

// Writes exactly out_size bytes from exactly in_size. False when the input is corrupt, cut off or of another length;
// then `out` holds anything, and nothing outside either buffer was touched.
bool lzf_decompress(const unsigned char* in, std::size_t in_size, unsigned char* out, std::size_t out_size) noexcept;

std::vector<unsigned char> lzf_compress(const unsigned char* in, std::size_t in_size);

}  // namespace overtake::io
