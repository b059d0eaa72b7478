// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// CarProfile: the centre of a race car by the heights of the parts that are seen.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/car_profile.h"

namespace {

using namespace overtake;

struct Part {
  float along_m, height_m;  // from the centre
};
constexpr Part kRearWing = {-2.38f, 0.66f}, kRearTyre = {-1.83f, 0.30f}, kAirBox = {-0.55f, 0.92f};
constexpr Part kNose = {2.17f, 0.20f}, kFrontTyre = {1.57f, 0.38f}, kCockpit = {0.72f, 0.62f};
constexpr Part kTopFromAhead = {-0.38f, 0.92f};

struct Seen {
  std::vector<Part> points;  // from the sensor
  float low_m = 1e9f, high_m = -1e9f;
  void add(float center_m, const Part& part, int32_t times = 3) {
    for (int32_t k = 0; k < times; ++k) {
      const float at_m = center_m + part.along_m + 0.01f * float(k);
      points.push_back({at_m, part.height_m});
      low_m = std::min(low_m, at_m);
      high_m = std::max(high_m, at_m);
    }
  }
  CarProfile::Match match(const CarProfile& profile, float independent = 3, float road_sigma_m = 0) const {
    PointsAlong kept;
    for (std::size_t i = 0; i < points.size(); ++i) kept.add(int32_t(i), points[i].along_m, points[i].height_m);
    return profile.match(kept, low_m, high_m, independent, road_sigma_m);
  }
};
Seen see(float center_m, const std::vector<Part>& parts) {
  Seen seen;
  for (const Part& part : parts) seen.add(center_m, part);
  return seen;
}

const CarProfile kRear(CarProfile::End::kRear), kFront(CarProfile::End::kFront);

TEST_CASE("car profile: any two parts that a car shows give its centre, near and far") {
  const auto check = [](const CarProfile& profile, const std::vector<Part>& parts) {
    for (const float center_m : {-110.0f, -63.21f, 12.0f, 97.37f}) {
      const CarProfile::Match match = see(center_m, parts).match(profile);
      CAPTURE(center_m);
      CHECK(match.fits);
      CHECK(std::fabs(match.center_m - center_m) < 0.15f);
      CHECK(match.sigma_m < 0.6f);
    }
  };
  check(kRear, {kRearWing, kRearTyre});
  check(kRear, {kRearWing, kAirBox});
  check(kRear, {kRearTyre, kAirBox});
  check(kFront, {kNose, kFrontTyre});
  check(kFront, {kNose, kTopFromAhead});
  check(kFront, {kFrontTyre, kCockpit});
}

// In three recorded scans 49 m ahead: the wing, then the tyres 0.48 m before it (simulated: 0.61 m), and the air box.
TEST_CASE("car profile: a recorded rear, whose end is the end of the car") {
  constexpr float kEnd_m = 46.57f;
  Seen seen;
  for (const Part& part : {Part{0.0f, 0.59f},
                           {0.0f, 0.47f},
                           {0.49f, 0.30f},
                           {0.46f, 0.27f},
                           {0.35f, 0.11f},
                           {1.88f, 1.07f},
                           {1.90f, 0.85f}})
    seen.add(kEnd_m, part);
  const CarProfile::Match match = seen.match(kRear, 6, 0.04f);
  CHECK(match.fits);
  CHECK(std::fabs(match.center_m - (kEnd_m + 0.5f * CarProfile::kLength_m)) < 0.04f);
}

TEST_CASE("car profile: one part alone is told by its height, with more doubt") {
  const CarProfile::Match nose = see(-80, {kNose}).match(kFront), top = see(-80, {kTopFromAhead}).match(kFront);
  CHECK(std::fabs(nose.center_m + 80) < 0.3f);
  CHECK(std::fabs(top.center_m + 80) < 0.4f);
  CHECK(nose.sigma_m > see(-80, {kNose, kFrontTyre}).match(kFront).sigma_m);
  const CarProfile::Match tyre = see(90, {kRearTyre}).match(kRear);
  CHECK(std::fabs(tyre.center_m - 90) < 0.5f);
  CHECK(tyre.sigma_m > 0.2f);
}

TEST_CASE("car profile: an error of the road's height, which all points share, is allowed for") {
  Seen low = see(-95, {kNose, kFrontTyre, kCockpit, kTopFromAhead});
  for (Part& point : low.points) point.height_m -= 0.2f;
  const CarProfile::Match trusting = low.match(kFront, 6), doubting = low.match(kFront, 6, 0.1f);
  CHECK(std::fabs(doubting.center_m + 95) < 0.1f);
  CHECK(std::fabs(trusting.center_m + 95) > 0.15f);
  // One part alone tells less where the heights are less certain.
  CHECK(see(90, {kRearWing}).match(kRear, 3, 0.1f).sigma_m > 1.1f * see(90, {kRearWing}).match(kRear).sigma_m);
}

TEST_CASE("car profile: of many points only `independent` count") {
  Seen seen;
  seen.add(50, kRearTyre, 40);
  CHECK(seen.match(kRear, 3).sigma_m > seen.match(kRear, 40).sigma_m);
  CHECK(seen.match(kRear, 40).sigma_m == seen.match(kRear, 1000).sigma_m);
}

TEST_CASE("car profile: what looks like no part of the car does not fit") {
  CHECK(!see(50, {{0, 1.15f}, {1, 1.2f}}).match(kRear).fits);
  CHECK(!see(50, {{-2.4f, 1.19f}, {2.4f, 1.19f}}).match(kFront).fits);
  CHECK(!kRear.match({}, 0, 0, 3, 0).fits);
}

TEST_CASE("car profile: a box that is longer than the car has its middle, and all heights are in the table") {
  const CarProfile::Match match =
      see(20, {{-2.6f, 0.3f}, {2.59f, 0.3f}, {-1.8f, 0.3f}, {-1.8f, 0.3f}, {1.22f, 0.32f}}).match(kRear);
  CHECK(match.fits);
  CHECK(std::fabs(match.center_m - 20.0f) < 0.05f);
  CHECK(match.sigma_m == 0.0f);
  for (const float height_m : {-1e9f, -0.3f, 0.0f, 5.0f, 1e9f}) {
    Seen seen = see(20, {kRearTyre, kRearWing});
    seen.points[0].height_m = height_m;
    const CarProfile::Match odd = seen.match(kRear);
    CHECK(std::isfinite(odd.center_m));
  }
}

TEST_CASE("car profile: the order of the points changes no byte") {
  Seen seen = see(70, {kRearWing, kRearTyre, kAirBox});
  const CarProfile::Match before = seen.match(kRear);
  std::reverse(seen.points.begin(), seen.points.end());
  const CarProfile::Match after = seen.match(kRear);
  CHECK(before.center_m == after.center_m);
  CHECK(before.sigma_m == after.sigma_m);
}

TEST_CASE(
    "points along a heading: of many, the same half or more of the capacity in any order, of all rows and columns") {
  constexpr int32_t kColumns = 1024, kWide = 30, kHigh = 20;
  const auto kept_of = [](bool backwards) {
    PointsAlong points;
    for (int32_t i = 0; i < kWide * kHigh; ++i) {
      const int32_t k = backwards ? kWide * kHigh - 1 - i : i;
      points.add(k / kWide * kColumns + k % kWide, float(k % kWide), float(k / kWide));
    }
    std::vector<std::pair<float, float>> kept;
    for (int32_t i = 0; i < points.count(); ++i) kept.emplace_back(points.along_m(i), points.height_m(i));
    std::sort(kept.begin(), kept.end());
    return kept;
  };
  const auto kept = kept_of(false);
  CHECK(int32_t(kept.size()) <= PointsAlong::kCapacity);
  CHECK(int32_t(kept.size()) >= PointsAlong::kCapacity / 3);
  CHECK(kept == kept_of(true));
  int32_t left = 0, low = 0;
  for (const auto& [along_m, height_m] : kept) {
    left += along_m < 0.5f * kWide;
    low += height_m < 0.5f * kHigh;
  }
  const int32_t third = int32_t(kept.size()) / 3;
  CHECK(left >= third);
  CHECK(left <= 2 * third + 1);
  CHECK(low >= third);
  CHECK(low <= 2 * third + 1);
}

TEST_CASE("points along a heading: more returns of one pixel than the capacity are none, and harm nothing") {
  PointsAlong points;
  for (int32_t i = 0; i < 200; ++i) points.add(i < 100 ? 0 : 7, float(i), 0.5f);
  CHECK(points.count() <= PointsAlong::kCapacity);
  points.add(1 << 30, 1.0f, 0.5f);
}

}  // namespace
