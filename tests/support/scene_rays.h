// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Intersections of a ray with the surfaces of a scene. Each function updates the nearest hit (distance along the unit
// direction, cosine of the angle between ray and normal), or leaves it unchanged.
#pragma once

#include "tests/support/scene.h"

namespace overtake {

struct Vec3 {
  double x, y, z;
};

struct Ray {
  Vec3 from, along;  // along is a unit vector
};

struct Hit {
  double range_m, cos_incidence;
  SceneSurface surface;
};

struct Box {
  double x_min, x_max, y_min, y_max, z_min, z_max;
};

// Road: z = (rho - radius) tan(banking) for rho_min <= rho <= rho_max, seen from above.
struct Cone {
  double radius_m, tan_banking, rho_min_m, rho_max_m;
};
void meet_cone(const Ray& ray, const Cone& cone, Hit* nearest) noexcept;

// Level ground at z for rho <= rho_max, seen from above.
struct Disc {
  double z_m, rho_max_m;
  SceneSurface surface;
};
void meet_disc(const Ray& ray, const Disc& disc, Hit* nearest) noexcept;

// Upright wall rho = radius for z_min <= z <= z_max, both faces.
struct Cylinder {
  double radius_m, z_min_m, z_max_m;
  SceneSurface surface;
};
void meet_cylinder(const Ray& ray, const Cylinder& cylinder, Hit* nearest) noexcept;

// Boxes along the axes of the car's own frame; the ray is given in that frame.
void meet_boxes(const Ray& ray, const Box* boxes, int32_t count, Hit* nearest) noexcept;

}  // namespace overtake
