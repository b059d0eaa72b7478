// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames out of sequence: the states equal those of sorted order, and every measurement is counted. Ids:
// test_track_identity. Any frames and rows: test_track_soundness.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/support/circle_road.h"
#include "tests/support/track_frames.h"

namespace {

using namespace overtake;
using overtake::test::adds_up;
using overtake::test::CircleRoad;
using overtake::test::delay;
using overtake::test::give;
using overtake::test::is_earlier;
using overtake::test::is_finite;
using overtake::test::make_clutter;
using overtake::test::make_frames;
using overtake::test::make_ring_frames;
using overtake::test::TestDetection;
using overtake::test::TestFrame;
using overtake::test::to_ns;
using overtake::test::TrackerBench;

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

TEST_CASE("track history: a restart before the first frame makes no frame late") {
  TrackerBench bench;
  bench.tracker.restart();
  bench.step(1.0, {{10, 0}});
  bench.step(0.9, {{10, 0}});
  CHECK_FALSE(bench.last.late);
  CHECK(bench.last.refiltered == 1);
  bench.tracker.restart();
  bench.tracker.restart();  // the first one dropped iterations
  bench.step(1.0, {{10, 0}});
  bench.step(0.9, {{10, 0}});
  CHECK(bench.last.late);
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
