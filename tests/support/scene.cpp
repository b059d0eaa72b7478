// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/scene.h"

#include <cmath>

#include "tests/support/scene_rays.h"

namespace overtake {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;

// An open-wheel racing car as its LiDAR silhouette: x forward from the middle, z up from the road.
constexpr Box kCar[] = {
    {-1.90, 1.50, -0.40, 0.40, 0.06, 0.62},   // monocoque and gearbox
    {-1.40, 0.10, -0.28, 0.28, 0.62, 1.02},   // engine cover and roll hoop
    {-1.30, 0.70, -0.86, 0.86, 0.06, 0.50},   // side pods
    {1.50, 2.40, -0.22, 0.22, 0.12, 0.42},    // nose
    {2.05, 2.45, -0.95, 0.95, 0.06, 0.20},    // front wing
    {-2.45, -1.90, -0.35, 0.35, 0.16, 0.48},  // rear crash structure
    {-2.30, -2.00, -0.06, 0.06, 0.48, 0.82},  // wing pylon
    {-2.45, -2.00, -0.76, 0.76, 0.80, 1.04},  // rear wing
    {1.20, 1.86, 0.60, 0.95, 0.00, 0.66},     // wheels
    {1.20, 1.86, -0.95, -0.60, 0.00, 0.66},   {-1.76, -1.10, 0.55, 0.95, 0.00, 0.70},
    {-1.76, -1.10, -0.95, -0.55, 0.00, 0.70},
};
constexpr int32_t kCarBoxes = int32_t(sizeof kCar / sizeof kCar[0]);
constexpr double kCarReachM = 2.8;  // no part of the car is farther from its origin

constexpr double kInnerWallM = 1.0, kOuterWallM = 1.1, kFenceM = 7.0;  // heights
constexpr double kFencePanelM = 4;  // of five panels three are covered, the others show the stands behind
constexpr double kPitsBehindM = 30, kPitsM = 14, kStandsBehindM = 22, kStandsM = 28;

constexpr float kReflectance[] = {0.10f, 0.20f, 0.35f, 0.35f, 0.20f, 0.15f, 0.40f};  // by SceneSurface

// Steele's SplitMix64: one 64-bit state, no table, the same on every machine.
struct Random {
  uint64_t state;
  uint64_t next() noexcept {
    uint64_t z = (state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  double uniform() noexcept { return double(next() >> 11) * 0x1p-53; }
  // Sum of four uniforms of 16 bits, scaled to variance 1: close enough to a normal, bounded by 3.5, exact arithmetic.
  double normal() noexcept {
    const uint64_t bits = next();
    const uint64_t sum = (bits & 0xFFFF) + (bits >> 16 & 0xFFFF) + (bits >> 32 & 0xFFFF) + (bits >> 48);
    return (double(sum) - 131070.0) / 37837.2;
  }
};

// A car's axes and origin in the map frame at one moment.
struct Placement {
  Vec3 origin, x, y, z;
};

Vec3 to_map(const Placement& p, const Vec3& v) noexcept {
  return {p.x.x * v.x + p.y.x * v.y + p.z.x * v.z, p.x.y * v.x + p.y.y * v.y + p.z.y * v.z,
          p.x.z * v.x + p.y.z * v.y + p.z.z * v.z};
}

double dot(const Vec3& a, const Vec3& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 to_car(const Placement& p, const Vec3& v) noexcept { return {dot(p.x, v), dot(p.y, v), dot(p.z, v)}; }
Vec3 difference(const Vec3& a, const Vec3& b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

// One car's circle: the angle round the axis grows linearly with time.
struct Circle {
  double rho_m, angle0_rad, rate_rps, z_m, sin_banking, cos_banking;

  Placement at(double time_s) const noexcept {
    const double angle = angle0_rad + rate_rps * time_s, c = std::cos(angle), s = std::sin(angle);
    return {{rho_m * c, rho_m * s, z_m},
            {-s, c, 0},
            {-c * cos_banking, -s * cos_banking, -sin_banking},
            {-c * sin_banking, -s * sin_banking, cos_banking}};
  }
};

Circle make_circle(const SceneDef& def, double gap_m, double d_m, double speed_mps) {
  const double rho = def.radius_m - d_m;  // the curve turns left, so left is inside
  return {rho,
          -kPi / 2 + gap_m / def.radius_m,
          speed_mps / rho,
          -d_m * std::tan(def.banking_rad),
          std::sin(def.banking_rad),
          std::cos(def.banking_rad)};
}
Circle ego_circle(const SceneDef& def) { return make_circle(def, 0, def.ego_d_m, def.ego_speed_mps); }
Circle opponent_circle(const SceneDef& def) {
  return make_circle(def, def.start_gap_m, def.opponent_d_m, def.opponent_speed_mps);
}

double wrap(double angle_rad) { return std::remainder(angle_rad, 2 * kPi); }

ScenePose make_pose(const Circle& circle, double banking_rad, double time_s) {
  const Vec3 origin = circle.at(time_s).origin;
  const double yaw = wrap(circle.angle0_rad + circle.rate_rps * time_s + kPi / 2);
  return {origin.x, origin.y, origin.z, -banking_rad, 0, yaw, circle.rate_rps * circle.rho_m, circle.rate_rps};
}

bool is_covered(const Ray& ray, double range_m) {
  const double x = ray.from.x + range_m * ray.along.x, y = ray.from.y + range_m * ray.along.y;
  const double along_m = (std::atan2(y, x) + kPi) * std::sqrt(x * x + y * y);
  return int32_t(along_m / kFencePanelM) % 5 < 3;
}

// Share of returns from ground at this grazing angle: none below 0.4 deg, all above 0.75 deg. With a sensor
// 0.65 m high that is the last road at 50 to 90 m.
double ground_return_share(double cos_incidence) { return (cos_incidence - 0.007) / 0.006; }

}  // namespace

// Spacing 0.25 deg round the horizon, growing with the square of the distance from it to 2 deg at the edges.
double Scene::layer_elevation_rad(int32_t layer) {
  const int32_t from_middle = layer < kSceneLayers / 2 ? kSceneLayers / 2 - 1 - layer : layer - kSceneLayers / 2;
  double e_deg = 0.125;
  for (int32_t k = 1; k <= from_middle; ++k) e_deg += 0.25 + 1.75 * k * k / 225.0;
  return (layer < kSceneLayers / 2 ? e_deg : -e_deg) * kDegree;
}

SceneMounting Scene::mounting(int32_t sensor) {
  constexpr SceneMounting kMounting[kSceneSensors] = {
      {2.342, 0, 0.646, 0}, {1.549, 0.267, 0.741, 120 * kDegree}, {1.549, -0.267, 0.741, -120 * kDegree}};
  return kMounting[sensor];
}

Scene::Scene(uint64_t seed, const SceneDef& def) : seed_(seed), def_(def) {
  constexpr double kPitch = 60 * kDegree / kSceneShots;
  beam_.reserve(size_t(kSceneLayers) * kSceneShots * 2 * 3);
  for (int32_t layer = 0; layer < kSceneLayers; ++layer)
    for (int32_t shot = 0; shot < kSceneShots; ++shot)
      for (int32_t head = 0; head < 2; ++head) {
        // Lines are bowed, and the halves of a line do not quite meet, as with the real sensor.
        const double azimuth = (head == 0 ? 60 * kDegree : 0) - (shot + 0.5) * kPitch;
        const double side = azimuth / (60 * kDegree);
        const double elevation =
            layer_elevation_rad(layer) + (0.4 * (side * side - 0.25) - (head == 0 ? 0 : 0.08)) * kDegree;
        beam_.push_back(std::cos(elevation) * std::cos(azimuth));
        beam_.push_back(std::cos(elevation) * std::sin(azimuth));
        beam_.push_back(std::sin(elevation));
      }
}

SceneScan Scene::scan(int32_t index, int32_t sensor) const {
  const double k = std::tan(def_.banking_rad);
  const double left_m = def_.width_left_m + def_.wall_behind_edge_m;
  const double right_m = def_.width_right_m + def_.wall_behind_edge_m;
  const double rho_in = def_.radius_m - left_m, rho_out = def_.radius_m + right_m;
  const double z_in = -left_m * k, z_out = right_m * k;
  const Cone road = {def_.radius_m, k, rho_in, rho_out};
  const Disc infield = {z_in, rho_in, SceneSurface::infield};
  const Cylinder inner_wall = {rho_in, z_in - 1, z_in + kInnerWallM, SceneSurface::inner_wall};
  const Cylinder outer_wall = {rho_out, z_out - 1, z_out + kOuterWallM, SceneSurface::outer_wall};
  const Cylinder fence = {rho_out, z_out + kOuterWallM, z_out + kFenceM, SceneSurface::fence};
  const Cylinder pits = {rho_in - kPitsBehindM, z_in - 50, z_in + kPitsM, SceneSurface::building};
  const Cylinder stands = {rho_out + kStandsBehindM, z_out - 50, z_out + kStandsM, SceneSurface::building};
  const Circle ego = ego_circle(def_), opponent = opponent_circle(def_);
  const SceneMounting mount = mounting(sensor);
  const double cos_mount = std::cos(mount.yaw_rad), sin_mount = std::sin(mount.yaw_rad);

  // Each scan has its own random stream, so that frames can be made in any order.
  Random random = {seed_};
  random.state = random.next() ^ uint64_t(index) * 0xD1342543DE82EF95u;
  random.state = random.next() ^ uint64_t(sensor);

  SceneScan out;
  constexpr size_t kMost = size_t(kSceneLayers) * kSceneShots * 2;
  for (auto* column : {&out.x_m, &out.y_m, &out.z_m, &out.intensity, &out.time_offset_s}) column->reserve(kMost);
  out.layer.reserve(kMost);
  out.surface.reserve(kMost);

  const double* beam = beam_.data();
  for (int32_t layer = 0; layer < kSceneLayers; ++layer)
    for (int32_t shot = 0; shot < kSceneShots; ++shot) {
      const double offset_s = def_.sweep_s * (layer * kSceneShots + shot) / double(kSceneLayers * kSceneShots);
      const double time_s = index * def_.period_s + offset_s;
      const Placement vehicle = ego.at(time_s), other = opponent.at(time_s);
      const Vec3 arm = to_map(vehicle, {mount.x_m, mount.y_m, mount.z_m});
      const Vec3 eye = {vehicle.origin.x + arm.x, vehicle.origin.y + arm.y, vehicle.origin.z + arm.z};
      const Vec3 to_other = difference(other.origin, eye);

      for (int32_t head = 0; head < 2; ++head, beam += 3) {
        const Vec3 in_vehicle = {cos_mount * beam[0] - sin_mount * beam[1], sin_mount * beam[0] + cos_mount * beam[1],
                                 beam[2]};
        const Ray ray = {eye, to_map(vehicle, in_vehicle)};
        // The number of draws per ray is constant, so that the draws of a ray do not depend on what other rays hit.
        const double luck = random.uniform(), ground_luck = random.uniform();
        const double noise_m = random.normal() * def_.range_noise_m;

        Hit hit = {def_.range_max_m, 0, SceneSurface::building};
        meet_cone(ray, road, &hit);
        meet_disc(ray, infield, &hit);
        meet_cylinder(ray, inner_wall, &hit);
        meet_cylinder(ray, outer_wall, &hit);
        meet_cylinder(ray, pits, &hit);
        meet_cylinder(ray, stands, &hit);
        Hit fence_hit = hit;
        meet_cylinder(ray, fence, &fence_hit);
        if (fence_hit.surface == SceneSurface::fence && is_covered(ray, fence_hit.range_m)) hit = fence_hit;
        const double ahead = dot(to_other, ray.along);
        if (def_.has_opponent && ahead > -kCarReachM &&
            dot(to_other, to_other) - ahead * ahead < kCarReachM * kCarReachM) {
          const Vec3 from = to_car(other, {-to_other.x, -to_other.y, -to_other.z});
          meet_boxes({from, to_car(other, ray.along)}, kCar, kCarBoxes, &hit);
        }
        if (hit.range_m >= def_.range_max_m || luck < def_.missing_share) continue;
        const bool is_ground = hit.surface == SceneSurface::road || hit.surface == SceneSurface::infield;
        if (is_ground && ground_luck > ground_return_share(hit.cos_incidence)) continue;

        const double range = hit.range_m + noise_m;
        const double brightness = 0.3 + 0.7 * hit.cos_incidence + 0.1 * luck;
        out.x_m.push_back(float(beam[0] * range));
        out.y_m.push_back(float(beam[1] * range));
        out.z_m.push_back(float(beam[2] * range));
        out.intensity.push_back(kReflectance[int32_t(hit.surface)] * float(brightness));
        out.time_offset_s.push_back(float(offset_s));
        out.layer.push_back(uint16_t(layer));
        out.surface.push_back(hit.surface);
      }
    }
  return out;
}

SceneFrame Scene::frame(int32_t index) const {
  const double time_s = index * def_.period_s;
  SceneFrame out;
  out.stamp_ns = int64_t(std::llround(time_s * 1e9));
  for (int32_t s = 0; s < kSceneSensors; ++s) out.scan[s] = scan(index, s);
  out.ego = ego_at(time_s);
  out.opponent = opponent_at(time_s);
  const Placement vehicle = ego_circle(def_).at(time_s), other = opponent_circle(def_).at(time_s);
  const Vec3 place = to_car(vehicle, difference(other.origin, vehicle.origin)), nose = to_car(vehicle, other.x);
  out.opponent_x_m = place.x;
  out.opponent_y_m = place.y;
  out.opponent_z_m = place.z;
  out.opponent_yaw_rad = std::atan2(nose.y, nose.x);
  return out;
}

ScenePose Scene::ego_at(double time_s) const { return make_pose(ego_circle(def_), def_.banking_rad, time_s); }
ScenePose Scene::opponent_at(double time_s) const { return make_pose(opponent_circle(def_), def_.banking_rad, time_s); }

SceneMap Scene::map() const {
  const int32_t count = int32_t(2 * kPi * def_.radius_m / 2.0);
  SceneMap out;
  for (int32_t i = 0; i < count; ++i) {
    const double angle = -kPi / 2 + 2 * kPi * i / count;
    out.x_m.push_back(def_.radius_m * std::cos(angle));
    out.y_m.push_back(def_.radius_m * std::sin(angle));
  }
  out.width_left_m.assign(size_t(count), def_.width_left_m);
  out.width_right_m.assign(size_t(count), def_.width_right_m);
  out.banking_rad.assign(size_t(count), -def_.banking_rad);  // a car's roll there
  return out;
}

}  // namespace overtake
