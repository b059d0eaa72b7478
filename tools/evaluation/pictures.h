// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of single moments, as SVG (clouds and images are embedded pixels). snapshot_picker.h selects the moments.
#pragma once

#include <string>
#include <vector>

#include "tools/io/map_file.h"
#include "tools/io/rig.h"
#include "tools/view/views.h"

namespace overtake::evaluation {

struct PictureTime {
  int64_t frame = -1;
  double time_s = 0;  // since the first frame
  int64_t stamp_ns = 0;
};

// The images of one scan of one sensor during the segmentation.
struct StripMoment {
  PictureTime at;
  std::string sensor;
  double azimuth_left_deg = 60, azimuth_right_deg = -60;
  cli::DenseImage range, angle, smooth, repaired, labels;
  struct Point {
    float azimuth_rad, elevation_rad, range_m;
    int32_t label;  // as in ovt_labels
  };
  std::vector<Point> points;
  double car_m = 0;  // distance of the car in it
  int64_t car_points = 0;
};
std::string draw_strip(const StripMoment& moment);

// A rectangle seen from above, vehicle frame.
struct Outline {
  double x_m = 0, y_m = 0, heading_rad = 0, length_m = 0, width_m = 0;
};

// The clouds of all sensors, vehicle frame.
struct CloudMoment {
  PictureTime at;
  struct Point {
    float x_m, y_m, z_m, intensity;
    int32_t cluster;  // merged cluster, -1 ground or noise, -2 without a label
  };
  std::vector<Point> points;
  Outline car;                 // the true one
  std::string sensors;         // sensors that see the car
  std::vector<int64_t> parts;  // points of the car's cluster, per sensor
};
std::string draw_clouds(const CloudMoment& moment, const io::Rig& rig);

// A detection with both of its fits, vehicle frame.
struct FitMoment {
  PictureTime at;
  double slip_rad = 0;                          // true heading minus true course
  std::vector<std::pair<float, float>> points;  // x, y
  Outline truth, by_map, by_points;             // psi_REF, psi_VAR
  int64_t inside_map = 0, inside_points = 0;
  bool points_chosen = false;
};
std::string draw_fits(const std::vector<FitMoment>& moments, bool simulated = true);

// Sensors and fields of view from above; measures blind strips between neighbouring edges.
std::string draw_rig(const io::Rig& rig, double length_m, double width_m);

// The ego's path and the places of passes.
struct RacePath {
  struct Step {
    double time_s, x_m, y_m, ahead_m;  // of the ego; ahead_m: of one other car
  };
  std::vector<Step> steps;
  bool simulated = true;  // else recorded
};
std::string draw_race(const io::MapData& map, const RacePath& path);

}  // namespace overtake::evaluation
