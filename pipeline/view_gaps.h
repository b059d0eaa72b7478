// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Parts of a sensor's view in which no row has a return: dirt or tape on its window, a part of the own car, a driver
// that crops the view. A road returns in every column that sees it, so where a scan shows ground, a gap of several
// degrees is mostly none of the scene. What looks like one: a view over a crest into the sky.
#pragma once

#include <cstdint>

#include "core/range_image.h"
#include "core/sensor_model.h"

namespace overtake {

inline constexpr int32_t kMaxViewGaps = 8;  // of a sensor; further ones, to the right of these, do not count

struct ViewGap {
  int32_t first_col, cols;  // of a sensor that wraps, the columns go on at column 0
};

// In ascending order of the columns, but for one that goes on at column 0.
struct ViewGaps {
  bool known = false;  // the scan shows enough ground to tell
  int32_t count = 0;
  ViewGap gap[kMaxViewGaps];
};

// Columns of the narrowest gap that counts, 3 deg. The wing of the own car hides up to 1.7 deg.
int32_t least_gap(const SensorModel& sensor) noexcept;

// The gaps of one scan, `known` aside.
ViewGaps find_gaps(const SensorModel& sensor, Plane<const int32_t> pixel_point) noexcept;

inline float left_of(const SensorModel& sensor, const ViewGap& gap) {  // azimuth of the left edge
  return sensor.azimuth_left_rad - sensor.pitch_rad * float(gap.first_col);
}
inline float width_of(const SensorModel& sensor, const ViewGap& gap) { return sensor.pitch_rad * float(gap.cols); }

}  // namespace overtake
