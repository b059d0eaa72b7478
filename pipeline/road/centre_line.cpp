// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/centre_line.h"

#include <algorithm>
#include <cmath>

namespace overtake {

void CentreLine::lay(const CircuitMap& map, double s_m, double step_m, int32_t count, double origin_x_m,
                     double origin_y_m) noexcept {
  const double length = map.length_m();
  int32_t hint = -1;
  first = count;
  last = -1;
  for (int32_t k = 0; k < count; ++k) {
    const double s = s_m + (k - count / 2) * step_m;
    if (!map.closed() && (s < 0.0 || s > length)) continue;
    const MapPose at = map.at(s, &hint);
    first = std::min(first, k);
    last = k;
    x_m[k] = float(at.x_m - origin_x_m);
    y_m[k] = float(at.y_m - origin_y_m);
    left_m[k] = float(at.width_left_m);
    right_m[k] = float(at.width_right_m);
  }
  for (int32_t k = first; k < last; ++k) {
    dx_m[k] = x_m[k + 1] - x_m[k];
    dy_m[k] = y_m[k + 1] - y_m[k];
    const float length2 = dx_m[k] * dx_m[k] + dy_m[k] * dy_m[k];
    per_m2[k] = length2 > 1e-6f ? 1.0f / length2 : 0.0f;
    per_m[k] = std::sqrt(per_m2[k]);
  }
}

}  // namespace overtake
