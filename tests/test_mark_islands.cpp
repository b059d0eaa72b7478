// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A car of which one row is seen, as low as the road may be.
#include "kernels/mark_islands.h"

#include <doctest/doctest.h>

#include <random>
#include <string>
#include <vector>

#include "kernels/kernel_table.h"
#include "tests/support/images.h"

namespace overtake {
namespace {

using test::OwnedBits;
using test::OwnedPlane;

constexpr float kPitch = 0.0026f;  // a column is 0.208 m wide at 80 m: an island has 3 to 13 columns, a gap 5

std::vector<float> operator+(std::vector<float> a, const std::vector<float>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
std::vector<float> times(int32_t count, float range_m) { return std::vector<float>(std::size_t(count), range_m); }
std::string text(int32_t count, char c) { return std::string(std::size_t(count), c); }

// The pixels of a row of ground that become non-ground.
std::string marked(const std::vector<float>& range_m, bool wraps = false, float height_m = 0.2f) {
  const int32_t cols = int32_t(range_m.size());
  OwnedPlane<float> range(1, cols), height(1, cols);
  OwnedBits nonground(1, cols);
  nonground.clear();
  for (int32_t c = 0; c < cols; ++c)
    range.view().row(0)[c] = range_m[std::size_t(c)], height.view().row(0)[c] = height_m;
  ref::mark_islands(wraps, kPitch, range, height, nonground);
  std::string out;
  for (int32_t c = 0; c < cols; ++c) out += nonground.view().test(0, c) ? '#' : '.';
  return out;
}
// A row with these pixels between a wall on either side.
std::string between(const std::vector<float>& range_m, float beside_m = 100.0f) {
  return marked(times(20, beside_m) + range_m + times(20, beside_m)).substr(20, range_m.size());
}

TEST_CASE("mark_islands: what has nothing at its distance beside it is not the road") {
  CHECK(between(times(8, 80)) == text(8, '#'));
  CHECK(between(times(8, 80), 0.0f) == text(8, '#'));  // the road beside it returns nothing
  CHECK(marked(times(48, 80)) == text(48, '.'));
  CHECK(marked(times(40, 0) + times(8, 80)) == text(40, '.') + text(8, '#'));  // at the edge of the image
}

TEST_CASE("mark_islands: an island is 0.6 to 2.8 m wide and has 3 pixels") {
  CHECK(between(times(2, 80)) == "..");
  CHECK(between(times(3, 80)) == "###");
  CHECK(between(times(3, 70)) == "...");  // 0.55 m
  CHECK(between(times(13, 80)) == text(13, '#'));
  CHECK(between(times(14, 80)) == text(14, '.'));
  CHECK(between({80, 0, 0, 80}, 0.0f) == "....");
}

TEST_CASE("mark_islands: it has gaps, and steps of 1.5 m; what lies behind it is not of it") {
  CHECK(between({80, 0, 81.4f, 100, 82.7f, 82}) == "#.#.##");
  CHECK(between({80, 81.4f, 82.8f, 84.2f, 85.6f}) == "#####");
  CHECK(between({80, 80, 80, 82, 82, 82}) == "###...");  // behind it: beside those, something is nearer
  CHECK(between(times(5, 80) + times(5, 0) + times(5, 80)) == "#####.....#####");  // two islands
  CHECK(between(times(5, 80) + times(4, 0) + times(5, 80)) == text(14, '.'));      // one that is too wide
  CHECK(between({80, 0, 0, 0, 80, 0, 0, 0, 80}, 0.0f) == text(9, '.'));            // 3 of 9 columns
  CHECK(between({80, 0, 0, 80, 0, 0, 80}, 0.0f) == "#..#..#");
}

TEST_CASE("mark_islands: what something nearer may hide a part of is none") {
  CHECK(between(times(5, 80), 70.0f) == ".....");
  CHECK(marked(times(20, 0) + times(5, 80) + times(4, 0) + times(20, 70)).substr(20, 5) == ".....");
  CHECK(marked(times(20, 0) + times(5, 80) + times(5, 0) + times(20, 70)).substr(20, 5) == "#####");
  CHECK(marked(times(20, 70) + times(4, 0) + times(5, 80) + times(20, 0)).substr(24, 5) == ".....");
}

TEST_CASE("mark_islands: only far away, over the running ground") {
  CHECK(between(times(8, 60)) == text(8, '#'));
  CHECK(between(times(8, 59.9f)) == text(8, '.'));
  const std::vector<float> row = times(20, 0) + times(8, 80) + times(20, 0);
  CHECK(marked(row, false, IslandLimits::kLow_m) == text(20, '.') + text(8, '#') + text(20, '.'));
  CHECK(marked(row, false, 0.99f * IslandLimits::kLow_m) == text(48, '.'));
}

TEST_CASE("mark_islands: an image of all directions has no edge") {
  const std::vector<float> row = times(2, 80) + times(44, 0) + times(2, 80);
  CHECK(marked(row, true) == "##" + text(44, '.') + "##");
  CHECK(marked(row, false) == text(48, '.'));
  CHECK(marked(times(8, 80) + times(36, 0) + times(8, 80), true) == text(52, '.'));
  CHECK(marked(times(8, 80) + times(40, 0) + times(2, 70), true) == text(50, '.'));  // hidden across the seam
}

TEST_CASE("mark_islands: one pixel over the ground is enough, and what is non-ground stays so") {
  const std::vector<float> ranges = times(9, 0) + times(6, 80) + times(9, 0);
  OwnedPlane<float> range(1, 24), height(1, 24);
  OwnedBits nonground(1, 24);
  nonground.clear();
  for (int32_t c = 0; c < 24; ++c) range.view().row(0)[c] = ranges[std::size_t(c)];
  height.view().row(0)[12] = 0.3f;
  nonground.view().set(0, 3);
  ref::mark_islands(false, kPitch, range, height, nonground);
  for (int32_t c = 0; c < 24; ++c) CHECK(nonground.view().test(0, c) == (c == 3 || (c >= 9 && c < 15)));
}

TEST_CASE("mark_islands: every ISA marks what the reference marks") {
  constexpr int32_t kRows = 4;
  std::mt19937 random(1);
  const auto uniform = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
  int32_t islands = 0, pixels = 0;
  for (int32_t round = 0; round < 60; ++round) {
    const int32_t cols = 40 + int32_t(uniform(0, 200));
    const bool wraps = round % 2 == 0;
    OwnedPlane<float> range(kRows, cols), height(kRows, cols);
    OwnedBits before(kRows, cols), expected(kRows, cols);
    before.clear(), expected.clear();
    for (int32_t r = 0; r < kRows; ++r) {
      float near_m = 0;
      for (int32_t c = 0; c < cols; ++c) {
        if (uniform(0, 1) < 0.15f) near_m = uniform(0, 1) < 0.6f ? 0.0f : uniform(50, 120);
        range.view().row(r)[c] = near_m == 0.0f || uniform(0, 1) < 0.1f ? 0.0f : near_m + uniform(-1, 1);
        height.view().row(r)[c] = uniform(-0.2f, 0.4f);
        if (uniform(0, 1) < 0.1f) before.view().set(r, c), expected.view().set(r, c);
      }
    }
    ref::mark_islands(wraps, kPitch, range, height, expected);
    for (const char* isa : {"sse2", "avx2", "avx512", "neon64"}) {
      const KernelTable* kernels = find_kernels(isa);
      if (!kernels) continue;
      OwnedBits found(kRows, cols);
      found.clear();
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < cols; ++c)
          if (before.view().test(r, c)) found.view().set(r, c);
      kernels->mark_islands(wraps, kPitch, range, height, found);
      int32_t differ = 0;
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < cols; ++c) {
          differ += found.view().test(r, c) != expected.view().test(r, c);
          islands += expected.view().test(r, c) && !before.view().test(r, c), ++pixels;
        }
      CHECK(differ == 0);
    }
  }
  CHECK(20 * islands > pixels);
}

}  // namespace
}  // namespace overtake
