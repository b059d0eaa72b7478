// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rules of pipeline/track/life_cycle.h by name, first on histories alone, then through the tracker.
#include <doctest/doctest.h>

#include <string>

#include "core/math.h"
#include "pipeline/track/life_cycle.h"
#include "tests/support/tracker_bench.h"

namespace {

using namespace overtake;
using overtake::test::TrackerBench;

constexpr LifeCycleParams kPaper = {20, 6, 5};

// 'x' is a hit, '.' a miss; the first is the initiation. Returns the iteration that deleted the track, 0 while it
// exists.
int32_t live(LifeCycle& life, const std::string& iterations, const LifeCycleParams& p = kPaper) {
  int32_t n = 0;
  for (const char c : iterations) {
    ++n;
    if (!life.record(c == 'x', p)) return n;
  }
  return 0;
}

std::string repeat(const char* text, int n) {
  std::string s;
  for (int i = 0; i < n; ++i) s += text;
  return s;
}

}  // namespace

TEST_CASE("life cycle: the paper's thresholds are the default") {
  const TrackerParams p;
  CHECK(p.window == 20);
  CHECK(p.confirm_hits == 6);
  CHECK(p.keep_hits == 5);
  CHECK(p.max_silence_s == 4.0);
}

TEST_CASE("life cycle: a track is tentative with five hits, confirmed with the sixth") {
  LifeCycle life;
  CHECK(live(life, "xxxxx") == 0);
  CHECK(life.state == TrackState::kTentative);
  CHECK(live(life, "x") == 0);
  CHECK(life.state == TrackState::kConfirmed);
  CHECK(life.hits() == 6);
  CHECK(life.age == 6);
}

TEST_CASE("life cycle: the six hits need not be in a row") {
  LifeCycle life;
  CHECK(live(life, "x..x..x..x..x..") == 0);
  CHECK(life.state == TrackState::kTentative);
  CHECK(live(life, "x") == 0);
  CHECK(life.state == TrackState::kConfirmed);
}

TEST_CASE("life cycle: a young track is deleted exactly when it cannot be confirmed any more") {
  LifeCycle one_hit;  // 1 hit, at age 15 five iterations remain until age 20: 1 + 5 = 6
  CHECK(live(one_hit, "x" + repeat(".", 14)) == 0);
  CHECK(live(one_hit, ".") == 1);  // age 16: 1 + 4 < 6

  LifeCycle five_hits;  // five hits can still become six by age 20
  CHECK(live(five_hits, "xxxxx" + repeat(".", 14)) == 0);
  CHECK(five_hits.age == 19);

  LifeCycle four_hits;  // 4 + 1 < 6 at age 19
  CHECK(live(four_hits, "xxxx" + repeat(".", 16)) == 19);
}

TEST_CASE("life cycle: a young confirmed track is not deleted by misses") {
  LifeCycle life;
  CHECK(live(life, "xxxxxx" + repeat(".", 13)) == 0);
  CHECK(life.age == 19);
  CHECK(life.state == TrackState::kConfirmed);
}

TEST_CASE("life cycle: from age N on a track with fewer than M_e hits is deleted") {
  LifeCycle life;
  // Six hits at ages 1..6. At age 25 the window is 6..25, one hit; at age 22 it is 3..22, four hits: deleted there.
  CHECK(live(life, "xxxxxx" + repeat(".", 19)) == 22);
}

TEST_CASE("life cycle: a confirmed track with exactly M_e hits stays confirmed") {
  LifeCycle life;
  CHECK(live(life, "xxxxxx" + repeat(".", 15)) == 0);  // age 21: window 2..21, five hits
  CHECK(life.hits() == 5);
  CHECK(life.state == TrackState::kConfirmed);
  LifeCycle steady;  // one hit in four iterations: always five of twenty
  CHECK(live(steady, "xxxxxx" + repeat("...x", 100)) == 0);
  CHECK(steady.state == TrackState::kConfirmed);
}

