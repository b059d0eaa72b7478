// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The attitude of an ego pose that has none: a localisation in the plane gives x, y and yaw. On a bank of 20 deg a
// vehicle without roll contradicts the map, which is banked there, and what is 10 m beside it is 0.6 m elsewhere.
#pragma once

#include <cstdint>

#include "core/circuit_map.h"
#include "pipeline/ego_buffer.h"

namespace overtake {

// Whether a place is on the circuit, or less than 1 m outside of it.
bool is_on_road(const MapProjection& at) noexcept;

// Belongs to the producer of the poses.
class BankAttitude {
 public:
  // The map must stay in memory. Null, or a map without banking: each pose stays as it is.
  void build(const CircuitMap* map) noexcept { map_ = map && map->has_banking() ? map : nullptr; }

  // A pose on the circuit whose roll and pitch are 0 where the map's cross slope is more than 0.05 gets the attitude of
  // a vehicle that stands there, and has_attitude false: its height may be that of a plane, too.
  EgoPose complete(const EgoPose& pose) noexcept;

 private:
  const CircuitMap* map_ = nullptr;
  int32_t hint_ = -1;
};

}  // namespace overtake
