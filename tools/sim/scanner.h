// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One scan of one sensor: casts beams through the world and applies the link budget to the returns.
//
// A first pass casts the middle of every beam. A second pass casts four more rays across a beam if its neighbours in
// the same, upper or lower line hit another surface or another range, and wherever a car may be. Hits within a pulse's
// length merge into one range; the rest becomes a second return.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tools/sim/rain.h"
#include "tools/sim/workers.h"
#include "tools/sim/world.h"

namespace overtake::sim {

// One scan: columns of the same length, acquisition order, frame of the sensor at the time of each point.
struct Scan {
  std::vector<float> x_m, y_m, z_m, intensity;
  std::vector<uint16_t> ring, surface;
  std::vector<uint32_t> time_ns;       // after the start of the scan
  std::vector<uint8_t> return_number;  // 0 first, 1 second
  int32_t lines = 0, beams = 0, split_beams = 0;

  std::size_t size() const { return x_m.size(); }
  void append(const Scan& other);
};

struct Mounting {
  Rigid nominal, real;  // T_vehicle_sensor: according to the rig, and in reality
};

// How the two heads of one sensor are adjusted to each other.
struct Heads {
  double overlap_rad = 0;  // of their azimuths in the middle; negative: a gap
  double step_rad = 0;     // how much higher the left head looks
};

struct ScanJob {
  const World* world;
  const ScanPattern* pattern;
  const SensorErrors* errors;
  const Rain* rain;
  Mounting mounting;
  Heads heads;
  const OwnCarMask* own_car;
  std::span<const Dirt> dirt;  // of all sensors and times
  double begin_s;
  int32_t sensor;
  Random random;  // for this sensor and scan
};

// All jobs together, distributed to the workers; the result does not depend on the number of workers.
std::vector<Scan> take_scans(const std::vector<ScanJob>& jobs, Workers& workers);

}  // namespace overtake::sim
