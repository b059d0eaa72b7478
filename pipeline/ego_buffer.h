// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses: one producer appends to a ring; each frame takes a copy of the last ones that were pushed before its last
// scan, so that what a frame sees never depends on when it is worked on.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "core/arena.h"
#include "pipeline/overtake.h"

namespace overtake {

struct EgoPose {
  int64_t stamp_ns = 0;
  double x_m = 0, y_m = 0, z_m = 0, roll_rad = 0, pitch_rad = 0, yaw_rad = 0, speed_mps = 0, yaw_rate_rps = 0;
};

// Pose at one time, with T_map_vehicle as a matrix.
struct EgoState {
  EgoPose pose;
  double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  int64_t age_ns = 0;  // how far from the nearest pose known

  void to_map(double x, double y, double z, double& map_x, double& map_y) const noexcept {
    map_x = r[0] * x + r[1] * y + r[2] * z + pose.x_m;
    map_y = r[3] * x + r[4] * y + r[5] * z + pose.y_m;
  }
  double heading_to_map(double heading_rad) const noexcept;
  double heading_to_vehicle(double heading_rad) const noexcept;  // the inverse
};

inline constexpr int64_t kEgoFreshNs = 100'000'000;  // older: EGO_STALE, no map gate
inline constexpr int64_t kEgoLostNs = 500'000'000;   // older: tracks only predict

// The poses a frame may use, those round its time, ascending stamps.
struct EgoWindow {
  static constexpr int32_t kCapacity = 256;
  int32_t count = 0;
  EgoPose poses[kCapacity];

  // Interpolates (linear, the yaw the short way round) or extrapolates (constant speed and yaw rate). False when no
  // pose is known within kEgoLostNs of stamp_ns, before or after.
  bool at(int64_t stamp_ns, EgoState& out) const noexcept;
};

// Which poses a scan found when it was pushed: those from `first` to before `count`.
struct EgoMark {
  int64_t first = 0, count = 0;
};

class EgoBuffer {
 public:
  // Throws std::bad_alloc when there is no memory.
  explicit EgoBuffer(int32_t capacity, const Allocator& allocator = default_allocator());

  // Producer. OVT_DUPLICATE or OVT_LATE when the stamp does not grow. The third in a row that is older by more than
  // 0.5 s, and grows, is a clock that went back: the poses before it are forgotten.
  ovt_status push(const EgoPose& pose) noexcept;
  EgoMark mark() const noexcept;
  // Consumer: of the marked poses those from kReachNs before first_ns to kReachNs after last_ns, with one more on
  // either side; the newest of them where they are too many.
  void copy_window(const EgoMark& mark, int64_t first_ns, int64_t last_ns, EgoWindow& window) const noexcept;
  static constexpr int64_t kReachNs = 100'000'000;

 private:
  Arena arena_;
  EgoPose* ring_ = nullptr;
  int64_t capacity_;
  std::atomic<int64_t> count_{0};
  std::atomic<int64_t> first_{0};  // poses before it belong to a clock that is gone
  // producer's
  int64_t last_stamp_ns_ = INT64_MIN;
  int32_t older_ = 0;  // stamps in a row that are much older
  int64_t older_ns_ = 0;
};

}  // namespace overtake
