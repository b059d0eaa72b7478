// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: a car of which one row is seen, as low as the road may be.
#include "kernels/mark_islands.h"

#include "core/math.h"

namespace overtake::ref {
namespace {

// An island from a pixel of it to one end.
struct End {
  int32_t steps = 0;   // columns from that pixel
  int32_t pixels = 0;  // besides it
  bool free = true;    // nothing nearer is beside it
};

// A row of ranges around a pixel.
struct Row {
  const float* range_m;
  int32_t cols, c;
  bool wraps;

  // -1 beyond the edge.
  int32_t column(int32_t steps) const {
    const int32_t k = c + steps;
    if (k >= 0 && k < cols) return k;
    return !wraps ? -1 : k < 0 ? k + cols : k - cols;
  }
  // 0 without a return, and beyond the edge.
  float at(int32_t steps) const {
    const int32_t k = column(steps);
    return k < 0 ? 0.0f : range_m[k];
  }
};

// Walks to one side, until the island is too wide or `gap` columns have no pixel of it. Calls f(steps) for each of its
// pixels.
template <class F>
End walk(const Row& row, int32_t direction, int32_t gap, int32_t most, F&& f) {
  End end;
  float last_m = row.at(0);
  for (int32_t steps = 1; steps <= end.steps + gap && steps <= most + gap; ++steps) {
    const float range_m = row.at(direction * steps);
    if (!(range_m > 0.0f) || range_m > last_m + IslandLimits::kDepth_m) continue;
    if (range_m < last_m - IslandLimits::kDepth_m) {
      end.free = false;
      break;
    }
    last_m = range_m;
    end.steps = steps, ++end.pixels;
    f(direction * steps);
  }
  return end;
}

}  // namespace

int32_t mark_island_of(bool wraps, float pitch_rad, Plane<const float> range_filled_m, int32_t r, int32_t c,
                       BitPlane nonground) noexcept {
  const Row row = {range_filled_m.row(r), range_filled_m.cols, c, wraps};
  const float column_m = pitch_rad * row.at(0);
  // At most a quarter of the image, so that on an image of all directions the two walks do not meet.
  const int32_t most = int32_t(min_of(IslandLimits::kMost_m / column_m, float(row.cols / 4)));
  const int32_t gap = int32_t(min_of(IslandLimits::kGap_m / column_m, float(row.cols / 4))) + 1;
  const auto nothing = [](int32_t) {};
  const End left = walk(row, -1, gap, most, nothing), right = walk(row, 1, gap, most, nothing);
  const int32_t columns = left.steps + right.steps + 1, pixels = left.pixels + right.pixels + 1;
  if (columns > most) return right.steps;
  if (!left.free || !right.free || pixels < IslandLimits::kLeastPixels) return 0;
  if (float(columns) * column_m < IslandLimits::kLeast_m) return 0;
  if (float(pixels) < IslandLimits::kShare * float(columns)) return 0;
  const auto mark = [&](int32_t steps) { nonground.set(r, row.column(steps)); };
  mark(0);
  walk(row, -1, gap, most, mark);
  walk(row, 1, gap, most, mark);
  return right.steps;
}

void mark_islands(bool wraps, float pitch_rad, Plane<const float> range_filled_m, Plane<const float> height_m,
                  BitPlane nonground) noexcept {
  for (int32_t r = 0; r < range_filled_m.rows; ++r)
    for (int32_t c = 0; c < range_filled_m.cols; ++c)
      if (range_filled_m.row(r)[c] >= IslandLimits::kFrom_m && height_m.row(r)[c] >= IslandLimits::kLow_m &&
          !nonground.test(r, c))
        c += mark_island_of(wraps, pitch_rad, range_filled_m, r, c, nonground);
}

}  // namespace overtake::ref
