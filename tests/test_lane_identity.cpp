// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: which car a track is of, and which detections it takes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "core/math.h"
#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::pushed_row, test::ns_of, test::seen_car;
using test::make_ring, test::on_ring;

}  // namespace

TEST_CASE("lane identity: a car that comes back keeps its id, also where it braked meanwhile") {
  constexpr double kRadius = 300;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto comes_back = [&](int32_t hidden, double late_m) {
    LaneBench bench(&ring.map);
    TrackId before = kNobody, after = kNobody;
    for (int32_t k = 0; k < 40 + hidden + 20; ++k) {
      const double way_m = 50 * kFrame_s * k;
      const Place ego = on_ring(kRadius, way_m - 40);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 40) / kRadius, 50};
      const bool is_hidden = k >= 40 && k < 40 + hidden;
      const Place at = on_ring(kRadius, k < 40 ? way_m : way_m - late_m);
      const auto& ids =
          bench.step(k, is_hidden ? std::vector<Measurement>{} : std::vector{seen_car(at.x_m, at.y_m, k)});
      if (!ids.empty()) (k < 40 ? before : after) = ids[0];
    }
    CHECK(bench.confirmed() == 1);
    return before == after;
  };
  CHECK(comes_back(20, 0));
  CHECK(comes_back(60, 0));
  CHECK(comes_back(60, 15));
  CHECK(comes_back(100, 25));
  CHECK_FALSE(comes_back(20, 60));  // another car
  CHECK_FALSE(comes_back(260, 0));  // after 13 s
}

TEST_CASE(
    "lane identity: a lost track takes no pushed row: the row has a track of its own, which gets the id back if it "
    "fits") {
  const auto come_back = [](double aside_m, bool is_row) {
    LaneBench bench;
    const auto row = [&](double y_m, int32_t k) {
      bench.ego_at(10 * kFrame_s * k - 30);
      return is_row ? pushed_row(10 * kFrame_s * k, y_m, k) : seen_car(10 * kFrame_s * k, y_m, k);
    };
    TrackId before = kNobody, after = kNobody;
    int32_t k = 0;
    for (; k < 30; ++k) before = bench.step(k, {row(0, k)})[0];
    for (; bench.rows.count > 0 && bench.state().stage != LaneStage::kLost; ++k) bench.step(k, {});
    REQUIRE(bench.rows.count == 1);
    for (int32_t i = 0; i < 20; ++i, ++k) after = bench.step(k, {row(aside_m, k)})[0];
    CHECK(bench.tracker->counts().births == (is_row ? 2 : 1));
    return before == after;
  };
  CHECK(come_back(0, true));
  CHECK_FALSE(come_back(9, true));
  CHECK(come_back(0, false));  // a cluster shows that it is a car
}

TEST_CASE(
    "lane identity: a lost car that a single row shows is still a lost one, and keeps its id after the next gap") {
  LaneBench bench;
  int32_t k = 0;
  const auto go = [&](int32_t frames, bool is_seen) {
    for (int32_t i = 0; i < frames; ++i, ++k) {
      bench.ego_at(20 * kFrame_s * k);
      bench.input.ego.speed_mps = 20;
      Measurement z = pushed_row(20 + 20 * kFrame_s * k, 3, k);
      z.var_x = z.var_y = 1.0;
      bench.step(k, is_seen ? std::vector{z} : std::vector<Measurement>{});
    }
  };
  go(4, true);
  REQUIRE(bench.is_confirmed());
  const TrackId id = bench.rows.id[0];
  go(4, false);
  REQUIRE(bench.state().stage == LaneStage::kLost);
  go(1, true);
  go(1, false);
  REQUIRE(bench.tracker->counts().joined == 1);
  CHECK(bench.state().stage == LaneStage::kLost);
  go(8, false);
  go(8, true);
  REQUIRE(bench.confirmed() == 1);
  CHECK(bench.rows.id[0] == id);
}

