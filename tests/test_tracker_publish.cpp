// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's output: copies at a given time, headings, paths; and the guarantees about it: same bytes, finite
// numbers, no heap call.
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "core/math.h"
#include "pipeline/track/cvtr_tracker.h"
#include "tests/support/heap_calls.h"
#include "tests/support/tracker_bench.h"

namespace {

using namespace overtake;
using overtake::test::is_finite;
using overtake::test::kNan;
using overtake::test::TestDetection;
using overtake::test::to_ns;
using overtake::test::TrackerBench;

// A confirmed track, 20 m/s along +x, detections with the given heading; the last at 1 s, x = 20 m.
void drive(TrackerBench& bench, double heading_rad, int frames = 21) {
  bench.frame.ego = {true, 0, 0, 0, 25};
  for (int k = 0; k < frames; ++k) bench.step(0.05 * k, {{k * 1.0, 0, heading_rad}});
}

// Cars on circles with noise, gaps and clutter.
struct Traffic {
  std::mt19937_64 random;
  explicit Traffic(uint64_t seed) : random(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  std::vector<TestDetection> look(double time_s) {
    std::vector<TestDetection> all;
    for (int car = 0; car < 12; ++car) {
      if (uniform(0, 1) < 0.15) continue;
      const double radius = 60 + 12 * car, angle = car + (20 + car) * time_s / radius;
      all.push_back({radius * std::cos(angle) + uniform(-0.5, 0.5), radius * std::sin(angle) + uniform(-0.5, 0.5),
                     wrap_angle(angle + kHalfPi), uniform(0, 0.045), 4.9, 1.9});
    }
    while (uniform(0, 1) < 0.4) all.push_back({uniform(-200, 200), uniform(-200, 200)});
    return all;
  }
};

uint64_t run_traffic(uint64_t seed, bool shuffled) {
  Traffic traffic(seed);
  std::mt19937_64 order(99);
  TrackerBench bench;
  Hash hash;
  for (int k = 0; k < 150; ++k) {
    std::vector<TestDetection> detections = traffic.look(0.05 * k);
    if (shuffled) std::shuffle(detections.begin(), detections.end(), order);
    bench.step(0.05 * k, detections);
    TrackTable t = bench.tracks_at(0.05 * k + 0.02);
    std::fill_n(t.detection, t.count, 0);  // row numbers differ when rows are shuffled; the tracks do not
    hash.add_value(hash_table(t, 0));
    hash.add_value(hash_table(bench.paths(), 0));
  }
  CHECK(bench.track_count() >= 12);
  return hash.value();
}

}  // namespace

TEST_CASE("tracker publish: gives a copy predicted to a time, and keeps the state") {
  TrackerBench bench;
  drive(bench, kNan);
  const double x_now = bench.tracks_at(1.0).x_m[0], v = bench.tracks_at(1.0).speed_mps[0];
  CHECK(v == doctest::Approx(20));
  CHECK(bench.tracks_at(1.5).x_m[0] == doctest::Approx(x_now + 0.5 * v));
  CHECK(bench.tracks_at(1.5).stamp_ns[0] == to_ns(1.5));
  CHECK(bench.tracks_at(1.5).measured_ns[0] == to_ns(1.0));
  CHECK(bench.tracks_at(0.9).x_m[0] == doctest::Approx(x_now - 0.1 * v));
  CHECK(bench.tracks_at(1.0).x_m[0] == x_now);
}

TEST_CASE("tracker publish: the flag stale is set from half a second after the last measurement, at the given time") {
  TrackerBench bench;
  drive(bench, 0.0);  // last measured at 1 s
  CHECK((bench.tracks_at(1.5).flags[0] & kTrackStale) == 0);
  CHECK((bench.tracks_at(1.500001).flags[0] & kTrackStale) != 0);
  CHECK((bench.tracks_at(1.9).flags[0] & kTrackStale) != 0);
}

TEST_CASE("tracker publish: the covariance grows ahead, and has no noise before the state's time") {
  TrackerBench bench;
  drive(bench, kNan);
  const double var_v = bench.tracks_at(1.0).covariance[5][0];
  CHECK(bench.tracks_at(1.5).covariance[5][0] == doctest::Approx(var_v + 0.5 * 10));
  CHECK(bench.tracks_at(0.9).covariance[5][0] == doctest::Approx(var_v));
}

TEST_CASE("tracker publish: every point of a path equals the track published at its time") {
  TrackerBench bench;
  bench.frame.ego = {true, 0, 0, 0, 25};
  for (int k = 0; k < 40; ++k) {
    const double angle = 0.4 * 0.05 * k;  // a circle of 50 m at 20 m/s
    bench.step(0.05 * k, {{50 * std::sin(angle), 50 - 50 * std::cos(angle)}});
  }
  REQUIRE(bench.tracker.path_points() == 30);
  for (int point = 0; point < 30; ++point) {
    bench.tracks_at(1.95);
    const auto i = std::size_t(point);
    REQUIRE(bench.paths().count == 30);
    const double x = bench.paths().x_m[i], y = bench.paths().y_m[i], var_x = bench.paths().var_x[i],
                 cov = bench.paths().cov_xy[i], course = bench.paths().course_rad[i];
    const TrackTable& then = bench.tracks_at(1.95 + 0.1 * (point + 1));
    CAPTURE(point);
    CHECK(x == doctest::Approx(then.x_m[0]).epsilon(1e-9));
    CHECK(y == doctest::Approx(then.y_m[0]).epsilon(1e-9));
    CHECK(var_x == doctest::Approx(then.covariance[0][0]).epsilon(1e-6));
    CHECK(cov == doctest::Approx(then.covariance[1][0]).epsilon(1e-6));
    CHECK(course == doctest::Approx(then.course_rad[0]).epsilon(1e-9));
  }
}

TEST_CASE("tracker publish: rows are by slot, each with the row of its detection") {
  TrackerBench bench;
  bench.step(0.0, {{-50, 0}, {10, 0}, {30, 0}});  // the nearest get their slots first
  const TrackTable& t = bench.tracks();
  REQUIRE(t.count == 3);
  CHECK(t.x_m[0] == 10);
  CHECK(t.x_m[1] == 30);
  CHECK(t.x_m[2] == -50);
  CHECK(t.detection[0] == 1);
  CHECK(t.detection[2] == 0);
  for (int i = 0; i < 3; ++i) {
    CHECK(slot_of(t.id[i]) == uint32_t(i));
    CHECK(t.id[i] == bench.ids[std::size_t(t.detection[i])]);
  }
  bench.step(0.05, {{10, 0}});
  CHECK(bench.tracks().detection[0] == 0);
  CHECK(bench.tracks().detection[1] == -1);
}

TEST_CASE("tracker publish: the heading is that of the last detection, advanced by the yaw rate") {
  TrackerBench bench;
  bench.frame.ego = {true, 0, 0, 0, 25};
  for (int k = 0; k < 300; ++k) {
    const double angle = 0.4 * 0.05 * k;
    const double heading = wrap_angle(angle + 0.1);  // 0.1 rad of sideslip
    bench.step(0.05 * k, {{50 * std::sin(angle), 50 - 50 * std::cos(angle), heading}});
  }
  const double measured = 0.4 * 14.95 + 0.1;
  CHECK(std::fabs(wrap_angle(bench.tracks_at(14.95).heading_rad[0] - measured)) < 1e-12);
  const double omega = bench.tracks().yaw_rate_rps[0];
  CHECK(omega == doctest::Approx(0.4).scale(0).epsilon(0.1));
  CHECK(std::fabs(wrap_angle(bench.tracks_at(15.25).heading_rad[0] - measured - 0.3 * omega)) < 1e-12);
  // After a detection without heading, the last heading stays and is advanced.
  bench.step(15.0, {{50 * std::sin(6.0), 50 - 50 * std::cos(6.0)}});
  CHECK(std::fabs(wrap_angle(bench.tracks_at(15.0).heading_rad[0] - measured - 0.05 * omega)) < 1e-12);
}

TEST_CASE("tracker publish: a track without a measured heading has its course as heading") {
  TrackerBench bench;
  drive(bench, kNan);
  CHECK(bench.tracks().heading_rad[0] == bench.tracks().course_rad[0]);
}

TEST_CASE("tracker publish: a confirmed track in motion reverses a heading that opposes its course") {
  struct Case {
    double heading_rad, expected_rad;
  };
  for (const Case c : {Case{0.2, 0.2}, Case{1.5, 1.5}, Case{-1.5, -1.5}, Case{1.65, 1.65 - kPi}, Case{3.1, 3.1 - kPi},
                       Case{-3.0, kPi - 3.0}}) {
    CAPTURE(c.heading_rad);
    TrackerBench bench;
    drive(bench, c.heading_rad);
    CHECK(bench.tracks().heading_rad[0] == doctest::Approx(c.expected_rad));
  }
}

TEST_CASE("tracker publish: in the vehicle frame an overtaken car keeps its heading, although it moves backwards") {
  TrackerBench bench;
  bench.frame.in_map = false;
  for (int k = 0; k < 21; ++k) bench.step(0.05 * k, {{50 - k * 1.0, 0, 0.1}});
  const TrackTable& t = bench.tracks();
  REQUIRE(t.state[0] == int32_t(TrackState::kConfirmed));
  CHECK(t.speed_mps[0] > 10);
  CHECK(std::fabs(t.course_rad[0]) > 3);
  CHECK(std::fabs(t.heading_rad[0] - 0.1) < 0.1);
}

TEST_CASE("tracker publish: a tentative track and a standing one keep the measured heading") {
  TrackerBench tentative;
  drive(tentative, 3.0, 5);
  CHECK(tentative.tracks().heading_rad[0] == doctest::Approx(3.0));
  TrackerBench standing;
  for (int k = 0; k < 40; ++k) standing.step(0.05 * k, {{10, 0, 3.0}});
  REQUIRE(standing.tracks().state[0] == int32_t(TrackState::kConfirmed));
  CHECK(std::fabs(wrap_angle(standing.tracks().heading_rad[0] - 3.0)) < 0.01);
}

TEST_CASE("tracker publish: the extent is that of the last detection with an extent") {
  TrackerBench bench;
  bench.step(0.0, {{10, 0}});
  CHECK(bench.tracks().length_m[0] == 0);
  bench.step(0.05, {{10, 0, kNan, 0, 4.5, 1.7}});
  bench.step(0.10, {{10, 0}});
  CHECK(bench.tracks().length_m[0] == 4.5);
  CHECK(bench.tracks().width_m[0] == 1.7);
}

TEST_CASE("tracker publish: the same frames give the same bytes") {
  CHECK(run_traffic(5, false) == run_traffic(5, false));
}

namespace {

// The columns that the paper's tracker writes.
struct PaperPaths : PathTable {};
template <class F>
void for_each_column(PaperPaths& t, F&& f) {
#define OVT_PATH(type, name, ...) f(#name, t.name);
#include "core/columns.def"
}

}  // namespace

TEST_CASE("tracker publish: the golden hash of 2000 frames holds on every compiler and machine") {
  // Twelve cars on springs, moved only by multiply and add, so that libm has no influence.
  std::mt19937_64 random(3);
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * double(random() >> 11) / 9007199254740992.0;
  };
  struct Car {
    double x_m, y_m, vx_mps, vy_mps;
  } cars[12];
  for (Car& car : cars) {
    car.x_m = uniform(-100, 100);
    car.y_m = uniform(-100, 100);
    car.vx_mps = uniform(-40, 40);
    car.vy_mps = uniform(-40, 40);
  }
  TrackerBench bench;
  Hash hash;
  for (int k = 0; k < 2000; ++k) {
    std::vector<TestDetection> detections;
    for (Car& car : cars) {
      car.vx_mps -= 0.0025 * car.x_m;
      car.vy_mps -= 0.0025 * car.y_m;
      car.x_m += 0.05 * car.vx_mps;
      car.y_m += 0.05 * car.vy_mps;
      if (uniform(0, 1) > 0.9) continue;
      TestDetection d;
      d.x_m = car.x_m + uniform(-0.4, 0.4);
      d.y_m = car.y_m + uniform(-0.4, 0.4);
      d.heading_rad = uniform(-3, 3);
      d.late_s = uniform(0, 0.05);
      detections.push_back(d);
    }
    bench.step_ns(int64_t(k) * 50000000, detections);
    hash.add_value(hash_table(bench.tracks_at_ns(int64_t(k) * 50000000 + 10000000), 0));
    hash.add_value(hash_table(PaperPaths{bench.paths()}, 0));
  }
  constexpr uint64_t kGolden = 0xd9e29768fb64df57u;
  INFO("new hash " << hash.value() << ", golden hash " << kGolden);
  CHECK(hash.value() == kGolden);
}

