// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Nearest hit of a ray among triangles. Embree finds the triangles whose boxes a ray enters; this file intersects them
// in double (Moeller & Trumbore 1997). The boxes are enlarged by more than float rounding, so that no triangle is
// missed: a hit depends on the triangles alone, not on Embree's version or its ISA.
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
  // isa: Embree's instruction set (sse2, avx, avx2, avx512); "": the widest of this machine. No hit depends on it.
  // Throws std::runtime_error when Embree cannot build the hierarchy, for instance without memory.
  explicit Bvh(const Mesh& mesh, const std::string& isa = "");

  // Nearest hit with near_m < range < far_m; of equal ranges the first triangle. The direction need not be exactly of
  // unit length. A `likely` triangle (the hit of the neighbouring ray) is tested first, which shortens the search; the
  // result is the same.
  Hit cast(Vec3 origin, Vec3 direction, double near_m, double far_m, int32_t likely = -1) const;
  // The same for kPack rays that are almost parallel: they traverse the hierarchy together. far_m[i] <= 0 skips ray i.
  // Each hit equals that of cast().
  static constexpr int32_t kPack = 4;
  void cast_pack(const Vec3* origin, const Vec3* direction, const double* near_m, const double* far_m, int32_t likely,
                 Hit* out) const;
  // Reference: the same without the hierarchy and by another formula (plane, then the side of each edge).
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
  struct Pack;  // kPack rays during the search

  std::vector<Triangle> triangles_;
  std::vector<Vec3> normal_;
  std::shared_ptr<const std::vector<Edges>> edges_;  // by triangle; Embree keeps its address
  std::shared_ptr<RTCSceneTy> scene_;
  Vec3 center_;
  double radius_ = 0;
};

}  // namespace overtake::sim
