// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_path.h"

#include <algorithm>
#include <cmath>

#include "core/math.h"

namespace overtake {
namespace {

constexpr double kWalkStep_s = 0.1;      // longest step along a lane
constexpr double kLeastShrink = 0.2;     // a lane's centre is no nearer than this share of its radius
constexpr double kMostDrift_m = 20.0;    // standard deviation of a car's own way across its lane
constexpr double kRest_s = 0.5;          // time constant of coming to rest
constexpr double kRestDrift = 0.25;      // its own way is this share of a moving car's
constexpr double kMostTurn_mps2 = 40.0;  // a car turns no faster
// How fast cars drive across their lanes, deviations: those that keep their places, and the share that changes them.
constexpr double kKeep_mps = 0.1, kChange_mps = 2.0, kChangeShare = 0.4;
constexpr double kSettle_s = 0.05;  // time constant with which a path leaves the errors of its start

// f(h) = 1 / (1 + h + h^2 / 2) and the integrals of f and of f^2 from 0 to h, of u = 1 + h: f = 2 / (1 + u^2).
struct Decay {
  double value, integral, integral2;
};
Decay decay_of(double h) {
  const double u = 1.0 + h, square = 1.0 + u * u, angle = atan2_f64(h, 2.0 + h);  // atan u - pi / 4
  return {2.0 / square, 2.0 * angle, 2.0 * (u / square - 0.5 + angle)};
}

// The estimate's covariance in the axes of its course.
PathCar make_car(const TrackEstimate& estimate) {
  const MotionState& m = estimate.mean;
  const auto& p = estimate.covariance;
  double s, c;
  sin_cos_f64(m.course_rad, s, c);
  PathCar car;
  car.speed_mps = m.speed_mps;
  car.p_ss = c * c * p[0][0] + s * s * p[1][1] + 2.0 * c * s * p[0][1];
  car.p_dd = s * s * p[0][0] + c * c * p[1][1] - 2.0 * c * s * p[0][1];
  car.p_sd = c * s * (p[1][1] - p[0][0]) + (c * c - s * s) * p[0][1];
  car.p_sv = c * p[0][2] + s * p[1][2];
  car.p_dv = c * p[1][2] - s * p[0][2];
  car.p_sc = c * p[0][3] + s * p[1][3];
  car.p_dc = c * p[1][3] - s * p[0][3];
  car.p_sw = c * p[0][4] + s * p[1][4];
  car.p_dw = c * p[1][4] - s * p[0][4];
  car.p_vv = p[2][2];
  car.p_vc = p[2][3];
  car.p_vw = p[2][4];
  car.p_cc = p[3][3];
  car.p_cw = p[3][4];
  car.p_ww = p[4][4];
  return car;
}

void drop_yaw_rate(PathCar& car) { car.p_sw = car.p_dw = car.p_vw = car.p_cw = car.p_ww = 0.0; }

// What the course differs from the lane's is in part the car's own way across the lane, in part an error of the
// estimate, and an error of the place goes with that.
struct Turn {
  double own_rad = 0, error_rad = 0, error_m = 0;
  double own_var = 0;  // because it is not known whether the car keeps its place
};

// The mean of both cases: the car keeps its place, or it changes it.
Turn split_turn(const PathCar& car, double turn_rad) {
  const double v = std::max(car.speed_mps, 1.0), keep = kKeep_mps / v, change = kChange_mps / v;
  const double keeps_var = keep * keep + car.p_cc, changes_var = change * change + car.p_cc;  // of turn_rad
  const double odds = kChangeShare / (1.0 - kChangeShare) * std::sqrt(keeps_var / changes_var) *
                      exp_f64(std::min(0.5 * turn_rad * turn_rad * (1.0 / keeps_var - 1.0 / changes_var), 50.0));
  const double changes = odds / (1.0 + odds);
  const double of_keep = keep * keep / keeps_var, of_change = change * change / changes_var;
  Turn turn;
  turn.own_rad = (of_keep + changes * (of_change - of_keep)) * turn_rad;
  turn.error_rad = turn_rad - turn.own_rad;
  turn.error_m = car.p_cc > 0.0 ? turn.error_rad * car.p_dc / car.p_cc : 0.0;
  const double apart_rad = (of_change - of_keep) * turn_rad;
  turn.own_var = changes * (1.0 - changes) * apart_rad * apart_rad;
  return turn;
}

// The place on the lane beside the car. Beyond the end of an open line, the car drives straight on.
class LaneWalk {
 public:
  // False: the map has no place beside the car.
  bool begin(const CircuitMap& map, int32_t segment, const MotionState& m) {
    const MapProjection foot = map.project(m.x_m, m.y_m, segment);
    if (foot.segment < 0) return false;
    map_ = &map;
    s_m_ = foot.s_m;
    segment_ = foot.segment;
    at_ = map.at(s_m_, &segment_);
    double s, c;
    sin_cos_f64(at_.heading_rad, s, c);
    const double x_m = m.x_m - at_.x_m, y_m = m.y_m - at_.y_m;
    ahead_m_ = c * x_m + s * y_m;  // not 0: the line has corners
    left_m_ = c * y_m - s * x_m;
    return true;
  }
  const MapPose& at() const { return at_; }
  double left_m() const { return left_m_; }
  double ahead_m() const { return ahead_m_ + (map_->closed() ? 0.0 : std::max(s_m_ - map_->length_m(), 0.0)); }

