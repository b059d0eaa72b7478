// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tests whether the lines of a cloud come from one spinning sensor at the cloud's own origin: then the elevation along
// a line is almost constant. Else it finds the places from which the lines were taken.
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

// The upper one of the two in the middle; 0 of none.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T();
  std::nth_element(values.begin(), values.begin() + int64_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class LineShapes {
 public:
  // Samples the points, of the first scans only. Needs x, y, z and layers as numbers.
  void add(const io::SensorScan& scan);

  // Medians over the lines: degrees from the 10 % lowest to the 10 % highest elevations along a line, and between two
  // lines. 0 where there are fewer than 8 lines of 50 points.
  struct Spread {
    double along_deg = 0, apart_deg = 0;
  };
  Spread spread() const;
  // Of a spinning sensor: a line varies by up to a degree (parallax of its lasers).
  bool one_sensor() const;

  // The place in the cloud's frame from which each line of a run of lines has a constant elevation.
  struct Source {
    int64_t first_line = 0, last_line = 0;
    double x_m = 0, y_m = 0, z_m = 0;
  };
  std::vector<Source> sources() const;  // one or two; empty where no place explains the lines

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
