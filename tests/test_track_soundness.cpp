// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Any frames and rows: what a tracker publishes is sound, every row is counted, its tables keep to their capacities,
// and its memory comes from the allocator.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <new>
#include <random>

#include "tests/support/circle_road.h"
#include "tests/support/heap_calls.h"
#include "tests/support/track_frames.h"

namespace {

using namespace overtake;
using overtake::test::adds_up;
using overtake::test::CircleRoad;
using overtake::test::is_finite;
using overtake::test::is_positive_definite;
using overtake::test::is_sound;
using overtake::test::kNan;
using overtake::test::make_clutter;
using overtake::test::TestDetection;
using overtake::test::to_ns;
using overtake::test::TrackerBench;
using overtake::test::uniform;

bool adds_up(TrackerBench& bench) { return adds_up(bench.tracker.counts(), bench.track_count()); }

}  // namespace

TEST_CASE("track soundness: all memory comes from the allocator; each refusal is bad_alloc and leaks no block") {
  struct Heap {
    int32_t live = 0, calls = 0, refused = -1;
  } heap;
  Allocator allocator;
  allocator.user = &heap;
  allocator.allocate = [](size_t bytes, size_t alignment, void* user) -> void* {
    Heap& h = *static_cast<Heap*>(user);
    if (h.calls++ == h.refused) return nullptr;
    ++h.live;
    return std::aligned_alloc(alignment, bytes);
  };
  allocator.release = [](void* block, size_t, void* user) {
    --static_cast<Heap*>(user)->live;
    std::free(block);
  };
  MakeTracker* const make = find_method(test::test_method())->make_tracker;
  int32_t needed = 0;
  {
    const int64_t before = overtake::test::count_heap_calls();
    const auto tracker = make(TrackerParams{}, nullptr, allocator);
    needed = heap.calls;
    if (overtake::test::can_count_heap_calls()) CHECK(overtake::test::count_heap_calls() - before == needed + 1);
    CHECK(heap.live == needed);
  }
  CHECK(heap.live == 0);
  REQUIRE(needed > 0);
  for (int32_t k = 0; k < needed; ++k) {
    heap = {.live = 0, .calls = 0, .refused = k};
    CHECK_THROWS_AS(make(TrackerParams{}, nullptr, allocator), std::bad_alloc);
    CHECK(heap.live == 0);
  }
}

