// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the car of a track exists: whether the sensors can see it, what a detection says for or against a car, and
// the score that confirms the track, loses it or ends it.
#include <algorithm>
#include <cmath>

#include "core/cluster_table.h"
#include "core/math.h"
#include "pipeline/track/lane_tracker.h"

namespace overtake {
namespace {

constexpr double kLog2Pi = 1.8378770664093453;
constexpr double kLeastDetect = 0.01;
constexpr double kWing_rad = 0.2, kWing_m = 10.0;  // the shadow of the own rear wing, to both sides; from here on
// Widths of a car: one this far beside another one's line of sight is hidden by it, or may be in part.
constexpr double kHiddenWidths = 0.6, kPartWidths = 1.2;
constexpr double kTall_m = 0.6;     // no road nearer than 30 m is misjudged by as much: in the own shadow this is a car
constexpr double kOutside_m = 0.3;  // of the circuit is where a car's centre cannot be,
constexpr int32_t kMostOfWall = 30;  // unless more points tell that it is a car
constexpr double kOwnMiss_s = 0.04;  // misses that follow each other sooner have one cause, and count in part
constexpr double kKnownHit = 0.3;    // a hit adds at least this to the score of a track that was confirmed
constexpr double kLowReach_m = 80.0, kNearest_m = 8.0, kSparse = 0.03, kThin = 0.1;
constexpr double kFewFrom_m = 60.0, kMostTimes = 6.0;  // nearer a car shows more points, up to so many times as many
constexpr double kRowScore = 1.0;  // of a pushed row without a score: its detector says that it is a car
constexpr int32_t kRowHits = 2;    // what the first row counts, because it is a whole object
constexpr double kLeastScore = 0.11920292202211755;       // 1 / (1 + e^2)
constexpr double kPassing_m = 15.0, kBesideRoad_m = 6.0;  // ahead of the ego vehicle at most, and beside it at least
constexpr double kPassed_m = 60.0, kPassedShare = 0.25;  // farther behind and slower than this share of the ego's speed
constexpr double kMoving_mps = 5.0;                      // what is faster does not stand
constexpr double kFreeCoast_m = 3.0;    // without a map: most deviation of the place of a car that should be seen
constexpr double kLeastCoast_s = 0.12;  // not longer unseen: the place is as its source tells it
constexpr double kFarJump_s = 0.3;  // after a far jump of the ego pose: what was not seen in that time was elsewhere
constexpr int64_t kMostVotes = 10;  // after so many votes for one class, more for another one decide

int64_t vote_of(const Measurement& z) {
  return int64_t(z.object_class == int32_t(ObjectClass::kCar)) -
         int64_t(z.object_class == int32_t(ObjectClass::kDebris));
}

// Of a pushed row: log odds of its detector's confidence, from -2 to 2, because a detector repeats its errors.
double score_of(const Measurement& z) {
  if (!(z.score >= 0.0)) return kRowScore;
  const double p = std::clamp(z.score, kLeastScore, 1.0 - kLeastScore);
  return log_f64(p / (1.0 - p));
}

// A car that was confirmed may show very little of itself. What never looked like a car is not known to be one, unless
// another detector says so.
bool is_known_car(const LaneTrack& s, const Measurement& z) {
  return s.stage != LaneStage::kTentative && (s.class_votes > 0 || !is_cluster(z));
}

double sigma_speed(const LaneTrack& s) { return std::sqrt(s.estimate.covariance[2][2]); }

bool is_behind_wing(const TrackerEgo& ego, double range_m, double bearing_rad) {
  return ego.known && range_m > kWing_m && std::fabs(bearing_rad) > kPi - kWing_rad;
}

}  // namespace

// ---- what the sensors can see ---------------------------------------------------------------------------------------

// Distance from the ego vehicle; 0 in the map without an ego pose, where no place is farther than another.
double LanePolicy::range_of(double dx, double dy) const noexcept { return knows_range_ ? hypot_f64(dx, dy) : 0.0; }

// The tracks as the ego vehicle sees them.
void LanePolicy::look_from_ego(const TrackView<State>& tracks) noexcept {
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
    if (!tracks.head[slot].alive) continue;
    const double dx = place_[slot].x_m - ego_.x_m, dy = place_[slot].y_m - ego_.y_m;
    range_m_[slot] = range_of(dx, dy);
    bearing_rad_[slot] = wrap_angle(atan2_f64(dy, dx) - ego_.heading_rad);
  }
}

