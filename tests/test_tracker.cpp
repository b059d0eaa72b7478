// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Births, gates, stamps, capacities. Life cycle: test_track_life_cycle. What is published: test_tracker_publish.
#include "pipeline/track/cvtr_tracker.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "core/math.h"
#include "tests/support/tracker_bench.h"

namespace {

using namespace overtake;
using overtake::test::kNan;
using overtake::test::TestDetection;
using overtake::test::to_ns;
using overtake::test::TrackerBench;

// A left-hand circle of 100 m radius around the origin, driven counter-clockwise.
CircuitMap make_circle() {
  std::vector<double> x, y, width(360, 10.0);
  for (int k = 0; k < 360; ++k) {
    x.push_back(100 * std::cos(k * kPi / 180));
    y.push_back(100 * std::sin(k * kPi / 180));
  }
  CircuitMap map;
  const char* error = nullptr;
  REQUIRE(map.build(x.data(), y.data(), width.data(), width.data(), nullptr, 360, true, &error));
  return map;
}

void check_birth_covariance(const TrackTable& t, double var_phi) {
  const double expected[kTrackCovarianceSize] = {5, 0, 5, 0, 0, 400, 0, 0, 0, var_phi, 0, 0, 0, 0, 0.01};
  for (int k = 0; k < kTrackCovarianceSize; ++k) {
    CAPTURE(k);
    CHECK(t.covariance[k][0] == doctest::Approx(expected[k]));
  }
}

}  // namespace

TEST_CASE("tracker: defaults are the paper's table") {
  const TrackerParams p;
  const double q[5] = {0.005, 0.005, 0.5, 0.005, 0.0005};
  for (int i = 0; i < 5; ++i) CHECK(p.q_diag[i] == q[i]);
  CHECK(p.q_step_s == 0.05);
  CHECK(p.r_diag[0] == 5.0);
  CHECK(p.r_diag[1] == 5.0);
  CHECK(p.gate_d2 == 9.21);
  CHECK(p.gate_m == 8.0);
}

TEST_CASE("tracker: with a map a new track takes its tangent, its curvature and 0.8 of the ego speed") {
  const CircuitMap map = make_circle();
  TrackerBench bench({}, &map);
  bench.frame.ego = {true, 90, -40, 1.2, 50};
  bench.step(1.0, {{0, 101}});  // at the top: driving towards -x
  const TrackTable& t = bench.tracks();
  REQUIRE(t.count == 1);
  CHECK(t.speed_mps[0] == doctest::Approx(40));
  CHECK(std::fabs(wrap_angle(t.course_rad[0] - kPi)) < 0.02);
  CHECK(t.yaw_rate_rps[0] == doctest::Approx(40 / 100.0).epsilon(0.02));
  CHECK(t.x_m[0] == 0);
  CHECK(t.y_m[0] == 101);
  check_birth_covariance(t, 0.04);
}

TEST_CASE("tracker: with a map and without an ego a new track stands still along the tangent") {
  const CircuitMap map = make_circle();
  TrackerBench bench({}, &map);
  bench.step(1.0, {{100, 0}});
  CHECK(bench.tracks().speed_mps[0] == 0);
  CHECK(bench.tracks().course_rad[0] == doctest::Approx(kHalfPi).epsilon(0.01));
  CHECK(bench.tracks().yaw_rate_rps[0] == 0);
  check_birth_covariance(bench.tracks(), 0.04);
}

TEST_CASE("tracker: a frame in the vehicle frame does not use the map") {
  const CircuitMap map = make_circle();
  TrackerBench bench({}, &map);
  bench.frame.in_map = false;
  bench.frame.ego = {true, 0, 0, 0.3, 10};
  bench.step(1.0, {{0, 100}});
  CHECK(bench.tracks().course_rad[0] == 0.3);
}

TEST_CASE("tracker: without a map a new track takes the ego heading and no yaw rate") {
  const CircuitMap empty;
  for (const CircuitMap* map : {static_cast<const CircuitMap*>(nullptr), &empty}) {
    TrackerBench bench({}, map);
    bench.frame.ego = {true, 0, 0, -2.5, 60};
    bench.step(1.0, {{30, 4}});
    CHECK(bench.tracks().speed_mps[0] == doctest::Approx(48));
    CHECK(bench.tracks().course_rad[0] == -2.5);
    CHECK(bench.tracks().yaw_rate_rps[0] == 0);
    check_birth_covariance(bench.tracks(), 0.04);
  }
}

TEST_CASE("tracker: without map and ego a new track has no known course") {
  TrackerBench bench;
  bench.step(1.0, {{30, 4}});
  CHECK(bench.tracks().speed_mps[0] == 0);
  CHECK(bench.tracks().course_rad[0] == 0);
  check_birth_covariance(bench.tracks(), kPi * kPi);
}

