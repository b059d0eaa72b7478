// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/point_table.h"

namespace overtake {

// Counts the points of each reason.   reads  points.reason   writes  count[kReasonCount]
void count_reasons(const PointTable& points, int32_t* count) noexcept;

}  // namespace overtake