TEST_CASE("lane identity: where all rows are pushed, a track rather stays without one than takes a far one") {
  // How far aside the track of a car takes a row. A cluster far away makes the frames no frames of pushed rows only.
  const auto reach_m = [](bool only_rows) {
    double farthest_m = 0;
    for (double aside_m = 0; aside_m < 6; aside_m += 0.1) {
      LaneBench bench;
      const auto step = [&](int32_t k, double y_m) {
        std::vector<Measurement> seen = {pushed_row(10 * kFrame_s * k, y_m, k)};
        if (!only_rows) seen.push_back(seen_car(500, 500, k));
        bench.ego_at(10 * kFrame_s * k - 30);
        return bench.step(k, seen)[0];
      };
      TrackId before = kNobody;
      for (int32_t k = 0; k < 10; ++k) before = step(k, 0);
      if (step(10, aside_m) == before) farthest_m = aside_m;
    }
    return farthest_m;
  };
  CHECK(reach_m(true) > 0.5);
  CHECK(reach_m(true) < reach_m(false));
}

TEST_CASE("lane identity: one car in two detections is one track, and both rows count as used") {
  LaneBench bench;
  const TrackId id = bench.follow(20);
  for (int32_t k = 20; k < 40; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    const double x_m = 50 * kFrame_s * k;
    const auto& ids = bench.step(k, {seen_car(x_m, 0, k), seen_car(x_m - 1.5, 0.6, k)});
    CHECK(ids[0] == id);
    CHECK(ids[1] == kNobody);  // it updates no track
    CHECK(bench.rows.count == 1);
  }
  const TrackerCounts c = bench.tracker->counts();
  CHECK(c.births == 1);
  CHECK(c.measurements == c.hits + c.births);
  // Side by side, 2.2 m apart, are two cars.
  for (int32_t k = 40; k < 60; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    bench.step(k, {seen_car(50 * kFrame_s * k, 0, k), seen_car(50 * kFrame_s * k, 2.2, k)});
  }
  CHECK(bench.confirmed() == 2);
}

TEST_CASE("lane identity: a part of a car that was measured earlier in the frame moves with the car") {
  LaneBench bench;
  bench.follow(20);
  for (int32_t k = 20; k < 30; ++k) {
    const double x_m = 50 * kFrame_s * k;
    Measurement part = seen_car(x_m - 4.5, 0.6, k);  // where the car was 90 ms before
    part.stamp_ns -= 90'000'000;
    bench.ego_at(x_m - 30);
    bench.step(k, {seen_car(x_m, 0, k), part});
  }
  CHECK(bench.tracker->counts().births == 1);
}

TEST_CASE("lane identity: a detection updates a track before faint points that lie nearer to its prediction") {
  LaneBench bench;
  const TrackId id = bench.follow(20);
  for (int32_t k = 20; k < 30; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    const double x_m = 50 * kFrame_s * k;
    Measurement faint = seen_car(x_m, 0, k);
    faint.faint = 1, faint.points = 2;
    const auto& ids = bench.step(k, {seen_car(x_m, 0.15, k), faint});
    CHECK(ids[0] == id);
    CHECK(ids[1] == kNobody);
  }
}

TEST_CASE("lane identity: faint points on the road, or beside the car, are not of it") {
  const auto is_taken = [](double height_m, double aside_m) {
    LaneBench bench;
    bench.follow(20);
    bench.ego_at(50 * kFrame_s * 20 - 30);
    Measurement faint = seen_car(50 * kFrame_s * 20, aside_m, 20);
    faint.faint = 1, faint.points = 2, faint.height_m = height_m, faint.object_class = 0;
    bench.step(20, {faint});
    return bench.state().uncorrected_s == 0.0;
  };
  const double sigma_m = [] {
    LaneBench bench;
    bench.follow(20);
    return std::sqrt(bench.state().estimate.covariance[1][1] + 0.01);
  }();
  CHECK(is_taken(0.6, 0));
  CHECK(is_taken(0.6, 2 * sigma_m));
  CHECK_FALSE(is_taken(0.6, 4 * sigma_m));
  CHECK_FALSE(is_taken(0.1, 0));
}

TEST_CASE("lane identity: two tracks that turn out to be one car become the elder one") {
  LaneBench bench;
  TrackId elder = kNobody;
  // Two parts of one car, too far apart for one detection, that come together.
  for (int32_t k = 0; k < 60; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    const double x_m = 50 * kFrame_s * k, gap_m = k < 40 ? 6.0 : std::max(0.0, 6.0 - 0.5 * (k - 40));
    const auto& ids = k == 0 ? bench.step(k, {seen_car(x_m, 0, k)})
                             : bench.step(k, {seen_car(x_m, 0, k), seen_car(x_m - gap_m, 0, k)});
    if (k == 0) elder = ids[0];
    if (k == 39) CHECK(bench.confirmed() == 2);
  }
  CHECK(bench.rows.count == 1);
  CHECK(bench.rows.id[0] == elder);
  const TrackerCounts c = bench.tracker->counts();
  CHECK(c.joined == 1);
  CHECK(c.deaths == c.missed + c.silent + c.displaced + c.unsound + c.forgotten + c.joined);
  CHECK(c.births == bench.rows.count + c.deaths);
  CHECK(c.measurements == c.hits + c.births);
}

