// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ids with frames out of sequence: each id stays with its car and never goes to another one.
#include <doctest/doctest.h>

#include <map>
#include <random>
#include <set>

#include "pipeline/track/track_ids.h"
#include "tests/support/track_frames.h"

namespace {

using namespace overtake;
using overtake::test::CircleRoad;
using overtake::test::delay;
using overtake::test::give;
using overtake::test::kNan;
using overtake::test::make_frames;
using overtake::test::TestDetection;
using overtake::test::TestFrame;
using overtake::test::to_ns;
using overtake::test::TrackerBench;
using overtake::test::uniform;

}  // namespace

TEST_CASE("track identity: a track keeps its id when an older frame shows its car earlier") {
  TrackerBench bench;
  bench.step(0.0, {});
  bench.step(0.10, {{50, 0}});
  const TrackId published = bench.ids[0];
  bench.step(0.15, {{50, 0}});
  bench.step(0.05, {{50, 0}});  // in sorted order the car's track starts here
  CHECK(bench.ids[0] == published);
  REQUIRE(bench.snapshot().count == 1);
  CHECK(bench.snapshot().id[0] == published);
  CHECK(bench.snapshot().age[0] == 3);
  // A new car gets an unused id.
  bench.step(0.20, {{50, 0}, {90, 0}});
  CHECK(bench.ids[0] == published);
  CHECK(bench.ids[1] != published);
}

TEST_CASE("track identity: two cars that change slots keep their ids") {
  TrackerBench bench;
  bench.step(0.0, {});
  bench.step(0.10, {{20, 0}, {50, 0}});  // nearest first: slots 0 and 1
  const TrackId near = bench.ids[0], far = bench.ids[1];
  bench.step(0.15, {{20, 0}, {50, 0}});
  bench.step(0.05, {{50, 0}});  // in sorted order the far one starts first, in slot 0
  const TrackTable& t = bench.snapshot();
  REQUIRE(t.count == 2);
  CHECK(t.x_m[0] == doctest::Approx(50));
  CHECK(t.id[0] == far);
  CHECK(t.id[1] == near);
  bench.step(0.20, {{20, 0}, {50, 0}, {80, 0}});
  CHECK(bench.ids[0] == near);
  CHECK(bench.ids[1] == far);
  CHECK(bench.ids[2] != near);
  CHECK(bench.ids[2] != far);
}

TEST_CASE("track identity: a track that an older frame deletes passes its id to the track that follows its car") {
  TrackerParams p;
  p.window = 4;
  p.confirm_hits = 4;           // a tentative track is deleted at its first miss
  p.lane.tentative_misses = 0;  // the same
  p.keep_hits = 1;
  TrackerBench bench(p);
  bench.step(0.00, {{30, 0}});
  const TrackId published = bench.ids[0];
  bench.step(0.10, {{30, 0}});
  bench.step(0.15, {{30, 0}});
  CHECK(bench.ids[0] == published);
  bench.step(0.05, {});  // a miss
  REQUIRE(bench.snapshot().count == 1);
  CHECK(bench.snapshot().age[0] == 2);
  CHECK(bench.snapshot().id[0] == published);
  CHECK(bench.tracker.counts().deaths == 1);
  CHECK(bench.tracker.counts().births == 2);
}

TEST_CASE("track identity: a snapshot after an older frame refers to that frame's rows") {
  TrackerBench bench;
  bench.step(0.00, {{30, 0}, {60, 0}});
  bench.step(0.10, {{60, 0}, {30, 0}});
  bench.step(0.05, {{90, 0}, {30, 0}});
  const TrackTable& t = bench.snapshot();
  REQUIRE(t.count == 3);
  CHECK(t.detection[0] == 1);
  CHECK(t.flags[0] == 0);
  CHECK(t.detection[1] == -1);
  CHECK(t.flags[1] == kTrackCoasting);
  CHECK(t.detection[2] == 0);
  CHECK(bench.ids[0] == t.id[2]);
  CHECK(bench.ids[1] == t.id[0]);
  bench.step(-9.0, {{30, 0}});  // too old: no effect on any track
  CHECK(bench.last.late);
  for (int i = 0; i < 3; ++i) CHECK(bench.snapshot().detection[i] == -1);
  for (int i = 0; i < 3; ++i) CHECK(bench.snapshot().flags[i] == kTrackCoasting);
}

