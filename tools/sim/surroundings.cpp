// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Static objects around the track, from the centre line's description alone.
//
//   d:   outer wall with fence | white line |   road   | white line | apron | grass | inner wall or pit wall | pit lane
//
// Heights and distances are usual values of American ovals: SAFER wall 1.07 m, catch fence to 6.7 m, posts every 6 m.
#include <cstdint>
#include <utility>

#include "tools/sim/mesh.h"
#include "tools/sim/random.h"
#include "tools/sim/track.h"

namespace overtake::sim {
namespace {

constexpr double kWallHeight = 1.07, kFenceTop = 6.7, kPostSpacing = 6, kLine = 0.15, kCell = 1.0;
constexpr double kPitHalf = 260;  // extent of the pit lane before and after the start line

struct Builder {
  const Track& track;
  const Verge verge;
  Mesh mesh;

  Vec3 at(double s, double d, double above) const {
    Vec3 p = track.place(s, d);
    p.z += above;
    return p;
  }
  // Quads between two lateral stations d1(s), d2(s) at heights above the surface, for the whole lap or from s1 to s2.
  template <class Station>
  void add_strip(double s1, double s2, double cell, Station&& station) {
    const int count = int((s2 - s1) / cell + 0.5);
    Vec3 a0, b0;
    for (int i = 0; i <= count; ++i) {
      const double s = lerp(s1, s2, double(i) / count);
      const auto [a, b] = station(s);
      if (i > 0) mesh.add_quad(a0, a, b, b0);
      a0 = a, b0 = b;
    }
  }
  void use(MaterialId material, Surface surface) { mesh.material = material, mesh.surface = surface; }
  Rigid stand(double s, double d) const {
    const SurfaceFrame f = track.frame(s, d);
    const Vec3 up{0, 0, 1}, along = normalized({f.along.x, f.along.y, 0});
    return {{along, cross(up, along), up}, f.place};
  }
  bool in_pit(double s) const { return s < kPitHalf || s > track.length_m() - kPitHalf; }
  double inner_wall(const TrackPoint& p) const { return p.width_left_m + track.apron_m() + (is_oval() ? 9.5 : 6); }
  bool is_oval() const { return track.name() == "oval"; }