TEST_CASE("lane identity: a lost car that comes back beside a new one does not take the new one's track") {
  LaneBench bench;
  const TrackId elder = bench.follow(40);
  int32_t k = 40;
  for (int32_t lost = 0; lost < 20; ++k) {  // misses where it should be seen
    bench.ego_at(50 * kFrame_s * k - 30);
    bench.step(k, {});
    lost += bench.confirmed() == 0;
  }
  CHECK(bench.state().score == -LaneBench::of_best().lane.most_score);
  TrackId other = kNobody;
  for (int32_t end = k + 20; k < end; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    const auto& ids = bench.step(k, {seen_car(50 * kFrame_s * k, 0, k), seen_car(50 * kFrame_s * k, 2.5, k)});
    CHECK(ids[0] == elder);
    if (other == kNobody) other = ids[1];
    CHECK(ids[1] == other);
  }
  CHECK(bench.confirmed() == 2);
  CHECK(bench.tracker->counts().joined == 0);
}

TEST_CASE("lane identity: a car that passes another one closely keeps its track") {
  // Beside a standing car, nearer than two parts of one car may be. At 2 m/s they may be parts.
  const auto least_confirmed = [](double speed_mps) {
    LaneBench bench;
    int32_t least = 2;
    for (int32_t k = 0; k < 90; ++k) {
      bench.ego_at(-40);
      const double x_m = speed_mps * kFrame_s * (k - 60);
      bench.step(k, {seen_car(0, 0, k), seen_car(x_m, 1.2, k)});
      if (std::fabs(x_m) < 3) least = std::min(least, bench.confirmed());
    }
    return least;
  };
  CHECK(least_confirmed(8) == 2);
  CHECK(least_confirmed(2) == 1);
}

TEST_CASE("lane identity: two tracks that become one have the time of their state, also where their stamps differ") {
  // The detections of the elder, or of the younger one, are 40 ms older: 2 m.
  for (const bool elder_is_early : {true, false}) {
    CAPTURE(elder_is_early);
    LaneBench bench;
    for (int32_t k = 0; k < 60; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      const double gap_m = k < 40 ? 6.0 : std::max(0.0, 6.0 - 0.5 * (k - 40));
      const auto seen = [&](bool early, double behind_m) {
        const double ago_s = early ? 0.04 : 0.0;
        Measurement z = seen_car(50 * (kFrame_s * k - ago_s) - behind_m, 0, k);
        z.stamp_ns -= early ? 40'000'000 : 0;
        return z;
      };
      std::vector<Measurement> rows = {seen(elder_is_early, 0)};
      if (k > 0) rows.push_back(seen(!elder_is_early, gap_m));
      bench.step(k, rows);
      for (int32_t i = 0; k > 10 && i < bench.rows.count; ++i) {
        CAPTURE(k);
        // On the elder's place or on the younger one's, at its own time.
        const double error_m = bench.rows.x_m[i] - 50 * double(bench.rows.stamp_ns[i]) * 1e-9;
        CHECK(std::fmin(std::fabs(error_m), std::fabs(error_m + gap_m)) < 0.4);
      }
    }
    CHECK(bench.tracker->counts().joined >= 1);
  }
}

TEST_CASE("lane identity: a car that leaves its track abruptly has one track, and its id") {
  // The car turns aside at once and falls back, as in a spin. Another program pushes another car's row after each
  // frame, after every other one, or never.
  for (const double aside_m : {5.0, 6.0})
    for (const int32_t push_every : {1, 2, 1000}) {
      CAPTURE(aside_m);
      CAPTURE(push_every);
      LaneBench bench;
      TrackId id = kNobody;
      double x_m = 0;
      for (int32_t k = 0; k < 60; ++k) {
        const double ego_m = 50 * kFrame_s * k - 30;
        bench.ego_at(ego_m);
        x_m += (k < 40 ? 50 : 30) * kFrame_s;
        const TrackId now = bench.step(k, {seen_car(x_m, k < 40 ? 0 : aside_m, k)})[0];
        if (k == 39) id = now;
        if (k >= 48) CHECK(now == id);
        if (k >= 48 && push_every == 1000) CHECK(bench.confirmed() == 1);
        if (k % push_every != 1 % push_every) continue;
        Measurement row = pushed_row(ego_m + 130, 0, k);
        row.stamp_ns += ns_of(1) / 2;
        bench.push({row});
      }
      CHECK(bench.tracker->counts().joined == 1);
    }
}

