// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Random numbers that do not depend on the order of draws: every number is a function of the seed and of its purpose
// (sensor, scan, line, shot ...). So the order of threads has no effect. SplitMix64 (Steele, Lea, Flood 2014).
#pragma once

#include <cstdint>

#include "tools/sim/sim_math.h"

namespace overtake::sim {

inline uint64_t mix_bits(uint64_t v) {
  v += 0x9e3779b97f4a7c15u;
  v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
  v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
  return v ^ (v >> 31);
}

class Random {
 public:
  explicit Random(uint64_t seed) : state_(mix_bits(seed)) {}
  // An independent generator for a part.
  Random branch(uint64_t key) const { return Random(state_ ^ mix_bits(key + 0x632be59bd9b4e019u)); }

  uint64_t bits() { return mix_bits(state_ += 0x9e3779b97f4a7c15u); }
  double uniform() { return (double(bits() >> 11) + 0.5) * 0x1p-53; }  // (0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  // Normal by Box and Muller; at most 8.6 sigma. The second of a pair is returned by the next call.
  double normal() {
    if (has_second_) {
      has_second_ = false;
      return second_;
    }
    const double radius = std::sqrt(-2 * log_of(uniform()));
    const SinCos angle = sin_cos(2 * kPi * uniform());
    second_ = radius * angle.sin;
    has_second_ = true;
    return radius * angle.cos;
  }

 private:
  uint64_t state_;
  double second_ = 0;
  bool has_second_ = false;
};

}  // namespace overtake::sim
