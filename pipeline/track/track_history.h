// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's last iterations: what each was given, and the tracks before it, so that an older frame can be put in
// its place in time and what came after it run again.
//
//   oldest                                            newest
//   | tracks 0 | input 0 | tracks 1 | input 1 | ... | input n | -> the tracks as they are
//                                  ^ an older frame goes here: back to tracks 2, its input, input 2, input 3, ...
#pragma once

#include "pipeline/track/iteration.h"

namespace overtake {

class TrackHistory {
 public:
  void carve(Carver& carver, const TrackerParams& params, std::size_t state_bytes);
  // Where a frame of this stamp goes: among the iterations, after those of equal stamp; count() when it is the newest.
  // -1: late.
  int32_t find_place(int64_t stamp_ns) const noexcept;
  // Makes room there, and says where it is then: the oldest iteration is forgotten when the history is full.
  Iteration& insert(int32_t& place) noexcept;
  // Forgets everything; nothing may come before the next iteration.
  void clear() noexcept;

  // Steps that the iterations from `place` on took when they ran last, and whether one of them was cut short.
  int64_t work_from(int32_t place) const noexcept;
  bool limited_from(int32_t place) const noexcept;

  int32_t count() const noexcept { return count_; }
  Iteration& at(int32_t place) noexcept { return iterations_[order_[place]]; }
  const Iteration& at(int32_t place) const noexcept { return iterations_[order_[place]]; }

 private:
  int32_t count_ = 0, capacity_ = 0;
  double span_s_ = 0;
  bool reaches_back_ = true;  // whether what came before the oldest is known: nothing did
  Iteration* iterations_ = nullptr;
  int32_t* order_ = nullptr;  // by time -> in iterations_; those of no use follow
};

}  // namespace overtake
