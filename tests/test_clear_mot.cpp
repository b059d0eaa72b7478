// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// CLEAR MOT on scenes small enough to count by hand. All positions on a line: {id, x}. Objects are 1, 2, ..., tracks
// 10, 20, ...
#include "tools/evaluation/metrics/clear_mot.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/metric_lines.h"

using namespace overtake::metrics;
using overtake::test::Line;
using overtake::test::places;

namespace {

void add(ClearMot& mot, const Line& objects, const Line& tracks) { mot.add_frame(places(objects), places(tracks)); }

}  // namespace

TEST_CASE("clear_mot: a perfect tracker has MOTA 1 and MOTP 0") {
  ClearMot mot;
  for (int k = 0; k < 5; ++k) add(mot, {{1, k}, {2, 50 - k}}, {{20, 50 - k}, {10, k}});
  const ClearMotCounts& c = mot.counts();
  CHECK(c.frames == 5);
  CHECK(c.objects == 10);
  CHECK(c.matches == 10);
  CHECK(c.misses + c.false_positives + c.switches + c.fragments == 0);
  CHECK(c.mota() == 1.0);
  CHECK(c.motp_m() == 0.0);
}

TEST_CASE("clear_mot: misses, false positives and distances are counted per frame") {
  // frame 0: 1 --0.5-- 10     2 (missed)     30 at 100 (false)
  // frame 1: 1 --1.0-- 10     2 --1.5-- 20
  ClearMot mot;
  add(mot, {{1, 0}, {2, 10}}, {{10, 0.5}, {30, 100}});
  CHECK(mot.track_of_object() == std::vector<int32_t>{0, -1});
  add(mot, {{1, 0}, {2, 10}}, {{20, 11.5}, {10, -1}});
  CHECK(mot.track_of_object() == std::vector<int32_t>{1, 0});
  const ClearMotCounts& c = mot.counts();
  CHECK(c.objects == 4);
  CHECK(c.tracks == 4);
  CHECK(c.matches == 3);
  CHECK(c.misses == 1);
  CHECK(c.false_positives == 1);
  CHECK(c.switches == 0);
  CHECK(c.fragments == 0);  // object 2 was never matched before
  CHECK(c.mota() == doctest::Approx(1.0 - 2.0 / 4.0));
  CHECK(c.motp_m() == doctest::Approx((0.5 + 1.0 + 1.5) / 3.0));
}

TEST_CASE("clear_mot: the gate is 2 m inclusive, over both coordinates") {
  ClearMot mot;
  add(mot, {{1, 0}}, {{10, 2.0}});
  CHECK(mot.counts().matches == 1);
  add(mot, {{1, 0}}, {{10, 2.0001}});  // the gate also applies to a kept pair
  CHECK(mot.counts().matches == 1);
  CHECK(mot.counts().misses == 1);
  CHECK(mot.counts().false_positives == 1);
  mot.add_frame({{1, 0, 0}}, {{10, 1.5, 1.5}});
  CHECK(mot.counts().matches == 1);
  ClearMot wide(3.0);
  wide.add_frame({{1, 0, 0}}, {{10, 1.5, 1.5}});
  CHECK(wide.counts().matches == 1);
  CHECK(wide.counts().motp_m() == doctest::Approx(std::sqrt(4.5)));
}

TEST_CASE("clear_mot: a valid correspondence is kept even if another track is nearer") {
  // frame 0: 1 at 0, 10 at 0.     frame 1: 10 at 1.9, a new track 20 exactly on the object
  ClearMot mot;
  add(mot, {{1, 0}}, {{10, 0}});
  add(mot, {{1, 0}}, {{20, 0}, {10, 1.9}});
  CHECK(mot.track_of_object() == std::vector<int32_t>{1});
  CHECK(mot.counts().switches == 0);
  CHECK(mot.counts().false_positives == 1);
  CHECK(mot.counts().motp_m() == doctest::Approx(0.95));
}

