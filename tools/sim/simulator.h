// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A scenario with a seed, scan after scan.
#pragma once

#include <memory>

#include "tools/io/rig.h"
#include "tools/sim/scanner.h"

namespace overtake::sim {

struct Sweep {                 // the scans of all sensors that belong together
  int64_t begin_ns;            // true time
  int64_t stamp_ns[kSensors];  // as the sensor's clock says
  std::vector<Scan> scans;     // by sensor
};

struct SurveyedMap {  // centre line in driving direction, closed
  std::vector<double> x_m, y_m, width_left_m, width_right_m, banking_rad;
};

class Simulator {
 public:
  // Throws std::invalid_argument where a plan asks for more than a car can. seconds <= 0: as the scenario says.
  Simulator(const Scenario& scenario, uint64_t seed, double seconds = 0, int32_t worker_count = 0);

  int32_t sweep_count() const { return int32_t(begin_s_.size()); }
  double sweep_begin_s(int32_t index) const { return begin_s_[std::size_t(index)]; }
  Sweep sweep(int32_t index);  // depends on seed and index alone
  double seconds() const { return seconds_; }

  const Scenario& scenario() const { return scenario_; }
  const World& world() const { return *world_; }
  const io::Rig& rig() const { return rig_; }  // the nominal mounting: what a pipeline is told
  const Mounting& mounting(int32_t sensor) const { return mounting_[sensor]; }
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
  OwnCarMask own_car_[kSensors];
  std::vector<double> begin_s_;
};

}  // namespace overtake::sim
