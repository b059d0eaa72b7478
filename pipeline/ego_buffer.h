// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses. One producer appends to a ring buffer. Each frame copies the last poses that were pushed before its last
// scan, so the frame's poses do not depend on when it is processed.
//
// A pose that is ahead of the expected next stamp waits until the next pose agrees, and then starts a run. So one wrong
// stamp costs no good pose. The consumer decides whether a run fits the sensors (EgoRange).
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "core/arena.h"
#include "pipeline/overtake.h"
#include "pipeline/shared_words.h"

namespace overtake {

struct EgoPose {
  int64_t stamp_ns = 0;
  double x_m = 0, y_m = 0, z_m = 0, roll_rad = 0, pitch_rad = 0, yaw_rad = 0, speed_mps = 0, yaw_rate_rps = 0;
  bool has_attitude = true;  // false: nothing measured roll and pitch (BankAttitude)
};

// Pose at one time, with T_map_vehicle as a matrix.
struct EgoState {
  EgoPose pose;
  double r[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  int64_t age_ns = 0;  // distance in time to the nearest known pose

  void to_map(double x, double y, double z, double& map_x, double& map_y) const noexcept {
    map_x = r[0] * x + r[1] * y + r[2] * z + pose.x_m;
    map_y = r[3] * x + r[4] * y + r[5] * z + pose.y_m;
  }
  double heading_to_map(double heading_rad) const noexcept;
  double heading_to_vehicle(double heading_rad) const noexcept;  // the inverse
};
EgoState state_of(const EgoPose& pose) noexcept;  // at the pose itself

// Whether the vehicle drives, forwards or back: so fast that its place and its scans change.
inline bool is_moving(const EgoPose& pose) noexcept {
  constexpr double kMoves_mps = 1.0;
  return std::fabs(pose.speed_mps) > kMoves_mps;
}

inline constexpr int64_t kEgoStepNs = 200'000'000;   // poses farther apart are not compared with each other
inline constexpr int64_t kEgoFreshNs = 100'000'000;  // older: EGO_STALE, no map gate
inline constexpr int64_t kEgoLostNs = 500'000'000;   // older: tracks only predict

// The poses that a frame may use, around its time, ascending stamps.
struct EgoWindow {
  static constexpr int32_t kCapacity = 256;
  int32_t count = 0;
  EgoPose poses[kCapacity];

  // Interpolates (linear; yaw along the shorter way) or extrapolates (constant speed and yaw rate). False if no pose is
  // known within oldest_ns of stamp_ns, before or after.
  bool at(int64_t stamp_ns, EgoState& out, int64_t oldest_ns = kEgoLostNs) const noexcept;
};

// The poses in the buffer when a scan was pushed: from `first` to before `count`.
struct EgoRange {
  int64_t first = 0, count = 0;
  int64_t refused = 0;  // poses refused because of their stamps so far
};

class EgoBuffer {
 public:
  // Throws std::bad_alloc without memory.
  explicit EgoBuffer(int32_t capacity, const Allocator& allocator = default_allocator());

  // Producer. OVT_DUPLICATE or OVT_LATE if the stamp does not grow. The third increasing stamp in a row that is more
  // than 0.5 s older, or lies in the step of the last run, means that the clock went back: the buffer forgets the
  // earlier poses. A pose that waits is OVT_OK, too.
  ovt_status push(const EgoPose& pose) noexcept;
  // Producer: number of waiting poses dropped since the last call.
  int32_t take_dropped() noexcept { return std::exchange(dropped_, 0); }
  EgoRange range() const noexcept;
  // Replay. Consumer: from now on it reads as if the producer had pushed so many poses, so that no result depends on
  // how far the producer is. Producer: it may push spare() more than the smallest number that the consumer may still
  // set.
  void set_horizon(int64_t count) noexcept { horizon_ = count; }
  int64_t spare() const noexcept { return capacity_ / 4 - 2; }  // a push may append the pose that waited, too
  // Consumer: the first pose of the range that will not be overwritten soon; the count if there is none.
  int64_t oldest_safe(const EgoRange& range) const noexcept;
  // Consumer: the pose with this index; false if the producer overwrote it meanwhile.
  bool read(int64_t index, EgoPose& pose) const noexcept;
  // Consumer: its stamp, and the index at which its run begins. Of a later pose if the producer overwrote it.
  int64_t stamp_at(int64_t index) const noexcept {
    return int64_t(ring_[index % capacity_].load_word(offsetof(Entry, pose) + offsetof(EgoPose, stamp_ns)));
  }
  int64_t run_at(int64_t index) const noexcept {
    return std::min(int64_t(ring_[index % capacity_].load_word(offsetof(Entry, run))), index);
  }
  // Consumer: index of the first pose of the first run after `run` in the range.
  int64_t first_run_after(const EgoRange& range, int64_t run) const noexcept;
  // Consumer: the steps of the stamps at the begins of these runs, in sum; INT64_MAX if one is no longer known.
  int64_t gaps_after(const EgoRange& range, int64_t run) const noexcept;
  // Consumer: copies the poses of the range from kReachNs before first_ns to kReachNs after last_ns, with one more on
  // each side. If they are too many, it copies the newest.
  void copy_window(const EgoRange& range, int64_t first_ns, int64_t last_ns, EgoWindow& window) const noexcept;
  static constexpr int64_t kReachNs = 100'000'000;

 private:
  struct Entry {
    EgoPose pose;
    int64_t run;
  };
  // Index of the oldest pose that the producer has not begun to overwrite.
  int64_t oldest_whole() const noexcept { return count_.load(std::memory_order_acquire) - capacity_ + 1; }
  int64_t rhythm_ns() const noexcept;
  void append(const EgoPose& pose, bool begins_run) noexcept;
  void drop_waiting() noexcept;

  Arena arena_;
  SharedWords<Entry>* ring_ = nullptr;
  int64_t capacity_;
  int64_t horizon_ = -1;  // the consumer's; -1: all that were pushed
  std::atomic<int64_t> count_{0};
  std::atomic<int64_t> first_{0};  // earlier poses belong to a clock before a jump
  std::atomic<int64_t> refused_{0};
  // written by the producer only
  int64_t last_stamp_ns_ = INT64_MIN;
  int64_t interval_ns_ = 0;  // between stamps; a longer one counts for a while; 0: unknown
  int64_t run_ = 0;
  int64_t run_from_ns_ = INT64_MIN, run_stamp_ns_ = INT64_MIN;  // the step to the run's first pose
  bool waits_ = false;
  EgoPose waiting_;
  int32_t dropped_ = 0;
  int32_t older_ = 0;  // older stamps in a row, as after a clock that went back
  int64_t older_ns_ = 0;
};

}  // namespace overtake
