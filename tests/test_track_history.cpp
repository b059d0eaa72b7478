// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames out of sequence: the states equal those of sorted order, and every measurement is counted. Any frames: what a
// tracker publishes is sound, and its tables keep to their capacities. Ids: test_track_identity.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <new>
#include <random>
#include <string>

#include "tests/support/circle_road.h"
#include "tests/support/heap_calls.h"
#include "tests/support/track_frames.h"

namespace {

using namespace overtake;
using overtake::test::adds_up;
using overtake::test::CircleRoad;
using overtake::test::delay;
using overtake::test::give;
using overtake::test::is_earlier;
using overtake::test::is_finite;
using overtake::test::is_positive_definite;
using overtake::test::is_sound;
using overtake::test::kNan;
using overtake::test::make_frames;
using overtake::test::make_ring_frames;
using overtake::test::TestDetection;
using overtake::test::TestFrame;
using overtake::test::to_ns;
using overtake::test::TrackerBench;
using overtake::test::uniform;

// All values by slot, except the ids and the values of the last frame given; also the optional columns, if the method
// has them.
uint64_t hash_states(TrackerBench& bench) {
  Hash hash;
  bench.tracks_at_newest();
  if (bench.tracker.writes_optional()) hash.add_value(hash_table(bench.optional(), 0));
  const TrackTable& t = bench.snapshot();
  hash.add_value(t.count);
  for_each_column(const_cast<TrackTable&>(t), [&](const char* name, auto* column) {
    const std::string text = name;
    if (text != "id" && text != "detection" && text != "flags")
      hash.add_bytes(column, std::size_t(t.count) * sizeof(*column));
  });
  return hash.value();
}

bool adds_up(TrackerBench& bench) { return adds_up(bench.tracker.counts(), bench.track_count()); }

void check_same_counts(const TrackerCounts& a, const TrackerCounts& b) {
  CHECK(a.births == b.births);
  CHECK(a.deaths == b.deaths);
  CHECK(a.missed == b.missed);
  CHECK(a.silent == b.silent);
  CHECK(a.displaced == b.displaced);
  CHECK(a.unsound == b.unsound);
  CHECK(a.forgotten == b.forgotten);
  CHECK(a.joined == b.joined);
  CHECK(a.hits == b.hits);
  CHECK(a.misses == b.misses);
  CHECK(a.unborn == b.unborn);
  CHECK(a.rejected == b.rejected);
  CHECK(a.debris == b.debris);
  CHECK(a.measurements == b.measurements);
  CHECK(a.late == b.late);
}

}  // namespace

TEST_CASE("track history: frames in any order within half a second give the states of sorted order, bit by bit") {
  int64_t replays = 0, deaths = 0, overflow = 0;
  for (uint64_t seed = 1; seed <= 24; ++seed) {
    TrackerParams p;
    if (seed % 3 == 0) p.track_capacity = 12, p.detection_capacity = 10;                          // full tables
    if (seed % 3 == 1) p.max_silence_s = 0.3, p.window = 8, p.confirm_hits = 3, p.keep_hits = 2;  // many deletions
    std::vector<TestFrame> frames = make_frames(seed, 10, 3.0, 0.5);
    delay(frames, seed % 2 ? 0.45 : 0.15, seed);
    TrackerBench shuffled(p), sorted(p);
    std::vector<TestFrame> so_far;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      give(shuffled, frames[i]);
      REQUIRE_FALSE(shuffled.last.late);
      so_far.push_back(frames[i]);
      CAPTURE(seed);
      CAPTURE(i);
      if (i % 23 == 22 || i + 1 == frames.size()) {  // also in between
        TrackerBench fresh(p);
        std::stable_sort(so_far.begin(), so_far.end(), is_earlier);
        for (const TestFrame& f : so_far) give(fresh, f);
        REQUIRE(fresh.tracker.counts().replays == 0);
        REQUIRE(shuffled.track_count() == fresh.track_count());
        REQUIRE(hash_states(shuffled) == hash_states(fresh));
        check_same_counts(shuffled.tracker.counts(), fresh.tracker.counts());
        REQUIRE(adds_up(shuffled));
      }
    }
    replays += shuffled.tracker.counts().replays;
    deaths += shuffled.tracker.counts().deaths;
    overflow += shuffled.tracker.counts().overflow();
    CHECK(shuffled.tracker.counts().refiltered >= shuffled.tracker.counts().replays);
  }
  CHECK(replays > 1000);
  CHECK(deaths > 500);
  CHECK(overflow > 500);
}

