// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of preset `best` as a policy (pipeline/README.md, "Tracker of best"): a CVTR filter whose yaw rate goes
// to that of the lane, an existence score instead of M of N, and one track for one car.
#pragma once

#include <cmath>
#include <limits>

#include "pipeline/track/global_assignment.h"
#include "pipeline/track/lane_motion.h"
#include "pipeline/track/lane_path.h"
#include "pipeline/track/place_grid.h"
#include "pipeline/track/replay_tracker.h"

namespace overtake {

// A lost track was confirmed before. It is published as tentative, and keeps its id for its car.
enum class LaneStage : int32_t { kTentative, kConfirmed, kLost };

// No padding: equal tracks have equal bytes.
struct LaneTrack {
  LaneEstimate estimate;
  // Motion: the lane at the estimate's place, and how steadily the car drives.
  LanePull lane;
  double lag_along = 0, lag_across = 0;  // sums of the innovations, in standard deviations, fading
  double along_share = 1;                // mean square of the innovations along, in standard deviations, fading
  // The noise of a manoeuvre, of a new speed, and of a new course, goes on for so long.
  double manoeuvre_s = 0, brake_s = 0, turn_s = 0;
  // Heading: measured where two faces of the car are seen, else along the course.
  double heading_rad = 0, heading_rate_rps = 0;
  double heading_var = 0;  // of heading_rad
  double heading_cov = 0, heading_rate_var = 0;
  double heading_age_s = 1e3;  // since it was measured
  // Existence.
  double score = 0;   // log odds
  double misses = 0;  // since the last hit; those that follow each other soon count in part
  // Since the measurement that the estimate was corrected with last: the last hit; while nothing has told the course,
  // the first one (find_course).
  double uncorrected_s = 0;
  int64_t counted_ns = 0;            // stamp of the last iteration that was a hit or a miss
  uint64_t history = 0;              // bit k: hit k iterations ago
  int64_t class_votes = 0;           // of its detections: 1 of a car, -1 of debris, limited
  double length_m = 0, width_m = 0;  // of the last detection; 0: never measured
  int32_t age = 0, hits = 0;         // iterations; hits since its initiation
  LaneStage stage = LaneStage::kTentative;
  Visibility visibility = Visibility::kSeen;
  int32_t is_new = 0;          // 1: the last iteration confirmed it
  int32_t heading_misses = 0;  // measured headings in a row that contradict it
  int32_t turned_votes = 0;    // of detections: 1 with the front at the other end, else -1; not below 0
  int16_t has_course = 1;      // 0: nothing has told its course yet (see spread)
  int8_t is_backwards = 0;  // 1: the heading was last measured at more than 90 deg from the course of a car that moved
  int8_t had_row = 0;       // 1: a pushed row was one of its hits
  int32_t segment = -1;     // of the map, a hint
  int32_t asks_map = 0;     // 1: the last iteration could use the map
};

inline constexpr double kDrives_mps = 5.0;  // a slower car follows no lane
// Whether the car moves, and not only by the errors of its places, which turn the course of one that stands round.
inline bool moves_for_sure(const LaneTrack& s) noexcept {
  constexpr double kRests_mps = 1.0, kRestVariances = 4.0;
  const double speed_mps = s.estimate.mean.speed_mps;
  return speed_mps >= kRests_mps && speed_mps * speed_mps >= kRestVariances * s.estimate.covariance[2][2];
}
inline constexpr int32_t kSteadyHits = 5;  // with fewer hits the state has not settled

class LanePolicy {
 public:
  using State = LaneTrack;

  LanePolicy(const TrackerParams& params, const CircuitMap* map, const Allocator& allocator);

