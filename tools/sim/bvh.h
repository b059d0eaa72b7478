// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Nearest hit of a ray among triangles. Embree finds the triangles whose boxes a ray enters, and this file meets them
// in double (Moeller & Trumbore 1997). The boxes are grown outwards by more than float rounding, so that no triangle is
// lost: a hit depends on the triangles alone, not on Embree's version nor on the ISA it runs with.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/sim/mesh.h"

struct RTCSceneTy;  // of Embree

namespace overtake::sim {

struct Hit {
  double range_m = 0;     // along the unit direction
  int32_t triangle = -1;  // of the mesh, -1: none
};

class Bvh {
 public:
  Bvh() = default;
  // isa: which instruction set Embree searches with (sse2, avx, avx2, avx512), "" the widest of this machine; no hit
  // depends on it. Throws std::runtime_error when Embree cannot build the hierarchy, for instance without memory.
  explicit Bvh(const Mesh& mesh, const std::string& isa = "");

  // Nearest hit with near_m < range < far_m, of equal ranges the first triangle. The direction need not be exactly of
  // unit length. A triangle that is likely hit (the neighbouring ray's) may be given: it is met first, which bounds the
  // search; the result is the same.
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
  struct Edges {
    Vec3 a, ab, ac;
  };
  struct Pack;  // kPack rays on their way

  std::vector<Triangle> triangles_;
  std::vector<Vec3> normal_;
  std::shared_ptr<const std::vector<Edges>> edges_;  // by triangle; Embree keeps its address
  std::shared_ptr<RTCSceneTy> scene_;
  Vec3 center_;
  double radius_ = 0;
};

}  // namespace overtake::sim
