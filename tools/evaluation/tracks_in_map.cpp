// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/tracks_in_map.h"

#include <cmath>

#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/places.h"

namespace overtake::evaluation {
namespace {

// The height of the car that is nearest to a place of the vehicle frame, in this frame; 0 where none is near.
double height_at(const CarTruth& ego, const io::Rotation& axes, const std::vector<CarTruth>& cars, double x_m,
                 double y_m) {
  double height_m = 0, nearest_m = 2 * kGateM;
  for (const CarTruth& c : cars) {
    if (c.is_ego) continue;
    const Seen at = see(ego, c.x_m, c.y_m, c.z_m);
    const double distance_m = std::hypot(at.ahead_m - x_m, at.left_m - y_m);
    if (distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    height_m = (c.x_m - ego.x_m) * axes[2][0] + (c.y_m - ego.y_m) * axes[2][1] + (c.z_m - ego.z_m) * axes[2][2];
  }
  return height_m;
}

}  // namespace

const ovt_tracks& TracksInMap::take(const ovt_tracks& tracks, const std::vector<CarTruth>& cars) {
  const CarTruth& ego = *ego_of(cars);
  io::EgoRow pose;
  pose.x_m = ego.x_m, pose.y_m = ego.y_m, pose.z_m = ego.z_m;
  pose.roll_rad = ego.roll_rad, pose.pitch_rad = ego.pitch_rad, pose.yaw_rad = ego.heading_rad;
  const io::Rotation axes = io::axes_of(ego.roll_rad, ego.pitch_rad, ego.heading_rad);
  const std::size_t count = std::size_t(tracks.count);
  for (std::vector<double>* column : {&x_m_, &y_m_, &speed_mps_, &course_rad_, &heading_rad_}) column->resize(count);
  yaw_rate_rps_.assign(count, kNan);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = tracks.x_m[i], y = tracks.y_m[i], course = tracks.course_rad[i];
    const MapPlace at = to_map(pose, x, y, height_at(ego, axes, cars, x, y), tracks.heading_rad[i]);
    x_m_[i] = at.x_m, y_m_[i] = at.y_m, heading_rad_[i] = at.heading_rad;
    const double vx = tracks.speed_mps[i] * std::cos(course), vy = tracks.speed_mps[i] * std::sin(course);
    const double map_vx = ego.speed_mps * std::cos(ego.course_rad) + axes[0][0] * vx + axes[1][0] * vy -
                          ego.yaw_rate_rps * (at.y_m - ego.y_m);
    const double map_vy = ego.speed_mps * std::sin(ego.course_rad) + axes[0][1] * vx + axes[1][1] * vy +
                          ego.yaw_rate_rps * (at.x_m - ego.x_m);
    speed_mps_[i] = std::hypot(map_vx, map_vy), course_rad_[i] = std::atan2(map_vy, map_vx);
  }
  out_ = tracks;
  out_.x_m = x_m_.data(), out_.y_m = y_m_.data(), out_.heading_rad = heading_rad_.data();
  out_.speed_mps = speed_mps_.data(), out_.course_rad = course_rad_.data(), out_.yaw_rate_rps = yaw_rate_rps_.data();
  return out_;
}

}  // namespace overtake::evaluation
