// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/ego_heading.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/math.h"
#include "pipeline/clock_watch.h"
#include "pipeline/nearest_walls.h"
#include "pipeline/road/centre_line.h"
#include "pipeline/stages.h"

namespace overtake {
namespace {

constexpr double kLargestOffset = 0.05;  // rad: beyond it the walls do not fit this map

// ---- headings over time --------------------------------------------------------------------------------------------

constexpr double kLargestScatter = 0.01;  // rad, root mean square: the headings are not a line

// ---- points of walls -----------------------------------------------------------------------------------------------

constexpr int32_t kMostRead = 4096;  // points of one sensor
constexpr float kSpacing_m = 1.5f;   // of the points that are projected on the map
constexpr float kFar_m = 1e6f;
constexpr double kBin_m = 2.0;     // of the distance along the track
constexpr int32_t kMaxBins = 512;  // of one side
constexpr double kInside_m = 2.5;  // a wall appears this far inside its bound at most: an error of 1.4 deg at 100 m
constexpr double kOutside_m = 30.0;

static_assert(2 * kMaxBins <= kMaxWallPoints);

// Ego poses during a scan, every kStepNs, relative to an origin in the map; between two of them the matrix is linear.
class ScanPoses {
 public:
  static constexpr int32_t kFarthestNs = 300'000'000;  // a point farther from the scan's stamp has a wrong time

  // For points from first_ns to last_ns after the stamp. False: the pose is unknown at a part of that time.
  bool build(const EgoWindow& poses, int64_t stamp_ns, int32_t first_ns, int32_t last_ns,
             const EgoPose& origin) noexcept {
    begin_ns_ = std::min(first_ns, 0);
    count_ = (last_ns - begin_ns_) / kStepNs + 2;
    OVT_CHECK(count_ >= 2 && count_ <= kMost);
    for (int32_t k = 0; k < count_; ++k) {
      EgoState ego;
      const int64_t at_ns = later_ns(stamp_ns, begin_ns_ + int64_t(k) * kStepNs);
      if (!poses.at(at_ns, ego) || ego.age_ns > kEgoFreshNs) return false;
      for (int32_t i = 0; i < 6; ++i) knots_[k][i] = float(ego.r[i]);
      knots_[k][6] = float(ego.pose.x_m - origin.x_m);
      knots_[k][7] = float(ego.pose.y_m - origin.y_m);
    }
    return true;
  }
  // Place in the map, relative to the ego vehicle at the point's time, and the vehicle's place.
  struct Placed {
    float x_m, y_m, ego_x_m, ego_y_m;
  };
  Placed place(int32_t offset_ns, float x, float y, float z) const noexcept {
    const int32_t after_ns = offset_ns - begin_ns_, k = after_ns / kStepNs;
    const float u = float(after_ns - k * kStepNs) * (1.0f / float(kStepNs));
    float m[8];
    for (int32_t i = 0; i < 8; ++i) m[i] = knots_[k][i] + u * (knots_[k + 1][i] - knots_[k][i]);
    return {m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6], m[7]};
  }

 private:
  static constexpr int32_t kStepNs = 10'000'000, kMost = 2 * kFarthestNs / kStepNs + 2;
  int32_t begin_ns_ = 0, count_ = 0;
  float knots_[kMost][8];
};

// The innermost point of each bin along the track, on both sides.
class WallBins {
 public:
  explicit WallBins(double reach_m) noexcept
      : reach_m_(std::min(reach_m, 0.5 * kBin_m * kMaxBins)), bins_(int32_t(2.0 * reach_m_ / kBin_m)) {
    for (auto& side : beyond_m_) std::fill_n(side, bins_, kEmpty);
  }
  void add(const WallPoint& p) noexcept {
    if (!(p.beyond_m >= -kInside_m && p.beyond_m <= kOutside_m && std::fabs(p.along_m) < reach_m_)) return;
    const int32_t bin = std::min(int32_t((p.along_m + reach_m_) / kBin_m), bins_ - 1);
    if (!(p.beyond_m < beyond_m_[p.left][bin])) return;
    beyond_m_[p.left][bin] = p.beyond_m;
    along_m_[p.left][bin] = p.along_m;
  }
  int32_t list(WallPoint* out) const noexcept {
    int32_t count = 0;
    for (int32_t side = 0; side < 2; ++side)
      for (int32_t i = 0; i < bins_; ++i)
        if (beyond_m_[side][i] < kEmpty) out[count++] = {along_m_[side][i], beyond_m_[side][i], side == 1};
    return count;
  }

