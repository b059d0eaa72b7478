// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/scene_rays.h"

#include <cmath>
#include <limits>
#include <utility>

namespace overtake {
namespace {

void keep_nearer(double range_m, double cos_incidence, SceneSurface surface, Hit* nearest) noexcept {
  if (range_m > 0 && range_m < nearest->range_m) *nearest = {range_m, std::fabs(cos_incidence), surface};
}

}  // namespace

// (h + t dz)^2 = k^2 |o + t d|^2 in the plane, with h the height over the cone's tip. Two roots at most; the second
// nappe of the cone lies far below the road and no ray of a scene reaches it before its range ends.
void meet_cone(const Ray& ray, const Cone& cone, Hit* nearest) noexcept {
  const Vec3 o = ray.from, d = ray.along;
  const double k = cone.tan_banking, h = o.z + cone.radius_m * k;
  double root[2] = {0, 0};
  if (k == 0) {
    if (d.z < 0) root[0] = -o.z / d.z;
  } else {
    const double a = d.z * d.z - k * k * (d.x * d.x + d.y * d.y);
    const double half_b = h * d.z - k * k * (o.x * d.x + o.y * d.y);
    const double c = h * h - k * k * (o.x * o.x + o.y * o.y);
    const double discriminant = half_b * half_b - a * c;
    if (discriminant < 0) return;
    const double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));  // no cancellation
    if (a != 0) root[0] = q / a;
    if (q != 0) root[1] = c / q;
  }
  for (double t : root) {
    const double x = o.x + t * d.x, y = o.y + t * d.y, rho = std::sqrt(x * x + y * y);
    if (rho < cone.rho_min_m || rho > cone.rho_max_m) continue;
    const double cos_banking = 1 / std::sqrt(1 + k * k), sin_banking = k * cos_banking;
    const double cos_incidence = d.z * cos_banking - (d.x * x + d.y * y) / rho * sin_banking;
    keep_nearer(t, cos_incidence, SceneSurface::road, nearest);
  }
}

void meet_disc(const Ray& ray, const Disc& disc, Hit* nearest) noexcept {
  if (ray.along.z >= 0) return;
  const double t = (disc.z_m - ray.from.z) / ray.along.z;
  const double x = ray.from.x + t * ray.along.x, y = ray.from.y + t * ray.along.y;
  if (x * x + y * y > disc.rho_max_m * disc.rho_max_m) return;
  keep_nearer(t, ray.along.z, disc.surface, nearest);
}

void meet_cylinder(const Ray& ray, const Cylinder& cylinder, Hit* nearest) noexcept {
  const Vec3 o = ray.from, d = ray.along;
  const double a = d.x * d.x + d.y * d.y;
  const double half_b = o.x * d.x + o.y * d.y;
  const double c = o.x * o.x + o.y * o.y - cylinder.radius_m * cylinder.radius_m;
  const double discriminant = half_b * half_b - a * c;
  if (discriminant < 0) return;
  const double root = std::sqrt(discriminant);
  for (const double t : {(-half_b - root) / a, (-half_b + root) / a}) {
    const double z = o.z + t * d.z;
    if (z < cylinder.z_min_m || z > cylinder.z_max_m) continue;
    keep_nearer(t, root / cylinder.radius_m, cylinder.surface, nearest);
  }
}

void meet_boxes(const Ray& ray, const Box* boxes, int32_t count, Hit* nearest) noexcept {
  const double o[3] = {ray.from.x, ray.from.y, ray.from.z}, d[3] = {ray.along.x, ray.along.y, ray.along.z};
  for (int32_t i = 0; i < count; ++i) {
    const Box& b = boxes[i];
    const double lo[3] = {b.x_min, b.y_min, b.z_min}, hi[3] = {b.x_max, b.y_max, b.z_max};
    double enter = 0, leave = std::numeric_limits<double>::max(), cos_incidence = 1;
    for (int axis = 0; axis < 3; ++axis) {
      double near = (lo[axis] - o[axis]) / d[axis], far = (hi[axis] - o[axis]) / d[axis];  // +-inf when parallel
      if (near > far) std::swap(near, far);
      if (near > enter) {
        enter = near;
        cos_incidence = d[axis];
      }
      if (far < leave) leave = far;
    }
    if (enter <= leave) keep_nearer(enter, cos_incidence, SceneSurface::opponent, nearest);
  }
}

}  // namespace overtake
