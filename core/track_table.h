// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracks as they are published. The tracker's own working state (a 5 x 5 covariance per slot) lies in pipeline/tracker.
#pragma once

#include <cstdint>

#include "core/ids.h"

namespace overtake {

enum class TrackState : int32_t { kTentative = 0, kConfirmed = 1 };
inline constexpr int32_t kTrackStateSize = 5;        // x, y, v, phi, omega
inline constexpr int32_t kTrackCovarianceSize = 15;  // lower triangle, row by row

// Health of a track, TrackTable::flags.
inline constexpr uint32_t kTrackCoasting = 1;    // this frame holds no measurement of it
inline constexpr uint32_t kTrackUnobserved = 2;  // no sensor of this frame could see its place
inline constexpr uint32_t kTrackStale = 4;       // last measured more than kTrackStale_s ago
inline constexpr double kTrackStale_s = 0.5;

// One row per live track, by slot. Frame of reference: the map, or the vehicle where no ego pose is known.
struct TrackTable {
  int32_t count = 0, capacity = 0;
  TrackId* id = nullptr;
  int32_t* state = nullptr;        // TrackState
  int64_t* stamp_ns = nullptr;     // the time x..omega are predicted to
  int64_t* measured_ns = nullptr;  // the last measurement used
  double *x_m = nullptr, *y_m = nullptr, *speed_mps = nullptr, *course_rad = nullptr, *yaw_rate_rps = nullptr;
  double* covariance[kTrackCovarianceSize] = {};   // lower triangle of P: (0,0) (1,0) (1,1) (2,0) ...
  double* heading_rad = nullptr;                   // psi of the last detection, turned on by omega
  double *length_m = nullptr, *width_m = nullptr;  // extent of the last detection
  int32_t *age = nullptr, *hits = nullptr;         // iterations lived; hits among the last N
  int32_t* detection = nullptr;                    // row of this frame's DetectionTable, -1 none
  uint32_t* flags = nullptr;                       // kTrackCoasting ...
};
// clang-format off
template <class F>
void for_each_column(TrackTable& t, F&& f) {
  static constexpr const char* kCovarianceName[kTrackCovarianceSize] = {
      "p_xx",  "p_yx",  "p_yy",  "p_vx",  "p_vy",  "p_vv",  "p_cx",  "p_cy",
      "p_cv",  "p_cc",  "p_wx",  "p_wy",  "p_wv",  "p_wc",  "p_ww"};
  f("id", t.id);                  f("state", t.state);
  f("stamp_ns", t.stamp_ns);      f("measured_ns", t.measured_ns);
  f("x_m", t.x_m);                f("y_m", t.y_m);                f("speed_mps", t.speed_mps);
  f("course_rad", t.course_rad);  f("yaw_rate_rps", t.yaw_rate_rps);
  for (int32_t i = 0; i < kTrackCovarianceSize; ++i) f(kCovarianceName[i], t.covariance[i]);
  f("heading_rad", t.heading_rad); f("length_m", t.length_m);     f("width_m", t.width_m);
  f("age", t.age);                f("hits", t.hits);              f("detection", t.detection);
  f("flags", t.flags);
}
// clang-format on

// Predicted path of the tracks in a TrackTable: point k of track i is row i * points_per_track + k, at
// stamp + (k + 1) * step.
struct PathTable {
  int32_t count = 0, capacity = 0;
  int32_t points_per_track = 0;
  double *x_m = nullptr, *y_m = nullptr, *course_rad = nullptr, *speed_mps = nullptr;
  double *var_x = nullptr, *var_y = nullptr, *cov_xy = nullptr;
};
// clang-format off
template <class F>
void for_each_column(PathTable& t, F&& f) {
  f("x_m", t.x_m);      f("y_m", t.y_m);      f("course_rad", t.course_rad);  f("speed_mps", t.speed_mps);
  f("var_x", t.var_x);  f("var_y", t.var_y);  f("cov_xy", t.cov_xy);
}
// clang-format on

}  // namespace overtake