TEST_CASE(
    "lane identity: a car that comes into view is another one if the missing car is hidden, or missing for long") {
  // Whether a car that comes into view beside a missing one takes over its track.
  const auto takes_over = [](bool hidden, int32_t missing, double aside_m = 7, bool pushed = false) {
    LaneBench bench;
    for (int32_t k = 0; k < 60; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 40);
      std::vector<Measurement> seen;
      if (hidden) seen.push_back(seen_car(x_m - 15, 0, k));
      if (k < 40) seen.push_back(seen_car(x_m, 0, k));
      if (k >= 40 + missing) seen.push_back(seen_car(x_m, aside_m, k));
      for (Measurement& z : seen)
        if (pushed) z.points = 0, z.object_class = 0;
      bench.step(k, seen);
    }
    return bench.tracker->counts().joined > 0;
  };
  CHECK(takes_over(false, 0));
  CHECK_FALSE(takes_over(true, 0));
  CHECK_FALSE(takes_over(false, 0, 20));
  CHECK(takes_over(false, 4));
  CHECK_FALSE(takes_over(false, 12));
  CHECK_FALSE(takes_over(false, -10));         // both cars were seen
  CHECK_FALSE(takes_over(false, 0, 7, true));  // the next car in traffic
}

TEST_CASE("lane identity: a car that is seen now and then does not lose its id to one that comes into view beside it") {
  LaneBench bench;
  TrackId first = kNobody;
  for (int32_t k = 0; k < 120; ++k) {
    const double x_m = 50 * kFrame_s * k;
    bench.ego_at(x_m - 40);
    std::vector<Measurement> seen;
    if (k < 10 || k % 8 < 4) seen.push_back(seen_car(x_m, 0, k));
    const bool is_seen = !seen.empty();
    if (k >= 60) seen.push_back(seen_car(x_m, 7, k));
    const auto& ids = bench.step(k, seen);
    if (k == 9) first = ids[0];
    CAPTURE(k);
    if (k >= 10 && is_seen) CHECK(ids[0] == first);
    if (k >= 65) CHECK(bench.confirmed() == 2);
  }
  CHECK(bench.tracker->counts().joined == 0);
}

TEST_CASE("lane identity: two cars that stand side by side are two, whatever course their tracks began with") {
  // Pushed rows, 2.5 m apart, headings across the way of the ego vehicle.
  LaneBench bench;
  for (int32_t k = 0; k < 20; ++k) {
    std::vector<Measurement> rows;
    for (const double x_m : {20.0, 22.5}) {
      Measurement z = seen_car(x_m, 5, k);
      z.height_m = z.length_m = z.width_m = std::nan("");
      z.heading_rad = kHalfPi, z.free_heading = true;
      rows.push_back(z);
    }
    bench.input.ego.speed_mps = 0;
    bench.step(k, rows);
  }
  CHECK(bench.confirmed() == 2);
}

TEST_CASE("lane identity: of parked cars that come into view one after the other, none takes the next one's row") {
  // 5.5 m apart; the first is not seen a second time when the last comes into view. The same where the library's own
  // sensors see a car far away: then not each track may stay alone, but these may, because their course is unknown.
  for (const bool sees_car : {false, true}) {
    CAPTURE(sees_car);
    LaneBench bench;
    bench.input.ego.known = false;
    const auto step = [&](int32_t frame, std::initializer_list<double> places_m) {
      std::vector<Measurement> rows;
      for (const double x_m : places_m) {
        rows.push_back(seen_car(x_m, 0, frame));
        rows.back().points = 0, rows.back().var_x = rows.back().var_y = 0.3;
      }
      if (sees_car) rows.push_back(seen_car(500, 500, frame));
      return bench.step(frame, rows);
    };
    const std::vector<TrackId> first = step(0, {0, 5.5, 11}), second = step(2, {5.5, 11, 16.5});
    CHECK(second[0] == first[1]);
    CHECK(second[1] == first[2]);
    CHECK(std::count(first.begin(), first.end(), second[2]) == 0);
  }
}

