// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The centre line between two bounds that were measured separately, with different numbers of points.
#include <cmath>
#include <vector>

#include "core/circuit_map.h"
#include "core/math.h"

namespace overtake {

namespace {

constexpr double kMinStep_m = 1e-3;  // of the centre line: nearer midpoints count as one

// A bound as a line with a huge width, so that `inside` only means: not beyond the ends.
bool build_bound(CircuitMap& line, const double* x_m, const double* y_m, int32_t count, bool closed, const char** error,
                 MapPoint* point) {
  const std::vector<double> wide(std::size_t(count > 0 ? count : 0), kMaxMapWidth);
  return line.build(x_m, y_m, wide.data(), wide.data(), nullptr, count, closed, error, point);
}

}  // namespace

bool CircuitMap::build_from_bounds(const double* left_x_m, const double* left_y_m, int32_t left_count,
                                   const double* right_x_m, const double* right_y_m, int32_t right_count, bool closed,
                                   const char** error, MapPoint* point) {
  const auto fail = [&](const char* sentence) {
    if (error) *error = sentence;
    return false;
  };
  CircuitMap left, right;
  MapPoint none;
  MapPoint& wrong = point ? *point : none;
  wrong.line = "left bound";
  if (!build_bound(left, left_x_m, left_y_m, left_count, closed, error, &wrong)) return false;
  wrong.line = "right bound";
  if (!build_bound(right, right_x_m, right_y_m, right_count, closed, error, &wrong)) return false;
  wrong.line = "";

  const bool from_left = left.segment_count() >= right.segment_count();
  const CircuitMap &fine = from_left ? left : right, &other = from_left ? right : left;
  std::vector<double> x, y, half;
  MapProjection previous{};
  double progress = 0.0;  // arc length of the foot on the other bound
  bool any = false;
  for (std::size_t i = 0; i < fine.x_.size(); ++i) {
    const MapProjection p = other.project(fine.x_[i], fine.y_[i], any ? previous.segment : -1);
    if (from_left ? p.d_m < 0.0 : p.d_m > 0.0) {
      wrong = {int32_t(i), from_left ? "left bound" : "right bound"};
      return fail("a track map's left bound must lie left of its right bound in driving direction");
    }
    const MapPose foot = other.at(p.s_m);
    if (!p.inside) {  // one bound is longer: the track ends where the shorter one ends
      double s, c;
      sin_cos_f64(foot.heading_rad, s, c);
      if (std::fabs((fine.x_[i] - foot.x_m) * c + (fine.y_[i] - foot.y_m) * s) > kMinStep_m) continue;
    }
    if (any) {
      double step = p.s_m - previous.s_m;
      if (closed && step > 0.5 * other.length_m()) step -= other.length_m();
      if (closed && step < -0.5 * other.length_m()) step += other.length_m();
      progress += step;
    }
    any = true;
    previous = p;
    if (closed && i + 1 == fine.x_.size()) break;  // the repeated first vertex
    const double mid_x = 0.5 * (fine.x_[i] + foot.x_m), mid_y = 0.5 * (fine.y_[i] + foot.y_m);
    if (!x.empty() && hypot_f64(mid_x - x.back(), mid_y - y.back()) < kMinStep_m) continue;
    x.push_back(mid_x);
    y.push_back(mid_y);
    half.push_back(0.5 * std::fabs(p.d_m));
  }
  if (closed && x.size() > 1 && hypot_f64(x.back() - x.front(), y.back() - y.front()) < kMinStep_m) {
    x.pop_back();
    y.pop_back();
    half.pop_back();
  }
  if (closed ? progress < 0.5 * other.length_m() : progress < 0.0)
    return fail("a track map's two bounds must run in the same direction");
  return build(x.data(), y.data(), half.data(), half.data(), nullptr, int32_t(x.size()), closed, error);
}

}  // namespace overtake
