// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/pose_history.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace overtake::evaluation {
namespace {

bool is_before(const io::EgoRow& row, int64_t stamp_ns) { return row.stamp_ns < stamp_ns; }

struct Fit {
  double value = 0, slope = 0;
};
// a + b t + c t^2 through (t, v), at t = 0. A line if there are too few or too similar times for a quadratic.
Fit fit_quadratic(const std::vector<double>& t, const std::vector<double>& v) {
  std::array<double, 5> s{};
  std::array<double, 3> r{};
  for (std::size_t i = 0; i < t.size(); ++i) {
    double power = 1;
    for (std::size_t k = 0; k < 5; ++k, power *= t[i]) {
      s[k] += power;
      if (k < 3) r[k] += power * v[i];
    }
  }
  const double a = s[2] * s[4] - s[3] * s[3], b = s[1] * s[4] - s[2] * s[3], c = s[1] * s[3] - s[2] * s[2];
  const double whole = s[0] * a - s[1] * b + s[2] * c;
  if (whole > 1e-12 * s[0] * s[2] * s[4]) {
    const double value = (r[0] * a - s[1] * (r[1] * s[4] - r[2] * s[3]) + s[2] * (r[1] * s[3] - r[2] * s[2])) / whole;
    const double slope = (s[0] * (r[1] * s[4] - r[2] * s[3]) - r[0] * b + s[2] * (s[1] * r[2] - s[2] * r[1])) / whole;
    return {value, slope};
  }
  const double line = s[0] * s[2] - s[1] * s[1];
  return {(r[0] * s[2] - s[1] * r[1]) / line, (s[0] * r[1] - s[1] * r[0]) / line};
}

}  // namespace

void PoseHistory::add(const io::EgoRow& row) {
  const auto at = std::lower_bound(rows_.begin(), rows_.end(), row.stamp_ns, is_before);
  if (at == rows_.end() || at->stamp_ns != row.stamp_ns) rows_.insert(at, row);
}

std::optional<CarTruth> PoseHistory::at(int64_t stamp_ns) const {
  const int64_t half = int64_t(half_window_s_ * 1e9);
  const auto begin = std::lower_bound(rows_.begin(), rows_.end(), stamp_ns - half, is_before);
  const auto end = std::lower_bound(begin, rows_.end(), stamp_ns + half + 1, is_before);
  if (end - begin < 3 || begin->stamp_ns > stamp_ns || (end - 1)->stamp_ns < stamp_ns) return std::nullopt;
  std::vector<double> t;
  for (auto it = begin; it != end; ++it) t.push_back(double(it->stamp_ns - stamp_ns) * 1e-9);
  const auto fit = [&](double io::EgoRow::*field, bool is_angle) {
    std::vector<double> v;
    for (auto it = begin; it != end; ++it) {
      const double value = (*it).*field - (*begin).*field;  // small numbers: map coordinates are large
      v.push_back(is_angle ? wrap_angle(value) : value);
    }
    Fit f = fit_quadratic(t, v);
    f.value += (*begin).*field;
    return f;
  };
  const Fit x = fit(&io::EgoRow::x_m, false), y = fit(&io::EgoRow::y_m, false), yaw = fit(&io::EgoRow::yaw_rad, true);
  CarTruth c;
  c.x_m = x.value, c.y_m = y.value, c.z_m = fit(&io::EgoRow::z_m, false).value;
  c.roll_rad = wrap_angle(fit(&io::EgoRow::roll_rad, true).value);
  c.pitch_rad = wrap_angle(fit(&io::EgoRow::pitch_rad, true).value);
  c.heading_rad = wrap_angle(yaw.value), c.yaw_rate_rps = yaw.slope;
  c.speed_mps = std::hypot(x.slope, y.slope);
  c.course_rad = c.speed_mps < 1 ? c.heading_rad : std::atan2(y.slope, x.slope);
  return c;
}

}  // namespace overtake::evaluation
