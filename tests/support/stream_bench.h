// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Detectors of the demo scene with every eighth point, so that a test can push many scans in pieces.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/detector_bench.h"
#include "tests/support/pieces.h"

namespace overtake::test {

inline constexpr int64_t kMs = 1'000'000;
inline constexpr std::size_t kFrames = 5;

// Every eighth point of the demo scene, ring by ring or column by column.
inline const SceneScan& thin_scan(std::size_t frame, int32_t sensor, bool by_column = false) {
  static const auto all = [] {
    std::vector<SceneScan> scans;
    for (std::size_t k = 0; k < kFrames; ++k)
      for (std::size_t s = 0; s < 3; ++s)
        for (const bool columns : {false, true}) {
          const SceneScan& whole = demo_frame(k).scan[s];
          std::vector<std::size_t> order;
          for (std::size_t i = 0; i < whole.x_m.size(); i += 8) order.push_back(i);
          if (columns)
            std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
              return std::atan2(whole.y_m[a], whole.x_m[a]) > std::atan2(whole.y_m[b], whole.x_m[b]);
            });
          SceneScan thin;
          for (const std::size_t i : order) {
            thin.add_point(whole, i);
          }
          scans.push_back(std::move(thin));
        }
    return scans;
  }();
  return all[(frame * 3 + std::size_t(sensor)) * 2 + by_column];
}

struct Thin : DetectorBench {
  explicit Thin(const Options& options, bool columns = false) : DetectorBench(options), by_column(columns) {
    for (ovt_sensor_def& sensor : sensors) sensor.cols = 107, sensor.point_capacity = 6000;
  }
  ovt_points points(std::size_t frame, int32_t sensor) const {
    return points_of(thin_scan(frame, sensor, by_column), sensor, demo_frame(frame).stamp_ns);
  }
  ovt_status push_piece(const ovt_points& scan, const Range& range) {
    const ovt_points piece = piece_of(scan, range.first, range.last);
    return ovt_push_points(detector, &piece);
  }
  ovt_status end(const ovt_points& scan, int32_t count = -1) {
    return ovt_end_scan(detector, scan.sensor, scan.stamp_ns, count);
  }
  bool by_column;
};

// One sensor of the thin demo scene; each scan may lack points.
struct OneSensor : Thin {
  explicit OneSensor(int32_t workers = 1) : Thin({.workers = workers}) {
    def.sensor_count = 1;
    def.stream = 1;
  }
  // A scan without the points of `lost`, as one push.
  void push_without(std::size_t frame, const Range& lost) {
    const SceneScan& all = thin_scan(frame, 0);
    SceneScan rest;
    for (std::size_t i = 0; i < all.x_m.size(); ++i) {
      if (int32_t(i) >= lost.first && int32_t(i) < lost.last) continue;
      rest.add_point(all, i);
    }
    const ovt_points points = points_of(rest, 0, demo_frame(frame).stamp_ns);
    REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
  }
};

inline bool same_segmentation(const FrameRecord& a, const FrameRecord& b) {
  return a.labels == b.labels && a.images == b.images && a.info.cluster_count == b.info.cluster_count;
}

}  // namespace overtake::test
