// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/gap_watch.h"

#include <algorithm>

#include "pipeline/track/iteration.h"

namespace overtake {
namespace {

constexpr double kLasting_s = 0.25, kLongestStep_s = 0.6;  // a gap that no scan tells for longer begins anew
constexpr int64_t kNotNow = INT64_MAX;

bool is_in_gap(const ViewGaps& gaps, int32_t cols, int32_t first, int32_t end) noexcept {
  return std::any_of(gaps.gap, gaps.gap + gaps.count, [&](const ViewGap& gap) {
    const int32_t low = gap.first_col, high = low + gap.cols;
    return (first >= low && end <= high) || (first + cols >= low && end + cols <= high);
  });
}

}  // namespace

void GapWatch::restart() noexcept {
  for (Sensor& state : sensor_) state.stamp_ns = INT64_MIN, state.has_gaps = false, state.lasting.count = 0;
}

void GapWatch::follow(const SensorModel& sensor, const ViewGaps& gaps, int64_t stamp_ns, Sensor& state) const noexcept {
  const int32_t parts = std::min(kParts, sensor.cols);
  const auto first_of = [&](int32_t part) { return int32_t(int64_t(part) * sensor.cols / parts); };
  bool lasts[kParts];
  for (int32_t p = 0; p < parts; ++p) {
    int64_t& since_ns = state.since_ns[p];
    if (!state.has_gaps) since_ns = kNotNow;
    if (!is_in_gap(gaps, sensor.cols, first_of(p), first_of(p + 1)))
      since_ns = kNotNow;
    else if (since_ns == kNotNow)
      since_ns = stamp_ns;
    lasts[p] = since_ns != kNotNow && seconds_between(since_ns, stamp_ns) >= kLasting_s;
  }
  state.has_gaps = gaps.count > 0;
  state.lasting.count = 0;
  // From a part that does not last, so that no gap of a sensor that wraps is cut in two.
  const int32_t begin = sensor.wraps ? int32_t(std::find(lasts, lasts + parts, false) - lasts) % parts : 0;
  const auto part_at = [&](int32_t i) { return sensor.wraps ? (begin + i) % parts : i; };
  for (int32_t i = 0; i < parts && state.lasting.count < kMaxViewGaps;) {
    if (!lasts[part_at(i)]) {
      ++i;
      continue;
    }
    const int32_t first = part_at(i);
    int32_t cols = 0;
    for (; i < parts && lasts[part_at(i)]; ++i) cols += first_of(part_at(i) + 1) - first_of(part_at(i));
    const int32_t cut =
        2 * ((sensor.cols + parts - 1) / parts);  // parts that lie across an edge of the gap do not last
    if (cols > least_gap(sensor) - cut) state.lasting.gap[state.lasting.count++] = {first_of(first), cols};
  }
}

void GapWatch::follow(const SensorModel* sensors, int32_t sensor_count, Frame& frame) noexcept {
  for (int32_t s = 0; s < sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    Sensor& state = sensor_[s];
    const bool is_whole = part.present && !(frame.incomplete_mask >> s & 1u);
    if (is_whole && seconds_between(state.stamp_ns, part.stamp_ns) > kLongestStep_s)
      state.lasting.count = 0, state.has_gaps = false;
    if (is_whole && frame.gaps[s].known && part.stamp_ns > state.stamp_ns) {
      if (state.has_gaps || frame.gaps[s].count > 0) follow(sensors[s], frame.gaps[s], part.stamp_ns, state);
      state.stamp_ns = part.stamp_ns;
    }
    frame.blocked[s] = is_whole ? state.lasting : ViewGaps{};
  }
}

}  // namespace overtake