TEST_CASE("track identity: a track deleted since an older frame gives no id to the track now in its slot") {
  TrackerParams p;
  p.window = 4;
  p.confirm_hits = 4;           // a tentative track is deleted at its first miss
  p.lane.tentative_misses = 0;  // the same
  TrackerBench bench(p);
  bench.step(0.00, {});
  bench.step(0.10, {{50, 0}});
  const TrackId published = bench.ids[0];
  bench.step(0.05, {{20, 0}});  // its track started in slot 0 and was deleted at 0.10, when the other took the slot
  REQUIRE(bench.snapshot().count == 1);
  CHECK(bench.snapshot().id[0] == published);
  CHECK(bench.snapshot().detection[0] == -1);
  CHECK(bench.snapshot().flags[0] == kTrackCoasting);
  CHECK(bench.ids[0] != kNobody);
  CHECK(bench.ids[0] != published);
}

TEST_CASE("track identity: of two tracks that were one, the live one keeps the id, then the one with more of it") {
  for (const int32_t living : {1, 2, 3}) {  // bit 0: the first, bit 1: the second
    const int32_t keeper = living == 2 ? 1 : 0;
    TrackerParams p;
    p.track_capacity = 2;
    p.detection_capacity = 2;
    Arena arena;
    TrackHistory history;
    TrackIds ids;
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) {
      history.carve(carver, p, 1);
      ids.carve(carver, p);
    }));
    TrackHead head[2];
    ids.begin();
    head[1].birth = ids.add_birth(0, 1);
    ids.settle(history, 0, head);
    const TrackId earlier = head[1].id;
    ids.begin();
    // Four iterations ran again; one row each, once all of one track, now the first three of one, the last of another.
    for (int32_t i = 0; i < 4; ++i) {
      int32_t place = i;
      Iteration& it = history.insert(place);
      REQUIRE(place == i);
      if (i == 0) head[0].birth = ids.add_birth(i, 0);
      if (i == 3) head[1].birth = ids.add_birth(i, 1);
      it.stamp_ns = i;
      it.count = 1;
      it.measurement[0] = Measurement{};
      it.slot[0] = 0;
      it.track_before[0] = earlier;
      it.track[0] = kNobody;
      it.birth[0] = head[i == 3].birth;
      it.before.count = 0;
    }
    for (int32_t slot = 0; slot < 2; ++slot) head[slot].alive = (living >> slot & 1) != 0;
    ids.settle(history, 0, head);
    CHECK(head[keeper].id == earlier);
    for (int32_t i = 0; i < 4; ++i) CHECK((history.at(i).track[0] == earlier) == ((i == 3 ? 1 : 0) == keeper));
    CHECK(head[1 - keeper].id != earlier);
    CHECK(head[1 - keeper].id != kNobody);
  }
}

TEST_CASE("track identity: a car that is always seen keeps one id under reordering, and no id goes to another car") {
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    // Cars far apart, each seen in every frame: in any order, one track each.
    std::mt19937_64 random(seed);
    std::vector<TestFrame> frames;
    for (const int64_t period_ns : {to_ns(0.05), to_ns(0.037), to_ns(0.08)})
      for (int64_t stamp_ns = 0; stamp_ns < to_ns(4); stamp_ns += period_ns) {
        TestFrame f;
        f.stamp_ns = stamp_ns;
        for (int car = 0; car < 6; ++car) {
          const double t_s = double(stamp_ns) * 1e-9 - 0.4 * car;  // the cars appear one after the other
          if (t_s < 0) continue;
          f.detections.push_back({60.0 * car + 10 * t_s + uniform(random, -0.3, 0.3), uniform(random, -0.3, 0.3)});
          f.car.push_back(car);
        }
        frames.push_back(std::move(f));
      }
    delay(frames, 0.3, seed);
    TrackerBench bench;
    std::map<TrackId, int> car_of;
    std::map<int, std::set<TrackId>> ids_of;
    for (const TestFrame& f : frames) {
      const std::vector<TrackId>& ids = give(bench, f);
      REQUIRE_FALSE(bench.last.late);
      for (std::size_t i = 0; i < ids.size(); ++i) {
        REQUIRE(ids[i] != kNobody);
        const auto [at, fresh] = car_of.emplace(ids[i], f.car[i]);
        CAPTURE(seed);
        REQUIRE(at->second == f.car[i]);
        ids_of[f.car[i]].insert(ids[i]);
      }
      std::set<TrackId> published;
      const TrackTable& t = bench.snapshot();
      for (int32_t i = 0; i < t.count; ++i) REQUIRE(published.insert(t.id[i]).second);
    }
    CHECK(bench.tracker.counts().replays > 50);
    REQUIRE(ids_of.size() == 6);
    for (const auto& [car, ids] : ids_of) CHECK(ids.size() == 1);
  }
}

