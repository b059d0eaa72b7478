// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_tracker.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "core/cluster_table.h"
#include "core/math.h"
#include "core/table.h"
#include "tests/support/circle_road.h"

namespace {

using namespace overtake;

constexpr double kFrame_s = 0.05;
int64_t ns_of(int32_t frame) { return int64_t(frame) * 50'000'000; }

// A detection that shows most of a car.
Measurement seen_car(double x_m, double y_m, int32_t frame) {
  return {.x_m = x_m,
          .y_m = y_m,
          .var_x = 0.01,
          .var_y = 0.01,
          .cov_xy = 0,
          .length_m = 4.5,
          .width_m = 1.8,
          .stamp_ns = ns_of(frame),
          .height_m = 1.0,
          .object_class = int32_t(ObjectClass::kCar),
          .view = int32_t(CarView::kRear),
          .points = 1000};
}

class LaneBench {
 public:
  explicit LaneBench(const CircuitMap* map = nullptr, const TrackerParams& params = of_best())
      : tracker(make_lane_tracker(params, map, default_allocator())) {
    REQUIRE(arena_.build(default_allocator(), [&](Carver& carver) {
      carve_table(carver, rows, params.track_capacity);
      carve_table(carver, published, params.track_capacity);
      carve_table(carver, told, params.track_capacity);
      states = carver.take<std::byte>(std::size_t(params.track_capacity) * tracker->state_bytes());
    }));
    input.ego = {true, 0, 0, 0, 50};
    input.ask_map = map != nullptr;
  }
  static TrackerParams of_best() {
    TrackerParams p;
    p.gate_d2 = 25;
    p.max_silence_s = 12;
    p.track_capacity = p.detection_capacity = 32;
    return p;
  }

  const std::vector<TrackId>& step(int32_t frame, const std::vector<Measurement>& seen) {
    ids.assign(seen.size(), kNobody);
    input.stamp_ns = ns_of(frame);
    input.measurements = seen;
    tracker->step(input, ids.data());
    tracker->snapshot(rows, states);
    return ids;
  }
  // Publishes the tracks of the last step into `published` and `told`.
  void publish_at(int64_t publish_ns) { tracker->publish(rows, states, publish_ns, published, &told, nullptr); }
  LaneTrack state(int32_t row = 0) const {
    LaneTrack state;
    std::memcpy(&state, states + std::size_t(row) * sizeof state, sizeof state);
    return state;
  }
  bool is_confirmed(int32_t row = 0) const {
    return row < rows.count && rows.state[row] == int32_t(TrackState::kConfirmed);
  }
  int32_t confirmed() const {
    int32_t count = 0;
    for (int32_t i = 0; i < rows.count; ++i) count += is_confirmed(i);
    return count;
  }
  // A car that drives along x at 50 m/s, seen in `frames` frames; the ego vehicle follows 30 m behind.
  TrackId follow(int32_t frames, double y_m = 0) {
    TrackId id = kNobody;
    for (int32_t k = 0; k < frames; ++k) {
      ego_at(50 * kFrame_s * k - 30);
      id = step(k, {seen_car(50 * kFrame_s * k, y_m, k)})[0];
    }
    return id;
  }
  void ego_at(double x_m) { input.ego.x_m = x_m; }

  std::unique_ptr<FrameTracker> tracker;
  TrackerFrame input;
  TrackTable rows, published;
  OptionalTrackTable told;
  std::byte* states = nullptr;
  std::vector<TrackId> ids;

 private:
  Arena arena_;
};

test::CircleRoad make_ring(double radius_m) {
  test::CircleRoadDef def;
  def.radius_m = radius_m;
  return test::CircleRoad(def);
}

// On the centre line of a left-hand ring through the origin, `way_m` along it.
Place on_ring(double radius_m, double way_m) {
  return {radius_m * std::sin(way_m / radius_m), radius_m * (1 - std::cos(way_m / radius_m))};
}

}  // namespace

