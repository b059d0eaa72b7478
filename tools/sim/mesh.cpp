// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/mesh.h"

namespace overtake::sim {

void Mesh::add_quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  add_triangle(a, b, c);
  add_triangle(a, c, d);
}

void Mesh::add_box(const Rigid& pose, Vec3 low, Vec3 high) {
  const auto corner = [&](int i) {
    return pose * Vec3{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
  };
  constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}};
  for (const auto& f : kFaces) add_quad(corner(f[0]), corner(f[1]), corner(f[2]), corner(f[3]));
}

void Mesh::add_loft(const std::vector<std::vector<Vec3>>& rings) {
  const std::size_t n = rings.front().size();
  for (std::size_t r = 0; r + 1 < rings.size(); ++r)
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t j = i + 1 < n ? i + 1 : 0;
      add_quad(rings[r][i], rings[r][j], rings[r + 1][j], rings[r + 1][i]);
    }
  for (const auto* ring : {&rings.front(), &rings.back()})
    for (std::size_t i = 1; i + 1 < n; ++i) add_triangle((*ring)[0], (*ring)[i], (*ring)[i + 1]);
}

void Mesh::add_cylinder(Vec3 from, Vec3 to, double radius, int sides, double shoulder_m) {
  const Vec3 axis = normalized(to - from);
  const Vec3 u = normalized(cross(axis, std::fabs(axis.z) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0})), v = cross(axis, u);
  const auto ring = [&](Vec3 center, double r) {
    std::vector<Vec3> corners;
    for (int i = 0; i < sides; ++i) {
      const SinCos a = sin_cos(2 * kPi * i / sides);
      corners.push_back(center + u * (r * a.cos) + v * (r * a.sin));
    }
    return corners;
  };
  if (shoulder_m > 0)
    add_loft({ring(from, radius - shoulder_m), ring(from + axis * shoulder_m, radius),
              ring(to - axis * shoulder_m, radius), ring(to, radius - shoulder_m)});
  else
    add_loft({ring(from, radius), ring(to, radius)});
}

void Mesh::add_mesh(const Rigid& pose, const Mesh& other) {
  for (const Triangle& t : other.triangles)
    triangles.push_back({pose * t.a, pose * t.b, pose * t.c, t.material, surface});
}

}  // namespace overtake::sim
