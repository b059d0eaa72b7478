// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal by height.
#include "kernels/keep_above_road.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/images.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::OwnedBits;
using test::OwnedPlane;

// Pixels at given heights above the road, 20 m from a sensor that is 1 m above it; NaN: no return.
struct Kept {
  explicit Kept(std::initializer_list<std::initializer_list<float>> heights_m)
      : range(heights_m),
        elevation(heights_m),
        range_out(int32_t(heights_m.size()), int32_t(heights_m.begin()->size())),
        elevation_out(range_out),
        above(int32_t(heights_m.size()), int32_t(heights_m.begin()->size())) {
    for (int32_t r = 0; r < range.view().rows; ++r)
      for (int32_t c = 0; c < range.view().cols; ++c) {
        const float height_m = range.at(r, c);
        const bool hit = height_m == height_m;
        range.at(r, c) = hit ? 20.0f : 0.0f;
        elevation.at(r, c) = hit ? std::asin((height_m - 1.0f) / 20.0f) : 0.1f;
      }
    ref::keep_above_road(make_transform(0, 0, 1.0, 0, 0, 0.5), range, elevation, range_out, elevation_out, above);
    CHECK(test::tail_is_clear(above));
  }
  OwnedPlane<float> range, elevation, range_out, elevation_out;
  OwnedBits above;
};

TEST_CASE("keep_above_road: pixels above the road's height limit stay; neighbours do not matter") {
  Kept kept({{0.31f, 0.29f, 2.5f},  //
             {0.0f, 1.0f, -0.4f}});
  CHECK(art_of(kept.above) == drawn({"#.#",  //
                                     ".#."}));
}

TEST_CASE("keep_above_road: kept pixels keep their range and elevation, all others are zero in both") {
  Kept kept({{1.5f, 0.1f}});
  CHECK(kept.range_out.at(0, 0) == 20.0f);
  CHECK(kept.elevation_out.at(0, 0) == kept.elevation.at(0, 0));
  CHECK(kept.range_out.at(0, 1) == 0.0f);
  CHECK(kept.elevation_out.at(0, 1) == 0.0f);
}

TEST_CASE("keep_above_road: a pixel without a return is not kept, whatever its elevation says") {
  Kept kept({{NAN, 2.0f}});
  CHECK(art_of(kept.above) == drawn({".#"}));
  CHECK(kept.elevation_out.at(0, 0) == 0.0f);
}

}  // namespace
}  // namespace overtake
