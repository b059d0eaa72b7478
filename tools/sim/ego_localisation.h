// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The output of the ego's localisation: RTK GNSS with its errors instead of the truth.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/sim/motion.h"
#include "tools/sim/random.h"

namespace overtake::sim {

struct Jump {
  double at_s, x_m, y_m, over_s;  // the position is wrong by this for over_s
};
struct DropOut {
  double at_s, over_s;  // nothing is published
};

struct LocalisationErrors {
  double rate_hz = 100;
  double position_noise_m = 0.01;            // RTK: white noise, one sigma per axis
  double drift_m = 0.02, drift_time_s = 20;  // and slow drift (Gauss-Markov)
  double heading_noise_rad = 0.1 * kDegree, heading_offset_rad = 0;
  double speed_noise_mps = 0.05, yaw_rate_noise_rps = 0.005;
  double latency_s = 0.02;  // delay of the message; its stamp is right
  bool in_plane = false;    // z, roll and pitch are 0
  std::vector<Jump> jumps;
  std::vector<DropOut> drop_outs;
};

struct EgoPose {
  int64_t stamp_ns, publish_ns;
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad, speed_mps, yaw_rate_rps;
};

// Poses with stamps from 0 to seconds. The heading is the course over ground, so it is wrong by the slip angle.
std::vector<EgoPose> localise(const Motion& ego, const LocalisationErrors& errors, double seconds, Random random);

}  // namespace overtake::sim
