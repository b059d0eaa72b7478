// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// GOSPA with alpha = 2 (Rahmathullah, Garcia-Fernandez & Svensson 2017): one distance between the true objects and the
// tracks at one moment,
//     d = (min over pairings of  sum of distance^p  +  c^p / 2 (missed + false))^(1/p)
// without pairs farther apart than c. The pairing has the least cost, not the largest number of pairs.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/evaluation/metrics/clear_mot.h"

namespace overtake::metrics {

struct GospaParams {
  double c_m = 2, p = 2;
};

struct Gospa {
  double distance_m = 0;                                  // the total
  double localisation = 0, missed = 0, false_tracks = 0;  // its parts, in m^p; their sum is distance_m^p
  int64_t pairs = 0, missed_count = 0, false_count = 0;
};
// Positions that are not finite are never paired.
Gospa gospa(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks, const GospaParams& params = {});

}  // namespace overtake::metrics
