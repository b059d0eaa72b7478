// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/road_shape.h"

#include <algorithm>
#include <cmath>
#include <cstring>

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

// Points on the road, of one scan. When they are too many, every other one goes, and of those that follow, too: points
// come column after column, so the last ones alone are not those of the whole road.
struct RoadPoints {
  static constexpr int32_t kCapacity = 4096;
  int32_t count = 0, offered = 0, every = 1;
  float x[kCapacity], n[kCapacity], z[kCapacity];

  void clear() noexcept { count = offered = 0, every = 1; }

  void add(float at_x, float at_n, float at_z) noexcept {
    if (offered++ % every != 0) return;
    if (count == kCapacity) thin();
    x[count] = at_x;
    n[count] = at_n;
    z[count++] = at_z;
  }

 private:
  void thin() noexcept {
    count /= 2, every *= 2;
    for (int32_t i = 0; i < count; ++i) x[i] = x[2 * i], n[i] = n[2 * i], z[i] = z[2 * i];
  }
};

// The ground near the vehicle's lane in every so many columns of an image. Four columns lie side by side, and the walks
// of several fours go up together, because each is a chain of dependent operations.
class GroundWalks {
 public:
  GroundWalks(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, int32_t columns) noexcept
      : block_(make_ground_block(params)),
        axes_(axes),
        sensor_(sensor),
        range_m_(range_m),
        elevation_rad_(elevation_rad),
        rows_(std::min(range_m.rows, kRoom)),
        stride_(std::max(1, sensor.cols / columns)) {}

  // Walks up like running_ground, over the shape so far, and lists the ground column after column.
  void collect(const RoadShape& shape, float reach_m, RoadPoints& points) noexcept {
    const int32_t columns = (sensor_.cols - stride_ / 2 + stride_ - 1) / stride_, fours = (columns + kFour - 1) / kFour;
    const int32_t together = std::min(kRoom / rows_, kMostFours);
    points.clear();
    for (int32_t begin = 0; begin < fours; begin += together) {
      const int32_t count = std::min(together, fours - begin);
      if (laid_ != begin)
        for (int32_t f = 0; f < count; ++f) lay(begin + f, pixels_ + f * rows_);
      laid_ = begin;
      walk(shape, reach_m, count);
      for (int32_t f = 0; f < count; ++f) list(shape, pixels_ + f * rows_, points);
    }
  }

 private:
  static constexpr int32_t kRoom = 1024, kMostFours = 16;

  // Four pixels of one row.
  struct Pixels {
    Four x, y, z;                          // vehicle frame
    Four distance, sensor_z, ahead, side;  // sensor's axes; what the place of a pixel adds to the vehicle's z
    Four::Bits exists;
    bool any;         // of `exists`
    Four n, road_z;   // of the last walk: from the lane; of the road below, in the sensor's axes
    Four::Bits used;  // ... is ground for the fit
  };

  void lay(int32_t four, Pixels* pixels) const noexcept {
    const float *m = axes_.mounting.r, *t = axes_.mounting.t;
    int32_t column[kFour] = {}, count = 0;  // lanes without a column have no returns
    for (int32_t c = stride_ / 2 + kFour * stride_ * four; c < sensor_.cols && count < kFour; c += stride_)
      column[count++] = c;
    float cosines[kFour] = {}, sines[kFour] = {};
    for (int32_t l = 0; l < count; ++l)
      sin_cos_f32(float(wrap_angle(double(sensor_.azimuth_left_rad) - (column[l] + 0.5) * double(sensor_.pitch_rad))),
                  sines[l], cosines[l]);
    const Four cosine(cosines), sine(sines), zero(0.0f);
    for (int32_t i = 0; i < rows_; ++i) {
      const int32_t r = range_m_.rows - 1 - i;
      Pixels& p = pixels[i];
      float ranges[kFour] = {}, elevations[kFour] = {};
      for (int32_t l = 0; l < count; ++l) {
        ranges[l] = range_m_.row(r)[column[l]];
        elevations[l] = elevation_rad_.row(r)[column[l]];
      }
      const Four range(ranges);
      p.exists = range > zero;
      p.any = ranges[0] > 0.0f || ranges[1] > 0.0f || ranges[2] > 0.0f || ranges[3] > 0.0f;
      if (!p.any) continue;  // most of the sky
      Four up, level;
      sin_cos_small_of(Four(elevations), up, level);
      p.distance = range * level, p.sensor_z = range * up;
      const Four sx = p.distance * cosine, sy = p.distance * sine;
      p.x = Four(m[0]) * sx + Four(m[1]) * sy + Four(m[2]) * p.sensor_z + Four(t[0]);
      p.y = Four(m[3]) * sx + Four(m[4]) * sy + Four(m[5]) * p.sensor_z + Four(t[1]);
      p.ahead = Four(m[6]) * sx, p.side = Four(m[7]) * sy;
      p.z = p.ahead + p.side + Four(m[8]) * p.sensor_z + Four(t[2]);
    }
  }

