// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One point through a rigid transform, in one fixed order of operations, so that all kernels compute the same bytes. A
// template on the value type V: float in the references, a vector in the SIMD forms.
#pragma once

#include "core/check.h"
#include "core/sensor_model.h"

namespace overtake {

template <class V>
OVT_INLINE void transform_point(const Transform& T_to_from, V x, V y, V z, V& to_x, V& to_y, V& to_z) {
  const float* r = T_to_from.r;
  const float* t = T_to_from.t;
  to_x = ((V(r[0]) * x + V(r[1]) * y) + V(r[2]) * z) + V(t[0]);
  to_y = ((V(r[3]) * x + V(r[4]) * y) + V(r[5]) * z) + V(t[1]);
  to_z = ((V(r[6]) * x + V(r[7]) * y) + V(r[8]) * z) + V(t[2]);
}

}  // namespace overtake
