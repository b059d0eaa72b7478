// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The circuit's centre line around the ego vehicle, as straight pieces between stations, in float and relative to an
// origin, in the map's axes. Many places near each other are found on it faster than with CircuitMap::project.
#pragma once

#include <cstdint>

#include "core/circuit_map.h"

namespace overtake {

struct CentreLine {
  static constexpr int32_t kMost = 128;
  int32_t first = 0, last = -1;  // stations on the map
  float x_m[kMost], y_m[kMost], left_m[kMost], right_m[kMost];
  float dx_m[kMost], dy_m[kMost];  // to the next station
  float per_m[kMost], per_m2[kMost];

  // Station k < count <= kMost is at s_m + (k - count / 2) * step_m. Stations beyond the ends of an open line are
  // not there.
  void lay(const CircuitMap& map, double s_m, double step_m, int32_t count, double origin_x_m,
           double origin_y_m) noexcept;
  bool empty() const noexcept { return last <= first; }

  // The piece of a place, found from `piece` on; returns the share of its length, outside of 0 to 1 beyond the first
  // and the last station and outside of a corner.
  float find_piece(float x, float y, int32_t& piece) const noexcept {
    int32_t k = piece < first ? first : piece > last - 1 ? last - 1 : piece;
    const auto along = [&](int32_t i) { return ((x - x_m[i]) * dx_m[i] + (y - y_m[i]) * dy_m[i]) * per_m2[i]; };
    float t = along(k);
    while (t > 1.0f && k + 1 < last) t = along(++k);
    while (t < 0.0f && k > first) t = along(--k);
    piece = k;
    return t;
  }
  // Distance to the left of a piece's line.
  float measure_left(float x, float y, int32_t k) const noexcept {
    return (dx_m[k] * (y - y_m[k]) - dy_m[k] * (x - x_m[k])) * per_m[k];
  }
};

}  // namespace overtake
