// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything that a beam can hit: the surroundings, the cars at that time, the own car, smoke.
#pragma once

#include <memory>
#include <vector>

#include "tools/sim/bvh.h"
#include "tools/sim/scenario.h"
#include "tools/sim/smoke.h"

namespace overtake::sim {

struct World {
  Track track;
  Bvh surroundings;                              // in the map frame
  Bvh car;                                       // in the vehicle frame; one shape for all cars
  std::vector<std::unique_ptr<Motion>> motions;  // by car of the scenario
  int32_t ego = 0;
  std::vector<PuffSource> puff_sources;
  Random puff_random{0};  // the same for all sensors and scans of a run

  // Throws std::invalid_argument if a plan exceeds what a car can do. track_draws: see Track::make.
  explicit World(const Scenario& scenario, std::optional<Random> track_draws = {});
};

// The hit of a beam. surface: Surface, other cars numbered from Surface::car.
struct BeamHit {
  double range_m = 0;
  double cos_incidence = 0;
  uint16_t surface = 0;  // none: nothing within range
  MaterialId material = MaterialId::asphalt;
  double coverage = 1;    // share of the beam that stops here
  int32_t triangle = -1;  // of the surroundings, -1: of a car
};

// The cars and the ego during one line of a scan: poses at its start and end, linear in between.
struct LineView {
  Rigid ego[2];
  std::vector<Rigid> cars[2];
  std::vector<int32_t> numbers;  // of the cars, without the ego

  static LineView make(const World& world, double begin_s, double end_s);
};

struct Ray {
  Vec3 origin_map, direction_map, origin_vehicle, direction_vehicle;
};

// The directions in which a sensor may see its own car: a grid, grown by one cell on all sides. In other directions the
// own car does not block the view, and its mesh is not tested.
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
  double share;   // of the line's duration
  bool own_car;   // whether the own car may block the view
  bool active;    // whether to cast this ray
  double near_m;  // nearer hits do not count
  BeamHit hit;    // the nearest hit
};
// Casts nearly parallel rays of one line. likely: a triangle of the surroundings that is probably hit, -1: none; it
// does not change the result.
void cast(const World& world, const LineView& view, RayCast (&pack)[Bvh::kPack], double far_m, int32_t likely);

}  // namespace overtake::sim
