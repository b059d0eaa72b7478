// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`: which tracks are cars.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/lane_bench.h"

namespace {

using namespace overtake;
using test::kFrame_s, test::LaneBench, test::make_ring, test::ns_of, test::seen_car;

}  // namespace

TEST_CASE("lane existence: a car is confirmed at its third hit, a low or sparse object is not") {
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
  CHECK(confirmed_at([](Measurement& z) { z.object_class = 0; }) == 0);  // it never looks like a car
  // Pushed rows have no features, with or without a height.
  for (const double height_m : {kNotMeasured, 1.1})
    CHECK(confirmed_at([height_m](Measurement& z) {
            z.height_m = height_m, z.object_class = 0, z.points = 0, z.view = -1, z.width_m = 0.4;
          }) == 2);
}

TEST_CASE("lane existence: a pushed row of a low score or a low box confirms later, a cluster has no score") {
  const auto confirmed_at = [](int32_t points, double score, double height_m = kNotMeasured) {
    LaneBench bench;
    for (int32_t k = 0; k < 40; ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      Measurement z = seen_car(50 * kFrame_s * k, 0, k);
      z.points = points, z.score = score;
      if (points == 0) z.height_m = height_m;
      bench.step(k, {z});
      if (k == 0 && points == 0 && !std::isfinite(height_m)) {  // the first existence is the detector's
        const double limited = std::isfinite(score) ? std::clamp(score, 0.1192029, 0.8807971) : 0.7310586;
        CHECK(bench.state().score == doctest::Approx(std::log(limited / (1 - limited))).epsilon(1e-6));
      }
      if (bench.is_confirmed()) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at(0, kNotMeasured) == 2);  // its detector says that it is a car
  for (const double score : {0.7, 0.95, 1.0}) CHECK(confirmed_at(0, score) == 2);
  for (const double score : {0.5, 0.6}) CHECK(confirmed_at(0, score) == 3);
  CHECK(confirmed_at(0, 0.3) > 3);
  CHECK(confirmed_at(0, 0.15) > confirmed_at(0, 0.3));
  CHECK(confirmed_at(0, 0.0) > confirmed_at(0, 0.15));
  CHECK(confirmed_at(0, 0.0) == confirmed_at(0, 0.1));  // limited
  CHECK(confirmed_at(0, 0.0) < 20);                     // many such rows are a car all the same
  CHECK(confirmed_at(1000, 0.0) == 3);
  CHECK(confirmed_at(0, kNotMeasured, 1.1) == 2);
  CHECK(confirmed_at(0, kNotMeasured, 0.2) > 6);
  CHECK(confirmed_at(0, 0.95, 0.2) > 3);
}

TEST_CASE("lane existence: a confirmed car keeps its track while its rows have a score of 0") {
  LaneBench bench;
  TrackId id = kNobody;
  for (int32_t k = 0; k < 80; ++k) {
    bench.ego_at(50 * kFrame_s * k - 30);
    Measurement z = seen_car(50 * kFrame_s * k, 0, k);
    z.points = 0, z.height_m = kNotMeasured, z.score = k < 20 ? 0.9 : 0.0;
    const TrackId taken = bench.step(k, {z})[0];
    if (k == 0) id = taken;
    REQUIRE(taken == id);
  }
  CHECK(bench.is_confirmed());
}

TEST_CASE("lane existence: objects among many others that no car explains are confirmed later or not at all") {
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
        for (Measurement& z : seen) z.points = 0;
      bench.step(k, seen);
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (bench.is_confirmed(i)) return k + 1;
    }
    return 100;
  };
  CHECK(confirmed_after(0) == 3);
  CHECK(confirmed_after(12) > 3);
  CHECK(confirmed_after(30) > 4);
  CHECK(confirmed_after(30, true) == 2);  // pushed rows may be traffic
}

