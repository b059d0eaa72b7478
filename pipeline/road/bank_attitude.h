// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses of a localisation in the plane: x, y and yaw, and zeros for the rest. They tell nothing of the road's
// heights, and on a bank of 20 deg what is 10 m beside a vehicle without roll lies 0.6 m elsewhere on the map.
#pragma once

#include <cstdint>

#include "core/circuit_map.h"
#include "pipeline/ego_buffer.h"

namespace overtake {

// Belongs to the producer of the poses.
class BankAttitude {
 public:
  // From now on poses are looked at. The map must stay in memory; null: none.
  void build(const CircuitMap* map) noexcept {
    is_built_ = true;
    map_ = map && map->has_banking() ? map : nullptr;
  }

  // A pose whose roll and pitch are 0 has no attitude: has_attitude becomes false. On the circuit of a map with banking
  // it gets roll and pitch of a vehicle that stands there; over the metre beside it they fade. Any other pose stays as
  // it is.
  EgoPose complete(const EgoPose& pose) noexcept;

 private:
  bool is_built_ = false;
  const CircuitMap* map_ = nullptr;
  int32_t hint_ = -1;
};

}  // namespace overtake
