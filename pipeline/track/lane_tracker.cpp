// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/lane_tracker.h"

#include <algorithm>
#include <cmath>

#include "core/cluster_table.h"
#include "core/math.h"

namespace overtake {
namespace {

// Motion.
constexpr double kStep_s = 0.05;  // longest step of a prediction
constexpr int32_t kMostSteps = 1200;
constexpr double kLaneCourse_rad = 0.35, kLaneReach_m = 20.0;  // a car farther off its lane follows none
constexpr double kLaneHalf_m = 25.0;   // of the way over which a lane's curvature is the mean, to both sides
constexpr double kGuess_s = 0.12;      // a car that was not seen for longer keeps to its lane
constexpr double kStandSigmas = 0.25;  // share of stand_mps^2: variance of a speed that is known
constexpr double kStand_s = 0.5;       // time constant of coming to rest
constexpr double kPart_m2 = 0.5;       // variance of a detection whose error lasts for sure
constexpr double kLasting_m = 50.0;    // farther away, the parts of a car that are seen change with every frame
// Up to this angle from straight behind, the own rear wing hides the same parts of a car for long: there it is
// kBehindShare times part_share, and farther away than this distance less.
constexpr double kBehind_rad = 0.4;
constexpr double kBehindLasting_m = 60.0;
constexpr double kBehindShare = 10.0 / 3.0;
constexpr double kLagKeep = 0.8;      // share of the lag that an iteration keeps
constexpr double kManoeuvre_s = 0.3;  // the noise of a manoeuvre goes on for so long after the last sign of it
constexpr double kBraking_s = 0.06;   // the same of the speed and the acceleration
// The mean square of the innovations along: the share of it that an iteration keeps, the least value that is used, and
// the most that one innovation adds.
constexpr double kShareKeep = 0.95, kLeastShare = 0.5, kMostShare = 4.0;
constexpr double kLasts = 1.5;  // with_lasting_error multiplies the variance by more: the error lasts
// Of the acceleration of a change that is noticed: its deviation, and since when.
constexpr double kBegun_mps2 = 6.0, kBegun_s = 0.13;
constexpr double kFreeSpeedNoise = 1.0, kFreeCourseNoise = 0.0125;  // (m/s)^2 and rad^2 per second, without a map
constexpr double kSlow_mps = 25.0;            // power over speed: a slower car accelerates as one without a map
constexpr double kFreeYawRateNoise = 0.0125;  // (rad/s)^2 per second
constexpr double kFreeBirthCourse_rad = 1.0, kFreeBirthYawRate_rps = 0.5;  // deviations, at least
constexpr double kAcross = 3.0, kAcross_rad = 0.6;  // deviations; the course of a car that drives across its lane
constexpr double kFreeTurns_mps = 10.0;             // a faster car changes its course less
// (m/s^2)^2 per second; how long an acceleration lasts of a car that is seen, and of one that is not.
constexpr double kAccelNoise = 1.0, kAccel_s = 0.4, kGuessedAccel_s = 0.1;
// The same without a map, and of a car that is slow, brakes or spins.
constexpr double kLongAccelNoise = 4.0, kLongAccel_s = 1.2;
constexpr double kBrakes_mps2 = 1.5;    // off the throttle, too
constexpr double kNoAccelNoise = 0.72;  // (m/s)^2 per second, of the speed
constexpr double kBrakeLag = 0.83;      // times steady_lag: changes of speed are common, other manoeuvres are rare
constexpr double kTurnLag = 2.0;        // times steady_lag: far away a car's place jumps across, which is no turn
constexpr double kTurnNoise = 0.1;      // rad^2 per second: of the course while the car leaves it
// A track without a course gets one by a measurement to which a car of birth_sigma_speed has come so far (squared, over
// the measurement's variances), or after this time.
constexpr double kCourseWay = 0.25, kCourseWait_s = 0.12;
constexpr double kStandsShare = 0.5;                       // of birth_sigma_speed: a car that hardly moves
constexpr double kLeastBirth_mps = 20.0;                   // on a map cars drive one way
constexpr double kFastest_mps = 90.0, kBirthSigmas = 3.0;  // a new car of this speed is so many deviations off
constexpr double kFaintGate_d2 = 9.0;
constexpr double kJumpSigma_m = 0.3;  // of a jump of the ego pose
// A pushed row may be off its track by so many deviations, but by kMostReach_m at most.
constexpr double kRowSigmas = 3.0, kMostReach_m = 100.0;
constexpr double kAloneCost = 18.0;  // of a track that stays without a detection

// Heading.
constexpr double kHeadingMemory_s = 0.3, kHeadingGate_d2 = 9.0, kHeadingSigma_rad = 0.15, kHeadingRate_rps = 2.0;
constexpr double kHeadingRateNoise = 5.0;  // (rad/s)^2 per second
constexpr int32_t kHeadingMisses = 3;      // this many contradictions in a row replace it
constexpr int32_t kTurnedVotes = 3;        // so many more detections with the front at the other end turn it round
constexpr double kSlip_rad = 0.05;         // between the course and the axis of a car that drives

// What a place that spreads has more than if the new car moved about as guessed: as the ego vehicle does, or hardly.
double guess_of(const LaneTrack& s, double birth_sigma_mps, double uncorrected_s) {
  if (s.has_course) return 0.0;
  const double sigma_mps = s.estimate.mean.speed_mps > 0.0 ? birth_sigma_mps : kStandsShare * birth_sigma_mps;
  return std::max(s.estimate.covariance[2][2] - sigma_mps * sigma_mps, 0.0) * uncorrected_s * uncorrected_s;
}

// innovate() of a track that has no course yet: its car moves about as guessed, which makes the variance of its place
// less by guess_m2, or in any way. Either is as likely; what fits the measurement better counts.
bool innovate_guess(const TrackEstimate& e, double guess_m2, const Measurement& z, Innovation* out) {
  constexpr double kEither = 1.3862943611198906;  // 2 log 2
  if (!innovate(e, z, out)) return false;
  if (!(guess_m2 > 0.0)) return true;
  TrackEstimate guessed = e;
  guessed.covariance[0][0] -= guess_m2;
  guessed.covariance[1][1] -= guess_m2;
  Innovation of_guess;
  if (innovate(guessed, z, &of_guess) && of_guess.d2 + of_guess.log_det < out->d2 + out->log_det) *out = of_guess;
  out->log_det += kEither;
  return true;
}

// Of an axis, the direction within 90 deg of another one.
double nearer_end(double axis_rad, double to_rad) {
  return std::fabs(wrap_angle(axis_rad - to_rad)) > kHalfPi ? wrap_angle(axis_rad + kPi) : axis_rad;
}

int32_t steps_of(double dt_s) {
  const double ratio = std::fabs(dt_s) / kStep_s;
  return ratio >= kMostSteps ? kMostSteps : 1 + int32_t(ratio * (1.0 - 1e-9));
}

}  // namespace

LanePolicy::LanePolicy(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator)
    : params_(params),
      lane_(params.lane),
      map_(map && !map->empty() ? map : nullptr),
      assignment_(params, allocator),
      path_(params, map_) {
  const auto slots = std::size_t(params.track_capacity), rows = std::size_t(params.detection_capacity);
  arena_.build_or_throw(allocator, [&](Carver& carver) {
    for (double** column : {&range_m_, &bearing_rad_, &p_detect_, &p_in_view_, &hit_score_, &miss_score_})
      *column = carver.take<double>(slots);
    place_ = carver.take<Place>(slots);
    visibility_ = carver.take<Visibility>(slots);
    in_part_ = carver.take<bool>(slots);
    confirmed_ = carver.take<int32_t>(slots);
    owners_ = carver.take<int32_t>(slots);
    grid_.carve(carver, params.track_capacity, hypot_f64(lane_.length_m, lane_.width_m));
    claimed_ = carver.take<bool>(rows);
    unclaimed_ = carver.take<Place>(rows);
    path_.carve(carver);
  });
  path_.fill();
}

// ---- predict --------------------------------------------------------------------------------------------------------

// Of the lane around a place: the turn of its heading over 50 m. The points of a recorded centre line are less exact
// than the curvature of a few of them needs. Near the ends of an open line it is that of the line itself.
double LanePolicy::find_curvature(const MapProjection& at) const noexcept {
  const bool is_inside = map_->closed() || (at.s_m > kLaneHalf_m && at.s_m < map_->length_m() - kLaneHalf_m);
  if (!is_inside) return at.curvature_per_m;
  int32_t ahead = at.segment, behind = at.segment;
  const double to_rad = map_->at(at.s_m + kLaneHalf_m, &ahead).heading_rad;
  const double from_rad = map_->at(at.s_m - kLaneHalf_m, &behind).heading_rad;
  // By halves: a hairpin may turn by more than half a turn.
  return (wrap_angle(to_rad - at.heading_rad) + wrap_angle(at.heading_rad - from_rad)) / (2.0 * kLaneHalf_m);
}

// The lane that the car follows. Beyond an end of an open line it goes straight on. A slow car follows none, and does
// not turn.
void LanePolicy::look_at_lane(State& s) const noexcept {
  const MotionState& m = s.estimate.mean;
  s.lane = {};
  if (!(m.speed_mps > kDrives_mps)) {
    s.lane.time_s = lane_.lane_s;
    return;
  }
  if (!map_ || !s.asks_map) return;
  const MapProjection at = map_->project(m.x_m, m.y_m, s.segment);
  s.segment = at.segment;
  if (at.segment < 0 || std::fabs(at.d_m) > kLaneReach_m) return;
  if (!(std::fabs(wrap_angle(m.course_rad - at.heading_rad)) < kLaneCourse_rad)) return;
  const double curvature_per_m = map_->is_beside(at) ? find_curvature(at) : 0.0;
  const double shrink = 1.0 - curvature_per_m * at.d_m;
  if (shrink > 0.2) s.lane = {curvature_per_m / shrink, lane_.lane_s};
  if (is_guessed(s)) s.lane.heading_rad = at.heading_rad, s.lane.course_s = lane_.path_turn_s;
}

// An iteration that does not use the map takes it from the tracks that are not seen, too.
void LanePolicy::follow_map_use(State& s) const noexcept {
  if (s.asks_map == asks_map_) return;
  s.asks_map = asks_map_;
  look_at_lane(s);
}

// A car on a lane that was not seen lately drives as on its predicted path: parallel to the lane, at an offset that is
// less and less certain. An error of its course would take it off the lane: 1 deg by 0.9 m in a second at 50 m/s. The
// course of a car that is seen is its own: pulled to the lane, the places of a recorded drive were less exact.
bool LanePolicy::is_guessed(const State& s) const noexcept { return s.lane.time_s > 0.0 && s.uncorrected_s > kGuess_s; }

// With fewer hits the speed is not known well enough for its changes.
bool LanePolicy::may_accelerate(const State& s) const noexcept {
  return s.hits >= kSteadyHits && s.estimate.mean.speed_mps > kDrives_mps;
}

// Off the map, a car whose acceleration is not estimated has more noise: as if each acceleration ended at once.
double LanePolicy::speed_noise(const State& s) const noexcept {
  return lane_.q_speed + (s.asks_map || may_accelerate(s) ? 0.0 : kNoAccelNoise);
}

// Without a map, or slow: road traffic. Such a car accelerates more, and for longer.
bool LanePolicy::is_free(const State& s) const noexcept {
  const double speed_mps = s.estimate.mean.speed_mps;
  return !s.asks_map || (speed_mps > kDrives_mps && speed_mps < kSlow_mps);
}

CourseNoise LanePolicy::noise_of(const State& s) const noexcept {
  const double gain = s.manoeuvre_s > 0.0 ? lane_.manoeuvre_gain : 1.0;
  const double speed_gain = s.brake_s > 0.0 ? lane_.manoeuvre_gain : 1.0;
  CourseNoise noise = {lane_.q_along, lane_.q_across, speed_noise(s) * speed_gain, lane_.q_course * gain,
                       lane_.q_yaw_rate * gain};
  if (is_free(s)) noise.speed = std::max(noise.speed, kFreeSpeedNoise);
  const bool spins = s.heading_age_s <= kHeadingMemory_s, brakes = s.estimate.accel_mps2 < -kBrakes_mps2;
  const bool is_long = spins || brakes || is_free(s);
  if (may_accelerate(s)) noise.accel = (is_long ? kLongAccelNoise : kAccelNoise) * speed_gain;
  noise.accel_s = s.uncorrected_s > kGuess_s ? kGuessedAccel_s : is_long ? kLongAccel_s : kAccel_s;
  if (!s.asks_map) {  // road traffic, or a place off the map: anything may happen
    const double share = kFreeTurns_mps / std::max(s.estimate.mean.speed_mps, kFreeTurns_mps);
    noise.course = std::max(noise.course, kFreeCourseNoise * share * share);
    noise.yaw_rate = std::max(noise.yaw_rate, kFreeYawRateNoise);
  }
  if (s.turn_s > 0.0) noise.course = std::max(noise.course, kTurnNoise);
  if (s.lane.course_s > 0.0) noise.across += 2.0 * lane_.path_across * lane_.path_across * s.uncorrected_s;
  return noise;
}

bool LanePolicy::comes_to_rest(const State& s) const noexcept {
  return s.estimate.mean.speed_mps < lane_.stand_mps &&
         s.estimate.covariance[2][2] < kStandSigmas * lane_.stand_mps * lane_.stand_mps;
}

// forward_in_time: on the lane, with process noise, and the clocks of the state run. Else CVTR alone, whose step back
// is the inverse of its step forward.
void LanePolicy::move(State& s, double dt_s, bool forward_in_time) const noexcept {
  if (dt_s == 0.0) return;
  forward_in_time = forward_in_time && dt_s > 0.0;
  if (!s.has_course) {
    const double uncorrected_s = s.uncorrected_s + dt_s;  // negative: before the first measurement
    spread(s.estimate, s.uncorrected_s, uncorrected_s);
    s.uncorrected_s = uncorrected_s;
    if (forward_in_time) s.heading_age_s += dt_s;
    return;
  }
  const int32_t steps = steps_of(dt_s);
  const double step_s = dt_s / steps;
  for (int32_t k = 0; k < steps; ++k) {
    if (!forward_in_time) {
      predict_on_lane(s.estimate, {}, {}, step_s);
    } else {
      predict_on_lane(s.estimate, s.lane, noise_of(s), step_s);
      double& speed_mps = s.estimate.mean.speed_mps;
      if (!may_accelerate(s)) forget_acceleration(s.estimate);
      if (comes_to_rest(s)) speed_mps /= 1.0 + step_s / kStand_s;
      s.uncorrected_s += step_s;
      s.heading_age_s += step_s;
      s.manoeuvre_s = std::max(0.0, s.manoeuvre_s - step_s);
      s.brake_s = std::max(0.0, s.brake_s - step_s);
      s.turn_s = std::max(0.0, s.turn_s - step_s);
    }
    turn_heading(s, step_s, forward_in_time);
    look_at_lane(s);
  }
}

// A measured heading turns at its own rate. Else a car that drives points along its course, and one that stands keeps
// its heading.
void LanePolicy::turn_heading(State& s, double dt_s, bool forward_in_time) const noexcept {
  if (s.heading_age_s <= kHeadingMemory_s) {
    s.heading_rad = wrap_angle(s.heading_rad + s.heading_rate_rps * dt_s);
    if (forward_in_time) {
      s.heading_var += dt_s * (2.0 * s.heading_cov + dt_s * s.heading_rate_var);
      s.heading_cov += dt_s * s.heading_rate_var;
      s.heading_rate_var += kHeadingRateNoise * dt_s;
    }
  } else if (s.estimate.mean.speed_mps > kDrives_mps) {
    s.heading_rad = s.is_backwards ? wrap_angle(s.estimate.mean.course_rad + kPi) : s.estimate.mean.course_rad;
    s.heading_var = s.estimate.covariance[3][3] + kSlip_rad * kSlip_rad;
  }
}

// The ego vehicle's own sensors saw the car, so it has the same place relative to the ego vehicle as before the jump,
// which is known as well as the places before lead. A row in the map does not jump, and one in the vehicle frame is
// taken for such a row.
void LanePolicy::move_with_ego(State& s, double x_m, double y_m) const noexcept {
  if (s.had_row) return;
  s.estimate.mean.x_m += x_m;
  s.estimate.mean.y_m += y_m;
  s.estimate.covariance[0][0] += kJumpSigma_m * kJumpSigma_m;
  s.estimate.covariance[1][1] += kJumpSigma_m * kJumpSigma_m;
  look_at_lane(s);
}

// ---- associate ------------------------------------------------------------------------------------------------------

LanePolicy::Ahead LanePolicy::look_ahead(const State& s, double dt_s) const noexcept {
  MotionState ahead = s.estimate.mean;
  LanePull lane = s.lane;
  const int32_t steps = steps_of(dt_s);
  const double step_s = dt_s / steps;
  for (int32_t k = 0; k < steps; ++k) {
    const double speed_mps = ahead.speed_mps;
    ahead = advance_on_lane(ahead, lane, step_s);
    lane = lane_after(lane, speed_mps, step_s);
  }
  return ahead;
}

// A new car may be much faster than its track: at a low rate it drives farther than the gate from scan to scan, and
// where it is missed, from hit to hit. What is known of an acceleration is not in the prediction of look_ahead().
Doubt LanePolicy::doubt(const State& s) const noexcept {
  const double sigma_mps = std::sqrt(s.estimate.covariance[2][2]);
  return {kBirthSigmas * sigma_mps + std::fabs(s.estimate.accel_mps2) * kLongAccel_s,
          s.hits < kSteadyHits ? s.uncorrected_s : 0.0, rows_reach_m_};
}

LanePolicy::Estimate LanePolicy::estimate(const State& s, double dt_s, const Ahead&) const noexcept {
  Estimate e = {s.estimate, s.stage == LaneStage::kLost};
  if (!s.has_course) {
    spread(e, s.uncorrected_s, s.uncorrected_s + dt_s);
    e.guess_m2 = guess_of(s, params_.birth_sigma_v, s.uncorrected_s + dt_s);
    return e;
  }
  const CourseNoise noise = noise_of(s);
  LanePull lane = s.lane;
  const int32_t steps = steps_of(dt_s);
  const double step_s = dt_s / steps;
  for (int32_t k = 0; k < steps; ++k) {
    const double speed_mps = e.mean.speed_mps;
    predict_on_lane(e, lane, noise, step_s);
    lane = lane_after(lane, speed_mps, step_s);
  }
  return e;
}

// The error of a detection that shows a part of a car only is the same in the next frames: it counts with a larger
// covariance. That of a car in smoke is another one in each frame.
Measurement LanePolicy::with_lasting_error(const Measurement& z) const noexcept {
  Measurement r = z;
  if (!is_cluster(z) || z.in_smoke) return r;
  const double dx = z.x_m - ego_.x_m, dy = z.y_m - ego_.y_m;
  const bool is_behind = ego_.known && std::fabs(wrap_angle(atan2_f64(dy, dx) - ego_.heading_rad)) > kPi - kBehind_rad;
  const double lasting_m = is_behind ? kBehindLasting_m : kLasting_m;
  const double near = std::min(lasting_m * lasting_m / std::max(dx * dx + dy * dy, 1.0), 1.0);
  const double share = is_behind ? lane_.part_share * kBehindShare * near : lane_.part_share;
  const double scale = 1.0 + share * near * std::min((z.var_x + z.var_y) / kPart_m2, 1.0);
  r.var_x *= scale, r.var_y *= scale, r.cov_xy *= scale;
  return r;
}

// A lost track's place is so uncertain that it would take the next car of traffic, whose pushed row shows nothing of
// the car itself. That car gets a track of its own; find_elder gives it the lost id if its motion fits.
bool LanePolicy::cost(const Estimate& e, const Measurement& z, double& cost) const noexcept {
  if (e.is_lost && !is_cluster(z)) return false;
  Innovation innovation;
  if (!innovate_guess(e, e.guess_m2, with_lasting_error(z), &innovation) || !(innovation.d2 <= params_.gate_d2))
    return false;
  if (z.faint && !(innovation.d2 <= kFaintGate_d2 && z.height_m >= lane_.low_m)) return false;  // may be the road
  cost = innovation.d2 + innovation.log_det + (z.faint ? params_.gate_d2 : 0.0);  // a detection comes first
  // How badly a row tells its place says nothing about whose it is.
  if (const double det = z.var_x * z.var_y - z.cov_xy * z.cov_xy; !is_cluster(z) && det > 1.0) cost -= log_f64(det);
  return true;
}

// The assignment forms as many pairs as it can, at any cost within the gates. Of cars one behind the other, one of
// which is not seen, each track would take the next car, and a speed. Where all rows are pushed ones, each track may
// stay alone, so none does because another one may not. So may one of which not even the ego vehicle tells a course.
bool LanePolicy::alone_cost(const State& s, double& cost) const noexcept {
  cost = kAloneCost;
  return are_rows_ || (!s.has_course && !ego_.known);
}

Effort LanePolicy::associate(const TrackView<State>& tracks, const Iteration& it,
                             int32_t* measurement_of_slot) noexcept {
  asks_map_ = it.in_map && it.ask_map;
  ego_ = it.ego;
  since_far_jump_s_ = it.since_far_ego_jump_s;
  knows_range_ = it.ego.known || !it.in_map;
  are_rows_ = it.count > 0 && std::none_of(it.measurement, it.measurement + it.count, is_cluster);
  only_rows_ = are_rows_ && asks_map_ == 0;
  of_rows_ = it.of_rows;
  stamp_ns_ = it.stamp_ns;
  rows_reach_m_ = 0.0;
  for (int32_t i = 0; are_rows_ && i < it.count; ++i)
    rows_reach_m_ = std::max(rows_reach_m_, kRowSigmas * std::sqrt(it.measurement[i].var_x + it.measurement[i].var_y));
  rows_reach_m_ = std::min(rows_reach_m_, kMostReach_m);
  find_places(tracks, it);
  look_from_ego(tracks);
  find_detectable(tracks, it);
  const Effort effort = assignment_.run(*this, tracks, it, measurement_of_slot);
  list_unclaimed(tracks, it, measurement_of_slot);
  return effort;
}

// ---- update ---------------------------------------------------------------------------------------------------------

namespace {

// How far a measurement is ahead of the track and to its left, in standard deviations.
struct Off {
  double along, across;
};
Off find_off(const TrackEstimate& e, const Measurement& z) noexcept {
  const MotionState& m = e.mean;
  const auto& p = e.covariance;
  double sine, cosine;
  sin_cos_f64(m.course_rad, sine, cosine);
  const double x_m = z.x_m - m.x_m, y_m = z.y_m - m.y_m;
  const double xx = p[0][0] + z.var_x, yy = p[1][1] + z.var_y, xy = 2.0 * sine * cosine * (p[0][1] + z.cov_xy);
  return {(cosine * x_m + sine * y_m) / std::sqrt(cosine * cosine * xx + sine * sine * yy + xy),
          (cosine * y_m - sine * x_m) / std::sqrt(sine * sine * xx + cosine * cosine * yy - xy)};
}

}  // namespace

// A new track begins with the course of its lane. If the car is far to one side of where that leads, it drives across.
void LanePolicy::doubt_lane_course(State& s, const Measurement& z) const noexcept {
  if (!s.asks_map || s.hits >= kSteadyHits || !s.has_course) return;
  double& variance = s.estimate.covariance[3][3];
  if (std::fabs(find_off(s.estimate, z).across) > kAcross) variance = std::max(variance, kAcross_rad * kAcross_rad);
}

// Innovations ahead of or behind the track, several or a large one, are a manoeuvre: the car brakes or accelerates, and
// may turn. Those to the left or right tell less, because a far car's place jumps across: twice as large, they say that
// the course turns. A fast car's places on its map are more exact than their covariances say, so a change of its speed
// is noticed early by what its innovations usually are, and is an acceleration that has begun already. Not where the
// error of a detection lasts: it changes by jumps when other parts of the car are seen.
void LanePolicy::watch_for_manoeuvre(State& s, const Measurement& z, double dt_s, bool error_lasts) const noexcept {
  if (s.hits < kSteadyHits || !s.has_course || !(dt_s > 0.0)) return;
  auto& p = s.estimate.covariance;
  const Off off = find_off(s.estimate, z);
  const bool is_exact = !error_lasts && may_accelerate(s) && !is_free(s);
  s.lag_along = kLagKeep * s.lag_along + off.along / std::sqrt(is_exact ? std::max(s.along_share, kLeastShare) : 1.0);
  if (!(s.brake_s > 0.0) && !error_lasts)
    s.along_share += (1.0 - kShareKeep) * (std::min(off.along * off.along, kMostShare) - s.along_share);
  s.lag_across = kLagKeep * s.lag_across + off.across;
  if (std::fabs(s.lag_across) > kTurnLag * lane_.steady_lag) s.turn_s = kManoeuvre_s;
  const double more = (lane_.manoeuvre_gain - 1.0) * dt_s;  // a manoeuvre began after the last detection
  if (std::fabs(s.lag_along) > (may_accelerate(s) ? kBrakeLag : 1.0) * lane_.steady_lag) {
    if (!(s.brake_s > 0.0)) {
      if (is_exact)
        begin_acceleration(s.estimate, kBegun_mps2, kBegun_s);
      else
        p[2][2] += speed_noise(s) * more;
    }
    s.brake_s = kBraking_s;
  }
  if (!(std::fabs(s.lag_along) > lane_.steady_lag)) return;
  if (!(s.manoeuvre_s > 0.0)) {
    p[3][3] += lane_.q_course * more;
    p[4][4] += lane_.q_yaw_rate * more;
  }
  s.manoeuvre_s = kManoeuvre_s;
}

// Single detections take the wrong end for the front. Three more with the front at the other end than without turn the
// car round.
void LanePolicy::measure_front(State& s, const Measurement& z) const noexcept {
  const bool is_known = z.front != 0 && std::isfinite(z.heading_rad);
  const bool is_across = is_known && std::fabs(wrap_angle(z.heading_rad - s.heading_rad)) > kHalfPi;
  const bool is_other = is_known && is_across == (z.front > 0);
  s.turned_votes = std::max(s.turned_votes + (is_other ? 1 : -1), 0);
  if (s.turned_votes < kTurnedVotes) return;
  s.heading_rad = wrap_angle(s.heading_rad + kPi);
  s.turned_votes = 0;
}

// A rectangle has no front: the heading is measured modulo pi.
void LanePolicy::measure_heading(State& s, const Measurement& z) const noexcept {
  if (!z.free_heading || !std::isfinite(z.heading_rad)) return;
  constexpr double kVariance = kHeadingSigma_rad * kHeadingSigma_rad;
  const double turn = wrap_angle(nearer_end(z.heading_rad, s.heading_rad) - s.heading_rad);
  const bool is_known = s.heading_age_s <= kHeadingMemory_s;
  const double sum = s.heading_var + kVariance;
  if (is_known && turn * turn <= kHeadingGate_d2 * sum) {
    const double gain = s.heading_var / sum, rate_gain = s.heading_cov / sum;
    s.heading_rad = wrap_angle(s.heading_rad + gain * turn);
    s.heading_rate_rps += rate_gain * turn;
    s.heading_rate_var -= rate_gain * s.heading_cov;
    s.heading_cov *= 1.0 - gain;
    s.heading_var *= 1.0 - gain;
  } else {
    if (is_known && ++s.heading_misses < kHeadingMisses) return;
    s.heading_rad = wrap_angle(s.heading_rad + turn);
    s.heading_rate_rps = 0.0;
    s.heading_var = kVariance;
    s.heading_cov = 0.0;
    s.heading_rate_var = kHeadingRate_rps * kHeadingRate_rps;
  }
  s.heading_misses = 0;
  s.heading_age_s = 0.0;
}

// Where nothing told the course of a track, the way from its first measurement to this one does. A moment after the
// first, the errors of both are longer than the way.
bool LanePolicy::waits_for_course(const State& s, const Measurement& z) const noexcept {
  const double way2_m2 = s.estimate.covariance[2][2] * s.uncorrected_s * s.uncorrected_s;
  const bool is_told = s.uncorrected_s > 0.0 && way2_m2 > kCourseWay * (z.var_x + z.var_y);
  return !s.has_course && s.uncorrected_s < kCourseWait_s && !is_told;
}

// A measurement older than the state: back without noise, update, and forward to the state's time without noise.
void LanePolicy::update(int32_t slot, State& s, double dt_s, const Measurement& z) noexcept {
  const Measurement wide = with_lasting_error(z);
  s.asks_map = asks_map_;
  move(s, dt_s, true);
  Innovation innovation;
  const double guess_m2 = guess_of(s, params_.birth_sigma_v, s.uncorrected_s);
  const bool is_known = innovate_guess(s.estimate, guess_m2, wide, &innovation);
  score_hit(slot, s, z, is_known ? &innovation : nullptr);
  if (is_known) watch_for_manoeuvre(s, wide, dt_s, wide.var_x > kLasts * z.var_x);
  if (is_known) doubt_lane_course(s, wide);
  const bool waits = waits_for_course(s, wide);
  if (!s.has_course && !waits) {
    s.has_course = find_course(s.estimate, wide, s.uncorrected_s);
    if (s.has_course && moves_for_sure(s)) s.heading_rad = nearer_end(s.heading_rad, s.estimate.mean.course_rad);
  } else if (s.has_course) {
    update_on_lane(s.estimate, wide);
  }
  measure_front(s, z);
  measure_heading(s, z);
  if ((z.front != 0 || s.heading_age_s == 0.0) && moves_for_sure(s))
    s.is_backwards = std::fabs(wrap_angle(s.heading_rad - s.estimate.mean.course_rad)) > kHalfPi;
  turn_heading(s, 0.0, true);
  if (std::isfinite(z.length_m)) s.length_m = z.length_m;
  if (std::isfinite(z.width_m)) s.width_m = z.width_m;
  if (s.has_course) s.uncorrected_s = 0.0;
  if (!is_cluster(z)) s.had_row = 1;
  visibility_[slot] = Visibility::kSeen;  // also where the detection is no hit
  look_at_lane(s);
  if (dt_s < 0.0) move(s, -dt_s, false);
}

LaneTrack LanePolicy::initiate(const Measurement& z, const Iteration& it) const noexcept {
  State s;
  s.asks_map = it.in_map && it.ask_map;
  s.counted_ns = it.stamp_ns;
  s.length_m = std::isfinite(z.length_m) ? z.length_m : 0.0;
  s.width_m = std::isfinite(z.width_m) ? z.width_m : 0.0;
  MotionState& mean = s.estimate.mean;
  mean.x_m = z.x_m;
  mean.y_m = z.y_m;
  double sigma_v = params_.birth_sigma_v, sigma_phi = params_.birth_sigma_phi, sigma_omega = params_.birth_sigma_omega;
  if (it.ego.known) {
    mean.speed_mps = std::max(0.0, lane_.birth_speed_share * it.ego.speed_mps);
    sigma_v = lane_.birth_sigma_share * std::fabs(it.ego.speed_mps);
  }
  if (map_ && s.asks_map) {
    const MapProjection at = map_->project(z.x_m, z.y_m);
    if (it.ego.known) mean.speed_mps = std::max(mean.speed_mps, kLeastBirth_mps);
    mean.course_rad = wrap_angle(at.heading_rad);
    mean.yaw_rate_rps = map_->is_beside(at) ? mean.speed_mps * at.curvature_per_m : 0.0;
    sigma_phi = lane_.birth_sigma_course, sigma_omega = lane_.birth_sigma_yaw_rate;
    sigma_v = std::max(sigma_v, (kFastest_mps - mean.speed_mps) / kBirthSigmas);  // the ego vehicle may stand
  } else {
    if (it.ego.known) mean.course_rad = wrap_angle(it.ego.heading_rad);
    sigma_v = std::max(sigma_v, (kFastest_mps + mean.speed_mps) / kBirthSigmas);  // it may come from anywhere
    sigma_phi = it.ego.known ? std::max(sigma_phi, kFreeBirthCourse_rad) : kPi;
    sigma_omega = std::max(sigma_omega, kFreeBirthYawRate_rps);
    s.has_course = 0;
  }
  const Measurement wide = with_lasting_error(z);
  auto& cov = s.estimate.covariance;
  cov[0][0] = wide.var_x;
  cov[1][1] = wide.var_y;
  cov[0][1] = cov[1][0] = wide.cov_xy;
  cov[2][2] = sigma_v * sigma_v;
  cov[3][3] = sigma_phi * sigma_phi;
  cov[4][4] = sigma_omega * sigma_omega;
  s.heading_rad = mean.course_rad;
  s.heading_var = cov[3][3] + kSlip_rad * kSlip_rad;
  measure_heading(s, z);
  begin_existence(s, z);
  look_at_lane(s);
  return s;
}

template class ReplayTracker<LanePolicy>;

std::unique_ptr<FrameTracker> make_lane_tracker(const TrackerParams& params, const CircuitMap* map,
                                                const Allocator& allocator) {
  return std::make_unique<LaneTracker>(params, map, allocator);
}

}  // namespace overtake
