// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Finds which sensors are neighbours. Sorts all sensors that do not wrap clockwise by the azimuth of their image's
// middle. Each sensor is the left neighbour of the next one, the last one that of the first.
//
//   3 x 120 deg:   left (+120) -> front (0) -> right (-120) -> left        three seams, the rear one is right -> left
//   2 sensors:     a -> b -> a                                             both directions
//   1 sensor:      none; a sensor that wraps has no edge
#include "core/math.h"
#include "kernels/merge_seams.h"

namespace overtake {

int32_t find_seams(const SensorModel* sensors, int32_t sensor_count, int32_t left[kMaxSensors],
                   int32_t right[kMaxSensors]) noexcept {
  OVT_CHECK(sensor_count >= 0 && sensor_count <= kMaxSensors);
  int32_t order[kMaxSensors] = {};
  double azimuth[kMaxSensors] = {};
  int32_t count = 0;
  for (int32_t s = 0; s < sensor_count; ++s) {
    const SensorModel& m = sensors[s];
    if (m.wraps) continue;
    const double middle = wrap_angle(double(m.mounting_yaw_rad) + double(m.azimuth_left_rad) -
                                     0.5 * double(m.cols) * double(m.pitch_rad));
    int32_t at = count++;  // insertion sort: left first, ties in sensor order
    for (; at > 0 && azimuth[at - 1] < middle; --at) {
      azimuth[at] = azimuth[at - 1];
      order[at] = order[at - 1];
    }
    azimuth[at] = middle;
    order[at] = s;
  }
  if (count < 2) return 0;
  for (int32_t i = 0; i < count; ++i) {
    left[i] = order[i];
    right[i] = order[(i + 1) % count];
  }
  return count;
}

}  // namespace overtake
