// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/view_gaps.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "core/point_table.h"
#include "pipeline/stages.h"

namespace overtake {
namespace {

constexpr double kLeastGap_rad = 3.0 * kPi / 180;
constexpr int32_t kMostOf4 = 3;  // quarters of the view

// The lower rows see the road, so most columns are known by their first pixels.
bool is_empty(Plane<const int32_t> pixel_point, int32_t col) noexcept {
  for (int32_t r = pixel_point.rows - 1; r >= 0; --r)
    if (pixel_point.row(r)[col] != kNoPoint) return false;
  return true;
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
  int32_t all = 0, seen_from = cols;                // columns from there on belong to a gap that began left of column 0
  for (int32_t c = 0; c < seen_from; c += least) {  // each gap that counts has such a column
    if (!is_empty(pixel_point, c)) continue;
    int32_t first = c, end = c + 1;  // the gap is [first, end)
    const int32_t lowest = sensor.wraps ? end - cols : 0;
    while (first > lowest && is_empty(pixel_point, column(first - 1))) --first;
    const int32_t highest = sensor.wraps ? first + cols : cols;
    while (end < highest && is_empty(pixel_point, column(end))) ++end;
    if (first < 0) seen_from = first + cols;
    if (end - first >= least) {
      all += end - first;
      if (gaps.count < kMaxViewGaps) gaps.gap[gaps.count++] = {column(first), end - first};
    }
    c = (end - 1) / least * least;
  }
  if (4 * all > kMostOf4 * cols) gaps.count = 0;
  return gaps;
}

void find_view_gaps(const StageContext& context, Frame& frame) noexcept {
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    frame.gaps[s] = part.present ? find_gaps(context.sensors[s], part.kept.images.pixel_point) : ViewGaps{};
  }
}

}  // namespace overtake
