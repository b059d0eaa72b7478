// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// anchor_car: where the centre of a car is, by the side that is seen.
#include <doctest/doctest.h>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

constexpr float kLength = 4.921f, kWidth = 1.886f;
constexpr CarSize kSize = {kLength, kWidth, 4.2f};

TEST_CASE("anchor_car: along the heading, the end that the sensor sees, or the middle") {
  const auto center = [](float low, float high, float sensor) {
    return anchor_car(kSize, {low, high, -0.5f, 0.5f}, sensor, 0).center_1;
  };
  CHECK(center(20, 25, 0) == 22.5f);                                       // both ends
  CHECK(center(20, 21, 0) == doctest::Approx(20 + 0.5f * kLength));        // rear
  CHECK(center(-21, -20, 0) == doctest::Approx(-20.5f));                   // front, the nose not seen
  CHECK(center(-24.3f, -20, 0) == doctest::Approx(-20 - 0.5f * kLength));  // front with its nose
  CHECK(center(-24.1f, -20, 0) == doctest::Approx(-22.05f));
  CHECK(anchor_car(kSize, {20, 21, 0, 1}, 0, 0).view == CarView::kRear);
  CHECK(anchor_car(kSize, {-21, -20, 0, 1}, 0, 0).view == CarView::kFront);
  CHECK(anchor_car(kSize, {-1, 2, 3, 4}, 0, 0).view == CarView::kSide);
  CHECK(anchor_car(kSize, {20, 25, 0, 1}, 0, 0).unseen_1 == 0.0f);
  CHECK(anchor_car(kSize, {20, 21, 0, 1}, 0, 0).unseen_1 == 0.0f);  // the rear end is known
  CHECK(anchor_car(kSize, {-21, -20, 0, 1}, 0, 0).unseen_1 == doctest::Approx(kLength - 1));
}

TEST_CASE("anchor_car: across the heading, the middle of what is seen; beside the car, from the near flank") {
  const auto center = [](OrientedBox seen) { return anchor_car(kSize, seen, 0, 0).center_2; };
  CHECK(center({20, 21, 2, 3}) == 2.5f);
  CHECK(center({20, 25, 2, 3}) == 2.5f);
  CHECK(center({-2, 2, 3, 3.5f}) == doctest::Approx(3 + 0.5f * kWidth));
  CHECK(center({-2, 2, -3.5f, -3}) == doctest::Approx(-3 - 0.5f * kWidth));
  CHECK(center({-2, 2, 3, 5}) == 4.0f);      // all of its width
  CHECK(center({-1, 1, 3, 3.5f}) == 3.25f);  // too little of the flank
}

TEST_CASE("anchor_car: less than a length beside its ends the near flank is seen, too") {
  const auto center = [](OrientedBox seen) { return anchor_car(kSize, seen, 0, 0).center_2; };
  CHECK(center({2.4f, 7.3f, 3, 4.4f}) == doctest::Approx(3 + 0.5f * kWidth));    // ahead of the sensor
  CHECK(center({-7.3f, -2.4f, 3, 4.4f}) == doctest::Approx(3 + 0.5f * kWidth));  // behind it
  CHECK(center({2.4f, 7.3f, -4.4f, -3}) == doctest::Approx(-3 - 0.5f * kWidth));
  CHECK(center({2.6f, 7.5f, 3, 4.4f}) == 3.7f);         // farther
  CHECK(center({2.4f, 7.3f, -0.5f, 0.75f}) == 0.125f);  // straight ahead no flank is seen
  CHECK(center({2.4f, 5.3f, 3, 4.4f}) == 3.7f);         // too little of the flank
  CHECK(center({2.4f, 7.3f, 3, 5}) == 4.0f);            // all of its width
}

TEST_CASE("anchor_car: an end that is cut off is not the car's; the other one is, if it is seen") {
  const auto center = [](OrientedBox seen, float sensor_2, CutEnds cut) {
    return anchor_car(kSize, seen, 0, sensor_2, cut);
  };
  constexpr CutEnds kLow = {.low_1 = true}, kHigh = {.high_1 = true}, kBoth = {.low_1 = true, .high_1 = true};
  // From behind and beside: the rear end is cut off, the flank shows the front one.
  CHECK(center({2, 4, 3, 4}, 0, kLow).center_1 == doctest::Approx(4 - 0.5f * kLength));
  CHECK(center({2, 4, 3, 4}, 0, kLow).unseen_1 == doctest::Approx(0.3f * (kLength - 2)));
  CHECK(center({2, 4, 3, 4}, 0, kLow).center_2 == doctest::Approx(3 + 0.5f * kWidth));
  CHECK(center({-4, -2, 3, 4}, 0, kHigh).center_1 == doctest::Approx(-4 + 0.5f * kLength));  // from ahead
  CHECK(center({4, 6, 3, 4}, 0, kHigh).center_1 == doctest::Approx(4 + 0.5f * kLength));     // the near end is seen
  CHECK(center({4, 6, 3, 4}, 0, kHigh).unseen_1 == 0.0f);
  // Straight behind no flank is seen, and of an end on both sides nothing is known.
  CHECK(center({20, 22, -0.5f, 0.5f}, 0, kLow).center_1 == 21.0f);
  CHECK(center({20, 22, -0.5f, 0.5f}, 0, kLow).knows_no_end);
  CHECK(center({-22, -20, -0.5f, 0.5f}, 0, kHigh).knows_no_end);
  CHECK(center({2, 4, 3, 4}, 0, kBoth).center_1 == 3.0f);
  CHECK(center({2, 4, 3, 4}, 0, kBoth).knows_no_end);
  CHECK_FALSE(center({2, 4, 3, 4}, 0, {}).knows_no_end);
  // A side that is cut off.
  CHECK(center({20, 21, -0.2f, 1}, 0, {.low_2 = true}).center_2 == doctest::Approx(1 - 0.5f * kWidth));
  CHECK(center({20, 21, -1, 0.2f}, 0, {.high_2 = true}).center_2 == doctest::Approx(-1 + 0.5f * kWidth));
  CHECK(center({20, 21, -1, 0.2f}, 0, {.high_2 = true}).unseen_2 == doctest::Approx(0.3f * (kWidth - 1.2f)));
  CHECK(center({20, 21, -1, -0.2f}, 0, {.high_2 = true}).center_2 == doctest::Approx(-0.6f));  // too little of it
  CHECK(center({20, 21, -1, 0.2f}, 0, {.low_2 = true, .high_2 = true}).center_2 == doctest::Approx(-0.4f));
}

}  // namespace
