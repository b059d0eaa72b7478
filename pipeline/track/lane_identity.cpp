// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One track for one car: which tracks of LanePolicy are the same car, what two of them become, and which detections are
// a part of a known car.
#include <algorithm>
#include <bit>
#include <cmath>

#include "core/math.h"
#include "pipeline/track/lane_tracker.h"

namespace overtake {
namespace {

constexpr double kRecent_s = 0.3;  // a track was seen lately
// A track that misses for longer has no parts: its car may have left it. After a jump of the ego pose it has not.
constexpr double kOwns_s = 0.02, kOwnsAfterJump_s = 0.21, kAfterJump_s = 0.3;
constexpr int32_t kYoung = 20, kBothSeen = 3, kBetween = 8;  // iterations; in the second so many a car hit two of its
                                                             // tracks, in the third so many none of them
constexpr double kTakenOver_s = 0.12, kTakenOver_m = 6.0, kTakenOver_mps = 10.0;
constexpr int32_t kLooks = 16;                                // iterations before the last hit
constexpr double kSameTentative = 0.9, kSameConfirmed = 0.7;  // share of a car's length and width
constexpr int32_t kTwoCars = 20;                              // hits of both of two tracks
constexpr double kApartSigmas2 = 9.0;  // of the difference of two velocities, over its variance: two cars
constexpr double kSameSigmas = 1.5;    // of the offset of two tracks that are both seen
// A lost car comes back this near to its prediction, after t: base + t (rate + t growth), but no farther than most.
constexpr double kAgainAlong_m = 6.0, kAgainAlongRate = 4.0, kAgainAlongGrowth = 5.0, kAgainMost_m = 40.0;
constexpr double kAgainAcross_m = 3.0, kAgainAcrossRate = 1.5, kAgainSpeed_mps = 8.0, kAgainSpeedRate = 8.0;
constexpr double kAgainSpeedSigmas = 2.0;

// How far (dx, dy) goes along a heading and across it.
struct Axes {
  explicit Axes(double heading_rad) { sin_cos_f64(heading_rad, sine, cosine); }
  double along(double dx, double dy) const { return std::fabs(cosine * dx + sine * dy); }
  double across(double dx, double dy) const { return std::fabs(cosine * dy - sine * dx); }
  double sine, cosine;
};

// A place that moves with a car, after dt_s. Most rows have the iteration's stamp.
Place straight_on(Place from, const MotionState& m, double dt_s) {
  const double way_m = m.speed_mps * dt_s;
  if (way_m == 0.0) return from;
  double sine, cosine;
  sin_cos_f64(m.course_rad, sine, cosine);
  return {from.x_m + way_m * cosine, from.y_m + way_m * sine};
}

// Whether the car was never missing for as long as it is now, in the iterations before its last hit. (Each push of rows
// is an iteration, too, so the share of the hits tells nothing.)
bool is_longest_gap(const LaneTrack& s) {
  const int32_t missing = std::countr_zero(s.history), first = missing + 1, last = std::min(first + kLooks, s.age);
  int32_t gap = 0;
  for (int32_t k = first; k < std::min(last, 64); ++k) {
    gap = s.history >> k & 1 ? 0 : gap + 1;
    if (gap >= missing) return false;
  }
  return true;
}

}  // namespace

// The tracks at the iteration's stamp.
void LanePolicy::find_places(const TrackView<State>& tracks, const Iteration& it) noexcept {
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot)
    if (tracks.head[slot].alive)
      place_[slot] = straight_on(place(tracks.state[slot]), tracks.state[slot].estimate.mean,
                                 seconds_between(tracks.head[slot].state_ns, it.stamp_ns));
}

void LanePolicy::look_round(const TrackView<State>& tracks, const Iteration& it) noexcept {
  find_places(tracks, it);
  grid_.clear();
  owner_count_ = 0;
  const double owns_s = it.since_ego_jump_s < kAfterJump_s ? kOwnsAfterJump_s : kOwns_s;
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
    if (!tracks.head[slot].alive) continue;
    grid_.add(slot, place_[slot]);
    const State& s = tracks.state[slot];
    if (is_confirmed(s) && s.uncorrected_s <= owns_s) owners_[owner_count_++] = slot;
  }
}

// Whether `other` lies within a share of the length and width of the car of `s` that is at `place`.
bool LanePolicy::is_same_place(const State& s, Place place, Place other, double share) const noexcept {
  const double dx = other.x_m - place.x_m, dy = other.y_m - place.y_m;
  if (dx * dx + dy * dy > lane_.length_m * lane_.length_m + lane_.width_m * lane_.width_m) return false;
  const Axes axes(s.heading_rad);
  return axes.along(dx, dy) < share * lane_.length_m && axes.across(dx, dy) < share * lane_.width_m;
}

