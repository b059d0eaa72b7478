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

// Whether the upper of three pixels in a column, which is linked to the second one, stays linked.
bool stays(float upper_m, float lower_m, float under_m) {
  OwnedPlane<float> range = {{upper_m}, {lower_m}, {under_m}};
  OwnedBits down = {"#", "#", "."};
  ref::cut_steps(range, range, down);
  CHECK(down.view().test(1, 0));  // nothing is known below the last row
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

}  // namespace
}  // namespace overtake
