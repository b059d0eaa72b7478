// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The step mark_own_body: points of the own car are no obstacles.
#include <doctest/doctest.h>

#include <iterator>
#include <string>
#include <vector>

#include "pipeline/method/mark_own_body.h"
#include "tests/support/frame_rules.h"
#include "tests/support/one_sensor_detector.h"

namespace overtake {
namespace {

// Clusters of four points each, by their boxes in the vehicle frame.
struct Clusters {
  struct Box {
    float min_x, max_x, min_y, max_y;
  };
  explicit Clusters(std::vector<Box> boxes) : label(4 * boxes.size()), reason(label.size()), point(label.size()) {
    for (const Box& b : boxes) {
      min_x.push_back(b.min_x), max_x.push_back(b.max_x), min_y.push_back(b.min_y), max_y.push_back(b.max_y);
      begin.push_back(4 * int32_t(count.size()));
      count.push_back(4);
    }
    for (std::size_t i = 0; i < point.size(); ++i) {
      point[i] = int32_t(point.size() - 1 - i);  // the rows of the scan are in another order
      label[std::size_t(point[i])] = int32_t(i / 4) + 1;
    }
    table.count = table.capacity = int32_t(boxes.size());
    table.min_x_m = min_x.data(), table.max_x_m = max_x.data();
    table.min_y_m = min_y.data(), table.max_y_m = max_y.data();
    table.point_begin = begin.data(), table.point_count = count.data();
    members.count = members.capacity = points.count = points.capacity = int32_t(point.size());
    members.point = point.data();
    points.label = label.data(), points.reason = reason.data();
  }
  // Whether all points of a cluster lost their label, with the reason; all or none.
  bool is_marked(std::size_t cluster) const {
    int32_t marked = 0;
    for (std::size_t i = 4 * cluster; i < 4 * cluster + 4; ++i) {
      const std::size_t p = std::size_t(point[i]);
      CHECK((label[p] == kLabelNone) == (Reason(reason[p]) == Reason::kOwnBody));
      if (label[p] != kLabelNone) CHECK(label[p] == int32_t(cluster) + 1);
      marked += label[p] == kLabelNone;
    }
    CHECK(marked % 4 == 0);
    return marked == 4;
  }
  std::vector<float> min_x, max_x, min_y, max_y;
  std::vector<int32_t> begin, count, label;
  std::vector<uint8_t> reason;
  std::vector<int32_t> point;
  ClusterTable table;
  ClusterPointTable members;
  PointTable points;
};

}  // namespace

TEST_CASE("mark_own_body: the points of clusters on the own car, and of no other, lose their labels") {
  Clusters clusters({{-1.4f, 4.4f, -1.1f, 1.1f},
                     {3.0f, 4.6f, -0.5f, 0.5f},
                     {-1.6f, 0.0f, -0.5f, 0.5f},
                     {0.0f, 1.0f, 1.0f, 1.3f},
                     {0.0f, 1.0f, -1.3f, -1.0f},
                     {1.0f, 1.1f, 0.0f, 0.2f},
                     {20.0f, 22.0f, 0.0f, 1.0f}});
  mark_own_body({1.5f, 4.5f, 1.2f}, clusters.table, clusters.members, clusters.points);
  const bool wanted[] = {true, false, false, false, false, true, false};
  for (std::size_t c = 0; c < std::size(wanted); ++c) {
    CAPTURE(c);
    CHECK(clusters.is_marked(c) == wanted[c]);
  }
}

TEST_CASE("mark_own_body: points of the own car count by their reason, and not as points in clusters") {
  const auto run = [](double own_m) {
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, "best") == OVT_OK);
    params.gate_own_front_m = params.gate_own_back_m = params.gate_own_side_m = own_m;
    test::Small small;
    small.def.params = &params;
    small.create();
    const test::Posts posts(20);
    const ovt_points points = posts.points(1'000'000'000);
    REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
    const ovt_stats s = small.stats();
    CHECK(test::find_broken_sum(s, -1, 0) == nullptr);
    return s;
  };
  constexpr int32_t kOwnBody = int32_t(Reason::kOwnBody);
  CHECK(std::string(ovt_reason_name(kOwnBody)) == "own_body");
  const ovt_stats none = run(1), all = run(100);
  REQUIRE(none.points_clustered > 400);
  CHECK(none.points_bad[kOwnBody] == 0);
  CHECK(none.gated_own == 0);
  CHECK(all.points_clustered == 0);
  CHECK(all.points_bad[kOwnBody] == none.points_clustered);
  CHECK(all.clusters > 10);
  CHECK(all.gated_own == all.clusters);
  CHECK(all.points == none.points);
}

}  // namespace overtake
