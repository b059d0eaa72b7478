// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Fills gaps of the range image.
#include "kernels/fill_gaps.h"

#include <doctest/doctest.h>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::OwnedPlane;

struct Filled {
  explicit Filled(OwnedPlane<float> range_in)
      : rows(range_in.view().rows), cols(range_in.view().cols), range(rows, cols), elevation(rows, cols) {
    OwnedPlane<float> elevation_in(rows, cols);
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) elevation_in.at(r, c) = range_in.at(r, c) > 0 ? -0.25f * float(r) : 0.0f;
    ref::fill_gaps(test::paper_params().fill_gaps, range_in, elevation_in, range, elevation);
  }
  int32_t rows, cols;
  OwnedPlane<float> range, elevation;
};

using Row = std::vector<float>;

TEST_CASE("fill_gaps: an empty pixel gets the mean of the pixels directly above and below") {
  // 10    20        10    20
  //  .    20   ->   10.25 20
  // 10.5  21        10.5  21
  Filled f({{10.0f, 20.0f}, {0.0f, 20.0f}, {10.5f, 21.0f}});
  CHECK(f.range.row(0) == Row{10.0f, 20.0f});
  CHECK(f.range.row(1) == Row{10.25f, 20.0f});
  CHECK(f.range.row(2) == Row{10.5f, 21.0f});
  CHECK(f.elevation.row(1) == Row{-0.25f, -0.25f});
}

TEST_CASE("fill_gaps: without both neighbours a pixel stays empty") {
  //  .   .  10
  // 10   .   .
  //  .  10   .
  //  .   .  10
  Filled f({{0.0f, 0.0f, 10.0f}, {10.0f, 0.0f, 0.0f}, {0.0f, 10.0f, 0.0f}, {0.0f, 0.0f, 10.0f}});
  CHECK(f.range.row(0) == Row{0.0f, 0.0f, 10.0f});
  CHECK(f.range.row(1) == Row{10.0f, 0.0f, 0.0f});
  CHECK(f.range.row(2) == Row{0.0f, 10.0f, 0.0f});
  CHECK(f.range.row(3) == Row{0.0f, 0.0f, 10.0f});
}

TEST_CASE("fill_gaps: near the sensor, a missing neighbour is not a return at range 0") {
  Filled f({{0.5f, 0.0f}, {0.0f, 0.0f}, {0.0f, 0.5f}});
  CHECK(f.range.row(1) == Row{0.0f, 0.0f});
}

TEST_CASE("fill_gaps: reads the original image, so a filled pixel never fills another") {
  // 10 . 10 . 10 down one column: both gaps filled; 10 . . 10: none, in any order
  Filled f({{10.0f, 10.0f}, {0.0f, 0.0f}, {10.0f, 0.0f}, {0.0f, 10.0f}, {10.0f, 10.0f}});
  CHECK(f.range.row(1) == Row{10.0f, 0.0f});
  CHECK(f.range.row(2) == Row{10.0f, 0.0f});
  CHECK(f.range.row(3) == Row{10.0f, 10.0f});
}

TEST_CASE("fill_gaps: makes no phantom between car and wall: limit max(1 m, 3 % of the nearer range)") {
  //           nearer 10: limit 1 m             nearer 100: limit 3 m
  Filled f({{10.0f, 10.0f, 11.0f, 10.0f, 100.0f, 100.0f, 103.0f},
            {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f},
            {10.75f, 11.0f, 10.0f, 30.0f, 102.75f, 103.0f, 100.0f}});
  CHECK(f.range.row(1) == Row{10.375f, 0.0f, 0.0f, 0.0f, 101.375f, 0.0f, 0.0f});
  CHECK(f.elevation.row(1) == Row{-0.25f, 0.0f, 0.0f, 0.0f, -0.25f, 0.0f, 0.0f});
}

TEST_CASE("fill_gaps: copies an image of one row and of one pixel") {
  CHECK(Filled({{0.0f, 5.0f, 0.0f}}).range.row(0) == Row{0.0f, 5.0f, 0.0f});
  CHECK(Filled({{0.0f}}).range.row(0) == Row{0.0f});
}

}  // namespace
}  // namespace overtake
