// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// CVTR motion (motion_model.h) of a car that follows a lane: its yaw rate goes to that of the lane at its speed,
//
//   d omega / dt = (kappa v - omega) / tau
//
// with the lane's curvature kappa at the car's distance from the centre line. Without a lane, CVTR. The course of a car
// that is not seen goes to the lane's heading as well, after each step. Process noise is along and across the course: a
// car slides across its course far less than it brakes. The acceleration along the course decays (Singer 1970),
//
//   d a / dt = -a / tau_a + white noise,   d v / dt = a + white noise
#pragma once

#include "pipeline/track/track_filter.h"

namespace overtake {

struct LanePull {
  double curvature_per_m = 0;
  double time_s = 0;       // tau; 0: no lane
  double heading_rad = 0;  // of the lane, where the step begins
  double course_s = 0;     // time constant of the course; 0: it goes on as it is
};

// The acceleration is a sixth element beside the filter's five, which are published. Within one step it does not turn
// the car.
struct LaneEstimate : TrackEstimate {
  double accel_mps2 = 0, accel_var = 0;
  double accel_cov[kTrackStateSize] = {};  // with x, y, v, phi, omega
};
void forget_acceleration(LaneEstimate& estimate) noexcept;
// An acceleration of this deviation may have begun since_s ago: it adds to the covariance of place, speed and
// acceleration what it has done since.
void begin_acceleration(LaneEstimate& estimate, double sigma_mps2, double since_s) noexcept;

// Growth of the variances per second.
struct CourseNoise {
  double along = 0, across = 0, speed = 0, course = 0, yaw_rate = 0, accel = 0;
  double accel_s = 0;  // tau_a; 0: the acceleration stays what it is, and does not change the speed
};

// One step of at most about 0.1 s. A step back (dt_s < 0) is CVTR and adds no noise: the inverse of the lane's pull
// would blow up any difference from the lane.
MotionState advance_on_lane(const MotionState& state, const LanePull& lane, double dt_s) noexcept;
void predict_on_lane(LaneEstimate& estimate, const LanePull& lane, const CourseNoise& noise, double dt_s) noexcept;
// The lane at the end of a step from that speed on, with which the next step begins.
LanePull lane_after(const LanePull& lane, double speed_mps, double dt_s) noexcept;

// Where no map tells the course of a new track, it goes as the ego vehicle does, or stays where it is, and its place
// spreads to all sides alike until the second measurement.
void spread(TrackEstimate& estimate, double from_s, double to_s) noexcept;

// update() of track_filter.h, and of the acceleration. False, nothing changed, when S is not positive definite.
bool update_on_lane(LaneEstimate& estimate, const Measurement& z) noexcept;

}  // namespace overtake