TEST_CASE("track identity: ids stay when the ego pose jumps by 1 m and 1 deg, and when it jumps back") {
  const CircleRoad ring({.radius_m = 400.0});
  constexpr double kAhead_m[] = {-14, 9, 25, 45, 70};
  for (const int back_after : {1, 4, 20, 1000})
    for (const double sign : {-1.0, 1.0})
      for (const CircuitMap* map : {&ring.map, static_cast<const CircuitMap*>(nullptr)}) {
        CAPTURE(back_after);
        CAPTURE(sign);
        CAPTURE(map != nullptr);
        std::mt19937_64 random(11);
        TrackerBench bench(test::tracker_params_of(test::test_method()), map);
        std::vector<TrackId> before;
        for (int k = 0; k < 100; ++k) {
          const double way_m = 50.0 * 0.05 * k;
          const EgoPose ego = ring.pose_at(way_m, 0);
          const bool jumped = k >= 40 && k < 40 + back_after;
          const double turn = jumped ? sign * kPi / 180 : 0, shift_m = jumped ? sign / std::sqrt(2.0) : 0;
          bench.frame.ego = {true, ego.x_m + shift_m, ego.y_m + shift_m, ego.yaw_rad + turn, 50};
          std::vector<TestDetection> detections;
          for (const double ahead_m : kAhead_m) {
            const EgoPose car = ring.pose_at(way_m + ahead_m, ahead_m > 20 ? 2 : -2);
            const double dx = car.x_m - ego.x_m, dy = car.y_m - ego.y_m, range_m = std::hypot(dx, dy);
            // Preset best has the variance of the detection: 0.1 m, and half a degree of the ego heading.
            const double var = test::tests_best() ? 0.01 + 0.0087 * 0.0087 * range_m * range_m : kNan;
            const double x_m = ego.x_m + shift_m + std::cos(turn) * dx - std::sin(turn) * dy;
            const double y_m = ego.y_m + shift_m + std::sin(turn) * dx + std::cos(turn) * dy;
            detections.push_back({x_m + uniform(random, -0.1, 0.1), y_m + uniform(random, -0.1, 0.1), kNan, 0, 4.5, 1.8,
                                  var, var, 0, 1.0, OVT_CLASS_CAR, 0, 0, 2000});
          }
          const std::vector<TrackId>& ids = bench.step(0.05 * k, detections);
          if (k == 30) before = ids;
          if (k < 30) continue;
          CAPTURE(k);
          // Preset best may take a row as a part of its car, without an update, but for no longer than 0.2 s.
          const int since = k - (jumped || k < 40 ? 40 : 40 + back_after);
          for (std::size_t i = 0; i < ids.size(); ++i)
            REQUIRE((ids[i] == before[i] || (test::tests_best() && ids[i] == kNobody && since >= 0 && since < 4)));
          REQUIRE(bench.track_count() == int32_t(std::size(kAhead_m)));
          for (int32_t i = 0; i < bench.track_count(); ++i) REQUIRE(bench.snapshot().state[i] == OVT_CONFIRMED);
        }
      }
}

TEST_CASE("track identity: with births, deletions and full tables no two tracks share an id, and none returns") {
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    TrackerParams p;
    p.track_capacity = 14;
    p.max_silence_s = 0.3;
    p.window = 8;
    p.confirm_hits = 3;
    p.keep_hits = 2;
    std::vector<TestFrame> frames = make_frames(100 + seed, 10, 6.0, 0.6);
    delay(frames, 0.3, seed);
    TrackerBench bench(p);
    test::IdWatch watch(p);
    std::map<TrackId, int64_t> last_seen_ns;
    int64_t newest_ns = 0;
    for (const TestFrame& f : frames) {
      give(bench, f);
      newest_ns = std::max(newest_ns, f.stamp_ns);
      const TrackTable& t = bench.snapshot();
      REQUIRE(watch.accepts(t, bench.last));
      std::set<TrackId> now;
      for (int32_t i = 0; i < t.count; ++i) {
        CAPTURE(seed);
        REQUIRE(now.insert(t.id[i]).second);
        REQUIRE(slot_of(t.id[i]) < uint32_t(p.track_capacity));
        // A track may return within the window that can still change, not later.
        const auto [at, fresh] = last_seen_ns.emplace(t.id[i], newest_ns);
        REQUIRE(newest_ns - at->second <= to_ns(p.history_s + 0.1));
        at->second = newest_ns;
      }
      for (std::size_t i = 0; i < bench.ids.size(); ++i)
        for (std::size_t k = 0; k < i; ++k) REQUIRE((bench.ids[i] == kNobody || bench.ids[i] != bench.ids[k]));
    }
    CHECK(bench.tracker.counts().deaths > 30);
  }
}