TEST_CASE("clear_mot: a different track is one switch, the return to the first a second one") {
  ClearMot mot;
  add(mot, {{1, 0}}, {{10, 0}});
  add(mot, {{1, 0}}, {{20, 0.5}});  // 10 is missing: switch
  add(mot, {{1, 0}}, {{20, 0.5}});
  add(mot, {{1, 0}}, {{10, 0}, {20, 5}});  // 20 is outside the gate: switch back, and a false positive
  const ClearMotCounts& c = mot.counts();
  CHECK(c.switches == 2);
  CHECK(c.misses == 0);
  CHECK(c.fragments == 0);
  CHECK(c.false_positives == 1);
  CHECK(c.mota() == doctest::Approx(1.0 - 3.0 / 4.0));
}

TEST_CASE("clear_mot: a gap is one fragment, and a switch only if another track ends it") {
  ClearMot mot;
  add(mot, {{1, 0}, {2, 50}}, {{10, 0}, {20, 50}});
  add(mot, {{1, 0}, {2, 50}}, {});
  add(mot, {{1, 0}, {2, 50}}, {});
  add(mot, {{1, 0}, {2, 50}}, {{10, 0}, {30, 50}});  // 1 continues with 10, 2 with 30
  add(mot, {{1, 0}, {2, 50}}, {});                   // a miss at the end is not a fragment
  const ClearMotCounts& c = mot.counts();
  CHECK(c.misses == 6);
  CHECK(c.fragments == 2);
  CHECK(c.switches == 1);
  CHECK(c.mota() == doctest::Approx(1.0 - 7.0 / 10.0));
}

TEST_CASE("clear_mot: an absent object is neither missed nor fragmented") {
  ClearMot mot;
  add(mot, {{1, 0}}, {{10, 0}});
  add(mot, {}, {{10, 0}});
  add(mot, {{1, 0}}, {{10, 0}});
  CHECK(mot.counts().objects == 2);
  CHECK(mot.counts().misses == 0);
  CHECK(mot.counts().fragments == 0);
  CHECK(mot.counts().switches == 0);
  CHECK(mot.counts().false_positives == 1);
}

TEST_CASE("clear_mot: two tracks that swap objects are two switches") {
  // Objects 1 and 2 are 4 m apart; between the frames the tracks 10 and 20 swap places.
  ClearMot mot;
  add(mot, {{1, 0}, {2, 4}}, {{10, 0}, {20, 4}});
  add(mot, {{1, 0}, {2, 4}}, {{10, 4}, {20, 0}});
  add(mot, {{1, 0}, {2, 4}}, {{10, 4}, {20, 0}});
  CHECK(mot.counts().switches == 2);
  CHECK(mot.counts().matches == 6);
  CHECK(mot.counts().mota() == doctest::Approx(1.0 - 2.0 / 6.0));
}

TEST_CASE("clear_mot: takes as many pairs as the gate allows, then the smallest sum of distances") {
  // 10 lies between both objects, 20 reaches only object 1: expected (2, 10) and (1, 20), not (1, 10) alone.
  ClearMot mot;
  add(mot, {{1, 0.0}, {2, 2.0}}, {{10, 0.9}, {20, -1.5}});
  CHECK(mot.track_of_object() == std::vector<int32_t>{1, 0});
  CHECK(mot.counts().motp_m() == doctest::Approx((1.5 + 1.1) / 2.0));
  // Greedy takes (1, 10) at 0.1 and leaves 1.7; the crossed pairs cost 0.9 + 0.8, which is less.
  ClearMot least;
  add(least, {{1, 0.0}, {2, 1.0}}, {{10, 0.9}, {20, -0.7}});
  CHECK(least.track_of_object() == std::vector<int32_t>{1, 0});
  CHECK(least.counts().motp_m() == doctest::Approx((0.7 + 0.1) / 2.0));
}

