// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/world.h"

namespace overtake::sim {
namespace {

Mesh make_all_that_stands(const Track& track, const Scenario& scenario) {
  Mesh mesh = make_surroundings(track, scenario.verge);
  mesh.surface = Surface::debris;
  for (const Debris& piece : scenario.debris) {
    const SurfaceFrame f = track.frame(piece.s_m, piece.d_m);
    const double half = piece.size_m / 2;
    const Rigid foot = Rigid{{f.along, f.left, f.up}, f.place} * Rigid{rotation_about_z(piece.s_m), {}};
    mesh.material = piece.tyre ? MaterialId::tyre : MaterialId::debris;
    if (piece.tyre)
      mesh.add_cylinder(foot * Vec3{0, 0, 0}, foot * Vec3{0, 0, piece.height_m}, half, 24);
    else
      mesh.add_box(foot, {-half, -half * 0.6, 0}, {half, half * 0.6, piece.height_m});
  }
  mesh.surface = Surface::gantry_sign;
  for (const Reflectors& row : scenario.reflectors)
    for (int32_t i = 0; i < row.count; ++i) {
      const SurfaceFrame f = track.frame(row.s_m + i * row.every_m, row.d_m);
      const Rigid foot{{f.along, f.left, f.up}, f.place};
      const double half = row.size_m / 2, low = row.height_m - half, high = row.height_m + half;
      mesh.material = MaterialId::steel;
      mesh.add_box(foot, {-0.02, -0.03, 0}, {0.02, 0.03, high});
      mesh.material = MaterialId::reflector;
      mesh.add_quad(foot * Vec3{-0.03, half, low}, foot * Vec3{-0.03, -half, low}, foot * Vec3{-0.03, -half, high},
                    foot * Vec3{-0.03, half, high});
    }
  return mesh;
}

constexpr double kMaskCell = 0.5 * kDegree, kMaskAzimuth = 64 * kDegree, kMaskElevation = 20 * kDegree;
constexpr int32_t kMaskCols = 256, kMaskRows = 80, kRaysACell = 3;  // 0.17 deg apart: 7 mm at 2.4 m

}  // namespace

World::World(const Scenario& scenario, std::optional<Random> track_draws)
    : track(Track::make(scenario.track, track_draws)),
      surroundings(make_all_that_stands(track, scenario)),
      car(make_race_car(Surface::car)),
      ego(scenario.find_car(scenario.ego)) {
  for (const CarPlan& plan : scenario.cars) motions.push_back(std::make_unique<Motion>(track, plan, scenario.seconds));
  for (const Puffs& p : scenario.puffs)
    puff_sources.push_back({motions[std::size_t(scenario.find_car(p.car))].get(), p.from_s, p.to_s, p.per_s,
                            p.density_pm, p.life_s, puff_sources.size()});
}

OwnCarMask::OwnCarMask(const World& world, const Rigid& T) : cells_(kMaskRows * kMaskCols) {
  std::vector<uint8_t> seen(cells_.size());
  for (int32_t r = 0; r < kMaskRows * kRaysACell; ++r)
    for (int32_t c = 0; c < kMaskCols * kRaysACell; ++c) {
      const SinCos e = sin_cos((r + 0.5) * kMaskCell / kRaysACell - kMaskElevation);
      const SinCos a = sin_cos((c + 0.5) * kMaskCell / kRaysACell - kMaskAzimuth);
      const Vec3 direction = T.rotation * Vec3{e.cos * a.cos, e.cos * a.sin, e.sin};
      if (world.car.cast(T.place, direction, 0.02, 10).triangle >= 0)
        seen[std::size_t(r / kRaysACell * kMaskCols + c / kRaysACell)] = 1;
    }
  for (int32_t r = 0; r < kMaskRows; ++r)
    for (int32_t c = 0; c < kMaskCols; ++c)
      for (int32_t i = -1; i <= 1; ++i)
        for (int32_t j = -1; j <= 1; ++j)
          if (r + i >= 0 && r + i < kMaskRows && c + j >= 0 && c + j < kMaskCols &&
              seen[std::size_t((r + i) * kMaskCols + c + j)])
            cells_[std::size_t(r * kMaskCols + c)] = 1;
}

bool OwnCarMask::may_meet(double azimuth_rad, double elevation_rad) const {
  const double r = (elevation_rad + kMaskElevation) / kMaskCell, c = (azimuth_rad + kMaskAzimuth) / kMaskCell;
  if (cells_.empty() || r < 0 || c < 0 || r >= kMaskRows || c >= kMaskCols) return true;
  return cells_[std::size_t(int32_t(r) * kMaskCols + int32_t(c))] != 0;
}

LineView LineView::make(const World& world, double begin_s, double end_s) {
  LineView view;
  for (int32_t i = 0; i < int32_t(world.motions.size()); ++i) {
    const Motion& motion = *world.motions[std::size_t(i)];
    const Rigid begin = motion.at(begin_s).T_map_vehicle, end = motion.at(end_s).T_map_vehicle;
    if (i == world.ego) {
      view.ego[0] = begin, view.ego[1] = end;
    } else {
      view.cars[0].push_back(begin), view.cars[1].push_back(end);
      view.numbers.push_back(i);
    }
  }
  return view;
}

namespace {

// The nearest car; returns the range limit of the remaining search.
double cast_cars(const World& world, const LineView& view, RayCast& beam, double far) {
  const Ray& ray = beam.ray;
  BeamHit& best = beam.hit;
  const Hit own = beam.own_car ? world.car.cast(ray.origin_vehicle, ray.direction_vehicle, beam.near_m, far) : Hit();
  if (own.triangle >= 0) {
    const Triangle& t = world.car.triangle(own.triangle);
    far = own.range_m;
    best = {own.range_m,
            std::fabs(dot(world.car.normal(own.triangle), ray.direction_vehicle)),
            uint16_t(Surface::own_car),
            t.material,
            1,
            -1};
  }
  for (std::size_t i = 0; i < view.numbers.size(); ++i) {
    // First a ball around the car; a car moves a few centimetres within a line.
    const Vec3 to = view.cars[0][i] * world.car.center() - ray.origin_map;
    const double along = dot(to, ray.direction_map), radius = world.car.radius_m() + 0.3;
    if (along < -radius || along - radius > far || dot(to, to) - along * along > radius * radius) continue;
    const Rigid pose = blend(view.cars[0][i], view.cars[1][i], beam.share);
    const Vec3 origin = pose.inverse_times(ray.origin_map),
               direction = pose.rotation.transposed_times(ray.direction_map);
    const Hit hit = world.car.cast(origin, direction, beam.near_m, far);
    if (hit.triangle < 0) continue;
    far = hit.range_m;
    best = {hit.range_m,
            std::fabs(dot(world.car.normal(hit.triangle), direction)),
            uint16_t(uint16_t(Surface::car) + view.numbers[i]),
            world.car.triangle(hit.triangle).material,
            1,
            -1};
  }
  return far;
}

}  // namespace

void cast(const World& world, const LineView& view, RayCast (&pack)[Bvh::kPack], double far_m, int32_t likely) {
  Vec3 origin[Bvh::kPack], direction[Bvh::kPack];
  double near[Bvh::kPack], far[Bvh::kPack];
  Hit hits[Bvh::kPack];
  for (int32_t i = 0; i < Bvh::kPack; ++i) {
    RayCast& beam = pack[i];
    beam.hit = BeamHit();
    origin[i] = beam.ray.origin_map, direction[i] = beam.ray.direction_map;
    near[i] = beam.near_m;
    far[i] = beam.active ? cast_cars(world, view, beam, far_m) : -1;
  }
  world.surroundings.cast_pack(origin, direction, near, far, likely, hits);
  for (int32_t i = 0; i < Bvh::kPack; ++i) {
    if (hits[i].triangle < 0) continue;
    const Triangle& t = world.surroundings.triangle(hits[i].triangle);
    pack[i].hit = {hits[i].range_m,
                   std::fabs(dot(world.surroundings.normal(hits[i].triangle), direction[i])),
                   uint16_t(t.surface),
                   t.material,
                   1,
                   hits[i].triangle};
  }
}

}  // namespace overtake::sim
