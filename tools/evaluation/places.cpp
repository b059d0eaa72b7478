// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/places.h"

#include <algorithm>
#include <cmath>

#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/numbers.h"
#include "tools/io/angles.h"

namespace overtake::evaluation {

MapPlace to_map(const io::EgoRow& pose, double x_m, double y_m, double z_m, double heading_rad) {
  const io::Rotation axes = io::axes_of(pose.roll_rad, pose.pitch_rad, pose.yaw_rad);
  const double in[3] = {x_m, y_m, z_m};
  MapPlace out{pose.x_m, pose.y_m, 0};
  for (std::size_t k = 0; k < 3; ++k) out.x_m += axes[k][0] * in[k], out.y_m += axes[k][1] * in[k];
  const double ch = std::cos(heading_rad), sh = std::sin(heading_rad);
  out.heading_rad = std::atan2(axes[0][1] * ch + axes[1][1] * sh, axes[0][0] * ch + axes[1][0] * sh);
  return out;
}

double heading_from_map(double roll, double pitch, double yaw, double heading_rad) {
  const io::Rotation axes = io::axes_of(roll, pitch, yaw);
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  return std::atan2(axes[0][0] * s - axes[0][1] * c, axes[1][1] * c - axes[1][0] * s);
}

double heading_in_vehicle(double roll, double pitch, double yaw, double heading_rad) {
  const io::Rotation axes = io::axes_of(roll, pitch, yaw);
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  return std::atan2(axes[1][0] * c + axes[1][1] * s, axes[0][0] * c + axes[0][1] * s);
}

io::EgoRow pose_at(const std::vector<PublishedPose>& poses, int64_t stamp_ns) {
  const auto above = std::lower_bound(poses.begin(), poses.end(), stamp_ns,
                                      [](const PublishedPose& p, int64_t t) { return p.row.stamp_ns < t; });
  if (poses.empty()) return {};
  if (above == poses.end() || above == poses.begin()) {
    io::EgoRow row = above == poses.end() ? poses.back().row : poses.front().row;
    const double dt = double(stamp_ns - row.stamp_ns) * 1e-9;
    const double half = row.yaw_rate_rps * dt / 2;  // the chord of the arc has the yaw of its middle
    const double chord_m = row.speed_mps * dt * (std::fabs(half) > 1e-6 ? std::sin(half) / half : 1);
    row.x_m += chord_m * std::cos(row.yaw_rad + half), row.y_m += chord_m * std::sin(row.yaw_rad + half);
    row.yaw_rad += 2 * half;
    return row;
  }
  const io::EgoRow &a = (above - 1)->row, &b = above->row;
  const double w = double(stamp_ns - a.stamp_ns) / double(b.stamp_ns - a.stamp_ns);
  io::EgoRow row = a;
  row.x_m += w * (b.x_m - a.x_m), row.y_m += w * (b.y_m - a.y_m), row.z_m += w * (b.z_m - a.z_m);
  row.roll_rad += w * wrap_angle(b.roll_rad - a.roll_rad), row.pitch_rad += w * wrap_angle(b.pitch_rad - a.pitch_rad);
  row.yaw_rad += w * wrap_angle(b.yaw_rad - a.yaw_rad);
  return row;
}

const CarTruth* ego_of(const std::vector<CarTruth>& cars) {
  for (const CarTruth& c : cars)
    if (c.is_ego) return &c;
  return nullptr;
}

io::EgoRow true_pose(const CarTruth& c, int64_t stamp_ns) {
  return {stamp_ns, c.x_m, c.y_m, c.z_m, c.roll_rad, c.pitch_rad, c.heading_rad, c.speed_mps, c.yaw_rate_rps};
}

namespace {
double value_of(int32_t car, const std::vector<CarTruth>& cars, double CarTruth::*value) {
  for (const CarTruth& c : cars)
    if (c.car == car) return c.*value;
  return kNan;
}
}  // namespace

double mean_acceleration(int32_t car, const std::vector<CarTruth>& before, const std::vector<CarTruth>& after,
                         double seconds) {
  return (value_of(car, after, &CarTruth::speed_mps) - value_of(car, before, &CarTruth::speed_mps)) / seconds;
}

double mean_course_rate(int32_t car, const std::vector<CarTruth>& before, const std::vector<CarTruth>& after,
                        double seconds) {
  return wrap_angle(value_of(car, after, &CarTruth::course_rad) - value_of(car, before, &CarTruth::course_rad)) /
         seconds;
}

std::array<double, 5> state_error(const ovt_tracks& t, int32_t i, const CarTruth& car, double course_rate_rps) {
  return {t.x_m[i] - car.x_m, t.y_m[i] - car.y_m, t.speed_mps[i] - car.speed_mps,
          wrap_angle(t.course_rad[i] - car.course_rad),
          car.speed_mps > kMovingMps ? t.yaw_rate_rps[i] - course_rate_rps : kNan};
}

Seen see(const CarTruth& from, double x_m, double y_m, double z_m) {
  const io::Rotation axes = io::axes_of(from.roll_rad, from.pitch_rad, from.heading_rad);
  const double d[3] = {x_m - from.x_m, y_m - from.y_m, z_m - from.z_m};
  const auto along = [&](const std::array<double, 3>& axis) {
    return d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
  };
  return {along(axes[0]), along(axes[1])};
}

int32_t nearest_car(const std::vector<CarTruth>& cars, double x_m, double y_m) {
  int32_t best = -1;
  double best_m = kGateM;
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const double d = std::hypot(cars[i].x_m - x_m, cars[i].y_m - y_m);
    if (!cars[i].is_ego && d <= best_m) best = int32_t(i), best_m = d;
  }
  return best;
}

bool CarPlace::holds(double x_m, double y_m, double margin_m) const {
  const double dx = x_m - ahead_m, dy = y_m - left_m;
  return std::fabs(cos_turn * dx + sin_turn * dy) <= kCarLengthM / 2 + margin_m &&
         std::fabs(cos_turn * dy - sin_turn * dx) <= kCarWidthM / 2 + margin_m;
}

std::vector<CarPlace> place_cars(const std::vector<CarTruth>& cars) {
  std::vector<CarPlace> out;
  const CarTruth* ego = ego_of(cars);
  for (const CarTruth& c : cars) {
    if (c.is_ego || !ego) continue;
    const Seen at = see(*ego, c.x_m, c.y_m, c.z_m);
    const double turn = c.heading_rad - ego->heading_rad;
    out.push_back({c.car, at.ahead_m, at.left_m, std::cos(turn), std::sin(turn)});
  }
  return out;
}

}  // namespace overtake::evaluation
