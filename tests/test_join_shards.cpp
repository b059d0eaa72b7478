// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The rule join_shards: the clusters of one car become one, those of two cars do not.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "pipeline/body_look.h"
#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

constexpr float kLength = 4.921f, kWidth = 1.886f;

void join(RulesBench& bench) { bench.run("join_shards"); }

// Each row as its bounds along x and y, in order of place: the same for any order of the rows.
using Bounds = std::vector<std::array<float, 4>>;
Bounds bounds_of(const FrameClusterTable& merged) {
  Bounds bounds;
  for (int32_t i = 0; i < merged.count; ++i)
    bounds.push_back({merged.min_x_m[i], merged.max_x_m[i], merged.min_y_m[i], merged.max_y_m[i]});
  std::sort(bounds.begin(), bounds.end());
  return bounds;
}

// Every relation between members, rows and labels, and every sum of a row against its points.
void check_tables(const RulesBench& bench) {
  const Frame& frame = bench.frame;
  const FrameClusterTable& merged = frame.merged;
  std::vector<int32_t> seen(std::size_t(frame.members.count), 0);
  int32_t before = -1;
  for (int32_t row = 0; row < merged.count; ++row) {
    CAPTURE(row);
    CHECK(merged.first_member[row] > before);  // rows in the order of their first members
    before = merged.first_member[row];
    float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
    double sum[3] = {};
    int32_t points = 0, mask = 0, of_sensor[kMaxSensors] = {}, last = -1;
    float nearest = 1e9f;
    for (int32_t m = merged.first_member[row]; m >= 0; m = frame.members.next_member[m]) {
      CHECK(m > last);
      last = m;
      ++seen[std::size_t(m)];
      CHECK(frame.members.merged[m] == row);
      const int32_t s = frame.members.sensor[m], c = frame.members.cluster[m];
      const SensorPart& part = frame.sensors[s];
      CHECK(part.cluster_of_label[part.clusters.label[c]] == row);
      mask |= 1 << s;
      of_sensor[s] += part.clusters.point_count[c];
      nearest = std::min(nearest, part.clusters.nearest_m[c]);
      for (int32_t k = 0; k < part.clusters.point_count[c]; ++k, ++points) {
        const int32_t i = part.clusters.point_begin[c] + k;
        const float at[3] = {part.cluster_points.x_m[i], part.cluster_points.y_m[i], part.cluster_points.z_m[i]};
        for (int32_t a = 0; a < 3; ++a) {
          low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
          sum[a] += double(at[a]);
        }
      }
    }
    CHECK(merged.point_count[row] == points);
    CHECK(merged.sensor_mask[row] == mask);
    CHECK(merged.main_sensor[row] == int32_t(std::max_element(of_sensor, of_sensor + kMaxSensors) - of_sensor));
    CHECK(merged.nearest_m[row] == nearest);
    CHECK(merged.min_x_m[row] == low[0]);
    CHECK(merged.max_x_m[row] == high[0]);
    CHECK(merged.min_y_m[row] == low[1]);
    CHECK(merged.max_y_m[row] == high[1]);
    CHECK(merged.min_z_m[row] == low[2]);
    CHECK(merged.max_z_m[row] == high[2]);
    CHECK(merged.center_x_m[row] == doctest::Approx(sum[0] / points).epsilon(1e-4));
    CHECK(merged.center_y_m[row] == doctest::Approx(sum[1] / points).epsilon(1e-4));
    CHECK(merged.center_z_m[row] == doctest::Approx(sum[2] / points).epsilon(1e-4));
    if (frame.places.known[row]) {  // the place follows the cluster
      const float cos = frame.places.cos[row], sin = frame.places.sin[row];
      const OrientedBox box = trim_box(bench.context, frame, row, cos, sin, measure_box(frame, row, cos, sin));
      CHECK(box.low_1 == frame.places.low_1_m[row]);
      CHECK(box.high_1 == frame.places.high_1_m[row]);
      CHECK(box.low_2 == frame.places.low_2_m[row]);
      CHECK(box.high_2 == frame.places.high_2_m[row]);
    }
  }
  CHECK(std::all_of(seen.begin(), seen.end(), [](int32_t n) { return n == 1; }));
}

// The rear `back` and the front `front` metres of a car whose rear end is at x.
void add_car(RulesBench& bench, float x, float y, float back, float front, int32_t more) {
  bench.add(corners(x, x + back, y - 0.5f * kWidth, y + 0.5f * kWidth, 0.2f, 0.9f, more));
  if (front > 0.0f)
    bench.add(corners(x + kLength - front, x + kLength, y - 0.4f * kWidth, y + 0.4f * kWidth, 0.2f, 0.7f));
}