TEST_CASE("lane identity: of two cars side by side that come back together, each has its own id") {
  constexpr double kRadius = 800;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto exchanged = [&](uint32_t seed) {
    std::mt19937 random(seed);
    const auto noise = [&](double size) { return size * (double(random() >> 8) / (1 << 23) - 1.0); };
    LaneBench bench(&ring.map);
    TrackId before[2] = {kNobody, kNobody}, after[2] = {kNobody, kNobody};
    const double off_m[2] = {noise(3), noise(3)};
    for (int32_t k = 0; k < 110; ++k) {
      const double way_m = 50 * kFrame_s * k;
      const Place ego = on_ring(kRadius, way_m - 30);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 30) / kRadius, 50};
      std::vector<Measurement> rows;
      for (int32_t c = 0; c < 2 && (k < 60 || k >= 80); ++c) {
        const double angle = (way_m + (k < 60 ? 0.0 : off_m[c])) / kRadius, radius_m = kRadius + 3.0 * c - 1.5;
        rows.push_back(pushed_row(radius_m * std::sin(angle), kRadius - radius_m * std::cos(angle), k));
      }
      const auto& ids = bench.step(k, rows);
      for (std::size_t c = 0; c < rows.size(); ++c) (k < 60 ? before : after)[c] = ids[c];
    }
    return before[0] == after[1] || before[1] == after[0];
  };
  for (uint32_t seed = 1; seed <= 20; ++seed) CHECK_FALSE(exchanged(seed));
}

TEST_CASE("lane identity: two cars side by side that are both seen are two, though their places are uncertain") {
  const auto count_misses = [](bool pushed, uint32_t seed) {
    constexpr double kGap_m = 2.0, kSigma_m = 0.4;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, kSigma_m);
    LaneBench bench;
    int32_t misses = 0;
    for (int32_t k = 0; k < 160; ++k) {
      const double way_m = 50 * kFrame_s * k;
      bench.ego_at(way_m - 30);
      std::vector<Measurement> seen;
      for (const double y_m : {-0.5 * kGap_m, 0.5 * kGap_m}) {
        const double x_m = way_m + noise(random), at_m = y_m + noise(random);
        seen.push_back(pushed ? pushed_row(x_m, at_m, k) : seen_car(x_m, at_m, k));
        seen.back().var_x = seen.back().var_y = kSigma_m * kSigma_m;
      }
      bench.step(k, seen);
      misses += k >= 20 ? 2 - std::min(bench.confirmed(), 2) : 0;
    }
    return misses;
  };
  for (const bool pushed : {false, true}) {
    CAPTURE(pushed);
    int32_t misses = 0;
    for (uint32_t seed = 1; seed <= 10; ++seed) misses += count_misses(pushed, seed);
    CHECK(misses < 10);  // of 2,800
  }
}

TEST_CASE("lane identity: a car that brakes hard is found again soon, not taken for a part of its own track") {
  const test::CircleRoad ring = make_ring(1e5);
  struct Case {
    double brake_mps2, most_m;
  };
  for (const auto& [brake_mps2, most_m] : {Case{22, 2}, Case{40, 3}}) {
    CAPTURE(brake_mps2);
    for (uint32_t seed = 1; seed <= 20; ++seed) {
      CAPTURE(seed);
      std::mt19937 random(seed);
      std::normal_distribution<double> noise(0.0, 0.1);
      LaneBench bench(&ring.map);
      double worst_m = 0;
      for (int32_t k = 0; k < 100; k += 2) {  // 10 Hz
        const double t = kFrame_s * k, braking_s = std::clamp(t - 3.0, 0.0, 70 / brake_mps2);
        const double x_m = 70 * t - 0.5 * brake_mps2 * braking_s * braking_s -
                           brake_mps2 * braking_s * std::max(t - 3.0 - braking_s, 0.0);
        bench.ego_at(70 * t - 40);
        bench.input.ego.speed_mps = 70;
        Measurement z = seen_car(x_m + noise(random), noise(random), k);
        z.var_x = z.var_y = 0.01;
        bench.step(k, {z});
        if (k < 20) continue;
        double nearest_m = 1e9;
        for (int32_t i = 0; i < bench.rows.count; ++i)
          if (bench.is_confirmed(i)) nearest_m = std::min(nearest_m, std::fabs(bench.rows.x_m[i] - x_m));
        worst_m = std::max(worst_m, nearest_m);
      }
      CHECK(worst_m < most_m);
    }
  }
}

