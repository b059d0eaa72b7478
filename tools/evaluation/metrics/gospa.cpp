// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/gospa.h"

#include <cmath>

#include "tools/evaluation/metrics/assignment.h"

namespace overtake::metrics {

// A pair costs d^p. An object and a track without a partner cost c^p / 2 each; here the object pays for both, because
// the cost that every track has in any case does not change the choice.
Gospa gospa(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks, const GospaParams& params) {
  const int32_t n = int32_t(objects.size()), m = int32_t(tracks.size());
  Gospa g;
  if (n + m == 0) return g;
  const double alone = std::pow(params.c_m, params.p) / 2;
  const auto distance = [&](int32_t i, int32_t j) {
    const MotPlace &a = objects[std::size_t(i)], &b = tracks[std::size_t(j)];
    return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  };
  const std::vector<int32_t> column = assign(n, m, 2 * alone, [&](int32_t i, int32_t j) {
    return distance(i, j) < params.c_m ? std::pow(distance(i, j), params.p) : kForbidden;
  });
  for (int32_t i = 0; i < n; ++i) {
    const int32_t j = column[std::size_t(i)];
    if (j >= 0) ++g.pairs, g.localisation += std::pow(distance(i, j), params.p);
  }
  g.missed_count = n - g.pairs, g.false_count = m - g.pairs;
  g.missed = alone * double(g.missed_count), g.false_tracks = alone * double(g.false_count);
  g.distance_m = std::pow(g.localisation + g.missed + g.false_tracks, 1 / params.p);
  return g;
}

}  // namespace overtake::metrics
