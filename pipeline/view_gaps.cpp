// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/view_gaps.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "core/point_table.h"
#include "pipeline/frame_flags.h"
#include "pipeline/stages.h"

namespace overtake {
namespace {

constexpr double kLeastGap_rad = 3.0 * kPi / 180;
constexpr double kLeastGround = 0.2;  // share of the labelled points; the drivers that remove the ground leave less

// The lower rows see the road, so most columns are known by their first pixels.
bool is_empty(Plane<const int32_t> pixel_point, int32_t col) noexcept {
  for (int32_t r = pixel_point.rows - 1; r >= 0; --r)
    if (pixel_point.row(r)[col] != kNoPoint) return false;
  return true;
}

bool shows_ground(const SensorPart& part) noexcept {
  return double(count_ground(part)) > kLeastGround * double(part.reason_count[int32_t(Reason::kLabelled)]);
}

}  // namespace

int32_t least_gap(const SensorModel& sensor) noexcept {
  constexpr double kRounding = 1e-3;  // of a column
  return std::max(int32_t(std::ceil(kLeastGap_rad / double(sensor.pitch_rad) - kRounding)), 1);
}

ViewGaps find_gaps(const SensorModel& sensor, Plane<const int32_t> pixel_point) noexcept {
  const int32_t cols = pixel_point.cols, least = least_gap(sensor);
  const auto column = [&](int32_t c) { return c < 0 ? c + cols : c >= cols ? c - cols : c; };
  ViewGaps gaps;
  int32_t seen_from = cols;                         // columns from there on belong to a gap that began left of column 0
  for (int32_t c = 0; c < seen_from; c += least) {  // each gap that counts has such a column
    if (!is_empty(pixel_point, c)) continue;
    int32_t first = c, end = c + 1;  // the gap is [first, end)
    const int32_t lowest = sensor.wraps ? end - cols : 0;
    while (first > lowest && is_empty(pixel_point, column(first - 1))) --first;
    const int32_t highest = sensor.wraps ? first + cols : cols;
    while (end < highest && is_empty(pixel_point, column(end))) ++end;
    if (first < 0) seen_from = first + cols;
    if (end - first >= least && gaps.count < kMaxViewGaps) gaps.gap[gaps.count++] = {column(first), end - first};
    c = (end - 1) / least * least;
  }
  return gaps;
}

void find_view_gaps(const StageContext& context, Frame& frame) noexcept {
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    frame.gaps[s] = {};
    if (!part.present || !shows_ground(part)) continue;
    frame.gaps[s] = find_gaps(context.sensors[s], part.kept.images.pixel_point);
    frame.gaps[s].known = true;
  }
}

}  // namespace overtake
