// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Conversions of angles for the tools. The simulator has separate ones, because tests compare the tools with its truth.
#pragma once

#include <cmath>

namespace overtake::io {

inline constexpr double kPi = 3.14159265358979323846;

constexpr double deg(double rad) { return rad * (180.0 / kPi); }
constexpr double rad(double deg) { return deg * (kPi / 180.0); }
// Wraps the angle to -pi .. pi.
inline double wrap_angle(double rad) { return std::remainder(rad, 2 * kPi); }

}  // namespace overtake::io
