// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The strength of a returned pulse, and whether the sensor detects it.
//
//   signal = S0 * g / 0.1 * (250 m / R)^2 * exp(-2 a (R - 250 m)) * stretch^3    in units of the receiver's noise
//
//   g         reflectivity of the surface (material.h)
//   S0        such that a 10 % Lambertian target seen head-on is detected at 250 m with probability 0.9 (the maker's
//             range)
//   stretch   (1 + (spread / pulse)^2)^(-1/2): the peak of a pulse that a slanted surface spreads over `spread` metres
//             of range. The intensity of the recorded road falls with the peak: 0.14 near the car, 0.10 at a spread of
//             0.6 m, 0.08 at 1.1 m, 0.05 at 1.6 m. The recorded road ends while its intensity is still several times
//             that of other weak echoes at the same range, so the receiver does not detect the peak of a long pulse:
//             a stage coupled by a capacitor passes the changes of a signal, which fall with its duration once more.
//             Two such stages give stretch^3, and the recorded fading: half of the road's returns are missing at a
//             spread of 1.9 m (54 m away), all of them beyond 2.3 m.
//
// A pulse is detected if signal + noise > threshold; the noise is normal with sigma 1. The reported intensity is the
// peak. After a pulse the receiver needs some time, and it ends its search for a second one: recorded second returns
// are 1.2 to 18 m behind the first. Of two pulses farther apart it reports the stronger one.
#pragma once

#include "tools/sim/sim_math.h"

namespace overtake::sim {

inline constexpr double kThreshold = 5;  // in sigma: one false alarm in 3.5 million
inline constexpr double kSignalAtReference = kThreshold + 1.2815515655446004;  // 0.9 quantile above it
inline constexpr double kReferenceRange = 250, kReferenceReflectivity = 0.1;
inline constexpr double kExtinction = 1e-4;  // per metre, clear air
inline constexpr double kPulse = 0.6;        // metres of range: 4 ns
inline constexpr double kRecovery = 1.2;     // metres of range: 8 ns
inline constexpr double kSecondWithin = 18;  // metres of range: 120 ns

inline double received_signal(double g, double range_m) {
  return kSignalAtReference * g / kReferenceReflectivity * square(kReferenceRange / range_m) *
         exp_of(-2 * kExtinction * (range_m - kReferenceRange));
}
// Loss for a beam of this width on a surface whose normal makes this angle with the beam.
inline double stretch_loss(double range_m, double beam_rad, double cos_incidence) {
  const double c = clamp(std::fabs(cos_incidence), 1e-4, 1), spread = range_m * beam_rad * std::sqrt(1 - c * c) / c;
  return 1 / std::sqrt(1 + square(spread / kPulse));
}
inline double receiver_loss(double stretch_loss) { return stretch_loss * stretch_loss * stretch_loss; }

}  // namespace overtake::sim
