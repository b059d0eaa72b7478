// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A simulated overtake on an endless banked left curve. It needs no recording; every answer has a closed form.
//
//            stands ))            The road is a piece of a cone around the vertical axis through the map's origin:
//     outer wall, fence ))        z = (rho - radius) tan(banking). Walls, fence and buildings are cylinders round the
//        road      ))             same axis, the opponent is a handful of boxes. Both cars drive on circles at constant
//   inner wall  ))      . axis    speed, counter-clockwise. The ego starts behind and passes on the right.
//      infield  ))
//
// Three LiDARs of 120 degrees, mounted as in rig av21. Like the recorded ones, each has two heads that sweep +60..0 and
// 0..-60 degrees at the same time, line after line, with interleaved points. Each point has its own time stamp, and
// both cars move during the scan. A point is in the sensor frame of its own time: motion is not compensated.
//
// The scene shares no code with the pipeline that it tests. A frame depends on seed and index alone, not on earlier
// frames. It uses the C library's sin and cos, so its bytes may differ between machines; the project promises equal
// output bytes for equal input bytes only.
#pragma once

#include <cstdint>
#include <vector>

namespace overtake {

inline constexpr int32_t kSceneSensors = 3;
inline constexpr int32_t kSceneLayers = 32;  // layer 0 looks up most
inline constexpr int32_t kSceneShots = 440;  // a line and head; a full line has twice as many points
inline constexpr const char* kSceneSensorName[kSceneSensors] = {"front", "left", "right"};

enum class SceneSurface : uint8_t { road, infield, inner_wall, outer_wall, fence, building, opponent };

struct SceneDef {
  double radius_m = 400, banking_rad = 0.0872664626;  // of the centre line; 5 deg, outside higher
  double width_left_m = 8, width_right_m = 6;         // of the track, as in the map
  double wall_behind_edge_m = 1;                      // the road goes on up to the walls
  double ego_speed_mps = 64, opponent_speed_mps = 50;
  double ego_d_m = -2.2, opponent_d_m = 1.8;  // offset from the centre line, positive left
  double start_gap_m = 45;                    // along the centre line, rear axle to car's middle
  bool has_opponent = true;
  double period_s = 0.05, sweep_s = 0.045;         // frame k starts at k * period_s
  double range_max_m = 200, range_noise_m = 0.01;  // noise: one sigma, at most 3.5
  double missing_share = 0.002;                    // of the returns, besides ground seen at grazing angles
};

// A car's pose. The origin lies on the road: under the rear axle of the ego, under the middle of the opponent.
struct ScenePose {
  double x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad;
  double speed_mps, yaw_rate_rps;
};

// One scan of one sensor: columns of the same length, in the order of acquisition, sensor frame.
struct SceneScan {
  std::vector<float> x_m, y_m, z_m, intensity, time_offset_s;
  std::vector<uint16_t> layer;
  std::vector<SceneSurface> surface;  // what was hit

  // Copies point i of another scan, without its surface.
  void add_point(const SceneScan& from, std::size_t i) {
    x_m.push_back(from.x_m[i]);
    y_m.push_back(from.y_m[i]);
    z_m.push_back(from.z_m[i]);
    layer.push_back(from.layer[i]);
    intensity.push_back(from.intensity[i]);
    time_offset_s.push_back(from.time_offset_s[i]);
  }
};

struct SceneFrame {
  int64_t stamp_ns;  // start of all three scans
  SceneScan scan[kSceneSensors];
  ScenePose ego, opponent;                                            // at stamp_ns, map frame
  double opponent_x_m, opponent_y_m, opponent_z_m, opponent_yaw_rad;  // at stamp_ns, vehicle frame
};

// The centre line in driving direction, closed, about 2 m a point.
struct SceneMap {
  std::vector<double> x_m, y_m, width_left_m, width_right_m, banking_rad;
};

struct SceneMounting {
  double x_m, y_m, z_m, yaw_rad;  // T_vehicle_sensor
};

class Scene {
 public:
  explicit Scene(uint64_t seed, const SceneDef& def = SceneDef());

  SceneFrame frame(int32_t index) const;
  SceneMap map() const;
  ScenePose ego_at(double time_s) const;
  ScenePose opponent_at(double time_s) const;
  const SceneDef& def() const { return def_; }

  static SceneMounting mounting(int32_t sensor);
  static double layer_elevation_rad(int32_t layer);  // in the middle of the left head's half
  static constexpr double kOpponentLengthM = 4.9, kOpponentWidthM = 1.9;

 private:
  SceneScan scan(int32_t index, int32_t sensor) const;

  uint64_t seed_;
  SceneDef def_;
  std::vector<double> beam_;  // [layer][shot][head] unit vectors, sensor frame
};

}  // namespace overtake
