// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/road_shape.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"
#include "kernels/running_ground_pixel.h"

namespace overtake {
namespace {

// Four columns side by side, for walk_ground. Compilers make the baseline's vectors of it; the results are those of
// float.
struct Four {
  using Values = float __attribute__((vector_size(16)));
  using Bits = int32_t __attribute__((vector_size(16)));
  Values v;
  Four() = default;
  explicit Four(float all) : v{all, all, all, all} {}
  explicit Four(Values values) : v(values) {}
  explicit Four(const float* at) : v{at[0], at[1], at[2], at[3]} {}
  friend Four operator+(Four a, Four b) { return Four(a.v + b.v); }
  friend Four operator-(Four a, Four b) { return Four(a.v - b.v); }
  friend Four operator*(Four a, Four b) { return Four(a.v * b.v); }
  friend Four operator/(Four a, Four b) { return Four(a.v / b.v); }
  friend Bits operator<(Four a, Four b) { return a.v < b.v; }
  friend Bits operator>(Four a, Four b) { return a.v > b.v; }
  friend Bits operator<=(Four a, Four b) { return a.v <= b.v; }
  friend Bits operator>=(Four a, Four b) { return a.v >= b.v; }
  friend Bits operator==(Four a, Four b) { return a.v == b.v; }
  friend Four select(Bits mask, Four yes, Four no) { return Four(mask ? yes.v : no.v); }
  friend Four min_of(Four a, Four b) { return select(a < b, a, b); }
  friend Four max_of(Four a, Four b) { return select(a > b, a, b); }
  friend Four abs_of(Four a) { return Four(Values(Bits(a.v) & 0x7fffffff)); }
};
constexpr int32_t kFour = 4;

// Points on the road, of one scan.
struct RoadPoints {
  static constexpr int32_t kCapacity = 4096;
  int32_t count = 0;
  float x[kCapacity], n[kCapacity], z[kCapacity];