TEST_CASE("join_shards: rear, cockpit, a wheel of one point and a part that another sensor sees become one cluster") {
  RulesBench bench;
  bench.add(corners(40, 41, -6, -5, 0, 1));             // another object
  bench.add(corners(20, 21, -0.9f, 0.9f, 0.2f, 0.9f));  // rear
  bench.add(corners(22, 23, -0.4f, 0.4f, 0.6f, 1.2f));  // cockpit
  bench.add({{23.5f, 0.9f, 0.3f}});                     // wheel
  bench.add(corners(24, 24.8f, -0.5f, 0.5f, 0.3f, 0.5f, 5), 1);
  join(bench);
  REQUIRE(bench.frame.merged.count == 2);
  check_tables(bench);
  CHECK(bench.frame.merged.point_count[1] == 8 + 8 + 1 + 13);
  CHECK(bench.frame.merged.sensor_mask[1] == 3);
  CHECK(bench.frame.merged.min_x_m[1] == 20.0f);
  CHECK(bench.frame.merged.max_x_m[1] == 24.8f);
  CHECK(bench.frame.merged.stamp_ns[1] == bench.frame.stamp_ns);
}

TEST_CASE("join_shards: two cars nose to tail stay two, each with all of its parts") {
  for (const float apart : {0.6f, 1.0f, 1.5f, 2.0f})
    for (const float back : {0.3f, 1.5f, 3.0f})
      for (const float front : {0.0f, 0.4f, 1.0f}) {
        if (kLength - back - front > 2.5f && front > 0.0f) continue;  // farther apart than join.gap_m
        CAPTURE(apart);
        CAPTURE(back);
        CAPTURE(front);
        RulesBench bench;
        add_car(bench, 20, 0, back, front, 20);
        add_car(bench, 20 + kLength + apart, 0.3f, back, front, 0);
        join(bench);
        CHECK(bench.frame.merged.count == 2);
        check_tables(bench);
        CHECK(bench.frame.merged.max_x_m[0] < bench.frame.merged.min_x_m[1]);
      }
}

TEST_CASE("join_shards: two cars side by side stay two, each with all of its parts") {
  for (const float apart : {0.55f, 0.8f, 1.5f, 2.0f})
    for (const float ahead : {-1.0f, 0.0f, 0.5f, 2.0f}) {
      CAPTURE(apart);
      CAPTURE(ahead);
      RulesBench bench;
      add_car(bench, 30, -2, 1.5f, 1.0f, 20);
      add_car(bench, 30 + ahead, -2 + kWidth + apart, 1.5f, 1.0f, 20);
      join(bench);
      CHECK(bench.frame.merged.count == 2);
      check_tables(bench);
      for (int32_t row = 0; row < bench.frame.merged.count; ++row)
        CHECK(bench.frame.merged.max_y_m[row] - bench.frame.merged.min_y_m[row] <= kWidth + 1e-5f);
    }
}

TEST_CASE("join_shards: the limits of gap, length, width and height, to both sides") {
  const auto rows_of = [](const Spots& a, const Spots& b) {
    RulesBench bench;
    bench.add(a);
    bench.add(b);
    join(bench);
    return bench.frame.merged.count;
  };
  const Spots seed = corners(20, 21, -0.5f, 0.5f, 0.2f, 0.9f);
  CHECK(rows_of(seed, corners(23.4f, 24, -0.5f, 0.5f, 0.2f, 0.9f)) == 1);  // gap
  CHECK(rows_of(seed, corners(23.6f, 24, -0.5f, 0.5f, 0.2f, 0.9f)) == 2);
  CHECK(rows_of(seed, corners(16, 17.6f, -0.5f, 0.5f, 0.2f, 0.9f)) == 1);  // behind the seed
  CHECK(rows_of(seed, corners(15.5f, 18, -0.5f, 0.5f, 0.2f, 0.9f)) == 2);  // length: 5.5 m
  CHECK(rows_of(seed, corners(15.7f, 18, -0.5f, 0.5f, 0.2f, 0.9f)) == 1);  // 5.3 m
  CHECK(rows_of(seed, corners(20, 21, 1.0f, 1.8f, 0.2f, 0.9f)) == 1);      // width: 2.3 m
  CHECK(rows_of(seed, corners(20, 21, 1.0f, 1.9f, 0.2f, 0.9f)) == 2);      // 2.4 m
  CHECK(rows_of(seed, corners(20, 21, -0.5f, 0.5f, 1.2f, 1.75f)) == 1);    // height: 1.55 m
  CHECK(rows_of(seed, corners(20, 21, -0.5f, 0.5f, 1.2f, 1.85f)) == 2);    // 1.65 m
  CHECK(rows_of(corners(50, 51, -7.5f, -7.2f, 0.2f, 0.9f), corners(50, 51, -6.9f, -6.7f, 0.2f, 0.9f)) == 2);  // fence
  CHECK(rows_of(corners(20, 21, -6.8f, -6.5f, 0.2f, 0.9f), corners(20, 21, -6.2f, -6.1f, 0.2f, 0.9f)) == 1);
  CHECK(rows_of(corners(20, 26, -0.5f, 0.5f, 0.2f, 0.9f), corners(20, 21, 0.6f, 0.7f, 0.2f, 0.9f)) == 2);  // too long
  CHECK(rows_of(corners(3, 4, -0.5f, 0.5f, 0.2f, 0.9f), corners(4.6f, 6, -0.5f, 0.5f, 0.2f, 0.9f)) == 2);  // own nose
}

