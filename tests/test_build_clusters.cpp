// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/build_clusters.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <vector>

#include "core/arena.h"
#include "core/table.h"

using namespace overtake;

namespace {

struct Input {
  float x, y, z;
  int32_t label;
  int32_t time_offset_ns = 0;
};

// A scan with labels, and the result of build_clusters.
struct Scene {
  Scene(const std::vector<Input>& input, int32_t label_count, int32_t capacity, const Transform& T = {}) {
    const int32_t n = int32_t(input.size());
    auto carve = [&](Carver& carver) {
      carve_table(carver, scan, n);
      carve_table(carver, points, n);
      carve_table(carver, clusters, capacity);
      carve_table(carver, cluster_points, n + kRowAlign);
    };
    Carver measure;
    carve(measure);
    block.resize(measure.bytes() + 64);
    Carver hand_out(reinterpret_cast<void*>((reinterpret_cast<uintptr_t>(block.data()) + 63) / 64 * 64));
    carve(hand_out);
    clusters.capacity = capacity;
    scan.count = points.count = n;
    for (int32_t i = 0; i < n; ++i) {
      const Input& p = input[size_t(i)];
      scan.x_m[i] = p.x, scan.y_m[i] = p.y, scan.z_m[i] = p.z;
      scan.time_offset_ns[i] = p.time_offset_ns;
      points.range_m[i] = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
      points.label[i] = p.label;
    }
    row_of_label.assign(size_t(label_count) + 2, -99);
    std::vector<int32_t> cursor(size_t(label_count) + 1, -99), order(size_t(label_count) + 1, -99);
    overflow = ref::build_clusters(T, scan, points, label_count, clusters, cluster_points, row_of_label.data(),
                                   cursor.data(), order.data());
  }
  std::vector<int32_t> labels() const { return {clusters.label, clusters.label + clusters.count}; }
  std::vector<int32_t> rows() const { return {row_of_label.begin(), row_of_label.end() - 1}; }
  std::vector<int32_t> members(int32_t row) const {
    const int32_t* begin = cluster_points.point + clusters.point_begin[row];
    return {begin, begin + clusters.point_count[row]};
  }

  std::vector<char> block;
  ScanTable scan;
  PointTable points;
  ClusterTable clusters;
  ClusterPointTable cluster_points;
  std::vector<int32_t> row_of_label;
  int32_t overflow = -1;
};

using Ints = std::vector<int32_t>;

}  // namespace

TEST_CASE("build_clusters: groups points by label, in input order, without ground and unlabelled points") {
  const Scene s({{1, 0, 0, 2}, {2, 0, 0, 0}, {3, 0, 0, 1}, {4, 0, 0, -1}, {5, 0, 0, 2}, {6, 0, 0, 1}, {7, 0, 0, 2}}, 2,
                8);
  CHECK(s.overflow == 0);
  CHECK(s.labels() == Ints{1, 2});
  CHECK(s.rows() == Ints{-1, 0, 1});
  CHECK(s.row_of_label.back() == -99);  // nothing is written after the last label
  CHECK(s.cluster_points.count == 5);
  CHECK(s.members(0) == Ints{2, 5});
  CHECK(s.members(1) == Ints{0, 4, 6});
  CHECK(s.clusters.point_begin[1] == 2);
}

TEST_CASE("build_clusters: a label without points gets no row") {
  const Scene s({{1, 0, 0, 3}, {2, 0, 0, 5}}, 6, 8);
  CHECK(s.labels() == Ints{3, 5});
  CHECK(s.rows() == Ints{-1, -1, -1, 0, -1, 1, -1});
}