TEST_CASE("tracker: every unassociated detection initiates one track") {
  TrackerBench bench;
  bench.step(0.0, {{0, 0}, {50, 0}, {50, 30}});
  CHECK(bench.track_count() == 3);
  const std::vector<TrackId> first = bench.ids;
  bench.step(0.05, {{50, 30}, {0, 0}, {90, 0}, {50, 0}});
  CHECK(bench.track_count() == 4);
  CHECK(bench.ids[0] == first[2]);
  CHECK(bench.ids[1] == first[0]);
  CHECK(bench.ids[3] == first[1]);
  CHECK(std::find(first.begin(), first.end(), bench.ids[2]) == first.end());
  CHECK(bench.tracker.counts().births == 4);
  CHECK(bench.tracker.counts().hits == 3);
}

TEST_CASE("tracker: the Mahalanobis gate holds") {
  TrackerParams p;
  p.gate_m = 1000;
  // At initiation, at the same time: S = R + R = 10 I, so d^2 = 9.21 at 9.597 m.
  for (const double distance : {9.59, 9.60}) {
    TrackerBench bench(p);
    bench.step(0.0, {{0, 0}});
    const TrackId first = bench.ids[0];
    bench.step(0.0, {{0, distance}});
    CAPTURE(distance);
    CHECK((bench.ids[0] == first) == (distance < 9.597));
  }
}

TEST_CASE("tracker: the distance gate holds where the covariance is wide") {
  TrackerParams p;
  p.r_diag[0] = p.r_diag[1] = 500;
  for (const double distance : {7.999, 8.001}) {
    TrackerBench bench(p);
    bench.step(0.0, {{0, 0}});
    const TrackId first = bench.ids[0];
    bench.step(0.0, {{0, distance}});
    CAPTURE(distance);
    CHECK((bench.ids[0] == first) == (distance < 8));
  }
}

TEST_CASE("tracker: the gates are at the track's predicted place, not at its last one") {
  TrackerBench bench;
  bench.frame.ego = {true, 0, 0, 0, 100};  // starts with 80 m/s along +x
  bench.step(0.0, {{0, 0}});
  const TrackId first = bench.ids[0];
  bench.step(1.0, {{80, 0}});
  CHECK(bench.ids[0] == first);
}

TEST_CASE("tracker: the distance gate is measured from the predicted place, also at high speed") {
  TrackerParams p;
  p.r_diag[0] = p.r_diag[1] = 500;
  for (const double distance : {7.999, 8.001}) {
    TrackerBench bench(p);
    bench.frame.ego = {true, 0, 0, 0, 100};
    bench.step(0.0, {{0, 0}});
    const TrackId first = bench.ids[0];
    bench.step(0.1, {{8, distance}});
    CAPTURE(distance);
    CHECK((bench.ids[0] == first) == (distance < 8));
  }
}

TEST_CASE("tracker: in one frame a track is predicted separately to every stamp") {
  TrackerParams p;
  p.r_diag[0] = p.r_diag[1] = 1;
  TrackerBench bench(p);
  bench.frame.ego = {true, 0, 0, 0, 100};  // 80 m/s: 4 m at the first detection's stamp, 20 m at the second's
  bench.step(0.0, {{0, 0}});
  const TrackId first = bench.ids[0];
  bench.step(0.25, {{4, 7.95, kNan, 0.2}, {27.5, 0}});
  CHECK(bench.ids[0] != first);
  CHECK(bench.ids[1] == first);
}

TEST_CASE("tracker: equal costs are decided by the measurement, not by the row") {
  for (const bool swapped : {false, true}) {
    TrackerBench bench;
    bench.step(0.0, {{0, 0}});
    const TrackId first = bench.ids[0];
    bench.step(0.0,
               swapped ? std::vector<TestDetection>{{0, -1}, {0, 1}} : std::vector<TestDetection>{{0, 1}, {0, -1}});
    CHECK(bench.ids[swapped ? 0 : 1] == first);  // the lower y
  }
}

TEST_CASE("tracker: association is global, not greedy") {
  TrackerBench bench;
  bench.step(0.0, {{0, 0}, {0, 6}});
  const std::vector<TrackId> first = bench.ids;
  // The nearest pair is track 1 with the detection at 4. Taking it leaves only the detection at 9 to track 0, outside
  // its gate: one pair only. Two pairs are possible.
  bench.step(0.0, {{0, 4}, {0, 9}});
  CHECK(bench.ids == first);
}