// Whether the car of a lost track can be the one that was found: by the way along the lane, the offset across it, and
// the speeds.
bool LanePolicy::may_come_from(const State& lost, int32_t lost_slot, const State& found, int32_t slot,
                               double& distance_m) const noexcept {
  const Place at = place_[slot], from = place_[lost_slot];
  const double dx = at.x_m - from.x_m, dy = at.y_m - from.y_m;
  const Axes axes(lost.estimate.mean.course_rad);
  double along_m = axes.along(dx, dy), across_m = axes.across(dx, dy);
  if (map_ && found.asks_map) {
    const MapProjection here = map_->project(at.x_m, at.y_m, found.segment);
    const MapProjection there = map_->project(from.x_m, from.y_m, lost.segment);
    if (map_->is_beside(here) && map_->is_beside(there)) {
      along_m = std::fabs(here.s_m - there.s_m);
      if (map_->closed()) along_m = std::min(along_m, map_->length_m() - along_m);
      across_m = std::fabs(here.d_m - there.d_m);
    }
  }
  const double t = lost.uncorrected_s;
  distance_m = hypot_f64(along_m, across_m);
  const double speed_sigma = std::sqrt(found.estimate.covariance[2][2] + lost.estimate.covariance[2][2]);
  return along_m < std::min(kAgainMost_m, kAgainAlong_m + t * (kAgainAlongRate + t * kAgainAlongGrowth)) &&
         across_m < kAgainAcross_m + t * kAgainAcrossRate &&
         std::fabs(found.estimate.mean.speed_mps - lost.estimate.mean.speed_mps) <
             kAgainSpeed_mps + t * kAgainSpeedRate + kAgainSpeedSigmas * speed_sigma;
}

// A car that changes its motion abruptly leaves its track: the track that found it began about when the old one, whose
// car should be seen, had its last hit. (Two cars would have been seen at the same time.) The old track's speed and
// course may be anything then. Not of pushed rows, which have no votes: many are traffic, where the next car is near.
bool LanePolicy::took_over(const State& found, int32_t slot, const State& lost, int32_t lost_slot) const noexcept {
  const double reach_m = kTakenOver_m + kTakenOver_mps * lost.uncorrected_s;
  const int32_t between = std::countr_zero(lost.history) - found.age;
  return found.stage == LaneStage::kConfirmed && found.class_votes > 0 && found.age <= kYoung &&
         lost.visibility == Visibility::kMissed && lost.uncorrected_s > kTakenOver_s && between >= -kBothSeen &&
         between <= kBetween && is_longest_gap(lost) &&
         distance_m2(place_[slot], place_[lost_slot]) < reach_m * reach_m;
}

// Two cars that pass each other closely: their velocities differ. (Two parts of one car have the same.) `variance` is
// an upper limit in any direction.
bool LanePolicy::pass_each_other(const State& a, const State& b) const noexcept {
  double dx = 0, dy = 0, variance = 0, sign = 1;
  for (const LaneEstimate* e : {&a.estimate, &b.estimate}) {
    const double v = e->mean.speed_mps;
    double sine, cosine;
    sin_cos_f64(e->mean.course_rad, sine, cosine);
    dx += sign * v * cosine, dy += sign * v * sine, sign = -1;
    variance += e->covariance[2][2] + v * v * e->covariance[3][3];
  }
  return dx * dx + dy * dy > kApartSigmas2 * variance;
}

// Whether two confirmed tracks at one place are one car's. If both are seen in this iteration, their offset is within
// the car also where it is kSameSigmas larger: two cars side by side are hardly farther apart than two parts of one.
bool LanePolicy::is_one_car(const State& elder, Place elder_place, const State& s, Place place) const noexcept {
  if (pass_each_other(s, elder)) return false;
  // Two tracks of one car become one while both are seen. Each hit so often, they are two cars, in one detection now.
  if (s.visibility != Visibility::kSeen || elder.visibility != Visibility::kSeen)
    return std::min(s.hits, elder.hits) < kTwoCars;
  const auto &p = s.estimate.covariance, &q = elder.estimate.covariance;
  const double xx = p[0][0] + q[0][0], xy = p[0][1] + q[0][1], yy = p[1][1] + q[1][1];
  const double dx = place.x_m - elder_place.x_m, dy = place.y_m - elder_place.y_m;
  const Axes axes(elder.heading_rad);
  const double c2 = axes.cosine * axes.cosine, s2 = axes.sine * axes.sine, mixed = 2.0 * axes.sine * axes.cosine * xy;
  const double along_sigma_m = std::sqrt(std::max(c2 * xx + s2 * yy + mixed, 0.0));
  const double across_sigma_m = std::sqrt(std::max(s2 * xx + c2 * yy - mixed, 0.0));
  return axes.along(dx, dy) + kSameSigmas * along_sigma_m < kSameConfirmed * lane_.length_m &&
         axes.across(dx, dy) + kSameSigmas * across_sigma_m < kSameConfirmed * lane_.width_m;
}