TEST_CASE("track history: predictions and published copies between the frames have no effect") {
  std::vector<TestFrame> frames = make_frames(77, 8, 3.0, 0.4);
  delay(frames, 0.2, 5);
  TrackerBench quiet, asked;
  for (const TestFrame& f : frames) {
    give(quiet, f);
    give(asked, f);
    asked.predicted_to_ns(f.stamp_ns + 70'000'000);
    asked.tracks_at_ns(f.stamp_ns - 30'000'000);
    REQUIRE(hash_states(quiet) == hash_states(asked));
  }
}

TEST_CASE("track history: a frame with an equal stamp goes after the earlier ones") {
  for (const bool swapped : {false, true}) {
    TrackerBench late, sorted;
    const std::vector<TestDetection> a = {{10, 0}}, b = {{10, 1}};
    for (TrackerBench* bench : {&late, &sorted}) bench->step(0.0, {{10, 0}});
    sorted.step(0.1, swapped ? b : a);
    sorted.step(0.1, swapped ? a : b);
    sorted.step(0.2, {});
    late.step(0.1, swapped ? b : a);
    late.step(0.2, {});
    late.step(0.1, swapped ? a : b);
    CHECK(late.last.refiltered == 1);
    CHECK(hash_states(late) == hash_states(sorted));
  }
}

TEST_CASE("track history: a frame up to half a second old is used, an older one is late and has no effect") {
  for (const int64_t too_much_ns : {0, 1}) {
    TrackerBench bench;
    for (int k = 0; k <= 20; ++k) bench.step(0.05 * k, {{10, 0}});
    const uint64_t before = hash_states(bench);
    bench.step_ns(to_ns(0.5) - too_much_ns, {{10, 0.1}, {40, 0}});
    CHECK(bench.last.late == (too_much_ns > 0));
    CHECK((hash_states(bench) == before) == bench.last.late);
    CHECK((bench.ids[0] == kNobody) == bench.last.late);
    const TrackerCounts c = bench.tracker.counts();
    CHECK(c.late == 2 * too_much_ns);
    CHECK(c.late_frames == too_much_ns);
    CHECK(c.replays == 1 - too_much_ns);
    CHECK(c.refiltered == 10 * (1 - too_much_ns));
    CHECK(adds_up(bench));
  }
}

TEST_CASE("track history: a frame older than the history, or than the first frame since a restart, is late") {
  TrackerParams p;
  p.history_iterations = 4;
  TrackerBench bench(p);
  for (int k = 0; k < 6; ++k) bench.step(0.01 * k, {{10, 0}});  // the history holds 0.02 to 0.05
  bench.step(0.015, {{10, 0}});
  CHECK(bench.last.late);
  bench.step(0.025, {{10, 0}});
  CHECK(bench.last.refiltered == 3);
  bench.step(0.02, {{10, 0}});  // now it holds 0.025 to 0.05
  CHECK(bench.last.late);

  TrackerBench restarted;
  restarted.step(1.0, {{10, 0}});
  restarted.step(0.9, {{10, 0}});  // no earlier frame exists: this is known
  CHECK(restarted.last.refiltered == 1);
  restarted.tracker.restart();
  restarted.step(1.0, {{10, 0}});
  CHECK_FALSE(restarted.last.late);
  restarted.step(0.9, {{10, 0}});
  CHECK(restarted.last.late);
  restarted.step(1.1, {{10, 0}});
  restarted.step(1.0, {{10, 0}});
  CHECK(restarted.last.refiltered == 1);
}

TEST_CASE("track history: with room for one iteration every older frame is late") {
  TrackerParams p;
  p.history_iterations = 1;
  TrackerBench bench(p);
  bench.step(0.1, {{10, 0}});
  bench.step(0.2, {{10, 0}});
  bench.step(0.15, {{10, 0}});
  CHECK(bench.last.late);
  CHECK(bench.tracker.counts().hits == 1);
}

namespace {
// Every detection lies in every track's gate.
std::vector<TestDetection> make_clutter(int32_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<TestDetection> clutter;
  for (int32_t i = 0; i < count; ++i) clutter.push_back({uniform(random, -3, 3), uniform(random, -3, 3)});
  return clutter;
}
}  // namespace

