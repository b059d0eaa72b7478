// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangles and the few shapes everything is built of. Both sides of a triangle are seen.
#pragma once

#include <vector>

#include "tools/sim/material.h"

namespace overtake::sim {

struct Triangle {
  Vec3 a, b, c;
  MaterialId material;
  Surface surface;
};

struct Mesh {
  std::vector<Triangle> triangles;
  MaterialId material = MaterialId::concrete;  // of what is added next
  Surface surface = Surface::none;

  void add_triangle(Vec3 a, Vec3 b, Vec3 c) { triangles.push_back({a, b, c, material, surface}); }
  void add_quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d);  // corners in order round it
  void add_box(const Rigid& pose, Vec3 low, Vec3 high);
  // Rings of equally many corners, one after the other, joined by quads; closed at both ends.
  void add_loft(const std::vector<std::vector<Vec3>>& rings);
  void add_cylinder(Vec3 from, Vec3 to, double radius, int sides, double shoulder_m = 0);
  void add_mesh(const Rigid& pose, const Mesh& other);  // with its own materials, but this mesh's surface
};

// An AV-21-like open-wheel car in the vehicle frame (rear axle, on the road): 4.921 m long, 1.886 m wide.
Mesh make_race_car(Surface surface);
inline constexpr double kCarLengthM = 4.921, kCarWidthM = 1.886, kCarCenterXM = 1.56;

class Track;
// Everything that stands still: road, lines, apron, grass, walls, fence, gantries, stands, pit lane.
Mesh make_surroundings(const Track& track);

}  // namespace overtake::sim