  void walk(const RoadShape& shape, float reach_m, int32_t count) noexcept {
    constexpr float kLane_m = 6.0f;
    const float *m = axes_.mounting.r, *t = axes_.mounting.t;
    const Four zero(0.0f), reach(reach_m), lane(kLane_m);
    // First the road below each pixel, which does not wait for the walk. The first shape is level.
    const bool is_level = shape.expected.source == ExpectedRoad::Source::kNone &&
                          std::all_of(shape.term, shape.term + kTerms, [](double term) { return term == 0.0; });
    for (int32_t f = 0; f < count; ++f)
      for (int32_t i = 0; i < rows_; ++i) {
        Pixels& p = pixels_[f * rows_ + i];
        if (!p.any) continue;
        float heights_m[kFour] = {}, offsets_m[kFour], x[kFour], y[kFour];
        std::memcpy(x, &p.x, sizeof x), std::memcpy(y, &p.y, sizeof y);
        for (int32_t l = 0; l < kFour; l += 2) {
          const Two offset_m = shape.lane_offset(Two(x + l), Two(y + l));
          offset_m.store(offsets_m + l);
          if (!is_level) shape.height_at(Two(x + l), offset_m).store(heights_m + l);
        }
        p.n = Four(offsets_m);
        p.road_z = (Four(heights_m) - Four(t[2]) - p.ahead - p.side) / Four(m[8]);
      }
    GroundState<Four> states[kMostFours];
    std::fill_n(states, count,
                start_ground(Four(axes_.to_sensor_z(float(shape.height(double(t[0]), double(t[1]))), 0.0f, 0.0f))));
    for (int32_t i = 0; i < rows_; ++i)
      for (int32_t f = 0; f < count; ++f) {
        Pixels& p = pixels_[f * rows_ + i];
        GroundState<Four>& state = states[f];
        if (!p.any) {
          state.below_above = Four(kMissing_m);
          continue;
        }
        const auto pixel = walk_ground(block_, p.distance, p.sensor_z, RoadPlace<Four>{p.road_z, Four(-1e9f)}, zero,
                                       zero, p.exists, state);
        p.used = pixel.ground & (state.distance == p.distance) & (abs_of(p.x) <= reach) & (abs_of(p.n) <= lane);
      }
  }

  void list(const RoadShape& shape, const Pixels* pixels, RoadPoints& points) const noexcept {
    const ExpectedRoad& expected = shape.expected;
    for (int32_t l = 0; l < kFour; ++l)
      for (int32_t i = 0; i < rows_; ++i)
        if (const Pixels& p = pixels[i]; p.any && p.used[l] && p.x.v[l] >= expected.from_m && p.x.v[l] <= expected.to_m)
          points.add(p.x.v[l], p.n.v[l], p.z.v[l] - float(shape.expected_at(double(p.x.v[l]), double(p.n.v[l]))));
  }

  const GroundBlock block_;
  const RoadAxes& axes_;
  const SensorModel& sensor_;
  const Plane<const float> range_m_, elevation_rad_;
  const int32_t rows_, stride_;
  int32_t laid_ = -1;  // the first four whose pixels are laid
  Pixels pixels_[kRoom];
};