TEST_CASE("tracker: the cost includes ln det S, so a wide track does not take a narrow one's detection") {
  TrackerParams p;
  p.r_diag[0] = p.r_diag[1] = 0.25;
  TrackerBench bench(p);
  for (int k = 0; k < 40; ++k) bench.step(0.05 * k, {{0, 0}});  // narrow
  const TrackId narrow = bench.ids[0];
  bench.step(2.0, {{0, 0}, {0, 2.0, kNan, 0, kNan, kNan, 9, 9, 0}});  // born at 2 m, sigma 3 m
  REQUIRE(bench.track_count() == 2);
  // 0.9 m from the narrow one (d^2 about 2.6), 1.1 m from the wide one (d^2 about 0.13).
  bench.step(2.0, {{0, 0.9}});
  CHECK(bench.ids[0] == narrow);
}

TEST_CASE("tracker: a detection's covariance replaces R, an invalid one does not") {
  struct Case {
    double var_x, var_y, cov_xy;
    bool own;
  };
  for (const Case c : {Case{1, 2, 0.5, true}, Case{kNan, 2, 0, false}, Case{1, 2, kNan, false}, Case{-1, 2, 0, false},
                       Case{1, 1, 1, false}, Case{1, 1, -2, false}, Case{0, 1, 0, false}, Case{INFINITY, 1, 0, false},
                       Case{1e300, 1e300, 0, false}}) {
    TrackerBench bench;
    bench.step(0, {{10, 0, kNan, 0, kNan, kNan, c.var_x, c.var_y, c.cov_xy}});
    CAPTURE(c.var_x);
    CAPTURE(c.cov_xy);
    CHECK(bench.tracks().covariance[0][0] == (c.own ? c.var_x : 5));
    CHECK(bench.tracks().covariance[1][0] == (c.own ? c.cov_xy : 0));
    CHECK(bench.tracks().covariance[2][0] == (c.own ? c.var_y : 5));
  }
}

TEST_CASE("tracker: each track is updated at its detection's stamp") {
  TrackerBench bench;
  bench.step(0.1, {{0, 0, kNan, 0.08}, {50, 0, kNan, 0.01}});
  CHECK(bench.tracks().measured_ns[0] == to_ns(0.02));
  CHECK(bench.tracks().measured_ns[1] == to_ns(0.09));
  // Two cars at 50 m/s, seen 30 and 100 ms into the next frame: each moved by its own time.
  TrackerBench moving;
  moving.frame.ego = {true, 0, 0, 0, 62.5};
  moving.step(0.1, {{0, 0, kNan, 0.1}, {50, 0}});
  moving.step(0.2, {{50 * 0.13, 0, kNan, 0.07}, {50 + 50 * 0.1, 0}});
  const TrackTable& t = moving.tracks();
  REQUIRE(t.count == 2);
  for (int i = 0; i < 2; ++i) CHECK(t.speed_mps[i] == doctest::Approx(50).epsilon(1e-9));
}

TEST_CASE("tracker: a detection older than its track measures the track's earlier place") {
  // The track moves at 50 m/s and its state is at 0.1 s; the detection, exactly on the path, is from 0.09 s.
  TrackerBench bench;
  bench.frame.ego = {true, 0, 0, 0, 62.5};
  bench.step(0.1, {{5, 0}});
  const TrackId first = bench.ids[0];
  bench.step(0.1, {{4.5, 0, kNan, 0.01}});
  CHECK(bench.ids[0] == first);
  const TrackTable& t = bench.tracks_at(0.1);
  CHECK(t.stamp_ns[0] == to_ns(0.1));
  CHECK(t.measured_ns[0] == to_ns(0.1));
  CHECK(t.x_m[0] == doctest::Approx(5).epsilon(1e-9));
  CHECK(t.speed_mps[0] == doctest::Approx(50).epsilon(1e-9));
  CHECK(t.covariance[0][0] < 2.6);  // and it had an effect: two measurements of 5 m^2
}

TEST_CASE("tracker: a detection more than half a second older than a track is not associated with it") {
  for (const double late : {0.49, 0.51}) {
    TrackerBench bench;
    bench.step(1.0, {{5, 0}});
    const TrackId first = bench.ids[0];
    bench.step(1.0, {{5, 0, kNan, late}});
    CAPTURE(late);
    CHECK((bench.ids[0] == first) == (late < 0.5));
  }
}

