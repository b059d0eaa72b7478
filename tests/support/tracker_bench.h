// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A tracker with the tables and columns that a test needs, and what must be true of them after any input.
//
//   TrackerBench bench;
//   bench.step(0.05, {{10.0, 2.0}});       // one frame at 50 ms with one detection
//   bench.tracks().x_m[0]
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/math.h"
#include "core/table.h"
#include "core/track_table.h"
#include "pipeline/method/methods.h"
#include "pipeline/params.h"
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
  double height_m = kNan;
  int32_t object_class = 0, free_heading = 0, view = -1, points = 0, debris = 0, faint = 0;
  double score = kNan;
};

// The tracker's parameters of a preset. TrackerParams{} are those of `paper`.
inline overtake::TrackerParams tracker_params_of(const char* method, int32_t tracks = 256, int32_t detections = 256) {
  ovt_params params;
  if (ovt_params_init(&params, sizeof params, method) != OVT_OK) std::abort();
  return overtake::make_tracker_params(params, tracks, detections);
}

class TrackerBench {
 public:
  explicit TrackerBench(const overtake::TrackerParams& params = {}, const overtake::CircuitMap* map = nullptr,
                        const char* method = overtake::test::test_method(),
                        const overtake::Allocator& allocator = overtake::default_allocator())
      : owner_(overtake::find_method(method)->make_tracker(params, map, allocator)), tracker(*owner_) {
    const bool built = arena_.build(overtake::default_allocator(), [&](overtake::Carver& carver) {
      overtake::carve_table(carver, snapshot_, params.track_capacity);
      states_ = carver.take<std::byte>(std::size_t(params.track_capacity) * tracker.state_bytes());
      overtake::carve_table(carver, tracks_, params.track_capacity);
      overtake::carve_table(carver, optional_, params.track_capacity);
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
                          .stamp_ns = d.late_s == 0 ? stamp_ns : stamp_ns - to_ns(d.late_s),
                          .debris = d.debris,
                          .faint = d.faint,
                          .height_m = d.height_m,
                          .object_class = d.object_class,
                          .free_heading = d.free_heading,
                          .view = d.view,
                          .points = d.points,
                          .score = d.score};
    }
    frame.stamp_ns = stamp_ns;
    frame.measurements = measurements_;
    const int64_t late_frames = tracker.counts().late_frames;
    last = {tracker.step(frame, ids.data()), false};
    last.late = tracker.counts().late_frames > late_frames;
    last_ns_ = stamp_ns;
    newest_ns_ = std::max(newest_ns_, stamp_ns);
    return ids;
  }

