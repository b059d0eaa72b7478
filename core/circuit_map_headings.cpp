// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Heading and curvature of a map's line. Points that lie near each other turn a small error into a large one: with an
// error of 1 cm, points 0.5 m apart have headings that err by 0.8 deg, and curvatures like those of a bend of 40 m.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/circuit_map.h"
#include "core/math.h"

namespace overtake {

namespace {

constexpr double kNoisy_per_m = 0.002;                  // more noise of the curvature is smoothed,
constexpr double kGoal_per_m = 0.0005;                  // to about this where a window can do so
constexpr double kReaches_m[] = {3.0, 5.0, 8.0, 12.0};  // of a window to either side; a hairpin is no longer
constexpr int32_t kLeastChords = 7;                     // of a window: points farther apart than 3.4 m stay as they are
constexpr int32_t kMostChords = 256;                    // to either side
// Standard deviations for an error of 1 m of each point: of the curvature, times the square of the points' distance; of
// the smoothed one, times sqrt(reach^5 / distance) (measured).
constexpr double kNoiseOfPoints = 0.61, kNoiseOfWindow = 6.0;
constexpr double kUpperQuartile = 1.1503;  // of the absolute value of a normal distribution,
constexpr double kOfDifferences = 1.08;    // of its second differences' deviation

double mix_angle(double a, double b, double t) { return wrap_angle(a + t * wrap_angle(b - a)); }

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

// The chords around a vertex: the direction there, and how it turns.
class Window {
 public:
  // A chord (dx, dy) at t, from -1 to 1 in the window. It counts by its length.
  void add(double t, double dx, double dy, double length) {
    const double left = 1.0 - t * t, weight = left * left * length;
    x_.add(t, dx / length, weight);
    y_.add(t, dy / length, weight);
    ++count_;
  }
  // Leaves both as they are if the chords are too few.
  void fit(double reach_m, double& heading_rad, double& curvature_per_m) const {
    double dx, dy, dx_turn, dy_turn;
    if (count_ < kLeastChords || !x_.solve(dx, dx_turn) || !y_.solve(dy, dy_turn)) return;
    const double length2 = dx * dx + dy * dy;  // below 1 where noise makes the line longer
    if (!(length2 > 0.0)) return;
    heading_rad = wrap_angle(atan2_f64(dy, dx));
    curvature_per_m = (dx * dy_turn - dy * dx_turn) / (length2 * std::sqrt(length2) * reach_m);
  }

 private:
  Parabola x_, y_;
  int32_t count_ = 0;
};

// The shortest reach whose window brings the noise down to the goal, for points step_m apart.
double choose_reach(double noise_per_m, double step_m, double length_m) {
  const double error_m = noise_per_m * step_m * step_m / kNoiseOfPoints;
  double reach_m = 0.0;
  for (const double reach : kReaches_m) {
    if (reach > length_m / 8) break;
    reach_m = reach;
    if (kNoiseOfWindow * error_m * std::sqrt(step_m / reach) / (reach * reach) <= kGoal_per_m) break;
  }
  return reach_m;
}

}  // namespace

// A chord has the direction of the tangent at its middle (exactly so on a circle). So a vertex's heading is
// interpolated between its two chords by their lengths. Curvature: central difference of the vertices' headings. Where
// the points are noisy, both come from the chords of a window instead.
void CircuitMap::compute_headings() {
  const int32_t n = segment_count();
  std::vector<double> chord(static_cast<std::size_t>(n));
  const auto at = [](auto& column, int32_t i) -> auto& { return column[static_cast<std::size_t>(i)]; };
  const auto length = [&](int32_t i) { return at(s_, i + 1) - at(s_, i); };
  for (int32_t i = 0; i < n; ++i) at(chord, i) = atan2_f64(at(y_, i + 1) - at(y_, i), at(x_, i + 1) - at(x_, i));
  heading_.assign(x_.size(), 0.0);
  curvature_.assign(x_.size(), 0.0);
  for (int32_t i = closed_ ? 0 : 1; i < n; ++i) {
    const int32_t before = i > 0 ? i - 1 : n - 1;
    at(heading_, i) = mix_angle(at(chord, before), at(chord, i), length(before) / (length(before) + length(i)));
  }
  if (closed_) {
    at(heading_, n) = at(heading_, 0);
  } else {  // an end vertex extrapolates the slope of the two end chords
    at(heading_, 0) = mix_angle(at(heading_, 1), at(chord, 0), 2.0);
    at(heading_, n) = mix_angle(at(heading_, n - 1), at(chord, n - 1), 2.0);
  }
  for (int32_t i = 0; i < (closed_ ? n : n + 1); ++i) {
    const bool first = i == 0, last = i == n;
    const int32_t before = !first ? i - 1 : closed_ ? n - 1 : 0, after = last ? n : i + 1;
    const double span = (last ? 0.0 : length(i)) + (first && !closed_ ? 0.0 : length(before));
    at(curvature_, i) = wrap_angle(at(heading_, after) - at(heading_, before)) / span;
  }
  if (closed_) at(curvature_, n) = at(curvature_, 0);

  const double step_m = length_m() / n;
  const double noise_per_m = measure_curvature_noise();
  if (noise_per_m > kNoisy_per_m) smooth_headings(choose_reach(noise_per_m, step_m, length_m()));
}

// By the second differences of the curvature: in a bend they are small, whatever its radius. The upper quartile, so
// that the corners of a line without noise are not taken for noise.
double CircuitMap::measure_curvature_noise() const {
  std::vector<double> differences;
  for (std::size_t i = 1; i + 1 < curvature_.size(); ++i)
    differences.push_back(std::fabs(curvature_[i] - 0.5 * (curvature_[i - 1] + curvature_[i + 1])));
  const auto quartile = differences.begin() + std::ptrdiff_t(differences.size() * 3 / 4);
  std::nth_element(differences.begin(), quartile, differences.end());
  return *quartile / (kUpperQuartile * kOfDifferences);
}

// Fits the direction of the chords around each vertex, as a vector: points so noisy that the line turns back do no
// harm.
void CircuitMap::smooth_headings(double reach_m) {
  const int32_t n = segment_count();
  for (int32_t vertex = 0; vertex < (closed_ ? n : n + 1); ++vertex) {
    Window window;
    for (const int32_t side : {1, -1}) {
      double way_m = 0.0;
      for (int32_t k = 0; k < kMostChords; ++k) {
        int32_t i = side > 0 ? vertex + k : vertex - 1 - k;
        if (closed_) i += i < 0 ? n : i >= n ? -n : 0;
        if (i < 0 || i >= n) break;
        const std::size_t a = std::size_t(i), b = a + 1;
        const double length = s_[b] - s_[a], middle_m = way_m + 0.5 * length;
        if (middle_m >= reach_m) break;
        window.add(side * middle_m / reach_m, x_[b] - x_[a], y_[b] - y_[a], length);
        way_m += length;
      }
    }
    window.fit(reach_m, heading_[std::size_t(vertex)], curvature_[std::size_t(vertex)]);
  }
  if (closed_) heading_.back() = heading_.front(), curvature_.back() = curvature_.front();
}

}  // namespace overtake
