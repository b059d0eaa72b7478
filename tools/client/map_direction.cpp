// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/map_direction.h"

#include <cmath>

#include "tools/io/words.h"

namespace overtake::cli {

void MapDirection::add(const CircuitMap& map, const io::EgoRow& row, double margin_m) {
  constexpr double kDrives_mps = 5;
  if (map.empty() || !(row.speed_mps > kDrives_mps)) return;
  if (!(map.measure_outside(row.x_m, row.y_m, &hint_) <= margin_m)) return;
  const MapProjection place = map.project(row.x_m, row.y_m, hint_);
  ++moving_;
  against_ += std::cos(row.yaw_rad - place.heading_rad) < 0;
}

std::string MapDirection::sentence(const std::string& map) const {
  return "the ego vehicle drives against " + map + " in " + std::to_string(against_) + " of " +
         io::counted(moving_, "pose");
}

}  // namespace overtake::cli