TEST_CASE("lane tracker: a car is confirmed at its third hit, a low, sparse or narrow object is not") {
  const auto confirmed_at = [](auto change) {
    LaneBench bench;
    for (int32_t k = 0; k < 40; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      Measurement z = seen_car(50 * kFrame_s * k, 0, k);
      change(z);
      bench.step(k, {z});
      if (bench.is_confirmed()) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at([](Measurement&) {}) == 3);
  CHECK(confirmed_at([](Measurement& z) { z.height_m = 0.2; }) == 0);
  CHECK(confirmed_at([](Measurement& z) { z.points = 1; }) == 0);
  CHECK(confirmed_at([](Measurement& z) { z.object_class = 0, z.width_m = 0.4, z.points = 5; }) == 0);
  CHECK(confirmed_at([](Measurement& z) { z.object_class = 0; }) > 3);  // not surely a car: later
  // Pushed rows have no features.
  CHECK(confirmed_at([](Measurement& z) { z.height_m = kNotMeasured, z.object_class = 0, z.points = 0; }) == 3);
}

TEST_CASE("lane tracker: objects among many others that no car explains are confirmed later or not at all") {
  const auto confirmed_after = [](int32_t others, bool pushed = false) {
    std::mt19937_64 random(5);
    LaneBench bench;
    for (int32_t k = 0; k < 10; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      std::vector<Measurement> seen = {seen_car(50 * kFrame_s * k, 0, k)};
      for (int32_t i = 0; i < others; ++i) {
        const double angle = std::uniform_real_distribution<double>(0, 6.28)(random);
        seen.push_back(seen_car(seen[0].x_m + 8 * std::cos(angle), 8 * std::sin(angle), k));
      }
      if (pushed)
        for (Measurement& z : seen) z.height_m = kNotMeasured;
      bench.step(k, seen);
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (bench.is_confirmed(i)) return k + 1;
    }
    return 100;
  };
  CHECK(confirmed_after(0) == 3);
  CHECK(confirmed_after(12) > 3);
  CHECK(confirmed_after(30) > 4);
  CHECK(confirmed_after(30, true) == 3);  // pushed rows may be traffic
}

TEST_CASE("lane tracker: a known car that shows little of itself keeps its track") {
  LaneBench bench;
  const TrackId id = bench.follow(20);
  for (int32_t k = 20; k < 80; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    Measurement z = seen_car(50 * kFrame_s * k, 0, k);
    z.object_class = 0, z.points = 2, z.width_m = 0.2, z.height_m = 0.2;
    CHECK(bench.step(k, {z})[0] == id);
  }
  CHECK(bench.is_confirmed());
}

TEST_CASE("lane tracker: misses end what is in view; what another car hides, or the own wing, goes on") {
  // Seconds from the last detection until the track is no longer confirmed.
  const auto lasts_s = [](double ahead_m, bool behind_another) {
    TrackerParams params = LaneBench::of_best();
    params.lane.coast_sigma_m = 1e3;
    LaneBench bench(nullptr, params);
    for (int32_t k = 0; k < 140; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - ahead_m);
      std::vector<Measurement> seen;
      if (behind_another) seen.push_back(seen_car(x_m - 15, 0, k));
      if (k < 20) seen.push_back(seen_car(x_m, 0, k));
      bench.step(k, seen);
      if (k > 25 && bench.confirmed() == int32_t(behind_another)) return (k - 19) * kFrame_s;
    }
    return 100.0;
  };
  CHECK(lasts_s(40, false) < 1.5);
  CHECK(lasts_s(40, true) > 2.5);
  CHECK(lasts_s(-30, false) > 2.5);
  CHECK(lasts_s(-8, false) < 1.5);  // nearer than the shadow of the wing
  CHECK(lasts_s(40, true) < 4.5);   // and no longer than coast_s
}