// Whether `other` is an older track of the slot's car, and how far from it. A known car that is hidden, behind the car
// of the other track for instance, is not the same car because its prediction comes near.
bool LanePolicy::is_elder(const TrackView<State>& tracks, int32_t other, int32_t slot,
                          double& distance_m) const noexcept {
  const State &s = tracks.state[slot], &o = tracks.state[other];
  if (other == slot || o.age < s.age || (o.age == s.age && other > slot)) return false;
  if (o.stage == LaneStage::kTentative && s.stage != LaneStage::kTentative) return false;
  distance_m = 0.0;
  if (o.stage != LaneStage::kTentative && took_over(s, slot, o, other)) return true;
  if (o.stage == LaneStage::kTentative || o.uncorrected_s <= kRecent_s) {
    if (s.stage != LaneStage::kTentative && s.uncorrected_s > kRecent_s) return false;
    // It would go on with the younger one's estimate, whose speed may still be that of its birth.
    if (o.stage == LaneStage::kConfirmed && s.stage == LaneStage::kTentative && o.uncorrected_s > kTakenOver_s &&
        s.estimate.covariance[2][2] > o.estimate.covariance[2][2])
      return false;
    const bool are_confirmed = s.stage == LaneStage::kConfirmed;  // the elder is, too, or was
    return is_same_place(o, place_[other], place_[slot], are_confirmed ? kSameConfirmed : kSameTentative) &&
           (!are_confirmed || is_one_car(o, place_[other], s, place_[slot]));
  }
  return s.is_new && may_come_from(o, other, s, slot, distance_m);
}

// An older track of the same car: one at the same place, or, for a track that was just confirmed or that took over, one
// that was not seen lately and whose car may have come here. The nearest one, of equals the lower slot.
int32_t LanePolicy::find_elder(const TrackView<State>& tracks, int32_t slot) const noexcept {
  int32_t best = -1;
  double best_m = 0;
  const auto look_at = [&](int32_t other) {
    double distance_m;
    if (!is_elder(tracks, other, slot, distance_m)) return;
    if (best < 0 || distance_m < best_m || (distance_m == best_m && other < best)) best = other, best_m = distance_m;
  };
  const State& s = tracks.state[slot];
  if (s.stage != LaneStage::kConfirmed || (!s.is_new && s.age > kYoung)) {
    grid_.for_each_near(place_[slot], look_at);
  } else {
    for (int32_t other = 0; other < tracks.slot_count; ++other)
      if (tracks.head[other].alive) look_at(other);
  }
  return best;
}

// The elder keeps what it is, and goes on with the younger one's estimate if it was not seen lately itself.
bool LanePolicy::join(State& s, const State& younger, bool younger_is_newer) const noexcept {
  const State elder = s;
  const bool takes_over = younger_is_newer && elder.uncorrected_s > kTakenOver_s;
  if (takes_over) {
    s = younger;
    s.age = elder.age;
    s.hits = int32_t(std::min(int64_t(elder.hits) + younger.hits, int64_t(INT32_MAX)));
    s.history = elder.history | younger.history;
    s.score = std::max(elder.score, younger.score);
  }
  if (younger_is_newer) s.visibility = younger.visibility;
  s.had_row = elder.had_row || younger.had_row;
  s.class_votes = limit_votes(elder.class_votes + younger.class_votes);
  if (is_confirmed(younger) && !is_confirmed(elder)) s.score = std::max(elder.score, younger.score);
  s.stage = is_confirmed(younger) ? LaneStage::kConfirmed : elder.stage;
  s.is_new = 0;
  return takes_over;
}

// A detection beside the one that updated a car's track, and within the car: a part of it.
int32_t LanePolicy::find_owner(const TrackView<State>& tracks, const Iteration& it, int32_t i) const noexcept {
  const Measurement& z = it.measurement[i];
  for (int32_t k = 0; k < owner_count_; ++k) {
    const State& s = tracks.state[owners_[k]];
    const Place there = straight_on(place_of(z), s.estimate.mean, seconds_between(z.stamp_ns, it.stamp_ns));
    if (is_same_place(s, place_[owners_[k]], there, kSameTentative)) return owners_[k];
  }
  return -1;
}

}  // namespace overtake
