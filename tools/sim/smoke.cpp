// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/smoke.h"

#include <algorithm>

namespace overtake::sim {

PuffCloud puffs_at(const std::vector<PuffSource>& sources, double time_s, const Random& random) {
  PuffCloud cloud;
  for (const PuffSource& source : sources) {
    const int64_t first = int64_t(std::max(0.0, (time_s - source.life_s - source.from_s) * source.per_s));
    const int64_t last = int64_t((std::min(time_s, source.to_s) - source.from_s) * source.per_s);
    for (int64_t i = first; i <= last && time_s > source.from_s; ++i) {
      const double born = source.from_s + double(i) / source.per_s, age = time_s - born;
      if (age < 0 || age >= source.life_s) continue;
      Random dice = random.branch(source.key).branch(uint64_t(i));
      const CarState car = source.car->at(born);
      const double side = i % 2 ? 0.75 : -0.75;
      const SinCos course = sin_cos(car.course_rad);
      const double speed = 0.35 * car.speed_mps, slowed = 0.6 * (1 - exp_of(-age / 0.6));  // metres per m/s
      Puff puff;
      puff.center =
          car.T_map_vehicle * Vec3{dice.uniform(-0.5, 0.2), side + 0.15 * dice.normal(), dice.uniform(0.1, 0.4)};
      puff.center = puff.center + Vec3{course.cos, course.sin, 0} * (speed * slowed) +
                    Vec3{0.8 + 0.5 * dice.normal(), -0.4 + 0.5 * dice.normal(), 0.5 + 0.2 * dice.normal()} * age;
      puff.radius_m = 0.25 + 0.9 * std::sqrt(age);
      puff.extinction_pm =
          source.density_pm * exp_of(-2.5 * age / source.life_s) * dice.uniform(0.5, 1.5) * square(0.5 / puff.radius_m);
      cloud.puffs.push_back(puff);
    }
  }
  for (const Puff& puff : cloud.puffs) cloud.center = cloud.center + puff.center * (1.0 / double(cloud.puffs.size()));
  for (const Puff& puff : cloud.puffs)
    cloud.radius_m = std::max(cloud.radius_m, length(puff.center - cloud.center) + 3 * puff.radius_m);
  return cloud;
}

double cross_smoke(const PuffCloud& cloud, Vec3 origin, Vec3 direction, double far_m, Random& random,
                   std::vector<SmokeReturn>& out) {
  if (cloud.puffs.empty()) return 1;
  const double middle = dot(cloud.center - origin, direction);
  if (length(cloud.center - origin - direction * middle) > cloud.radius_m) return 1;
  const std::size_t begin = out.size();
  for (const Puff& puff : cloud.puffs) {
    const Vec3 to = puff.center - origin;
    const double along = dot(to, direction), aside2 = dot(to, to) - along * along, r2 = square(puff.radius_m);
    if (aside2 > 6 * r2 || along < 0) continue;
    const double depth = puff.extinction_pm * 1.7724538509055160 * puff.radius_m * exp_of(-aside2 / r2);
    const double range = along + 0.7071067811865476 * puff.radius_m * random.normal();
    if (depth < 1e-3 || range < 0.5 || range > far_m) continue;
    out.push_back({range, depth, 1.8 * puff.radius_m});
  }
  std::sort(out.begin() + std::ptrdiff_t(begin), out.end(),
            [](const SmokeReturn& a, const SmokeReturn& b) { return a.range_m < b.range_m; });
  double left = 1;
  for (std::size_t i = begin; i < out.size(); ++i) {
    const double passed = exp_of(-2 * out[i].share);
    out[i].share = left * (1 - passed);
    left *= passed;
  }
  return left;
}

}  // namespace overtake::sim
