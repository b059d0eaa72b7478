// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames of detections for a TrackerBench, in order or delayed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "core/math.h"
#include "tests/support/circle_road.h"
#include "tests/support/tracker_bench.h"

namespace overtake::test {

struct TestFrame {
  int64_t stamp_ns = 0;
  std::vector<TestDetection> detections;
  overtake::TrackerEgo ego;
  std::vector<overtake::ObservedSector> sectors;
  int32_t sector_count = -1;
  std::vector<int> car;  // per detection; -1 for clutter
};

inline double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * double(random() >> 11) / 9007199254740992.0;
}

// Two sources of different rates see cars that come and go, with clutter: tracks start and end all the time.
inline std::vector<TestFrame> make_frames(uint64_t seed, int32_t cars, double seconds, double clutter) {
  std::mt19937_64 random(seed);
  std::vector<TestFrame> frames;
  for (const int64_t period_ns : {to_ns(0.05), to_ns(0.037)})
    for (int64_t stamp_ns = 0; stamp_ns < to_ns(seconds); stamp_ns += period_ns) {
      TestFrame f;
      f.stamp_ns = stamp_ns;
      f.ego = {random() % 4 != 0, uniform(random, -5, 5), 0, 0.1, 40};
      if (random() % 3 == 0) {
        f.sectors.push_back({0, 0, 2.0, uniform(random, -2, 0), 0, 200});
        f.sector_count = 1;
      }
      for (int car = 0; car < cars; ++car) {
        const double t_s = double(stamp_ns) * 1e-9;
        if (std::fmod(t_s + 0.37 * car, 1.7) < 0.6 || uniform(random, 0, 1) < 0.1) continue;  // hidden for 0.6 s
        const double radius = 30 + 11 * car, angle = car + (15 + car) * t_s / radius;
        f.detections.push_back({radius * std::cos(angle) + uniform(random, -0.3, 0.3),
                                radius * std::sin(angle) + uniform(random, -0.3, 0.3),
                                overtake::wrap_angle(angle + overtake::kHalfPi), uniform(random, -0.01, 0.03), 4.9,
                                1.9});
        f.car.push_back(car);
      }
      while (uniform(random, 0, 1) < clutter) {
        f.detections.push_back({uniform(random, -150, 150), uniform(random, -150, 150)});
        f.car.push_back(-1);
      }
      if (random() % 8 == 0) f.detections.push_back({kNan, 0}), f.car.push_back(-1);
      frames.push_back(std::move(f));
    }
  return frames;
}

// Every detection lies in every track's gate.
inline std::vector<TestDetection> make_clutter(int32_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<TestDetection> clutter;
  for (int32_t i = 0; i < count; ++i) clutter.push_back({uniform(random, -3, 3), uniform(random, -3, 3)});
  return clutter;
}

// Cars at different speeds on a ring, each hidden for 1.4 s every few seconds, some detections in two parts; the ego
// vehicle drives among them; its poses jump by 0.8 m now and then.
inline std::vector<TestFrame> make_ring_frames(uint64_t seed, const CircleRoad& ring, double seconds) {
  std::mt19937_64 random(seed);
  std::vector<TestFrame> frames;
  double start_m[5], speed_mps[5];
  for (int c = 0; c < 5; ++c)
    start_m[c] = 30.0 * c - 60 + uniform(random, -8, 8), speed_mps[c] = uniform(random, 36, 44);
  for (const int64_t period_ns : {to_ns(0.05), to_ns(0.071)})
    for (int64_t stamp_ns = 0; stamp_ns < to_ns(seconds); stamp_ns += period_ns) {
      const double t_s = double(stamp_ns) * 1e-9;
      const overtake::EgoPose ego = ring.pose_at(40 * t_s, 0);
      TestFrame f;
      f.stamp_ns = stamp_ns;
      const double shift_m = std::fmod(t_s, 1.9) < 0.5 ? 0.8 : 0.0;
      f.ego = {true, ego.x_m + shift_m, ego.y_m, ego.yaw_rad, 40, 40 / ring.def.radius_m};
      for (int c = 0; c < 5; ++c) {
        if (std::fmod(t_s + 0.9 * c, 4.0) > 2.6) continue;
        for (int parts = random() % 6 == 0 ? 2 : 1; parts > 0; --parts) {
          const double along = uniform(random, -1, 1) + (parts == 2 ? 2.6 : 0.0);
          const overtake::EgoPose at = ring.pose_at(start_m[c] + speed_mps[c] * t_s + along, uniform(random, 1, 2));
          f.detections.push_back({at.x_m, at.y_m, at.yaw_rad, uniform(random, 0, 0.03), 4.5, 1.8, 0.1, 0.1, 0, 1.0,
                                  int32_t(random() % 2), int32_t(random() % 3 == 0), 0, 2000});
          f.car.push_back(c);
        }
      }
      frames.push_back(std::move(f));
    }
  return frames;
}

inline bool is_earlier(const TestFrame& a, const TestFrame& b) { return a.stamp_ns < b.stamp_ns; }

// Frames arrive up to `delay_s` late.
inline void delay(std::vector<TestFrame>& frames, double delay_s, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<std::pair<double, std::size_t>> arrival;
  for (std::size_t i = 0; i < frames.size(); ++i)
    arrival.emplace_back(double(frames[i].stamp_ns) * 1e-9 + uniform(random, 0, delay_s), i);
  std::sort(arrival.begin(), arrival.end());
  std::vector<TestFrame> delayed;
  for (const auto& [time_s, i] : arrival) delayed.push_back(frames[i]);
  frames = std::move(delayed);
}

inline const std::vector<overtake::TrackId>& give(TrackerBench& bench, const TestFrame& f) {
  bench.frame.ego = f.ego;
  bench.frame.sectors = f.sectors.data();
  bench.frame.sector_count = f.sector_count;
  return bench.step_ns(f.stamp_ns, f.detections);
}

}  // namespace overtake::test