TEST_CASE("lane tracker: a car that comes back keeps its id, also where it braked meanwhile") {
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

TEST_CASE("lane tracker: one car in two detections is one track, and both rows count as used") {
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

TEST_CASE("lane tracker: two tracks that turn out to be one car become the elder one") {
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

TEST_CASE("lane tracker: a car that is lost where a bend begins follows the lane, without a map it goes on as before") {
  constexpr double kRadius = 250;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto error_after_2s = [&](const CircuitMap* map) {
    LaneBench bench(map);
    for (int32_t k = 0; k <= 60; ++k) {  // along the ring's tangent, and lost where it touches the ring
      const Place at = {50 * kFrame_s * (k - 20), 0};
      bench.input.ego = {true, at.x_m - 30, at.y_m, 0, 50};
      bench.step(k, k <= 20 ? std::vector{seen_car(at.x_m, at.y_m, k)} : std::vector<Measurement>{});
    }
    const Place truth = on_ring(kRadius, 50 * kFrame_s * 40);
    return std::hypot(bench.rows.x_m[0] - truth.x_m, bench.rows.y_m[0] - truth.y_m);
  };
  CHECK(error_after_2s(&ring.map) < 7.0);
  CHECK(error_after_2s(nullptr) > 15.0);
}

TEST_CASE("lane tracker: the heading of a car that spins is measured, its course goes on") {
  LaneBench bench;
  constexpr double kSpin_rps = 3.0;
  double heading = 0;
  for (int32_t k = 0; k < 60; ++k) {
    bench.ego_at(30 * kFrame_s * k - 20);
    Measurement z = seen_car(30 * kFrame_s * k, 0, k);
    if (k >= 20) {
      heading = kSpin_rps * kFrame_s * (k - 20);
      z.heading_rad = wrap_angle(k % 3 == 0 ? heading : heading + kPi);  // a rectangle has no front
      z.free_heading = 1;
    }
    bench.step(k, {z});
    if (k == 19) CHECK(bench.rows.heading_rad[0] == bench.rows.course_rad[0]);
    if (k >= 30) CHECK(std::fabs(wrap_angle(bench.rows.heading_rad[0] - heading)) < 0.15);
  }
  CHECK(std::fabs(bench.rows.course_rad[0]) < 0.03);
  CHECK(bench.rows.speed_mps[0] == doctest::Approx(30).epsilon(0.03));
}

TEST_CASE("lane tracker: braking is noticed") {
  constexpr double kRadius = 3000;
  const test::CircleRoad ring = make_ring(kRadius);
  const auto speed_error = [&](double gain) {
    TrackerParams params = LaneBench::of_best();
    params.lane.manoeuvre_gain = gain;
    LaneBench bench(&ring.map, params);
    double way_m = 0, v_mps = 70, worst = 0;
    for (int32_t k = 0; k < 60; ++k) {
      if (k >= 30) v_mps -= 18 * kFrame_s;
      const Place at = on_ring(kRadius, way_m), ego = on_ring(kRadius, way_m - 40);
      bench.input.ego = {true, ego.x_m, ego.y_m, (way_m - 40) / kRadius, 50};
      bench.step(k, {seen_car(at.x_m, at.y_m, k)});
      if (k >= 45) worst = std::max(worst, std::fabs(bench.rows.speed_mps[0] - v_mps));
      way_m += v_mps * kFrame_s;
    }
    return worst;
  };
  CHECK(speed_error(10) < 2.5);
  CHECK(speed_error(1) > 1.3 * speed_error(10));
}

TEST_CASE("lane tracker: a car that stands is confirmed far away, and stays where it is while hidden") {
  const test::CircleRoad ring = make_ring(3000);
  LaneBench bench(&ring.map);
  bench.input.ego.speed_mps = 80;
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0.0, 0.3);
  double confirmed_m = 0;
  for (int32_t k = 0; k < 40; ++k) {
    bench.ego_at(80 * kFrame_s * k - 160);
    Measurement z = seen_car(noise(random), noise(random), k);
    z.var_x = z.var_y = 0.09, z.points = 6, z.width_m = 1.7;
    bench.step(k, k < 25 ? std::vector{z} : std::vector<Measurement>{});
    if (confirmed_m == 0 && bench.is_confirmed()) confirmed_m = 160 - 80 * kFrame_s * k;
  }
  CHECK(confirmed_m > 110);
  CHECK(bench.rows.speed_mps[0] < 1.0);
  CHECK(std::hypot(bench.rows.x_m[0], bench.rows.y_m[0]) < 1.0);
}

TEST_CASE("lane tracker: the existence probability is that of the score, also of a car that is lost") {
  LaneBench bench;
  const auto existence = [&](int64_t later_ns = 0) {
    bench.publish_at(bench.input.stamp_ns + later_ns);
    REQUIRE(bench.told.count == 1);
    return bench.told.existence[0];
  };
  double before = 0;
  for (int32_t k = 0; k < 20; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    bench.step(k, {seen_car(50 * kFrame_s * k, 0, k)});
    CHECK(existence() >= before);
    CHECK(existence() == doctest::Approx(1.0 / (1.0 + std::exp(-bench.state().score))).epsilon(1e-14));
    if (!bench.is_confirmed()) CHECK(existence() < 0.983);  // confirm_score
    before = existence();
  }
  CHECK(before == doctest::Approx(0.99966465).epsilon(1e-8));  // most_score
  CHECK(existence(500'000'000) == before);                     // a prediction sees nothing
  double when_lost = 1;
  for (int32_t k = 20; k < 60; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    bench.step(k, {});
    CHECK(existence() <= before);
    before = existence();
    if (when_lost == 1 && !bench.is_confirmed()) when_lost = before;
  }
  CHECK(bench.rows.state[0] == int32_t(TrackState::kTentative));  // and it is still there
  CHECK(when_lost <= 0.5);
  CHECK(before < 0.01);

  LaneBench low;
  for (int32_t k = 0; k < 3; ++k) {
    low.ego_at(50 * kFrame_s * k - 30);
    Measurement z = seen_car(50 * kFrame_s * k, 0, k);
    z.height_m = 0.1;
    low.step(k, {z});
  }
  low.publish_at(low.input.stamp_ns);
  REQUIRE(low.told.count == 1);
  CHECK(low.told.existence[0] < 0.2);
}

TEST_CASE("lane tracker: the class is that of most of the detections, and can change") {
  LaneBench bench;
  int32_t frame = 0;
  const auto class_after = [&](int32_t frames, ObjectClass seen, bool pushed = false) {
    for (const int32_t end = frame + frames; frame < end; ++frame) {
      bench.ego_at(50 * kFrame_s * frame - 30);
      Measurement z = seen_car(50 * kFrame_s * frame, 0, frame);
      z.object_class = int32_t(seen), z.debris = seen == ObjectClass::kDebris;
      if (pushed) z.height_m = kNotMeasured;
      bench.step(frame, {z});
    }
    bench.publish_at(bench.input.stamp_ns);
    REQUIRE(bench.told.count == 1);
    return ObjectClass(bench.told.object_class[0]);
  };
  CHECK(class_after(8, ObjectClass::kUnknown, true) == ObjectClass::kUnknown);
  CHECK(class_after(1, ObjectClass::kCar) == ObjectClass::kCar);
  CHECK(class_after(40, ObjectClass::kCar) == ObjectClass::kCar);
  CHECK(class_after(20, ObjectClass::kUnknown) == ObjectClass::kCar);
  CHECK(class_after(9, ObjectClass::kDebris) == ObjectClass::kCar);  // partly hidden
  CHECK(class_after(1, ObjectClass::kDebris) == ObjectClass::kUnknown);
  CHECK(class_after(1, ObjectClass::kDebris) == ObjectClass::kDebris);
  CHECK(class_after(40, ObjectClass::kDebris) == ObjectClass::kDebris);
  CHECK(class_after(11, ObjectClass::kCar) == ObjectClass::kCar);
}

TEST_CASE("lane tracker: the visibility tells why a car has no detection, and the time how long") {
  // Of a car `ahead_m` ahead of the ego vehicle, in the given frame after its last detection.
  struct Told {
    Visibility visibility;
    double unseen_s;
    bool coasting;
  };
  const auto told = [](int32_t frames, double ahead_m, bool behind_another = false, bool in_view = true) {
    LaneBench bench;
    const double front_m = ahead_m - 15;
    for (int32_t k = 0; k < 20 + frames; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - ahead_m);
      const ObservedSector left = {x_m - ahead_m, 0, 3.0, 0.3, 0, 300};
      if (!in_view && k >= 20) bench.input.sectors = &left, bench.input.sector_count = 1;
      std::vector<Measurement> seen;
      if (k < 20) seen.push_back(seen_car(x_m, 0, k));
      if (behind_another) seen.push_back(seen_car(x_m - ahead_m + front_m, 0, k));
      bench.step(k, seen);
    }
    bench.publish_at(bench.input.stamp_ns);
    REQUIRE(bench.rows.count == 1 + int32_t(behind_another));
    const std::size_t row = behind_another;  // the nearer car's track is the first
    return Told{Visibility(bench.told.visibility[row]), bench.told.unseen_s[row],
                (bench.published.flags[row] & kTrackCoasting) != 0};
  };
  const Told seen = told(0, 40);
  CHECK(seen.visibility == Visibility::kSeen);
  CHECK(seen.unseen_s == 0);
  CHECK_FALSE(seen.coasting);
  const Told missed = told(4, 40);
  CHECK(missed.visibility == Visibility::kMissed);
  CHECK(missed.unseen_s == doctest::Approx(0.2));
  CHECK(missed.coasting);
  CHECK(told(4, 40, true).visibility == Visibility::kHidden);
  CHECK(told(0, 40, true).visibility == Visibility::kSeen);
  CHECK(told(4, -30).visibility == Visibility::kOwnShadow);
  CHECK(told(4, -8).visibility == Visibility::kMissed);
  CHECK(told(4, 40, false, false).visibility == Visibility::kOutside);
  CHECK(told(30, 40, false, false).unseen_s == doctest::Approx(1.5));

  LaneBench bench;
  bench.follow(10);
  bench.publish_at(bench.input.stamp_ns + 700'000'000);
  CHECK(bench.told.unseen_s[0] == doctest::Approx(0.7));
  bench.publish_at(bench.input.stamp_ns - 700'000'000);
  CHECK(bench.told.unseen_s[0] == 0);
}

TEST_CASE("lane tracker: a track that goes on for another one has its visibility") {
  LaneBench bench;
  bench.follow(40);
  for (int32_t k = 40; k < 60; ++k) {  // lost, then found 8 m farther back
    bench.ego_at(50 * kFrame_s * k - 30);
    const Measurement z = seen_car(50 * kFrame_s * k - 8, 0, k);
    bench.step(k, k < 50 ? std::vector<Measurement>{} : std::vector{z});
  }
  REQUIRE(bench.rows.count == 1);
  REQUIRE(bench.tracker->counts().joined == 1);
  bench.publish_at(bench.input.stamp_ns);
  CHECK(Visibility(bench.told.visibility[0]) == Visibility::kSeen);
  CHECK(ObjectClass(bench.told.object_class[0]) == ObjectClass::kCar);

  // Two parts of one car come together, and the elder's part is not seen any more.
  LaneBench parts;
  for (int32_t k = 0; k < 60 && (k < 40 || parts.rows.count == 2); ++k) {
    const double x_m = 50 * kFrame_s * k;
    parts.ego_at(x_m - 30);
    std::vector<Measurement> seen;
    if (k < 40) seen.push_back(seen_car(x_m, 0, k));
    if (k > 0) seen.push_back(seen_car(x_m - 6.0 + 0.1 * std::max(0, k - 15), 0, k));
    parts.step(k, seen);
    if (k == 39) REQUIRE(parts.confirmed() == 2);
  }
  REQUIRE(parts.rows.count == 1);
  CHECK(parts.state().unseen_s > 0);  // of the elder
  parts.publish_at(parts.input.stamp_ns);
  CHECK((parts.published.flags[0] & kTrackCoasting) == 0);
  CHECK(Visibility(parts.told.visibility[0]) == Visibility::kSeen);
}

TEST_CASE("lane tracker: the deviation of the heading is that of its source") {
  LaneBench bench;
  const auto sigma = [&](double later_s = 0) {
    bench.publish_at(bench.input.stamp_ns + int64_t(later_s * 1e9));
    REQUIRE(bench.told.count == 1);
    return bench.told.heading_sigma_rad[0];
  };
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  double sum_d2 = 0;
  for (int32_t k = 0; k < 120; ++k) {
    bench.ego_at(30 * kFrame_s * k - 20);
    Measurement z = seen_car(30 * kFrame_s * k, 0, k);
    const double heading = 2.0 * kFrame_s * (k - 20);
    if (k >= 20) z.heading_rad = wrap_angle(heading + std::clamp(noise(random), -0.2, 0.2)), z.free_heading = 1;
    bench.step(k, {z});
    if (k < 20) {  // the course, and the slip
      const double course_var = bench.rows.covariance[9][0];
      CHECK(sigma() == doctest::Approx(std::sqrt(course_var + 0.05 * 0.05)));
    } else if (k >= 30) {
      const double off = wrap_angle(bench.rows.heading_rad[0] - heading) / sigma();
      sum_d2 += off * off;
      CHECK(sigma() < 0.1);  // of one measurement
      CHECK(sigma(0.2) > 1.5 * sigma());
    }
  }
  CHECK(sum_d2 / 90 > 0.3);
  CHECK(sum_d2 / 90 < 2.0);
  const double later = sigma(1.0);  // the course again
  CHECK(later == doctest::Approx(std::sqrt(bench.published.covariance[9][0] + 0.05 * 0.05)));
}

TEST_CASE("lane tracker: frames in any order give the bytes of the sorted order, with map, losses and joins") {
  constexpr double kRadius = 200;
  const test::CircleRoad ring = make_ring(kRadius);
  std::mt19937_64 random(31);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  int64_t joined = 0, refiltered = 0;
  for (int32_t run = 0; run < 20; ++run) {
    struct Scene {
      TrackerFrame input;
      std::vector<Measurement> seen;
    };
    std::vector<Scene> scenes(120);
    double start_m[4], speed_mps[4];
    for (int32_t c = 0; c < 4; ++c) start_m[c] = draw(-60, 60), speed_mps[c] = draw(0, 70);
    for (int32_t k = 0; k < int32_t(scenes.size()); ++k) {
      Scene& scene = scenes[std::size_t(k)];
      const Place ego = on_ring(kRadius, 40 * kFrame_s * k);
      scene.input.stamp_ns = ns_of(k);
      scene.input.ego = {true, ego.x_m, ego.y_m, wrap_angle(40 * kFrame_s * k / kRadius), 40};
      scene.input.ask_map = k % 17 != 0;
      for (int32_t c = 0; c < 4; ++c) {
        if ((k / 20 + c) % 3 == 0 && draw(0, 1) < 0.9) continue;  // hidden for a second
        const Place at = on_ring(kRadius, start_m[c] + speed_mps[c] * kFrame_s * k);
        for (int32_t parts = draw(0, 1) < 0.2 ? 2 : 1; parts > 0; --parts) {
          Measurement z = seen_car(at.x_m + draw(-1, 1), at.y_m + draw(-1, 1), k);
          z.stamp_ns -= int64_t(draw(0, 40e6));
          z.height_m = draw(0, 1.2), z.points = int32_t(draw(1, 200)), z.view = int32_t(draw(0, 2.99));
          z.free_heading = draw(0, 1) < 0.3, z.heading_rad = draw(-3, 3), z.debris = draw(0, 1) < 0.05;
          scene.seen.push_back(z);
        }
      }
    }
    LaneBench sorted(&ring.map), late(&ring.map);
    const auto feed = [](LaneBench& bench, Scene& scene) {
      scene.input.measurements = scene.seen;
      bench.tracker->step(scene.input, nullptr);
    };
    for (Scene& scene : scenes) feed(sorted, scene);
    std::vector<std::size_t> order(scenes.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    for (std::size_t i = 1; i + 5 < order.size(); i += 5)
      std::shuffle(order.begin() + long(i), order.begin() + long(i) + 5, random);
    for (const std::size_t i : order) feed(late, scenes[i]);
    for (LaneBench* bench : {&sorted, &late}) bench->tracker->snapshot(bench->rows, bench->states);
    REQUIRE(sorted.rows.count == late.rows.count);
    CHECK(std::memcmp(sorted.states, late.states, std::size_t(sorted.rows.count) * sizeof(LaneTrack)) == 0);
    const TrackerCounts a = sorted.tracker->counts(), b = late.tracker->counts();
    CHECK(a.joined == b.joined);
    CHECK(a.hits == b.hits);
    CHECK(a.births == b.births);
    CHECK(b.late == 0);
    CHECK(a.measurements == a.hits + a.births + a.unborn + a.debris);
    CHECK(a.births == sorted.rows.count + a.deaths);
    joined += a.joined, refiltered += b.refiltered;
  }
  CHECK(joined > 0);
  CHECK(refiltered > 0);
}

TEST_CASE("lane tracker: any input leaves finite tracks") {
  constexpr double kRadius = 200;
  const test::CircleRoad ring = make_ring(kRadius);
  std::mt19937_64 random(41);
  const auto draw = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const double odd[] = {0, -0.0, 1e-300, 1e300, -1e9, kNotMeasured, std::numeric_limits<double>::infinity(), 1e8};
  const auto any = [&](double usual) { return draw(0, 1) < 0.1 ? odd[std::size_t(draw(0, 7.99))] : usual; };
  LaneBench bench(&ring.map);
  int64_t stamp_ns = 0;
  for (int32_t k = 0; k < 20000; ++k) {
    stamp_ns += int64_t(draw(0, 1) < 0.01 ? draw(-1e9, 9e9) : draw(-2e7, 1e8));
    std::vector<Measurement> seen;
    const Place ego = on_ring(kRadius, k * 2.0);
    for (int32_t i = int32_t(draw(0, 6)); i > 0; --i) {
      Measurement z = seen_car(any(ego.x_m + draw(-40, 40)), any(ego.y_m + draw(-40, 40)), 0);
      z.var_x = any(draw(0, 1)), z.var_y = any(draw(0, 1)), z.cov_xy = any(0);
      z.heading_rad = any(draw(-4, 4)), z.free_heading = 1, z.height_m = any(1), z.length_m = any(4),
      z.width_m = any(1);
      z.points = int32_t(draw(-5, 5000)), z.object_class = int32_t(draw(-2, 5)), z.view = int32_t(draw(-2, 5));
      z.stamp_ns = stamp_ns - int64_t(draw(0, 1) < 0.02 ? draw(-2e9, 2e9) : draw(0, 5e7));
      seen.push_back(z);
    }
    bench.input.stamp_ns = stamp_ns;
    bench.input.measurements = seen;
    bench.input.ego = {draw(0, 1) < 0.9, any(ego.x_m), any(ego.y_m), any(0.3), any(40)};
    bench.input.in_map = draw(0, 1) < 0.95, bench.input.ask_map = draw(0, 1) < 0.8;
    bench.tracker->step(bench.input, nullptr);
    bench.tracker->snapshot(bench.rows, bench.states);
    for (int32_t i = 0; i < bench.rows.count; ++i) {
      bool finite = true;
      for_each_column(bench.rows, [&](const char*, const auto* column) { finite &= std::isfinite(double(column[i])); });
      if (!finite) FAIL("frame " << k << ", track " << i);
    }
    bench.publish_at(stamp_ns + int64_t(any(draw(-1, 1)) > 0 ? 3e9 : -3e9));
    REQUIRE(bench.told.count == bench.rows.count);
    for (int32_t i = 0; i < bench.told.count; ++i) {
      const OptionalTrackTable& t = bench.told;
      const bool in_limits = t.existence[i] > 0 && t.existence[i] < 1 && t.unseen_s[i] >= 0 && t.unseen_s[i] < 100 &&
                             t.heading_sigma_rad[i] > 0 && t.heading_sigma_rad[i] <= kPi;
      if (!in_limits) FAIL("frame " << k << ", track " << i << ": existence, time or heading");
    }
    const TrackerCounts c = bench.tracker->counts();
    REQUIRE(c.births == bench.rows.count + c.deaths);
  }
  CHECK(bench.tracker->counts().hits > 1000);
}
