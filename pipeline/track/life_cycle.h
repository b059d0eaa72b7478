// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// M/N life cycle of a track (paper IV-C) over the iterations that could have seen it. Its initiation is iteration 1, a
// hit.
//
//   hits of the last N     while age < N                               from age N on
//   reached M_c            confirmed                                   confirmed
//   ... and fell           stays confirmed (only silence ends it)      dead below M_e, else unchanged
//   never reached M_c      dead as soon as hits in all iterations      dead below M_e, else tentative: M_c hits within
//                          left until age N cannot reach M_c           any N iterations still confirm it
#pragma once

#include <bit>
#include <cstdint>

#include "core/track_table.h"

namespace overtake {

inline constexpr int32_t kMaxWindow = 64;

struct LifeCycleParams {
  int32_t window, confirm_hits, keep_hits;  // N in 1..kMaxWindow, M_c, M_e
};

struct LifeCycle {
  uint64_t history = 0;  // bit k: hit k iterations ago
  int32_t age = 0;       // number of iterations
  TrackState state = TrackState::kTentative;

  int32_t hits() const { return std::popcount(history); }

  // Records one iteration. False: the track is dead.
  bool record(bool hit, const LifeCycleParams& p) {
    const uint64_t window_mask = p.window >= kMaxWindow ? ~uint64_t(0) : (uint64_t(1) << p.window) - 1;
    history = (history << 1 | uint64_t(hit)) & window_mask;
    if (age < INT32_MAX) ++age;
    if (hits() >= p.confirm_hits) state = TrackState::kConfirmed;
    if (age >= p.window) return hits() >= p.keep_hits;
    return state == TrackState::kConfirmed || hits() + (p.window - age) >= p.confirm_hits;
  }
};

}  // namespace overtake