TEST_CASE("track history: a late frame that costs more work than the limit is late, counted, and has no effect") {
  // A dense iteration of 100 costs 100 x 100 pairs of 16 steps, plus the assignment.
  for (const double limit : {1.5e6, 1e7}) {
    CAPTURE(limit);
    TrackerParams p;
    p.work_limit = limit;
    p.lane.length_m = p.lane.width_m = 1e-3;  // no two detections are of one car
    TrackerBench bench(p);
    for (int k = 0; k < 12; ++k) bench.step(0.05 * k, make_clutter(100, uint64_t(k)));
    CHECK(bench.tracker.counts().limited == 0);
    const uint64_t before = hash_states(bench);
    bench.step(0.05 * 11 - 0.04, make_clutter(100, 99));  // repeats one iteration: within either limit
    CHECK_FALSE(bench.last.late);
    CHECK(bench.last.refiltered == 1);
    CHECK(hash_states(bench) != before);
    const uint64_t then = hash_states(bench);
    bench.step(0.11, make_clutter(100, 98));  // repeats ten
    const bool refused = limit < 1e7;
    CHECK(bench.last.late == refused);
    CHECK(bench.last.limited == refused);
    CHECK((hash_states(bench) == then) == refused);
    const TrackerCounts c = bench.tracker.counts();
    CHECK(c.refused == (refused ? 1 : 0));
    CHECK(c.late_frames == c.refused);
    CHECK(c.late == 100 * c.refused);
    CHECK(adds_up(bench));
    bench.step(0.6, make_clutter(100, 12));
    CHECK_FALSE(bench.last.late);
    CHECK_FALSE(bench.last.limited);
  }
}

TEST_CASE("track history: an iteration beyond the work limit is shortened and flagged; few cars never reach it") {
  for (const double limit : {1e4, 1e15}) {
    CAPTURE(limit);
    TrackerParams p;
    p.work_limit = limit;
    p.lane.length_m = p.lane.width_m = 1e-3;  // no two detections are of one car
    TrackerBench dense(p), sparse(p), sparse_unlimited;
    for (int k = 0; k < 8; ++k) {
      const int64_t tracks = dense.track_count();
      dense.step(0.05 * k, make_clutter(100, uint64_t(k)));
      CHECK(dense.last.limited == (limit < 1e15 && k > 0));
      // A track compares at least 8 detections, a pair costs 16 steps; then the first search ends at once.
      const int64_t searched = test::tests_paper() ? 0 : int64_t(1e4);  // fewer tracks leave work for searches
      if (limit < 1e15) CHECK(dense.last.work <= std::max(tracks * 8 * 16, searched) + 108);
      if (limit == 1e15 && tracks == 100) CHECK(dense.last.work > 100 * 100 * 16);
      const TrackerCounts c = dense.tracker.counts();
      CHECK(c.hits + c.births + c.unborn == 100 * (k + 1));  // each row went somewhere
      if (test::tests_paper() || test::tests_best()) CHECK(c.unborn == 0);
      CHECK(adds_up(dense));
      std::vector<TestDetection> cars;
      for (int car = 0; car < 20; ++car) cars.push_back({30.0 * car + 2.0 * k, 5.0 * (car % 3)});
      sparse.step(0.05 * k, cars);
      sparse_unlimited.step(0.05 * k, cars);
      CHECK_FALSE(sparse.last.limited);
      CHECK(hash_states(sparse) == hash_states(sparse_unlimited));
    }
    CHECK(dense.tracker.counts().limited == (limit < 1e15 ? 7 : 0));
    CHECK(is_finite(dense.snapshot()));
  }
}

TEST_CASE("track history: with a work limit late frames also give the states of sorted order, bit by bit") {
  TrackerParams p;
  p.lane.length_m = p.lane.width_m = 1e-3;
  p.work_limit = test::tests_paper() ? 1e5 : test::tests_best() ? 1e4 : 3e4;  // a dense frame alone may be over it
  int64_t refused = 0, taken_in = 0, limited = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    std::vector<TestFrame> frames = make_frames(seed, 10, 2.0, 0.5), accepted;
    for (std::size_t i = 0; i < frames.size(); ++i)
      if (i % 16 == 0)
        for (const TestDetection& d : make_clutter(60, i)) frames[i].detections.push_back(d);
    delay(frames, 0.3, seed);
    TrackerBench shuffled(p), sorted(p);
    for (const TestFrame& f : frames) {
      give(shuffled, f);
      if (!shuffled.last.late) accepted.push_back(f);
    }
    std::stable_sort(accepted.begin(), accepted.end(), is_earlier);
    for (const TestFrame& f : accepted) {
      give(sorted, f);
      CHECK_FALSE(sorted.last.late);
    }
    CHECK(hash_states(shuffled) == hash_states(sorted));
    CHECK(shuffled.tracker.counts().limited == sorted.tracker.counts().limited);
    refused += shuffled.tracker.counts().refused;
    taken_in += shuffled.tracker.counts().replays;
    limited += shuffled.tracker.counts().limited;
  }
  CHECK(refused > 10);
  CHECK(taken_in > 100);
  CHECK(limited > 0);
}

