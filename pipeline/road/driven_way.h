// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the ego vehicle drove, it stood on the road: its last 100 m tell the road behind it without a map. Belongs to
// the intake.
#pragma once

#include <cstdint>

#include "pipeline/ego_buffer.h"
#include "pipeline/road/road_data.h"

namespace overtake {

class DrivenWay {
 public:
  static constexpr double kStep_m = 4.0;  // from one place to the next, at least
  static constexpr int64_t kLagNs = 200'000'000;

  // Poses come by rising stamps. After a step of the localisation, or a second without a pose, a new way begins.
  void add(const EgoPose& pose) noexcept;
  // Writes the way behind the ego pose of `road`, at a scan's stamp. Only places that are kLagNs older: by then every
  // pose up to them has arrived, so the order of arrival has no effect. A way that begins later has no place yet.
  void describe(int64_t stamp_ns, RoadData& road) const noexcept;
  void clear() noexcept { count_ = 0, has_last_ = false; }

 private:
  struct Place {
    double x_m, y_m, z_m;
    double left[3];  // the vehicle's y axis, in the map
    int64_t stamp_ns;
    bool begins;  // a way
  };
  static constexpr int64_t kPlaces = 64;  // more than a way has: a late scan still finds its own
  static_assert(kPlaces >= 2 * RoadData::kWay);

  Place places_[kPlaces];  // place i at i % kPlaces
  int64_t count_ = 0;      // of all
  EgoPose last_;
  bool has_last_ = false;
};

}  // namespace overtake