TEST_CASE("lane existence: on a map new cars side by side are no clutter of each other, what looks like none is") {
  const test::CircleRoad ring = make_ring(1e5);
  const auto confirmed_at = [&](bool with_map, ObjectClass others, int32_t faint = 0) {
    LaneBench bench(with_map ? &ring.map : nullptr);
    for (int32_t k = 0; k < 40; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 50);
      std::vector<Measurement> seen = {seen_car(x_m, 0, k)};
      for (int32_t i = 0; i < 4; ++i) {
        seen.push_back(seen_car(x_m + 6 - 4 * i, i % 2 ? 3.5 : -3.5, k));
        seen.back().object_class = int32_t(others), seen.back().faint = faint;
      }
      for (Measurement& z : seen) z.var_x = z.var_y = 1.0;
      bench.step(k, seen);
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (bench.is_confirmed(i) && std::fabs(bench.rows.y_m[i]) < 1.0) return k + 1;
    }
    return 1000;
  };
  CHECK(confirmed_at(true, ObjectClass::kCar) == 3);
  CHECK(confirmed_at(true, ObjectClass::kUnknown) > 3);
  CHECK(confirmed_at(true, ObjectClass::kUnknown, 1) == 3);
  CHECK(confirmed_at(false, ObjectClass::kCar) > 3);  // may be pieces of a wall
}

TEST_CASE("lane existence: without a map new cars are no clutter of each other once they are known to move") {
  const auto confirmed_at = [](double speed_mps, double height_m = 1.0) {
    LaneBench bench;
    for (int32_t k = 0; k < 60; ++k) {
      const double x_m = speed_mps * kFrame_s * k;
      bench.ego_at(50 * kFrame_s * k - 50);
      std::vector<Measurement> seen;
      for (int32_t i = 0; i < 5; ++i) {
        seen.push_back(seen_car(x_m + 6 - 3 * i, i % 2 ? 3.5 : -3.5, k));
        seen.back().var_x = 0.5, seen.back().var_y = 2.0;
        if (i > 0) seen.back().height_m = height_m;
      }
      bench.step(k, seen);
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (bench.is_confirmed(i) && std::hypot(bench.rows.x_m[i] - x_m - 6, bench.rows.y_m[i] + 3.5) < 1.0)
          return k + 1;
    }
    return 1000;
  };
  CHECK(confirmed_at(50) < 15);
  CHECK(confirmed_at(0) > 25);        // a wall
  CHECK(confirmed_at(50, 0.2) > 30);  // among low objects
}