// The probability that the iteration's sensors detect a car at its place: by the distance, the shadow of the own wing,
// and the cars in between.
void LanePolicy::find_detectable(const TrackView<State>& tracks, const Iteration& it) noexcept {
  confirmed_count_ = 0;
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot)
    if (tracks.head[slot].alive && is_confirmed(tracks.state[slot])) confirmed_[confirmed_count_++] = slot;
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
    if (!tracks.head[slot].alive) continue;
    const double range_m = range_m_[slot], bearing_rad = bearing_rad_[slot];
    double ratio = range_m / lane_.half_m;
    ratio *= ratio, ratio *= ratio, ratio *= ratio;
    double p = lane_.p_detect / (1.0 + ratio);
    p_in_view_[slot] = std::max(p, kLeastDetect);
    visibility_[slot] = Visibility::kMissed;
    in_part_[slot] = false;
    if (it.ego.known) {
      if (is_behind_wing(it.ego, range_m, bearing_rad)) {
        p = std::min(p, lane_.p_wing);
        visibility_[slot] = Visibility::kOwnShadow;
      }
      double beside_m = 1e9;  // how far beside the nearest line of sight over another car
      for (int32_t i = 0; i < confirmed_count_; ++i) {
        const int32_t other = confirmed_[i];
        if (other == slot) continue;
        if (!(range_m_[other] < range_m - 0.5 * lane_.length_m)) continue;
        const double turn_rad = std::fabs(bearing_rad_[other] - bearing_rad);
        beside_m = std::min(beside_m, range_m_[other] * std::min(turn_rad, kTwoPi - turn_rad));
      }
      in_part_[slot] = asks_map_ != 0 && beside_m < kPartWidths * lane_.width_m;
      if (beside_m < kHiddenWidths * lane_.width_m) {
        p *= lane_.p_hidden;
        visibility_[slot] = Visibility::kHidden;
      }
    }
    p_detect_[slot] = std::max(p, kLeastDetect);
    const double since_s = seconds_between(tracks.state[slot].counted_ns, it.stamp_ns);
    miss_score_[slot] = log_f64(1.0 - p_detect_[slot]) * std::clamp(since_s / kOwnMiss_s, 0.0, 1.0);
  }
}

// Whether a detection that no confirmed track explains may be clutter of another one. On a map one that looks like a
// car in each feature is none: cars begin side by side. Elsewhere pieces of a wall look like cars, too.
bool LanePolicy::is_clutter(const Measurement& z) const noexcept {
  return !z.faint && (asks_map_ == 0 || evidence_of(z, false) < 0.0);
}

// Whether a detection of a track that is not confirmed is one of a car: it came where the track was going several
// times, and what stands does not move.
bool LanePolicy::is_moving_car(const State& s, const Measurement& z) const noexcept {
  const double least_mps = std::max(kMoving_mps, kPassedShare * ego_.speed_mps);
  return s.hits >= lane_.confirm_hits && s.estimate.mean.speed_mps - sigma_speed(s) > least_mps &&
         evidence_of(z, false) >= 0.0;
}

// Detections that no car explains, and that may be clutter.
void LanePolicy::list_unclaimed(const TrackView<State>& tracks, const Iteration& it,
                                const int32_t* measurement_of_slot) noexcept {
  std::fill_n(claimed_, it.count, false);
  for (int32_t slot = 0; slot < tracks.slot_count; ++slot) {
    if (!tracks.head[slot].alive || measurement_of_slot[slot] < 0) continue;
    const State& s = tracks.state[slot];
    const int32_t i = measurement_of_slot[slot];
    claimed_[i] = claimed_[i] || is_confirmed(s) || is_moving_car(s, it.measurement[i]);
  }
  unclaimed_count_ = 0;
  for (int32_t i = 0; i < it.count; ++i)
    if (!claimed_[i] && is_clutter(it.measurement[i])) unclaimed_[unclaimed_count_++] = place_of(it.measurement[i]);
}

// ---- what a detection says ------------------------------------------------------------------------------------------