TEST_CASE("clear_mot: a track belongs to the last object it was matched with") {
  // 10 follows object 1; 1 is absent and 10 changes to object 2; then all are within reach of 10 again.
  ClearMot mot;
  add(mot, {{1, 0}}, {{10, 0}});
  add(mot, {{2, 1}}, {{10, 0.5}});
  add(mot, {{1, 0}, {2, 1}}, {{10, 0.2}});
  CHECK(mot.track_of_object() == std::vector<int32_t>{-1, 0});
  add(mot, {{1, 0}}, {{10, 0}});  // 2 is absent: 1 gets its own last track again: no switch, but a fragment
  CHECK(mot.counts().matches == 4);
  CHECK(mot.counts().switches == 0);
  CHECK(mot.counts().misses == 1);
  CHECK(mot.counts().fragments == 1);
}

TEST_CASE("clear_mot: empty frames count, and no frame at all has no score") {
  ClearMot mot;
  CHECK(std::isnan(mot.counts().mota()));
  CHECK(std::isnan(mot.counts().motp_m()));
  add(mot, {}, {});
  CHECK(mot.counts().frames == 1);
  CHECK(std::isnan(mot.counts().mota()));
  add(mot, {}, {{10, 0}, {20, 1}});
  CHECK(mot.counts().false_positives == 2);
  CHECK(std::isnan(mot.counts().mota()));
  add(mot, {{1, 0}}, {});
  CHECK(mot.counts().misses == 1);
  CHECK(mot.counts().mota() == -2.0);  // more errors than objects
}

TEST_CASE("clear_mot: a position that is not finite is never matched") {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  ClearMot mot;
  add(mot, {{1, 0}, {2, 10}}, {{10, 0}, {20, 10}});
  add(mot, {{1, nan}, {2, 10}}, {{10, 0}, {20, infinity}});
  CHECK(mot.counts().matches == 2);
  CHECK(mot.counts().misses == 2);
  CHECK(mot.counts().false_positives == 2);
}

TEST_CASE("clear_mot: counts of sequences add up") {
  ClearMot a, b;
  add(a, {{1, 0}}, {{10, 1}});
  add(b, {{1, 0}, {2, 9}}, {{10, 0.5}});
  add(b, {{1, 0}, {2, 9}}, {{20, 0.5}});
  add(b, {{1, 0}, {2, 9}}, {});
  add(b, {{1, 0}, {2, 9}}, {{20, 0.5}});
  ClearMotCounts sum = a.counts();
  sum += b.counts();
  CHECK(sum.frames == 5);
  CHECK(sum.objects == 9);
  CHECK(sum.tracks == 4);
  CHECK(sum.matches == 4);
  CHECK(sum.misses == 5);
  CHECK(sum.false_positives == 0);
  CHECK(sum.switches == 1);
  CHECK(sum.fragments == 1);
  CHECK(sum.mota() == doctest::Approx(1.0 - 6.0 / 9.0));
  CHECK(sum.motp_m() == doctest::Approx(2.5 / 4.0));
}

TEST_CASE("clear_mot: the order of the rows changes nothing") {
  const uint64_t seed = 7;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0.0, 12.0);
  ClearMot in_order, shuffled;
  for (int k = 0; k < 200; ++k) {
    std::vector<MotPlace> objects, tracks;
    for (uint64_t id = 1; id <= 8; ++id) {
      if (random() % 4) objects.push_back({id, place(random), place(random)});
      if (random() % 4) tracks.push_back({100 + id, place(random), place(random)});
    }
    in_order.add_frame(objects, tracks);
    std::shuffle(objects.begin(), objects.end(), random);
    std::shuffle(tracks.begin(), tracks.end(), random);
    shuffled.add_frame(objects, tracks);
    const ClearMotCounts &a = in_order.counts(), &b = shuffled.counts();
    REQUIRE(a.matches == b.matches);
    REQUIRE(a.switches == b.switches);
    REQUIRE(a.fragments == b.fragments);
    REQUIRE(a.matches + a.misses == a.objects);
    REQUIRE(a.matches + a.false_positives == a.tracks);
  }
  CHECK(in_order.counts().switches > 50);
  CHECK(in_order.counts().fragments > 50);
}
