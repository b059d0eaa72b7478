// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: what counts as a miss of a car, and when a car that is missed is lost.
#include <doctest/doctest.h>

#include <random>
#include <vector>

#include "tests/support/lane_bench.h"

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::ns_of, test::pushed_row, test::seen_car;

TEST_CASE("lane misses: rows of a source that never saw a car are no miss of it, those of one that did are") {
  for (const bool saw_it : {false, true}) {
    CAPTURE(saw_it);
    LaneBench bench;
    int32_t k = 0;
    for (; k < 20; ++k) {
      bench.input.of_rows = false;
      bench.step(k, {seen_car(0, 0, k)});
      if (k == 10 && saw_it) {
        Measurement row = pushed_row(0, 0, k);
        row.stamp_ns += 10'000'000;
        bench.input.of_rows = true;
        bench.push({row});
      }
    }
    REQUIRE(bench.is_confirmed());
    const int32_t age = bench.state().age;
    const double existence = bench.state().score;
    bench.input.of_rows = true;
    for (int32_t i = 0; i < 10; ++i, ++k) bench.step(k, {});
    CHECK(bench.state().age == age + (saw_it ? 10 : 0));
    CHECK((bench.state().score < existence) == saw_it);
    CHECK((bench.state().visibility == Visibility::kMissed) == saw_it);
  }
}

TEST_CASE("lane misses: empty iterations in quick succession do not end a new track") {
  for (const int64_t step_ms : {5, 10, 50}) {
    CAPTURE(step_ms);
    LaneBench bench;
    int64_t t_ms = 0;
    for (; t_ms < 1'000; t_ms += step_ms) {
      Measurement z = pushed_row(0.02 * double(t_ms), 0, 0);
      z.stamp_ns = bench.input.stamp_ns = t_ms * 1'000'000;
      const auto seen = t_ms % 100 == 0 ? std::vector{z} : std::vector<Measurement>{};
      bench.input.measurements = seen;
      bench.ids.assign(seen.size(), kNobody);
      bench.tracker->step(bench.input, bench.ids.data());
    }
    CHECK(bench.tracker->counts().births == 1);
    CHECK(bench.tracker->counts().missed == 0);
  }
}

TEST_CASE("lane misses: a place that its source tells badly is one of a confirmed car, not after it was not seen") {
  LaneBench bench;
  int32_t k = 0;
  for (; k < 4; ++k) {
    Measurement z = pushed_row(30 * kFrame_s * k, 0, k);
    z.var_x = z.var_y = 900;  // more than coast_sigma_m
    bench.step(k, {z});
  }
  CHECK(bench.confirmed() == 1);
  CHECK(bench.rows.count == 1);
  bench.publish_at(ns_of(k));
  CHECK(bench.published.state[0] == int32_t(TrackState::kConfirmed));
  bench.publish_at(ns_of(k + 4));
  CHECK(bench.published.state[0] == int32_t(TrackState::kTentative));
}

TEST_CASE("lane misses: tracks read for a later time are lost as an iteration at that time would lose them") {
  LaneBench bench;
  bench.follow(20);
  bench.publish_at(ns_of(19) + 300'000'000);
  CHECK(bench.published.state[0] == int32_t(TrackState::kConfirmed));
  CHECK(bench.told.existence[0] > 0.5);
  bench.publish_at(ns_of(19) + 4'100'000'000);
  CHECK(bench.published.state[0] == int32_t(TrackState::kTentative));
  CHECK(bench.told.existence[0] <= 0.5);
  CHECK(bench.is_confirmed());
}

TEST_CASE("lane misses: rows that tell their places badly are those of one car, whatever their deviation") {
  for (const bool has_ego : {false, true})
    for (const double sigma_m : {0.3, 3.0, 10.0, 20.0}) {
      CAPTURE(has_ego);
      CAPTURE(sigma_m);
      LaneBench bench;
      bench.input.ego.known = has_ego;
      std::mt19937_64 random(7);
      std::normal_distribution<double> error(0, sigma_m);
      for (int32_t k = 0; k < 100; ++k) {
        bench.ego_at(40 * kFrame_s * k - 50);
        Measurement z = pushed_row(45 * kFrame_s * k + error(random), error(random), k);
        z.var_x = z.var_y = sigma_m * sigma_m;
        bench.step(k, {z});
      }
      CHECK(bench.tracker->counts().births == 1);
      CHECK(bench.confirmed() == 1);
    }
}

TEST_CASE("lane misses: pushes that tell nothing of a car make a miss no smaller") {
  const auto score = [](bool has_pushes) {
    LaneBench bench;
    int32_t k = 0;
    for (; k < 20; ++k) bench.step(k, {seen_car(0, 0, k)});
    for (; k < 24; ++k) {
      for (int32_t i = 1; has_pushes && i < 5; ++i) {
        bench.input.of_rows = true;
        bench.input.stamp_ns = ns_of(k) - i * 10'000'000;
        bench.input.measurements = {};
        bench.tracker->step(bench.input, nullptr);
      }
      bench.input.of_rows = false;
      bench.step(k, {});
    }
    return bench.state().score;
  };
  CHECK(score(true) == doctest::Approx(score(false)).epsilon(0.01));
}

TEST_CASE("lane misses: of two tracks of one car that are joined, the rows of both count") {
  const LanePolicy policy(LaneBench::of_best(), nullptr, default_allocator());
  for (const bool is_elder : {false, true})
    for (const bool is_newer : {false, true}) {
      LaneTrack elder, younger;
      (is_elder ? elder : younger).had_row = 1;
      policy.join(elder, younger, is_newer);
      CHECK(elder.had_row == 1);
    }
}

TEST_CASE("lane misses: a late frame before a jump of the ego pose leads to the tracks of sorted arrival") {
  const auto state = [](bool is_late) {
    LaneBench bench;
    const auto step = [&](int32_t k) {
      bench.ego_at(50 * kFrame_s * k - 30 + (k < 20 ? 0.0 : 2.0));
      bench.step(k, {seen_car(50 * kFrame_s * k + (k < 20 ? 0.0 : 2.0), 0, k)});
    };
    for (int32_t k = 0; k < 25; ++k)
      if (!is_late || k != 17) step(k);
    if (is_late) step(17);
    CHECK(bench.tracker->counts().late_frames == 0);
    return bench.state();
  };
  const LaneTrack late = state(true), sorted = state(false);
  CHECK(late.estimate.mean.x_m == sorted.estimate.mean.x_m);
  CHECK(late.estimate.covariance[0][0] == sorted.estimate.covariance[0][0]);
  CHECK(late.score == sorted.score);
}
