// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers that several files of the evaluation use.
#pragma once

#include <limits>

namespace overtake::evaluation {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kDegree = 3.14159265358979323846 / 180;

}  // namespace overtake::evaluation
