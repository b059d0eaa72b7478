// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/pixel_view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

#include "core/math.h"
#include "kernels/drop_smoke.h"

namespace overtake {
namespace {

constexpr int32_t kBeside = 2;  // columns

}  // namespace

void PixelView::add_pixels(int32_t cluster, PixelBox& box) const noexcept {
  const Plane<int32_t>& image = part_.kept.images.pixel_point;
  const int32_t begin = part_.clusters.point_begin[cluster], end = begin + part_.clusters.point_count[cluster];
  for (int32_t k = begin; k < end; ++k) {
    const int32_t pixel = part_.kept.points.pixel[part_.cluster_points.point[k]];
    if (pixel < 0) continue;
    const int32_t row = pixel / image.stride;
    int32_t col = pixel % image.stride;
    if (sensor_.wraps && box.row_high >= 0) {
      if (col - box.col_low > image.cols / 2) col -= image.cols;
      if (box.col_low - col > image.cols / 2) col += image.cols;
    }
    box.row_low = std::min(box.row_low, row), box.row_high = std::max(box.row_high, row);
    box.col_low = std::min(box.col_low, col), box.col_high = std::max(box.col_high, col);
  }
}

void PixelView::count_rows(int32_t cluster, RowCount& count) const noexcept {
  const int32_t begin = part_.clusters.point_begin[cluster], end = begin + part_.clusters.point_count[cluster];
  for (int32_t k = begin; k < end; ++k) {
    const int32_t pixel = part_.kept.points.pixel[part_.cluster_points.point[k]];
    if (pixel >= 0) ++count.points[pixel / part_.kept.images.pixel_point.stride & 63];
  }
}

float PixelView::find_row_pitch(const PixelBox& box) const noexcept {
  float pitch = 0.0f, before = 0.0f;
  bool any = false;
  for (int32_t row = box.row_low - 1; row <= box.row_high + 1; ++row) {
    float slope;
    if (!find_slope(row, box.col_low - kBeside, box.col_high + kBeside, slope)) {
      any = false;  // a row without a return: the next angle would be of two rows
      continue;
    }
    if (any) pitch = max_of(pitch, abs_of(slope - before));
    before = slope;
    any = true;
  }
  return pitch;
}

bool PixelView::may_be_hidden(const PixelBox& box, float range_m) const noexcept {
  constexpr float kNearer_m = 0.5f;
  for (int32_t row = box.row_low; row <= box.row_high; ++row)
    for (int32_t k = 1; k <= kBeside; ++k)
      for (const int32_t col : {box.col_low - k, box.col_high + k}) {
        if (!sensor_.wraps && (col < 0 || col >= sensor_.cols)) return true;
        const int32_t point = at(row, col);
        if (point >= 0 && range_of(point) < range_m - kNearer_m) return true;
      }
  return false;
}

GroundBeside PixelView::find_ground(const PixelBox& box) const noexcept {
  constexpr int32_t kColumns = 3, kRows = 3;
  const int32_t last_row = std::min(box.row_high + kRows, part_.row_count - 1);
  if (box.row_high >= last_row) return {};
  const auto look = [&](int32_t col, int32_t step, bool& most, bool& none) {
    if (!sensor_.wraps && (col + kColumns * step < 0 || col + kColumns * step >= sensor_.cols)) return;
    int32_t found = 0;
    for (int32_t k = 1; k <= kColumns; ++k) {
      bool any = false;
      for (int32_t row = box.row_high + 1; row <= last_row; ++row) any = any || at(row, col + k * step) >= 0;
      found += any;
    }
    most = 2 * found > kColumns;
    none = found == 0;
  };
  GroundBeside ground;
  look(box.col_low, -1, ground.left, ground.none_left);
  look(box.col_high, 1, ground.right, ground.none_right);
  return ground;
}

bool PixelView::is_on_surface(int32_t point) const noexcept {
  const int32_t pixel = part_.kept.points.pixel[point];
  if (pixel < 0) return false;
  const int32_t stride = part_.kept.images.pixel_point.stride, row = pixel / stride, col = pixel % stride;
  const float range_m = range_of(point), surface_m = kSurface_m + kSurfaceShare * range_m;
  for (const int32_t beside : {at(row, col - 1), at(row, col + 1)})
    if (beside >= 0 && abs_of(range_of(beside) - range_m) < surface_m) return true;
  return false;
}

bool PixelView::is_apart(int32_t point) const noexcept {
  const int32_t pixel = part_.kept.points.pixel[point];
  if (pixel < 0) return false;
  const int32_t stride = part_.kept.images.pixel_point.stride, row = pixel / stride, col = pixel % stride;
  const float range_m = range_of(point), surface_m = kSurface_m + kSurfaceShare * range_m;
  bool any = false;
  for (const int32_t step : {-1, 1}) {
    const int32_t beside = next_beside(row, col, step);
    if (beside >= 0 && abs_of(range_of(beside) - range_m) < surface_m) return false;
    any = any || beside >= 0;
  }
  return any;
}

bool PixelView::is_behind(int32_t point, int32_t step) const noexcept {
  constexpr float kNearer_m = 0.5f;
  const int32_t pixel = part_.kept.points.pixel[point];
  if (pixel < 0) return false;
  const int32_t stride = part_.kept.images.pixel_point.stride;
  const int32_t beside = next_beside(pixel / stride, pixel % stride, step);
  if (beside < 0) return false;
  const int32_t label = part_.kept.points.label[beside];
  return label > kLabelGround && label != part_.kept.points.label[point] &&
         range_of(beside) < range_of(point) - kNearer_m;
}

LevelPoints PixelView::find_level(int32_t point, float high_m) const noexcept {
  constexpr float kApart_m = 1.0f, kSlope = 0.05f, kMost_m = 0.15f;
  const int32_t pixel = part_.kept.points.pixel[point];
  const Plane<float>& heights_m = part_.kept.images.height_m;
  if (pixel < 0 || !heights_m.data || heights_m.data[pixel] < high_m) return {};
  const int32_t stride = part_.kept.images.pixel_point.stride, row = pixel / stride, col = pixel % stride;
  const auto find = [&](int32_t next) {
    const int32_t other = at(next, col);
    if (other < 0) return kNoPoint;
    const float apart_m = abs_of(range_of(other) - range_of(point));
    const float rise_m = abs_of(heights_m.at(next, col) - heights_m.data[pixel]);
    return apart_m >= kApart_m && rise_m <= min_of(kSlope * apart_m, kMost_m) ? other : kNoPoint;
  };
  return {find(row - 1), find(row + 1)};
}

BoxFill PixelView::find_fill(const PixelBox& box, int32_t points, float nearest_m) const noexcept {
  constexpr int32_t kMost = 32;  // rows and columns to look at
  constexpr float kNearer_m = 0.3f;
  const int32_t rows = box.row_high - box.row_low + 1, cols = box.col_high - box.col_low + 1;
  const int32_t row_step = (rows + kMost - 1) / kMost, col_step = (cols + kMost - 1) / kMost;
  int32_t looked_at = 0, hidden = 0, empty = 0;
  for (int32_t row = box.row_low; row <= box.row_high; row += row_step)
    for (int32_t col = box.col_low; col <= box.col_high; col += col_step) {
      const int32_t point = at(row, col);
      ++looked_at;
      empty += point < 0;
      hidden += point >= 0 && range_of(point) < nearest_m - kNearer_m;
    }
  const float share = float(points) * float(looked_at) / float(box.area());
  return {share / max_of(float(looked_at - hidden - empty), 1.0f), share / max_of(float(looked_at - hidden), 1.0f)};
}

void PixelView::count_smoke(const PixelBox& box, float range_m, float beside_m, SmokeCount& count) const noexcept {
  constexpr float kReach_m = 6.0f;
  const float beside = min_of(beside_m / max_of(range_m * sensor_.pitch_rad, 1e-3f), float(sensor_.cols));
  const int32_t cols = std::max(kSmokeCols, int32_t(beside));
  for (int32_t row = box.row_low - kSmokeRows; row <= box.row_high + kSmokeRows; ++row)
    for (int32_t col = box.col_low - cols; col <= box.col_high + cols; ++col) {
      const int32_t point = at(row, col);
      if (point < 0 || !(abs_of(range_of(point) - range_m) <= kReach_m)) continue;
      count.smoke += Reason(part_.kept.points.reason[point]) == Reason::kSmoke;
      count.labelled += part_.kept.points.label[point] > kLabelGround;
    }
}

void PixelView::count_level(int32_t cluster, LevelRows& count) const noexcept {
  constexpr float kStep_m = 0.4f, kStepShare = 0.01f;
  const Plane<int32_t>& image = part_.kept.images.pixel_point;
  const int32_t* const pixels = part_.kept.points.pixel;
  const auto is_ground = [&](int32_t point) { return point >= 0 && part_.kept.points.label[point] == kLabelGround; };
  const int32_t begin = part_.clusters.point_begin[cluster], end = begin + part_.clusters.point_count[cluster];
  const auto is_left_of = [&](int32_t a, int32_t b) {  // of two pixels of a row; by less than half a turn
    const int32_t columns = b - a;
    return sensor_.wraps && std::abs(columns) > image.cols / 2 ? columns < 0 : columns > 0;
  };
  uint64_t rows = 0, level = 0;
  int32_t left[64], right[64];  // the points at the ends of a row
  for (int32_t k = begin; k < end; ++k) {
    const int32_t point = part_.cluster_points.point[k], pixel = pixels[point];
    if (pixel < 0) continue;
    const int32_t row = pixel / image.stride, col = pixel % image.stride, place = row & 63;
    const uint64_t bit = uint64_t(1) << place;
    if (!(rows & bit) || is_left_of(pixel, pixels[left[place]])) left[place] = point;
    if (!(rows & bit) || is_left_of(pixels[right[place]], pixel)) right[place] = point;
    rows |= bit;
    if (level & bit) continue;
    for (int32_t side = -kBeside; side <= kBeside; ++side) {
      const int32_t beside = at(row, col + side);
      if (is_ground(beside) && abs_of(range_of(beside) - range_of(point)) < kStep_m) level |= bit;
    }
  }
  const auto goes_on = [&](int32_t point, int32_t step) {
    const int32_t pixel = pixels[point], beside = next_beside(pixel / image.stride, pixel % image.stride, step);
    const float range_m = range_of(point);
    return is_ground(beside) && abs_of(range_of(beside) - range_m) < max_of(kStep_m, kStepShare * range_m);
  };
  count.rows += std::popcount(rows), count.level += std::popcount(level);
  for (uint64_t bits = rows; bits != 0; bits &= bits - 1) {
    const int32_t place = std::countr_zero(bits);
    count.enclosed += goes_on(left[place], -1) && goes_on(right[place], 1);
  }
}

int32_t PixelView::at(int32_t row, int32_t col) const noexcept {
  const Plane<int32_t>& image = part_.kept.images.pixel_point;
  if (row < 0 || row >= image.rows) return kNoPoint;
  if (sensor_.wraps) col = (col % image.cols + image.cols) % image.cols;
  return col < 0 || col >= image.cols ? kNoPoint : image.at(row, col);
}

int32_t PixelView::next_beside(int32_t row, int32_t col, int32_t step) const noexcept {
  constexpr int32_t kReach = 3;
  int32_t beside = kNoPoint;
  for (int32_t i = 1; i <= kReach && beside < 0; ++i) beside = at(row, col + i * step);
  return beside;
}

float PixelView::range_of(int32_t point) const noexcept {
  const ScanTable& scan = part_.scan;
  const float x = scan.x_m[point], y = scan.y_m[point], z = scan.z_m[point];
  return std::sqrt(x * x + y * y + z * z);
}

// Height over distance of a return of the row between the columns, in the sensor's axes.
bool PixelView::find_slope(int32_t row, int32_t first, int32_t last, float& slope) const noexcept {
  for (int32_t col = first; col <= last; ++col) {
    const int32_t point = at(row, col);
    if (point < 0) continue;
    const ScanTable& scan = part_.scan;
    const float x = scan.x_m[point], y = scan.y_m[point];
    slope = scan.z_m[point] / std::sqrt(max_of(x * x + y * y, 1e-6f));
    return true;
  }
  return false;
}

}  // namespace overtake