// Least squares over the points within trim_m of the shape, each 5 m of x with the same weight. False: too few points.
bool fit_shape(const RoadPoints& points, double trim_m, RoadShape& shape) noexcept {
  constexpr int32_t kBins = 40, kFewest = 24, kFewestBins = 3;
  constexpr double kBin_m = 5.0;
  // Standard deviations of the ground's heights, and of the terms from what is expected. Errors of learned heights are
  // the same for many points.
  constexpr struct {
    double height_m, term[kTerms];
  } kSigmas[] = {{0.03, {0.1, 0.02, 0.02, 5e-4, 2e-3}},      // kNone
                 {0.03, {0.1, 0.02, 0.02, 1e-4, 5e-4}},      // kWay
                 {0.03, {0.1, 0.02, 0.02, 2e-5, 2e-4}},      // kMap
                 {0.06, {0.02, 0.005, 0.005, 1e-7, 1e-6}}};  // kLearned: a plane
  const auto& sigma = kSigmas[int32_t(shape.expected.source)];
  const auto bin_of = [](float x) { return std::clamp(int32_t(x / kBin_m + 0.5 * kBins), 0, kBins - 1); };
  int32_t of_bin[kBins] = {}, used = 0, bins = 0;
  static_assert(RoadPoints::kCapacity <= INT16_MAX);
  struct Chosen {
    int16_t point, bin;
  } chosen[RoadPoints::kCapacity];
  const double* const p = shape.term;
  for (int32_t i = 0; i < points.count; ++i) {
    const double x = double(points.x[i]), n = double(points.n[i]);
    if (!(std::fabs(p[0] + p[1] * x + p[2] * n + p[3] * x * x + p[4] * x * n - double(points.z[i])) <= trim_m))
      continue;
    const int32_t bin = bin_of(points.x[i]);
    chosen[used++] = {int16_t(i), int16_t(bin)};
    bins += of_bin[bin]++ == 0;
  }
  if (used < kFewest || bins < kFewestBins) return false;
  double weight_of[kBins];
  for (int32_t bin = 0; bin < kBins; ++bin) weight_of[bin] = 1.0 / std::max(of_bin[bin], 1);
  // The upper triangle of the normal equations, in pairs of columns. Below the diagonal it is not used.
  static_assert(kTerms == 5);
  using Pair = double __attribute__((vector_size(16)));
  Pair sum[kTerms][3] = {};
  for (int32_t k = 0; k < kTerms; ++k)
    sum[k][k / 2][k % 2] = sigma.height_m * sigma.height_m / (sigma.term[k] * sigma.term[k]);
  for (int32_t k = 0; k < used; ++k) {
    const int32_t i = chosen[k].point;
    const double x = double(points.x[i]), n = double(points.n[i]), weight = weight_of[chosen[k].bin];
    const double basis[kTerms] = {1.0, x, n, x * x, x * n};
    const Pair pair[3] = {{1.0, x}, {n, basis[3]}, {basis[4], double(points.z[i])}};
    for (int32_t row = 0; row < kTerms; ++row) {
      const double weighted = weight * basis[row];
      for (int32_t at = row / 2; at < 3; ++at) sum[row][at] += Pair{weighted, weighted} * pair[at];
    }
  }
  double a[kTerms][kTerms + 1];
  for (int32_t row = 0; row < kTerms; ++row)
    for (int32_t col = 0; col <= kTerms; ++col) a[row][col] = sum[row][col / 2][col % 2];
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
    bool of_plane;
  } kPasses[] = {{30.0f, 0.5, true}, {60.0f, 0.3, false}, {100.0f, 0.3, true}};
  constexpr int32_t kColumns = 20, kPlaneColumns = 12;  // a plane has fewer terms
  const bool plane = shape.expected.source == ExpectedRoad::Source::kLearned;
  RoadPoints points;
  GroundWalks walks(params, axes, sensor, range_m, elevation_rad, plane ? kPlaneColumns : kColumns);
  for (const auto& pass : kPasses) {
    if (plane && !pass.of_plane) continue;
    walks.collect(shape, pass.reach_m, points);
    if (!fit_shape(points, pass.trim_m, shape)) return;
  }
}

}  // namespace overtake
