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

// Blocks of one layer, which are most: their pixels are computed in vectors.
void scatter_more(const ScanTable& scan, const int32_t* row_of_layer, int32_t begin, int32_t end, PointTable& points,
                  RangeImages& images) noexcept {
  constexpr int32_t kBlock = 64;
  const Plane<int32_t> winner = images.pixel_point;
  const int32_t *layers = scan.layer, *columns = points.column;
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  int32_t *pixels = points.pixel, *labels = points.label, *winners = winner.data;
  uint8_t* lost = points.lost;
  float *pixel_range_m = images.range_m.data, *pixel_elevation_rad = images.elevation_rad.data;
  for (int32_t first = begin; first < end; first += kBlock) {
    const int32_t last = std::min(first + kBlock, end);
    const int32_t layer = layers[first];
    int32_t others = 0;
    for (int32_t i = first; i < last; ++i) others |= layers[i] ^ layer;
    if (others == 0 && columns[first] >= 0) {  // else its layer may have no row
      const int32_t row_begin = row_of_layer[layer] * winner.stride;
      for (int32_t i = first; i < last; ++i) pixels[i] = columns[i] < 0 ? -1 : row_begin + columns[i];
    } else {
      for (int32_t i = first; i < last; ++i)
        pixels[i] = columns[i] < 0 ? -1 : row_of_layer[layers[i]] * winner.stride + columns[i];
    }
    std::fill(lost + first, lost + last, uint8_t(0));
    for (int32_t i = first; i < last; ++i) labels[i] = pixels[i] < 0 ? kLabelNone : kLabelGround;
    for (int32_t i = first; i < last; ++i) {
      const int32_t pixel = pixels[i];
      if (pixel < 0) continue;
      OVT_CHECK(pixel < winner.rows * winner.stride);
      if (const int32_t old = winners[pixel]; old != kNoPoint) {
        const bool wins =
            intensity[i] > intensity[old] || (intensity[i] == intensity[old] && range_m[i] < range_m[old]);
        lost[wins ? old : i] = 1;
        if (!wins) continue;
      }
      winners[pixel] = i;
      pixel_range_m[pixel] = range_m[i];
      pixel_elevation_rad[pixel] = elevation_rad[i];
    }
  }
}

}  // namespace overtake