  // Walks until the car has driven way_m and is left_m beside the line. The next step makes up for this step's error.
  void go_on(double way_m, double left_m) {
    const double mean_left_m = 0.5 * (left_m_ + left_m), heading_rad = at_.heading_rad;
    const double shrink = std::max(1.0 - at_.curvature_per_m * mean_left_m, kLeastShrink);
    const double ds = std::max((way_m - way_m_) / shrink, 0.0);
    s_m_ += ds;
    at_ = map_->at(s_m_, &segment_);
    way_m_ += ds - mean_left_m * wrap_angle(at_.heading_rad - heading_rad);
    left_m_ = left_m;
  }

 private:
  const CircuitMap* map_ = nullptr;
  double s_m_ = 0, way_m_ = 0, left_m_ = 0, ahead_m_ = 0;
  int32_t segment_ = -1;
  MapPose at_{};
};

struct LanePlace {
  double x_m, y_m, heading_rad, ahead_m, left_m = 0, turn_rad = 0;
  double across_m2 = 0;  // in addition to that of the columns
};

}  // namespace

LanePath::LanePath(const TrackerParams& params, const CircuitMap* map)
    : params_(params.lane),
      map_(map),
      kernels_(params.kernels ? *params.kernels : *find_kernels(nullptr)),
      step_s_(params.horizon_step_s),
      points_(path_points(params, params.horizon_s)) {}

void LanePath::carve(Carver& carver) {
  const auto rows = std::size_t(round_up(points_, kPathBlock));
  for (Columns* c : {&lane_, &free_, &rest_})
    for (double** column : {&c->along_s, &c->across_s, &c->across_s2, &c->along_m2, &c->across_m2})
      *column = carver.take<double>(rows);
  for (double** column : {&turn_left_, &error_left_, &error_across_s_, &late_s_, &speed_m2_, &drift_m2_, &rest_speed_})
    *column = carver.take<double>(rows);
}

void LanePath::fill() {
  const double turn_s = params_.path_turn_s >= 1e-3 ? params_.path_turn_s : 1e-3;
  for (int32_t k = 0; k < round_up(points_, kPathBlock); ++k) {
    const double t = (k + 1) * step_s_;
    const Decay turn = decay_of(t / turn_s), settle = decay_of(t / kSettle_s), rest = decay_of(t / kRest_s);
    const double drift_m = std::min(params_.path_across * t, kMostDrift_m);
    const double along_m2 = params_.q_along * t, across_m2 = params_.q_across * t;
    const double rest_m2 = kRestDrift * kRestDrift * drift_m * drift_m;
    const auto set = [k](const Columns& c, double along_s, double across_s, double across_s2, double s_m2,
                         double d_m2) {
      c.along_s[k] = along_s;
      c.across_s[k] = across_s;
      c.across_s2[k] = across_s2;
      c.along_m2[k] = s_m2;
      c.across_m2[k] = d_m2;
    };
    set(lane_, t, turn_s * turn.integral, 0.0, along_m2, across_m2);
    set(free_, t, t, 0.5 * t * t, along_m2, across_m2);
    set(rest_, kRest_s * rest.integral, kRest_s * rest.integral, 0.0, along_m2 + rest_m2, across_m2 + rest_m2);
    speed_m2_[k] = params_.path_speed * (t * t * t / 3.0);
    drift_m2_[k] = drift_m * drift_m;
    turn_left_[k] = turn.value;
    error_left_[k] = settle.value;
    error_across_s_[k] = kSettle_s * settle.integral;
    late_s_[k] = 0.5 * turn_s * turn.integral2;
    rest_speed_[k] = rest.value;
  }
}

// place(k): where the lane of point k is.
template <class PlaceOf>
void LanePath::write_points(const PathCar& car, const Columns& by_point, const PathNoise& noise, PlaceOf&& place,
                            PathTable& t) const noexcept {
  for (int32_t begin = 0; begin < t.points_per_track; begin += kPathBlock) {
    const int32_t count = std::min(t.points_per_track - begin, kPathBlock);
    alignas(kCacheLine) double lane[6][kPathBlock] = {}, out[8][kPathBlock];
    alignas(kCacheLine) double along_m2[kPathBlock] = {}, across_m2[kPathBlock] = {};
    alignas(kCacheLine) double steady_along_m2[kPathBlock] = {}, steady_across_m2[kPathBlock] = {};
    const Columns& c = by_point;
    for (int32_t i = 0; i < count; ++i) {
      const LanePlace p = place(begin + i);
      lane[0][i] = p.x_m, lane[1][i] = p.y_m, lane[2][i] = p.heading_rad;
      lane[3][i] = p.ahead_m, lane[4][i] = p.left_m, lane[5][i] = p.turn_rad;
      const double s_m2 = c.along_m2[begin + i], d_m2 = c.across_m2[begin + i] + p.across_m2;
      const double speed_m2 = speed_m2_[begin + i], drift_m2 = drift_m2_[begin + i];
      along_m2[i] = s_m2 + noise.along * speed_m2;
      across_m2[i] = d_m2 + noise.across * drift_m2;
      steady_along_m2[i] = car.steady_along * s_m2 + noise.steady_speed * speed_m2;
      steady_across_m2[i] = car.steady_across * d_m2 + noise.steady_drift * drift_m2;
    }
    kernels_.place_path(car,
                        {c.along_s + begin, c.across_s + begin, c.across_s2 + begin, along_m2, across_m2,
                         steady_along_m2, steady_across_m2},
                        {lane[0], lane[1], lane[2], lane[3], lane[4], lane[5]}, count,
                        {out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]});
    double* const columns[8] = {t.x_m,   t.y_m,    t.course_rad,     t.var_x,
                                t.var_y, t.cov_xy, t.steady_along_m, t.steady_across_m};
    for (int32_t i = 0; i < 8; ++i) std::copy_n(out[i], count, columns[i] + t.count);
    t.count += count;
  }
}

