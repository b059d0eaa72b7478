// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One iteration, top to bottom: silence, gates and assignment, hits, misses, deaths, births.
#include "pipeline/tracker.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "core/math.h"
#include "pipeline/tracker_state.h"

namespace overtake {
namespace {

TrackerEgo make_sane(const TrackerEgo& ego) {
  const bool finite = std::fabs(ego.x_m) <= kMaxPlace_m && std::fabs(ego.y_m) <= kMaxPlace_m &&
                      std::fabs(ego.heading_rad) <= 1e6 && std::fabs(ego.speed_mps) <= 1e3;
  return ego.known && finite ? ego : TrackerEgo{};
}

bool is_in_sector(const ObservedSector& s, double x_m, double y_m) {
  const double dx = x_m - s.x_m, dy = y_m - s.y_m, range_m = hypot_f64(dx, dy);
  if (!(range_m >= s.range_min_m && range_m <= s.range_max_m && range_m <= 4.0 * kMaxPlace_m)) return false;
  const double width_rad = s.left_rad - s.right_rad;
  if (width_rad >= kTwoPi - 1e-9) return true;  // the edges of a full turn may miss each other by a rounding
  double right_of_left_rad = wrap_angle(s.left_rad - atan2_f64(dy, dx));
  if (right_of_left_rad < 0.0) right_of_left_rad += kTwoPi;
  return right_of_left_rad <= width_rad;
}

bool is_observed(const TrackerFrame& frame, const MotionState& place) {
  if (frame.sector_count < 0) return true;
  for (int32_t i = 0; i < frame.sector_count; ++i)
    if (is_in_sector(frame.sectors[i], place.x_m, place.y_m)) return true;
  return false;
}

// A detection older than the state measures where the track was: back without noise, update, and back to the state's
// time without noise, so that no noise counts twice and time never goes back.
void take_hit(const Tracker::State& state, Track& track, const Candidate& c) {
  const double dt_s = seconds_between(track.state_ns, c.stamp_ns);
  predict_track(track, state.noise, dt_s);
  update(track.estimate, c.z);
  if (std::isfinite(c.heading_rad)) {
    track.has_heading = true;
    track.heading_rad = c.heading_rad;
  }
  if (std::isfinite(c.length_m)) track.length_m = c.length_m;
  if (std::isfinite(c.width_m)) track.width_m = c.width_m;
  track.detection = c.row;
  track.measured_ns = std::max(track.measured_ns, c.stamp_ns);
  if (dt_s >= 0.0)
    track.state_ns = c.stamp_ns;
  else
    predict_track(track, state.no_noise, -dt_s);
}

void predict_to(const Tracker::State& state, Track& track, int64_t stamp_ns) {
  if (stamp_ns <= track.state_ns) return;
  predict_track(track, state.noise, seconds_between(track.state_ns, stamp_ns));
  track.state_ns = stamp_ns;
}

void give_birth(Tracker::State& state, Track& track, const Candidate& c, const TrackerFrame& frame,
                const TrackerEgo& ego) {
  const TrackerParams& p = state.params;
  const uint32_t generation = track.generation + 1;
  track = Track{};
  track.alive = true;
  track.generation = generation;
  track.state_ns = track.measured_ns = c.stamp_ns;
  track.detection = c.row;
  track.has_heading = std::isfinite(c.heading_rad);
  track.heading_rad = track.has_heading ? c.heading_rad : 0.0;
  track.length_m = std::isfinite(c.length_m) ? c.length_m : 0.0;
  track.width_m = std::isfinite(c.width_m) ? c.width_m : 0.0;

  MotionState& mean = track.estimate.mean;
  mean.x_m = c.z.x_m;
  mean.y_m = c.z.y_m;
  mean.speed_mps = ego.known ? std::max(0.0, p.birth_speed_share * ego.speed_mps) : 0.0;
  double var_phi = p.birth_sigma_phi * p.birth_sigma_phi;
  if (state.map && !state.map->empty() && frame.in_map) {
    const MapProjection lane = state.map->project(c.z.x_m, c.z.y_m);
    mean.course_rad = wrap_angle(lane.heading_rad);
    mean.yaw_rate_rps = mean.speed_mps * lane.curvature_per_m;
  } else if (ego.known) {
    mean.course_rad = wrap_angle(ego.heading_rad);
  } else {
    var_phi = kPi * kPi;
  }

  auto& cov = track.estimate.covariance;
  cov[0][0] = c.z.var_x;
  cov[1][1] = c.z.var_y;
  cov[0][1] = cov[1][0] = c.z.cov_xy;
  cov[2][2] = p.birth_sigma_v * p.birth_sigma_v;
  cov[3][3] = var_phi;
  cov[4][4] = p.birth_sigma_omega * p.birth_sigma_omega;
  track.life.record(true, state.life_cycle);
  ++state.counts.births;
  ++state.alive_count;
}

double distance_m2(const Track& track, const TrackerEgo& ego) {
  const double dx = track.estimate.mean.x_m - ego.x_m, dy = track.estimate.mean.y_m - ego.y_m;
  return dx * dx + dy * dy;
}

// The first free slot; in a full table the farthest tentative track, when it is farther than the detection, makes room.
int32_t find_slot(Tracker::State& state, const Candidate& c, const TrackerEgo& ego) {
  int32_t farthest = -1;
  for (int32_t slot = 0; slot < int32_t(state.tracks.size()); ++slot) {
    const Track& track = state.tracks[std::size_t(slot)];
    if (!track.alive) return slot;
    if (track.life.state == TrackState::kConfirmed) continue;
    if (farthest < 0 || distance_m2(track, ego) > distance_m2(state.tracks[std::size_t(farthest)], ego))
      farthest = slot;
  }
  ++state.counts.overflow;
  if (farthest < 0 || !(distance_m2(state.tracks[std::size_t(farthest)], ego) > c.ego_distance_m2)) return -1;
  state.bury(state.tracks[std::size_t(farthest)]);
  return farthest;
}

}  // namespace

TrackerParams make_sane(TrackerParams p) noexcept {
  p.window = std::clamp(p.window, 1, kMaxWindow);
  p.track_capacity = std::clamp(p.track_capacity, 1, 4096);
  p.detection_capacity = std::clamp(p.detection_capacity, 1, 4096);
  p.max_silence_s = p.max_silence_s >= 0.0 ? std::min(p.max_silence_s, kMaxPredict_s) : kMaxPredict_s;
  p.predict_step_s = p.predict_step_s >= 1e-3 ? p.predict_step_s : 1e-3;
  p.horizon_step_s = p.horizon_step_s >= 1e-3 ? std::min(p.horizon_step_s, kMaxPredict_s) : 1e-3;
  p.horizon_s = p.horizon_s >= 0.0 ? std::min(p.horizon_s, kMaxPredict_s) : 0.0;
  return p;
}

ProcessNoise make_process_noise(const TrackerParams& params) noexcept {
  ProcessNoise noise;
  for (int i = 0; i < kTrackStateSize; ++i) noise.variance_per_s[i] = params.q_diag[i] / params.q_step_s;
  noise.max_step_s = params.predict_step_s;
  return noise;
}

Tracker::State::State(const TrackerParams& p, const TrackMap* m)
    : params(make_sane(p)),
      map(m),
      life_cycle{params.window, params.confirm_hits, params.keep_hits},
      noise(make_process_noise(params)),
      no_noise{{}, params.predict_step_s},
      tracks(std::size_t(params.track_capacity)),
      candidate_of_slot(std::size_t(params.track_capacity), -1),
      munkres(params.track_capacity, params.detection_capacity, params.track_capacity * params.detection_capacity) {
  candidates.reserve(std::size_t(params.detection_capacity));
  newborn.reserve(std::size_t(params.detection_capacity));
}

void Tracker::State::bury(Track& track) {
  track.alive = false;
  ++counts.deaths;
  --alive_count;
}

bool Tracker::State::bury_silent(Track& track, int64_t now_ns) {
  if (!(seconds_between(track.measured_ns, now_ns) > params.max_silence_s)) return false;
  bury(track);
  return true;
}

Tracker::Tracker(const TrackerParams& params, const TrackMap* map) : state_(std::make_unique<State>(params, map)) {}
Tracker::~Tracker() = default;

void Tracker::step(const TrackerFrame& unchecked, TrackId* track_of_detection) noexcept {
  State& s = *state_;
  TrackerFrame frame = unchecked;
  frame.ego = make_sane(unchecked.ego);
  s.in_map = frame.in_map;
  ++s.counts.iterations;
  for (Track& track : s.tracks)
    if (track.alive) s.bury_silent(track, frame.stamp_ns);

  select_candidates(s, frame);
  associate(s);

  for (std::size_t slot = 0; slot < s.tracks.size(); ++slot) {
    Track& track = s.tracks[slot];
    if (!track.alive) continue;
    track.detection = -1;
    const int32_t hit = s.candidate_of_slot[slot];
    bool lives = true;
    if (hit >= 0) {
      take_hit(s, track, s.candidates[std::size_t(hit)]);
      ++s.counts.hits;
      lives = track.life.record(true, s.life_cycle);
    } else {
      predict_to(s, track, frame.stamp_ns);
      if (is_observed(frame, track.estimate.mean)) {  // what no sensor could see is no iteration
        ++s.counts.misses;
        lives = track.life.record(false, s.life_cycle);
      }
    }
    if (!lives || !is_sound(track.estimate)) s.bury(track);
  }

  // Nearest first: what is born early is never put out for a later one, and row order does not matter.
  s.newborn.clear();
  for (int32_t i = 0; i < int32_t(s.candidates.size()); ++i)
    if (s.candidates[std::size_t(i)].slot < 0) s.newborn.push_back(i);
  std::sort(s.newborn.begin(), s.newborn.end(), [&s](int32_t a, int32_t b) {
    const double da = s.candidates[std::size_t(a)].ego_distance_m2, db = s.candidates[std::size_t(b)].ego_distance_m2;
    return std::tie(da, a) < std::tie(db, b);
  });
  for (const int32_t i : s.newborn) {
    const Candidate& c = s.candidates[std::size_t(i)];
    const int32_t slot = find_slot(s, c, frame.ego);
    if (slot >= 0) give_birth(s, s.tracks[std::size_t(slot)], c, frame, frame.ego);
  }

  if (!track_of_detection) return;
  std::fill_n(track_of_detection, frame.detections.count, kNobody);
  for (std::size_t slot = 0; slot < s.tracks.size(); ++slot) {
    const Track& track = s.tracks[slot];
    if (track.alive && track.detection >= 0)
      track_of_detection[track.detection] = make_track_id(uint32_t(slot), track.generation);
  }
}

void Tracker::predict(int64_t stamp_ns) noexcept {
  State& s = *state_;
  for (Track& track : s.tracks) {
    if (!track.alive || s.bury_silent(track, stamp_ns)) continue;
    track.detection = -1;
    predict_to(s, track, stamp_ns);
    if (!is_sound(track.estimate)) s.bury(track);
  }
}

void Tracker::restart() noexcept {
  for (Track& track : state_->tracks) track.alive = false;
  state_->alive_count = 0;
}

int32_t Tracker::track_count() const noexcept { return state_->alive_count; }
TrackerCounts Tracker::counts() const noexcept { return state_->counts; }

}  // namespace overtake
