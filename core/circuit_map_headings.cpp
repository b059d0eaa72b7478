// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Heading and curvature of a map's line. Points that lie near each other turn a small error into a large one: with an
// error of 1 cm, points 0.5 m apart have headings that err by 0.8 deg, and curvatures like those of a bend of 40 m. So
// stretches of the line whose points are noisy have them smoothed; the points stay as they are.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/circuit_map.h"
#include "core/math.h"
#include "core/mix.h"

namespace overtake {

namespace {

constexpr double kNearest_m = 0.1;    // of the points that are looked at: a vehicle that stands adds many to a line
constexpr double kStretch_m = 50.0;   // length of a stretch, at least
constexpr int32_t kLeastPoints = 16;  // of a stretch whose noise is measured
// A stretch is smoothed from this noise of its curvature on, to about the second number.
constexpr double kNoisy_per_m = 0.002, kGoal_per_m = 0.0005;
constexpr double kReaches_m[] = {3.0, 5.0, 8.0, 12.0};  // of a window to either side; a hairpin is no longer
constexpr int32_t kLeastChords = 7;                     // of a window
// Standard deviations for an error of 1 m of each point: of the curvature, times the square of the points' distance; of
// the smoothed one, times sqrt(reach^5 / distance) (measured).
constexpr double kNoiseOfPoints = 0.61, kNoiseOfWindow = 6.0;
// Of a normal distribution with a standard deviation of 1: the upper quartile of the absolute values. And how much
// larger the second differences of the curvature are than the curvature's noise.
constexpr double kUpperQuartile = 1.1503, kOfDifferences = 1.08;

// The value that a share of them does not exceed.
double quantile_of(std::vector<double>& values, double share) {
  const auto at = values.begin() + std::ptrdiff_t(double(values.size() - 1) * share);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Line {
  std::vector<double> x, y, s, heading, curvature;  // s: along the line
  bool closed = false;                              // the last point is the first one again

  int32_t segment_count() const { return int32_t(x.size()) - 1; }
  double length(int32_t segment) const { return s[std::size_t(segment) + 1] - s[std::size_t(segment)]; }
  void follow_chords();
};

// A chord has the direction of the tangent at its middle (exactly so on a circle). So a vertex's heading is
// interpolated between its two chords by their lengths. Curvature: central difference of the vertices' headings.
void Line::follow_chords() {
  const int32_t n = segment_count();
  std::vector<double> chord(static_cast<std::size_t>(n));
  const auto at = [](auto& column, int32_t i) -> auto& { return column[static_cast<std::size_t>(i)]; };
  for (int32_t i = 0; i < n; ++i) at(chord, i) = atan2_f64(at(y, i + 1) - at(y, i), at(x, i + 1) - at(x, i));
  heading.assign(x.size(), 0.0);
  curvature.assign(x.size(), 0.0);
  for (int32_t i = closed ? 0 : 1; i < n; ++i) {
    const int32_t before = i > 0 ? i - 1 : n - 1;
    at(heading, i) = mix_angle(at(chord, before), at(chord, i), length(before) / (length(before) + length(i)));
  }
  if (closed) {
    at(heading, n) = at(heading, 0);
  } else if (n > 1) {  // an end vertex extrapolates the slope of the two end chords
    at(heading, 0) = mix_angle(at(heading, 1), at(chord, 0), 2.0);
    at(heading, n) = mix_angle(at(heading, n - 1), at(chord, n - 1), 2.0);
  }
  for (int32_t i = 0; i < (closed ? n : n + 1); ++i) {
    const bool first = i == 0, last = i == n;
    const int32_t before = !first ? i - 1 : closed ? n - 1 : 0, after = last ? n : i + 1;
    const double span = (last ? 0.0 : length(i)) + (first && !closed ? 0.0 : length(before));
    at(curvature, i) = wrap_angle(at(heading, after) - at(heading, before)) / span;
  }
  if (closed) at(curvature, n) = at(curvature, 0);
}

// Weighted least squares of v = a + b t + c t^2: a and b.
class Parabola {
 public:
  void add(double t, double v, double weight) {
    double power = weight;
    for (int k = 0; k < 5; ++k, power *= t) {
      moment_[k] += power;
      if (k < 3) sum_[k] += power * v;
    }
  }
  // False where the places do not tell them.
  bool solve(double& value, double& slope) const {
    const double* const m = moment_;
    const double aa = m[2] * m[4] - m[3] * m[3], ab = m[2] * m[3] - m[1] * m[4], ac = m[1] * m[3] - m[2] * m[2];
    const double det = m[0] * aa + m[1] * ab + m[2] * ac;
    if (!(det > 1e-9 * m[0] * m[2] * m[4])) return false;
    value = (aa * sum_[0] + ab * sum_[1] + ac * sum_[2]) / det;
    slope = (ab * sum_[0] + (m[0] * m[4] - m[2] * m[2]) * sum_[1] + (m[1] * m[2] - m[0] * m[3]) * sum_[2]) / det;
    return true;
  }

 private:
  double moment_[5] = {}, sum_[3] = {};
};

// Fits the direction of the chords around a point, as a vector: points so noisy that the line turns back do no harm.
// Chords count by their lengths. False if they are too few.
bool fit_window(const Line& line, int32_t point, double reach_m, double& heading_rad, double& curvature_per_m) {
  const int32_t n = line.segment_count();
  Parabola x, y;
  int32_t count = 0;
  for (const int32_t side : {1, -1}) {
    double way_m = 0.0;
    for (int32_t k = 0; k < n; ++k) {
      int32_t i = side > 0 ? point + k : point - 1 - k;
      if (line.closed) i += i < 0 ? n : i >= n ? -n : 0;
      if (i < 0 || i >= n) break;
      const std::size_t a = std::size_t(i), b = a + 1;
      const double length = line.length(i), t = (way_m + 0.5 * length) / reach_m;
      if (t >= 1.0) break;
      const double left = 1.0 - t * t, weight = left * left * length;
      x.add(side * t, (line.x[b] - line.x[a]) / length, weight);
      y.add(side * t, (line.y[b] - line.y[a]) / length, weight);
      way_m += length;
      ++count;
    }
  }
  double dx, dy, dx_turn, dy_turn;
  if (count < kLeastChords || !x.solve(dx, dx_turn) || !y.solve(dy, dy_turn)) return false;
  const double length2 = dx * dx + dy * dy;  // below 1 where noise makes the line longer
  if (!(length2 > 0.0)) return false;
  heading_rad = wrap_angle(atan2_f64(dy, dx));
  curvature_per_m = (dx * dy_turn - dy * dx_turn) / (length2 * std::sqrt(length2) * reach_m);
  return true;
}

// The shortest reach whose window brings the noise of points step_m apart down to the goal; 0: they are not noisy.
double choose_reach(double error_m, double step_m, double most_m) {
  if (!(kNoiseOfPoints * error_m > kNoisy_per_m * step_m * step_m)) return 0.0;
  double reach_m = 0.0;
  for (const double reach : kReaches_m) {
    if (reach > most_m) break;
    reach_m = reach;
    if (kNoiseOfWindow * error_m * std::sqrt(step_m / reach) / (reach * reach) <= kGoal_per_m) break;
  }
  return reach_m;
}

// The reach of each point's window, 0 without one: by the second differences of the curvature, which are small in a
// bend of any radius. Their upper quartile, so that the corners of a line without noise are not taken for noise. Each
// point is in two stretches, and has the longer reach.
std::vector<double> choose_reaches(const Line& line) {
  const int32_t n = line.segment_count();
  const double length_m = line.s.back();
  const int32_t halves = 2 * std::max(int32_t(length_m / kStretch_m), 1);  // of stretches
  std::vector<int32_t> begin(std::size_t(halves) + 1, n + 1);
  for (int32_t i = n; i >= 0; --i)
    begin[std::size_t(std::min(int32_t(line.s[std::size_t(i)] / length_m * halves), halves - 1))] = i;
  for (int32_t half = halves - 1; half >= 0; --half)  // some have no point
    begin[std::size_t(half)] = std::min(begin[std::size_t(half)], begin[std::size_t(half) + 1]);

  std::vector<double> reaches(line.x.size(), 0.0), errors_m, steps_m;
  for (int32_t half = 0; half < (line.closed ? halves : halves - 1); ++half) {
    const std::size_t both[] = {std::size_t(half), std::size_t((half + 1) % halves)};
    errors_m.clear(), steps_m.clear();
    for (const std::size_t part : both)
      for (int32_t i = std::max(begin[part], 1); i < std::min(begin[part + 1], n); ++i) {
        const std::size_t at = std::size_t(i);
        const double before_m = line.length(i - 1), after_m = line.length(i), step_m = 0.5 * (before_m + after_m);
        const double between = mix(line.curvature[at - 1], line.curvature[at + 1], before_m / (before_m + after_m));
        errors_m.push_back(std::fabs(line.curvature[at] - between) * step_m * step_m);
        steps_m.push_back(step_m);
      }
    if (int32_t(errors_m.size()) < kLeastPoints) continue;
    const double error_m = quantile_of(errors_m, 0.75) / (kUpperQuartile * kOfDifferences * kNoiseOfPoints);
    const double reach_m = choose_reach(error_m, quantile_of(steps_m, 0.5), length_m / 8);
    for (const std::size_t part : both)
      for (int32_t i = begin[part]; i < begin[part + 1]; ++i)
        reaches[std::size_t(i)] = std::max(reaches[std::size_t(i)], reach_m);
  }
  if (line.closed) reaches.front() = reaches.back() = std::max(reaches.front(), reaches.back());
  return reaches;
}

// Smooths heading and curvature of the points with a reach. Nearer than that to an end of an open line, they go on from
// the nearest point with a whole window.
void smooth(Line& line, const std::vector<double>& reaches) {
  const int32_t count = line.closed ? line.segment_count() : line.segment_count() + 1;
  const double length_m = line.s.back();
  int32_t first_whole = -1, last_whole = -1;
  const auto is_whole = [&](std::size_t i) {
    return line.closed || (line.s[i] >= reaches[i] && length_m - line.s[i] >= reaches[i]);
  };
  for (int32_t i = 0; i < count; ++i) {
    const std::size_t at = std::size_t(i);
    if (!is_whole(at)) continue;
    first_whole = first_whole < 0 ? i : first_whole;
    last_whole = i;
    if (reaches[at] > 0.0) fit_window(line, i, reaches[at], line.heading[at], line.curvature[at]);
  }
  if (line.closed) {
    line.heading.back() = line.heading.front();
    line.curvature.back() = line.curvature.front();
    return;
  }
  for (int32_t i = 0; i < count; ++i) {
    const std::size_t at = std::size_t(i), from = std::size_t(i < first_whole ? first_whole : last_whole);
    if (is_whole(at) || first_whole < 0) continue;
    line.curvature[at] = line.curvature[from];
    line.heading[at] = wrap_angle(line.heading[from] + line.curvature[from] * (line.s[at] - line.s[from]));
  }
}

// The points of a line that are kNearest_m apart, the first and the last one among them.
std::vector<std::size_t> list_apart(const Line& line) {
  const auto are_apart = [&](std::size_t a, std::size_t b) {
    return hypot_f64(line.x[a] - line.x[b], line.y[a] - line.y[b]) >= kNearest_m;
  };
  const std::size_t end = line.x.size() - 1;
  std::vector<std::size_t> kept = {0};
  for (std::size_t i = 1; i < end; ++i)
    if (are_apart(i, kept.back()) && are_apart(i, end)) kept.push_back(i);
  kept.push_back(end);
  return kept;
}

Line keep_points(const Line& line, const std::vector<std::size_t>& kept) {
  Line thin;
  thin.closed = line.closed;
  for (const std::size_t i : kept) {
    const double x = line.x[i], y = line.y[i];
    thin.s.push_back(thin.s.empty() ? 0.0 : thin.s.back() + hypot_f64(x - thin.x.back(), y - thin.y.back()));
    thin.x.push_back(x), thin.y.push_back(y);
  }
  return thin;
}

}  // namespace

void CircuitMap::compute_headings() {
  Line line;
  line.x = x_, line.y = y_, line.s = s_, line.closed = closed_;
  line.follow_chords();
  heading_ = line.heading, curvature_ = line.curvature;

  const std::vector<std::size_t> kept = list_apart(line);
  if (int32_t(kept.size()) <= kLeastPoints) return;
  Line thin = keep_points(line, kept);
  thin.follow_chords();
  const std::vector<double> reaches = choose_reaches(thin);
  if (std::none_of(reaches.begin(), reaches.end(), [](double reach_m) { return reach_m > 0.0; })) return;
  smooth(thin, reaches);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!(reaches[k] > 0.0)) continue;
    heading_[kept[k]] = thin.heading[k], curvature_[kept[k]] = thin.curvature[k];
    if (k + 1 == kept.size()) continue;
    const double from_m = s_[kept[k]], step_m = s_[kept[k + 1]] - from_m;
    for (std::size_t i = kept[k] + 1; i < kept[k + 1]; ++i) {  // points that were left out
      const double t = (s_[i] - from_m) / step_m;
      heading_[i] = mix_angle(thin.heading[k], thin.heading[k + 1], t);
      curvature_[i] = mix(thin.curvature[k], thin.curvature[k + 1], t);
    }
  }
}

}  // namespace overtake