 private:
  static constexpr double kEmpty = 1e9;
  double reach_m_;
  int32_t bins_;
  double beyond_m_[2][kMaxBins], along_m_[2][kMaxBins];
};

// The centre line around the ego vehicle.
struct NearLine {
  EgoPose origin;
  CentreLine line;

  // False: the ego pose is unknown.
  bool lay(const CircuitMap& map, const Frame& frame, double reach_m) noexcept {
    constexpr double kStation_m = 2.5, kMargin_m = 20.0;  // margin: the way during a scan, and bends
    EgoState ego;
    if (!frame.ego.at(frame.stamp_ns, ego)) return false;
    origin = ego.pose;
    const double half_m = reach_m + kMargin_m;
    const double step_m = std::max(kStation_m, 2.0 * half_m / double(CentreLine::kMost - 2));
    const double s_m = map.project(origin.x_m, origin.y_m).s_m;
    line.lay(map, s_m, step_m, 2 * int32_t(half_m / step_m) + 1, origin.x_m, origin.y_m);
    return !line.empty();
  }
};

// Places the points of find_nearest_walls against the bounds, at most one for each kSpacing_m and one for each bin
// along the circuit. Returns their number.
int32_t place_nearest(const StageContext& context, const Frame& frame, int32_t sensor, const EgoWindow& poses,
                      const NearLine& near, const NearestWall* nearest, WallPoint* out) noexcept {
  const SensorPart& part = frame.sensors[sensor];
  const CentreLine& line = near.line;
  const SensorModel& model = context.sensors[sensor];
  const auto offset_of = [&](int32_t row) {
    return model.is_compensated ? int32_t(model.compensated_to_ns)
                                : part.scan.time_offset_ns[part.cluster_points.point[row]];
  };
  int32_t rows[kWallDirections], offset_ns[kWallDirections], count = 0, first_ns = INT32_MAX, last_ns = INT32_MIN;
  float last_x_m = kFar_m, last_y_m = kFar_m;
  for (int32_t i = 0; i < kWallDirections; ++i) {
    if (nearest[i] == kNoWall) continue;
    const int32_t k = row_of(nearest[i]), at_ns = offset_of(k);
    if (at_ns < -ScanPoses::kFarthestNs || at_ns > ScanPoses::kFarthestNs) continue;
    const float dx = part.cluster_points.x_m[k] - last_x_m, dy = part.cluster_points.y_m[k] - last_y_m;
    if (dx * dx + dy * dy < kSpacing_m * kSpacing_m) continue;
    last_x_m = part.cluster_points.x_m[k];
    last_y_m = part.cluster_points.y_m[k];
    rows[count] = k;
    offset_ns[count++] = at_ns;
    first_ns = std::min(first_ns, at_ns);
    last_ns = std::max(last_ns, at_ns);
  }
  ScanPoses scan_poses;
  if (count == 0 || !scan_poses.build(poses, part.stamp_ns, first_ns, last_ns, near.origin)) return 0;
  WallBins bins(context.detect.walls.reach_m);
  int32_t piece = line.first + (line.last - line.first) / 2;
  for (int32_t i = 0; i < count; ++i) {
    const int32_t k = rows[i];
    const float x = part.cluster_points.x_m[k], y = part.cluster_points.y_m[k];
    const ScanPoses::Placed at = scan_poses.place(offset_ns[i], x, y, part.cluster_points.z_m[k]);
    const float map_x = at.ego_x_m + at.x_m, map_y = at.ego_y_m + at.y_m;
    const float t = line.find_piece(map_x, map_y, piece);
    if (!(t >= 0.0f || piece > line.first) || !(t <= 1.0f || piece + 1 < line.last)) continue;  // beyond the line
    const float d_m = line.measure_left(map_x, map_y, piece);
    const bool left = d_m > 0.0f;
    const float* const width_m = left ? line.left_m : line.right_m;
    const float share = max_of(min_of(t, 1.0f), 0.0f);
    const float along_m = (at.x_m * line.dx_m[piece] + at.y_m * line.dy_m[piece]) * line.per_m[piece];
    bins.add({double(along_m), double(abs_of(d_m) - (width_m[piece] + share * (width_m[piece + 1] - width_m[piece]))),
              left});
  }
  return bins.list(out);
}

// ---- fit -----------------------------------------------------------------------------------------------------------

constexpr double kFirstScale_m = 1.6, kLastScale_m = 0.1, kShrink = 0.7;  // of the biweight: 3 scales
constexpr int32_t kSteps = 12;
constexpr int32_t kFewest = 12;          // points that agree
constexpr int32_t kSideShare = 3;        // a third of a side's points must agree
constexpr double kShortest_m = 30.0;     // distance along the track between the first and the last of them
constexpr double kPointSigma_m = 0.02;   // of a wall's own shape
constexpr double kLargestSigma = 0.005;  // rad

double median_of(double* values, int32_t count) noexcept {
  std::nth_element(values, values + count / 2, values + count);
  return values[count / 2];
}

// A turn of the ego heading, and the distance of each side's points from their bound after it.
struct WallFit {
  double turn = 0, distance_m[2] = {0, 0};
};

// Weighted sums over the points that agree with a fit.
struct WallSums {
  double w[2] = {}, wa[2] = {}, wb[2] = {}, waa = 0, wab = 0, wrr = 0;
  double first_m = 1e9, last_m = -1e9;
  int32_t count[2] = {};
};
WallSums sum_agreeing(const WallPoint* points, int32_t count, const WallFit& fit, double scale_m) noexcept {
  WallSums sums;
  const double limit = 3.0 * scale_m;
  for (int32_t i = 0; i < count; ++i) {
    const WallPoint& p = points[i];
    const double a = p.left ? p.along_m : -p.along_m;
    const double r = p.beyond_m + a * fit.turn - fit.distance_m[p.left];
    const double u = (r / limit) * (r / limit);
    if (!(u < 1.0)) continue;
    const double w = (1.0 - u) * (1.0 - u);
    sums.w[p.left] += w;
    sums.wa[p.left] += w * a;
    sums.wb[p.left] += w * p.beyond_m;
    sums.waa += w * a * a;
    sums.wab += w * a * p.beyond_m;
    sums.wrr += w * r * r;
    sums.first_m = std::min(sums.first_m, p.along_m);
    sums.last_m = std::max(sums.last_m, p.along_m);
    ++sums.count[p.left];
  }
  return sums;
}

}  // namespace

