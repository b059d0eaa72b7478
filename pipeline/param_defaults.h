// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The defaults of params.def, by field, in the field's unit.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/math.h"

namespace overtake {

inline constexpr double kDegree_rad = kPi / 180.0;

constexpr bool ends_in_deg(const char* name) {
  std::size_t n = 0;
  while (name[n]) ++n;
  return n >= 4 && name[n - 4] == '_' && name[n - 3] == 'd' && name[n - 2] == 'e' && name[n - 1] == 'g';
}

namespace param_default {
#define OVT_REAL(field, name, unit, value, low, high, text) \
  inline constexpr double field = ends_in_deg(name) ? value * kDegree_rad : value;
#define OVT_INTEGER(field, name, unit, value, low, high, text) inline constexpr int32_t field = value;
#include "pipeline/params.def"
#undef OVT_REAL
#undef OVT_INTEGER
}  // namespace param_default

}  // namespace overtake