TEST_CASE("join_shards: on the apron, the parts of a near car become one; smoke, what is higher or far out does not") {
  // The rear and the front of a car whose right side is at y, beside the bound at 6 m: number of rows after joining.
  const auto rows = [](double x, double y, double low_m, double high_m, float intensity) {
    RulesBench bench;
    const double middle = y + 0.5 * double(kWidth);
    bench.look({{x, middle, 0, 1.0, double(kWidth), 0.1, 0.9, 1},
                {x + 3.2, middle, 0, 1.0, double(kWidth), low_m, high_m, 2, intensity},
                {25, -8, 0, 0.1, 2.0, 0.2, 1.4, -1, 0.01f}});
    join(bench);
    return bench.frame.merged.count;
  };
  CHECK(rows(22, 7, 0.1, 1.2, 1.0f) == 1);
  CHECK(rows(22, 7, 0.1, 1.2, 0.05f) == 2);  // smoke
  CHECK(rows(22, 7, 1.1, 1.6, 1.0f) == 2);   // over the ground
  CHECK(rows(45, 7, 0.1, 1.2, 1.0f) == 2);   // farther away its parts are not looked for
  CHECK(rows(22, 11, 0.1, 1.2, 1.0f) == 2);  // more than 5 m beyond the bound
  CHECK(rows(22, 5, 0.1, 1.2, 0.05f) == 1);  // on the circuit
}

TEST_CASE("join_shards: a seed wider than a car stands across the circuit, and its parts are joined across") {
  RulesBench bench;
  bench.add(corners(30, 31.5f, -1, 1.6f, 0.2f, 0.9f));  // 2.6 m of a flank
  bench.add(corners(30, 31.2f, 2.5f, 3.5f, 0.2f, 0.9f));
  bench.add(corners(34, 35, -1, 1, 0.2f, 0.9f));  // behind it: not of this car
  join(bench);
  REQUIRE(bench.frame.merged.count == 2);
  CHECK(bench.frame.merged.max_y_m[0] - bench.frame.merged.min_y_m[0] == doctest::Approx(4.5));
  check_tables(bench);
}

TEST_CASE("join_shards: a car at an angle to the lane is one where two sensors see it whole, not where two cars are") {
  const auto turned = [](double yaw_deg, float x, float y, float width = kWidth) {
    Spots spots = corners(-0.5f * kLength, 0.5f * kLength, -0.5f * width, 0.5f * width, 0.2f, 0.9f);
    const float sine = float(std::sin(yaw_deg * kPi / 180)), cosine = float(std::cos(yaw_deg * kPi / 180));
    for (auto& spot : spots) {
      const Spot before = spot;
      spot.x = x + before.x * cosine - before.y * sine;
      spot.y = y + before.x * sine + before.y * cosine;
    }
    return spots;
  };
  const auto rows = [&](double yaw_deg, float beside_m, int32_t sensor, float width = kWidth) {
    RulesBench bench;
    bench.add(turned(yaw_deg, 20, 0, width));
    bench.add(turned(yaw_deg, 20, beside_m, width), sensor);
    join(bench);
    check_tables(bench);
    return bench.frame.merged.count;
  };
  for (const double yaw_deg : {-60.0, -30.0, 15.0, 30.0, 45.0, 60.0, 75.0}) {
    CAPTURE(yaw_deg);
    CHECK(rows(yaw_deg, 0.2f, 1) == 1);
    CHECK(rows(yaw_deg, 0.2f, 0) == 1);
    CHECK(rows(yaw_deg, 3.0f, 1) == 2);
    CHECK(rows(yaw_deg, 3.0f, 0) == 2);
    CHECK(rows(yaw_deg, 0.2f, 1, 3.0f) == 2);  // wider than a car
  }
}