void smooth_headings(const EgoWindow& in, EgoWindow& out, double drift_sigma_rps) noexcept {
  out.count = in.count;
  if (&in != &out) std::copy_n(in.poses, in.count, out.poses);
  const int32_t n = in.count;
  if (n < 3) return;
  // y: heading without the turn by the yaw rates, since the first pose.
  double st = 0, stt = 0, sy = 0, sty = 0, turn = 0;
  double t[EgoWindow::kCapacity], y[EgoWindow::kCapacity], by_rate[EgoWindow::kCapacity];
  for (int32_t i = 0; i < n; ++i) {
    const EgoPose &first = in.poses[0], &at = in.poses[i], &before = in.poses[i > 0 ? i - 1 : 0];
    t[i] = double(difference_ns(at.stamp_ns, first.stamp_ns)) * 1e-9;
    if (i > 0) turn += 0.5 * (at.yaw_rate_rps + before.yaw_rate_rps) * (t[i] - t[i - 1]);
    by_rate[i] = turn;
    y[i] = wrap_angle(at.yaw_rad - first.yaw_rad - turn);
    st += t[i];
    stt += t[i] * t[i];
    sy += y[i];
    sty += t[i] * y[i];
  }
  const double spread = double(n) * stt - st * st;
  if (!(spread > 0)) return;
  const double slope = (double(n) * sty - st * sy) / spread, start = (sy - slope * st) / double(n);
  double rss = 0;
  for (int32_t i = 0; i < n; ++i) {
    const double r = y[i] - start - slope * t[i];
    rss += r * r;
  }
  if (!(rss <= double(n) * kLargestScatter * kLargestScatter)) return;
  const double noise2 = rss / double(n - 2);
  const double drift = slope * spread / (spread + double(n) * noise2 / (drift_sigma_rps * drift_sigma_rps));
  const double first_rad = in.poses[0].yaw_rad + (sy - drift * st) / double(n);
  for (int32_t i = 0; i < n; ++i) out.poses[i].yaw_rad = wrap_angle(first_rad + drift * t[i] + by_rate[i]);
}

