// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c: smoke and dust are not obstacles.
#include "kernels/drop_smoke.h"

#include <algorithm>
#include <cmath>

namespace overtake::ref {
namespace {

struct Image {
  Plane<const float> range_m;
  ConstBitPlane considered;
};

// The neighbours of a pixel, and those of them for which counts(row, column, difference of the ranges) is true.
struct Neighbours {
  float all = 0.0f, counted = 0.0f;
};
template <class F>
Neighbours count_neighbours(const Image& image, float reach_m, int32_t r, int32_t c, F&& counts) {
  const int32_t top = std::max(r - kSmokeRows, 0), bottom = std::min(r + kSmokeRows, image.range_m.rows - 1);
  const int32_t left = std::max(c - kSmokeCols, 0), right = std::min(c + kSmokeCols, image.range_m.cols - 1);
  Neighbours n;
  for (int32_t i = top; i <= bottom; ++i)
    for (int32_t j = left; j <= right; ++j) {
      if ((i == r && j == c) || !image.considered.test(i, j)) continue;
      const float apart_m = std::fabs(image.range_m.row(i)[j] - image.range_m.row(r)[c]);
      if (!(apart_m < reach_m)) continue;
      n.all += 1.0f;
      if (counts(i, j, apart_m)) n.counted += 1.0f;
    }
  return n;
}

bool is_rough(const DropSmokeParams& params, const Image& image, int32_t r, int32_t c) {
  const float surface_m = kSurface_m + kSurfaceShare * image.range_m.row(r)[c];
  const Neighbours near = count_neighbours(image, params.reach_m, r, c,
                                           [&](int32_t, int32_t, float apart_m) { return apart_m < surface_m; });
  return near.counted <= params.near_share * near.all;
}

bool is_among_rough(const DropSmokeParams& params, const Image& image, ConstBitPlane rough, int32_t r, int32_t c) {
  const Neighbours among =
      count_neighbours(image, params.reach_m, r, c, [&](int32_t i, int32_t j, float) { return rough.test(i, j); });
  return among.counted >= kRoughShare * among.all;
}

}  // namespace

void drop_smoke(const DropSmokeParams& params, const ScanTable& scan, const GroundLight& ground, const int32_t*,
                Plane<const float> range_filled_m, Plane<const int32_t> pixel_point, BitPlane nonground,
                BitPlane considered, BitPlane rough, BitPlane smoke) noexcept {
  const Image image = {range_filled_m, considered};
  const int32_t rows = nonground.rows, cols = nonground.cols;
  const float limit = params.dark_share * ground.light;
  for (const BitPlane& bits : {considered, rough, smoke})
    for (int32_t r = 0; r < rows; ++r) bits.clear_row(r);
  if (!(limit > 0.0f)) return;  // no ground, or no intensities

  const auto is_dark = [&](int32_t r, int32_t c) {
    const int32_t point = pixel_point.row(r)[c];
    return point == kNoPoint ? nonground.test(r, c) : ground.of(scan, point) < limit;
  };
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c)
      if (nonground.test(r, c) || is_dark(r, c)) considered.set(r, c);
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c)
      if (is_dark(r, c) && is_rough(params, image, r, c)) rough.set(r, c);
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c)
      if (is_dark(r, c) && is_among_rough(params, image, rough, r, c)) smoke.set(r, c);
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < nonground.words_per_row; ++w) nonground.row(r)[w] &= ~smoke.row(r)[w];
}

}  // namespace overtake::ref
