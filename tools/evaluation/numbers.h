// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Constants that several files of the evaluation use.
#pragma once

#include <limits>

namespace overtake::evaluation {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace overtake::evaluation
