// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/scatter_more.h"

#include <algorithm>

#include "core/check.h"

namespace overtake {

void clear_pixels(RangeImages& images) noexcept {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r) {
    std::fill_n(images.range_m.row(r), winner.cols, kNoReturn);
    std::fill_n(images.elevation_rad.row(r), winner.cols, 0.0f);
    std::fill_n(winner.row(r), winner.cols, kNoPoint);
  }
}

void scatter_more(const ScanTable& scan, const int32_t* row_of_layer, int32_t begin, int32_t end, PointTable& points,
                  RangeImages& images) noexcept {
  const Plane<int32_t> winner = images.pixel_point;
  const int32_t *layers = scan.layer, *columns = points.column;
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  int32_t *pixels = points.pixel, *winners = winner.data;
  uint8_t* lost = points.lost;
  float *pixel_range_m = images.range_m.data, *pixel_elevation_rad = images.elevation_rad.data;
  for (int32_t i = begin; i < end; ++i) {
    lost[i] = 0;
    if (columns[i] < 0) {
      pixels[i] = -1;
      continue;
    }
    const int32_t row = row_of_layer[layers[i]];
    OVT_CHECK(row >= 0 && row < winner.rows && columns[i] < winner.cols);
    const int32_t pixel = row * winner.stride + columns[i], old = winners[pixel];
    pixels[i] = pixel;
    if (old != kNoPoint) {
      const bool wins = intensity[i] > intensity[old] || (intensity[i] == intensity[old] && range_m[i] < range_m[old]);
      lost[wins ? old : i] = 1;
      if (!wins) continue;
    }
    winners[pixel] = i;
    pixel_range_m[pixel] = range_m[i];
    pixel_elevation_rad[pixel] = elevation_rad[i];
  }
}

}  // namespace overtake
