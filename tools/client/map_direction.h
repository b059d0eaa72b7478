// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the ego vehicle drives in the direction of a map's points. On a map of the opposite direction left and right,
// the reference heading and the lane of every car are wrong, and the place fits.
#pragma once

#include <cstdint>
#include <string>

#include "core/circuit_map.h"
#include "tools/io/ego_file.h"

namespace overtake::cli {

class MapDirection {
 public:
  // Counts the pose if the vehicle drives forward faster than 5 m/s, at most `margin_m` outside of the map.
  void add(const CircuitMap& map, const io::EgoRow& row, double margin_m);
  bool is_against() const { return 2 * against_ > moving_; }
  // "the ego vehicle drives against MAP in 36 of 41 poses"
  std::string sentence(const std::string& map) const;

 private:
  int64_t moving_ = 0, against_ = 0;
  int32_t hint_ = -1;
};

}  // namespace overtake::cli
