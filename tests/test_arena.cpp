// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "core/arena.h"

#include <doctest/doctest.h>

#include <utility>
#include <vector>

#include "core/range_image.h"

namespace overtake {
namespace {

// Counts the blocks it hands out and dirties them. It can be set to refuse, or to return unaligned addresses.
struct Ledger {
  int allocations = 0, releases = 0;
  size_t bytes_out = 0, bytes_back = 0;
  bool has_memory = true;
  size_t offset = 0;

  Allocator allocator() {
    Allocator a;
    a.user = this;
    a.allocate = [](size_t bytes, size_t alignment, void* user) -> void* {
      Ledger& self = *static_cast<Ledger*>(user);
      if (!self.has_memory) return nullptr;
      const Allocator base = default_allocator();
      void* block = base.allocate(bytes + kCacheLine, alignment, nullptr);
      std::memset(block, 0xa5, bytes + kCacheLine);
      ++self.allocations;
      self.bytes_out += bytes;
      return static_cast<char*>(block) + self.offset;
    };
    a.release = [](void* block, size_t bytes, void* user) {
      Ledger& self = *static_cast<Ledger*>(user);
      ++self.releases;
      self.bytes_back += bytes;
      const Allocator base = default_allocator();
      base.release(static_cast<char*>(block) - self.offset, bytes, nullptr);
    };
    return a;
  }
};

bool is_aligned(const void* p) { return reinterpret_cast<std::uintptr_t>(p) % kCacheLine == 0; }

TEST_CASE("arena: hands out aligned, zeroed pieces that do not overlap") {
  Ledger ledger;
  Arena arena;
  float* a = nullptr;
  uint8_t* b = nullptr;
  int64_t* c = nullptr;
  REQUIRE(arena.build(ledger.allocator(), [&](Carver& carver) {
    a = carver.take<float>(5);
    b = carver.take<uint8_t>(65);
    c = carver.take<int64_t>(3);
  }));
  CHECK(ledger.allocations == 1);
  CHECK(arena.bytes() == 64 + 128 + 64);
  CHECK(is_aligned(a));
  CHECK(is_aligned(b));
  CHECK(is_aligned(c));
  const char* block = reinterpret_cast<const char*>(a);
  CHECK(reinterpret_cast<const char*>(b) == block + 64);
  CHECK(reinterpret_cast<const char*>(c) == block + 192);
  for (std::size_t i = 0; i < arena.bytes(); ++i) REQUIRE(block[i] == 0);
}

TEST_CASE("arena: the default allocator gives aligned blocks") {
  Arena arena;
  char* a = nullptr;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { a = carver.take<char>(1000); }));
  CHECK(is_aligned(a));
  CHECK(arena.bytes() == 1024);
}

TEST_CASE("arena: without memory build fails and keeps nothing") {
  Ledger ledger;
  Arena arena;
  float* a = nullptr;
  const auto carve = [&](Carver& carver) { a = carver.take<float>(100); };
  REQUIRE(arena.build(ledger.allocator(), carve));
  ledger.has_memory = false;
  CHECK_FALSE(arena.build(ledger.allocator(), carve));
  CHECK(a == nullptr);
  CHECK(arena.bytes() == 0);
  CHECK(ledger.releases == 1);  // the block of the first build
  ledger.has_memory = true;
  CHECK(arena.build(ledger.allocator(), carve));
  CHECK(a != nullptr);
}

TEST_CASE("arena: refuses an unaligned block and frees it") {
  Ledger ledger;
  ledger.offset = 16;
  Arena arena;
  CHECK_FALSE(arena.build(ledger.allocator(), [&](Carver& carver) { carver.take<float>(100); }));
  CHECK(arena.bytes() == 0);
  CHECK(ledger.allocations == 1);
  CHECK(ledger.releases == 1);
}

TEST_CASE("arena: frees its block once, with the allocator that gave it, also after moves") {
  Ledger ledger, other;
  {
    Arena first;
    float* a = nullptr;
    REQUIRE(first.build(ledger.allocator(), [&](Carver& carver) { a = carver.take<float>(16); }));
    a[3] = 7.0f;
    Arena second(std::move(first));
    CHECK(first.bytes() == 0);
    CHECK(second.bytes() == 64);
    CHECK(a[3] == 7.0f);  // the columns' addresses stay valid after the move
    Arena third;
    REQUIRE(third.build(other.allocator(), [&](Carver& carver) { carver.take<float>(16); }));
    third = std::move(second);
    CHECK(other.releases == 1);
    CHECK(third.bytes() == 64);
    CHECK(a[3] == 7.0f);
    Arena& self = third;
    third = std::move(self);
    CHECK(third.bytes() == 64);
    CHECK(ledger.releases == 0);
  }
  CHECK(ledger.releases == 1);
  CHECK(other.releases == 1);
  CHECK(ledger.bytes_back == ledger.bytes_out);
}

TEST_CASE("arena: carving nothing still gives addresses") {
  Arena arena;
  float* a = nullptr;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { a = carver.take<float>(0); }));
  CHECK(a != nullptr);
}

TEST_CASE("plane: rows start on cache lines, with kRowPad columns on both sides inside the block") {
  for (const int32_t cols : {1, 15, 16, 17, 857}) {
    CAPTURE(cols);
    Arena arena;
    Plane<float> plane;
    char* before = nullptr;
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) {
      before = carver.take<char>(64);
      plane = carver.take_plane<float>(3, cols);
    }));
    CHECK(plane.rows == 3);
    CHECK(plane.cols == cols);
    CHECK(plane.stride % kRowAlign == 0);
    CHECK(plane.stride - plane.cols >= kRowPad);
    for (int32_t r = 0; r < 3; ++r) CHECK(is_aligned(plane.row(r)));
    const char* first = reinterpret_cast<const char*>(plane.row(0) - kRowPad);
    const char* last = reinterpret_cast<const char*>(plane.row(2) + plane.cols + kRowPad);
    CHECK(first >= before + 64);
    CHECK(last <= before + arena.bytes());
  }
}

TEST_CASE("range images: the images of a scan share one shape and one stride") {
  Arena arena;
  RangeImages m;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_range_images(carver, m, 8, 70); }));
  const Plane<float> planes[] = {m.range_m,   m.elevation_rad,    m.range_filled_m,   m.elevation_filled_rad,
                                 m.angle_rad, m.angle_smooth_rad, m.range_repaired_m, m.elevation_repaired_rad};
  for (const Plane<float>& p : planes) {
    CHECK(p.data != nullptr);
    CHECK(p.rows == 8);
    CHECK(p.cols == 70);
    CHECK(p.stride == m.pixel_point.stride);
  }
  CHECK(m.labels.stride == m.pixel_point.stride);
  for (const BitPlane& b : {m.nonground, m.nonground_repaired, m.link_right, m.link_down}) {
    CHECK(b.words != nullptr);
    CHECK(b.words_per_row == 2);
  }
  m.nonground.set(7, 69);
  CHECK(m.nonground.test(7, 69));
  CHECK_FALSE(m.nonground.test(7, 68));
  CHECK(m.nonground.row(7)[1] == uint64_t(1) << 5);
  m.nonground.clear_row(7);
  CHECK_FALSE(m.nonground.test(7, 69));
}

}  // namespace
}  // namespace overtake
