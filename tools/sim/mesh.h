// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangles, and the few shapes that all objects consist of. Both sides of a triangle are visible.
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
  MaterialId material = MaterialId::concrete;  // material of the shapes added next
  Surface surface = Surface::none;

  void add_triangle(Vec3 a, Vec3 b, Vec3 c) { triangles.push_back({a, b, c, material, surface}); }
  void add_quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d);  // corners in order around it
  void add_box(const Rigid& pose, Vec3 low, Vec3 high);
  // Consecutive rings with equal numbers of corners, joined by quads; closed at both ends.
  void add_loft(const std::vector<std::vector<Vec3>>& rings);
  void add_cylinder(Vec3 from, Vec3 to, double radius, int sides, double shoulder_m = 0);
  void add_mesh(const Rigid& pose, const Mesh& other);  // with the materials of `other` and the surface of this mesh
};

// An AV-21-like open-wheel car in the vehicle frame (rear axle, on the road): 4.921 m long, 1.886 m wide.
Mesh make_race_car(Surface surface);
inline constexpr double kCarLengthM = 4.921, kCarWidthM = 1.886, kCarCenterXM = 1.56;

class Track;
// What lies beside the road: kerbs of this height in curves, and grass up to this height from the edge on (0: an
// asphalt apron before level grass).
struct Verge {
  double kerb_m = 0, grass_m = 0;
};
// Everything static: road, lines, apron, grass, walls, fence, gantries, stands, pit lane.
Mesh make_surroundings(const Track& track, const Verge& verge = {});

}  // namespace overtake::sim
