// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/road/driven_way.h"

#include <algorithm>
#include <cmath>

#include "pipeline/clock_watch.h"

namespace overtake {
namespace {

constexpr double kLongest_s = 1.0;                 // between two poses
constexpr double kJump_m = 0.4, kJumpShare = 0.2;  // more than the speed tells, and this share of the step
constexpr double kLeastLeft = 0.5;                 // a way that has turned round is not behind the vehicle

}  // namespace

void DrivenWay::add(const EgoPose& pose) noexcept {
  const double x_m = pose.x_m - last_.x_m, y_m = pose.y_m - last_.y_m, z_m = pose.z_m - last_.z_m;
  const double step_m = std::sqrt(x_m * x_m + y_m * y_m);
  const double seconds = has_last_ ? double(difference_ns(pose.stamp_ns, last_.stamp_ns)) * 1e-9 : 0.0;
  const double most_m = kJump_m + kJumpShare * step_m;
  const bool goes_on = has_last_ && seconds <= kLongest_s && std::fabs(z_m) <= most_m &&
                       std::fabs(step_m - std::fabs(pose.speed_mps) * seconds) <= most_m;
  last_ = pose;
  has_last_ = true;
  if (goes_on) {
    const Place& newest = places_[(count_ - 1) % kPlaces];
    const double dx = pose.x_m - newest.x_m, dy = pose.y_m - newest.y_m;
    if (!(dx * dx + dy * dy >= kStep_m * kStep_m)) return;
  }
  const EgoState ego = state_of(pose);
  places_[count_++ % kPlaces] = {pose.x_m, pose.y_m, pose.z_m, {ego.r[1], ego.r[4], ego.r[7]}, pose.stamp_ns, !goes_on};
}

void DrivenWay::describe(int64_t stamp_ns, RoadData& road) const noexcept {
  road.way_count = 0;
  const double* const r = road.ego.r;
  const EgoPose& here = road.ego.pose;
  // A vector of the map in the vehicle's axes.
  const auto turned = [&](double x, double y, double z, int32_t axis) {
    return r[axis] * x + r[3 + axis] * y + r[6 + axis] * z;
  };
  double last_x = 0.0;
  for (int64_t i = count_ - 1; i >= std::max<int64_t>(count_ - kPlaces, 0) && road.way_count < RoadData::kWay; --i) {
    const Place& p = places_[i % kPlaces];
    const int64_t age_ns = difference_ns(stamp_ns, p.stamp_ns);
    if (age_ns < 0) continue;
    if (age_ns < kLagNs) {
      if (p.begins) return;
      continue;
    }
    const double x = p.x_m - here.x_m, y = p.y_m - here.y_m, z = p.z_m - here.z_m;
    const double ahead_m = turned(x, y, z, 0), left_y = turned(p.left[0], p.left[1], p.left[2], 1);
    if (!(left_y >= kLeastLeft)) return;
    if (ahead_m <= last_x - 0.5 * kStep_m) {
      last_x = ahead_m;
      road.way[road.way_count++] = {float(ahead_m), float(turned(x, y, z, 1)), float(turned(x, y, z, 2)),
                                    float(turned(p.left[0], p.left[1], p.left[2], 2) / left_y)};
    }
    if (p.begins) return;
  }
}

}  // namespace overtake