TEST_CASE(
    "lane identity: a car brakes hard while the ego pose jumps, and late frames give the states of sorted order") {
  const test::CircleRoad ring = make_ring(1e5);
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    LaneBench sorted(&ring.map), late(&ring.map);
    const auto step = [&](LaneBench& bench, int32_t k) {
      std::mt19937 random(1000 * seed + uint32_t(k));
      std::normal_distribution<double> noise(0.0, 0.1);
      const double t = kFrame_s * k, braking_s = std::clamp(t - 3.0, 0.0, 1.5);
      const double x_m = 70 * t - 0.5 * 40 * braking_s * braking_s - 40 * braking_s * std::max(t - 4.5, 0.0);
      bench.ego_at(70 * t - 40 + (k % 14 == 6 ? 0.8 : 0.0));
      bench.input.ego.speed_mps = 70;
      Measurement z = seen_car(x_m + noise(random), noise(random), k);
      z.var_x = z.var_y = 0.01;
      bench.step(k, {z});
    };
    for (int32_t k = 0; k < 100; k += 2) step(sorted, k);
    for (int32_t k = 0; k < 100; k += 4) step(late, k + 2), step(late, k);  // 10 Hz
    REQUIRE(late.rows.count == sorted.rows.count);
    for (int32_t i = 0; i < late.rows.count; ++i) {
      CHECK(late.rows.x_m[i] == sorted.rows.x_m[i]);
      CHECK(late.rows.speed_mps[i] == sorted.rows.speed_mps[i]);
    }
  }
}

TEST_CASE("lane identity: a row tells its car's speed late, and the car has its id again all the same") {
  const test::CircleRoad ring = make_ring(1e5);
  int32_t others = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 0.5);
    LaneBench bench(&ring.map);
    TrackId before = kNobody, after = kNobody;
    for (int32_t k = 0; k < 120; ++k) {
      const double way_m = 60 * kFrame_s * k;
      bench.ego_at(way_m - 40);
      bench.input.ego.speed_mps = 60;
      std::vector<Measurement> rows;
      if (k < 60 || k >= 78) rows = {pushed_row(way_m + noise(random), noise(random), k)};
      if (!rows.empty()) rows[0].var_x = rows[0].var_y = 0.25;
      const auto& ids = bench.step(k, rows);
      if (!ids.empty()) (k < 60 ? before : after) = ids[0];
    }
    others += before != after;
  }
  CHECK(others <= 1);
}

TEST_CASE("lane identity: a hidden car keeps its track where its prediction comes near the car in front of it") {
  const test::CircleRoad ring = make_ring(1e5);
  LaneBench bench(&ring.map);
  for (int32_t k = 0; k < 140; ++k) {
    const double t = kFrame_s * k;
    bench.ego_at(50 * t - 40);
    // The second car comes later into view. It is slower, falls into the shadow of the first one and comes nearer.
    std::vector<Measurement> seen = {seen_car(50 * t, 0, k)};
    if (k >= 5 && k < 60) seen.push_back(seen_car(48.5 * t + 10, 0.3, k));
    bench.step(k, seen);
    const bool is_near = 10 - 1.5 * t < 0.7 * 4.9;
    if (k >= 40 && k < 96) CHECK(bench.rows.count == 2);
    if (k == 95) CHECK(is_near);
  }
}

TEST_CASE("lane identity: a car that leaves its track by 2 m has its id and a track of its speed 0.2 s later") {
  const test::CircleRoad ring = make_ring(1e6);
  for (const double off_m : {2.0, 3.0, 4.0}) {
    CAPTURE(off_m);
    LaneBench bench(&ring.map);
    double x_m = 0;
    TrackId id = kNobody;
    for (int32_t k = 0; k < 60; ++k) {
      if (k == 40) x_m -= off_m;
      bench.input.ego = {true, 70 * kFrame_s * k - 30, 0, 0, 70};
      bench.step(k, {seen_car(x_m, 0, k)});
      if (k == 39) id = bench.rows.id[0];
      if (k >= 44) {
        REQUIRE(bench.confirmed() == 1);
        CHECK(bench.rows.id[0] == id);
        CHECK(std::fabs(bench.rows.x_m[0] - x_m) < 0.5);
        CHECK(std::fabs(bench.rows.speed_mps[0] - 50) < 12);
      }
      x_m += (k < 40 ? 70 : 50) * kFrame_s;
    }
  }
}

