// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/overtake.h"

namespace overtake::ros2 {

// Topics track_0 to track_7 with odometry and path: a confirmed track keeps the lowest number that was free.
inline constexpr int32_t kTrackTopics = 8;

class TrackNumbers {
 public:
  // Gives numbers to the confirmed tracks; -1: none is free, or not confirmed.
  std::vector<int32_t> assign(const ovt_tracks& tracks);
  bool was_used(int32_t number) const { return was_used_[std::size_t(number)]; }  // before the last assign
  bool is_used(int32_t number) const { return ids_[std::size_t(number)] != 0; }

 private:
  std::array<uint64_t, kTrackTopics> ids_{};  // 0: free
  std::array<bool, kTrackTopics> was_used_{};
};

}  // namespace overtake::ros2
