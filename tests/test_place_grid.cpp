// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "core/arena.h"
#include "pipeline/track/place_grid.h"

namespace {

using namespace overtake;

constexpr int32_t kSlots = 200;

struct GridBench {
  Arena arena;
  PlaceGrid grid;
  explicit GridBench(double near_m) {
    arena.build_or_throw(default_allocator(), [&](Carver& carver) { grid.carve(carver, kSlots, near_m); });
    grid.clear();
  }
  std::vector<int32_t> near(Place place) const {
    std::vector<int32_t> slots;
    grid.for_each_near(place, [&](int32_t slot) { slots.push_back(slot); });
    std::sort(slots.begin(), slots.end());
    return slots;
  }
};

}  // namespace

TEST_CASE("place grid: whatever is near a place is listed once, wherever that is") {
  constexpr double kNear_m = 5.0;
  std::mt19937 random(3);
  const auto draw = [&random](double low, double high) {
    return low + (high - low) * double(random() % 65536) / 65536;
  };
  for (const Place centre : {Place{0, 0}, Place{1000, -3000}, Place{-1e8, 1e8}, Place{-7e11, -1e12}}) {
    GridBench bench(kNear_m);
    std::vector<Place> places;
    for (int32_t slot = 0; slot < kSlots; ++slot) {
      places.push_back({centre.x_m + draw(-40, 40), centre.y_m + draw(-40, 40)});
      bench.grid.add(slot, places.back());
    }
    std::size_t near_count = 0, listed_count = 0;
    for (const Place place : places) {
      const std::vector<int32_t> listed = bench.near(place);
      CHECK(std::adjacent_find(listed.begin(), listed.end()) == listed.end());
      listed_count += listed.size();
      for (int32_t slot = 0; slot < kSlots; ++slot) {
        if (distance_m2(place, places[std::size_t(slot)]) > kNear_m * kNear_m) continue;
        CHECK(std::binary_search(listed.begin(), listed.end(), slot));
        ++near_count;
      }
    }
    CHECK(near_count > 400);
    CHECK(listed_count < kSlots * kSlots / 8);  // four cells of 10 m x 10 m, of 80 m x 80 m
  }
}

TEST_CASE("place grid: a list holds cells that are 32 apart, and none after it is cleared") {
  GridBench bench(5.0);
  bench.grid.add(7, {1, 1});
  bench.grid.add(9, {1 + 32 * 10 / 0.99, 1});
  CHECK(bench.near({1, 1}) == std::vector<int32_t>{7, 9});
  CHECK(bench.near({1 + 16 * 10, 1}).empty());
  bench.grid.clear();
  CHECK(bench.near({1, 1}).empty());
}
