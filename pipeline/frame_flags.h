// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The flags that say what became of a finished frame's points, rows and time. The intake and the stages set those of
// what they alone know: clocks, silent sensors, the ego pose, the map, exceptions.
//
//   OVT_FLAG_CLOUD_DEGRADED    of a sensor's points more than half are unusable (every reason before dust)
//   OVT_FLAG_NO_DATA           scans, and not one usable point in them
//   OVT_FLAG_OVERFLOW          a table was too small: clusters of a sensor, merged clusters, candidates, tracks
//   OVT_FLAG_DEADLINE_MISSED   later than deadline_ns; 0: there is no deadline
#pragma once

#include <cstdint>

#include "pipeline/frame.h"

namespace overtake {

uint32_t flags_of(const Frame& frame, int32_t sensor_count, bool tracks_overflowed, int64_t deadline_ns) noexcept;

}  // namespace overtake
