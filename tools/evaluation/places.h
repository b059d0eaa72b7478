// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Positions in the vehicle, map and sensor frames of the truth.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/evaluation/truth_log.h"
#include "tools/io/mounting.h"

namespace overtake::evaluation {

inline constexpr double kMovingMps = 3;  // faster: the course, and so slip and rate of the course, mean something
inline constexpr double kCarLengthM = 4.921, kCarWidthM = 1.886;

struct MapPlace {
  double x_m, y_m, heading_rad;
};
// Transforms a position and a heading from the vehicle's frame to the map.
MapPlace to_map(const io::EgoRow& pose, double x_m, double y_m, double z_m, double heading_rad);
// The inverse for the heading.
double heading_from_map(double roll_rad, double pitch_rad, double yaw_rad, double heading_rad);
// The heading as the library transforms psi_REF to the vehicle: the level direction seen from the vehicle. On a banked
// track it differs from heading_from_map.
double heading_in_vehicle(double roll_rad, double pitch_rad, double yaw_rad, double heading_rad);

// Published poses: linear between two of them, beyond the ends on the arc of the nearest one's speed and yaw rate.
io::EgoRow pose_at(const std::vector<PublishedPose>& poses, int64_t stamp_ns);

const CarTruth* ego_of(const std::vector<CarTruth>& cars);  // null: none
io::EgoRow true_pose(const CarTruth& ego, int64_t stamp_ns);

// The mean acceleration of a car between two times that are this far apart; NaN if one of them does not have the car.
double mean_acceleration(int32_t car, const std::vector<CarTruth>& before, const std::vector<CarTruth>& after,
                         double seconds);
// The same for the course: its mean rate.
double mean_course_rate(int32_t car, const std::vector<CarTruth>& before, const std::vector<CarTruth>& after,
                        double seconds);
// Error of a track's state at a car: x, y, speed, course, and rate of the course, which is what yaw_rate_rps of a track
// is. NaN: the rate at a car that is not faster than kMovingMps.
std::array<double, 5> state_error(const ovt_tracks& tracks, int32_t row, const CarTruth& car, double course_rate_rps);

// A map position seen from a car's frame (x forward, y left), with its full attitude.
struct Seen {
  double ahead_m, left_m;
};
Seen see(const CarTruth& from, double x_m, double y_m, double z_m);

// The nearest car within the gate, without the ego: its row in `cars`, -1 none.
int32_t nearest_car(const std::vector<CarTruth>& cars, double x_m, double y_m);

// The rectangle of a car in another car's frame.
struct CarPlace {
  int32_t car = 0;
  double ahead_m = 0, left_m = 0, cos_turn = 1, sin_turn = 0;
  // Whether the point is in the rectangle enlarged by margin_m on each side.
  bool holds(double x_m, double y_m, double margin_m) const;
};
// All cars except the ego, seen from the ego. Empty without ego.
std::vector<CarPlace> place_cars(const std::vector<CarTruth>& cars);

}  // namespace overtake::evaluation