TEST_CASE("lane identity: a part of a car that is seen once while the car is not does not hand its speed to the car") {
  for (const double ahead_m : {-2.2, 2.2}) {
    CAPTURE(ahead_m);
    LaneBench bench;
    const TrackId id = bench.follow(30);
    bench.input.ego.speed_mps = 0;  // a birth begins with a speed like this
    for (int32_t k = 30; k < 40; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      const double x_m = 50 * kFrame_s * k;
      bench.step(k, k == 34   ? std::vector<Measurement>{seen_car(x_m + ahead_m, 1.0, k)}
                    : k >= 37 ? std::vector<Measurement>{seen_car(x_m, 0.0, k)}
                              : std::vector<Measurement>{});
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (bench.rows.id[i] == id) {
          CAPTURE(k);
          CHECK(bench.rows.speed_mps[i] > 44.0);
          CHECK(std::fabs(bench.rows.x_m[i] - x_m) < 2.5);
        }
    }
    CHECK(bench.confirmed() == 1);
    CHECK(bench.rows.id[0] == id);
  }
}

TEST_CASE("lane identity: a track's time does not go back where another one takes it over") {
  // From frame 40 on the detections are 56 ms older than their frames, and 3 m behind the track.
  const test::CircleRoad ring = make_ring(1e6);
  LaneBench bench(&ring.map);
  int64_t last_ns = 0;
  bool was_joined = false;
  for (int32_t k = 0; k < 60; ++k) {
    const double age_s = k < 40 ? 0.0 : 0.056, behind_m = k < 40 ? 0.0 : 3.0;
    bench.input.ego = {true, 70 * kFrame_s * k - 30, 0, 0, 70};
    Measurement z = seen_car(70 * (kFrame_s * k - age_s) - behind_m, 0, k);
    z.stamp_ns -= int64_t(age_s * 1e9);
    bench.step(k, {z});
    was_joined |= bench.tracker->counts().joined > 0;
    CHECK(bench.rows.stamp_ns[0] >= last_ns);
    last_ns = bench.rows.stamp_ns[0];
  }
  CHECK(was_joined);
  CHECK(bench.rows.count == 1);
  CHECK(std::fabs(bench.rows.x_m[0] - (70 * (kFrame_s * 59 - 0.056) - 3.0)) < 0.5);
}

TEST_CASE("lane identity: two cars known for a while stay two while one detection covers both, and keep their ids") {
  const struct {
    bool in_line, is_honest;  // the variance of the one detection covers both
    int32_t merged;
  } cases[] = {{false, true, 4}, {false, true, 8}, {true, true, 4}, {true, true, 8}, {false, false, 6}};
  for (const auto& [in_line, is_honest, merged] : cases) {
    CAPTURE(in_line);
    CAPTURE(is_honest);
    CAPTURE(merged);
    LaneBench bench;
    std::vector<TrackId> first;
    for (int32_t k = 0; k < 70; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 40);
      const Place a = {x_m, 0}, b = in_line ? Place{x_m + 6, 0} : Place{x_m, 2.4};
      const bool is_one = k >= 40 && k < 40 + merged;
      std::vector<Measurement> rows;
      if (is_one) {
        rows.push_back(seen_car(0.5 * (a.x_m + b.x_m), 0.5 * (a.y_m + b.y_m), k));
        rows[0].var_x = is_honest && in_line ? 9 : 0.1, rows[0].var_y = is_honest && !in_line ? 1.4 : 0.1;
      } else {
        rows = {seen_car(a.x_m, a.y_m, k), seen_car(b.x_m, b.y_m, k)};
      }
      for (Measurement& z : rows) z.points = 0;
      const std::vector<TrackId> ids = bench.step(k, rows);
      if (k == 39) first = ids;
      if (k >= 39) CHECK(bench.confirmed() == 2);
      if (k >= 40 + merged) CHECK(ids == first);
    }
  }
}