// Log of the ratio: such a detection of a car, to one of another object. A car that another one hides in part may show
// few points and a small side; but what is hidden of it is its lower part, or one side at its full height. The same
// holds for a follower in the shadow of the own car.
double LanePolicy::evidence_of(const Measurement& z, bool in_part) const noexcept {
  if (in_part && !is_cluster(z)) return 0.0;
  if (z.in_shadow && z.height_m >= kTall_m) in_part = true;
  const double dx = z.x_m - ego_.x_m, dy = z.y_m - ego_.y_m, range_m = range_of(dx, dy);
  double score = in_part || z.object_class == int32_t(ObjectClass::kCar) ? 0.0 : lane_.unknown_score;
  if (!is_cluster(z)) score = score_of(z);
  if (z.height_m < lane_.low_m) {  // the height of the road is less certain far away
    const double share = range_m > kLowReach_m ? kLowReach_m / range_m : 1.0;
    score += lane_.low_score * share * share;
  }
  if (in_part || !is_cluster(z)) return score;
  const double near_m = std::max(range_m, kNearest_m);
  double share = double(z.points) * near_m * near_m / lane_.car_points;
  if (near_m < kFewFrom_m && !is_behind_wing(ego_, range_m, wrap_angle(atan2_f64(dy, dx) - ego_.heading_rad)))
    share /= std::min(kFewFrom_m * kFewFrom_m / (near_m * near_m), kMostTimes);
  if (share < kSparse)
    score += lane_.sparse_score;
  else if (share < kThin)
    score += lane_.thin_score;
  return score;
}

// Density of the other unclaimed detections around an unclaimed one. Pushed rows are another detector's cars: many of
// them are traffic.
double LanePolicy::clutter_near(const Measurement& z) const noexcept {
  if (!is_cluster(z)) return lane_.clutter_per_m2;
  const double reach_m2 = lane_.clutter_reach_m * lane_.clutter_reach_m;
  int32_t others = 0;
  for (int32_t i = 0; i < unclaimed_count_; ++i) {
    const double m2 = distance_m2(unclaimed_[i], place_of(z));
    others += m2 > 0.0 && m2 <= reach_m2;  // not itself
  }
  return std::max(lane_.clutter_per_m2, double(others) / lane_.clutter_area_m2);
}

// A few points outside of the circuit, by the ego heading as the tracker has learned it. The gates know it as
// published: half a degree is a metre at 120 m.
bool LanePolicy::is_piece_of_wall(const State& s, const Measurement& z) const noexcept {
  if (!map_ || !asks_map_ || !is_cluster(z) || z.points >= kMostOfWall) return false;
  int32_t segment = s.segment;
  return map_->measure_outside(z.x_m, z.y_m, &segment) > kOutside_m;
}

int64_t LanePolicy::limit_votes(int64_t votes) noexcept { return std::clamp(votes, -kMostVotes, kMostVotes); }

void LanePolicy::score_hit(int32_t slot, State& s, const Measurement& z, const Innovation* innovation) noexcept {
  double score = 0.0;
  if (innovation) {
    const double log_density = -kLog2Pi - 0.5 * (innovation->log_det + innovation->d2);
    // A hit tells that the car is not hidden. Where no map is asked, a misjudged road behind the own wing makes hits,
    // too.
    const double p_hit = asks_map_ != 0 ? p_in_view_[slot] : p_detect_[slot];
    const double log_ratio = log_f64(p_hit / clutter_near(z)) + log_density;
    score = std::clamp(log_ratio, -lane_.hit_score, lane_.hit_score);
    score += evidence_of(z, in_part_[slot]);
  }
  s.class_votes = limit_votes(s.class_votes + vote_of(z));
  if (is_known_car(s, z))
    score = std::max(score, kKnownHit);
  else if ((s.class_votes < 0 && z.debris && !in_part_[slot]) || is_piece_of_wall(s, z))
    score = -lane_.hit_score;
  hit_score_[slot] = score;
}

void LanePolicy::begin_existence(State& s, const Measurement& z) const noexcept {
  s.class_votes = vote_of(z);
  s.score = std::clamp(evidence_of(z, false), -lane_.most_score, lane_.most_score);
  s.history = 1;
  s.age = 1;
  s.hits = is_cluster(z) ? 1 : kRowHits;
  s.had_row = !is_cluster(z);
}

// ---- the life of a track --------------------------------------------------------------------------------------------