  void predict(State& s, double dt_s) const noexcept { move(s, dt_s, true); }
  Place place(const State& s) const noexcept { return {s.estimate.mean.x_m, s.estimate.mean.y_m}; }
  bool is_sound(const State& s) const noexcept { return overtake::is_sound(s.estimate); }
  Effort associate(const TrackView<State>& tracks, const Iteration& it, int32_t* measurement_of_slot) noexcept;
  void update(int32_t slot, State& s, double dt_s, const Measurement& z) noexcept;
  State initiate(const Measurement& z, const Iteration& it) const noexcept;
  bool record(int32_t slot, State& s, bool hit) const noexcept;
  bool is_confirmed(const State& s) const noexcept { return s.stage == LaneStage::kConfirmed; }
  State publishable(const State& s, bool) const noexcept;
  void write(const State& s, TrackTable& t, std::size_t i) const noexcept;
  bool may_miss(const State& s) const noexcept { return !of_rows_ || s.had_row != 0; }
  void leave_view(State& s) const noexcept;
  void write_optional(const State& s, OptionalTrackTable& t, std::size_t i) const noexcept;
  void write_paths(std::span<const State> states, PathTable& t) const noexcept;

  // One track for one car.
  void move_with_ego(State& s, double x_m, double y_m) const noexcept;
  void look_round(const TrackView<State>& tracks, const Iteration& it) noexcept;
  int32_t find_elder(const TrackView<State>& tracks, int32_t slot) const noexcept;
  bool join(State& elder, const State& younger, bool younger_is_newer) const noexcept;
  int32_t find_owner(const TrackView<State>& tracks, const Iteration& it, int32_t measurement) const noexcept;

  // For the assignment. The lane is that at the track's state, which is at most a few frames old.
  struct Estimate : LaneEstimate {
    bool is_lost = false;
    double guess_m2 = 0;  // see innovate_guess
  };
  using Ahead = MotionState;
  Ahead look_ahead(const State& s, double dt_s) const noexcept;
  Place place(const Ahead& ahead) const noexcept { return {ahead.x_m, ahead.y_m}; }
  Estimate estimate(const State& s, double dt_s, const Ahead& ahead) const noexcept;
  bool cost(const Estimate& e, const Measurement& z, double& cost) const noexcept;
  bool alone_cost(const State& s, double& cost) const noexcept;
  double travel_m(const State& s, double dt_s) const noexcept { return s.estimate.mean.speed_mps * std::fabs(dt_s); }
  Doubt doubt(const State& s) const noexcept;

 private:
  // lane_tracker.cpp
  void move(State& s, double dt_s, bool forward_in_time) const noexcept;
  bool comes_to_rest(const State& s) const noexcept;
  double find_curvature(const MapProjection& at) const noexcept;
  void look_at_lane(State& s) const noexcept;
  void follow_map_use(State& s) const noexcept;
  bool is_guessed(const State& s) const noexcept;
  bool may_accelerate(const State& s) const noexcept;
  double speed_noise(const State& s) const noexcept;
  CourseNoise noise_of(const State& s) const noexcept;
  void turn_heading(State& s, double dt_s, bool forward_in_time) const noexcept;
  void measure_front(State& s, const Measurement& z) const noexcept;
  void measure_heading(State& s, const Measurement& z) const noexcept;
  void doubt_lane_course(State& s, const Measurement& z) const noexcept;
  bool is_free(const State& s) const noexcept;
  bool waits_for_course(const State& s, const Measurement& z) const noexcept;
  void watch_for_manoeuvre(State& s, const Measurement& z, double dt_s, bool error_lasts) const noexcept;
  Measurement with_lasting_error(const Measurement& z) const noexcept;

  // lane_existence.cpp
  double range_of(double dx, double dy) const noexcept;
  void look_from_ego(const TrackView<State>& tracks) noexcept;
  void find_detectable(const TrackView<State>& tracks, const Iteration& it) noexcept;
  bool is_clutter(const Measurement& z) const noexcept;
  bool is_moving_car(const State& s, const Measurement& z) const noexcept;
  void list_unclaimed(const TrackView<State>& tracks, const Iteration& it, const int32_t* measurement_of_slot) noexcept;
  double evidence_of(const Measurement& z, bool in_part) const noexcept;
  bool is_piece_of_wall(const State& s, const Measurement& z) const noexcept;
  double clutter_near(const Measurement& z) const noexcept;
  void score_hit(int32_t slot, State& s, const Measurement& z, const Innovation* innovation) noexcept;
  void begin_existence(State& s, const Measurement& z) const noexcept;
  bool was_passed(int32_t slot, const State& s) const noexcept;
  bool has_coasted(const State& s, double most_m) const noexcept;
  bool is_of_place_before(const State& s) const noexcept;
  void lose(State& s) const noexcept;
  static int64_t limit_votes(int64_t votes) noexcept;

