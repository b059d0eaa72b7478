// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Cuts links at the top of an object.
#include "kernels/cut_steps.h"

#include <doctest/doctest.h>

#include "tests/support/images.h"

namespace overtake {
namespace {

using test::OwnedBits;
using test::OwnedPlane;

// Whether the upper of three pixels in a column, which is linked to the second one, stays linked. bound_m: where the
// column's ray passes a bound; 0: nowhere.
bool stays(float upper_m, float lower_m, float under_m, float bound_m = 0.0f) {
  OwnedPlane<float> range = {{upper_m}, {lower_m}, {under_m}};
  OwnedBits down = {"#", under_m > 0.0f ? "#" : ".", "."};
  const float per_m = bound_m > 0.0f ? 1.0f / bound_m : 0.0f, bound_per_m[2] = {per_m, per_m};
  ref::cut_steps(range, range, bound_per_m, down);
  if (bound_m == 0.0f) CHECK(down.view().test(1, 0) == (under_m > 0.0f));  // nothing is known below the last row
  return down.view().test(0, 0);
}

TEST_CASE("cut_steps: what stands behind the top of an upright object is another one") {
  CHECK_FALSE(stays(15.0f, 10.0f, 9.8f));  // a house behind a car
  CHECK_FALSE(stays(15.0f, 10.0f, 12.4f));
  CHECK(stays(10.0f, 15.0f, 15.0f));  // what hangs over is not cut
}

TEST_CASE("cut_steps: a small step stays: 1.5 m, and 0.12 of the range") {
  CHECK(stays(11.4f, 10.0f, 10.0f));
  CHECK_FALSE(stays(11.6f, 10.0f, 10.0f));
  CHECK(stays(55.9f, 50.0f, 50.0f));
  CHECK_FALSE(stays(56.1f, 50.0f, 50.0f));
}

TEST_CASE("cut_steps: rows of a flat surface stay linked, and so does what has no pixel below") {
  CHECK(stays(70.0f, 60.0f, 52.0f));
  CHECK(stays(15.0f, 10.0f, 7.0f));
  CHECK(stays(15.0f, 10.0f, 0.0f));
}

TEST_CASE("cut_steps: a car on the circuit is not linked to the wall beside it, whatever is below") {
  CHECK_FALSE(stays(75.0f, 62.0f, 55.0f, 68.0f));  // one row hits the car, the next one the road before it
  CHECK_FALSE(stays(112.0f, 95.0f, 0.0f, 105.0f));
  CHECK(stays(112.0f, 95.0f, 0.0f, 94.0f));   // both outside
  CHECK(stays(112.0f, 95.0f, 0.0f, 113.0f));  // both inside
  CHECK(stays(112.0f, 95.0f, 0.0f));          // no bound is known
  CHECK(stays(70.0f, 66.0f, 0.0f, 68.0f));    // a small step: the foot of the wall itself
  CHECK(stays(95.0f, 112.0f, 0.0f, 105.0f));  // what hangs over
}

TEST_CASE("cut_steps: also above the last row, and the bound between two rays is a straight line") {
  OwnedPlane<float> range(2, 2 * kRayColumns);
  OwnedBits down(2, 2 * kRayColumns);
  for (int32_t c = 0; c < 2 * kRayColumns; ++c) {
    range.view().row(0)[c] = 100.0f, range.view().row(1)[c] = 50.0f;
    down.view().set(0, c);
  }
  const float bound_per_m[3] = {0.0f, 1.0f / 50.0f, 1.0f / 25.0f};  // 1 / 100 m in the middle between the first two
  ref::cut_steps(range, range, bound_per_m, down);
  for (int32_t c = 0; c < 2 * kRayColumns; ++c)
    CHECK(down.view().test(0, c) == (c < kRayColumns / 2 || c >= kRayColumns));
}

}  // namespace
}  // namespace overtake
