// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/point_table.h"
#include "core/range_image.h"

namespace overtake {

// Removes the labels of points in pixels of smoke: their reason becomes kSmoke. A point that already has a reason
// (kDust, kSecondReturn) keeps it.
//   reads  smoke pixel_point, points pixel lost reason    writes  points label reason
void mark_smoke(ConstBitPlane smoke, Plane<const int32_t> pixel_point, PointTable& points) noexcept;

}  // namespace overtake
