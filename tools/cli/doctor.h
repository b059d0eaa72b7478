// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Finds what is wrong with a recording for a rig, and gives advice in sentences. Needs the scans and poses in the order
// of the recording; needs no detector.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/circuit_map.h"
#include "pipeline/overtake.h"
#include "tools/cli/doctor_columns.h"
#include "tools/cli/doctor_lines.h"
#include "tools/cli/doctor_walls.h"
#include "tools/io/ego_file.h"
#include "tools/io/map_file.h"
#include "tools/io/rig.h"
#include "tools/io/sensor_scan.h"

namespace overtake::cli {

struct Finding {
  bool wrong = false;  // false: a note; the recording works, but the user may want to know
  std::string about;   // "sensor 'front'", "ego", "recording"
  std::string sentence, advice;
};

// The road as a sensor sees it, in the vehicle frame by the rig's mounting: it should be level, at height 0.
struct Ground {
  double height_m;             // under the sensor
  double pitch_rad, roll_rad;  // of the plane: nose-down slope along x, slope along y
};
// The plane with the most points near it, from points 3 to 30 m away; empty if too few points lie on one plane.
std::optional<Ground> fit_ground(const io::SensorScan& scan, const io::RigSensor& sensor);

class Doctor {
 public:
  explicit Doctor(const io::Rig& rig);

  void add_scan(const io::SensorScan& scan);
  void add_error(int32_t sensor, const std::string& sentence);  // adds a scan that could not be read
  void add_ego(const io::EgoRow& row);
  // Sets the map on which the poses should lie. Throws io::Error where the data is not a map.
  void set_map(const io::MapData& map, const std::string& file, const ovt_params& params);
  std::vector<Finding> findings() const;

 private:
  struct Sensor {
    int64_t scans = 0, empty = 0, errors = 0, backward = 0, repeated = 0, gaps = 0;
    int64_t points = 0, bad = 0, outside = 0, outside_if_vehicle = 0, far_points = 0, near_points = 0, odd_layers = 0;
    int32_t most_points = 0;
    int64_t first_ns = 0, last_ns = 0, longest_gap_ns = 0, first_back_scan = 0, first_back_ns = 0;
    double time_span_s = 0, odd_layer = 0, azimuth_low_deg = 1e9, azimuth_high_deg = -1e9;
    std::set<std::string> frame_ids;
    std::set<int64_t> layers;
    std::string lines_how, first_error;
    std::vector<std::string> more_errors;
    bool lost = false;  // a scan, since the last good one
    std::vector<int64_t> steps_ns;
    std::vector<Ground> grounds;
    std::vector<double> ranges_m;     // a sample
    std::array<bool, 360> seen = {};  // azimuths from -180 deg on, a degree each
    LineShapes shapes;
    ColumnSteps columns;
  };
  struct Ego {
    int64_t poses = 0, first_ns = INT64_MAX, last_ns = INT64_MIN, backward = 0, moving = 0, crooked = 0, fast = 0;
    io::EgoRow newest;
    std::vector<int64_t> steps_ns;  // the first ones
    std::vector<io::EgoRow> rows;   // the first ones, for the map

    void add_step(const io::EgoRow& row);  // from `newest` to `row`
  };
  void look_at_points(const io::SensorScan& scan, const io::RigSensor& model, Sensor& s) const;
  void judge_presence(std::size_t i, std::vector<Finding>& out) const;
  void judge_points(std::size_t i, std::vector<Finding>& out) const;
  void judge_view(std::size_t i, std::vector<Finding>& out) const;
  void judge_columns(std::size_t i, std::vector<Finding>& out) const;
  void judge_time(std::size_t i, std::vector<Finding>& out) const;
  // False if the lines do not belong to one sensor at the cloud's origin: then the mounting cannot be tested.
  bool judge_lines(std::size_t i, std::vector<Finding>& out) const;
  // `owner`: the sensor whose yaw seems to be the right one.
  void judge_yaw(std::size_t i, std::size_t owner, std::vector<Finding>& out) const;
  void judge_mounting(std::size_t i, std::vector<Finding>& out) const;
  void judge_ego(std::vector<Finding>& out) const;
  void judge_place(std::vector<Finding>& out) const;
  void judge_direction(std::vector<Finding>& out) const;

  const io::Rig rig_;
  std::vector<Sensor> sensors_;
  std::vector<WallDirections> walls_;
  Ego ego_;
  CircuitMap map_;
  std::string map_file_;
  double map_margin_m_ = 0;
};

}  // namespace overtake::cli
