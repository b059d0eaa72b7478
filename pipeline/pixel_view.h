// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The pixels of a cluster in the image of one sensor, and what lies around them.
#pragma once

#include <cstdint>

#include "pipeline/frame.h"

namespace overtake {

struct PixelBox {
  int32_t row_low = INT32_MAX, row_high = -1, col_low = INT32_MAX, col_high = INT32_MIN;

  int32_t area() const { return (row_high - row_low + 1) * (col_high - col_low + 1); }  // of a box with pixels
};

// Pixels of smoke (drop_smoke), and of clusters.
struct SmokeCount {
  int32_t smoke = 0, labelled = 0;
};

// The share of a cluster in its box: of the returns, and of the pixels. Those of nearer objects do not count.
struct BoxFill {
  float of_returns, of_pixels;
};

// Rows of a cluster; those that the ground beside the cluster continues without a step, and those that go on as ground
// on the left and on the right.
struct LevelRows {
  int32_t rows = 0, level = 0, enclosed = 0;
};

// kNoPoint: none.
struct LevelPoints {
  int32_t above = kNoPoint, below = kNoPoint;
};

// Points by row. Rows that are a multiple of 64 apart are counted together: no car holds both.
struct RowCount {
  int32_t points[64] = {};
};

// Whether there is ground beside an object, on the left and on the right as the sensor sees it: in most of the columns
// that are looked at, or in none of them. In the shadow of the own car there is none, and a part of the object may be
// in it.
struct GroundBeside {
  bool left = false, right = false;
  bool none_left = false, none_right = false;
};

class PixelView {
 public:
  PixelView(const SensorModel& sensor, const SensorPart& part) : sensor_(sensor), part_(part) {}

  // Columns go on beyond the edges of a sensor that sees all around: a box across the first column has no gap.
  void add_pixels(int32_t cluster, PixelBox& box) const noexcept;
  // Adds the points of a cluster to those of their rows.
  void count_rows(int32_t cluster, RowCount& count) const noexcept;
  // Largest angle between two neighbouring rows at the cluster; 0: unknown.
  float find_row_pitch(const PixelBox& box) const noexcept;
  // Whether something nearer, or the edge of the image, may hide more of the object on the left or on the right.
  bool may_be_hidden(const PixelBox& box, float range_m) const noexcept;
  // Ground is what returns in the rows next below the box. Beyond the edge of the image, and below the
  // lowest row, nothing is known.
  GroundBeside find_ground(const PixelBox& box) const noexcept;
  // Whether a pixel beside that of the point, in its row, lies on one surface with it.
  bool is_on_surface(int32_t point) const noexcept;
  // Whether the next returns beside it in its row, at most three pixels away, lie at other ranges. A dark surface has
  // gaps, but no jumps.
  bool is_apart(int32_t point) const noexcept;
  // Whether the next return on one side (step -1 or 1) in its row, at most three pixels away, is of another cluster and
  // clearly nearer.
  bool is_behind(int32_t point, int32_t step) const noexcept;
  // Adds the rows of a cluster. The ground beside a row has the range of one of its points; for `enclosed`, that of
  // both of its ends, nearly: the row lies on it.
  void count_level(int32_t cluster, LevelRows& count) const noexcept;
  // The points in the next rows above and below that are as high over the running ground as a point, at another range;
  // none if that is lower than high_m.
  LevelPoints find_level(int32_t point, float high_m) const noexcept;
  // For a cluster of so many points. Of a large box some rows and columns are looked at.
  BoxFill find_fill(const PixelBox& box, int32_t points, float nearest_m) const noexcept;
  // Adds the pixels in the box, in drop_smoke's window around it, and up to beside_m to its left and right, at ranges
  // that differ from range_m by 6 m at most.
  void count_smoke(const PixelBox& box, float range_m, float beside_m, SmokeCount& count) const noexcept;

 private:
  int32_t at(int32_t row, int32_t col) const noexcept;  // the point of a pixel, kNoPoint
  float range_of(int32_t point) const noexcept;
  int32_t next_beside(int32_t row, int32_t col, int32_t step) const noexcept;  // at most three pixels away, or kNoPoint
  bool find_slope(int32_t row, int32_t first, int32_t last, float& slope) const noexcept;

  const SensorModel& sensor_;
  const SensorPart& part_;
};

}  // namespace overtake
