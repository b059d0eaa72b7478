// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything a beam can meet: the surroundings, the cars where they are at that moment, the own car, smoke.
#pragma once

#include <memory>
#include <vector>

#include "tools/sim/bvh.h"
#include "tools/sim/scenario.h"
#include "tools/sim/smoke.h"

namespace overtake::sim {

struct World {
  Track track;
  Bvh surroundings;                              // map frame
  Bvh car;                                       // vehicle frame; one shape for all
  std::vector<std::unique_ptr<Motion>> motions;  // by car of the scenario
  int32_t ego = 0;
  std::vector<PuffSource> puff_sources;
  Random puff_random{0};  // the same for all sensors and scans of a run

  // Throws std::invalid_argument where a plan is beyond what a car can do.
  explicit World(const Scenario& scenario);
};

// What a beam met. surface: Surface, cars numbered from Surface::car.
struct BeamHit {
  double range_m = 0;
  double cos_incidence = 0;
  uint16_t surface = 0;  // none: nothing within range
  MaterialId material = MaterialId::asphalt;
  double coverage = 1;    // share of the beam that is stopped here
  int32_t triangle = -1;  // of the surroundings, -1: a car's
};

// The cars and the ego as one line of a scan sees them: poses at its begin and end, straight in between.
struct LineView {
  Rigid ego[2];
  std::vector<Rigid> cars[2];
  std::vector<int32_t> numbers;  // of the cars, the ego left out

  static LineView make(const World& world, double begin_s, double end_s);
};

struct Ray {
  Vec3 origin_map, direction_map, origin_vehicle, direction_vehicle;
};

// Where a sensor may see its own car: a grid of directions, cells grown by one all round. Outside of it nothing of the
// own car is in the way, and no time is lost on asking.
class OwnCarMask {
 public:
  OwnCarMask() = default;
  OwnCarMask(const World& world, const Rigid& T_vehicle_sensor);
  bool may_meet(double azimuth_rad, double elevation_rad) const;

 private:
  std::vector<uint8_t> cells_;
};

// One ray of a pack.
struct RayCast {
  Ray ray;
  double share;   // of the line's time
  bool own_car;   // whether the own car may be in the way
  bool active;    // whether it is to be cast
  double near_m;  // hits nearer than this do not count
  BeamHit hit;    // the nearest one
};
// Rays of one line that run nearly alike. likely: a triangle of the surroundings that is probably hit, -1: none; the
// result does not depend on it.
void cast(const World& world, const LineView& view, RayCast (&pack)[Bvh::kPack], double far_m, int32_t likely);

}  // namespace overtake::sim
