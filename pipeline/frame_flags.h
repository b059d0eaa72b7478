// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The flags that follow from a finished frame's points, tables and latency. The intake and the stages set the other
// flags: clocks, silent sensors, the ego pose, the map, exceptions.
//
//   OVT_FLAG_CLOUD_DEGRADED    more than half of a sensor's points are unusable (reasons before kDust), or it has none;
//                              or more than 3 of 4 lose their pixel to another range: a beam has at most three returns
//   OVT_FLAG_NO_GROUND         of many usable points, but for objects right beside the sensor, hardly one is ground;
//                              of methods with the running ground, whose height image tells the road
//   OVT_FLAG_NO_DATA           a frame of scans without a usable point
//   OVT_FLAG_OVERFLOW          a table was too small: clusters of a sensor, merged clusters, candidates, tracks
//   OVT_FLAG_DEADLINE_MISSED   latency above deadline_ns; 0: no deadline
#pragma once

#include <cstdint>

#include "pipeline/frame.h"

namespace overtake {

// Points of a present sensor whose place is known.
int64_t count_usable(const SensorPart& part) noexcept;

// Labelled points that are in no cluster; those of the own body have no label, but are in one.
int64_t count_ground(const SensorPart& part) noexcept;

uint32_t flags_of(const Frame& frame, int32_t sensor_count, bool tracks_overflowed, int64_t deadline_ns) noexcept;

}  // namespace overtake
