// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/track_numbers.h"

#include <algorithm>

namespace overtake::ros2 {

std::vector<int32_t> TrackNumbers::assign(const ovt_tracks& tracks) {
  for (std::size_t n = 0; n < ids_.size(); ++n) was_used_[n] = ids_[n] != 0;
  const auto confirmed = [&](int32_t i) { return tracks.state[i] == OVT_CONFIRMED; };
  std::array<bool, kTrackTopics> alive{};
  std::vector<int32_t> numbers(std::size_t(tracks.count), -1);
  for (int32_t i = 0; i < tracks.count; ++i) {
    const auto known = std::find(ids_.begin(), ids_.end(), tracks.id[i]);
    if (!confirmed(i) || known == ids_.end()) continue;
    alive[std::size_t(known - ids_.begin())] = true;
    numbers[std::size_t(i)] = int32_t(known - ids_.begin());
  }
  for (std::size_t n = 0; n < ids_.size(); ++n)
    if (!alive[n]) ids_[n] = 0;
  for (int32_t i = 0; i < tracks.count; ++i) {
    if (!confirmed(i) || numbers[std::size_t(i)] >= 0) continue;
    const auto free = std::find(ids_.begin(), ids_.end(), uint64_t(0));
    if (free == ids_.end()) break;
    *free = tracks.id[i];
    numbers[std::size_t(i)] = int32_t(free - ids_.begin());
  }
  return numbers;
}

}  // namespace overtake::ros2