  // Published at the last frame's stamp, or at a given stamp.
  const overtake::TrackTable& tracks() { return tracks_at_ns(last_ns_); }
  const overtake::TrackTable& tracks_at(double time_s) { return tracks_at_ns(to_ns(time_s)); }
  const overtake::TrackTable& tracks_at_ns(int64_t stamp_ns) {
    tracker.snapshot(snapshot_, states_);
    tracker.publish(snapshot_, states_, stamp_ns, tracks_, &optional_, &paths_);
    return tracks_;
  }
  const overtake::TrackTable& tracks_at_newest() { return tracks_at_ns(newest_ns_); }  // of all stamps so far
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
  // The same; no rows where the method does not write them.
  const overtake::OptionalTrackTable& optional() const { return optional_; }

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
  overtake::OptionalTrackTable optional_;
  overtake::PathTable paths_;
  std::vector<overtake::Measurement> measurements_;
  int64_t last_ns_ = 0, newest_ns_ = std::numeric_limits<int64_t>::min();
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

// Cholesky of the lower triangle, row by row, scaled to a unit diagonal: the state's units have very different sizes.
inline bool is_positive_definite(const overtake::TrackTable& t, int32_t i) {
  double l[5][5] = {}, scale[5];
  for (int32_t r = 0; r < 5; ++r) scale[r] = 1 / std::sqrt(t.covariance[r * (r + 1) / 2 + r][i]);
  for (int32_t r = 0; r < 5; ++r)
    for (int32_t c = 0; c <= r; ++c) {
      double sum = t.covariance[r * (r + 1) / 2 + c][i] * scale[r] * scale[c];
      for (int32_t k = 0; k < c; ++k) sum -= l[r][k] * l[c][k];
      if (r == c && !(sum > -1e-9)) return false;  // tolerates rounding errors
      l[r][c] = r == c ? std::sqrt(std::fmax(sum, 1e-12)) : sum / l[c][c];
    }
  return true;
}
inline bool is_positive_definite(const overtake::TrackTable& t) {
  for (int32_t i = 0; i < t.count; ++i)
    if (!is_positive_definite(t, i)) return false;
  return true;
}

// Of tracks at their own times: every state is one that a car can have.
inline bool is_sound(const overtake::TrackTable& t) {
  for (int32_t i = 0; i < t.count; ++i)
    if (!(t.speed_mps[i] >= 0 && t.speed_mps[i] <= overtake::kMaxSpeed_mps &&
          std::fabs(t.yaw_rate_rps[i]) <= overtake::kMaxYawRate_rps && std::fabs(t.course_rad[i]) <= overtake::kPi &&
          std::fabs(t.heading_rad[i]) <= overtake::kPi && t.hits[i] >= 0 && t.age[i] > 0))
      return false;
  return is_finite(t) && is_positive_definite(t);
}
inline bool is_sound(const overtake::OptionalTrackTable& t) {
  for (int32_t i = 0; i < t.count; ++i)
    if (!(t.existence[i] > 0 && t.existence[i] < 1 && t.unseen_s[i] >= 0 && t.heading_sigma_rad[i] > 0 &&
          t.heading_sigma_rad[i] <= overtake::kPi && t.object_class[i] >= OVT_CLASS_UNKNOWN &&
          t.object_class[i] <= OVT_CLASS_DEBRIS && t.visibility[i] >= OVT_VISIBILITY_SEEN &&
          t.visibility[i] <= OVT_VISIBILITY_OUTSIDE))
      return false;
  return true;
}

// Each row and each track ends in one place.
inline bool adds_up(const overtake::TrackerCounts& c, int32_t track_count) {
  return c.measurements == c.hits + c.births + c.unborn + c.rejected + c.debris + c.late &&
         c.deaths == c.missed + c.silent + c.displaced + c.unsound + c.forgotten + c.joined &&
         c.births - c.deaths == track_count;
}

// The ids after each frame: none is 0, no two tracks share one, and only a frame out of sequence may give back that of
// a deleted track, while the history still has the iterations of that track. The history drops iterations in the order
// of stamps, so some stay for longer than `history_iterations` frames.
class IdWatch {
 public:
  explicit IdWatch(const overtake::TrackerParams& params) : history_(2 * params.history_iterations) {}

  // After each step, with its result.
  bool accepts(const overtake::TrackTable& t, const TrackerBench::Result& last) {
    const int64_t absence = last.refiltered > 0 ? history_ : 1;
    frames_ += !last.late;
    ++looks_;
    for (int32_t i = 0; i < t.count; ++i) {
      if (t.id[i] == overtake::kNobody) return false;
      Seen& seen = last_.emplace(t.id[i], Seen{frames_, 0}).first->second;
      if (seen.look == looks_ || seen.frame < oldest_ || frames_ - seen.frame > absence) return false;
      seen = {frames_, looks_};
    }
    return true;
  }
  void restart() { oldest_ = frames_ + 1; }
  std::size_t ids() const { return last_.size(); }

 private:
  struct Seen {
    int64_t frame, look;
  };
  int64_t history_, frames_ = 0, looks_ = 0, oldest_ = 0;
  std::unordered_map<overtake::TrackId, Seen> last_;
};

}  // namespace overtake::test
