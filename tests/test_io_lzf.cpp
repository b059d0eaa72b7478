// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/lzf.h"

#include <doctest/doctest.h>

#include <random>
#include <string>

using namespace overtake;

namespace {

using Bytes = std::vector<unsigned char>;

bool unpack(const Bytes& in, Bytes& out) { return io::lzf_decompress(in.data(), in.size(), out.data(), out.size()); }

}  // namespace

TEST_CASE("lzf: a vector made by hand from the format: literals, a short copy that overlaps itself, a long copy") {
  //               "ab"        copy 4 from 2 back    "c"       copy 9 + 3 = 12 from 1 back
  const Bytes in = {1, 'a', 'b', 2 << 5, 1, 0, 'c', 7 << 5, 3, 0};
  const std::string expected =
      "ababab"
      "c"
      "cccccccccccc";
  Bytes out(expected.size());
  REQUIRE(unpack(in, out));
  CHECK(std::string(out.begin(), out.end()) == expected);
}

TEST_CASE("lzf: a copy from 8192 bytes back, the farthest there is") {
  Bytes plain(8192);
  for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = static_cast<unsigned char>(i * 2654435761u >> 13);
  Bytes in;
  for (std::size_t i = 0; i < plain.size(); i += 32) {
    in.push_back(31);
    in.insert(in.end(), plain.begin() + std::ptrdiff_t(i), plain.begin() + std::ptrdiff_t(i + 32));
  }
  in.insert(in.end(), {(1 << 5) | 31, 255});
  Bytes out(8195);
  REQUIRE(unpack(in, out));
  CHECK(Bytes(out.begin(), out.begin() + 8192) == plain);
  CHECK(Bytes(out.begin() + 8192, out.end()) == Bytes(plain.begin(), plain.begin() + 3));
}

TEST_CASE("lzf: each kind of corrupt input is refused") {
  struct Row {
    const char* what;
    Bytes in;
    std::size_t out_size;
  };
  const Row rows[] = {{"literal run cut off", {4, 'a', 'b'}, 5},
                      {"literal run longer than the output", {1, 'a', 'b'}, 1},
                      {"copy without its offset", {0, 'a', 1 << 5}, 4},
                      {"long copy without its length", {0, 'a', 7 << 5}, 10},
                      {"long copy without its offset", {0, 'a', 7 << 5, 0}, 10},
                      {"copy from before the start", {0, 'a', 1 << 5, 1}, 4},
                      {"copy longer than the output", {0, 'a', 1 << 5, 0}, 3},
                      {"output not filled", {0, 'a'}, 2},
                      {"nothing at all", {}, 1}};
  for (const Row& row : rows) {
    CAPTURE(row.what);
    Bytes out(row.out_size);
    CHECK_FALSE(unpack(row.in, out));
  }
}

TEST_CASE("lzf: what the compressor packs comes back, and repetitive data becomes small") {
  const uint32_t seed = 3;
  CAPTURE(seed);
  std::mt19937 random(seed);
  for (std::size_t n = 0; n < 20000; n = n * 3 / 2 + 1)
    for (const uint32_t alphabet : {1u, 2u, 5u, 256u}) {
      CAPTURE(n);
      CAPTURE(alphabet);
      Bytes plain(n);
      for (auto& byte : plain) byte = static_cast<unsigned char>(random() % alphabet);
      const Bytes packed = io::lzf_compress(plain.data(), plain.size());
      Bytes back(n);
      REQUIRE(unpack(packed, back));
      CHECK(back == plain);
      if (n > 1000 && alphabet == 1) CHECK(packed.size() < n / 50);
      CHECK(packed.size() * io::kLzfMaxExpansion >= n);
    }
}

TEST_CASE("lzf: no changed or missing byte writes outside the output") {
  const uint32_t seed = 5;
  CAPTURE(seed);
  std::mt19937 random(seed);
  Bytes plain(600);
  for (auto& byte : plain) byte = static_cast<unsigned char>(random() % 3);
  const Bytes packed = io::lzf_compress(plain.data(), plain.size());
  int64_t refused = 0;
  for (int32_t round = 0; round < 20000; ++round) {
    Bytes in = packed;
    in[random() % in.size()] = static_cast<unsigned char>(random());
    if (random() % 2) in.resize(random() % in.size());
    Bytes out(plain.size() + 64, 0xa5);  // guard behind the output
    refused += !io::lzf_decompress(in.data(), in.size(), out.data(), plain.size());
    REQUIRE(Bytes(out.begin() + std::ptrdiff_t(plain.size()), out.end()) == Bytes(64, 0xa5));
  }
  CHECK(refused > 10000);
}
