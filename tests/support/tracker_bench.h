// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A tracker with the tables and columns that a test needs.
//
//   TrackerBench bench;
//   bench.step(0.05, {{10.0, 2.0}});       // one frame at 50 ms with one detection
//   bench.tracks().x_m[0]
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "core/table.h"
#include "core/track_table.h"
#include "pipeline/method/methods.h"
#include "tests/support/test_method.h"

namespace overtake::test {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline int64_t to_ns(double s) { return int64_t(std::llround(s * 1e9)); }

struct TestDetection {
  double x_m = 0, y_m = 0;
  double heading_rad = kNan;
  double late_s = 0;  // the detection's stamp is this much before the frame's
  double length_m = kNan, width_m = kNan;
  double var_x = kNan, var_y = kNan, cov_xy = kNan;
};

class TrackerBench {
 public:
  explicit TrackerBench(const overtake::TrackerParams& params = {}, const overtake::CircuitMap* map = nullptr)
      : owner_(overtake::find_method(overtake::test::test_method())
                   ->make_tracker(params, map, overtake::default_allocator())),
        tracker(*owner_) {
    const bool built = arena_.build(overtake::default_allocator(), [&](overtake::Carver& carver) {
      overtake::carve_table(carver, snapshot_, params.track_capacity);
      states_ = carver.take<std::byte>(std::size_t(params.track_capacity) * tracker.state_bytes());
      overtake::carve_table(carver, tracks_, params.track_capacity);
      overtake::carve_table(carver, paths_, params.track_capacity * tracker.path_points());
      paths_.points_per_track = tracker.path_points();
    });
    if (!built) std::abort();
  }

  // The caller may set up `frame` first (ego, sectors); step fills its stamp and detections.
  const std::vector<overtake::TrackId>& step(double time_s, const std::vector<TestDetection>& detections) {
    return step_ns(to_ns(time_s), detections);
  }
  const std::vector<overtake::TrackId>& step_ns(int64_t stamp_ns, const std::vector<TestDetection>& detections) {
    const std::size_t n = detections.size();
    measurements_.resize(n);
    ids.assign(n, overtake::kNobody);
    for (std::size_t i = 0; i < n; ++i) {
      const TestDetection& d = detections[i];
      measurements_[i] = {.x_m = d.x_m,
                          .y_m = d.y_m,
                          .var_x = d.var_x,
                          .var_y = d.var_y,
                          .cov_xy = d.cov_xy,
                          .heading_rad = d.heading_rad,
                          .length_m = d.length_m,
                          .width_m = d.width_m,
                          .stamp_ns = d.late_s == 0 ? stamp_ns : stamp_ns - to_ns(d.late_s)};
    }
    frame.stamp_ns = stamp_ns;
    frame.measurements = measurements_;
    const int64_t late_frames = tracker.counts().late_frames;
    last = {tracker.step(frame, ids.data()), false};
    last.late = tracker.counts().late_frames > late_frames;
    last_ns_ = stamp_ns;
    return ids;
  }

  // Published at the last frame's stamp, or at a given stamp.
  const overtake::TrackTable& tracks() { return tracks_at_ns(last_ns_); }
  const overtake::TrackTable& tracks_at(double time_s) { return tracks_at_ns(to_ns(time_s)); }
  const overtake::TrackTable& tracks_at_ns(int64_t stamp_ns) {
    tracker.snapshot(snapshot_, states_);
    tracker.publish(snapshot_, states_, stamp_ns, tracks_, nullptr, &paths_);
    return tracks_;
  }
  // A pure prediction.
  const overtake::TrackTable& predicted_to(double time_s) { return predicted_to_ns(to_ns(time_s)); }
  const overtake::TrackTable& predicted_to_ns(int64_t stamp_ns) {
    tracker.predict(stamp_ns, snapshot_, states_);
    return snapshot_;
  }
  // The tracks without a prediction.
  const overtake::TrackTable& snapshot() {
    tracker.snapshot(snapshot_, states_);
    return snapshot_;
  }
  int32_t track_count() { return snapshot().count; }
  const overtake::PathTable& paths() const { return paths_; }  // of the last call of tracks...

 private:
  std::unique_ptr<overtake::FrameTracker> owner_;

 public:
  overtake::FrameTracker& tracker;
  overtake::TrackerFrame frame;
  std::vector<overtake::TrackId> ids;  // results of the last step
  struct Result : overtake::StepResult {
    bool late = false;  // too old, or too much work: nothing changed
  };
  Result last;

 private:
  overtake::Arena arena_;
  overtake::TrackTable snapshot_, tracks_;
  std::byte* states_ = nullptr;  // of the snapshot
  overtake::PathTable paths_;
  std::vector<overtake::Measurement> measurements_;
  int64_t last_ns_ = 0;
};

// has_finite_columns: every number of every row is finite. is_finite: also positive diagonals of the covariances.
template <class Table>
bool has_finite_columns(const Table& t) {
  bool finite = true;
  for_each_column(const_cast<Table&>(t), [&](const char*, const auto* column) {
    for (int32_t k = 0; k < t.count; ++k) finite &= bool(std::isfinite(double(column[k])));
  });
  return finite;
}
inline bool is_finite(const overtake::TrackTable& t) {
  for (int32_t k = 0; k < t.count; ++k)
    for (const int32_t diagonal : {0, 2, 5, 9, 14})
      if (!(t.covariance[diagonal][k] > 0)) return false;
  return has_finite_columns(t);
}
inline bool is_finite(const overtake::PathTable& t) { return has_finite_columns(t); }

}  // namespace overtake::test
