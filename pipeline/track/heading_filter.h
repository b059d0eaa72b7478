// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Learns the error of the published ego heading from the walls of many frames (ego_heading.h). A linear model with a
// Kalman filter:
//
//   offset of sensor s = slip * acceleration across + lever * curvature + constant of s
//
// slip: a tyre's slip angle grows with its lateral force. lever: the course of a point differs from the vehicle's axis
// by the point's distance from the rear axle times the curvature. The constant contains the error of the localisation
// and of the sensor's mounting. Where no wall is seen, the model goes on.
//
//   measured walls, by stamp:   | base | w | w | w | w | w | w |          each with the state after it
//                                              ^ at(t): the last one before t - kLagNs
//
// A frame's offset depends on walls over 0.5 s older alone (pushed detections: by as much more as they may be ahead of
// the scans). A scan that is later than that is refused by the intake, so the offset of a frame is the same in every
// order of arrival.
#pragma once

#include "core/arena.h"
#include "core/sensor_model.h"
#include "pipeline/clock_watch.h"
#include "pipeline/ego_heading.h"

namespace overtake {

struct HeadingFilterParams {
  double slip_sigma = 0;          // rad per m/s^2
  double lever_sigma_m = 0;       // of the distance from the rear axle to the point whose course is published
  double constant_sigma_rad = 0;  // common to all sensors
  double mounting_sigma_rad = 0;  // of each sensor
  double wall_sigma_rad = 0;      // of the walls of one scan: errors of the map
  double wall_memory_s = 0;       // these errors are correlated for this long
};

// Replaces the yaw rates of the poses by the rates at which their course turns. A car turns in before its tyres have
// the slip angle that lets it follow: the course comes later, by the slip angle per m/s^2 times the speed.
void follow_course(const EgoWindow& in, EgoWindow& out) noexcept;

// What the model needs of a pose of follow_course.
struct HeadingCause {
  double accel_mps2 = 0;  // across, in the vehicle's plane, that the tyres make: without gravity's part; left positive
  double curvature_per_m = 0;
};
HeadingCause cause_of(const EgoPose& pose) noexcept;

class HeadingFilter {
 public:
  static constexpr int64_t kLagNs = kLateNs;
  static constexpr int32_t kCommon = 2, kSize = kCommon + kMaxSensors;
  static constexpr int32_t kMean = -1, kNoConstant = -2;  // instead of a sensor

  struct State {
    double x[kSize];                       // slip, lever, constants
    double p[kSize][kSize];                // covariance
    int64_t stamp_ns;                      // of the last walls; INT64_MIN: none
    int32_t contradicted;                  // walls in a row that contradicted the model
    int32_t contradicted_by[kMaxSensors];  // those of a sensor

    // Of one sensor, or kMean, or (the offset) kNoConstant.
    double offset_rad(const HeadingCause& cause, int32_t sensor, int32_t sensor_count) const noexcept;
    double variance(const HeadingCause& cause, int32_t sensor, int32_t sensor_count) const noexcept;
  };

  // Throws std::bad_alloc when the allocator has no memory. lead_ns: at() is asked for stamps that are up to so much
  // older than those of the frames that ask.
  HeadingFilter(const HeadingFilterParams& params, int32_t sensor_count,
                const Allocator& allocator = default_allocator(), int64_t lead_ns = 0);

  // The walls of a frame; walls[sensor_count]. Frames may come out of sequence. A frame that is kLagNs older than the
  // newest one changes nothing.
  void add(int64_t stamp_ns, const HeadingCause& cause, const WallHeading* walls) noexcept;
  // The state that a frame of this stamp uses.
  const State& at(int64_t stamp_ns) const noexcept;
  // Whether the model contradicts the walls. No walls: no.
  bool contradicts(const State& state, const HeadingCause& cause, const WallHeading* walls) const noexcept;
  // The clock jumped: keeps what it learned, forgets the stamps.
  void restart() noexcept;

  int32_t sensor_count() const noexcept { return sensor_count_; }

 private:
  // Frames with walls of kept_ns_, what late frames, their lead and their lag may need, at up to 256 a second and with
  // a lead of up to 0.25 s.
  static constexpr int32_t kCapacity = 320;
  struct Entry {
    int64_t stamp_ns;
    HeadingCause cause;
    WallHeading walls[kMaxSensors];
    State after;
  };
  State first_state() const noexcept;
  void open(State& state) const noexcept;
  void open_constant(State& state, int32_t sensor) const noexcept;
  void step(State& state, const Entry& entry) const noexcept;
  // Square of the innovation over the state's variance plus kGateNoise times the walls'; > kGate: contradicts.
  double measure(const State& state, const HeadingCause& cause, int32_t sensor, const WallHeading& wall,
                 double& innovation) const noexcept;

  const HeadingFilterParams params_;
  const int32_t sensor_count_;
  const int64_t kept_ns_;
  Arena arena_;
  State base_;  // before the oldest entry
  Entry* entries_ = nullptr;
  int32_t count_ = 0;
  int64_t newest_ns_ = INT64_MIN;
};

}  // namespace overtake
