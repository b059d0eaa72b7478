// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Nearest hit of a ray among triangles: a bounding volume hierarchy (binned surface-area heuristic, Wald 2007) of float
// boxes grown outwards, so that they never lose a triangle; triangles are met in double (Moeller & Trumbore 1997).
#pragma once

#include <cstdint>
#include <vector>

#include "tools/sim/mesh.h"

namespace overtake::sim {

struct Hit {
  double range_m = 0;     // along the unit direction
  int32_t triangle = -1;  // of the mesh, -1: none
};

class Bvh {
 public:
  Bvh() = default;
  explicit Bvh(const Mesh& mesh);

  // Nearest hit with near_m < range < far_m. The direction need not be exactly of unit length. A triangle that is
  // likely hit (the neighbouring ray's) may be given: it is met first, which bounds the search; the result is the same.
  Hit cast(Vec3 origin, Vec3 direction, double near_m, double far_m, int32_t likely = -1) const;
  // The same for kPack rays side by side, which should run nearly alike: they go down the hierarchy together. Ray i has
  // a far_m[i] <= 0 where it is not to be cast. Each hit is what cast() says.
  static constexpr int32_t kPack = 4;
  void cast_pack(const Vec3* origin, const Vec3* direction, const double* near_m, const double* far_m, int32_t likely,
                 Hit* out) const;
  // The same without the hierarchy and by another formula: plane, then the side of each edge.
  Hit cast_brute_force(Vec3 origin, Vec3 direction, double near_m, double far_m) const;

  Vec3 normal(int32_t triangle) const { return normal_[std::size_t(triangle)]; }
  const Triangle& triangle(int32_t i) const { return triangles_[std::size_t(i)]; }
  std::size_t size() const { return triangles_.size(); }
  Vec3 center() const { return center_; }
  double radius_m() const { return radius_; }

 private:
  // While building: children at first and first + 1; a leaf: count triangles from first.
  struct Branch {
    float low[3];
    int32_t first;
    float high[3];
    int32_t count;
  };
  // Four boxes side by side; child: a node, or where count > 0 the first of so many triangles. Empty: count < 0.
  struct Node {
    float low[3][4], high[3][4];
    int32_t child[4], count[4];
  };
  struct Edges {
    Vec3 a, ab, ac;
    int32_t index;
  };
  void split(std::size_t branch, int32_t begin, int32_t end, int depth);
  int32_t widen(int32_t branch);

  std::vector<Triangle> triangles_;
  std::vector<Vec3> normal_;
  std::vector<Branch> branches_;  // while building
  std::vector<Node> nodes_;
  std::vector<Edges> edges_;    // in leaf order
  std::vector<int32_t> place_;  // of each triangle in edges_
  std::vector<int32_t> order_;  // while building
  Vec3 center_;
  double radius_ = 0;
};

}  // namespace overtake::sim
