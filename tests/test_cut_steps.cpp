// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Cuts links at the top of an object.
#include "kernels/cut_steps.h"

#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "kernels/kernel_table.h"
#include "tests/support/images.h"

namespace overtake {
namespace {

using test::OwnedBits;
using test::OwnedPlane;

// Whether the upper of three pixels in a column, which is linked to the second one, stays linked. bound_m: where the
// column's ray passes a bound, last_bound_m: where it does so for the last time; 0: nowhere, and no second time.
bool stays(float upper_m, float lower_m, float under_m, float bound_m = 0.0f, float last_bound_m = 0.0f) {
  OwnedPlane<float> range = {{upper_m}, {lower_m}, {under_m}};
  OwnedBits down = {"#", under_m > 0.0f ? "#" : ".", "."};
  const float per_m = bound_m > 0.0f ? 1.0f / bound_m : 0.0f, bound_per_m[2] = {per_m, per_m};
  const float last_per_m = last_bound_m > 0.0f ? 1.0f / last_bound_m : per_m;
  const float last_bound_per_m[2] = {last_per_m, last_per_m};
  ref::cut_steps(range, range, bound_per_m, last_bound_per_m, down);
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
  CHECK(stays(112.0f, 95.0f, 0.0f, 91.0f));   // both outside
  CHECK(stays(112.0f, 95.0f, 0.0f, 116.0f));  // both inside
  CHECK(stays(112.0f, 95.0f, 0.0f));          // no bound is known
  CHECK(stays(70.0f, 66.0f, 0.0f, 68.0f));    // a small step: the foot of the wall itself
  CHECK(stays(95.0f, 112.0f, 0.0f, 105.0f));  // what hangs over
}

TEST_CASE("cut_steps: a bound may err by 0.03 of its distance") {
  CHECK_FALSE(stays(108.1f, 90.7f, 0.0f, 108.3f));  // the wall stands at the bound
  CHECK_FALSE(stays(112.0f, 95.0f, 0.0f, 115.3f));
  CHECK(stays(112.0f, 95.0f, 0.0f, 115.6f));
  CHECK_FALSE(stays(112.0f, 95.0f, 0.0f, 92.4f));  // the car drives along it
  CHECK(stays(112.0f, 95.0f, 0.0f, 92.1f));
}

TEST_CASE("cut_steps: across a bound, a step of 0.08 of the range is large") {
  CHECK_FALSE(stays(104.0f, 95.0f, 0.0f, 100.0f));
  CHECK(stays(102.0f, 95.0f, 0.0f, 100.0f));
  CHECK(stays(104.0f, 95.0f, 94.8f));  // but not elsewhere
}

TEST_CASE("cut_steps: across a bend, a ray leaves the circuit twice") {
  CHECK_FALSE(stays(138.6f, 124.9f, 0.0f, 52.0f, 130.0f));  // the car is on the circuit again
  CHECK_FALSE(stays(58.0f, 45.0f, 0.0f, 52.0f, 130.0f));
  CHECK(stays(100.0f, 80.0f, 0.0f, 52.0f, 130.0f));  // both inside of the bend
}

TEST_CASE("cut_steps: also above the last row, and the bound between two rays is a straight line") {
  OwnedPlane<float> range(2, 2 * kRayColumns);
  OwnedBits down(2, 2 * kRayColumns);
  for (int32_t c = 0; c < 2 * kRayColumns; ++c) {
    range.view().row(0)[c] = 100.0f, range.view().row(1)[c] = 50.0f;
    down.view().set(0, c);
  }
  const float bound_per_m[3] = {0.0f, 1.0f / 50.0f, 1.0f / 25.0f};  // 1 / 100 m in the middle between the first two
  ref::cut_steps(range, range, bound_per_m, bound_per_m, down);
  for (int32_t c = 0; c < 2 * kRayColumns; ++c)
    CHECK(down.view().test(0, c) == (c < kRayColumns / 2 || c >= kRayColumns));
}

TEST_CASE("cut_steps: every ISA cuts what the reference cuts, on rows of random ranges and bounds") {
  constexpr int32_t kRows = 9, kCols = 150;  // test_agreement has few steps across a bound
  std::mt19937 random(1);
  const auto uniform = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
  int32_t cuts = 0, links = 0;
  for (int32_t round = 0; round < 20; ++round) {
    OwnedPlane<float> filled(kRows, kCols), repaired(kRows, kCols);
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        repaired.view().row(r)[c] = uniform(10, 100);
        filled.view().row(r)[c] = uniform(0, 1) < 0.5f ? 0.0f : repaired.view().row(r)[c] + uniform(-9, 9);
      }
    std::vector<float> bound_per_m(std::size_t(count_rays(kCols)));
    for (float& per_m : bound_per_m) per_m = uniform(0, 1) < 0.3f ? 0.0f : 1.0f / uniform(10, 100);
    std::vector<float> last_bound_per_m = bound_per_m;
    for (float& per_m : last_bound_per_m) per_m = uniform(0, 1) < 0.5f ? per_m : 1.0f / uniform(10, 100);
    const auto link_all = [](OwnedBits& bits) {  // no pixel beyond the last column has a link
      bits.clear();
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < kCols; ++c) bits.view().set(r, c);
    };
    OwnedBits expected(kRows, kCols);
    link_all(expected);
    ref::cut_steps(filled, repaired, bound_per_m.data(), last_bound_per_m.data(), expected);
    for (const char* isa : {"sse2", "avx2", "avx512", "neon64"}) {
      const KernelTable* kernels = find_kernels(isa);
      if (!kernels) continue;
      OwnedBits found(kRows, kCols);
      link_all(found);
      kernels->cut_steps(filled, repaired, bound_per_m.data(), last_bound_per_m.data(), found);
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < kCols; ++c) {
          CHECK(found.view().test(r, c) == expected.view().test(r, c));
          cuts += !expected.view().test(r, c), ++links;
        }
    }
  }
  CHECK(20 * cuts > links);
}

}  // namespace
}  // namespace overtake
