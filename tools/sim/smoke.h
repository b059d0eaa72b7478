// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tyre smoke and dust: puffs that leave a car's rear wheels, slow down, grow and fade. A puff is a Gaussian ball of
// extinction. A beam through it loses exp(-2 tau) on the way there and back, and gets a weak return from inside.
#pragma once

#include <vector>

#include "tools/sim/motion.h"
#include "tools/sim/random.h"

namespace overtake::sim {

struct PuffSource {
  const Motion* car;
  double from_s, to_s, per_s, density_pm, life_s;
  uint64_t key;
};

struct Puff {
  Vec3 center;
  double radius_m, extinction_pm;
};

// The puffs that exist at one moment, with a ball that contains all of them.
struct PuffCloud {
  std::vector<Puff> puffs;
  Vec3 center;
  double radius_m = 0;
};
PuffCloud puffs_at(const std::vector<PuffSource>& sources, double time_s, const Random& random);

inline constexpr double kSmokeReflectivity = 0.08;  // of a thick cloud: pi / (2 x lidar ratio), ratio 20 sr

struct SmokeReturn {
  double range_m, share;  // share of the beam's energy on its way back, before the surface behind
  double depth_m;         // of the puff along the beam: the echo is spread over this
};
// Appends the returns along a ray up to range far_m to `out`; returns the energy left for the surface behind.
double cross_smoke(const PuffCloud& cloud, Vec3 origin, Vec3 direction, double far_m, Random& random,
                   std::vector<SmokeReturn>& out);

}  // namespace overtake::sim