TEST_CASE("join_shards: the parts of a car at an angle are one for one sensor, those of the car beside it are not") {
  // Parts of a body of 4.9 x 1.9 m that stands at an angle, 20 m ahead, as {low_x, high_x, low_y, high_y} of the body.
  const auto rows = [](double yaw_deg, const std::vector<std::array<float, 4>>& parts, float z_m = 0.9f) {
    RulesBench bench;
    const float sine = float(std::sin(yaw_deg * kPi / 180)), cosine = float(std::cos(yaw_deg * kPi / 180));
    for (const auto& part : parts) {
      Spots spots = corners(part[0], part[1], part[2], part[3], 0.2f, &part == &parts.back() ? z_m : 0.9f);
      for (auto& spot : spots) {
        const Spot before = spot;
        spot.x = 20 + before.x * cosine - before.y * sine;
        spot.y = before.x * sine + before.y * cosine;
      }
      const Spots once = spots;
      if (&part == &parts.front()) spots.insert(spots.end(), once.begin(), once.end());  // the seed
      bench.add(spots);
    }
    join(bench);
    check_tables(bench);
    return bench.frame.merged.count;
  };
  const std::array<float, 4> flank = {-1.2f, 2.4f, -0.9f, -0.5f}, inside = {-0.2f, 0.3f, 0.1f, 0.5f};
  const std::array<float, 4> rear = {-2.4f, -1.9f, -0.9f, 0.9f}, other = {-1, 1, 1.9f, 2.3f},
                             next = {3.5f, 4, -0.5f, 0.5f};
  for (const double yaw_deg : {-70.0, -45.0, -20.0, 10.0, 20.0, 40.0, 55.0, 80.0}) {
    CAPTURE(yaw_deg);
    CHECK(rows(yaw_deg, {flank, inside}) == 1);
    CHECK(rows(yaw_deg, {flank, inside, rear}) == 1);
    CHECK(rows(yaw_deg, {flank, rear, other}) == 2);   // too wide together
    CHECK(rows(yaw_deg, {flank, rear, next}) == 2);    // too long together
    CHECK(rows(yaw_deg, {flank, inside}, 3.0f) == 2);  // too high together
  }
}

TEST_CASE("join_shards: with a negative bound nothing is joined on the circuit or on its apron") {
  for (const double y : {5.0, 7.0})
    for (const float bound_m : {0.0f, -100.0f}) {
      RulesBench bench;
      bench.context.detect.join_shards.bound_m = bound_m;
      const double middle = y + 0.5 * double(kWidth);
      bench.look(
          {{22, middle, 0, 1.0, double(kWidth), 0.1, 0.9, 1}, {25.2, middle, 0, 1.0, double(kWidth), 0.1, 1.2, 2}});
      join(bench);
      CHECK(bench.frame.merged.count == (bound_m < 0.0f ? 2 : 1));
    }
}

TEST_CASE("join_shards: a few points in front of a body of many are not a part of it") {
  const auto rows_of = [](float x_m, int32_t more, float y_m = 0.0f, int32_t of_body = 100, int32_t sensor = 0) {
    RulesBench bench;
    bench.add(corners(20, 21, -0.8f, 0.8f, 0.2f, 0.9f, of_body - 8));
    Spots spots(std::size_t(more), Spot{x_m, y_m, 0.5f});
    bench.add(spots, sensor);
    join(bench);
    check_tables(bench);
    return bench.frame.merged.count;
  };
  CHECK(rows_of(18.5f, 2) == 2);
  CHECK(rows_of(18.5f, 3) == 1);
  CHECK(rows_of(18.5f, 8, 0, 500) == 2);
  CHECK(rows_of(18.5f, 9, 0, 500) == 1);
  CHECK(rows_of(18.5f, 2, 0, 100, 1) == 1);  // ranges of two sensors do not tell it
  CHECK(rows_of(19.8f, 2) == 1);             // as near as the body
  CHECK(rows_of(22.0f, 2) == 1);             // behind it
  CHECK(rows_of(21.0f, 2, 1.2f) == 1);       // beside it
}