TEST_CASE("tracker publish: the order of a frame's rows changes nothing") {
  for (const uint64_t seed : {5u, 6u, 7u}) {
    CAPTURE(seed);
    CHECK(run_traffic(seed, true) == run_traffic(seed, false));
  }
}

TEST_CASE("tracker publish: other detections give other bytes") {
  CHECK(run_traffic(5, false) != run_traffic(6, false));
}

TEST_CASE("tracker publish: absurd numbers are rejected and counted, and everything stays finite") {
  const double inf = std::numeric_limits<double>::infinity();
  constexpr int64_t kFirst = std::numeric_limits<int64_t>::min(), kLast = std::numeric_limits<int64_t>::max();
  const double absurd[] = {kNan, inf, -inf, 1e308, -1e308, 1e9, 5e-324};
  std::mt19937_64 random(41);
  const auto pick = [&]() { return random() % 2 ? 1.0 : absurd[random() % std::size(absurd)]; };
  const int64_t stamps[] = {kFirst, kFirst + 1, -1, 0, 1, to_ns(1), kLast - 1, kLast};
  TrackerBench bench;
  ObservedSector sector{};
  for (int n = 0; n < 5000; ++n) {
    CAPTURE(n);
    bench.frame.ego = {random() % 2 == 0, pick(), pick(), pick(), pick()};
    sector = {pick(), pick(), pick(), pick(), pick(), pick()};
    bench.frame.sectors = &sector;
    bench.frame.sector_count = int32_t(random() % 3) - 1 > 0 ? 1 : -1;
    std::vector<TestDetection> detections(random() % 4);
    for (TestDetection& d : detections) d = {pick(), pick(), pick(), 0, pick(), pick(), pick(), pick(), pick()};
    bench.step_ns(random() % 4 ? to_ns(0.01 * n) : stamps[random() % std::size(stamps)], detections);
    if (bench.last.late && random() % 4 == 0) bench.tracker.restart();
    REQUIRE(is_finite(bench.predicted_to_ns(stamps[random() % std::size(stamps)])));
    REQUIRE(is_finite(bench.tracks_at_ns(stamps[random() % std::size(stamps)])));
    REQUIRE(is_finite(bench.paths()));
  }
  CHECK(bench.tracker.counts().rejected > 500);
  CHECK(bench.tracker.counts().births > 100);
}

