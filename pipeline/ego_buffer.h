// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses: one producer appends to a ring; each frame takes a copy of the last ones that were pushed before its last
// scan, so that what a frame sees never depends on when it is worked on.
//
// A pose that steps ahead of the rhythm of those before it waits until the next one agrees, and then begins a run: one
// wrong stamp costs no good pose. Whether a run fits the sensors, who takes the windows says (EgoMark).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>

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
  int64_t refused = 0;  // poses whose stamps were not believed, so far
};

class EgoBuffer {
 public:
  // Throws std::bad_alloc when there is no memory.
  explicit EgoBuffer(int32_t capacity, const Allocator& allocator = default_allocator());

  // Producer. OVT_DUPLICATE or OVT_LATE when the stamp does not grow. The third in a row that grows, and is older by
  // more than 0.5 s, or lies in the step of the last run, is a clock that went back: the poses before it are forgotten.
  // OVT_OK for a pose that waits as well.
  ovt_status push(const EgoPose& pose) noexcept;
  // Producer: poses that waited in vain, since the last call.
  int32_t take_dropped() noexcept { return std::exchange(dropped_, 0); }
  EgoMark mark() const noexcept;
  // Consumer: the first pose of the mark that is not about to be overwritten; the count where there is none.
  int64_t oldest_safe(const EgoMark& mark) const noexcept;
  // Consumer: of the pose of this index, from there on. The run begins with the pose of index run_at().
  int64_t stamp_at(int64_t index) const noexcept { return ring_[index % capacity_].pose.stamp_ns; }
  int64_t run_at(int64_t index) const noexcept { return ring_[index % capacity_].run; }
  // Consumer: where the first of the marked runs behind `run` begins.
  int64_t first_run_after(const EgoMark& mark, int64_t run) const noexcept;
  // Consumer: of the marked poses those from kReachNs before first_ns to kReachNs after last_ns, with one more on
  // either side; the newest of them where they are too many.
  void copy_window(const EgoMark& mark, int64_t first_ns, int64_t last_ns, EgoWindow& window) const noexcept;
  static constexpr int64_t kReachNs = 100'000'000;

 private:
  struct Entry {
    EgoPose pose;
    int64_t run;
  };
  int64_t rhythm_ns() const noexcept;
  void append(const EgoPose& pose, bool begins_run) noexcept;
  void drop_waiting() noexcept;

  Arena arena_;
  Entry* ring_ = nullptr;
  int64_t capacity_;
  std::atomic<int64_t> count_{0};
  std::atomic<int64_t> first_{0};  // poses before it belong to a clock that is gone
  std::atomic<int64_t> refused_{0};
  // producer's
  int64_t last_stamp_ns_ = INT64_MIN;
  int64_t interval_ns_ = 0;  // of the stamps, the longer ones count for a while; 0: not known
  int64_t run_ = 0;
  int64_t run_from_ns_ = INT64_MIN, run_stamp_ns_ = INT64_MIN;  // the step to its first pose
  bool waits_ = false;
  EgoPose waiting_;
  int32_t dropped_ = 0;
  int32_t older_ = 0;  // stamps in a row that are older, as a clock that went back would have them
  int64_t older_ns_ = 0;
};

}  // namespace overtake
