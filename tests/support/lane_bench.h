// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best`, alone: detections of a car as the rules give them, and what the tracker makes of them.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "core/cluster_table.h"
#include "core/table.h"
#include "pipeline/track/lane_tracker.h"
#include "tests/support/circle_road.h"

namespace overtake::test {

inline constexpr double kFrame_s = 0.05;
inline int64_t ns_of(int32_t frame) { return int64_t(frame) * 50'000'000; }

// A detection that shows most of a car.
inline Measurement seen_car(double x_m, double y_m, int32_t frame) {
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

// A row of another program: it shows nothing of the car itself.
inline Measurement pushed_row(double x_m, double y_m, int32_t frame) {
  Measurement z = seen_car(x_m, y_m, frame);
  z.points = 0;
  z.height_m = kNotMeasured;
  z.var_x = z.var_y = 0.09;
  return z;
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
  // An iteration of pushed rows, at their own stamp.
  void push(const std::vector<Measurement>& rows_of_another) {
    std::vector<TrackId> of_rows(rows_of_another.size(), kNobody);
    input.stamp_ns = rows_of_another.front().stamp_ns;
    input.measurements = rows_of_another;
    tracker->step(input, of_rows.data());
    tracker->snapshot(rows, states);
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

inline CircleRoad make_ring(double radius_m) {
  CircleRoadDef def;
  def.radius_m = radius_m;
  return CircleRoad(def);
}

// On the centre line of a left-hand ring through the origin, `way_m` along it.
inline Place on_ring(double radius_m, double way_m) {
  return {radius_m * std::sin(way_m / radius_m), radius_m * (1 - std::cos(way_m / radius_m))};
}

}  // namespace overtake::test
