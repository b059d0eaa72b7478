// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which gaps of the sensors' views last. What lies behind them is not seen: a car that is lost there is no miss.
#pragma once

#include <cstdint>

#include "pipeline/frame.h"

namespace overtake {

class GapWatch {
 public:
  // The scans of a frame.   reads  gaps, sensors   writes  blocked
  // A scan changes nothing if it is not newer than the sensor's last one, incomplete, or shows too little ground to
  // tell (ViewGaps::known).
  void follow(const SensorModel* sensors, int32_t sensor_count, Frame& frame) noexcept;
  void restart() noexcept;

 private:
  static constexpr int32_t kParts = 1024;  // of a view; of fewer columns, one each

  struct Sensor {
    int64_t stamp_ns = INT64_MIN;  // of its last scan
    bool has_gaps = false;         // in its last scan
    int64_t since_ns[kParts];      // stamp of the first scan of a row of them without a return in this part
    ViewGaps lasting;
  };
  void follow(const SensorModel& sensor, const ViewGaps& gaps, int64_t stamp_ns, Sensor& state) const noexcept;

  Sensor sensor_[kMaxSensors];
};

}  // namespace overtake
