// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Simulates a scenario with a seed, scan by scan.
#pragma once

#include <memory>
#include <string>

#include "tools/io/rig.h"
#include "tools/sim/scanner.h"

namespace overtake::sim {

struct SimFrame {              // the scans of all sensors that belong together
  int64_t begin_ns;            // true time
  int64_t stamp_ns[kSensors];  // of the sensor's clock
  std::vector<Scan> scans;     // by sensor
};

struct SurveyedMap {  // centre line in driving direction, closed
  std::vector<double> x_m, y_m, width_left_m, width_right_m, banking_rad;
};

class Simulator {
 public:
  // Throws std::invalid_argument if a plan exceeds what a car can do. seconds <= 0: the scenario's duration.
  Simulator(const Scenario& scenario, uint64_t seed, double seconds = 0, int32_t worker_count = 0);

  int32_t frame_count() const { return int32_t(begin_s_.size()); }
  double frame_begin_s(int32_t index) const { return begin_s_[std::size_t(index)]; }
  SimFrame frame(int32_t index);  // depends only on seed and index
  double seconds() const { return seconds_; }

  const Scenario& scenario() const { return scenario_; }
  const World& world() const { return *world_; }
  const io::Rig& rig() const { return rig_; }  // the nominal mounting, which the detector gets
  const Mounting& mounting(int32_t sensor) const { return mounting_[sensor]; }
  const Heads& heads(int32_t sensor) const { return heads_[sensor]; }
  int32_t worker_count() const { return workers_->count(); }
  std::vector<EgoPose> ego_poses() const;
  SurveyedMap map() const;

 private:
  Scenario scenario_;
  Random random_;
  double seconds_;
  std::unique_ptr<World> world_;
  std::unique_ptr<Workers> workers_;
  io::Rig rig_;
  Mounting mounting_[kSensors];
  Heads heads_[kSensors];
  OwnCarMask own_car_[kSensors];
  std::vector<double> begin_s_;
};

// Of a scenario's name or file; `ego` and `pattern`, unless empty, replace the scenario's. Throws io::Error.
std::unique_ptr<Simulator> make_simulator(const std::string& scenario, const std::string& ego,
                                          const std::string& pattern, uint64_t seed, double seconds,
                                          int32_t worker_count);

}  // namespace overtake::sim
