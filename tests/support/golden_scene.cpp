// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/golden_scene.h"

#include <limits>

#include "tests/support/test_method.h"

namespace overtake::test {
namespace {

constexpr int32_t kLayers = 32, kShots = 430;  // shots per ring and head
constexpr double kSin60 = 0.8660254037844386;
// Tangent of half the angle between two shots, about 0.07 degrees: the rotation uses rational numbers of it.
constexpr double kHalfStep = 0.0012176687;
constexpr double kStepCos = (1.0 - kHalfStep * kHalfStep) / (1.0 + kHalfStep * kHalfStep);
constexpr double kStepSin = 2.0 * kHalfStep / (1.0 + kHalfStep * kHalfStep);

struct Mounting {
  double x_m, y_m, z_m, cos_yaw, sin_yaw, yaw_rad;
};
constexpr Mounting kMountings[kGoldenSensors] = {{2.342, 0.0, 0.646, 1.0, 0.0, 0.0},
                                                 {1.549, 0.267, 0.741, -0.5, kSin60, 2.0943951023931953},
                                                 {1.549, -0.267, 0.741, -0.5, -kSin60, -2.0943951023931953}};

struct Car {
  double x_m, y_m, step_m, cos_yaw, sin_yaw;  // step: distance gained on the ego per frame
};
// One ahead, one that comes from behind and crosses the seam between right and front, one oblique.
constexpr Car kCars[] = {{18.0, 2.5, 0.4, 1.0, 0.0}, {-30.0, -3.0, 1.5, 0.96, 0.28}, {40.0, -4.0, -2.0, 0.8, 0.6}};
constexpr double kHalfLength = 2.4, kHalfWidth = 0.9, kCarHeight = 1.2;
constexpr double kWallLeft = 9.0, kWallRight = -7.0, kWallHeight = 1.5;

double least(double a, double b) { return a < b ? a : b; }
double most(double a, double b) { return a > b ? a : b; }

// A ray o + t d in the vehicle frame: t of the first hit; 250: none.
double first_hit(const double* o, const double* d, int32_t frame) {
  double t = d[2] < 0.0 ? -o[2] / d[2] : 1000.0;
  if (d[1] != 0.0) {
    const double wall = ((d[1] > 0.0 ? kWallLeft : kWallRight) - o[1]) / d[1];
    if (o[2] + wall * d[2] < kWallHeight) t = least(t, wall);
  }
  for (const Car& car : kCars) {
    // In the car's frame it is a box around the origin.
    const double cx = o[0] - (car.x_m + car.step_m * frame), cy = o[1] - car.y_m;
    const double ox = car.cos_yaw * cx + car.sin_yaw * cy, oy = car.cos_yaw * cy - car.sin_yaw * cx;
    const double dx = car.cos_yaw * d[0] + car.sin_yaw * d[1], dy = car.cos_yaw * d[1] - car.sin_yaw * d[0];
    if (dx == 0.0 || dy == 0.0) continue;
    const double x0 = (-kHalfLength - ox) / dx, x1 = (kHalfLength - ox) / dx;
    const double y0 = (-kHalfWidth - oy) / dy, y1 = (kHalfWidth - oy) / dy;
    const double enter = most(least(x0, x1), least(y0, y1)), leave = least(most(x0, x1), most(y0, y1));
    if (enter > 0.0 && enter < leave && o[2] + enter * d[2] < kCarHeight) t = least(t, enter);
  }
  return t;
}

// xorshift (Marsaglia 2003).
struct Random {
  uint64_t state;
  uint32_t next() {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return uint32_t(state >> 32);
  }
};

}  // namespace

std::vector<ovt_sensor_def> golden_sensors() {
  std::vector<ovt_sensor_def> sensors;
  for (const Mounting& mounting : kMountings) {
    ovt_sensor_def def = ovt_default_sensor_def();
    def.x_m = mounting.x_m;
    def.y_m = mounting.y_m;
    def.z_m = mounting.z_m;
    def.yaw_rad = mounting.yaw_rad;
    sensors.push_back(def);
  }
  return sensors;
}

int64_t golden_stamp_ns(int32_t frame, int32_t sensor) {
  return 1000000000 + frame * kGoldenPeriodNs + sensor * 1000000;
}

std::vector<GoldenPoint> golden_cloud(int32_t frame, int32_t sensor) {
  const Mounting& mounting = kMountings[sensor];
  const double origin[3] = {mounting.x_m, mounting.y_m, mounting.z_m};
  std::vector<double> beam_x, beam_y;  // from +60 degrees to the right
  double bx = 0.5, by = kSin60;
  for (int32_t i = 0; i < 2 * kShots; ++i) {
    beam_x.push_back(bx);
    beam_y.push_back(by);
    const double x = kStepCos * bx + kStepSin * by, y = kStepCos * by - kStepSin * bx;
    bx = x, by = y;
  }

  Random random{uint64_t(1 + frame * kGoldenSensors + sensor) * 0x9e3779b97f4a7c15u};
  std::vector<GoldenPoint> cloud;
  for (int32_t layer = 0; layer < kLayers; ++layer) {
    if (layer == 5 && frame % 2 == 1) continue;  // in every other frame a layer is missing
    for (int32_t i = 0; i < 2 * kShots; ++i) {
      const std::size_t shot = std::size_t(i / 2 + i % 2 * kShots);
      const double x = beam_x[shot], y = beam_y[shot];
      const double z = 0.05 - 0.005 * layer - 0.0004 * (layer * layer) + 0.003 * (y * y);  // rings are not level
      const double direction[3] = {mounting.cos_yaw * x - mounting.sin_yaw * y,
                                   mounting.sin_yaw * x + mounting.cos_yaw * y, z};
      const double hit = first_hit(origin, direction, frame);
      const uint32_t dice = random.next(), noise = random.next();
      if (hit > 250.0 || dice % 32 == 0) continue;
      const double t = hit + 0.03 * (double(noise % 4096) / 4096.0 - 0.5);
      GoldenPoint point{float(t * x),
                        float(t * y),
                        float(t * z),
                        float(dice / 32 % 256),
                        uint16_t(layer),
                        0,
                        uint32_t(layer) * 1400000u + uint32_t(i) * 1000u};
      switch (dice / 8192 % 2048) {
        case 0: point.x_m = std::numeric_limits<float>::quiet_NaN(); break;
        case 1: point.z_m = std::numeric_limits<float>::infinity(); break;
        case 2: point.x_m = point.y_m = point.z_m = 0.0f; break;
        case 3: point.layer = 65000; break;
        case 4: point.y_m = 1e-40f; break;      // subnormal
        case 5: cloud.push_back(point); break;  // a duplicate point
        default: break;
      }
      cloud.push_back(point);
    }
  }
  return cloud;
}

ovt_ego_pose golden_ego(int64_t stamp_ns) {
  ovt_ego_pose pose;
  ovt_ego_pose_init(&pose, sizeof pose);
  pose.stamp_ns = stamp_ns;
  pose.x_m = 40.0 * (double(stamp_ns) * 1e-9);
  pose.yaw_rad = 0.02;
  if (tests_best()) pose.roll_rad = 1e-4;  // measured, so its heights count
  pose.speed_mps = 40.0;
  return pose;
}

GoldenMap::GoldenMap() {
  for (int32_t i = 0; i < 400; ++i) {
    x_m.push_back(-300.0 + 2.0 * i);
    y_m.push_back(0.04 * i - 4.0);
    width_m.push_back(8.0);
  }
  def = ovt_default_map_def();
  def.count = int32_t(x_m.size());
  def.x_m = x_m.data();
  def.y_m = y_m.data();
  def.width_left_m = def.width_right_m = width_m.data();
}

}  // namespace overtake::test
