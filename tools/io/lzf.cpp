// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/lzf.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace overtake::io {

bool lzf_decompress(const unsigned char* in, std::size_t in_size, unsigned char* out, std::size_t out_size) noexcept {
  std::size_t i = 0, o = 0;
  while (i < in_size) {
    const std::size_t control = in[i++];
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > in_size - i || length > out_size - o) return false;
      std::memcpy(out + o, in + i, length);
      i += length;
      o += length;
      continue;
    }
    std::size_t length = (control >> 5) + 2;
    if (length == 9) {
      if (i >= in_size) return false;
      length += in[i++];
    }
    if (i >= in_size) return false;
    const std::size_t back = ((control & 31) << 8 | in[i++]) + 1;
    if (back > o || length > out_size - o) return false;
    for (std::size_t k = 0; k < length; ++k, ++o) out[o] = out[o - back];  // byte by byte: the copy may overlap itself
  }
  return o == out_size;
}

std::vector<unsigned char> lzf_compress(const unsigned char* in, std::size_t in_size) {
  constexpr std::size_t kMaxBack = 8192, kMaxLength = 264, kHashSize = 1 << 14;
  std::vector<std::size_t> last_seen(kHashSize, SIZE_MAX);
  std::vector<unsigned char> out;
  std::size_t literal_begin = 0;
  const auto flush_literals = [&](std::size_t end) {
    while (literal_begin < end) {
      const std::size_t length = std::min<std::size_t>(32, end - literal_begin);
      out.push_back(static_cast<unsigned char>(length - 1));
      out.insert(out.end(), in + literal_begin, in + literal_begin + length);
      literal_begin += length;
    }
  };
  std::size_t i = 0;
  while (i + 3 <= in_size) {
    const std::size_t hash = (in[i] * 0x9e5fu ^ in[i + 1] * 0x79b1u ^ in[i + 2] * 0x3c6fu) % kHashSize;
    const std::size_t seen = last_seen[hash];
    last_seen[hash] = i;
    if (seen == SIZE_MAX || i - seen > kMaxBack || std::memcmp(in + seen, in + i, 3) != 0) {
      ++i;
      continue;
    }
    std::size_t length = 3;
    while (length < kMaxLength && i + length < in_size && in[seen + length] == in[i + length]) ++length;
    flush_literals(i);
    const std::size_t back = i - seen - 1;
    if (length < 9) {
      out.push_back(static_cast<unsigned char>((length - 2) << 5 | back >> 8));
    } else {
      out.push_back(static_cast<unsigned char>(7 << 5 | back >> 8));
      out.push_back(static_cast<unsigned char>(length - 9));
    }
    out.push_back(static_cast<unsigned char>(back & 255));
    i += length;
    literal_begin = i;
  }
  flush_literals(in_size);
  return out;
}

}  // namespace overtake::io
