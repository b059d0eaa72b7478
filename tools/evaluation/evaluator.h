// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Compares the library's results of each frame with the simulator's truth and writes tables:
//
//   scans       one row per scan: tp fp fn tn of non-ground (points with a label), points without a label
//   car_points  one per car, scan and 10 m of range: its points, and those found to be non-ground
//   cars        one per car and frame: position, points, clusters by truth and by the paper's rule
//               (cluster_tally.h: boxed), detected, confirmed track
//   clusters    one per frame: clusters that mix a car with another object, or two cars
//               (NaN, like points and clusters of cars and of euclid, if the log has no surface of each point)
//   boxes       one per frame: mixed clusters by the paper's rule
//   seams       one per car that several sensors see with 3 non-ground points or more: whether one cluster contains a
//               point of each of them
//   ego         one per frame: the true speed and yaw rate
//   ego_heading one per frame: error of the ego heading that the pipeline got, and with its own correction
//   detections  one per detection: position, its car (-1 none) and its errors
//   tracks      one per track: the same with speed, course, rate of the course (yaw_rate_rps), NEES, age of its data;
//               rate and NEES only at cars faster than kMovingMps. Without ego poses as
//               tracks_in_map.h has it, without yaw rate and NEES
//   parked_tracks   one per track at no car that is on a parked vehicle: it is in no other table of tracks
//   existence   one per track of a method that publishes the probability of existence
//   motion      one per car and frame, at publish time: what the car truly does; slip is heading minus course
//   paths       one per predicted path of a confirmed track at a car, and horizon (path_judge.h)
//   centres     one per detection at a car: the error of its centre in the axes of the car, and its square in units of
//               the published covariance (NaN without one)
//   debris      one per frame that sees debris: its points, and detections of class debris on it
//   false_detections   one per detection at no car: position, the surface of most of its points (-1 unknown), its
//               place on the map, the roll of the ego
//   innovations one per detection that updated a track: NIS with the parameters tracker.r_x and r_y
//   innovations_own   the same with the covariance that the method publishes with the detection
//   times       one per stage that ran: nanoseconds
//   cuts        of a piece of a log (pieces.h): one per track at the frames before and at its end
// and, on every N-th frame (evaluator_baselines.cpp), for the points with a label:
//   grid        the 2.5-D grid: like scans
//   auto_label  the automatic labels (tools/evaluation/baselines/label_ground.h) compared with the truth: like scans
//   scans_auto  grid_auto    the pipeline and the grid compared with the automatic labels: like scans
//   euclid      Euclidean clusters of the points found to be non-ground, by radius: one per car, by truth and inside
//   euclid_mixed    the same: mixed clusters of the frame
//
// Detections are compared with the truth at their own stamp, tracks at publish time, which is the end of the frame: its
// first stamp plus a period. Errors are estimate minus truth, in the map; "veh" is the same error rotated to the true
// ego's frame. While the pipeline does not know the ego pose, detections are taken to the map by the true one. A
// detection or a track is at the nearest car within the gate, else false. A detection of class debris is
// at no car, and false unless most of its points are of debris or of a car; a right one is in no table of detections.
// A track is on a parked vehicle while most points of its last detection lie on one, unless that is of class debris.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/evaluation/cluster_tally.h"
#include "tools/evaluation/path_judge.h"
#include "tools/evaluation/places.h"
#include "tools/evaluation/table.h"
#include "tools/evaluation/tracks_in_map.h"
#include "tools/evaluation/truth_log.h"

namespace overtake::evaluation {

inline constexpr double kGateM = 4.0, kNearestM = -100, kFarthestM = 150;

// The kind of a surface. Noise (smoke, blooming, the own car) counts as ground: nothing to find, as in the paper.
Kind kind_of(uint16_t surface);
inline bool is_positive(Kind kind) { return kind == Kind::kCar || kind == Kind::kObstacle; }
int32_t car_of(uint16_t surface);  // -1: not a car

// The points of a frame that have a label, vehicle frame.
struct CloudPoints {
  std::vector<float> x_m, y_m, z_m;
  std::vector<uint16_t> surface;  // empty if the log has no surface of each point
  std::vector<bool> found;        // non-ground
  std::vector<int32_t> sensor;
  std::vector<CarPlace> cars;
};

using Tables = std::map<std::string, Table>;
Tables make_tables();
void write_tables(const std::string& folder, const Tables& tables);
// Throws io::Error for a missing file and for a missing column: an empty table would look like a run without findings.
Tables read_tables(const std::string& folder);

// Results of another source for a frame's detections and tracks (oracles of later stages); the columns outlive the
// call.
struct Replayed {
  ovt_detections detections;
  ovt_reader* tracks = nullptr;  // positioned at the frame of these detections; null: no tracks
};

class Evaluator {
 public:
  // truth_shift_ns: negative control, compares with the truth of this much later.
  Evaluator(const TruthLog& log, const ovt_params& params, int64_t truth_shift_ns = 0);
  // Evaluates the baselines (tools/evaluation/baselines) on every N-th of the same clouds; 0: never.
  void use_baselines(int32_t every) { baselines_every_ = every; }