TEST_CASE("tracker publish: a detection whose stamp is far from its frame's is rejected") {
  TrackerBench bench;
  bench.step(10.0, {{10, 0, kNan, 0.99}, {30, 0, kNan, 1.01}, {50, 0, kNan, -1.01}});
  CHECK(bench.ids[0] != kNobody);
  CHECK(bench.ids[1] == kNobody);
  CHECK(bench.ids[2] == kNobody);
  CHECK(bench.tracker.counts().rejected == 2);
}

TEST_CASE("tracker publish: parameters of any value give a working tracker") {
  for (const double absurd : {0.0, -1.0, kNan, 1e300}) {
    CAPTURE(absurd);
    TrackerParams p;
    p.predict_step_s = p.horizon_s = p.horizon_step_s = p.max_silence_s = absurd;
    p.window = p.track_capacity = p.detection_capacity = -1;
    CvtrTracker tracker(p, nullptr);
    CHECK(tracker.path_points() >= 0);
    CHECK(tracker.path_points() <= 60000);
    const Measurement z = {.x_m = 1, .y_m = 2, .stamp_ns = 5};
    TrackerFrame frame;
    frame.stamp_ns = z.stamp_ns;
    frame.measurements = {&z, 1};
    TrackId id = kNobody;
    tracker.step(frame, &id);
    CHECK(id != kNobody);
  }
}

