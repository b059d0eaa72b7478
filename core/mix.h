// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Linear interpolation, also of angles along the shorter way.
#pragma once

#include "core/math.h"

namespace overtake {

inline double mix(double a, double b, double t) { return a + t * (b - a); }
inline double mix_angle(double a, double b, double t) { return wrap_angle(a + t * wrap_angle(b - a)); }

}  // namespace overtake
