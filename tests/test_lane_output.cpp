// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the tracker of preset `best` tells a planner of each track.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/math.h"
#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::make_ring, test::ns_of, test::seen_car;

}  // namespace

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
  CHECK(told(4, -12).visibility == Visibility::kOwnShadow);
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

TEST_CASE("lane tracker: a track that a detection or faint points updated is seen, also where they are no hit of it") {
  for (const bool faint : {false, true}) {
    CAPTURE(faint);
    LaneBench bench;
    bench.follow(2);
    for (int32_t k = 2; k < 4; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      Measurement z = seen_car(50 * kFrame_s * k, 0, k);
      z.debris = !faint, z.faint = faint, z.points = 2;
      bench.step(k, {z});
      REQUIRE(bench.rows.count == 1);
      REQUIRE_FALSE(bench.is_confirmed());
      CHECK(bench.state().history == (k == 2 ? 0b110 : 0b1100));
      bench.publish_at(bench.input.stamp_ns);
      CHECK(Visibility(bench.told.visibility[0]) == Visibility::kSeen);
      CHECK(bench.told.unseen_s[0] == 0);
      CHECK(bench.published.detection[0] == (faint ? -1 : 0));
    }
    bench.step(4, {});
    bench.publish_at(bench.input.stamp_ns);
    CHECK(Visibility(bench.told.visibility[0]) == Visibility::kMissed);
  }
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

  // Two parts of one car come together, and the elder's part is not seen any more. (The other one is not known for so
  // long that it must be another car.)
  LaneBench parts;
  for (int32_t k = 0; k < 60 && (k < 40 || parts.rows.count == 2); ++k) {
    const double x_m = 50 * kFrame_s * k;
    parts.ego_at(x_m - 30);
    std::vector<Measurement> seen;
    if (k < 40) seen.push_back(seen_car(x_m, 0, k));
    if (k > 26) seen.push_back(seen_car(x_m - 6.0 + 0.1 * std::max(0, k - 15), 0, k));
    parts.step(k, seen);
    if (k == 39) REQUIRE(parts.confirmed() == 2);
  }
  REQUIRE(parts.rows.count == 1);
  CHECK(parts.state().uncorrected_s > 0);  // of the elder
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

namespace {

struct NoiseShares {
  double along, across;
  double steady_along, steady_across, steady_speed, steady_drift;  // of a car that goes on: PathNoise
};

// The noise in the variance of a path, 2 s ahead, as a multiple of that of path_speed and of path_across.
// The car drives along x at 50 m/s; from frame 30 on it brakes by brake_mps2 and drives across its lane at across_mps.
NoiseShares path_shares(int32_t frames, double brake_mps2 = 0.0, double across_mps = 0.0) {
  constexpr double kSpeedNoise = 10.0, kAcross_mps = 0.4, kAhead_s = 2.0;
  const test::CircleRoad road = make_ring(1e6);
  const auto variances = [&](double path_speed, double path_across) {
    TrackerParams params = LaneBench::of_best();
    params.lane.path_speed = path_speed;
    params.lane.path_across = path_across;
    LaneBench bench(&road.map, params);
    double x_m = 0, y_m = 0, v_mps = 50;
    for (int32_t k = 0; k < frames; ++k) {
      bench.ego_at(x_m - 30);
      bench.step(k, {seen_car(x_m, y_m, k)});
      x_m += v_mps * kFrame_s;
      if (k < 30) continue;
      v_mps -= brake_mps2 * kFrame_s;
      y_m += across_mps * kFrame_s;
    }
    const int32_t points = path_points(params, kAhead_s);
    Arena arena;
    PathTable paths;
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, paths, points); }));
    paths.points_per_track = points;
    bench.tracker->publish(bench.rows, bench.states, ns_of(frames - 1), bench.published, &bench.told, &paths);
    REQUIRE(paths.count == points);
    const double along_m = paths.steady_along_m[points - 1], across_m = paths.steady_across_m[points - 1];
    return std::array{paths.var_x[points - 1], paths.var_y[points - 1], along_m * along_m, across_m * across_m};
  };
  const auto none = variances(0, 0), both = variances(kSpeedNoise, kAcross_mps);
  const double along_m2 = kSpeedNoise * kAhead_s * kAhead_s * kAhead_s / 3.0, across_m = kAcross_mps * kAhead_s;
  const double across_m2 = across_m * across_m;
  return {(both[0] - none[0]) / along_m2, (both[1] - none[1]) / across_m2, none[2] / none[0], none[3] / none[1],
          (both[2] - none[2]) / along_m2, (both[3] - none[3]) / across_m2};
}

}  // namespace

