// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/track_history.h"

#include <algorithm>

namespace overtake {

void TrackHistory::carve(Carver& carver, const TrackerParams& params, std::size_t state_bytes) {
  const auto tracks = std::size_t(params.track_capacity), rows = std::size_t(params.detection_capacity);
  capacity_ = params.history_iterations;
  span_s_ = params.history_s;
  iterations_ = carver.take<Iteration>(std::size_t(capacity_));
  order_ = carver.take<int32_t>(std::size_t(capacity_));
  for (int32_t i = 0; i < capacity_; ++i) {
    Iteration kept{};
    kept.measurement = carver.take<Measurement>(rows);
    kept.ego_distance_m2 = carver.take<double>(rows);
    for (int32_t** column : {&kept.row, &kept.slot, &kept.birth}) *column = carver.take<int32_t>(rows);
    for (TrackId** column : {&kept.track, &kept.track_before}) *column = carver.take<TrackId>(rows);
    kept.before.slot = carver.take<int32_t>(tracks);
    kept.before.head = carver.take<TrackHead>(tracks);
    kept.before.state = carver.take<std::byte>(tracks * state_bytes);
    if (!iterations_) continue;  // the carver only measures
    iterations_[i] = kept;
    order_[i] = i;
  }
}

int32_t TrackHistory::find_place(int64_t stamp_ns) const noexcept {
  if (count_ == 0) return 0;
  const int64_t newest_ns = at(count_ - 1).stamp_ns;
  if (stamp_ns >= newest_ns) return count_;
  if (seconds_between(stamp_ns, newest_ns) > span_s_) return -1;
  int32_t place = count_ - 1;
  while (place > 0 && at(place - 1).stamp_ns > stamp_ns) --place;
  const bool is_known = place > 0 || (reaches_back_ && count_ < capacity_);
  return is_known ? place : -1;
}

Iteration& TrackHistory::insert(int32_t& place) noexcept {
  int32_t free = count_;
  if (count_ == capacity_) {
    reaches_back_ = false;
    free = 0;
    if (place > 0) --place;
  } else {
    ++count_;
  }
  if (free < place)
    std::rotate(order_ + free, order_ + free + 1, order_ + place + 1);
  else
    std::rotate(order_ + place, order_ + free, order_ + free + 1);
  return at(place);
}

int64_t TrackHistory::work_from(int32_t place) const noexcept {
  int64_t work = 0;
  for (; place < count_; ++place) work += at(place).work;
  return work;
}

bool TrackHistory::limited_from(int32_t place) const noexcept {
  bool limited = false;
  for (; place < count_; ++place) limited |= at(place).limited;
  return limited;
}

void TrackHistory::clear() noexcept {
  reaches_back_ = reaches_back_ && count_ == 0;
  count_ = 0;
}

}  // namespace overtake
