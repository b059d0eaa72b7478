// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One track for one car: which tracks of LanePolicy are the same car, what two of them become, and which detections are
// a part of a known car.
#include <algorithm>
#include <cmath>

#include "pipeline/track/lane_tracker.h"

namespace overtake {
namespace {

constexpr double kRecent_s = 0.3;                             // a track was seen lately
constexpr double kSameTentative = 0.9, kSameConfirmed = 0.7;  // share of a car's length and width
// A lost car comes back this near to its prediction, after t: base + t (rate + t growth), but no farther than most.
constexpr double kAgainAlong_m = 6.0, kAgainAlongRate = 4.0, kAgainAlongGrowth = 5.0, kAgainMost_m = 40.0;
constexpr double kAgainAcross_m = 3.0, kAgainAcrossRate = 1.5, kAgainSpeed_mps = 8.0, kAgainSpeedRate = 8.0;

}  // namespace

// Whether two slots can be at one place at all: cheaper than is_same_place(), which decides.
bool LanePolicy::is_near(int32_t a, int32_t b) const noexcept {
  const double dx = x_m_[a] - x_m_[b], dy = y_m_[a] - y_m_[b];
  return dx * dx + dy * dy <= lane_.length_m * lane_.length_m + lane_.width_m * lane_.width_m;
}

// Whether a place is the slot's car, within a share of its length and width.
bool LanePolicy::is_same_place(int32_t slot, double x_m, double y_m, double share) const noexcept {
  const double dx = x_m - x_m_[slot], dy = y_m - y_m_[slot];
  return std::fabs(axis_cos_[slot] * dx + axis_sin_[slot] * dy) < share * lane_.length_m &&
         std::fabs(axis_cos_[slot] * dy - axis_sin_[slot] * dx) < share * lane_.width_m;
}

// Whether the car of a lost track can be the one that was found: by the way along the lane, the offset across it, and
// the speeds.
bool LanePolicy::may_come_from(const State& lost, int32_t lost_slot, const State& found, int32_t slot,
                               double& distance_m) const noexcept {
  const double dx = x_m_[slot] - x_m_[lost_slot], dy = y_m_[slot] - y_m_[lost_slot];
  double along_m = std::fabs(cos_[lost_slot] * dx + sin_[lost_slot] * dy);
  double across_m = std::fabs(cos_[lost_slot] * dy - sin_[lost_slot] * dx);
  if (map_ && found.asks_map) {
    const MapProjection here = map_->project(x_m_[slot], y_m_[slot], found.segment);
    const MapProjection there = map_->project(x_m_[lost_slot], y_m_[lost_slot], lost.segment);
    if (here.segment >= 0 && there.segment >= 0) {
      along_m = std::fabs(here.s_m - there.s_m);
      if (map_->closed()) along_m = std::min(along_m, map_->length_m() - along_m);
      across_m = std::fabs(here.d_m - there.d_m);
    }
  }
  const double t = lost.unseen_s;
  distance_m = along_m;
  return along_m < std::min(kAgainMost_m, kAgainAlong_m + t * (kAgainAlongRate + t * kAgainAlongGrowth)) &&
         across_m < kAgainAcross_m + t * kAgainAcrossRate &&
         std::fabs(found.estimate.mean.speed_mps - lost.estimate.mean.speed_mps) <
             kAgainSpeed_mps + t * kAgainSpeedRate;
}

// An older track of the same car: one at the same place, or, for a track that was just confirmed, one that was not seen
// lately and whose car may have come here. The nearest one, of equals the lower slot.
int32_t LanePolicy::find_elder(const TrackView<State>& tracks, int32_t slot) const noexcept {
  const State& s = tracks.state[slot];
  int32_t best = -1;
  double best_m = 0;
  for (int32_t other = 0; other < tracks.slot_count; ++other) {
    if (other == slot || !tracks.head[other].alive) continue;
    if (!s.is_new && !is_near(slot, other)) continue;
    const State& o = tracks.state[other];
    if (o.age < s.age || (o.age == s.age && other > slot)) continue;
    if (o.stage == LaneStage::kTentative && s.stage != LaneStage::kTentative) continue;
    double distance_m = 0;
    if (o.stage == LaneStage::kTentative || (o.stage == LaneStage::kConfirmed && o.unseen_s <= kRecent_s)) {
      const double share = s.stage == LaneStage::kConfirmed ? kSameConfirmed : kSameTentative;
      if (!is_same_place(other, x_m_[slot], y_m_[slot], share)) continue;
    } else if (!s.is_new || !may_come_from(o, other, s, slot, distance_m)) {
      continue;
    }
    if (best < 0 || distance_m < best_m) best = other, best_m = distance_m;
  }
  return best;
}

// The elder keeps what it is, and goes on with the younger one's estimate if it was not seen lately itself.
LaneTrack LanePolicy::join(const State& elder, const State& younger, bool younger_is_newer) const noexcept {
  State s = elder;
  if (younger_is_newer && elder.unseen_s > kRecent_s) {
    s = younger;
    s.age = elder.age;
    s.hits = int32_t(std::min(int64_t(elder.hits) + younger.hits, int64_t(INT32_MAX)));
    s.history = elder.history | younger.history;
    s.score = std::max(elder.score, younger.score);
  }
  if (younger_is_newer) s.visibility = younger.visibility;
  s.class_votes = limit_votes(elder.class_votes + younger.class_votes);
  if (is_confirmed(elder) || is_confirmed(younger)) s.stage = LaneStage::kConfirmed;
  s.is_new = 0;
  return s;
}

// A detection beside the one that updated a car's track, and within the car: a part of it.
int32_t LanePolicy::find_owner(const TrackView<State>& tracks, const Iteration& it, int32_t i) const noexcept {
  const Measurement& z = it.measurement[i];
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
    if (!tracks.head[slot].alive || !is_confirmed(tracks.state[slot]) || tracks.state[slot].unseen_s > kRecent_s)
      continue;
    const double way_m = tracks.state[slot].estimate.mean.speed_mps * seconds_between(z.stamp_ns, it.stamp_ns);
    if (is_same_place(slot, z.x_m + way_m * cos_[slot], z.y_m + way_m * sin_[slot], kSameTentative)) return slot;
  }
  return -1;
}

}  // namespace overtake