TEST_CASE("tracker: all memory comes from the allocator; each refusal is bad_alloc and leaks no block") {
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

TEST_CASE("track history: flags report coasting, unobserved and stale") {
  TrackerBench bench;
  bench.step(0.0, {{30, 0}, {-31, 0}});
  CHECK(bench.snapshot().flags[0] == 0);
  const ObservedSector ahead = {0, 0, 1, -1, 0, 100};
  bench.frame.sectors = &ahead;
  bench.frame.sector_count = 1;
  bench.step(0.5, {});
  CHECK(bench.snapshot().flags[0] == kTrackCoasting);
  CHECK(bench.snapshot().flags[1] == (kTrackCoasting | kTrackUnobserved));
  CHECK(bench.tracks_at(0.5).flags[0] == kTrackCoasting);
  CHECK(bench.tracks_at(0.500001).flags[0] == (kTrackCoasting | kTrackStale));
  bench.step(0.6, {{30, 0}});
  CHECK(bench.snapshot().flags[0] == 0);
  CHECK(bench.snapshot().flags[1] == (kTrackCoasting | kTrackUnobserved | kTrackStale));
  CHECK(bench.tracks_at(0.1).flags[1] == (kTrackCoasting | kTrackUnobserved));  // published for an earlier time
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

TEST_CASE("track history: 25,000 frames with random stamps: every row counted, every state sound, no id used twice") {
  run_random_stamps(20'000);
}

TEST_SUITE("long") {
  TEST_CASE("track history: a million frames with random stamps: every row counted, every state sound") {
    run_random_stamps(1'000'000);
  }
}

TEST_CASE("track history: lost cars that return, and cars in two parts: late frames give the states of sorted order") {
  const CircleRoad ring({.radius_m = 200.0});
  int64_t replays = 0, recoveries = 0, joined = 0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const CircuitMap* const map = seed % 4 == 0 ? nullptr : &ring.map;
    const TrackerParams p = test::tracker_params_of(test::test_method());
    std::vector<TestFrame> delayed = make_ring_frames(seed, ring, 8.0);
    delay(delayed, seed % 2 ? 0.45 : 0.1, seed);
    std::vector<TestFrame> frames = delayed;
    std::stable_sort(frames.begin(), frames.end(), is_earlier);  // equal stamps: in the order of arrival
    TrackerBench sorted(p, map), late(p, map);
    std::map<TrackId, int32_t> story;  // by id: 1 confirmed, 2 confirmed and then lost
    for (const TestFrame& f : frames) {
      give(sorted, f);
      const TrackTable& t = sorted.snapshot();
      for (int32_t i = 0; i < t.count; ++i) {
        int32_t& at = story[t.id[i]];
        const bool confirmed = t.state[i] == OVT_CONFIRMED;
        recoveries += confirmed && at == 2;
        at = confirmed ? 1 : at > 0 ? 2 : 0;
      }
    }
    std::vector<TestFrame> so_far;
    for (std::size_t i = 0; i < delayed.size(); ++i) {
      give(late, delayed[i]);
      REQUIRE_FALSE(late.last.late);
      so_far.push_back(delayed[i]);
      if (i % 97 != 96) continue;
      TrackerBench fresh(p, map);
      std::stable_sort(so_far.begin(), so_far.end(), is_earlier);
      for (const TestFrame& f : so_far) give(fresh, f);
      CAPTURE(seed);
      CAPTURE(i);
      REQUIRE(hash_states(late) == hash_states(fresh));
    }
    CAPTURE(seed);
    CHECK(hash_states(late) == hash_states(sorted));
    check_same_counts(late.tracker.counts(), sorted.tracker.counts());
    CHECK(adds_up(late));
    replays += late.tracker.counts().replays;
    joined += late.tracker.counts().joined;
  }
  CHECK(replays > 500);
  if (test::tests_best()) CHECK(recoveries > 20);
  if (test::tests_best()) CHECK(joined > 20);
}

TEST_CASE("track history: tables of any capacity keep to it under more rows than they have room for") {
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

TEST_CASE("track history: any set of columns may be NaN: the car is tracked all the same") {
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