TEST_CASE("lane existence: a known car that shows little of itself keeps its track") {
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

TEST_CASE("lane existence: near the ego vehicle a car shows many points, but not behind the own wing") {
  const auto confirmed_at = [](double ahead_m, double left_m, int32_t points) {
    LaneBench bench;
    for (int32_t k = 0; k < 40; ++k) {
      bench.ego_at(50 * kFrame_s * k - ahead_m);
      Measurement z = seen_car(50 * kFrame_s * k, left_m, k);
      z.points = points;
      bench.step(k, {z});
      if (bench.is_confirmed()) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at(100, 0, 3) == 3);
  CHECK(confirmed_at(25, 0, 200) == 3);
  CHECK(confirmed_at(25, 0, 60) > 3);
  CHECK(confirmed_at(25, 0, 12) == 0);
  CHECK(confirmed_at(2, 2.5, 1000) == 3);
  CHECK(confirmed_at(2, 2.5, 100) == 0);
  CHECK(confirmed_at(-25, 0, 20) == 3);
  CHECK(confirmed_at(-25, 10, 20) > 3);  // beside the wing's shadow
}

TEST_CASE("lane existence: a follower whose sides the own shadow cuts off is confirmed, unless it is low") {
  const auto confirmed_at = [](int32_t in_shadow, double height_m) {
    LaneBench bench;
    for (int32_t k = 0; k < 40; ++k) {
      bench.ego_at(50 * kFrame_s * k + 14);
      Measurement z = seen_car(50 * kFrame_s * k, 0.3, k);
      z.object_class = 0, z.points = 8, z.width_m = 0.3, z.in_shadow = in_shadow, z.height_m = height_m;
      bench.step(k, {z});
      if (bench.is_confirmed()) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at(1, 0.9) == 3);
  CHECK(confirmed_at(0, 0.9) == 0);
  CHECK(confirmed_at(1, 0.59) == 0);  // may be a piece of a misjudged road
}

TEST_CASE("lane existence: on a map a hit behind the own wing counts as one in view, also beside what may be clutter") {
  const test::CircleRoad ring = make_ring(1e5);
  const auto confirmed_at = [&](double ahead_m, bool with_map, double var_m2) {
    LaneBench bench(with_map ? &ring.map : nullptr);
    for (int32_t k = 0; k < 40; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - ahead_m);
      std::vector<Measurement> seen = {seen_car(x_m, -1.5, k), seen_car(x_m - 7, 1.5, k)};
      for (Measurement& z : seen) z.var_x = z.var_y = var_m2;
      seen[1].object_class = int32_t(ObjectClass::kUnknown);
      bench.step(k, seen);
      if (bench.confirmed() > 0) return k + 1;
    }
    return 1000;
  };
  CHECK(confirmed_at(50, true, 0.2) <= 8);
  CHECK(confirmed_at(-50, true, 0.2) <= 8);
  CHECK(confirmed_at(-50, false, 0.05) > confirmed_at(50, false, 0.05));  // may be a misjudged road
}

TEST_CASE("lane existence: a few points outside of the circuit are no new car, and a known one keeps its track") {
  const test::CircleRoad ring = make_ring(1e5);
  const auto confirmed_at = [&](double left_m, int32_t points, bool with_map = true) {
    LaneBench bench(with_map ? &ring.map : nullptr);
    for (int32_t k = 0; k < 40; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 100);
      Measurement z = seen_car(x_m, left_m, k);
      z.points = points;
      bench.step(k, {z});
      if (bench.is_confirmed()) return k + 1;
    }
    return 0;
  };
  const double left_m = test::CircleRoad::kWidthLeft_m, right_m = -test::CircleRoad::kWidthRight_m;
  CHECK(confirmed_at(left_m + 0.4, 10) == 0);
  CHECK(confirmed_at(right_m - 0.4, 10) == 0);
  CHECK(confirmed_at(left_m + 0.2, 10) == 3);  // the map errs, too
  CHECK(confirmed_at(left_m + 0.4, 30) == 3);  // a car on the apron
  CHECK(confirmed_at(left_m + 0.4, 0) == 2);   // a pushed row
  CHECK(confirmed_at(left_m + 0.4, 10, false) == 3);
  LaneBench bench(&ring.map);
  const TrackId id = bench.follow(20, left_m - 0.5);
  for (int32_t k = 20; k < 60; ++k) {
    bench.ego_at(50 * kFrame_s * k - 100);
    Measurement z = seen_car(50 * kFrame_s * k, left_m - 0.5 + std::min(0.05 * (k - 20), 1.0), k);
    z.points = 10;
    CHECK(bench.step(k, {z})[0] == id);
  }
  CHECK(bench.is_confirmed());
}

TEST_CASE("lane existence: a track that never looked like a car is lost when it looks like none, debris at once") {
  const auto lost_after = [](auto first, auto later) {
    LaneBench bench;
    for (int32_t k = 0; k < 60; ++k) {
      bench.ego_at(50 * kFrame_s * k - 60);
      Measurement z = seen_car(50 * kFrame_s * k, 0, k);
      z.points = 0, z.object_class = 0;  // pushed rows confirm it
      if (k >= 10 && k < 15) z.points = 1000, first(z);
      if (k >= 15) z.points = 1000, later(z);
      bench.step(k, {z});
      REQUIRE(bench.rows.count == 1);
      if (k == 9) REQUIRE(bench.is_confirmed());
      if (k >= 15 && !bench.is_confirmed()) return k - 14;
    }
    return 0;
  };
  const auto as_it_is = [](Measurement&) {};
  const auto low = [](Measurement& z) { z.height_m = 0.2; };
  const auto debris = [](Measurement& z) { z.object_class = int32_t(ObjectClass::kDebris), z.debris = 1; };
  const auto car = [](Measurement& z) { z.object_class = int32_t(ObjectClass::kCar); };
  CHECK(lost_after(as_it_is, as_it_is) == 0);
  CHECK(lost_after(as_it_is, low) > 0);
  const int32_t at_once = lost_after(as_it_is, debris);
  CHECK(at_once > 0);
  CHECK(at_once <= 4);
  CHECK(lost_after(car, low) == 0);    // a known car
  CHECK(lost_after(car, debris) > 5);  // as many votes have to say so
}

TEST_CASE("lane existence: what another car may hide in part may be small, but is not low") {
  const test::CircleRoad ring = make_ring(1e5);
  const auto is_confirmed = [&](double height_m) {
    LaneBench bench(&ring.map);
    for (int32_t k = 0; k < 40; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 30);
      std::vector<Measurement> seen = {seen_car(x_m, 0, k)};
      if (k >= 10) {
        seen.push_back(seen_car(x_m + 20, 1, k));
        seen[1].object_class = 0, seen[1].points = 5, seen[1].width_m = 0.3, seen[1].height_m = height_m;
      }
      // It never looks like a car otherwise; one look as a car makes it known.
      if (k == 12) seen[1].object_class = int32_t(ObjectClass::kCar);
      bench.step(k, seen);
    }
    return bench.confirmed() == 2;
  };
  CHECK(is_confirmed(0.9));
  CHECK_FALSE(is_confirmed(0.15));
}

