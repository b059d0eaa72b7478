// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What cut_links does with one cluster and with one run. (label_cut has a vector form of cut_run.)
#pragma once

#include "core/math.h"
#include "kernels/cut_links.h"
#include "kernels/link_pixels.h"

namespace overtake {

enum class TwoCars { kNo, kLong, kAbreast, kInLine };

// The columns of a run in an image that is turned by half, where columns wrap: columns across its edge lie side by side
// there. A run across the edge of the turned image takes all of its columns.
struct TurnedColumns {
  int32_t first, last;
};
OVT_INLINE TurnedColumns turn_columns(bool wraps, int32_t cols, int32_t first, int32_t last) {
  const int32_t half = wraps ? cols / 2 : 0;
  if (first < half && last >= half) return {0, cols - 1};
  const int32_t turn = first < half ? cols - half : -half;
  return {first + turn, last + turn};
}

// Whether a cluster may be two cars, and why: too long for one car and too short for a wall, as wide as two cars, or
// narrow and not short.
OVT_INLINE TwoCars may_be_two_cars(const CutLinksParams& params, const LabelExtent& extent) {
  const float depth_m = extent.far_m - extent.near_m;
  const int32_t columns = extent.last_col - extent.first_col, turned = extent.last_turned - extent.first_turned;
  const float width_m =
      0.5f * (extent.far_m + extent.near_m) * float(turned < columns ? turned : columns) * params.sin_pitch;
  const float length_m2 = depth_m * depth_m + width_m * width_m;
  if (!(length_m2 < params.max_length_m * params.max_length_m)) return TwoCars::kNo;
  if (length_m2 > params.min_length_m * params.min_length_m) return TwoCars::kLong;
  if (width_m > params.abreast_width_m) return TwoCars::kAbreast;
  const bool is_in_line =
      width_m < params.in_line_width_m && length_m2 > params.in_line_length_m * params.in_line_length_m;
  return is_in_line ? TwoCars::kInLine : TwoCars::kNo;
}

// The least steps of range of the links that are cut.
struct CutSteps {
  float right_m, down_m;
};
OVT_INLINE CutSteps steps_of(const CutLinksParams& params, TwoCars cluster) {
  if (cluster == TwoCars::kLong) return {0.0f, params.step_m};
  if (cluster == TwoCars::kAbreast) return {params.abreast_step_m, params.in_line_step_m};
  return {params.in_line_step_m, params.in_line_step_m};
}

// A link from the last column leads to the first one.
OVT_INLINE bool is_weak_right(const CutLinksParams& params, float step_m, Plane<const float> range_m, int32_t r,
                              int32_t c) {
  const float own_m = range_m.row(r)[c], next_m = range_m.row(r)[c + 1 < range_m.cols ? c + 1 : 0];
  if (abs_of(own_m - next_m) < step_m) return false;
  return !pixels_join(own_m, next_m, params.sin_pitch, params.cos_pitch, params.tan_threshold);
}

OVT_INLINE bool is_weak_down(const CutLinksParams& params, float step_m, Plane<const float> range_m,
                             Plane<const float> elevation_rad, int32_t r, int32_t c) {
  const float own_m = range_m.row(r)[c], below_m = range_m.row(r + 1)[c];
  if (abs_of(own_m - below_m) < step_m) return false;
  const float alpha = min_of(abs_of(elevation_rad.row(r)[c] - elevation_rad.row(r + 1)[c]), kHalfPiF);
  float sin_alpha, cos_alpha;
  sin_cos_small_f32(alpha, sin_alpha, cos_alpha);
  return !pixels_join(own_m, below_m, sin_alpha, cos_alpha, params.tan_threshold);
}

// Cuts the weak links of the run that begins at a pixel. Returns their number.
OVT_INLINE int32_t cut_run(const CutLinksParams& params, const CutSteps& steps, Plane<const float> range_m,
                           Plane<const float> elevation_rad, int32_t r, int32_t c, BitPlane right, BitPlane down) {
  const auto clear = [](BitPlane links, int32_t row, int32_t col) OVT_INLINED {
    links.row(row)[col >> 6] &= ~(uint64_t(1) << (col & 63));
    return 1;
  };
  int32_t cuts = 0;
  for (bool goes_on = true; goes_on; ++c) {
    if (down.test(r, c) && is_weak_down(params, steps.down_m, range_m, elevation_rad, r, c)) cuts += clear(down, r, c);
    const bool has_link = right.test(r, c);
    if (has_link && is_weak_right(params, steps.right_m, range_m, r, c)) cuts += clear(right, r, c);
    goes_on = has_link && c + 1 < range_m.cols;
  }
  return cuts;
}

}  // namespace overtake
