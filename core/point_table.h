// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Points of one sensor's scan: the input, and the result for each point.
#pragma once

#include <cstdint>

namespace overtake {

inline constexpr int32_t kNoLayer = -1;    // layer value that was not an integer in 0..65535
inline constexpr int32_t kLabelNone = -1;  // -1 none, 0 ground, clusters from 1
inline constexpr int32_t kLabelGround = 0;

// Why a point carries no label. Every point ends with a label or one of these.
enum class Reason : uint8_t {
  kLabelled = 0,    // has a label (ground or a cluster)
  kNotFinite,       // NaN or infinity in x, y, z or the azimuth's inputs
  kZeroRange,       // all three coordinates zero (a subnormal counts as zero)
  kRangeLimit,      // nearer or farther than the sensor's limits
  kBadLayer,        // layer outside the sensor's range, or not a uint16
  kOutsideAzimuth,  // outside the sensor's azimuth limits
  kLayerDropped,    // more layers than rows: this one had the fewest points
  kDust,            // another point won its pixel, and this one is more than 0.5 m nearer
  kSecondReturn,    // another point won its pixel, and this one is more than 0.5 m farther
  kSmoke,           // among smoke or dust (drop_smoke), not an obstacle
  kOwnBody,         // in a cluster of the own car (mark_own_body), not an obstacle
  kCount
};
inline constexpr int32_t kReasonCount = int32_t(Reason::kCount);
const char* reason_name(Reason reason) noexcept;  // "labelled", "not_finite", ... as written to reasons.json

// One row per input point, input order, sensor frame. Written by load_points when the scan is pushed.
struct ScanTable {
  int32_t count = 0, capacity = 0;
  float *x_m = nullptr, *y_m = nullptr, *z_m = nullptr;
  float* intensity = nullptr;         // 0 if the sensor has none; NaN becomes 0
  int32_t* layer = nullptr;           // 0..65535 or kNoLayer
  int32_t* time_offset_ns = nullptr;  // after the scan's stamp; 0 if the sensor has none
};
// clang-format off
template <class F>
void for_each_column(ScanTable& t, F&& f) {
  f("x_m", t.x_m);              f("y_m", t.y_m);       f("z_m", t.z_m);
  f("intensity", t.intensity);  f("layer", t.layer);   f("time_offset_ns", t.time_offset_ns);
}
// clang-format on

// Points [first, last). Bounds between two spans are multiples of kPointSpan, so they share no vector and no cache
// line.
inline constexpr int32_t kPointSpan = 64;
struct PointSpan {
  int32_t first = 0, last = INT32_MAX;
};

// One row per input point, same order: the results of the stages.
struct PointTable {
  int32_t count = 0, capacity = 0;
  float* range_m = nullptr;        // project_points; 0 for a dropped point
  float* elevation_rad = nullptr;  // project_points
  int32_t* column = nullptr;       // project_points; -1 for a dropped point
  int32_t* pixel = nullptr;        // scatter_points: row * stride + column in the images, -1 none
  int32_t* label = nullptr;        // scatter_points: ground or none; label_points, mark_smoke, mark_own_body
  uint8_t* lost = nullptr;         // scatter_points: 1 if another point won its pixel, else 0
  uint8_t* reason = nullptr;       // Reason; the same steps as `label`, and project_points
};
// clang-format off
template <class F>
void for_each_column(PointTable& t, F&& f) {
  f("range_m", t.range_m);  f("elevation_rad", t.elevation_rad);  f("column", t.column);
  f("pixel", t.pixel);      f("label", t.label);
  f("lost", t.lost);        f("reason", t.reason);
}
// clang-format on

}  // namespace overtake
