// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Clusters across sensors: which clusters and points take part, and the content of the merged table.
#include "kernels/merge_seams.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/seam_scene.h"

using namespace overtake;
using namespace overtake::test;

TEST_CASE("merge_seams: a point counts only if it is its pixel's winner and has a cluster's label") {
  const auto merged = [](int32_t label, bool wins) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].put(0, 5, 9, 0, 0, 1);  // the rest of the cluster, away from the seam
    rig[0].put(0, 19, 10, 0, 0, label, 0, wins);
    rig[1].put(0, 0, 10, 1, 0, 1);
    return Frame(rig, kMerge).merged.count == 1;
  };
  CHECK(merged(1, true));
  CHECK_FALSE(merged(1, false));
  CHECK_FALSE(merged(kLabelGround, true));
  CHECK_FALSE(merged(kLabelNone, true));
}

TEST_CASE("merge_seams: a cluster without a row in its sensor's table takes no part") {
  std::vector<Sensor> rig = plain_rig();
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[0].put(1, 3, 5, 0, 0, 2);
  rig[1].put(0, 0, 10, 1, 0, 1);
  rig[0].cluster_capacity = 1;  // keeps label 2, the nearer one
  const Frame f(rig, kMerge);
  CHECK(f.members.count == 2);
  CHECK(f.merged.count == 2);
}

TEST_CASE("merge_seams: two near clusters of one sensor are joined only by a neighbour's cluster") {
  std::vector<Sensor> rig = plain_rig();
  rig[0].put(0, 19, 10, 0, 0, 1);
  rig[0].put(1, 19, 10, 0.1f, 0, 2);
  CHECK(Frame(rig, kMerge).merged.count == 2);
  rig[1].put(0, 0, 10, 1, 0, 1);
  const Frame f(rig, kMerge);
  REQUIRE(f.merged.count == 1);
  CHECK(f.row_members(0) == Ints{0, 1, 2});
}

TEST_CASE("merge_seams: with one sensor, wrapping or not, every cluster is a row with its sums and stamp") {
  for (bool wraps : {false, true}) {
    CAPTURE(wraps);
    std::vector<Sensor> rig = plain_rig(20, 1);
    rig[0].model.wraps = wraps;
    rig[0].stamp_ns = 1000;
    rig[0].put(0, 0, 10, 0, 0, 1, 10);
    rig[0].put(0, 19, 10, 1, 4, 2, 20);
    rig[0].put(1, 19, 12, 2, 2, 2, 31);
    const Frame f(rig, kMerge);
    REQUIRE(f.merged.count == 2);
    CHECK(f.merged.center_x_m[1] == 11);
    CHECK(f.merged.center_y_m[1] == 1.5f);
    CHECK(f.merged.center_z_m[1] == 3);
    CHECK(f.merged.point_count[1] == 2);
    CHECK(f.merged.stamp_ns[0] == 1010);
    CHECK(f.merged.stamp_ns[1] == 1025);  // 1025.5 rounds down
    CHECK(f.merged.nearest_m[1] == f.points[0].range_m[1]);
    CHECK(f.merged.sensor_mask[1] == 1);
    CHECK(f.members.next_member[0] == -1);
  }
}

