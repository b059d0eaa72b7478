// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/metrics/gospa.h"

#include <cmath>

#include "pipeline/munkres.h"

namespace overtake::metrics {

// Being alone is a partner of its own: object i may take column tracks + i, track j the row objects + j, each for
// c^p / 2; two such stand-ins cost nothing. So every pairing is complete and the least cost decides alone.
Gospa gospa(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks, const GospaParams& params) {
  const int32_t n = int32_t(objects.size()), m = int32_t(tracks.size());
  Gospa g;
  if (n + m == 0) return g;
  const double alone = std::pow(params.c_m, params.p) / 2;
  Munkres solver(n + m, n + m, (n + m) * (n + m));
  solver.clear(n + m, n + m);
  const auto distance = [&](int32_t i, int32_t j) {
    const MotPlace &a = objects[std::size_t(i)], &b = tracks[std::size_t(j)];
    return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  };
  for (int32_t i = 0; i < n; ++i) {
    for (int32_t j = 0; j < m; ++j)
      if (distance(i, j) < params.c_m) solver.add(i, j, std::pow(distance(i, j), params.p));
    solver.add(i, m + i, alone);
  }
  for (int32_t j = 0; j < m; ++j) {
    solver.add(n + j, j, alone);
    for (int32_t i = 0; i < n; ++i) solver.add(n + j, m + i, 0.0);
  }
  std::vector<int32_t> column(std::size_t(n + m), -1);
  solver.solve(column.data());
  for (int32_t i = 0; i < n; ++i) {
    const int32_t j = column[std::size_t(i)];
    if (j >= 0 && j < m) ++g.pairs, g.localisation += std::pow(distance(i, j), params.p);
  }
  g.missed_count = n - g.pairs, g.false_count = m - g.pairs;
  g.missed = alone * double(g.missed_count), g.false_tracks = alone * double(g.false_count);
  g.distance_m = std::pow(g.localisation + g.missed + g.false_tracks, 1 / params.p);
  return g;
}

}  // namespace overtake::metrics