TEST_CASE("life cycle: an old tentative track with M_e hits stays tentative and can still be confirmed") {
  LifeCycle life;
  CHECK(live(life, "x...x...x...x...x...") == 0);  // age 20, five hits
  CHECK(life.age == 20);
  CHECK(life.state == TrackState::kTentative);
  CHECK(live(life, "x...x...x..") == 0);  // one enters, one leaves: still five
  CHECK(life.state == TrackState::kTentative);
  CHECK(live(life, "x") == 0);  // six within twenty
  CHECK(life.state == TrackState::kConfirmed);
}

TEST_CASE("life cycle: only the last N iterations count") {
  LifeCycle life;
  CHECK(live(life, repeat("x", 200)) == 0);
  CHECK(life.hits() == 20);
  CHECK(live(life, repeat(".", 15)) == 0);
  CHECK(live(life, ".") == 1);
}

TEST_CASE("life cycle: a window of 64 works") {
  LifeCycle life;
  CHECK(live(life, repeat("x", 100), {64, 6, 5}) == 0);
  CHECK(life.hits() == 64);
}

TEST_CASE("tracker: a track is confirmed at its sixth hit") {
  TrackerBench bench;
  for (int k = 0; k < 5; ++k) bench.step(0.05 * k, {{10, 0}});
  REQUIRE(bench.tracks().count == 1);
  CHECK(bench.tracks().state[0] == int32_t(TrackState::kTentative));
  bench.step(0.25, {{10, 0}});
  CHECK(bench.tracks().state[0] == int32_t(TrackState::kConfirmed));
  CHECK(bench.tracks().age[0] == 6);
  CHECK(bench.tracks().hits[0] == 6);
}

TEST_CASE("tracker: a single false detection is deleted after sixteen iterations") {
  TrackerBench bench;
  bench.step(0, {{10, 0}});
  for (int k = 1; k < 15; ++k) bench.step(0.05 * k, {});
  CHECK(bench.track_count() == 1);
  bench.step(0.75, {});
  CHECK(bench.track_count() == 0);
  CHECK(bench.tracker.counts().deaths == 1);
  CHECK(bench.tracker.counts().misses == 15);
}

TEST_CASE("tracker: a track without a hit for longer than max_silence_s is always deleted") {
  TrackerBench bench;
  for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{10, 0}});
  bench.frame.sector_count = 0;  // no sensor sees anything: no iteration, no miss
  bench.step(0.45 + 4.0, {});
  CHECK(bench.track_count() == 1);
  bench.step(0.45 + 4.0 + 1e-6, {});
  CHECK(bench.track_count() == 0);
}

TEST_CASE("tracker: a pure prediction leaves out silent tracks, and does not change the tracker") {
  TrackerBench bench;
  for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{10, 0}});
  REQUIRE(bench.predicted_to(4.45).count == 1);  // 4 s after its last hit
  CHECK(bench.predicted_to(4.45).age[0] == 10);
  CHECK(bench.predicted_to(4.45).hits[0] == 10);
  CHECK(bench.predicted_to(4.45).stamp_ns[0] == overtake::test::to_ns(4.45));
  CHECK(bench.predicted_to(4.45).flags[0] == (kTrackCoasting | kTrackUnobserved | kTrackStale));
  CHECK(bench.predicted_to(4.46).count == 0);
  CHECK(bench.track_count() == 1);
  CHECK(bench.tracker.counts().hits == 9);
  CHECK(bench.tracker.counts().deaths == 0);
  bench.step(4.46, {});  // the next iteration buries it
  CHECK(bench.track_count() == 0);
  CHECK(bench.tracker.counts().deaths == 1);
}

TEST_CASE("tracker: a detection after the silence initiates a new track") {
  TrackerBench bench;
  for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{10, 0}});
  const TrackId first = bench.ids[0];
  bench.step(5.0, {{10, 0}});
  CHECK(bench.track_count() == 1);
  CHECK(bench.ids[0] != kNobody);
  CHECK(bench.ids[0] != first);
}