TEST_CASE("merge_seams: a stamp is the floor of the mean of all points' stamps, for any stamps") {
  constexpr int64_t kLow = std::numeric_limits<int64_t>::min(), kHigh = std::numeric_limits<int64_t>::max();
  const auto stamp = [](int64_t stamp_0, int32_t points_0, int64_t stamp_1, int32_t points_1, int32_t offset) {
    std::vector<Sensor> rig = plain_rig();
    rig[0].stamp_ns = stamp_0, rig[1].stamp_ns = stamp_1;
    for (int32_t i = 0; i < points_0; ++i) rig[0].put(i, 19, 10, 0, 0, 1, offset);
    for (int32_t i = 0; i < points_1; ++i) rig[1].put(i, 0, 10, 1, 0, 1, offset);
    const Frame f(rig, kMerge);
    REQUIRE(f.merged.count == 1);
    return f.merged.stamp_ns[0];
  };
  CHECK(stamp(100, 3, 200, 1, 0) == 125);     // weighted by points
  CHECK(stamp(100, 1, 201, 2, 5) == 172);     // 172.33
  CHECK(stamp(-100, 1, -201, 2, 0) == -168);  // -167.33 rounds toward minus infinity
  CHECK(stamp(-3, 1, 3, 1, 0) == 0);
  const int64_t now = 1767225600123456789;
  CHECK(stamp(now, 20, now + 1, 20, 0) == now);
  CHECK(stamp(now, 1, now + 50000000, 31, -7) == now + 48437500 - 7);
  CHECK(stamp(kHigh, 32, kHigh, 32, 0) == kHigh);
  CHECK(stamp(kLow, 32, kLow, 32, 0) == kLow);
  CHECK(stamp(kLow, 16, kHigh, 16, 0) == -1);
  CHECK(stamp(kHigh, 2, kHigh, 2, 1000) == kHigh);  // saturates
  CHECK(stamp(kLow, 2, kLow, 2, -1000) == kLow);
}

TEST_CASE("merge_seams: the main sensor saw most of the points; ties: the lower sensor") {
  for (int extra : {0, 1}) {
    std::vector<Sensor> rig = plain_rig();
    for (int32_t r = 0; r < 4; ++r) rig[0].put(r, 19, 10, 0, 0, 1);
    for (int32_t r = 0; r < 4 + extra; ++r) rig[1].put(r, 0, 10, 1, 0, 1);
    CHECK(Frame(rig, kMerge).merged.main_sensor[0] == extra);
  }
}

TEST_CASE("merge_seams: with more clusters than rows the nearest are kept, in order; ties: the earlier one") {
  std::vector<Sensor> rig = plain_rig();
  //                                        member  range
  rig[0].put(0, 5, 40, 0, 0, 1);   //  0       40
  rig[0].put(1, 5, 20, 0, 0, 2);   //  1       20
  rig[0].put(2, 19, 60, 0, 0, 3);  //  2       60, with member 5: 59
  rig[0].put(3, 5, 0, 20, 0, 4);   //  3       20
  rig[1].put(0, 5, 10, 0, 0, 1);   //  4       10
  rig[1].put(1, 0, 59, 0, 0, 2);   //  5
  rig[1].put(2, 5, 0, 0, 20, 3);   //  6       20
  const auto rows = [&](int32_t capacity) {
    const Frame f(rig, kMerge, capacity);
    CHECK(f.overflow == 6 - f.merged.count);
    Ints merged(f.members.merged, f.members.merged + f.members.count);
    for (int32_t row = 0; row < f.merged.count; ++row)
      for (int32_t m : f.row_members(row)) CHECK(merged[size_t(m)] == row);
    for (int32_t m = 0; m < f.members.count; ++m)
      if (merged[size_t(m)] < 0) CHECK(f.members.next_member[m] == -1);
    return merged;
  };
  CHECK(rows(6) == Ints{0, 1, 2, 3, 4, 2, 5});
  CHECK(rows(5) == Ints{0, 1, -1, 2, 3, -1, 4});
  CHECK(rows(4) == Ints{-1, 0, -1, 1, 2, -1, 3});
  CHECK(rows(3) == Ints{-1, 0, -1, 1, 2, -1, -1});
  CHECK(rows(2) == Ints{-1, 0, -1, -1, 1, -1, -1});
  CHECK(rows(1) == Ints{-1, -1, -1, -1, 0, -1, -1});
  CHECK(rows(0) == Ints{-1, -1, -1, -1, -1, -1, -1});
}

