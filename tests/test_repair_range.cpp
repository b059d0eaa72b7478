// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Repair of the non-ground range image, NGRIR (eq. 3).
#include "kernels/repair_range.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::OwnedBits;
using test::OwnedPlane;

const RepairRangeParams kRepair = test::paper_params().repair_range;  // window 9, 5 m

// One row; '#' is non-ground. All ranges 20 m unless given.
struct Repaired {
  Repaired(const RepairRangeParams& params, const char* picture, std::vector<float> ranges = {})
      : cols(int32_t(std::string(picture).size())), range_out(1, cols), elevation_out(1, cols), bits_out(1, cols) {
    OwnedPlane<float> range(1, cols), elevation(1, cols);
    for (int32_t c = 0; c < cols; ++c) {
      range.at(0, c) = ranges.empty() ? 20.0f : ranges[std::size_t(c)];
      elevation.at(0, c) = 0.01f * float(c);
    }
    OwnedBits bits{picture};
    ref::repair_range(params, range, elevation, bits, range_out, elevation_out, bits_out);
    CHECK(test::tail_is_clear(bits_out));
    picture_out = art_of(bits_out);
    picture_out.pop_back();
  }
  float range(int32_t c) { return range_out.at(0, c); }
  float elevation(int32_t c) { return elevation_out.at(0, c); }
  int32_t cols;
  OwnedPlane<float> range_out, elevation_out;
  OwnedBits bits_out;
  std::string picture_out;
};

TEST_CASE("repair_range: a pixel joins with the mean of the pairs on both sides") {
  //                  0   1   2   3    4
  Repaired one(kRepair, "#.#..", {10, 99, 12, 99, 99});
  CHECK(one.picture_out == "###..");
  CHECK(one.range(1) == 11.0f);
  CHECK(one.elevation(1) == doctest::Approx(0.01f));
  CHECK(one.range(0) == 10.0f);  // non-ground pixels keep their range
  CHECK(one.elevation(2) == 0.02f);
  CHECK(one.range(3) == 0.0f);  // all other pixels are not in the image
  CHECK(one.elevation(3) == 0.0f);

  // two pairs: (1, 3) and (0, 4), each counts with both pixels
  Repaired two(kRepair, "##.##", {10, 11, 0, 13, 14});
  CHECK(two.picture_out == "#####");
  CHECK(two.range(2) == 12.0f);
}

TEST_CASE("repair_range takes an empty pixel as well as a ground pixel") {
  CHECK(Repaired(kRepair, "#.#", {20, 0, 20}).picture_out == "###");
  CHECK(Repaired(kRepair, "#.#", {20, 35, 20}).range(1) == 20.0f);
}

TEST_CASE("repair_range: both pixels of a pair must be non-ground and at one distance from the pixel") {
  CHECK(Repaired(kRepair, "#..").picture_out == "#..");
  CHECK(Repaired(kRepair, "#..#").picture_out == "#..#");  // no pixel is in the middle of the two
  CHECK(Repaired(kRepair, "#...#").picture_out == "#.#.#");
}

TEST_CASE("repair_range: window 9 reaches four columns, and no further") {
  CHECK(Repaired(kRepair, "#.......#").picture_out == "#...#...#");
  CHECK(Repaired(kRepair, "#.........#").picture_out == "#.........#");
  RepairRangeParams narrow = kRepair;
  narrow.half_window = 1;
  CHECK(Repaired(narrow, "#...#.#").picture_out == "#...###");
  narrow.half_window = 0;
  CHECK(Repaired(narrow, "#.#").picture_out == "#.#");
}

TEST_CASE("repair_range: the ranges of a pair differ by less than 5 m") {
  CHECK(Repaired(kRepair, "#.#", {20, 0, 24.9f}).picture_out == "###");
  CHECK(Repaired(kRepair, "#.#", {20, 0, 25}).picture_out == "#.#");
  CHECK(Repaired(kRepair, "#.#", {25, 0, 20}).picture_out == "#.#");
  // the outer pair fails and does not spoil the inner one
  CHECK(Repaired(kRepair, "##.##", {10, 20, 0, 22, 30}).range(2) == 21.0f);
}

TEST_CASE("repair_range reads the original mask only: a repaired pixel repairs nothing") {
  CHECK(Repaired(kRepair, "#...#....").picture_out == "#.#.#....");
}

TEST_CASE("repair_range: a pair that leaves the image does not exist, unless columns wrap") {
  RepairRangeParams wraps = kRepair;
  wraps.wraps = true;
  CHECK(Repaired(kRepair, ".#......#").picture_out == ".#......#");
  CHECK(Repaired(wraps, ".#......#").picture_out == "##......#");
  CHECK(Repaired(wraps, ".#......#").range(0) == 20.0f);
  CHECK(Repaired(wraps, "#.....#..").picture_out == "#..#..#..");
  CHECK(Repaired(wraps, "#......#.").picture_out == "#......##");
}

TEST_CASE("repair_range: on a narrow wrapping image the two pixels of a pair are never one") {
  RepairRangeParams wraps = kRepair;
  wraps.wraps = true;
  CHECK(Repaired(wraps, "#").picture_out == "#");
  CHECK(Repaired(wraps, ".").picture_out == ".");
  CHECK(Repaired(wraps, "#.").picture_out == "#.");
  CHECK(Repaired(wraps, "..#.").picture_out == "..#.");
  CHECK(Repaired(wraps, "#.#").picture_out == "###");
}

TEST_CASE("repair_range: agrees with a plain form of eq. 3 on random masks") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const int32_t rows = 3, cols = 1 + int32_t(random() % 200);
    RepairRangeParams params = kRepair;
    params.wraps = random() % 2 == 0;
    params.half_window = int32_t(random() % 6);
    OwnedPlane<float> range(rows, cols), elevation(rows, cols), range_out(rows, cols), elevation_out(rows, cols);
    OwnedBits bits(rows, cols), bits_out(rows, cols);
    bits.clear();
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        range.at(r, c) = 10.0f + float(random() % 1000) * 0.01f;
        elevation.at(r, c) = float(random() % 100) * 0.001f;
        if (r != 1 && random() % 3 == 0) bits.view().set(r, c);
      }
    ref::repair_range(params, range, elevation, bits, range_out, elevation_out, bits_out);
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        CAPTURE(c);
        double sum = 0, e_sum = 0, n = 0;
        for (int32_t k = 1; k <= params.half_window; ++k) {
          int32_t a = c - k, b = c + k;
          if (params.wraps) {
            if (2 * k >= cols) break;
            a = (a + cols) % cols;
            b = b % cols;
          }
          if (a < 0 || b >= cols || !bits.view().test(r, a) || !bits.view().test(r, b)) continue;
          if (std::fabs(range.at(r, a) - range.at(r, b)) >= 5.0f) continue;
          sum += double(range.at(r, a)) + double(range.at(r, b));
          e_sum += double(elevation.at(r, a)) + double(elevation.at(r, b));
          n += 2;
        }
        const bool own = bits.view().test(r, c);
        CHECK(bits_out.view().test(r, c) == (own || n > 0));
        const double want = own ? double(range.at(r, c)) : n > 0 ? sum / n : 0.0;
        const double e_want = own ? double(elevation.at(r, c)) : n > 0 ? e_sum / n : 0.0;
        CHECK(double(range_out.at(r, c)) == doctest::Approx(want).epsilon(1e-6));
        CHECK(double(elevation_out.at(r, c)) == doctest::Approx(e_want).epsilon(1e-5));
      }
  }
}

}  // namespace
}  // namespace overtake