TEST_CASE("tracker publish: a snapshot published later equals the tracker published at that time") {
  TrackerBench bench;
  bench.frame.ego = {true, 0, 0, 0, 25};
  for (int k = 0; k < 30; ++k) bench.step(0.05 * k, {{k * 1.0, 0.01 * k * k, 3.0}, {50, 20.0 + k}});
  Arena arena;
  TrackTable snapshot, tracks;
  std::byte* states = nullptr;
  PathTable paths;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) {
    carve_table(carver, snapshot, 256);
    states = carver.take<std::byte>(256 * bench.tracker.state_bytes());
    carve_table(carver, tracks, 256);
    carve_table(carver, paths, 256 * bench.tracker.path_points());
    paths.points_per_track = bench.tracker.path_points();
  }));
  bench.tracker.snapshot(snapshot, states);
  const TrackTable& expected = bench.tracks_at(1.6);
  for (int k = 30; k < 40; ++k) bench.step(0.05 * k, {{k * 1.0, 0, 1.0}});  // the tracker has moved on
  bench.tracker.publish(snapshot, states, to_ns(1.6), tracks, nullptr, &paths);
  REQUIRE(tracks.count == 2);
  CHECK(hash_table(tracks, 0) == hash_table(expected, 0));
  CHECK(hash_table(paths, 0) == hash_table(bench.paths(), 0));
  CHECK(snapshot.stamp_ns[0] == to_ns(1.45));
}

