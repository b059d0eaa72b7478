// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One scan of one sensor: beams through the world, returns through the link budget.
//
// A first pass casts the middle of every beam. Where a beam's neighbours in its line or in the lines above and below
// met something else, or something nearer or farther, and wherever a car may be, a second pass casts four more rays
// across the beam: what they meet within a pulse's length mixes into one range, the rest becomes a second return.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/sim/workers.h"
#include "tools/sim/world.h"

namespace overtake::sim {

inline constexpr int32_t kSensors = 3;
inline constexpr const char* kSensorName[kSensors] = {"front", "left", "right"};

// One scan: columns of the same length, acquisition order, frame of the sensor at the moment of each point.
struct Scan {
  std::vector<float> x_m, y_m, z_m, intensity;
  std::vector<uint16_t> ring, surface;
  std::vector<uint32_t> time_ns;       // after the scan's begin
  std::vector<uint8_t> return_number;  // 0 first, 1 second
  int32_t lines = 0, beams = 0, split_beams = 0;

  std::size_t size() const { return x_m.size(); }
  void append(const Scan& other);
};

struct Mounting {
  Rigid nominal, real;  // T_vehicle_sensor: as the rig says, and where it really sits
};

struct ScanJob {
  const World* world;
  const ScanPattern* pattern;
  const SensorErrors* errors;
  Mounting mounting;
  const OwnCarMask* own_car;
  double begin_s;
  int32_t sensor;
  Random random;  // of this sensor and scan
};

// All jobs together, shared among the workers; the result does not depend on their number.
std::vector<Scan> take_scans(const std::vector<ScanJob>& jobs, Workers& workers);

}  // namespace overtake::sim
