// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Assignment for the metrics. The tracker has a separate one (pipeline/track/munkres.h): a shared one would hide its
// errors from the metrics.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace overtake::metrics {

inline constexpr double kForbidden = std::numeric_limits<double>::infinity();

// Column of each row, -1 none: the least sum of cost(row, column) over the pairs plus `alone` for each row without one.
// kForbidden: not a pair. Ties depend on rounding, but are the same in every run. O(rows^2 (rows + columns)).
std::vector<int32_t> assign(int32_t rows, int32_t columns, double alone,
                            const std::function<double(int32_t, int32_t)>& cost);

}  // namespace overtake::metrics