// A turn of the ego heading by `turn` moves a point to the left by along_m * turn, so it moves away from the left bound
// and towards the right one: beyond + along * turn (left) and beyond - along * turn (right) are constant.
WallHeading fit_walls(const WallParams& params, const WallPoint* points, int32_t count) noexcept {
  WallHeading out;
  if (count < kFewest || count > kMaxWallPoints) return out;
  WallFit fit;
  double scratch[kMaxWallPoints];
  int32_t given[2];  // points of each side
  for (int32_t side = 0; side < 2; ++side) {
    int32_t n = 0;
    for (int32_t i = 0; i < count; ++i)
      if (points[i].left == (side == 1)) scratch[n++] = points[i].beyond_m;
    if (n > 0) fit.distance_m[side] = median_of(scratch, n);
    given[side] = n;
  }
  double scale_m = kFirstScale_m, information = 0;
  for (int32_t step = 0; step < kSteps; ++step) {
    const WallSums s = sum_agreeing(points, count, fit, scale_m);
    double toward = s.wab;
    information = s.waa;
    for (int32_t side = 0; side < 2; ++side)
      if (s.w[side] > 0) {
        information -= s.wa[side] * s.wa[side] / s.w[side];
        toward -= s.wa[side] * s.wb[side] / s.w[side];
      }
    if (!(information > 1e-6)) return out;
    fit.turn = -toward / information;
    for (int32_t side = 0; side < 2; ++side)
      if (s.w[side] > 0) fit.distance_m[side] = (s.wb[side] + fit.turn * s.wa[side]) / s.w[side];
    scale_m = std::max(kLastScale_m, scale_m * kShrink);
  }
  const WallSums s = sum_agreeing(points, count, fit, scale_m);
  const double weight = s.w[0] + s.w[1];
  const int32_t agree = s.count[0] + s.count[1];
  if (agree < kFewest || s.last_m - s.first_m < kShortest_m || !(weight > 0)) return out;
  const double scatter2 = s.wrr / weight;
  bool sides_agree = true;
  for (int32_t side = 0; side < 2; ++side)
    if (given[side] >= kFewest) sides_agree = sides_agree && kSideShare * s.count[side] >= given[side];
  out.offset_rad = fit.turn;
  out.variance = (scatter2 + kPointSigma_m * kPointSigma_m) / information;
  out.points = agree;
  for (int32_t side = 0; side < 2; ++side) {
    out.side_points[side] = s.count[side];
    if (s.count[side] >= kFewest) out.beyond_m[side] = fit.distance_m[side];
  }
  out.valid = sides_agree && scatter2 <= params.scatter_m * params.scatter_m && std::fabs(fit.turn) <= kLargestOffset &&
              out.variance <= kLargestSigma * kLargestSigma;
  return out;
}

void measure_walls(const StageContext& context, Frame& frame) noexcept {
  for (WallHeading& walls : frame.walls) walls = {};
  if (!frame.uses_map) return;
  EgoWindow poses;
  smooth_headings(frame.ego, poses, kAnyDrift);
  NearLine near;
  if (!near.lay(*context.map, frame, context.detect.walls.reach_m)) return;
  for (int32_t s = 0; s < context.sensor_count; ++s) {
    if (!frame.sensors[s].present) continue;
    NearestWall nearest[kWallDirections];
    find_nearest_walls(context, frame, s, kMostRead, false, nearest);
    WallPoint points[kMaxWallPoints];
    const int32_t count = place_nearest(context, frame, s, poses, near, nearest, points);
    frame.walls[s] = fit_walls(context.detect.walls, points, count);
  }
}

EgoState turned(const EgoState& state, double angle_rad) noexcept {
  EgoState out = state;
  double s, c;
  sin_cos_f64(angle_rad, s, c);
  for (int32_t i = 0; i < 3; ++i) {
    out.r[i] = c * state.r[i] - s * state.r[3 + i];
    out.r[3 + i] = s * state.r[i] + c * state.r[3 + i];
  }
  out.pose.yaw_rad = wrap_angle(state.pose.yaw_rad + angle_rad);
  return out;
}

}  // namespace overtake
