// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's last iterations: the input of each, and the tracks before it. So the tracker can insert an older frame
// at its stamp and run all later iterations again.
//
//   oldest                                            newest
//   | tracks 0 | input 0 | tracks 1 | input 1 | ... | input n | -> current tracks
//                                  ^ an older frame goes here: restore tracks 2, run its input, input 2, ...
#pragma once

#include "pipeline/track/iteration.h"

namespace overtake {

class TrackHistory {
 public:
  void carve(Carver& carver, const TrackerParams& params, std::size_t state_bytes);
  // Place of a frame of this stamp among the iterations, after those of equal stamp; count() when it is the newest. -1:
  // late.
  int32_t find_place(int64_t stamp_ns) const noexcept;
  // Makes room at `place`. A full history drops its oldest iteration and updates `place`.
  Iteration& insert(int32_t& place) noexcept;
  // Drops all iterations; a frame older than the next iteration will be late, unless there was no iteration yet.
  void clear() noexcept;

  // Steps that the iterations from `place` on took in their last runs, and whether the work limit shortened one of
  // them.
  int64_t work_from(int32_t place) const noexcept;
  bool limited_from(int32_t place) const noexcept;

  int32_t count() const noexcept { return count_; }
  Iteration& at(int32_t place) noexcept { return iterations_[order_[place]]; }
  const Iteration& at(int32_t place) const noexcept { return iterations_[order_[place]]; }

 private:
  int32_t count_ = 0, capacity_ = 0;
  double span_s_ = 0;
  bool reaches_back_ = true;  // the history dropped no iteration before the oldest
  Iteration* iterations_ = nullptr;
  int32_t* order_ = nullptr;  // by time -> index in iterations_; unused ones follow
};

}  // namespace overtake