TEST_CASE("join_shards: a row inside of the group counts for its height") {
  RulesBench bench;
  bench.add(corners(20, 23, -0.8f, 0.8f, 0.5f, 1.0f, 8));
  bench.add(corners(19, 20, -0.8f, 0.8f, 0.5f, 1.0f, 4));
  bench.add({{22, 0, -0.2f}});
  bench.add({{23.5f, 0, 1.5f}});  // 1.7 m over the lowest point
  join(bench);
  CHECK(bench.frame.merged.count == 2);
  check_tables(bench);
}

TEST_CASE("join_shards: the parts at both ends of a car are one, wherever it is") {
  for (float x = 12; x < 28; x += 0.9f)
    for (float y = -8; y < 8; y += 0.9f)
      for (const bool from_rear : {false, true})
        for (const bool from_right : {false, true}) {
          CAPTURE(x);
          CAPTURE(y);
          RulesBench bench;
          const auto add = [&](float along, float across, int32_t times) {
            const float at_x = x + (from_rear ? along : 4.6f - along), at_y = y + (from_right ? across : 1.6f - across);
            const Spots once = corners(at_x, at_x + 0.3f, at_y, at_y + 0.3f, 0.2f, 0.9f);
            Spots spots;
            for (int32_t i = 0; i < times; ++i) spots.insert(spots.end(), once.begin(), once.end());
            bench.add(spots);
          };
          add(0, 0, 4);  // the seed
          add(2.3f, 0.8f, 1);
          add(4.6f, 1.6f, 1);
          join(bench);
          REQUIRE(bench.frame.merged.count == 1);
        }
}

TEST_CASE("join_shards: without a map the axes are those of the vehicle") {
  RulesBench bench(false);
  bench.add(corners(20, 21, 30, 31, 0.2f, 0.9f));
  bench.add(corners(22, 23, 30, 31, 0.2f, 0.9f));
  join(bench);
  CHECK(bench.frame.merged.count == 1);
  check_tables(bench);
}

TEST_CASE("join_shards: any clutter keeps every member once, within the limits, for any numbering of the sensors") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto uniform = [&](float low, float high) { return low + (high - low) * float(random() % 10000) * 1e-4f; };
    std::vector<Spots> clutter;
    for (int32_t i = 0; i < 300; ++i) {
      const float x = uniform(-40, 60), y = uniform(-8, 8), z = uniform(0, 1.2f), size = uniform(0, 1.5f);
      clutter.push_back(random() % 4 == 0
                            ? Spots{{x, y, z}}
                            : corners(x, x + size, y, y + uniform(0, 1), z, z + 0.3f, int32_t(random() % 5)));
    }
    const auto joined = [&](uint32_t order) {
      RulesBench bench;
      std::mt19937 shuffle(order);
      std::vector<Spots> in = clutter;
      std::shuffle(in.begin(), in.end(), shuffle);
      for (const Spots& spots : in) bench.add(spots, int32_t(shuffle() % 2));
      join(bench);
      check_tables(bench);
      CHECK(bench.frame.merged.count < 250);
      for (int32_t row = 0; row < bench.frame.merged.count; ++row) {
        if (bench.frame.members.next_member[bench.frame.merged.first_member[row]] < 0) continue;
        const OrientedBox box = box_of(bench.frame.places, row);
        CHECK(box.length() <= kLength + 0.501f);
        CHECK(box.width() <= kWidth + 0.501f);
      }
      return bounds_of(bench.frame.merged);
    };
    const Bounds first = joined(1);
    CHECK(joined(2) == first);
    CHECK(joined(3) == first);
  }
}

}  // namespace

TEST_CASE("join_shards: a small gap is the same at every angle to the map") {
  ovt_params params;
  REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
  params.join_gap_m = 1.0;
  for (int32_t degree = 0; degree < 360; degree += 30) {
    CAPTURE(degree);
    RulesBench bench(true, &params);
    const double a = degree * kPi / 180;
    bench.frame.ego.poses[0].yaw_rad = -a;
    const auto at = [&](double u, double v) {
      u += 25;
      return Spot{float(u * std::cos(a) - v * std::sin(a)), float(u * std::sin(a) + v * std::cos(a)), 0.5f};
    };
    bench.add({at(0.5, 1.0), at(0.0, 0.2), at(0.25, 0.6)});
    bench.add({at(1.49, -0.79)});
    join(bench);
    CHECK(bench.frame.merged.count == 1);
  }
}
