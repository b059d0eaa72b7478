// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The strength of a returned pulse, and whether the sensor detects it.
//
//   signal = S0 * g / 0.1 * (250 m / R)^2 * exp(-2 a (R - 250 m)) * stretch      in units of the receiver's noise
//
//   g         reflectivity of the surface (material.h)
//   S0        such that a 10 % Lambertian target seen head-on is detected at 250 m with probability 0.9 (the maker's
//             range)
//   stretch   (1 + (spread / pulse)^2)^(-1/2). A slanted surface spreads the pulse over `spread` metres of range, and a
//             receiver that waits for the peak to pass its threshold loses signal. So asphalt at grazing angles
//             vanishes early. (A matched filter would lose only the square root, and see the road at three times the
//             range of the recorded scans.)
//
// A pulse is detected if signal + noise > threshold; the noise is normal with sigma 1. The reported intensity is the
// pulse's energy, which does not depend on the spread.
#pragma once

#include "tools/sim/sim_math.h"

namespace overtake::sim {

inline constexpr double kThreshold = 5;  // in sigma: one false alarm in 3.5 million
inline constexpr double kSignalAtReference = kThreshold + 1.2815515655446004;  // 0.9 quantile above it
inline constexpr double kReferenceRange = 250, kReferenceReflectivity = 0.1;
inline constexpr double kExtinction = 1e-4;  // per metre, clear air
inline constexpr double kPulse = 0.6;        // metres of range: 4 ns

inline double received_signal(double g, double range_m) {
  return kSignalAtReference * g / kReferenceReflectivity * square(kReferenceRange / range_m) *
         exp_of(-2 * kExtinction * (range_m - kReferenceRange));
}
// Loss for a beam of this width on a surface whose normal makes this angle with the beam.
inline double stretch_loss(double range_m, double beam_rad, double cos_incidence) {
  const double c = clamp(std::fabs(cos_incidence), 1e-4, 1), spread = range_m * beam_rad * std::sqrt(1 - c * c) / c;
  return 1 / std::sqrt(1 + square(spread / kPulse));
}

}  // namespace overtake::sim