void LanePath::write(const TrackEstimate& estimate, PathKind kind, int32_t segment, const PathNoise& noise,
                     PathTable& t) const noexcept {
  const MotionState& m = estimate.mean;
  PathCar car = make_car(estimate);
  car.steady_along = noise.steady_along, car.steady_across = noise.steady_across;
  double* const speed_mps = t.speed_mps + t.count;
  for (int32_t k = 0; k < t.points_per_track; ++k)
    speed_mps[k] = kind == PathKind::kRest ? m.speed_mps * rest_speed_[k] : m.speed_mps;

  if (kind == PathKind::kLane) {
    LaneWalk lane;
    if (map_ && lane.begin(*map_, segment, m)) {
      drop_yaw_rate(car);
      const double left_m = lane.left_m();
      const Turn turn = split_turn(car, wrap_angle(m.course_rad - lane.at().heading_rad));
      const auto steps = int32_t(std::ceil(step_s_ / kWalkStep_s - 1e-9));
      double way_m = 0;
      const auto place = [&](int32_t k) {
        const double way_from_m = way_m, left_from_m = lane.left_m();
        way_m = m.speed_mps * ((k + 1) * step_s_ - turn.own_rad * turn.own_rad * late_s_[k]);
        const double across_m = m.speed_mps * (turn.own_rad * lane_.across_s[k] + turn.error_rad * error_across_s_[k]);
        const double left_to_m = left_m + across_m - turn.error_m * (1.0 - error_left_[k]);
        for (int32_t i = 1; i <= steps; ++i) {
          const double share = double(i) / steps;
          lane.go_on(way_from_m + share * (way_m - way_from_m), left_from_m + share * (left_to_m - left_from_m));
        }
        const double lever_m = m.speed_mps * lane_.across_s[k];
        return LanePlace{.x_m = lane.at().x_m,
                         .y_m = lane.at().y_m,
                         .heading_rad = lane.at().heading_rad,
                         .ahead_m = lane.ahead_m(),
                         .left_m = left_to_m,
                         .turn_rad = turn.own_rad * turn_left_[k] + turn.error_rad * error_left_[k],
                         .across_m2 = turn.own_var * lever_m * lever_m};
      };
      return write_points(car, lane_, noise, place, t);
    }
  }
  if (kind == PathKind::kRest || kind == PathKind::kStraight) {
    drop_yaw_rate(car);
    const bool rests = kind == PathKind::kRest;
    const Columns& by_point = rests ? rest_ : free_;
    return write_points(
        car, by_point, rests ? PathNoise{.along = 0.0, .across = 0.0} : noise,  // the rest of it is in `car`
        [&](int32_t k) {
          return LanePlace{m.x_m, m.y_m, m.course_rad, m.speed_mps * by_point.along_s[k]};
        },
        t);
  }
  // The chord of one step turns from step to step.
  const double most_rps = kMostTurn_mps2 / std::max(m.speed_mps, 1e-3);
  const double yaw_rate_rps = std::clamp(m.yaw_rate_rps, -most_rps, most_rps);
  const double turn_rad = yaw_rate_rps * step_s_, chord_m = m.speed_mps * step_s_ * sinc(0.5 * turn_rad);
  double sine, cosine, sin_turn, cos_turn;
  sin_cos_f64(wrap_angle(m.course_rad + 0.5 * turn_rad), sine, cosine);
  sin_cos_f64(wrap_angle(turn_rad), sin_turn, cos_turn);
  double x_m = m.x_m, y_m = m.y_m, dx_m = chord_m * cosine, dy_m = chord_m * sine;
  write_points(
      car, free_, noise,
      [&](int32_t k) {
        x_m += dx_m, y_m += dy_m;
        const double dx = dx_m;
        dx_m = cos_turn * dx - sin_turn * dy_m;
        dy_m = sin_turn * dx + cos_turn * dy_m;
        return LanePlace{x_m, y_m, wrap_angle(m.course_rad + (k + 1) * turn_rad), 0.0};
      },
      t);
}

}  // namespace overtake
