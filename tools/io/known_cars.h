// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The other cars' true states of a log of `overtake simulate`: topic /truth/cars, JSON. Shown to users; the method
// never reads them.
#pragma once

#include <deque>
#include <string_view>
#include <vector>

#include "tools/io/sensor_scan.h"

namespace overtake::io {

inline constexpr const char* kCarStatesName = "overtake.CarStates";
inline constexpr const char* kCarStatesTopic = "/truth/cars";

class KnownCars {
 public:
  // Keeps the states of the last seconds. Throws std::runtime_error for any other text.
  void add(std::string_view json);
  // The cars at a time between two messages, or up to 0.1 s after the last one (linear; angles the shorter way). Empty:
  // not known.
  std::vector<KnownCar> at(int64_t stamp_ns) const;

 private:
  struct States {
    int64_t stamp_ns = 0;
    std::vector<KnownCar> cars;
  };
  std::deque<States> states_;  // in the order of the stamps
};

}  // namespace overtake::io