TEST_CASE("tracker publish: for an absurd time a track is predicted by 60 s, as reported") {
  TrackerBench bench;
  drive(bench, kNan);
  CHECK(bench.tracks_at_ns(std::numeric_limits<int64_t>::max()).stamp_ns[0] == to_ns(61));
  CHECK(bench.tracks_at_ns(std::numeric_limits<int64_t>::min()).stamp_ns[0] == to_ns(-59));
}

TEST_CASE("tracker publish: from the first frame on there is no heap call") {
  if (!overtake::test::can_count_heap_calls()) {
    MESSAGE("skipped: a sanitizer owns the heap");
    return;
  }
  // A full table, more detections than capacity, paths, restarts.
  TrackerParams p;
  p.track_capacity = p.detection_capacity = 32;
  TrackerBench bench(p);
  std::mt19937_64 random(42);
  std::uniform_real_distribution<double> place(-60, 60);
  std::vector<Measurement> measurements(64);
  std::vector<TrackId> ids(64);
  const int64_t before = overtake::test::count_heap_calls();
  for (int k = 0; k < 1000; ++k) {
    for (Measurement& z : measurements) {
      z.x_m = place(random);
      z.y_m = place(random);
      z.stamp_ns = to_ns(0.05 * k) - int64_t(random() % 50000000);
    }
    TrackerFrame frame;
    frame.stamp_ns = to_ns(0.05 * k - (k % 7 == 0 ? 0.12 : 0.0));  // some out of sequence
    frame.measurements = {measurements.data(), random() % 65};
    bench.tracker.step(frame, ids.data());
    if (k % 100 == 99) bench.tracker.restart();
    bench.tracks_at(0.05 * k);
  }
  CHECK(overtake::test::count_heap_calls() == before);
  CHECK(bench.tracker.counts().overflow() > 0);
  CHECK(bench.tracker.counts().replays > 100);
  const CvtrTracker another(p, nullptr);  // the counter itself counts
  CHECK(overtake::test::count_heap_calls() > before);
}
