// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/circuit_file.h"

#include "tools/io/error.h"

namespace overtake::cli {

CircuitMap to_circuit(const io::MapData& data, const std::string& file) {
  CircuitMap map;
  const char* wrong = "";
  MapPoint point;
  const double* banking = data.banking_rad.empty() ? nullptr : data.banking_rad.data();
  const bool built =
      data.is_bounds()
          ? map.build_from_bounds(data.left_x_m.data(), data.left_y_m.data(), int32_t(data.left_x_m.size()),
                                  data.right_x_m.data(), data.right_y_m.data(), int32_t(data.right_x_m.size()),
                                  data.closed, &wrong, &point)
          : map.build(data.x_m.data(), data.y_m.data(), data.width_left_m.data(), data.width_right_m.data(), banking,
                      int32_t(data.x_m.size()), data.closed, &wrong, &point);
  if (!built) throw io::Error(file, 0, describe_fault(wrong, point));
  return map;
}

CircuitMap read_circuit(const std::string& file) { return to_circuit(io::read_map(file), file); }

}  // namespace overtake::cli
