// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Looks at every frame of a run and selects the best moment for each picture, using the truth:
//
//   strip     the scan with the most points on a car 10 to 25 m away
//   clouds    the frame with the most points of a car on both sides of a seam (the smaller side counts), in one cluster
//   fits      detections of a car whose slip angle exceeds 2, 25 and 60 deg (by 15 deg at most; most points count)
//   sensors   the rig
//   race      the track, the ego's path and the passes
//
// Pictures without a suitable moment in the run are not drawn.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/pictures.h"
#include "tools/evaluation/places.h"

namespace overtake::evaluation {

// A picture with its score among the pictures of the same name, and its description.
struct NamedPicture {
  std::string name, svg, caption;
  double score = 0;
  std::vector<int64_t> stamps_ns = {};  // of its frames, for pictures of single moments
  std::string log = {};                 // the run of this picture
  std::string path = {};                // of the recording, as it was given
};

class SnapshotPicker {
 public:
  SnapshotPicker(const TruthLog& log, const ovt_params& params, const std::string& map_file);
  void expect(const LogFrame& frame) { frame_ = &frame; }
  // Call in the library's callback, after the evaluator's function.
  void look(ovt_reader* reader);
  std::vector<NamedPicture> finish() const;

 private:
  struct Cars {
    std::vector<CarTruth> all;
    const CarTruth* ego = nullptr;
  };
  Cars cars_at(int64_t stamp_ns) const;
  void look_at_scans(ovt_reader* reader, const Cars& cars);
  void look_at_seams(ovt_reader* reader, const Cars& cars);
  void look_at_fits(ovt_reader* reader);
  void keep_strip(ovt_reader* reader, const io::SensorScan& scan, double car_m, int64_t car_points);
  void keep_clouds(ovt_reader* reader, const Cars& cars, int32_t car);

  const TruthLog& log_;
  const ovt_params params_;
  const std::string map_file_;
  std::vector<io::Mounting> mountings_;
  const LogFrame* frame_ = nullptr;
  int64_t first_ns_ = -1;
  PictureTime now_;
  StripMoment strip_;
  CloudMoment clouds_;
  int64_t clouds_score_ = 0;
  std::vector<FitMoment> fits_;
  std::map<int32_t, double> most_slip_deg_;  // so far, by car
  RacePath race_;
};

// The folder of a run contains its pictures: NAME.svg each, and pictures.json. path: of the recording.
void write_pictures(const std::string& run_folder, const std::vector<NamedPicture>& pictures, const std::string& path);
// The pictures with the highest score of each name, by name; ties: the first.
std::map<std::string, NamedPicture> best_pictures(const std::vector<std::string>& run_folders);
void copy_pictures(const std::string& from_run_folder, const std::string& to_run_folder);

}  // namespace overtake::evaluation
