// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The circuit as a centre line with widths, closed or open, and the projection of map points to (s, d) on it.
// s grows along the driving direction from the first point, d is positive to the left. Double precision, map frame.
// Built once (the only place that allocates); read-only and thread-safe after that.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "core/check.h"

namespace overtake {

struct MapPose {  // a place on the centre line
  double x_m, y_m, heading_rad, curvature_per_m, width_left_m, width_right_m, banking_rad;
  double cross_slope() const noexcept;  // tangent of the banking; 0 where it is nearly upright
};

struct MapProjection {
  double s_m, d_m;  // d > 0 left of the centre line
  double heading_rad, curvature_per_m, width_left_m, width_right_m;
  bool inside;      // -width_right <= d <= width_left, and not beyond the ends of an open line
  int32_t segment;  // hint for the next projection nearby
};

// Limit of map coordinates: build refuses larger ones, and project never calls such a point inside.
inline constexpr double kMaxMapCoordinate = 1e8;
// Limit of widths: a track this wide already contains every point within kMaxMapCoordinate.
inline constexpr double kMaxMapWidth = 4.0 * kMaxMapCoordinate;
inline constexpr double kMaxMapBanking_rad = 1.0;  // steeper is no road

// Nearest point to p on the segment from a to b: a + t (b - a), clamped to the box of a and b.
struct SegmentFoot {
  double t, x_m, y_m, distance2;
};
OVT_INLINE SegmentFoot find_foot(double ax, double ay, double bx, double by, double px, double py) {
  const double ux = bx - ax, uy = by - ay;
  const double t = ((px - ax) * ux + (py - ay) * uy) / (ux * ux + uy * uy);
  SegmentFoot f;
  if (t >= 1.0) {
    f = {1.0, bx, by, 0.0};
  } else if (t > 0.0) {
    f = {t, std::clamp(ax + t * ux, std::min(ax, bx), std::max(ax, bx)),
         std::clamp(ay + t * uy, std::min(ay, by), std::max(ay, by)), 0.0};
  } else {
    f = {0.0, ax, ay, 0.0};
  }
  f.distance2 = (f.x_m - px) * (f.x_m - px) + (f.y_m - py) * (f.y_m - py);
  return f;
}

// The point of a map's columns that is wrong, from 0; -1: not one alone. `line`: "left bound", "right bound", or "".
struct MapPoint {
  int32_t index = -1;
  const char* line = "";
};
// A sentence of CircuitMap::build with its point.
std::string describe_fault(const char* sentence, const MapPoint& point);

class CircuitMap {
 public:
  // Columns of `count` points. banking may be null. The last point of a closed line may repeat the first one, as files
  // do; build then drops it. On failure returns false, sets `error` to a static sentence and `point`, and changes
  // nothing else. Fails on fewer than 3 points, a missing column, values that are not finite or too large, neighbours
  // closer than 1e-6 m, and negative widths.
  bool build(const double* x_m, const double* y_m, const double* width_left_m, const double* width_right_m,
             const double* banking_rad, int32_t count, bool closed, const char** error, MapPoint* point = nullptr);
  // Centre line and widths from two bounds with any point counts, each in driving direction. The bound with more points
  // is projected on the other; the centre is the middle, the widths are half the distance. Also fails when the left
  // bound is not on the left, and when the bounds run in opposite directions.
  bool build_from_bounds(const double* left_x_m, const double* left_y_m, int32_t left_count, const double* right_x_m,
                         const double* right_y_m, int32_t right_count, bool closed, const char** error,
                         MapPoint* point = nullptr);

  bool empty() const { return x_.empty(); }
  bool closed() const { return closed_; }
  bool has_banking() const { return has_banking_; }  // false: none was given, or all of it is 0
  double length_m() const { return empty() ? 0.0 : s_.back(); }
  // Whether a projected place lies beside the line; false beyond the ends of an open one, and where there is no place.
  bool is_beside(const MapProjection& at) const {
    return at.segment >= 0 && (closed_ || (at.s_m > 0.0 && at.s_m < length_m()));
  }
  int32_t segment_count() const { return empty() ? 0 : int32_t(x_.size()) - 1; }

  // Nearest place on the centre line. `hint` is a segment of an earlier answer, -1 none. A hint changes the cost, never
  // the result, which equals a search over all segments (ties: the lower segment). noexcept, no allocation.
  // Heading and curvature are interpolated along s; in stretches of 50 m whose points are noisy, both are smoothed over
  // 3 to 12 m to either side. An empty map, or a point that is not finite or beyond kMaxMapCoordinate, gives: not
  // inside, segment -1, d infinite, the rest 0.
  MapProjection project(double x_m, double y_m, int32_t hint = -1) const noexcept;
  // Distance of a point outside of the circuit: 0 on the circuit, else the distance from its edge, or from the end of
  // an open line. Infinite where project finds no nearest place.
  double measure_outside(double x_m, double y_m, int32_t* hint) const noexcept;
  // The place at s_m: wrapped on a closed line, clamped on an open one; NaN counts as 0. `hint`: null, or the segment
  // of an earlier answer, -1 none; it receives the segment. It changes the cost, never the result.
  MapPose at(double s_m, int32_t* hint = nullptr) const noexcept;

 private:
  struct Box {
    double min_x, min_y, max_x, max_y;
  };
  struct Nearest;
  int32_t segment_of(double s_m, int32_t hint) const noexcept;
  void compute_headings();
  void compute_boxes();

  // One row per vertex. A closed line repeats its first vertex at the end, so segment i always runs from i to i + 1.
  std::vector<double> x_, y_, s_, heading_, curvature_, width_left_, width_right_, banking_;
  bool closed_ = false, has_banking_ = false;
  // Spatial index: a binary tree of bounding boxes over runs of kLeafSegments consecutive segments, stored as a heap
  // (node 1 is the root, node i has children 2i and 2i + 1, the leaves start at leaf_begin_). Consecutive segments are
  // neighbours, so the boxes are tight. A uniform grid would need a cell size, and on an oval most cells are empty.
  std::vector<Box> boxes_;
  int32_t leaf_begin_ = 0;
};

}  // namespace overtake