TEST_CASE("lane tracker: the path of a track without a course spreads to all sides, as the track does") {
  const TrackerParams params = LaneBench::of_best();
  LaneBench bench(nullptr, params);
  bench.input.ego.known = false;
  Measurement z = seen_car(7, 3, 0);
  z.points = 0, z.var_x = z.var_y = 0.04;
  bench.step(0, {z});
  const int32_t points = path_points(params, params.horizon_s);
  Arena arena;
  PathTable paths;
  REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, paths, points); }));
  paths.points_per_track = points;
  bench.tracker->publish(bench.rows, bench.states, ns_of(2), bench.published, &bench.told, &paths);
  REQUIRE(paths.count == points);
  for (int32_t k = 0; k < points; ++k) {
    const double deviation_m = 30 * (0.1 + params.horizon_step_s * (k + 1));
    CHECK(paths.x_m[k] == 7);
    CHECK(paths.y_m[k] == 3);
    CHECK(paths.var_x[k] == doctest::Approx(0.04 + deviation_m * deviation_m).epsilon(1e-9));
    CHECK(paths.var_y[k] == paths.var_x[k]);
    CHECK(paths.cov_xy[k] == 0);
    CHECK(paths.steady_across_m[k] == paths.steady_along_m[k]);
  }
}

TEST_CASE("lane tracker: a steady car has a narrow path, one that changes its speed or its place a wide one") {
  const NoiseShares new_car = path_shares(4), steady = path_shares(30);
  CHECK(new_car.along == doctest::Approx(1.0));
  CHECK(new_car.across == doctest::Approx(1.0));
  CHECK(steady.along == doctest::Approx(0.3).epsilon(0.05));
  CHECK(steady.across == doctest::Approx(0.8).epsilon(0.05));
  CHECK(new_car.steady_along == doctest::Approx(1.0));
  CHECK(new_car.steady_across == doctest::Approx(1.0));
  CHECK(steady.steady_along == doctest::Approx(0.012).scale(0).epsilon(0.1));
  CHECK(steady.steady_across == doctest::Approx(0.055).scale(0).epsilon(0.1));
  CHECK(steady.steady_speed == doctest::Approx(0.0015).scale(0).epsilon(0.01));
  CHECK(steady.steady_drift == doctest::Approx(0.002).scale(0).epsilon(0.1));
  const NoiseShares braking = path_shares(36, 18.0), changing = path_shares(36, 0.0, 3.0);
  const NoiseShares shifting = path_shares(36, 0.0, 0.3);  // a lag below one deviation: no limit holds
  CHECK(braking.along > 3.0);
  CHECK(braking.along <= 9.3);
  CHECK(braking.across < 1.5);
  CHECK(changing.along < 1.0);
  CHECK(changing.across > 2.0);
  CHECK(changing.across <= 5.301);
  CHECK(braking.steady_along > 0.9);
  CHECK(braking.steady_across < 0.5);
  CHECK(changing.steady_along < 0.5);
  CHECK(changing.steady_across > 0.9);
  CHECK(changing.steady_drift > 0.3);
  const double lag2 = 2.0 * (shifting.across - 0.8);
  CHECK(lag2 > 0.2);
  CHECK(shifting.steady_across == doctest::Approx(0.055 + lag2).epsilon(1e-6));
  CHECK(shifting.steady_drift == doctest::Approx(0.002 + 0.4 * lag2).epsilon(1e-6));
}