TEST_CASE("tracker: no noise is counted twice where scans overlap") {
  // 20 frames whose detections are 5 ms older than the state: P at the end must not exceed that of sorted arrival.
  TrackerBench late, sorted;
  late.step(0.0, {{0, 0}});
  sorted.step(0.0, {{0, 0}});
  for (int k = 1; k <= 20; ++k) {
    late.step(0.05 * k, {});  // leaves the state at the frame's stamp
    late.step(0.05 * k, {{0, 0, kNan, 0.005}});
    sorted.step(0.05 * k - 0.005, {{0, 0}});
  }
  const double of_late = late.tracks_at(1.0).covariance[5][0], of_sorted = sorted.tracks_at(1.0).covariance[5][0];
  CHECK(of_late == doctest::Approx(of_sorted).epsilon(0.02));
}

TEST_CASE("tracker: in a full table the nearest tentative tracks are kept") {
  TrackerParams p;
  p.track_capacity = 4;
  TrackerBench bench(p);
  bench.step(0.0, {{60, 0}, {20, 0}, {80, 0}, {40, 0}, {100, 0}, {10, 0}});
  CHECK(bench.track_count() == 4);
  CHECK(bench.tracker.counts().overflow() == 2);
  CHECK(bench.ids[2] == kNobody);
  CHECK(bench.ids[4] == kNobody);
  bench.step(0.05, {{60, 0}, {20, 0}, {40, 0}, {10, 0}, {30, 0}, {90, 0}});  // 30 puts 60 out, 90 finds no room
  CHECK(bench.track_count() == 4);
  CHECK(bench.ids[0] == kNobody);
  CHECK(bench.ids[4] != kNobody);
  CHECK(bench.ids[5] == kNobody);
  CHECK(bench.tracker.counts().overflow() == 4);
}

TEST_CASE("tracker: in a full table confirmed tracks stay, at any distance") {
  TrackerParams p;
  p.track_capacity = 2;
  TrackerBench bench(p);
  for (int k = 0; k < 6; ++k) bench.step(0.05 * k, {{200, 0}});
  const TrackId far = bench.ids[0];
  bench.step(0.3, {{200, 0}, {50, 0}});
  bench.step(0.35, {{200, 0}, {50, 0}, {20, 0}});
  CHECK(bench.ids[0] == far);
  CHECK(bench.ids[1] == kNobody);
  CHECK(bench.ids[2] != kNobody);
  CHECK(bench.track_count() == 2);
}

TEST_CASE("tracker: beyond the detection capacity those nearest to the ego are used") {
  TrackerParams p;
  p.detection_capacity = 3;
  TrackerBench bench(p);
  bench.frame.ego = {true, 100, 0, 0, 0};
  bench.step(0.0, {{0, 0}, {120, 0}, {60, 0}, {101, 0}, {300, 0}, {kNan, 0}});
  CHECK(bench.track_count() == 3);
  CHECK(bench.ids[0] == kNobody);
  CHECK(bench.ids[1] != kNobody);
  CHECK(bench.ids[2] != kNobody);
  CHECK(bench.ids[3] != kNobody);
  CHECK(bench.ids[4] == kNobody);
  CHECK(bench.tracker.counts().overflow() == 2);
  CHECK(bench.tracker.counts().rejected == 1);
}

TEST_CASE("tracker: ids are never reused, neither in a slot nor after a restart") {
  TrackerBench bench;
  std::vector<TrackId> seen;
  double time_s = 0;
  for (int round = 0; round < 50; ++round) {
    bench.step(time_s, {{10, 0}, {60, 0}});
    for (const TrackId id : bench.ids) {
      CHECK(id != kNobody);
      CHECK(std::find(seen.begin(), seen.end(), id) == seen.end());
      seen.push_back(id);
    }
    if (round % 2) {
      bench.tracker.restart();
      CHECK(bench.track_count() == 0);
    }
    time_s += 5;  // silence ends the others
  }
}

TEST_CASE("tracker: a car that stops and drives on is one track and never drives backwards") {
  std::mt19937_64 random(31);
  std::normal_distribution<double> noise(0, 0.3);
  TrackerBench bench;
  TrackId first = kNobody;
  double x = 0, v = 0;
  for (int k = 0; k < 2000; ++k) {
    const double time_s = 0.05 * k;
    const double wanted = time_s < 20 || time_s > 60 ? 20 : 0;  // along -x, a stop of 30 s
    v += std::clamp(wanted - v, -0.2, 0.2);
    x -= 0.05 * v;
    bench.step(time_s, {{x + noise(random), noise(random)}});
    if (k == 0) first = bench.ids[0];
    CAPTURE(k);
    REQUIRE(bench.ids[0] == first);
    const TrackTable& t = bench.tracks();
    REQUIRE(t.speed_mps[0] >= 0);
    if (v > 10 && time_s > 5) REQUIRE(std::fabs(wrap_angle(t.course_rad[0] - kPi)) < 0.5);
  }
}
