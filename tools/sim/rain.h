// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Rain: single drops in the way of the beams, loss by all drops together, and a road that is wet.
//
//   drops     per cubic metre with a diameter above D: N0 / L exp(-L D), N0 = 8000 / (m^3 mm), L = 4.1 R^-0.21 / mm,
//             R in mm/h (Marshall and Palmer 1948). A drop gives a return to every beam that it lies in: beams overlap
//             near the sensor.
//   beam      Gaussian, full width (4 sigma) kAperture + divergence x range. A drop at its middle has 2 (D / width)^2
//             of its energy.
//   return    Reflectivity of a drop times that share. The front face alone returns as a white surface of 0.005 does.
//             Light from inside adds to it, less at 1550 nm, where a millimetre of water absorbs two thirds, than at
//             905 nm. The default is an estimate between the two.
//   receiver  Its gain is held down nearer than kFullGain, or its own optics would blind it: only drops are so weak
//             that this matters. With these values two beams in 100 return a drop at 20 mm/h, half of them nearer than
//             3 m.
//   loss      1.076 R^0.67 dB/km one way (Carbonneau and Wisely 1998)
//
// Every line has new drops: a drop falls 8 m/s, and the next line is milliseconds later.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/sim/random.h"

namespace overtake::sim {

struct Rain {
  double mm_per_h = 0;  // 0: dry
  double drop_reflectivity = 0.02;
  double wet_floor = 0.5;  // reflectivity of a wet road, apron and grass: this share of the dry one

  bool falls() const { return mm_per_h > 0; }
  double floor_share() const { return falls() ? wet_floor : 1; }
  double extinction_pm() const;
};

inline constexpr double kAperture = 0.01;  // width of a beam where it leaves the sensor, m
inline constexpr double kFullGain = 20;    // m

// What one head does during one line: so many shots, a step apart.
struct Fan {
  double step_rad, beam_rad;
  int32_t shots;
};

struct DropReturn {
  int32_t shot;
  double range_m, share;  // share: of the beam's energy that meets the drop
};
// Appends the returns that a receiver may notice, by shot and then by range, to `out`.
void catch_drops(const Rain& rain, const Fan& fan, double range_min_m, Random random, std::vector<DropReturn>& out);

// Response of the receiver to a drop at this range, relative to a receiver with its full gain.
inline double gain_near(double range_m) { return range_m < kFullGain ? square(range_m / kFullGain) : 1; }

}  // namespace overtake::sim
