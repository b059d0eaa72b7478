// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/ego_localisation.h"

namespace overtake::sim {

std::vector<EgoPose> localise(const Motion& ego, const LocalisationErrors& errors, double seconds, Random random) {
  std::vector<EgoPose> poses;
  const int64_t period_ns = int64_t(1e9 / errors.rate_hz + 0.5), end_ns = int64_t(seconds * 1e9);
  const double step_s = 1 / errors.rate_hz, keep = exp_of(-step_s / errors.drift_time_s);
  const double kick = errors.drift_m * std::sqrt(1 - keep * keep);
  double drift_x = errors.drift_m * random.normal(), drift_y = errors.drift_m * random.normal();
  for (int64_t stamp_ns = 0; stamp_ns <= end_ns; stamp_ns += period_ns) {
    const double t = double(stamp_ns) * 1e-9;
    const CarState state = ego.at(t);
    const RollPitchYaw angles = angles_of(state.T_map_vehicle.rotation);
    EgoPose pose{};
    pose.stamp_ns = stamp_ns;
    pose.publish_ns = stamp_ns + int64_t(errors.latency_s * 1e9);
    pose.x_m = state.T_map_vehicle.place.x + drift_x + errors.position_noise_m * random.normal();
    pose.y_m = state.T_map_vehicle.place.y + drift_y + errors.position_noise_m * random.normal();
    pose.z_m = state.T_map_vehicle.place.z + errors.position_noise_m * random.normal();
    pose.roll_rad = angles.roll + errors.heading_noise_rad * random.normal();
    pose.pitch_rad = angles.pitch + errors.heading_noise_rad * random.normal();
    pose.yaw_rad =
        wrap_angle(state.course_rad + errors.heading_offset_rad + errors.heading_noise_rad * random.normal());
    pose.speed_mps = state.speed_mps + errors.speed_noise_mps * random.normal();
    pose.yaw_rate_rps = state.yaw_rate_rps + errors.yaw_rate_noise_rps * random.normal();
    if (errors.in_plane) pose.z_m = pose.roll_rad = pose.pitch_rad = 0;
    drift_x = keep * drift_x + kick * random.normal();
    drift_y = keep * drift_y + kick * random.normal();
    for (const Jump& jump : errors.jumps)
      if (t >= jump.at_s && t < jump.at_s + jump.over_s) pose.x_m += jump.x_m, pose.y_m += jump.y_m;
    bool silent = false;
    for (const DropOut& out : errors.drop_outs) silent = silent || (t >= out.at_s && t < out.at_s + out.over_s);
    if (!silent) poses.push_back(pose);
  }
  return poses;
}

}  // namespace overtake::sim