TEST_CASE("tracker: a frame whose sensors do not see the track's place is not an iteration for it") {
  // One sector from the origin, 90 degrees wide around +x, 5 to 50 m.
  const ObservedSector ahead = {0, 0, 0.78, -0.78, 5, 50};
  struct Case {
    double x_m, y_m;
    bool seen;
  };
  for (const Case c : {Case{10, 0, true}, Case{10, 9, true}, Case{10, 11, false}, Case{-10, 0, false},
                       Case{4, 0, false}, Case{51, 0, false}, Case{49, 0, true}}) {
    CAPTURE(c.x_m);
    CAPTURE(c.y_m);
    TrackerBench bench;
    for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{c.x_m, c.y_m}});
    bench.frame.sectors = &ahead;
    bench.frame.sector_count = 1;
    bench.step(0.5, {});
    CHECK(bench.tracks().age[0] == (c.seen ? 11 : 10));
    CHECK(bench.tracker.counts().misses == (c.seen ? 1 : 0));
  }
}

TEST_CASE("tracker: sectors work across +-pi and for a full turn") {
  struct Case {
    ObservedSector sector;
    bool seen;
  };
  for (const Case& c : {Case{{0, 0, 3.5, 2.8, 0, 50}, true},    // behind, left edge beyond +pi
                        Case{{0, 0, -2.8, -3.5, 0, 50}, true},  // the same, with the right edge beyond -pi
                        Case{{0, 0, 2.9, -2.9, 0, 50}, false},  // everything except behind
                        Case{{0, 0, kPi, -kPi, 0, 50}, true},   // a full turn
                        Case{{0, 0, 9.4, 9.4 - 2 * kPi, 0, 50}, true},
                        Case{{-20, 0, 0.1, -0.1, 0, 50}, true},  // a sensor at another position, the track ahead of it
                        Case{{0, 0, overtake::test::kNan, 0, 0, 50}, false}}) {
    CAPTURE(c.sector.view.left_rad);
    TrackerBench bench;
    for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{-10, 0}});
    bench.frame.sectors = &c.sector;
    bench.frame.sector_count = 1;
    bench.step(0.5, {});
    CHECK(bench.tracks().age[0] == (c.seen ? 11 : 10));
  }
}

TEST_CASE("tracker: a gap of a sensor's view is not seen") {
  struct Case {
    double gap_left_rad, gap_right_rad;
    bool seen;
  };
  for (const Case c : {Case{0.1, -0.1, false}, Case{0.3, 0.1, true}, Case{-0.1, -0.3, true},
                       Case{2 * kPi + 0.1, 2 * kPi - 0.1, false}}) {
    CAPTURE(c.gap_left_rad);
    ObservedSector sector = {0, 0, 0.78, -0.78, 5, 50};
    sector.gap_count = 2;
    sector.gap[0] = {0.7, 0.6};
    sector.gap[1] = {c.gap_left_rad, c.gap_right_rad};
    for (const double half_rad : {0.78, kPi}) {
      sector.view = {half_rad, -half_rad};
      TrackerBench bench;
      for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{10, 0}});
      bench.frame.sectors = &sector;
      bench.frame.sector_count = 1;
      bench.step(0.5, {});
      CHECK(bench.tracker.counts().misses == (c.seen ? 1 : 0));
    }
  }
}

TEST_CASE("tracker: unknown sectors mean that everything was observed, no sector means nothing") {
  TrackerBench bench;
  for (int k = 0; k < 10; ++k) bench.step(0.05 * k, {{10, 0}});
  bench.frame.sector_count = 0;
  bench.step(0.5, {});
  CHECK(bench.tracks().age[0] == 10);
  bench.frame.sector_count = -1;
  bench.step(0.55, {});
  CHECK(bench.tracks().age[0] == 11);
}

TEST_CASE("tracker: a hit outside every sector counts") {
  TrackerBench bench;
  bench.frame.sector_count = 0;
  for (int k = 0; k < 6; ++k) bench.step(0.05 * k, {{10, 0}});
  CHECK(bench.tracks().state[0] == int32_t(TrackState::kConfirmed));
  CHECK(bench.tracks().age[0] == 6);
}