// Duplicates, reordering, jumps, the limits of int64, and the detector's reaction: a restart after three late frames.
namespace {

// A detection of one of 14 cars that stand 15 m apart, along x or along the ring, with any of the columns.
TestDetection draw_detection(std::mt19937_64& random, const CircleRoad* ring) {
  const double s_m = 15.0 * int(random() % 14), along = uniform(random, -1, 1), aside = uniform(random, -1, 1);
  const EgoPose at = ring ? ring->pose_at(s_m + along, aside) : EgoPose{.x_m = s_m + along, .y_m = aside};
  TestDetection d = {at.x_m, at.y_m, uniform(random, -3, 3)};
  if (random() % 20 == 0) d.x_m = uniform(random, -200, 400);
  if (random() % 50 == 0) d.y_m = kNan;
  if (random() % 4 == 0) d.var_x = d.var_y = std::pow(10.0, uniform(random, -3, 3));
  if (random() % 4 == 0) d.cov_xy = uniform(random, -1, 1);
  if (random() % 4 == 0) d.length_m = uniform(random, -1, 9), d.width_m = random() % 4 ? uniform(random, 0, 3) : kNan;
  if (random() % 4 == 0) d.score = uniform(random, -0.2, 1.2), d.height_m = uniform(random, 0, 2);
  if (random() % 2 == 0) {  // as the rules of a method give it, else a pushed row
    d.height_m = uniform(random, 0, 2);
    d.object_class = int32_t(random() % 3), d.view = int32_t(random() % 5) - 1;
    d.points = int32_t(random() % 3 ? random() % 2000 : 0), d.debris = random() % 12 == 0;
    d.faint = random() % 8 == 0;
    d.free_heading = random() % 2 == 0;
  }
  return d;
}

void run_random_stamps(int32_t steps, const CircleRoad* ring) {
  constexpr int64_t kFirst = std::numeric_limits<int64_t>::min(), kLast = std::numeric_limits<int64_t>::max();
  const int64_t edges[] = {kFirst, kFirst + 1, kFirst + to_ns(0.3), -1, 0, 1, kLast - to_ns(0.3), kLast - 1, kLast};
  std::mt19937_64 random(1234);
  TrackerParams p = test::tracker_params_of(test::test_method(), 24, 12);
  p.horizon_s = 0.3;
  TrackerBench bench(p, ring ? &ring->map : nullptr);
  test::IdWatch ids(p);
  int64_t now_ns = 0, rows = 0, jumps = 0;
  int32_t late_in_a_row = 0;
  for (int32_t n = 0; n < steps; ++n) {
    int64_t stamp_ns = now_ns;
    const auto kind = random() % 100;
    if (kind < 60) {
      now_ns = int64_t(uint64_t(now_ns) + random() % 60'000'000);
      stamp_ns = now_ns;
    } else if (kind < 90) {
      stamp_ns = int64_t(uint64_t(now_ns) - random() % 400'000'000);
    } else if (kind < 97) {
      // the same stamp again
    } else if (kind < 98) {
      now_ns = stamp_ns = int64_t(random());
    } else if (kind < 99) {
      const auto edge = random() % (std::size(edges) + 3);  // or minutes ahead
      if (edge < std::size(edges)) now_ns = edges[edge];
      if (edge >= std::size(edges)) now_ns = int64_t(uint64_t(now_ns) + random() % 300'000'000'000), ++jumps;
      stamp_ns = now_ns;
    } else {
      stamp_ns = int64_t(uint64_t(now_ns) + random() % 4'000'000'000 - 2'000'000'000);
    }
    bench.frame.ego = {random() % 2 == 0, 0, 0, 0, 30};
    bench.frame.in_map = random() % 64 != 0;
    bench.frame.ask_map = random() % 16 != 0;
    std::vector<TestDetection> detections(random() % 16);
    for (TestDetection& d : detections) d = draw_detection(random, ring);
    for (const TestDetection& d : detections) rows += !d.faint;
    bench.step_ns(stamp_ns, detections);
    CAPTURE(n);
    const TrackTable& t = bench.snapshot();
    REQUIRE(is_sound(t));
    REQUIRE(ids.accepts(t, bench.last));
    for (const TrackId id : bench.ids) REQUIRE((id == kNobody || slot_of(id) < uint32_t(p.track_capacity)));
    late_in_a_row = bench.last.late ? late_in_a_row + 1 : 0;
    if (late_in_a_row == 3) {
      bench.tracker.restart();
      ids.restart();
      late_in_a_row = 0;
    }
    const TrackerCounts c = bench.tracker.counts();
    REQUIRE(c.measurements == rows);
    REQUIRE(adds_up(bench));
    if (n % 16 == 0) {
      const TrackTable& published = bench.tracks_at_ns(edges[random() % std::size(edges)]);
      REQUIRE(is_finite(published));
      REQUIRE(is_positive_definite(published));
      REQUIRE(is_finite(bench.paths()));
      REQUIRE(is_sound(bench.optional()));
      const TrackTable& predicted = bench.predicted_to_ns(int64_t(random()));
      REQUIRE(is_finite(predicted));
      REQUIRE(is_positive_definite(predicted));
    }
  }
  CHECK(jumps > steps / 1000);
  CHECK(int64_t(ids.ids()) > steps / 10);
  const TrackerCounts c = bench.tracker.counts();
  for (const int64_t count :
       {c.births, c.deaths, c.hits, c.misses, c.overflow(), c.unborn, c.rejected, c.debris, c.late, c.replays})
    CHECK(count > steps / 1000);
  CHECK((c.joined > steps / 1000) == test::tests_best());
}

void run_random_stamps(int32_t steps) {
  run_random_stamps(steps, nullptr);
  const CircleRoad ring({.radius_m = 120.0});
  run_random_stamps(steps / 4, &ring);
}

}  // namespace

TEST_CASE("track soundness: 25,000 frames with random stamps: every row counted, every state sound, no id used twice") {
  run_random_stamps(20'000);
}

TEST_SUITE("long") {
  TEST_CASE("track soundness: a million frames with random stamps: every row counted, every state sound") {
    run_random_stamps(1'000'000);
  }
}

TEST_CASE("track soundness: tables of any capacity keep to it under more rows than they have room for") {
  // Every block lies between guard bytes.
  constexpr std::size_t kFence = 128;
  struct Heap {
    std::map<void*, std::size_t> blocks;
    bool whole = true;
  } heap;
  Allocator allocator;
  allocator.user = &heap;
  allocator.allocate = [](size_t bytes, size_t alignment, void* user) -> void* {
    REQUIRE(kFence % alignment == 0);
    auto* const base = static_cast<unsigned char*>(std::aligned_alloc(kFence, (bytes + 3 * kFence) / kFence * kFence));
    std::fill_n(base, kFence, 0xa5);
    std::fill_n(base + kFence + bytes, kFence, 0xa5);
    static_cast<Heap*>(user)->blocks[base + kFence] = bytes;
    return base + kFence;
  };
  allocator.release = [](void* block, size_t, void* user) {
    Heap& h = *static_cast<Heap*>(user);
    auto* const at = static_cast<unsigned char*>(block);
    for (std::size_t k = 0; k < kFence; ++k)
      h.whole = h.whole && at[-1 - int64_t(k)] == 0xa5 && at[h.blocks.at(block) + k] == 0xa5;
    h.blocks.erase(block);
    std::free(at - kFence);
  };
  const struct {
    int32_t tracks, rows, given;
  } sizes[] = {{1, 1, 40}, {1, 256, 300}, {256, 1, 40}, {256, 256, 300}, {64, 64, 64}, {64, 63, 70}};
  for (const auto& size : sizes)
    for (const bool one_car : {false, true}) {
      CAPTURE(size.tracks);
      CAPTURE(size.rows);
      CAPTURE(one_car);
      TrackerParams p = test::tracker_params_of(test::test_method(), size.tracks, size.rows);
      if (!one_car) p.lane.length_m = p.lane.width_m = 1e-3;  // else all rows are of few cars
      {
        TrackerBench bench(p, nullptr, test::test_method(), allocator);
        test::IdWatch ids(p);
        for (int k = 0; k < 24; ++k) {
          const double time_s = 0.05 * (k % 5 == 4 ? k - 3 : k);  // some frames are late
          bench.step(time_s, make_clutter(size.given, uint64_t(k)));
          REQUIRE(bench.track_count() <= size.tracks);
          REQUIRE(is_sound(bench.snapshot()));
          REQUIRE(ids.accepts(bench.snapshot(), bench.last));
          REQUIRE(adds_up(bench));
          REQUIRE(is_finite(bench.tracks_at(time_s + 0.2)));
          REQUIRE(is_finite(bench.paths()));
        }
        CHECK(bench.tracker.counts().replays == 4);
        if (!one_car && size.given > size.tracks) CHECK(bench.tracker.counts().overflow() > 0);
        if (!one_car && !test::tests_paper()) CHECK(bench.track_count() >= std::min(size.tracks, size.rows));
      }
      CHECK(heap.whole);
      CHECK(heap.blocks.empty());
    }
}

TEST_CASE("track soundness: any set of columns may be NaN: the car is tracked all the same") {
  for (uint32_t missing = 0; missing < 256; ++missing) {
    CAPTURE(missing);
    TrackerBench bench(test::tracker_params_of(test::test_method()));
    TrackId id = kNobody;
    for (int k = 0; k < 12; ++k) {
      bench.frame.ego = {true, 1.5 * k - 30, 0, 0, 30};
      TestDetection d = {1.5 * k, 0, 0, 0, 4.5, 1.8, 0.04, 0.04, 0, 1.0, OVT_CLASS_CAR, 1, 0, 500};
      double* const columns[] = {&d.heading_rad, &d.length_m, &d.width_m, &d.var_x, &d.var_y, &d.cov_xy, &d.height_m};
      for (std::size_t c = 0; c < std::size(columns); ++c)
        if (missing >> c & 1) *columns[c] = kNan;
      if (missing >> 7 & 1) d.object_class = 0, d.view = -1, d.points = 500;
      const TrackId taken = bench.step(0.05 * k, {d})[0];
      if (k == 0) id = taken;
      REQUIRE(taken == id);
      REQUIRE(id != kNobody);
      REQUIRE(is_sound(bench.snapshot()));
    }
    // For `best` a cluster that never looks like a car is none; a row without a height is another detector's.
    const bool looks_like_none = test::tests_best() && (missing >> 6 & 3) == 2;
    CHECK(bench.snapshot().state[0] == (looks_like_none ? OVT_TENTATIVE : OVT_CONFIRMED));
    const bool own = (missing >> 3 & 7) == 0;  // without one of the three, R of the parameters counts
    CHECK(bench.snapshot().speed_mps[0] == doctest::Approx(30).epsilon(own ? 0.05 : 0.2));
    CHECK((bench.snapshot().covariance[0][0] < 0.05) == own);
    CHECK(bench.snapshot().length_m[0] == doctest::Approx(missing >> 1 & 1 ? 0 : 4.5).epsilon(0.2));
  }
  TrackerBench bench(test::tracker_params_of(test::test_method()));
  bench.step(0, {{kNan, 0}, {0, kNan}, {kNan, kNan}});
  CHECK(bench.tracker.counts().rejected == 3);
}
