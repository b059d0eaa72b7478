// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tests whether the lines of a cloud come from one spinning sensor at the cloud's own origin: then the elevation along
// a line is almost constant. Else it finds the positions of the sensors that took the lines.
//
//   one sensor, its own frame     two sensors, the vehicle's frame: the elevation of a line falls with the distance
//          o------- line 1          o-------         line 1, from here
//          |\------ line 2           o------         line 33, from there
//                                  + origin
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "tools/io/sensor_scan.h"

namespace overtake::cli {

// For an even number of values the upper one of the two in the middle; 0 without values.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T();
  std::nth_element(values.begin(), values.begin() + int64_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class LineShapes {
 public:
  // Samples points of the first scans only. Needs x, y, z and layers as numbers.
  void add(const io::SensorScan& scan);

  // Medians over the lines: degrees from the 10 % lowest to the 10 % highest elevations along a line, and between two
  // lines. 0 if there are fewer than 8 lines with at least 50 points.
  struct Spread {
    double along_deg = 0, apart_deg = 0;
  };
  Spread spread() const;
  // True for a spinning sensor: its lines vary by up to a degree (parallax of the lasers).
  bool one_sensor() const;

  // The place in the cloud's frame from which each line of a run of lines has a constant elevation.
  struct Source {
    int64_t first_line = 0, last_line = 0;
    double x_m = 0, y_m = 0, z_m = 0;
  };
  std::vector<Source> sources() const;  // one or two; empty if no place explains the lines

 private:
  struct Point {
    float x, y, z;
  };
  std::map<int64_t, std::vector<Point>> lines_;
  int32_t scans_ = 0;

  struct Cone;  // of a line: z = height + slope * distance
  static Cone fit_cone(const std::vector<Point>& line, double x_m, double y_m);
  double misfit(double x_m, double y_m) const;
};

}  // namespace overtake::cli
