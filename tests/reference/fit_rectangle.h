// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The pose of a cluster (eq. 5; Zhang 2017, variance criterion) in double precision, written from the method. It shares
// no code with the kernel. It checks the kernel's result: a heading is right if no other heading of the search costs
// less, and a count is right if it fits the rectangle.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "kernels/fit_rectangle.h"

namespace overtake::reference {

struct PlacedRectangle {
  double center_x = 0, center_y = 0, length = 0, width = 0;  // extent of the points
  int sure = 0, possible = 0;                                // points certainly inside; points perhaps inside
  bool is_tied = false;  // the sensor faces the middle of a side: rounding decides the corner
};

class RectangleReference {
 public:
  RectangleReference(const FitRectangleParams& params, const std::vector<float>& x, const std::vector<float>& y,
                     double sensor_x, double sensor_y)
      : params_(params), x_(x.begin(), x.end()), y_(y.begin(), y.end()), sensor_x_(sensor_x), sensor_y_(sensor_y) {}

  // Sum of the variances of the distances to the closer edge, over both pairs of edges.
  double cost(double heading) const {
    const Sides s = sides(heading);
    std::vector<double> along, across;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double d1 = std::min(first(heading, i) - s.low_1, s.high_1 - first(heading, i));
      const double d2 = std::min(second(heading, i) - s.low_2, s.high_2 - second(heading, i));
      (d2 < d1 ? across : along).push_back(std::min(d1, d2));
    }
    return variance(along) + variance(across);
  }

  PlacedRectangle place(double heading) const {
    constexpr double kHair = 1e-4;
    const Sides s = sides(heading);
    const double c = std::cos(heading), sn = std::sin(heading);
    const double from_1 = sensor_x_ * c + sensor_y_ * sn - (s.low_1 + s.high_1) / 2;
    const double from_2 = sensor_y_ * c - sensor_x_ * sn - (s.low_2 + s.high_2) / 2;
    const double length = double(params_.length_m), width = double(params_.width_m);
    const double center_1 = from_1 > 0 ? s.high_1 - length / 2 : s.low_1 + length / 2;
    const double center_2 = from_2 > 0 ? s.high_2 - width / 2 : s.low_2 + width / 2;
    PlacedRectangle out;
    out.is_tied = std::fabs(from_1) < 2e-3 || std::fabs(from_2) < 2e-3;
    out.center_x = center_1 * c - center_2 * sn;
    out.center_y = center_1 * sn + center_2 * c;
    out.length = s.high_1 - s.low_1;
    out.width = s.high_2 - s.low_2;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double off = std::max(std::fabs(first(heading, i) - center_1) - length / 2,
                                  std::fabs(second(heading, i) - center_2) - width / 2) -
                         double(params_.margin_m);
      out.sure += off < -kHair;
      out.possible += off < kHair;
    }
    return out;
  }

  // A description of the error in a fit; empty if there is none.
  std::string find_fault(const RectangleFit& fit, double heading_ref) const {
    if (std::fabs(std::remainder(double(fit.heading_ref_rad) - heading_ref, 2 * M_PI)) > 1e-5) return "psi_REF";
    const PlacedRectangle ref = place(double(fit.heading_ref_rad)), var = place(double(fit.heading_var_rad));
    if (!ref.is_tied && is_off(fit.ref_x_m, ref.center_x)) return "centre of psi_REF, x";
    if (!ref.is_tied && is_off(fit.ref_y_m, ref.center_y)) return "centre of psi_REF, y";
    if (!ref.is_tied && (fit.inliers_ref < ref.sure || fit.inliers_ref > ref.possible)) return "points of psi_REF";
    if (!var.is_tied && is_off(fit.var_x_m, var.center_x)) return "centre of psi_VAR, x";
    if (!var.is_tied && is_off(fit.var_y_m, var.center_y)) return "centre of psi_VAR, y";
    if (!var.is_tied && (fit.inliers_var < var.sure || fit.inliers_var > var.possible)) return "points of psi_VAR";
    if (fit.from_var != (fit.inliers_ref < fit.inliers_var)) return "eq. 5";
    if (fit.heading_rad != (fit.from_var ? fit.heading_var_rad : fit.heading_ref_rad)) return "chosen heading";
    const PlacedRectangle& best = fit.from_var ? var : ref;
    if (is_off(fit.extent_length_m, best.length) || is_off(fit.extent_width_m, best.width)) return "extent";
    if (fit.center_x_m != (fit.from_var ? fit.var_x_m : fit.ref_x_m)) return "chosen centre";
    if (int(x_.size()) < params_.min_var_points)
      return fit.heading_var_rad == fit.heading_ref_rad ? "" : "psi_VAR of too few points";
    return find_heading_fault(double(fit.heading_var_rad), heading_ref, var);
  }

 private:
  struct Sides {
    double low_1, high_1, low_2, high_2;
  };
  static constexpr double kDegree = M_PI / 180;

  static bool is_off(float got, double want) { return std::fabs(double(got) - want) > 1e-3; }
  double first(double h, std::size_t i) const { return x_[i] * std::cos(h) + y_[i] * std::sin(h); }
  double second(double h, std::size_t i) const { return y_[i] * std::cos(h) - x_[i] * std::sin(h); }
  Sides sides(double h) const {
    Sides s{1e30, -1e30, 1e30, -1e30};
    for (std::size_t i = 0; i < x_.size(); ++i) {
      s.low_1 = std::min(s.low_1, first(h, i)), s.high_1 = std::max(s.high_1, first(h, i));
      s.low_2 = std::min(s.low_2, second(h, i)), s.high_2 = std::max(s.high_2, second(h, i));
    }
    return s;
  }
  static double variance(const std::vector<double>& values) {
    if (values.empty()) return 0;
    double mean = 0, sum = 0;
    for (const double v : values) mean += v / double(values.size());
    for (const double v : values) sum += (v - mean) * (v - mean);
    return sum / double(values.size());
  }

  std::string find_heading_fault(double heading, double heading_ref, const PlacedRectangle& placed) const {
    constexpr double kSlack = 2e-5;  // m^2, for sums in single precision
    constexpr int kSteps = 90 * 16;  // the search uses steps of 1/16 degree in [0, 90) deg
    // At the corners the distances to both edges are equal: rotating the axes swaps the set of a corner, and the
    // variances.
    const double place_in_grid = heading / kDegree * 16;
    const int step = ((int(std::lround(place_in_grid)) % kSteps) + kSteps) % kSteps;
    if (std::fabs(place_in_grid - std::round(place_in_grid)) > 1e-3) return "psi_VAR is not a step of the search";
    const auto cost_of = [this](int i) { return cost(((i + kSteps) % kSteps) * kDegree / 16); };
    double best = 1e30;
    for (int degree = 0; degree < 90; ++degree) best = std::min(best, cost_of(16 * degree));
    if (cost_of(step) > best + kSlack) return "psi_VAR costs more than a whole degree";
    for (const int neighbour : {step - 1, step + 1})
      if (cost_of(step) > cost_of(neighbour) + kSlack) return "psi_VAR costs more than its neighbour";
    const PlacedRectangle turned = place(heading + M_PI / 2);
    if (!placed.is_tied && !turned.is_tied && turned.sure > placed.possible) return "turned by 90 deg it holds more";
    if (std::cos(heading - heading_ref) < -1e-4) return "psi_VAR points backwards";
    return "";
  }

  FitRectangleParams params_;
  std::vector<double> x_, y_;
  double sensor_x_, sensor_y_;
};

}  // namespace overtake::reference
