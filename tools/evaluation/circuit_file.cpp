// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/circuit_file.h"

#include "tools/io/error.h"
#include "tools/io/map_file.h"

namespace overtake::evaluation {

void build_circuit(const std::string& map_file, CircuitMap& map) {
  const io::MapData data = io::read_map(map_file);
  const char* error = "";
  const double* banking = data.banking_rad.empty() ? nullptr : data.banking_rad.data();
  const bool built =
      data.is_bounds()
          ? map.build_from_bounds(data.left_x_m.data(), data.left_y_m.data(), int32_t(data.left_x_m.size()),
                                  data.right_x_m.data(), data.right_y_m.data(), int32_t(data.right_x_m.size()),
                                  data.closed, &error)
          : map.build(data.x_m.data(), data.y_m.data(), data.width_left_m.data(), data.width_right_m.data(), banking,
                      int32_t(data.x_m.size()), data.closed, &error);
  if (!built) throw io::Error(map_file, 0, error);
}

}  // namespace overtake::evaluation
