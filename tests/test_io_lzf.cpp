// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// LZF, the compression of PCD's binary_compressed, as liblzf unpacks it:
//
//   000LLLLL <L+1 bytes>              literal run of 1..32 bytes
//   LLLooooo oooooooo                 copy L+2 bytes (L = 1..6) from o+1 bytes back
//   111ooooo LLLLLLLL oooooooo        copy L+9 bytes (L = 0..255) from o+1 bytes back; may overlap what it writes
#include <doctest/doctest.h>
#include <lzf.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "tools/io/error.h"
#include "tools/io/pcd.h"

using namespace overtake;

namespace {

using Bytes = std::vector<unsigned char>;

std::string pcd_head(std::size_t points) {
  return "FIELDS a\nSIZE 1\nTYPE U\nWIDTH " + std::to_string(points) + "\nDATA binary_compressed\n";
}

// A PCD file of one byte a point.
bool unpack(const Bytes& in, Bytes& out) {
  std::string file = pcd_head(out.size());
  for (const auto size : {uint32_t(in.size()), uint32_t(out.size())})
    file.append(reinterpret_cast<const char*>(&size), 4);
  file.append(in.begin(), in.end());
  try {
    out = io::parse_pcd("f", file).columns[0].bytes;
  } catch (const io::Error& error) {
    CHECK(std::string(error.what()).starts_with("f: the compressed data is corrupt"));
    return false;
  }
  return true;
}

Bytes pack(const Bytes& plain) {
  io::Cloud cloud;
  io::add_column(cloud, "a", io::ValueType::kUint8, plain);
  const std::string file = io::format_pcd(cloud, io::PcdEncoding::kBinaryCompressed);
  const auto data = file.find("binary_compressed\n") + 18 + 8;
  return Bytes(file.begin() + std::ptrdiff_t(data), file.end());
}

// Bytes that end where the process may not read or write.
class Guarded {
 public:
  explicit Guarded(std::size_t size) : size_(size) {
    const auto page = std::size_t(sysconf(_SC_PAGESIZE));
    mapped_ = (size + page - 1) / page * page + page;
    void* block = mmap(nullptr, mapped_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    REQUIRE(block != MAP_FAILED);
    block_ = static_cast<unsigned char*>(block);
    REQUIRE(mprotect(block_ + mapped_ - page, page, PROT_NONE) == 0);
    end_ = block_ + mapped_ - page;
  }
  ~Guarded() { munmap(block_, mapped_); }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;
  unsigned char* last(std::size_t size) {
    REQUIRE(size <= size_);
    return end_ - size;
  }

 private:
  std::size_t size_, mapped_ = 0;
  unsigned char *block_ = nullptr, *end_ = nullptr;
};

}  // namespace

TEST_CASE("lzf: decompresses a hand-made vector: literals, a short copy that overlaps itself, a long copy") {
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

TEST_CASE("lzf: copies from 8192 bytes back, the maximum") {
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

TEST_CASE("lzf: refuses each kind of corrupt input") {
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

TEST_CASE("lzf: compressed data is restored, and repetitive data becomes small") {
  const uint32_t seed = 3;
  CAPTURE(seed);
  std::mt19937 random(seed);
  for (std::size_t n = 1; n < 20000; n = n * 3 / 2 + 1)
    for (const uint32_t alphabet : {1u, 2u, 5u, 256u}) {
      CAPTURE(n);
      CAPTURE(alphabet);
      Bytes plain(n);
      for (auto& byte : plain) byte = static_cast<unsigned char>(random() % alphabet);
      const Bytes packed = pack(plain);
      Bytes back(n);
      REQUIRE(unpack(packed, back));
      CHECK(back == plain);
      if (n > 1000 && alphabet == 1) CHECK(packed.size() < n / 50);
      CHECK(packed.size() * 88 >= n);
    }
}

TEST_CASE("lzf: no changed or missing byte makes the library read or write outside of its buffers") {
  const uint32_t seed = 5;
  CAPTURE(seed);
  std::mt19937 random(seed);
  Bytes plain(600);
  for (auto& byte : plain) byte = static_cast<unsigned char>(random() % 3);
  const Bytes packed = pack(plain);
  Guarded source(packed.size()), target(plain.size());
  int64_t refused = 0;
  for (int32_t round = 0; round < 20000; ++round) {
    Bytes in = packed;
    in[random() % in.size()] = static_cast<unsigned char>(random());
    if (random() % 2) in.resize(1 + random() % (in.size() - 1));
    unsigned char* from = source.last(in.size());
    std::memcpy(from, in.data(), in.size());
    unsigned char* to = target.last(plain.size());
    const unsigned before = to[-1];
    refused += lzf_decompress(from, uint32_t(in.size()), to, uint32_t(plain.size())) != plain.size();
    REQUIRE(to[-1] == before);
  }
  CHECK(refused > 10000);
}
