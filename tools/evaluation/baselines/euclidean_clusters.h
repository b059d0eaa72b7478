// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Euclidean clustering as in PCL (Rusu & Cousins 2011): points within the radius of each other are in one cluster,
// transitively. Implemented with a hash grid instead of a k-d tree; the clusters are the same.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake::baselines {

// Cluster of each point, from 0 in the order of their first points. Throws std::invalid_argument for columns of
// different lengths, a radius that is not positive, and a point that is not finite.
std::vector<int32_t> cluster_points(const std::vector<float>& x_m, const std::vector<float>& y_m,
                                    const std::vector<float>& z_m, double radius_m);

}  // namespace overtake::baselines
