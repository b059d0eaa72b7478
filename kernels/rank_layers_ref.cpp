// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: assigns layers to image rows.
//
// Both orders below are total (the layer id breaks every tie), so any sorting algorithm gives the same result. The
// means are quotients of two integers that a double holds exactly.
#include "kernels/rank_layers.h"

#include <algorithm>

#include "core/check.h"

namespace overtake::ref {

int32_t rank_layers(int32_t rows, LayerSums& sums, int32_t* row_of_layer, int32_t* layer_order) noexcept {
  OVT_CHECK(rows >= 1);
  int32_t* const first = layer_order;
  int32_t* const last = std::copy(sums.touched, sums.touched + sums.touched_count, layer_order);
  int32_t* kept_last = last;

  if (sums.touched_count > rows) {
    std::sort(first, last, [&](int32_t a, int32_t b) {
      const int32_t points_a = sums.point_count[a], points_b = sums.point_count[b];
      return points_a != points_b ? points_a > points_b : a < b;
    });
    kept_last = first + rows;
    for (const int32_t* layer = kept_last; layer != last; ++layer) row_of_layer[*layer] = -1;
  }

  std::sort(first, kept_last, [&](int32_t a, int32_t b) {
    const double mean_a = double(sums.elevation_sum[a]) / double(sums.point_count[a]);
    const double mean_b = double(sums.elevation_sum[b]) / double(sums.point_count[b]);
    return mean_a != mean_b ? mean_a > mean_b : a < b;
  });
  const auto row_count = int32_t(kept_last - first);
  for (int32_t row = 0; row < row_count; ++row) row_of_layer[first[row]] = row;

  for (const int32_t* layer = first; layer != last; ++layer) {
    sums.point_count[*layer] = 0;
    sums.elevation_sum[*layer] = 0;
  }
  return row_count;
}

}  // namespace overtake::ref