  // Only every N-th frame is compared with the truth; the pipeline still gets all of them.
  void compare_every(int32_t frames) { compare_every_ = frames; }
  // Leaves out the table of times.
  void leave_out_times() { with_times_ = false; }
  // The ego poses that the pipeline got, if they are not those of the log; they outlive the evaluator.
  void use_poses(const std::vector<PublishedPose>& poses) { poses_ = &poses; }
  // The circuit from which the paths' cars change their offset, if the truth does not have it. Throws io::Error.
  void use_circuit(const std::string& map_file) { paths_.use_circuit(map_file); }

  // For a piece of a log (pieces.h): times count from the log's first stamp instead of the first frame's.
  void start_at(int64_t first_ns) { first_ns_ = first_ns; }
  // The piece begins: forgets the rows of its warm-up, and notes the tracks at its last frame.
  void begin_piece();
  // The piece ends: notes the tracks at its last frame.
  void end_piece() { note_cut(); }
  // A frame after the end of the piece: only its truth counts, for predicted paths.
  void look_ahead(const LogFrame& frame);

  // Call before the scans of this frame are pushed.
  void expect(const LogFrame& frame) { frame_ = &frame; }
  void expect_nothing() { frame_ = nullptr; }
  // Call in the library's callback. Throws std::runtime_error for a frame without expect().
  void add(ovt_reader* reader, const Replayed* relayed = nullptr);
  // Runs the baselines on the last frame if they are due: slow, and not part of the library's times.
  void evaluate_baselines();
  const Tables& tables();  // sorted by frame

 private:
  struct Prior {
    double x_m, y_m, speed_mps, course_rad, xx, xy, yy;
    int64_t stamp_ns;
  };
  void skip(const ovt_frame_info& info, ovt_reader* reader);
  void add_labels(ovt_reader* reader, const ovt_frame_info& info);
  // `surfaces`: of each point, null unknown; `own`: the ego's car, -1 none.
  void add_scan(const ovt_labels& labels, int32_t sensor, const std::vector<uint16_t>* surfaces, int32_t own,
                ClusterTally& tally, SeamTally& seams);
  void add_ego_heading(const ovt_frame_info& info);
  void add_detections(const ovt_frame_info& info, const ovt_detections& detections);
  void add_false_detection(const ovt_detections& detections, int32_t row, const CarTruth* ego);
  void add_motion(int64_t publish_ns, const std::vector<CarTruth>& cars);
  void add_tracks(const ovt_frame_info& info, const ovt_tracks& tracks, const ovt_detections& detections,
                  const std::vector<CarTruth>& cars);
  void remember_tracks(const ovt_frame_info& info, const ovt_tracks& tracks);
  void note_cut();
  void add_times(ovt_reader* reader);
  void add_ground_baselines(const CloudPoints& cloud);
  void add_euclid(const CloudPoints& cloud);

  int32_t main_surface(int32_t cluster) const;
  const std::vector<PublishedPose>& poses() const { return poses_ ? *poses_ : log_.poses(); }
  std::vector<CarTruth> cars_at(int64_t stamp_ns) const { return log_.cars_at(stamp_ns + truth_shift_ns_); }

  const TruthLog& log_;
  const int64_t truth_shift_ns_;
  int32_t baselines_every_ = 0, compare_every_ = 1;
  bool with_times_ = true;
  const std::vector<PublishedPose>* poses_ = nullptr;  // null: those of the log
  const double r_x_, r_y_;
  const LogFrame* frame_ = nullptr;
  Tables tables_;
  std::map<uint64_t, Prior> prior_;
  std::set<uint64_t> parked_;  // tracks (note_parked)
  PathJudge paths_;
  TracksInMap tracks_in_map_;
  struct Place {
    double id, x_m, y_m;
  };
  int64_t last_frame_ = -1;
  std::vector<Place> last_tracks_;  // at last_frame_
  int64_t first_ns_ = -1;
  double frame_number_ = 0, time_s_ = 0;
  // Of the current frame, by car.
  std::map<int32_t, double> course_rate_;
  std::map<int32_t, int64_t> points_, clusters_, boxed_, detected_, tentative_, confirmed_;
  std::map<int64_t, std::map<uint16_t, int64_t>> surfaces_;  // points of each cluster, by surface
  int64_t debris_points_ = 0, debris_found_ = 0;
  CloudPoints due_;  // for the baselines
  bool is_due_ = false;
};

}  // namespace overtake::evaluation