TEST_CASE("lane existence: faint points are no clutter around a new car") {
  const auto confirmed_at = [](int32_t faint) {
    LaneBench bench;
    for (int32_t k = 0; k < 20; ++k) {
      const double x_m = 50 * kFrame_s * k;
      bench.ego_at(x_m - 60);
      std::vector<Measurement> seen = {seen_car(x_m, 0, k)};
      for (int32_t i = 0; i < 12; ++i) {
        seen.push_back(seen_car(x_m + 3 + 0.3 * i, 5.0, k));
        seen.back().points = 1, seen.back().object_class = 0, seen.back().faint = faint, seen.back().debris = !faint;
      }
      bench.step(k, seen);
      if (bench.confirmed() > 0) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at(1) == 3);
  CHECK(confirmed_at(0) > 3);
}

TEST_CASE("lane existence: what stands and comes into view behind the ego vehicle is no new car") {
  const auto is_confirmed = [](double ahead_m, double speed_mps) {
    LaneBench bench;
    for (int32_t k = 0; k < 30; ++k) {
      const double t_s = kFrame_s * k;
      bench.ego_at(50 * t_s);
      bench.step(k, {seen_car(ahead_m + speed_mps * t_s, 0, k)});
    }
    return bench.is_confirmed();
  };
  CHECK(is_confirmed(140, 0));  // seen from ahead, and passed
  CHECK_FALSE(is_confirmed(-80, 0));
  CHECK(is_confirmed(-80, 30));
  CHECK(is_confirmed(-10, 0));  // near: it may have been hidden
}

TEST_CASE("lane existence: far behind the ego vehicle a new track waits until it is known to move") {
  const auto confirmed_at = [](double ahead_m, double speed_mps, double ego_mps = 22) {
    LaneBench bench;
    for (int32_t k = 0; k < 30; ++k) {
      const double t_s = kFrame_s * k;
      bench.ego_at(ego_mps * t_s);
      bench.input.ego.speed_mps = ego_mps;
      Measurement seen = seen_car(ahead_m + speed_mps * t_s, 0, k);
      seen.var_x = seen.var_y = 0.33;
      bench.step(k, {seen});
      if (bench.confirmed() > 0) return k + 1;
    }
    return 0;
  };
  CHECK(confirmed_at(-62, 0) == 0);
  CHECK(confirmed_at(-50, 0) == 3);  // near: it may have been hidden
  CHECK(confirmed_at(-62, 22) >= 3);
  CHECK(confirmed_at(-62, 22) <= 6);
  CHECK(confirmed_at(-62, 0, 0) == 3);  // who stands has passed nothing
}

TEST_CASE("lane existence: without a map, what stands and comes into view beside the road is no new car") {
  struct Car {
    double ahead_m, beside_m, speed_mps = 0.0;
    int32_t points = 1000;  // 0: a pushed row
  };
  const test::CircleRoad road = make_ring(5000);
  const CircuitMap* map = nullptr;
  SUBCASE("no map") {}
  SUBCASE("a map that the ego vehicle has left") { map = &road.map; }
  const auto is_confirmed = [&](const Car& car) {
    LaneBench bench(map);
    bench.input.ask_map = false;
    for (int32_t k = 0; k < 30; ++k) {
      const double t_s = kFrame_s * k;
      bench.ego_at(20 * t_s);
      Measurement seen = seen_car(car.ahead_m + car.speed_mps * t_s, car.beside_m, k);
      seen.points = car.points;
      if (k == 25)
        bench.step(k, {});
      else
        bench.step(k, {seen});
    }
    return bench.is_confirmed();
  };
  CHECK_FALSE(is_confirmed({10, 9}));
  CHECK_FALSE(is_confirmed({10, -9}));
  CHECK(is_confirmed({30, 9}));  // seen from ahead
  CHECK(is_confirmed({10, 5}));  // on the road: it may have been hidden
  CHECK(is_confirmed({10, 9, 30}));
  CHECK(is_confirmed({10, 9, 0, 0}));
}

TEST_CASE("lane existence: misses end what is in view; what another car hides, or the own wing, goes on") {
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

TEST_CASE(
    "lane existence: a car where no sensor looks has no miss, and is lost after coast_s or when its place is "
    "uncertain") {
  const auto lasts_s = [](double coast_s, double coast_sigma_m) {
    TrackerParams params = LaneBench::of_best();
    params.lane.coast_s = coast_s, params.lane.coast_sigma_m = coast_sigma_m;
    LaneBench bench(nullptr, params);
    bench.follow(40);
    const double score = bench.state().score;
    bench.input.sector_count = 0;
    int32_t k = 40;
    for (; k < 200 && (k == 40 || bench.is_confirmed()); ++k) {
      bench.ego_at(50 * kFrame_s * k - 30);
      bench.step(k, {});
      if (bench.is_confirmed()) CHECK(bench.state().score == score);
    }
    CHECK(bench.rows.count == 1);  // it keeps its id until it is silent
    return (k - 40) * kFrame_s;
  };
  CHECK(lasts_s(4, 1e3) == doctest::Approx(4).epsilon(0.03));
  CHECK(lasts_s(2, 1e3) == doctest::Approx(2).epsilon(0.06));
  CHECK(lasts_s(4, 1) < 3);
}

TEST_CASE("lane existence: a prediction loses a car after coast_s or when its place is uncertain, for itself only") {
  const auto lasts_s = [](double coast_s, double coast_sigma_m) {
    TrackerParams params = LaneBench::of_best();
    params.lane.coast_s = coast_s, params.lane.coast_sigma_m = coast_sigma_m;
    LaneBench bench(nullptr, params);
    const TrackId id = bench.follow(40);
    REQUIRE(bench.is_confirmed());
    const double score = bench.state().score;
    const int64_t begin_ns = bench.input.stamp_ns;
    int32_t k = 1;
    for (; k < 200; ++k) {
      bench.tracker->predict(begin_ns + ns_of(k), bench.rows, bench.states);
      REQUIRE(bench.rows.count == 1);  // it keeps its id until it is silent
      CHECK(bench.rows.id[0] == id);
      if (!bench.is_confirmed()) break;
      CHECK(bench.state().score == score);
    }
    bench.publish_at(begin_ns + ns_of(k));
    CHECK(bench.told.existence[0] <= 0.5);
    bench.tracker->snapshot(bench.rows, bench.states);
    CHECK(bench.is_confirmed());
    CHECK(bench.state().score == score);
    return k * kFrame_s;
  };
  CHECK(lasts_s(4, 1e3) == doctest::Approx(4).epsilon(0.03));
  CHECK(lasts_s(2, 1e3) == doctest::Approx(2).epsilon(0.06));
  CHECK(lasts_s(4, 1) < 3);
}

TEST_CASE("lane existence: without a map, a distant car that is not seen is lost as soon as its place is uncertain") {
  const auto coasts_s = [](double coast_sigma_m) {
    TrackerParams params = LaneBench::of_best();
    params.lane.coast_sigma_m = coast_sigma_m;
    LaneBench bench(nullptr, params);
    int32_t k = 0;
    const auto step = [&](const std::vector<Measurement>& seen) {
      bench.ego_at(50 * kFrame_s * k - 150);  // a miss says little
      bench.step(k++, seen);
    };
    while (k < 40) step({seen_car(50 * kFrame_s * k, 0, k)});
    REQUIRE(bench.confirmed() == 1);
    while (k < 200 && bench.is_confirmed()) step({});
    return (k - 40) * kFrame_s;
  };
  CHECK(coasts_s(20) == coasts_s(3));
  CHECK(coasts_s(1) < coasts_s(3));
  CHECK(coasts_s(3) > 0.3);
}

TEST_CASE("lane existence: without an ego pose, it does not count how far a car is from the map's origin") {
  const auto score_at = [](double x_m) {
    LaneBench bench;
    bench.input.ego = {};
    bench.input.in_map = true;
    for (int32_t k = 0; k < 24; ++k) {
      Measurement z = seen_car(x_m + 10 * kFrame_s * k, 0, k);
      z.points = 0, z.height_m = 0.2;
      bench.step(k, k < 20 ? std::vector{z} : std::vector<Measurement>{});
    }
    return bench.state().score;
  };
  CHECK(score_at(2000) == doctest::Approx(score_at(0)).epsilon(1e-6));
}

TEST_CASE("lane existence: the score of a new track is limited as that of an older one") {
  TrackerParams params = LaneBench::of_best();
  params.lane.low_score = -100, params.lane.most_score = 8;
  LaneBench bench(nullptr, params);
  Measurement z = seen_car(0, 0, 0);
  z.height_m = 0.1;
  bench.step(0, {z});
  REQUIRE(bench.rows.count == 1);
  CHECK(bench.state().score == -8);
}

constexpr int32_t kNeverBack = 1000;  // frames

TEST_CASE("lane existence: after a far jump of the ego pose no track stays where nothing was seen since") {
  const test::CircleRoad ring = test::make_ring(1e6);
  // Seconds for which a track that is no car's stays confirmed after the poses tell the whole jump. The car is seen
  // 30 m ahead all the time.
  const auto ghost_s = [&](double jump_m, int32_t back_after = kNeverBack, int32_t parts = 1, int32_t gap = 0) {
    LaneBench bench(&ring.map);
    int32_t last = 39;
    for (int32_t k = 0; k < 140; ++k) {
      const double share = k < 40 + back_after ? std::clamp(double(k - 39) / parts, 0.0, 1.0) : 0.0;
      const double x_m = 60 * kFrame_s * k + share * jump_m;
      bench.input.ego = {k < 40 || k >= 40 + gap, x_m, 0, 0, 60};
      bench.step(k, {seen_car(x_m + 30, 0, k)});
      for (int32_t i = 0; i < bench.rows.count; ++i)
        if (k >= 40 && bench.is_confirmed(i) && std::fabs(bench.rows.x_m[i] - x_m - 30) > 1) last = k;
    }
    return kFrame_s * (last - 39 - std::max(parts - 1, gap));
  };
  for (const double jump_m : {-100.0, -30.0, -20.0, 20.0, 60.0, 100.0}) {
    CAPTURE(jump_m);
    CHECK(ghost_s(jump_m) <= 0.4);
    CHECK(ghost_s(jump_m, 1) <= 0.4);
    CHECK(ghost_s(jump_m, kNeverBack, 2) <= 0.4);  // in parts: the poses between two pushed ones
    CHECK(ghost_s(jump_m, kNeverBack, 4) <= 0.5);
    CHECK(ghost_s(jump_m, kNeverBack, 1, 10) <= 0.4);  // after a gap of 0.5 s
  }
}

TEST_CASE("lane existence: a far jump of the ego pose, and back, leaves the cars their tracks") {
  const test::CircleRoad ring = test::make_ring(1e6);
  LaneBench bench(&ring.map);
  TrackId id = kNobody;
  for (int32_t k = 0; k < 80; ++k) {
    const double x_m = 60 * kFrame_s * k + (k == 40 ? 50.0 : 0.0);
    bench.input.ego = {true, x_m, 0, 0, 60};
    bench.step(k, {seen_car(x_m + 30, 0, k)});
    if (k == 39) id = bench.ids[0];
    if (k > 41) CHECK(bench.ids[0] == id);
  }
  // A prediction long after the last frame is not a track that was not seen since the jump.
  bench.tracker->predict(ns_of(79) + 1'500'000'000, bench.rows, bench.states);
  CHECK(bench.is_confirmed());
}

TEST_CASE("lane existence: a far car that is not seen coasts, but not after a far jump of the ego pose") {
  const test::CircleRoad ring = test::make_ring(1e6);
  // How long a track stays confirmed from the jump on. A miss of a car 120 m away says little.
  const auto lasts_s = [&](double jump_m) {
    LaneBench bench(&ring.map);
    int32_t k = 0;
    const auto step = [&](double jumped_m, bool is_seen) {
      const double x_m = 60 * kFrame_s * k;
      bench.input.ego = {true, x_m + jumped_m, 0, 0, 60};
      bench.step(k, is_seen ? std::vector{seen_car(x_m + 120, 0, k)} : std::vector<Measurement>{});
      ++k;
    };
    while (k < 40) step(0, true);
    REQUIRE(bench.confirmed() == 1);
    while (k < 120 && bench.is_confirmed()) step(jump_m, false);
    return kFrame_s * (k - 40);
  };
  CHECK(lasts_s(0) > 1);
  CHECK(lasts_s(4) > 1);
  for (const double jump_m : {-60.0, -20.0, 20.0}) {
    CAPTURE(jump_m);
    CHECK(lasts_s(jump_m) > 0.3);
    CHECK(lasts_s(jump_m) <= 0.45);
  }
}

TEST_CASE("lane existence: a car that is missed is lost after a time, whatever the rate of the frames") {
  for (const int64_t step_ms : {10, 20, 50}) {
    CAPTURE(step_ms);
    LaneBench bench;
    int64_t t_ms = 0, lost_ms = 0;
    for (; t_ms < 3'000 && lost_ms == 0; t_ms += step_ms) {
      const double x_m = 0.05 * double(t_ms);
      bench.ego_at(x_m - 40);
      Measurement z = seen_car(x_m, 0, 0);
      z.stamp_ns = t_ms * 1'000'000;
      bench.input.stamp_ns = z.stamp_ns;
      const auto seen = t_ms < 1'000 ? std::vector{z} : std::vector<Measurement>{};
      bench.input.measurements = seen;
      bench.ids.assign(bench.input.measurements.size(), kNobody);
      bench.tracker->step(bench.input, bench.ids.data());
      bench.tracker->snapshot(bench.rows, bench.states);
      if (t_ms >= 1'000 && bench.confirmed() == 0) lost_ms = t_ms - 1'000;
    }
    CHECK(lost_ms >= 500);
    CHECK(lost_ms <= 900);
  }
}
