// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tests whether the columns of a rig's image are as wide as the steps of the sensor from point to point of a line. Too
// narrow, every second column or more stays empty, and what hangs together falls apart; too wide, most points have no
// pixel of their own.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

class ColumnSteps {
 public:
  // Looks at the first scans only. Needs x, y and layers as numbers.
  void add(const io::SensorScan& scan);
  // Median step in azimuth between two neighbouring points of a line; 0: too few points.
  double median_deg() const;
  // The number of columns that these steps ask for, where the rig's columns are clearly of another width; else 0.
  int32_t find_other_cols(const io::RigSensor& model) const;

 private:
  std::vector<float> steps_deg_;
  int32_t scans_ = 0;
};

double column_deg(const io::RigSensor& model);  // width of a column

}  // namespace overtake::cli