// What stands is seen first from ahead, so something slow that comes into view far behind was passed, and did not look
// like a car then. A new track's speed is a guess: while the ego vehicle moves, what may be slow, by a standard
// deviation, waits. Nor did, where no map is asked, a post or a sign that is new beside the road where the ego vehicle
// is.
bool LanePolicy::was_passed(int32_t slot, const State& s) const noexcept {
  if (!ego_.known) return false;
  const double slow_mps = kPassedShare * ego_.speed_mps, speed_mps = s.estimate.mean.speed_mps;
  if (std::fabs(bearing_rad_[slot]) > kHalfPi && range_m_[slot] > kPassed_m)
    return speed_mps - (ego_.speed_mps > kMoving_mps ? sigma_speed(s) : 0.0) < slow_mps;
  if (!(speed_mps < slow_mps)) return false;
  if (asks_map_ != 0 || only_rows_) return false;
  double sine, cosine;
  sin_cos_f64(bearing_rad_[slot], sine, cosine);
  return range_m_[slot] * cosine < kPassing_m && std::fabs(range_m_[slot] * sine) > kBesideRoad_m;
}

// A confirmed track is lost in the end: without a hit for too long, or when its place has become too uncertain. The
// place that a hit has just told is as certain as its source can tell it.
bool LanePolicy::has_coasted(const State& s, double most_m) const noexcept {
  const auto& p = s.estimate.covariance;
  return s.uncorrected_s > lane_.coast_s ||
         (s.uncorrected_s > kLeastCoast_s && !(p[0][0] + p[1][1] <= most_m * most_m));
}

// The ego pose has jumped so far that the track's place on the map was wrong, and nothing was seen there since.
bool LanePolicy::is_of_place_before(const State& s) const noexcept {
  return since_far_jump_s_ > kFarJump_s && s.uncorrected_s > since_far_jump_s_;
}

void LanePolicy::lose(State& s) const noexcept {
  s.stage = LaneStage::kLost;
  s.score = std::min(s.score, 0.0);
}

// A prediction runs no iteration, but its time counts: no place may be published as that of a known car for ever.
LaneTrack LanePolicy::publishable(const State& s, bool) const noexcept {
  State published = s;
  if (is_confirmed(s) && has_coasted(s, lane_.coast_sigma_m)) lose(published);
  return published;
}

// No sensor looks where the car is, or it is not known where the source of rows that never saw the car looks: no miss.
void LanePolicy::leave_view(State& s) const noexcept {
  if (!of_rows_) s.visibility = Visibility::kOutside;
  s.is_new = 0;
  follow_map_use(s);
  if (is_confirmed(s) && (has_coasted(s, lane_.coast_sigma_m) || is_of_place_before(s))) lose(s);
}

// The features tell new cars from other objects. A known car may show very little of itself, so a hit of a track that
// was confirmed always speaks for it.
bool LanePolicy::record(int32_t slot, State& s, bool hit) const noexcept {
  s.history = s.history << 1 | uint64_t(hit);
  if (s.age < INT32_MAX) ++s.age;
  follow_map_use(s);
  s.is_new = 0;
  s.visibility = visibility_[slot];
  if (hit) {
    if (s.hits < INT32_MAX) ++s.hits;
    s.score += hit_score_[slot];
    s.misses = 0.0;
  } else {
    s.score += miss_score_[slot];
    s.misses += std::clamp(seconds_between(s.counted_ns, stamp_ns_) / kOwnMiss_s, 0.0, 1.0);
  }
  s.counted_ns = stamp_ns_;
  s.score = std::clamp(s.score, -lane_.most_score, lane_.most_score);
  switch (s.stage) {
    case LaneStage::kTentative:
      if (s.score > lane_.confirm_score && s.hits >= lane_.confirm_hits && !was_passed(slot, s)) {
        s.stage = LaneStage::kConfirmed;
        s.is_new = 1;
      }
      return s.is_new != 0 ||
             (s.score > lane_.drop_score - 0.5 * lane_.most_score && s.misses <= lane_.tentative_misses);
    case LaneStage::kConfirmed: {
      const bool is_free = !s.asks_map && s.visibility == Visibility::kMissed;
      const double most_m = is_free ? std::min(lane_.coast_sigma_m, kFreeCoast_m) : lane_.coast_sigma_m;
      if (!(s.score > lane_.drop_score) || has_coasted(s, most_m) || is_of_place_before(s)) lose(s);
      return true;
    }
    case LaneStage::kLost:
      if (hit && s.score > lane_.confirm_score) s.stage = LaneStage::kConfirmed;
      return true;  // until it is silent
  }
  return true;
}

}  // namespace overtake
