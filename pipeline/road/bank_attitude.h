// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses of a localisation in the plane: x, y and yaw, and zeros or the tilt of a mounting for the rest. They tell
// nothing of the road's heights, and on a bank of 20 deg what is 10 m beside a vehicle without roll lies 0.6 m
// elsewhere on the map.
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

  // A pose has no attitude if its roll and pitch are 0; if they have not changed over the last 20 m and differ by 1.5
  // deg from those of a vehicle on the bank; or, where the map tells no bank, if they have not changed over 100 m and
  // a turn of 0.1 rad. Then has_attitude becomes false, and on the circuit of a map with banking the pose gets roll
  // and pitch of a vehicle that stands there; over the metre beside it they fade. Any other pose stays as it is.
  EgoPose complete(const EgoPose& pose) noexcept;

 private:
  void follow(const EgoPose& pose) noexcept;
  bool stand_on_bank(EgoPose& pose) noexcept;

  bool is_built_ = false;
  const CircuitMap* map_ = nullptr;
  int32_t hint_ = -1;
  int64_t last_ns_ = 0;
  double roll_rad_ = 0, pitch_rad_ = 0, yaw_rad_ = 0;  // of the first pose of this attitude
  double same_m_ = 0, turned_rad_ = 0;                 // way and turn since then
};

}  // namespace overtake