TEST_CASE("merge_seams: agrees with a brute-force search on random clouds") {
  for (uint32_t seed = 1; seed <= 300; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto below = [&](uint32_t n) { return int32_t(random() % n); };
    const int sensors = 1 + below(8);
    const int32_t columns = 1 + below(6), labels = 1 + below(6), capacity = below(4) ? 64 : below(6);
    std::vector<Sensor> rig = plain_rig(5 + below(10), sensors);
    std::vector<int> clockwise;  // sensor at each place around the vehicle
    for (int s = 0; s < sensors; ++s) clockwise.push_back(s);
    std::shuffle(clockwise.begin(), clockwise.end(), random);
    for (int i = 0; i < sensors; ++i) {
      Sensor& s = rig[size_t(clockwise[size_t(i)])];
      s.model.mounting_yaw_rad = float((180 - 360.0 / sensors * (i + 0.5)) * kDegree);
      s.model.T_vehicle_sensor = transform_of({double(below(5)), double(below(5)), 0, double(below(360))});
      s.present = below(6) > 0;
      s.stamp_ns = 1700000000000000000 + below(100000000);
      const int n = below(120);
      for (int k = 0; k < n; ++k) {
        const int32_t row = below(kRows), column = below(uint32_t(s.model.cols)),
                      label = below(uint32_t(labels) + 2) - 1;
        const float x = float(below(4000)) / 200, y = float(below(4000)) / 200, z = float(below(800)) / 200;
        const bool taken = std::any_of(s.input.begin(), s.input.end(),
                                       [&](const Point& p) { return p.row == row && p.column == column; });
        s.put(row, column, x, y, z, label, below(50000000), !taken);
      }
    }
    const MergeSeamsParams params = closer_than(0.3f + float(below(200)) / 100, columns);
    const Frame f(rig, params, capacity);

    // Members, and their groups: repeat until nothing changes.
    struct Member {
      int sensor;
      int32_t label;
      Ints points;
      int group;
    };
    std::vector<Member> want;
    for (int s = 0; s < sensors; ++s)
      for (int32_t label = 1; rig[size_t(s)].present && label <= labels; ++label) {
        Member m{s, label, {}, int(want.size())};
        for (size_t i = 0; i < rig[size_t(s)].input.size(); ++i)
          if (rig[size_t(s)].input[i].label == label) m.points.push_back(int32_t(i));
        if (!m.points.empty()) want.push_back(m);
      }
    const auto place = [&](int s, int32_t i, float out[3]) {
      const Point& p = rig[size_t(s)].input[size_t(i)];
      const Transform& T = rig[size_t(s)].model.T_vehicle_sensor;
      for (int a = 0; a < 3; ++a) out[a] = T.r[3 * a] * p.x + T.r[3 * a + 1] * p.y + T.r[3 * a + 2] * p.z + T.t[a];
    };
    const auto touch = [&](const Member& a, const Member& b) {  // a's right edge, b's left edge
      if (a.sensor == b.sensor) return false;
      const auto at = std::find(clockwise.begin(), clockwise.end(), a.sensor) - clockwise.begin();
      if (clockwise[size_t(at + 1) % size_t(sensors)] != b.sensor) return false;
      for (int32_t i : a.points)
        for (int32_t k : b.points) {
          const Point &p = rig[size_t(a.sensor)].input[size_t(i)], &q = rig[size_t(b.sensor)].input[size_t(k)];
          if (!p.wins || !q.wins || p.column < rig[size_t(a.sensor)].model.cols - columns || q.column >= columns)
            continue;
          float u[3], v[3];
          place(a.sensor, i, u), place(b.sensor, k, v);
          const float dx = u[0] - v[0], dy = u[1] - v[1], dz = u[2] - v[2];
          if (dx * dx + dy * dy + dz * dz < params.distance_m * params.distance_m) return true;
        }
      return false;
    };
    for (bool changed = true; changed;) {
      changed = false;
      for (Member& a : want)
        for (Member& b : want)
          if (a.group != b.group && touch(a, b)) {
            const int to = std::min(a.group, b.group), from = std::max(a.group, b.group);
            for (Member& m : want)
              if (m.group == from) m.group = to;
            changed = true;
          }
    }

    // Groups in order of their first member; with too many, those of a member with enough points first, then the
    // nearest.
    struct Group {
      int first;
      float nearest;
      bool has_enough = false;
    };
    std::vector<Group> groups;
    for (int i = 0; i < int(want.size()); ++i) {
      if (want[size_t(i)].group != i) continue;
      Group g{i, 1e9f};
      for (const Member& m : want) {
        if (m.group != i) continue;
        g.has_enough = g.has_enough || m.points.size() >= size_t(kLeastPoints);
        for (int32_t p : m.points) g.nearest = std::min(g.nearest, f.points[size_t(m.sensor)].range_m[p]);
      }
      groups.push_back(g);
    }
    const int32_t found = int32_t(groups.size());
    std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
      return a.has_enough != b.has_enough ? a.has_enough : a.nearest < b.nearest;
    });
    groups.resize(size_t(std::min(found, capacity)));
    std::sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) { return a.first < b.first; });

    CHECK(f.overflow == found - int32_t(groups.size()));
    REQUIRE(f.members.count == int32_t(want.size()));
    REQUIRE(f.merged.count == int32_t(groups.size()));
    for (int32_t m = 0; m < f.members.count; ++m) {
      const Member& w = want[size_t(m)];
      CHECK(f.members.sensor[m] == w.sensor);
      CHECK(f.clusters[size_t(w.sensor)].label[f.members.cluster[m]] == w.label);
      int32_t row = -1;
      for (size_t g = 0; g < groups.size(); ++g)
        if (groups[g].first == w.group) row = int32_t(g);
      CHECK(f.members.merged[m] == row);
    }
    for (int32_t row = 0; row < f.merged.count; ++row) {
      Ints list, points_of(8, 0);
      long double sum[3] = {}, magnitude = 0, stamp = 0;
      float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
      int32_t mask = 0, count = 0;
      for (int32_t m = 0; m < f.members.count; ++m) {
        if (f.members.merged[m] != row) continue;
        list.push_back(m);
        const int s = want[size_t(m)].sensor;
        mask |= 1 << s;
        for (int32_t i : want[size_t(m)].points) {
          float p[3];
          place(s, i, p);
          for (int a = 0; a < 3; ++a) {
            sum[a] += p[a], magnitude += std::fabs(p[a]);
            low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
          }
          stamp += (long double)(rig[size_t(s)].stamp_ns - 1700000000000000000) +
                   rig[size_t(s)].input[size_t(i)].time_offset_ns;
          ++points_of[size_t(s)], ++count;
        }
      }
      CHECK(f.row_members(row) == list);
      CHECK(f.merged.point_count[row] == count);
      CHECK(f.merged.sensor_mask[row] == mask);
      CHECK(f.merged.main_sensor[row] == std::max_element(points_of.begin(), points_of.end()) - points_of.begin());
      CHECK(f.merged.stamp_ns[row] == 1700000000000000000 + int64_t(std::floor(stamp / count)));
      const long double bound = 32 * 0x1p-24L * magnitude / count + 1e-9L;
      CHECK(std::fabs((long double)f.merged.center_x_m[row] - sum[0] / count) <= bound);
      CHECK(std::fabs((long double)f.merged.center_y_m[row] - sum[1] / count) <= bound);
      CHECK(std::fabs((long double)f.merged.center_z_m[row] - sum[2] / count) <= bound);
      CHECK(f.merged.min_x_m[row] == low[0]);
      CHECK(f.merged.min_y_m[row] == low[1]);
      CHECK(f.merged.min_z_m[row] == low[2]);
      CHECK(f.merged.max_x_m[row] == high[0]);
      CHECK(f.merged.max_y_m[row] == high[1]);
      CHECK(f.merged.max_z_m[row] == high[2]);
    }
  }
}