TEST_CASE("build_clusters: transforms points to the vehicle frame before bounds and sums") {
  // The left sensor: 120 deg to the left, at (1.549, 0.267, 0.741).
  Transform T;
  const float c = -0.5f, h = 0.8660254f;
  const float r[9] = {c, -h, 0, h, c, 0, 0, 0, 1}, t[3] = {1.549f, 0.267f, 0.741f};
  std::copy(r, r + 9, T.r);
  std::copy(t, t + 3, T.t);
  const Scene s({{10, 0, -0.5f, 1, 7}, {10, 2, 0.5f, 1, 8}}, 1, 8, T);
  // (10, 0) -> (-5, 8.66) + t; (10, 2) -> (-5 - 1.732, 8.66 - 1) + t
  CHECK(s.clusters.min_x_m[0] == doctest::Approx(-5.18305));
  CHECK(s.clusters.max_x_m[0] == doctest::Approx(-3.451));
  CHECK(s.clusters.min_y_m[0] == doctest::Approx(7.92725));
  CHECK(s.clusters.max_y_m[0] == doctest::Approx(8.92725));
  CHECK(s.clusters.min_z_m[0] == doctest::Approx(0.241));
  CHECK(s.clusters.max_z_m[0] == doctest::Approx(1.241));
  CHECK(s.clusters.sum_x_m[0] == doctest::Approx(-8.63405));
  CHECK(s.clusters.sum_y_m[0] == doctest::Approx(16.8545));
  CHECK(s.clusters.sum_z_m[0] == doctest::Approx(1.482));
  CHECK(s.clusters.sum_offset_ns[0] == 15);
  // Ranges are the sensor's, not the vehicle frame's.
  CHECK(s.clusters.nearest_m[0] == s.points.range_m[0]);
}

TEST_CASE("build_clusters: keeps the nearest clusters when the table is full, in label order") {
  //                  label:  1           2             3             4            5
  const std::vector<Input> in = {{50, 0, 0, 1}, {20, 0, 0, 2}, {90, 0, 0, 3},
                                 {60, 0, 0, 4}, {10, 0, 0, 5}, {5, 0, 0, 3}};
  const Scene s(in, 5, 3);
  CHECK(s.overflow == 2);
  CHECK(s.labels() == Ints{2, 3, 5});  // cluster 3's nearest point is at 5 m
  CHECK(s.rows() == Ints{-1, -1, 0, 1, -1, 2});
  CHECK(s.members(1) == Ints{2, 5});
  CHECK(s.cluster_points.count == 4);
}

TEST_CASE("build_clusters: clusters of one and two points give way first when the table is full") {
  // Rain near the sensor, and a car of three points behind it.
  const std::vector<Input> in = {{3, 0, 0, 1},  {4, 0, 0, 2},   {4, 0.1f, 0, 2}, {30, 0, 0, 3},
                                 {30, 1, 0, 3}, {30, -1, 0, 3}, {2, 0, 0, 4}};
  const Scene s(in, 4, 2);
  CHECK(s.overflow == 2);
  CHECK(s.labels() == Ints{3, 4});
  CHECK(Scene(in, 4, 1).labels() == Ints{3});
}

TEST_CASE("build_clusters: equal ranges are ordered by the smaller label") {
  const Scene s({{10, 0, 0, 3}, {0, 10, 0, 1}, {0, 0, 10, 2}, {-10, 0, 0, 4}}, 4, 2);
  CHECK(s.overflow == 2);
  CHECK(s.labels() == Ints{1, 2});
}

TEST_CASE("build_clusters: an empty scan, or a table without rows, gives no cluster") {
  const Scene empty({}, 0, 8);
  CHECK(empty.overflow == 0);
  CHECK(empty.clusters.count == 0);
  CHECK(empty.cluster_points.count == 0);
  CHECK(empty.rows() == Ints{-1});
  const Scene no_room({{1, 0, 0, 1}, {2, 0, 0, 2}}, 2, 0);
  CHECK(no_room.overflow == 2);
  CHECK(no_room.clusters.count == 0);
  CHECK(no_room.rows() == Ints{-1, -1, -1});
}

TEST_CASE("build_clusters: adds time offsets of both signs without overflow") {
  std::vector<Input> in;
  for (int i = 0; i < 20000; ++i) in.push_back({5, 0, 0, 1, 2147483647});
  for (int i = 0; i < 3; ++i) in.push_back({6, 0, 0, 2, -2147483647});
  const Scene s(in, 2, 4);
  CHECK(s.clusters.sum_offset_ns[0] == 20000LL * 2147483647LL);
  CHECK(s.clusters.sum_offset_ns[1] == -3LL * 2147483647LL);
}

