// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The height of the centre line and its cross slope along the circuit, learned from the ego poses: where the vehicle
// drove, it stood on the road. Belongs to the intake.
//
// Results must not depend on the order of arrival. A bin is used from kLag after the pose that completed it, by stamps:
// by then every pose up to that one has arrived, and a late scan still finds the value that was valid at its stamp,
// because a bin keeps its last two values, and renews them at most once a second. A step of the localisation is used at
// once, as the pose of the scan itself.
#pragma once

#include <cstdint>

#include "core/arena.h"
#include "core/circuit_map.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/road/driven_way.h"
#include "pipeline/road/road_data.h"

namespace overtake {

class HeightProfile {
 public:
  static constexpr double kBin_m = 5.0;
  static constexpr int64_t kLagNs = DrivenWay::kLagNs;

  // False without memory. The map must stay in memory; null: describes only the ego pose and the way behind it.
  [[nodiscard]] bool build(const CircuitMap* map, const Allocator& allocator);

  // Learns the poses of the range that are new, and describes the road around the ego pose at the stamp.
  void describe(const EgoBuffer& poses, const EgoRange& range, int64_t stamp_ns, RoadData& road) noexcept;
  // The clock jumped: what was learned stays and is valid at once.
  void restart() noexcept;

  int32_t bin_count() const noexcept { return count_; }

 private:
  struct Value {
    double height_m = 0, cross_slope = 0;
    int64_t from_ns = 0;  // valid for scans from this stamp on
    int32_t passes = 0;   // 0: no value
  };
  struct Bin {
    Value newest, before;
  };
  struct Place {
    double s_m, height_m, cross_slope;
    int64_t stamp_ns;
  };

  // A step of the localisation: from its stamp on, the poses are higher over the centre line by so much than before.
  struct Jump {
    int64_t stamp_ns;
    double rise_m;
  };

  struct Reading {
    bool known;
    double height_m, cross_slope;
    double earlier;  // share of values from an earlier lap
  };

  void learn(const EgoPose& pose) noexcept;
  void add(const Place& place) noexcept;
  void complete(int64_t stamp_ns) noexcept;
  int32_t bin_at(double s_m) const noexcept;  // -1 beyond the ends of an open line
  const Value& value_at(int32_t bin, int64_t stamp_ns) const noexcept;
  Reading read(double s_m, int64_t stamp_ns) const noexcept;
  bool is_jump(const EgoPose& pose) noexcept;
  void add_jump(const EgoState& ego, const Place& place) noexcept;
  double rise_since(const Value& value, int64_t stamp_ns) const noexcept;
  static void fill_stations(float height_m, float cross_slope, RoadData& road) noexcept;
  static void extend_stations(RoadData& road) noexcept;
  void expect_stations(RoadData& road) const noexcept;
  Place place_of(const EgoState& ego, const MapProjection& at) const noexcept;

  const CircuitMap* map_ = nullptr;
  Arena arena_;
  Bin* bins_ = nullptr;
  int32_t count_ = 0;
  int64_t learned_ = 0;  // poses of the buffer
  int32_t hint_ = -1, describe_hint_ = -1;
  bool has_last_ = false;
  Place last_{};
  // The bin that the vehicle is in.
  int32_t open_bin_ = -1, open_samples_ = 0;
  double open_height_m_ = 0, open_cross_slope_ = 0;
  // How far the poses of this lap are above those of the last one.
  bool has_drift_ = false;
  double drift_m_ = 0;
  // The last pose and, if known, the velocity over the step to it, from which a jump is seen.
  EgoPose last_pose_;
  bool has_velocity_ = false;
  int32_t jumps_in_a_row_ = 0;
  double velocity_x_ = 0, velocity_y_ = 0, velocity_z_ = 0;
  static constexpr int32_t kJumps = 8;
  Jump jumps_[kJumps] = {};  // the last ones
  int32_t jump_count_ = 0;   // of all
  EgoWindow window_;
  DrivenWay way_;
};

}  // namespace overtake