  void add_road();
  void add_kerbs();
  void add_grass();
  void add_infield();
  void add_walls();
  void add_fence();
  void add_gantries();
  void add_stands();
  void add_pit();
};

using Pair = std::pair<Vec3, Vec3>;

void Builder::add_road() {
  const double length = track.length_m();
  // Lateral stations: share of the way from the right edge to the left one, without the lines.
  constexpr int kLanes = 6;
  use(MaterialId::asphalt, Surface::road);
  for (int lane = 0; lane < kLanes; ++lane)
    add_strip(0, length, kCell, [&](double s) {
      const TrackPoint p = track.at(s);
      const double right = -p.width_right_m + kLine, left = p.width_left_m - kLine;
      return Pair{at(s, lerp(right, left, double(lane) / kLanes), 0),
                  at(s, lerp(right, left, (lane + 1.0) / kLanes), 0)};
    });
  add_strip(0, length, kCell, [&](double s) {  // from the outer line to the wall
    const double right = -track.at(s).width_right_m;
    return Pair{at(s, right - track.wall_behind_edge_m(), 0), at(s, right, 0)};
  });
  use(MaterialId::white_line, Surface::road);
  add_strip(0, length, kCell, [&](double s) {
    const double right = -track.at(s).width_right_m;
    return Pair{at(s, right, 0), at(s, right + kLine, 0)};
  });
  add_strip(0, length, kCell, [&](double s) {
    const double left = track.at(s).width_left_m;
    return Pair{at(s, left - kLine, 0), at(s, left, 0)};
  });
  if (verge.grass_m > 0) return add_grass();
  use(MaterialId::asphalt, Surface::apron_grass);
  add_strip(0, length, kCell, [&](double s) {
    const double left = track.at(s).width_left_m;
    return Pair{at(s, left, 0), at(s, left + track.apron_m(), 0)};
  });
  use(MaterialId::grass, Surface::apron_grass);
  add_strip(0, length, kCell, [&](double s) {  // cells as on the road: strips meet without cracks
    const TrackPoint p = track.at(s);
    return Pair{at(s, p.width_left_m + track.apron_m(), 0), at(s, inner_wall(p), 0)};
  });
  add_infield();
}

void Builder::add_infield() {
  use(MaterialId::grass, Surface::apron_grass);
  add_strip(0, track.length_m(), 5, [&](double s) {  // its joint with the grass is under a wall
    const TrackPoint p = track.at(s);
    return Pair{at(s, inner_wall(p), 0), at(s, inner_wall(p) + 30, 0)};
  });
}

// Blades of different heights: stations half a metre apart, each point at its own height; level at both borders and
// under kerbs.
void Builder::add_grass() {
  use(MaterialId::grass, Surface::apron_grass);
  constexpr int kStations = 16;
  const int lap = int(track.length_m() / kCell + 0.5);
  for (int k = 0; k < kStations; ++k)
    add_strip(0, track.length_m(), kCell, [&](double s) {
      const TrackPoint p = track.at(s);
      const auto blade = [&](int station) {
        const double share = double(station) / kStations, d = lerp(p.width_left_m, inner_wall(p), share);
        const uint64_t place = uint64_t(int(s / track.length_m() * lap + 0.5) % lap) * (kStations + 1);
        const bool border = station == kStations || d < p.width_left_m + (verge.kerb_m > 0 ? 1.3 : 0.1);
        return at(s, d, border ? 0 : verge.grass_m * Random(place + uint64_t(station)).uniform());
      };
      return Pair{blade(k), blade(k + 1)};
    });
  add_infield();
}

// On both sides wherever the line is curved: a ramp from the road, a flat top, a ramp down. The outer wall stands 0.8 m
// behind the edge.
void Builder::add_kerbs() {
  use(MaterialId::white_line, Surface::apron_grass);
  constexpr double kFrom = 1.0 / 450, kFull = 1.0 / 300, kRamp = 0.2;
  const auto height = [&](const TrackPoint& p) {
    return verge.kerb_m * smooth_step((std::fabs(p.curvature_pm) - kFrom) / (kFull - kFrom));
  };
  for (const double side : {1.0, -1.0}) {
    const double width = side > 0 ? 1.2 : 0.7;
    const double across[4] = {0, kRamp, width - kRamp, width};
    for (int k = 0; k < 3; ++k)
      add_strip(0, track.length_m(), kCell, [&](double s) {
        const TrackPoint p = track.at(s);
        const double edge = side > 0 ? p.width_left_m : -p.width_right_m, up = height(p);
        const auto point = [&](int i) {
          const double d = edge + side * across[i];
          return at(s, d, (i == 1 || i == 2 ? up : 0) - 0.002);  // no kerb: under the ground
        };
        return Pair{point(k), point(k + 1)};
      });
  }
}

void Builder::add_walls() {
  const double length = track.length_m();
  const auto outer = [&](double s) { return -track.at(s).width_right_m - track.wall_behind_edge_m(); };
  use(MaterialId::safer_wall, Surface::outer_wall);
  add_strip(0, length, kCell, [&](double s) { return Pair{at(s, outer(s), 0), at(s, outer(s), kWallHeight)}; });
  add_strip(0, length, kCell, [&](double s) {
    return Pair{at(s, outer(s), kWallHeight), at(s, outer(s) - 0.6, kWallHeight)};
  });
  // A band of advertisements on the wall, on every other 20 m.
  use(MaterialId::sign, Surface::outer_wall);
  for (double s = 0; s + 20 < length; s += 40)
    add_strip(s, s + 12, kCell, [&](double u) {
      return Pair{at(u, outer(u) + 0.01, 0.3), at(u, outer(u) + 0.01, 0.9)};
    });
  use(MaterialId::concrete, Surface::inner_wall);
  const double from = is_oval() ? kPitHalf : 0, to = is_oval() ? length - kPitHalf : length;
  add_strip(from, to, 2, [&](double s) {
    const double d = inner_wall(track.at(s));
    return Pair{at(s, d, 0), at(s, d, 0.95)};
  });
  use(MaterialId::reflector, Surface::inner_wall);  // reflectors every 50 m
  for (double s = from + 5; s < to - 5; s += 50) {
    const double d = inner_wall(track.at(s)) - 0.02;
    mesh.add_quad(at(s, d, 0.6), at(s + 0.12, d, 0.6), at(s + 0.12, d, 0.72), at(s, d, 0.72));
  }
}

void Builder::add_fence() {
  const double length = track.length_m();
  const auto line = [&](double s) { return -track.at(s).width_right_m - track.wall_behind_edge_m() - 0.45; };
  if (!is_oval()) return;
  use(MaterialId::fence_wire, Surface::fence_wire);
  add_strip(0, length, kPostSpacing / 2, [&](double s) {
    return Pair{at(s, line(s), kWallHeight), at(s, line(s), kFenceTop)};
  });
  use(MaterialId::steel, Surface::fence_post);
  const int posts = int(length / kPostSpacing);
  for (int i = 0; i < posts; ++i) {
    const Rigid foot = stand(length * i / posts, line(length * i / posts));
    mesh.add_box(foot, {-0.07, -0.17, 0}, {0.07, -0.03, kFenceTop});
  }
  for (const double height : {2.6, 4.3, 6.5})  // cables
    add_strip(0, length, kPostSpacing / 2, [&](double s) {
      return Pair{at(s, line(s) + 0.02, height), at(s, line(s) + 0.02, height + 0.025)};
    });
}

void Builder::add_gantries() {
  use(MaterialId::steel, Surface::gantry_sign);
  const double length = track.length_m();
  for (const double s : {0.0, length * 0.31, length * 0.62}) {
    const TrackPoint p = track.at(s);
    const Rigid center = stand(s, 0);
    const double right = -p.width_right_m - 2.2, left = p.width_left_m + track.apron_m() + 1;
    const double high = track.height(s, right) + 8.2 - center.place.z;
    use(MaterialId::steel, Surface::gantry_sign);
    for (const double d : {right, left})
      mesh.add_box(center, {-0.25, d - 0.25, track.height(s, d) - center.place.z}, {0.25, d + 0.25, high});
    mesh.add_box(center, {-0.25, right, high - 0.6}, {0.25, left, high});
    use(MaterialId::sign, Surface::gantry_sign);
    mesh.add_box(center, {-0.30, -4, high - 2.0}, {-0.26, 4, high - 0.6});
  }
  // Distance boards and flag posts beyond the inner edge.
  for (int i = 0; i < int(length / 150); ++i) {
    const double s = 60 + 150.0 * i;
    if (is_oval() && in_pit(s)) continue;
    const TrackPoint p = track.at(s);
    const Rigid foot = stand(s, inner_wall(p) + 1.5);
    use(MaterialId::steel, Surface::gantry_sign);
    mesh.add_box(foot, {-0.05, -0.05, 0}, {0.05, 0.05, 1.6});
    use(MaterialId::sign, Surface::gantry_sign);
    mesh.add_box(foot, {-0.03, -0.6, 1.6}, {0.03, 0.6, 2.6});
  }
}

void Builder::add_stands() {
  const double length = track.length_m();
  if (!is_oval()) {
    use(MaterialId::building, Surface::building);
    for (int i = 0; i < 12; ++i) {
      const double s = length * i / 12, d = (i % 2 ? 1 : -1) * (40.0 + 5 * (i % 3));
      mesh.add_box(stand(s, d), {-8, -5, -4}, {8, 5, 6});
    }
    return;
  }
  // Stepped rows behind the outer wall of the front stretch: a walkway, then 24 rows.
  use(MaterialId::concrete, Surface::building);
  const auto back = [&](double s) { return -track.at(s).width_right_m - 9; };
  for (const auto& [from, to] : {std::pair<double, double>{0, 330}, {length - 330, length}}) {
    add_strip(from, to, 5, [&](double s) { return Pair{at(s, back(s) + 8, 0), at(s, back(s), 0)}; });
    for (int row = 0; row < 24; ++row) {
      const double d = 0.9 * row, h = 0.45 * row;
      use(MaterialId::building, Surface::building);
      add_strip(from, to, 10, [&](double s) {
        return Pair{at(s, back(s) - d, 1.2 + h), at(s, back(s) - d, 1.65 + h)};
      });
      add_strip(from, to, 10, [&](double s) {
        return Pair{at(s, back(s) - d, 1.65 + h), at(s, back(s) - d - 0.9, 1.65 + h)};
      });
    }
  }
  // Elsewhere: poles and buildings at some distance, the same ones in every run.
  use(MaterialId::building, Surface::building);
  uint64_t key = 1;
  for (double s = 380; s < length - 380; s += 45) {
    key = key * 6364136223846793005u + 1442695040888963407u;
    const double d = -45 - double(key >> 58), size = 4 + double((key >> 52) & 15);
    mesh.add_box(stand(s, d), {-size, -3, -8}, {size, 3, 2 + size * 0.5});
  }
}

void Builder::add_pit() {
  if (!is_oval()) return;
  const double length = track.length_m();
  const auto edge = [&](double s) { return inner_wall(track.at(s)); };
  use(MaterialId::concrete, Surface::inner_wall);  // pit wall, its lane, the front of the garages
  for (const auto& [from, to] : {std::pair<double, double>{0, kPitHalf}, {length - kPitHalf, length}}) {
    use(MaterialId::concrete, Surface::inner_wall);
    add_strip(from, to, 2, [&](double s) { return Pair{at(s, edge(s), 0), at(s, edge(s), 0.95)}; });
    use(MaterialId::building, Surface::building);
    add_strip(from, to, 5, [&](double s) { return Pair{at(s, edge(s) + 28, 0), at(s, edge(s) + 28, 5)}; });
  }
  // Parked: race cars along the boxes, some trucks; some between pit wall and lane, visible over the wall.
  const Mesh parked = make_race_car(Surface::parked_vehicle);
  for (int i = -6; i <= 6; ++i) {
    const double s = track.wrap(32.0 * i + 9);
    use(MaterialId::paint, Surface::parked_vehicle);
    const SurfaceFrame place = track.frame(s, edge(s) + 13);
    mesh.add_mesh({{place.along, place.left, place.up}, place.place}, parked);
    if (i % 3 != 0) continue;
    use(MaterialId::truck, Surface::parked_vehicle);
    const Rigid foot = stand(track.wrap(s + 14), edge(s) + 19);
    mesh.add_box(foot, {-3.2, -1.0, 0.4}, {1.6, 1.0, 2.6});
    mesh.add_box(foot, {1.6, -1.0, 0.4}, {3.0, 1.0, 2.0});
    use(MaterialId::tyre, Surface::parked_vehicle);
    for (const double x : {-2.2, 2.0})
      mesh.add_cylinder(foot * Vec3{x, -1.02, 0.4}, foot * Vec3{x, 1.02, 0.4}, 0.4, 16);
  }
}

}  // namespace

Mesh make_surroundings(const Track& track, const Verge& verge) {
  Builder builder{track, verge, {}};
  builder.add_road();
  if (verge.kerb_m > 0) builder.add_kerbs();
  builder.add_walls();
  builder.add_fence();
  builder.add_gantries();
  builder.add_stands();
  builder.add_pit();
  return std::move(builder.mesh);
}

}  // namespace overtake::sim