TEST_CASE("build_clusters: adds point k of a cluster in lane k % 16, then lanes pairwise 8, 4, 2 and 1 apart") {
  for (int count : {1, 15, 16, 17, 1000}) {
    CAPTURE(count);
    std::mt19937 random{uint32_t(count)};
    std::uniform_real_distribution<float> value(-90.0f, 90.0f);
    std::vector<Input> in;
    for (int i = 0; i < count; ++i) {
      in.push_back({value(random), value(random), value(random), 2});
      in.push_back({value(random), value(random), value(random), 1});  // the other cluster's points lie between
    }
    const Scene s(in, 2, 4);
    float lane[16] = {};
    long double exact = 0, magnitude = 0;
    for (int k = 0; k < count; ++k) {
      const float x = in[size_t(2 * k)].x;
      lane[k % 16] += x;
      exact += x, magnitude += std::fabs(x);
    }
    for (int apart : {8, 4, 2, 1})
      for (int l = 0; l < apart; ++l) lane[l] += lane[l + apart];
    CHECK(std::bit_cast<uint32_t>(s.clusters.sum_x_m[1]) == std::bit_cast<uint32_t>(lane[0]));
    CHECK(std::fabs((long double)s.clusters.sum_x_m[1] - exact) <= (count / 16 + 5) * 0x1p-24L * magnitude);
  }
}

TEST_CASE("build_clusters: agrees with a plain search over all points on random labels") {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const int32_t label_count = int32_t(random() % 30), count = int32_t(random() % 200),
                  capacity = int32_t(random() % 24);
    std::uniform_int_distribution<int32_t> label(-1, label_count);
    std::uniform_int_distribution<int32_t> metres(-9, 9);  // whole metres, so that ranges tie
    std::vector<Input> in;
    for (int32_t i = 0; i < count; ++i)
      in.push_back({float(metres(random)), float(metres(random)), 10.0f, label(random), int32_t(random() % 1000)});
    const Scene s(in, label_count, capacity);

    struct Row {
      float nearest;
      int32_t label;
      Ints members;
    };
    std::vector<Row> want;
    for (int32_t l = 1; l <= label_count; ++l) {
      Row row{1e9f, l, {}};
      for (int32_t i = 0; i < count; ++i)
        if (in[size_t(i)].label == l)
          row.members.push_back(i), row.nearest = std::min(row.nearest, s.points.range_m[i]);
      if (!row.members.empty()) want.push_back(row);
    }
    const int32_t found = int32_t(want.size());
    std::stable_sort(want.begin(), want.end(), [](const Row& a, const Row& b) {
      const bool few_a = a.members.size() < size_t(kLeastPoints), few_b = b.members.size() < size_t(kLeastPoints);
      return few_a != few_b ? few_b : a.nearest < b.nearest;
    });
    want.resize(size_t(std::min(found, capacity)));
    std::sort(want.begin(), want.end(), [](const Row& a, const Row& b) { return a.label < b.label; });

    CHECK(s.overflow == found - int32_t(want.size()));
    REQUIRE(s.clusters.count == int32_t(want.size()));
    Ints rows(size_t(label_count) + 1, -1);
    for (int32_t row = 0; row < s.clusters.count; ++row) {
      const Row& w = want[size_t(row)];
      rows[size_t(w.label)] = row;
      CHECK(s.clusters.label[row] == w.label);
      CHECK(s.members(row) == w.members);
      CHECK(s.clusters.nearest_m[row] == w.nearest);
      float low = 1e9f, high = -1e9f;
      int64_t offset = 0;
      for (int32_t i : w.members) {
        low = std::min(low, in[size_t(i)].y), high = std::max(high, in[size_t(i)].y);
        offset += in[size_t(i)].time_offset_ns;
      }
      CHECK(s.clusters.min_y_m[row] == low);
      CHECK(s.clusters.max_y_m[row] == high);
      CHECK(s.clusters.sum_offset_ns[row] == offset);
    }
    CHECK(s.rows() == rows);
  }
}
