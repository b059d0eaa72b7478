// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Tracks and their paths as copies predicted to a time the caller names; the tracker's own state stays as it is.
#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/math.h"
#include "core/table.h"
#include "pipeline/track/tracker_state.h"

namespace overtake {
namespace {

// publish_ns, but at most so long from the other stamp.
int64_t limit_stamp(int64_t stamp_ns, int64_t publish_ns, double most_s) {
  const double dt_s = seconds_between(stamp_ns, publish_ns);
  const auto most_ns = int64_t(most_s * 1e9);
  if (dt_s > most_s) return stamp_ns + most_ns;  // no overflow: publish_ns lies beyond
  if (dt_s < -most_s) return stamp_ns - most_ns;
  return publish_ns;
}

// psi of the last detection, turned on by omega. An L-shape does not tell front from rear: where the track is sure to
// drive, its course does. Not in the vehicle frame: there a car that is being overtaken moves backwards. No heading
// ever measured: the course.
double choose_heading(const Track& track, bool in_map, double min_speed_mps) {
  const MotionState& m = track.estimate.mean;
  if (!track.has_heading) return m.course_rad;
  const bool drives = in_map && track.life.state == TrackState::kConfirmed && m.speed_mps >= min_speed_mps;
  const bool opposes = std::fabs(wrap_angle(track.heading_rad - m.course_rad)) > kHalfPi;
  return drives && opposes ? wrap_angle(track.heading_rad + kPi) : track.heading_rad;
}

void write_estimate(const TrackEstimate& estimate, TrackTable& t, std::size_t i) {
  t.x_m[i] = estimate.mean.x_m;
  t.y_m[i] = estimate.mean.y_m;
  t.speed_mps[i] = estimate.mean.speed_mps;
  t.course_rad[i] = estimate.mean.course_rad;
  t.yaw_rate_rps[i] = estimate.mean.yaw_rate_rps;
  int32_t entry = 0;
  for (int32_t r = 0; r < kTrackStateSize; ++r)
    for (int32_t c = 0; c <= r; ++c) t.covariance[entry++][i] = estimate.covariance[r][c];
}

TrackEstimate read_estimate(const TrackTable& t, std::size_t i) {
  TrackEstimate estimate;
  estimate.mean = {t.x_m[i], t.y_m[i], t.speed_mps[i], t.course_rad[i], t.yaw_rate_rps[i]};
  int32_t entry = 0;
  for (int32_t r = 0; r < kTrackStateSize; ++r)
    for (int32_t c = 0; c <= r; ++c) estimate.covariance[r][c] = estimate.covariance[c][r] = t.covariance[entry++][i];
  return estimate;
}

uint32_t stale_flag(int64_t measured_ns, int64_t stamp_ns) {
  return seconds_between(measured_ns, stamp_ns) > kTrackStale_s ? kTrackStale : 0;
}

void write_track(const Track& track, double heading_rad, TrackTable& t) {
  const auto i = std::size_t(t.count++);
  t.id[i] = track.id;
  t.state[i] = int32_t(track.life.state);
  t.stamp_ns[i] = track.state_ns;
  t.measured_ns[i] = track.measured_ns;
  write_estimate(track.estimate, t, i);
  t.heading_rad[i] = heading_rad;
  t.length_m[i] = track.length_m;
  t.width_m[i] = track.width_m;
  t.age[i] = track.life.age;
  t.hits[i] = track.life.hits();
  t.detection[i] = track.detection;
  t.flags[i] = track.flags | stale_flag(track.measured_ns, track.state_ns);
}

void write_path(TrackEstimate estimate, const ProcessNoise& noise, double step_s, PathTable& t) {
  for (int32_t k = 0; k < t.points_per_track; ++k) {
    predict(estimate, noise, step_s);
    const auto i = std::size_t(t.count++);
    t.x_m[i] = estimate.mean.x_m;
    t.y_m[i] = estimate.mean.y_m;
    t.course_rad[i] = estimate.mean.course_rad;
    t.speed_mps[i] = estimate.mean.speed_mps;
    t.var_x[i] = estimate.covariance[0][0];
    t.var_y[i] = estimate.covariance[1][1];
    t.cov_xy[i] = estimate.covariance[1][0];
  }
}

}  // namespace

int32_t count_path_points(const TrackerParams& unchecked) noexcept {
  const TrackerParams params = make_sane(unchecked);
  return int32_t(params.horizon_s / params.horizon_step_s + 0.5);
}

void Tracker::snapshot(TrackTable& states) const noexcept {
  const State& s = *state_;
  OVT_CHECK(states.capacity >= s.params.track_capacity);
  states.count = 0;
  for (int32_t slot = 0; slot < s.params.track_capacity; ++slot) {
    if (!s.tracks[slot].alive) continue;
    write_track(s.tracks[slot], choose_heading(s.tracks[slot], s.in_map, s.params.heading_speed_mps), states);
    const auto i = std::size_t(states.count - 1);
    states.detection[i] = s.shown_detection[slot];
    states.flags[i] = s.shown_flags[slot] | (states.flags[i] & kTrackStale);
  }
}

void Tracker::predict(int64_t stamp_ns, TrackTable& states) const noexcept {
  const State& s = *state_;
  OVT_CHECK(states.capacity >= s.params.track_capacity);
  states.count = 0;
  for (int32_t slot = 0; slot < s.params.track_capacity; ++slot) {
    if (!s.tracks[slot].alive || s.is_silent(s.tracks[slot], stamp_ns)) continue;
    Track track = s.tracks[slot];
    predict_track_to(track, s.noise, stamp_ns);
    if (!is_sound(track.estimate)) continue;
    track.detection = -1;
    track.flags = kTrackCoasting | kTrackUnobserved;
    write_track(track, choose_heading(track, s.in_map, s.params.heading_speed_mps), states);
  }
}

// A track's own time is its last measurement's, which lies this near to its iteration's.
int64_t limit_publish_ns(int64_t stamp_ns, int64_t publish_ns) noexcept {
  return limit_stamp(stamp_ns, publish_ns, kMaxPredict_s - kMaxStampSpread_s);
}

void publish_tracks(const TrackerParams& unchecked, const TrackTable& states, int64_t publish_ns, TrackTable& tracks,
                    PathTable* paths) noexcept {
  const TrackerParams params = make_sane(unchecked);
  const ProcessNoise noise = make_process_noise(params);
  if (&states != &tracks) copy_table(states, tracks);
  if (paths) {
    paths->count = 0;
    paths->points_per_track = count_path_points(params);
    OVT_CHECK(paths->capacity >= tracks.count * paths->points_per_track);
  }
  for (std::size_t i = 0; i < std::size_t(tracks.count); ++i) {
    const int64_t state_ns = tracks.stamp_ns[i];
    tracks.stamp_ns[i] = limit_stamp(state_ns, publish_ns, kMaxPredict_s);
    const double dt_s = seconds_between(state_ns, tracks.stamp_ns[i]);
    TrackEstimate estimate = read_estimate(tracks, i);
    tracks.heading_rad[i] = wrap_angle(tracks.heading_rad[i] + estimate.mean.yaw_rate_rps * dt_s);
    predict(estimate, noise, dt_s);
    write_estimate(estimate, tracks, i);
    tracks.flags[i] = (tracks.flags[i] & ~kTrackStale) | stale_flag(tracks.measured_ns[i], publish_ns);
    if (paths) write_path(estimate, noise, params.horizon_step_s, *paths);
  }
}

void Tracker::publish(int64_t publish_ns, TrackTable& tracks, PathTable* paths) const noexcept {
  snapshot(tracks);
  publish_tracks(state_->params, tracks, publish_ns, tracks, paths);
}

void Tracker::publish(const TrackTable& states, int64_t publish_ns, TrackTable& tracks,
                      PathTable* paths) const noexcept {
  publish_tracks(state_->params, states, publish_ns, tracks, paths);
}

double Tracker::path_step_s() const noexcept { return state_->params.horizon_step_s; }
int32_t Tracker::path_points() const noexcept { return count_path_points(state_->params); }

}  // namespace overtake