  // lane_output.cpp
  PathKind path_of(const State& s) const noexcept;
  PathNoise path_noise(const State& s) const noexcept;
  void spread_path(const State& s, int32_t first, PathTable& t) const noexcept;

  // lane_identity.cpp
  void find_places(const TrackView<State>& tracks, const Iteration& it) noexcept;
  bool is_same_place(const State& s, Place place, Place other, double share) const noexcept;
  bool may_come_from(const State& lost, int32_t lost_slot, const State& found, int32_t slot,
                     double& distance_m) const noexcept;
  bool took_over(const State& found, int32_t slot, const State& lost, int32_t lost_slot) const noexcept;
  bool pass_each_other(const State& a, const State& b) const noexcept;
  bool is_one_car(const State& elder, Place elder_place, const State& s, Place place) const noexcept;
  bool is_elder(const TrackView<State>& tracks, int32_t other, int32_t slot, double& distance_m) const noexcept;

  const TrackerParams params_;
  const LaneTrackerParams lane_;
  const CircuitMap* const map_;
  GlobalAssignment<LanePolicy> assignment_;
  LanePath path_;
  Arena arena_;
  // Of the iteration under way, by slot: the tracks at its stamp, whether and how probably its sensors detect them (and
  // would do so if nothing hid them), and the score of a hit.
  Place* place_ = nullptr;
  double *range_m_ = nullptr, *bearing_rad_ = nullptr, *p_detect_ = nullptr, *p_in_view_ = nullptr,
         *hit_score_ = nullptr, *miss_score_ = nullptr;
  Visibility* visibility_ = nullptr;
  bool* in_part_ = nullptr;       // another car may hide a part of it
  int32_t* confirmed_ = nullptr;  // slots of the confirmed tracks
  int32_t confirmed_count_ = 0;
  PlaceGrid grid_;             // slots by place_
  int32_t* owners_ = nullptr;  // slots of the confirmed tracks that were seen lately
  int32_t owner_count_ = 0;
  double since_far_jump_s_ = std::numeric_limits<double>::infinity();  // of the ego pose
  // By measurement: whether a confirmed track takes it; the places of the others.
  bool* claimed_ = nullptr;
  Place* unclaimed_ = nullptr;
  int32_t unclaimed_count_ = 0;
  int32_t asks_map_ = 0;
  int64_t stamp_ns_ = 0;
  double rows_reach_m_ = 0;  // of pushed rows: how far off their places may be
  bool knows_range_ = true;  // of the iteration's places from the ego vehicle
  bool are_rows_ = false;    // all measurements are pushed rows
  bool only_rows_ = false;   // the same, and no map is asked
  bool of_rows_ = false;     // the iteration is one of pushed rows: nothing tells where their source looks
  TrackerEgo ego_;
};

// The parameters that LanePolicy reads, as FrameRule::params.
inline constexpr const char* kLaneTrackerParams =
    "lane_tracker tracker.r_x tracker.r_y tracker.birth_sigma_speed tracker.birth_sigma_course_deg "
    "tracker.birth_sigma_yaw_rate tracker.gate_d2 tracker.gate_m tracker.window tracker.max_silence_s "
    "tracker.horizon_s tracker.horizon_step_s tracker.work_limit vehicle.length_m vehicle.width_m";

static_assert(sizeof(LaneTrack) == 61 * 8 + 10 * 4);

extern template class ReplayTracker<LanePolicy>;
using LaneTracker = ReplayTracker<LanePolicy>;
MakeTracker make_lane_tracker;

}  // namespace overtake
