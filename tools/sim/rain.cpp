// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/rain.h"

#include <algorithm>

#include "tools/sim/link_budget.h"

namespace overtake::sim {
namespace {

constexpr double kFarthest = 15;                // m
constexpr int32_t kShells = 10;                 // of range: each has its own smallest drop
constexpr double kSlab = 0.75;                  // half height of the space that is searched, in widths of the beam
constexpr double kFaintest = kThreshold - 3.5;  // one of 4,300 weaker returns would be detected

double power_of(double base, double exponent) { return exp_of(exponent * log_of(base)); }

}  // namespace

double Rain::extinction_pm() const { return falls() ? 1.076 * power_of(mm_per_h, 0.67) / 4343 : 0; }

void catch_drops(const Rain& rain, const Fan& fan, double range_min_m, Random random, std::vector<DropReturn>& out) {
  if (!rain.falls()) return;
  const std::size_t begin = out.size();
  const double slope = 4100 * power_of(rain.mm_per_h, -0.21);  // 1/m
  const auto width_at = [&](double range_m) { return kAperture + fan.beam_rad * range_m; };
  // The share of a beam's energy that a drop must have: nearer than kFullGain the same at any range, but for clear air.
  const double needed = kFaintest / (received_signal(1, kFullGain) * rain.drop_reflectivity);
  for (int32_t shell = 0; shell < kShells; ++shell) {
    const double from = kFarthest * shell / kShells, to = kFarthest * (shell + 1) / kShells;
    const double smallest = width_at(from) * std::sqrt(needed / 2), per_m3 = 8e6 / slope * exp_of(-slope * smallest);
    // Drops in the box around the shell's part of the fan; those outside of the fan go.
    const double wide = to * fan.step_rad * fan.shots, high = 2 * kSlab * width_at(to);
    const double mean = per_m3 * (to - from) * wide * high;
    const int32_t count = int32_t(std::max(0.0, mean + std::sqrt(mean) * random.normal() + random.uniform()));
    for (int32_t i = 0; i < count; ++i) {
      const double range = random.uniform(from, to), width = width_at(range);
      const double middle = random.uniform() * fan.shots - 0.5, up_m = random.uniform(-0.5, 0.5) * high;
      if (random.uniform() * to > range || range < range_min_m) continue;
      const double diameter = smallest - log_of(random.uniform()) / slope;
      const double most = 2 * square(diameter / width) * exp_of(-8 * square(up_m / width));
      const double shot_m = range * fan.step_rad, reach = width / shot_m;
      const int32_t first = std::max(0, int32_t(std::ceil(middle - reach)));
      const int32_t last = std::min(fan.shots - 1, int32_t(std::floor(middle + reach)));
      for (int32_t shot = first; most > needed && shot <= last; ++shot) {
        const double share = most * exp_of(-8 * square((shot - middle) * shot_m / width));
        if (share > needed) out.push_back({shot, range, std::min(1.0, share)});
      }
    }
  }
  std::sort(out.begin() + std::ptrdiff_t(begin), out.end(), [](const DropReturn& a, const DropReturn& b) {
    return a.shot != b.shot ? a.shot < b.shot : a.range_m < b.range_m;
  });
}

}  // namespace overtake::sim
