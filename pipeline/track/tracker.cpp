// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One iteration, top to bottom: silence, gates and assignment, hits, misses, deaths, births. And which ones run: the
// new one, or, for a frame out of sequence, that one and all after it.
#include "pipeline/track/tracker.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>

#include "core/math.h"
#include "pipeline/track/tracker_state.h"

namespace overtake {
namespace {

TrackerEgo make_sane(const TrackerEgo& ego) {
  const bool finite = std::fabs(ego.x_m) <= kMaxPlace_m && std::fabs(ego.y_m) <= kMaxPlace_m &&
                      std::fabs(ego.heading_rad) <= kMaxAngle_rad && std::fabs(ego.speed_mps) <= kMaxSpeed_mps;
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

bool is_observed(const Iteration& it, const MotionState& place) {
  if (it.sector_count < 0) return true;
  for (int32_t i = 0; i < it.sector_count; ++i)
    if (is_in_sector(it.sectors[i], place.x_m, place.y_m)) return true;
  return false;
}

// A measurement older than the state measures where the track was: back without noise, update, and back to the state's
// time without noise, so that no noise counts twice and time never goes back.
void take_hit(const Tracker::State& state, int32_t slot, const Measurement& c) {
  Track& track = state.tracks[slot];
  const double dt_s = seconds_between(track.state_ns, c.stamp_ns);
  if (const Prediction& gated = state.predictions[slot]; gated.is_at(c.stamp_ns)) {
    turn_heading(track, dt_s);
    track.estimate = gated.estimate;
  } else {
    predict_track(track, state.noise, dt_s);
  }
  update(track.estimate, c);
  if (std::isfinite(c.heading_rad)) {
    track.has_heading = true;
    track.heading_rad = c.heading_rad;
  }
  if (std::isfinite(c.length_m)) track.length_m = c.length_m;
  if (std::isfinite(c.width_m)) track.width_m = c.width_m;
  track.flags = 0;
  track.measured_ns = std::max(track.measured_ns, c.stamp_ns);
  if (dt_s >= 0.0)
    track.state_ns = c.stamp_ns;
  else
    predict_track(track, state.no_noise, -dt_s);
}

void give_birth(Tracker::State& state, int32_t slot, const Iteration& it, int32_t row) {
  const Measurement& c = it.measurement[row];
  const TrackerParams& p = state.params;
  Track& track = state.tracks[slot];
  track = Track{};
  track.alive = true;
  track.id = state.runs_again ? number_birth(state.replay, slot) : state.draw_id(slot);
  track.state_ns = track.measured_ns = c.stamp_ns;
  track.detection = it.row[row];
  track.has_heading = std::isfinite(c.heading_rad);
  track.heading_rad = track.has_heading ? c.heading_rad : 0.0;
  track.length_m = std::isfinite(c.length_m) ? c.length_m : 0.0;
  track.width_m = std::isfinite(c.width_m) ? c.width_m : 0.0;

  MotionState& mean = track.estimate.mean;
  mean.x_m = c.x_m;
  mean.y_m = c.y_m;
  mean.speed_mps = it.ego.known ? std::max(0.0, p.birth_speed_share * it.ego.speed_mps) : 0.0;
  double var_phi = p.birth_sigma_phi * p.birth_sigma_phi;
  if (state.map && !state.map->empty() && it.in_map && it.ask_map) {
    const MapProjection lane = state.map->project(c.x_m, c.y_m);
    mean.course_rad = wrap_angle(lane.heading_rad);
    mean.yaw_rate_rps = mean.speed_mps * lane.curvature_per_m;
  } else if (it.ego.known) {
    mean.course_rad = wrap_angle(it.ego.heading_rad);
  } else {
    var_phi = kPi * kPi;
  }

  auto& cov = track.estimate.covariance;
  cov[0][0] = c.var_x;
  cov[1][1] = c.var_y;
  cov[0][1] = cov[1][0] = c.cov_xy;
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

// The first free slot; in a full table the farthest tentative track, when it is farther than the measurement, makes
// room.
int32_t find_slot(Tracker::State& state, const Iteration& it, int32_t row) {
  const TrackerEgo& ego = it.ego;
  int32_t farthest = -1;
  for (int32_t slot = 0; slot < state.params.track_capacity; ++slot) {
    const Track& track = state.tracks[slot];
    if (!track.alive) return slot;
    if (track.life.state == TrackState::kConfirmed) continue;
    if (farthest < 0 || distance_m2(track, ego) > distance_m2(state.tracks[farthest], ego)) farthest = slot;
  }
  ++state.counts.overflow;
  if (farthest < 0 || !(distance_m2(state.tracks[farthest], ego) > it.ego_distance_m2[row])) {
    ++state.counts.unborn;
    return -1;
  }
  state.bury(state.tracks[farthest], state.counts.displaced);
  return farthest;
}

void update_tracks(Tracker::State& s, Iteration& it) {
  for (int32_t slot = 0; slot < s.params.track_capacity; ++slot) {
    Track& track = s.tracks[slot];
    if (!track.alive) continue;
    track.detection = -1;
    const int32_t hit = s.measurement_of_slot[slot];
    bool lives = true;
    if (hit >= 0) {
      take_hit(s, slot, it.measurement[hit]);
      track.detection = it.row[hit];
      it.track[hit] = track.id;
      ++s.counts.hits;
      lives = track.life.record(true, s.life_cycle);
    } else {
      predict_track_to(track, s.noise, it.stamp_ns);
      track.flags = kTrackCoasting | kTrackUnobserved;
      if (is_observed(it, track.estimate.mean)) {  // what no sensor could see is no iteration
        track.flags = kTrackCoasting;
        ++s.counts.misses;
        lives = track.life.record(false, s.life_cycle);
      }
    }
    if (!lives)
      s.bury(track, s.counts.missed);
    else if (!is_sound(track.estimate))
      s.bury(track, s.counts.unsound);
  }
}

// Nearest first: what is born early is never put out for a later one, and row order does not matter.
void give_births(Tracker::State& s, Iteration& it) {
  int32_t count = 0;
  for (int32_t i = 0; i < it.count; ++i)
    if (it.slot[i] < 0) s.newborn[count++] = i;
  std::sort(s.newborn, s.newborn + count, [&it](int32_t a, int32_t b) {
    const double da = it.ego_distance_m2[a], db = it.ego_distance_m2[b];
    return std::tie(da, a) < std::tie(db, b);
  });
  for (int32_t i = 0; i < count; ++i) {
    const int32_t row = s.newborn[i], slot = find_slot(s, it, row);
    if (slot < 0) continue;
    give_birth(s, slot, it, row);
    it.slot[row] = slot;
    it.track[row] = s.tracks[slot].id;
  }
}

// A pure function of the previous tracks and this input, so a replay gives the same result.
void run_iteration(Tracker::State& s, Iteration& it) {
  s.in_map = it.in_map;
  ++s.counts.iterations;
  s.counts.rejected += it.rejected;
  s.counts.unborn += it.unread;
  s.counts.overflow += it.unread;
  std::fill_n(it.track, it.count, kNobody);
  for (int32_t slot = 0; slot < s.params.track_capacity; ++slot)
    if (Track& track = s.tracks[slot]; track.alive && s.is_silent(track, it.stamp_ns)) s.bury(track, s.counts.silent);
  associate(s, it);
  s.counts.limited += it.limited;
  update_tracks(s, it);
  give_births(s, it);
}

void read_frame(const TrackerParams& params, const TrackerFrame& frame, Iteration& it) {
  it.stamp_ns = frame.stamp_ns;
  it.ego = make_sane(frame.ego);
  it.in_map = frame.in_map;
  it.ask_map = frame.ask_map;
  it.sector_count = std::min(frame.sector_count, kMaxSectors);
  std::copy_n(frame.sectors, std::max(it.sector_count, 0), it.sectors);
  select_measurements(params, frame, it);
}

// Back to the tracks before the iteration that now is at `place`, and from there on again.
void run_again(Tracker::State& s, int32_t place) {
  Iteration& inserted = s.history.at(place);
  std::swap(inserted.before, s.history.at(place + 1).before);
  s.restore(inserted.before);
  s.runs_again = true;
  s.replay.birth_count = 0;
  for (int32_t i = place; i < s.history.count(); ++i) {
    Iteration& it = s.history.at(i);
    s.replay.iteration = i;
    if (i == place) {
      std::fill_n(it.track_before, it.count, kNobody);
    } else {
      s.save(it.before);
      std::swap(it.track, it.track_before);
    }
    run_iteration(s, it);
  }
  s.runs_again = false;
  settle_ids(s, place);
}

void show_nothing(Tracker::State& s) {
  std::fill_n(s.shown_detection, s.params.track_capacity, -1);
  std::fill_n(s.shown_flags, s.params.track_capacity, kTrackCoasting);
}

// Records, for the last frame given, which measurement each track took and which track each measurement went to.
void show(Tracker::State& s, int32_t slot, const Track& track, TrackId* track_of_measurement) {
  if (track_of_measurement && track.detection >= 0) track_of_measurement[track.detection] = track.id;
  if (!s.tracks[slot].alive || s.tracks[slot].id != track.id) return;
  s.shown_detection[slot] = track.detection;
  s.shown_flags[slot] = track.flags;
}

}  // namespace

TrackerParams make_sane(TrackerParams p) noexcept {
  p.window = std::clamp(p.window, 1, kMaxWindow);
  p.track_capacity = std::clamp(p.track_capacity, 1, 4096);
  p.detection_capacity = std::clamp(p.detection_capacity, 1, 4096);
  p.history_iterations = std::clamp(p.history_iterations, 1, 256);
  p.history_s = p.history_s >= 0.0 ? std::min(p.history_s, kMaxPredict_s) : 0.0;
  p.max_silence_s = p.max_silence_s >= 0.0 ? std::min(p.max_silence_s, kMaxPredict_s) : kMaxPredict_s;
  p.predict_step_s = p.predict_step_s >= 1e-3 ? p.predict_step_s : 1e-3;
  p.horizon_step_s = p.horizon_step_s >= 1e-3 ? std::min(p.horizon_step_s, kMaxPredict_s) : 1e-3;
  p.horizon_s = p.horizon_s >= 0.0 ? std::min(p.horizon_s, kMaxPredict_s) : 0.0;
  p.work_limit = p.work_limit >= 1e4 ? std::min(p.work_limit, 1e15) : 1e4;
  return p;
}

ProcessNoise make_process_noise(const TrackerParams& params) noexcept {
  ProcessNoise noise;
  for (int i = 0; i < kTrackStateSize; ++i) noise.variance_per_s[i] = params.q_diag[i] / params.q_step_s;
  noise.max_step_s = params.predict_step_s;
  return noise;
}

Tracker::State::State(const TrackerParams& p, const TrackMap* m, const Allocator& allocator)
    : params(make_sane(p)),
      map(m),
      life_cycle{params.window, params.confirm_hits, params.keep_hits},
      noise(make_process_noise(params)),
      no_noise{{}, params.predict_step_s},
      munkres(params.track_capacity, params.detection_capacity, params.track_capacity * params.detection_capacity,
              allocator) {
  const auto slots = std::size_t(params.track_capacity), rows = std::size_t(params.detection_capacity);
  const std::size_t rows_kept = rows * std::size_t(params.history_iterations);
  const bool built = arena.build(allocator, [&](Carver& carver) {
    tracks = carver.take<Track>(slots);
    generation = carver.take<uint32_t>(slots);
    measurement_of_slot = carver.take<int32_t>(slots);
    predictions = carver.take<Prediction>(slots);
    measured_x_m = carver.take<double>(rows);
    measured_y_m = carver.take<double>(rows);
    within_reach = carver.take<int32_t>(rows);
    nearest = carver.take<uint64_t>(rows);
    newborn = carver.take<int32_t>(rows);
    shown_detection = carver.take<int32_t>(slots);
    shown_flags = carver.take<uint32_t>(slots);
    history.carve(carver, params);
    replay.births = carver.take<ReplayBirth>(rows_kept);
    replay.votes = carver.take<ReplayVote>(rows_kept);
    replay.known = carver.take<TrackId>(rows_kept);
    replay.taken = carver.take<bool>(rows_kept);
    replay.held = carver.take<int32_t>(slots);
    replay.held_until = carver.take<int32_t>(slots);
    replay.held_id = carver.take<TrackId>(slots);
  });
  if (!built) throw std::bad_alloc();
  std::fill_n(tracks, slots, Track{});
  show_nothing(*this);
}

bool Tracker::State::is_silent(const Track& track, int64_t now_ns) const {
  return seconds_between(track.measured_ns, now_ns) > params.max_silence_s;
}

void Tracker::State::bury(Track& track, int64_t& reason) {
  track.alive = false;
  ++reason;
  ++counts.deaths;
  --alive_count;
}

TrackId Tracker::State::draw_id(int32_t slot) { return make_track_id(uint32_t(slot), ++generation[slot]); }

void Tracker::State::save(SavedTracks& saved) const {
  saved.count = 0;
  saved.counts = counts;
  for (int32_t slot = 0; slot < params.track_capacity; ++slot) {
    if (!tracks[slot].alive) continue;
    saved.slot[saved.count] = slot;
    saved.track[saved.count++] = tracks[slot];
  }
}

void Tracker::State::restore(const SavedTracks& saved) {
  for (int32_t slot = 0; slot < params.track_capacity; ++slot) tracks[slot].alive = false;
  for (int32_t i = 0; i < saved.count; ++i) tracks[saved.slot[i]] = saved.track[i];
  alive_count = saved.count;
  const TrackerCounts all = counts;
  counts = saved.counts;
  counts.measurements = all.measurements;
  counts.late = all.late;
  counts.late_frames = all.late_frames;
  counts.refused = all.refused;
  counts.replays = all.replays;
  counts.refiltered = all.refiltered;
}

Tracker::Tracker(const TrackerParams& params, const TrackMap* map, const Allocator& allocator) {
  void* place = nullptr;
  if (!arena_.build(allocator, [&place](Carver& carver) { place = carver.take<State>(1); })) throw std::bad_alloc();
  state_ = new (place) State(params, map, allocator);
}
Tracker::~Tracker() { state_->~State(); }

StepResult Tracker::step(const TrackerFrame& frame, TrackId* track_of_measurement) noexcept {
  State& s = *state_;
  const auto rows = int32_t(frame.measurements.size());
  s.counts.measurements += rows;
  if (track_of_measurement) std::fill_n(track_of_measurement, rows, kNobody);
  show_nothing(s);
  int32_t place = s.history.find_place(frame.stamp_ns);
  const bool too_much = place >= 0 && double(s.history.work_from(place)) > s.params.work_limit;
  if (place < 0 || too_much) {
    s.counts.late += rows;
    ++s.counts.late_frames;
    s.counts.refused += too_much;
    return {.late = true, .limited = too_much};
  }

  const int32_t refiltered = s.history.count() - place;
  Iteration& it = s.history.insert(place);
  read_frame(s.params, frame, it);
  if (refiltered == 0) {
    s.save(it.before);
    run_iteration(s, it);
    for (int32_t slot = 0; slot < s.params.track_capacity; ++slot)
      if (s.tracks[slot].alive) show(s, slot, s.tracks[slot], track_of_measurement);
  } else {
    run_again(s, place);
    ++s.counts.replays;
    s.counts.refiltered += refiltered;
    const SavedTracks& after = s.history.at(place + 1).before;
    for (int32_t i = 0; i < after.count; ++i) show(s, after.slot[i], after.track[i], track_of_measurement);
  }
  bool limited = false;
  for (int32_t i = place; i < s.history.count(); ++i) limited |= s.history.at(i).limited;
  return {.late = false, .limited = limited, .refiltered = refiltered, .work = s.history.work_from(place)};
}

void Tracker::restart() noexcept {
  State& s = *state_;
  for (int32_t slot = 0; slot < s.params.track_capacity; ++slot)
    if (s.tracks[slot].alive) s.bury(s.tracks[slot], s.counts.forgotten);
  s.history.clear();
}

int32_t Tracker::track_count() const noexcept { return state_->alive_count; }
TrackerCounts Tracker::counts() const noexcept { return state_->counts; }

}  // namespace overtake