  void add(float at_x, float at_n, float at_z) noexcept {
    if (count == kCapacity) return;
    x[count] = at_x;
    n[count] = at_n;
    z[count++] = at_z;
  }
};

// Walks up four columns like running_ground, over the shape so far, and collects the ground near the vehicle's lane.
// Lanes without a column have no returns.
struct FourColumns {
  int32_t column[kFour];
  int32_t count;
};
void walk_four(const GroundBlock& block, const RoadAxes& axes, const SensorModel& sensor, const FourColumns& columns,
               Plane<const float> range_m, Plane<const float> elevation_rad, const RoadShape& shape, float reach_m,
               RoadPoints& points) noexcept {
  constexpr int32_t kMostRows = 1024;
  constexpr float kLane_m = 6.0f;
  const float *m = axes.mounting.r, *t = axes.mounting.t;
  const Four zero(0.0f);
  float cosines[kFour] = {}, sines[kFour] = {};
  for (int32_t l = 0; l < columns.count; ++l)
    sin_cos_f32(
        float(wrap_angle(double(sensor.azimuth_left_rad) - (columns.column[l] + 0.5) * double(sensor.pitch_rad))),
        sines[l], cosines[l]);
  const Four cosine(cosines), sine(sines);
  GroundState<Four> state =
      start_ground(Four(axes.to_sensor_z(float(shape.height(double(t[0]), double(t[1]))), 0.0f, 0.0f)));
  struct Ground {
    float x[kFour], n[kFour], z[kFour];
    int32_t used[kFour];
  } ground[kMostRows];
  const int32_t rows = std::min(range_m.rows, kMostRows);
  bool any = false;
  for (int32_t i = 0; i < rows; ++i) {
    const int32_t r = range_m.rows - 1 - i;
    float ranges[kFour] = {}, elevations[kFour] = {};
    for (int32_t l = 0; l < columns.count; ++l) {
      ranges[l] = range_m.row(r)[columns.column[l]];
      elevations[l] = elevation_rad.row(r)[columns.column[l]];
    }
    if (ranges[0] <= 0.0f && ranges[1] <= 0.0f && ranges[2] <= 0.0f && ranges[3] <= 0.0f) {  // most of the sky
      state.below_above = zero;
      for (int32_t l = 0; l < kFour; ++l) ground[i].used[l] = 0;
      continue;
    }
    const Four range(ranges);
    const Four::Bits exists = range > zero;
    Four up, level;
    sin_cos_small_of(Four(elevations), up, level);
    const Four distance = range * level, sensor_z = range * up, sx = distance * cosine, sy = distance * sine;
    const Four x = Four(m[0]) * sx + Four(m[1]) * sy + Four(m[2]) * sensor_z + Four(t[0]);
    const Four y = Four(m[3]) * sx + Four(m[4]) * sy + Four(m[5]) * sensor_z + Four(t[1]);
    Four height, n;
    for (int32_t l = 0; l < kFour; ++l) {
      const double at_x = double(x.v[l]), offset_m = shape.lane_offset(at_x, double(y.v[l]));
      height.v[l] = float(shape.height_at(at_x, offset_m));
      n.v[l] = float(offset_m);
    }
    const Four road_z = (height - Four(t[2]) - Four(m[6]) * sx - Four(m[7]) * sy) / Four(m[8]);
    const auto pixel =
        walk_ground(block, distance, sensor_z, RoadPlace<Four>{road_z, Four(-1e9f)}, zero, zero, exists, state);
    const Four::Bits used =
        pixel.ground & (state.distance == distance) & (abs_of(x) <= Four(reach_m)) & (abs_of(n) <= Four(kLane_m));
    const Four z = Four(m[6]) * sx + Four(m[7]) * sy + Four(m[8]) * sensor_z + Four(t[2]);
    for (int32_t l = 0; l < kFour; ++l) {
      ground[i].x[l] = x.v[l], ground[i].n[l] = n.v[l], ground[i].z[l] = z.v[l];
      ground[i].used[l] = used[l];
      any |= used[l] != 0;
    }
  }
  if (!any) return;
  for (int32_t l = 0; l < columns.count; ++l)
    for (int32_t i = 0; i < rows; ++i)
      if (ground[i].used[l]) points.add(ground[i].x[l], ground[i].n[l], ground[i].z[l]);
}

void collect_ground(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
                    Plane<const float> range_m, Plane<const float> elevation_rad, const RoadShape& shape, float reach_m,
                    RoadPoints& points) noexcept {
  constexpr int32_t kColumns = 20;
  const GroundBlock block = make_ground_block(params);
  points.count = 0;
  const int32_t stride = std::max(1, sensor.cols / kColumns);
  for (int32_t begin = stride / 2; begin < sensor.cols; begin += kFour * stride) {
    FourColumns columns = {};
    for (int32_t c = begin; c < sensor.cols && columns.count < kFour; c += stride) columns.column[columns.count++] = c;
    walk_four(block, axes, sensor, columns, range_m, elevation_rad, shape, reach_m, points);
  }
}

// Least squares over the points within trim_m of the shape, each 5 m of x with the same weight. False: too few points.
bool fit_shape(const RoadPoints& points, double trim_m, RoadShape& shape) noexcept {
  constexpr int32_t kBins = 40, kFewest = 24, kFewestBins = 3;
  constexpr double kBin_m = 5.0, kSigma_m = 0.03;
  constexpr double kPrior[kTerms] = {0.1, 0.02, 0.02, 5e-4, 2e-3};  // standard deviations from the level road
  const auto bin_of = [](float x) { return std::clamp(int32_t(x / kBin_m + 0.5 * kBins), 0, kBins - 1); };
  int32_t of_bin[kBins] = {}, used = 0, bins = 0;
  int32_t chosen[RoadPoints::kCapacity];
  const double* const p = shape.term;
  for (int32_t i = 0; i < points.count; ++i) {
    const double x = double(points.x[i]), n = double(points.n[i]);
    if (!(std::fabs(p[0] + p[1] * x + p[2] * n + p[3] * x * x + p[4] * x * n - double(points.z[i])) <= trim_m))
      continue;
    chosen[used++] = i;
    bins += of_bin[bin_of(points.x[i])]++ == 0;
  }
  if (used < kFewest || bins < kFewestBins) return false;
  double weight_of[kBins];
  for (int32_t bin = 0; bin < kBins; ++bin) weight_of[bin] = 1.0 / std::max(of_bin[bin], 1);
  double a[kTerms][kTerms + 1] = {};
  for (int32_t k = 0; k < kTerms; ++k) a[k][k] = kSigma_m * kSigma_m / (kPrior[k] * kPrior[k]);
  for (int32_t k = 0; k < used; ++k) {
    const int32_t i = chosen[k];
    const double x = double(points.x[i]), n = double(points.n[i]), weight = weight_of[bin_of(points.x[i])];
    const double basis[kTerms + 1] = {1.0, x, n, x * x, x * n, double(points.z[i])};
    for (int32_t row = 0; row < kTerms; ++row)
      for (int32_t col = row; col <= kTerms; ++col) a[row][col] += weight * basis[row] * basis[col];
  }
  // Symmetric and positive definite by the prior: elimination without pivots.
  for (int32_t k = 0; k < kTerms; ++k)
    for (int32_t row = k + 1; row < kTerms; ++row) {
      const double factor = a[k][row] / a[k][k];
      for (int32_t col = row; col <= kTerms; ++col) a[row][col] -= factor * a[k][col];
    }
  for (int32_t k = kTerms - 1; k >= 0; --k) {
    double value = a[k][kTerms];
    for (int32_t col = k + 1; col < kTerms; ++col) value -= a[k][col] * shape.term[col];
    shape.term[k] = value / a[k][k];
  }
  return true;
}

}  // namespace

void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept {
  constexpr struct {
    float reach_m;
    double trim_m;
  } kPass[] = {{30.0f, 0.5}, {60.0f, 0.3}, {100.0f, 0.3}};
  RoadPoints points;
  for (const auto& pass : kPass) {
    collect_ground(params, axes, sensor, range_m, elevation_rad, shape, pass.reach_m, points);
    if (!fit_shape(points, pass.trim_m, shape)) return;
  }
}

}  // namespace overtake
