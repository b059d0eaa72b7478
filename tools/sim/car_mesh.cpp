// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// An open-wheel race car of the Dallara AV-21's size. Lengths from published data of the car (4.921 x 1.886 m, wheel
// base 2.971 m); shapes by eye. The rear wing is as low as on ovals: seen from the side sensors, its end plates and
// main plane fill the last 7 degrees before straight back at 0.3 to 5 degrees below the horizon, where the recorded
// side scans have no returns from the road behind. The tops of the tyres are 0.57 m above the road of the vehicle
// frame, where the recorded front scans see them (0.87 m away, 5.7 degrees down), although the tyre's radius would put
// them higher.
#include "tools/sim/mesh.h"

namespace overtake::sim {
namespace {

// An octagon with bevelled corners across the car.
std::vector<Vec3> section(double x, double half_width, double low, double high, double y = 0) {
  const double bevel = 0.3 * (half_width < (high - low) / 2 ? half_width : (high - low) / 2);
  const double w = half_width, b = bevel;
  return {{x, y + w, low + b},  {x, y + w, high - b}, {x, y + w - b, high}, {x, y - w + b, high},
          {x, y - w, high - b}, {x, y - w, low + b},  {x, y - w + b, low},  {x, y + w - b, low}};
}

void add_wheel(Mesh& mesh, double x, double y_inner, double y_outer, double radius) {
  mesh.material = MaterialId::tyre;
  mesh.add_cylinder({x, y_inner, radius}, {x, y_outer, radius}, radius, 32, 0.04);
  mesh.material = MaterialId::alloy;
  const double outward = y_outer > y_inner ? 0.004 : -0.004;
  mesh.add_cylinder({x, y_outer - outward, radius}, {x, y_outer + outward, radius}, 0.19, 20);
}

void add_tube(Mesh& mesh, Vec3 from, Vec3 to, double radius) {
  mesh.material = MaterialId::dark_carbon;
  mesh.add_cylinder(from, to, radius, 6);
}

// A wing element: a cambered chord at an angle, lofted over its span.
void add_wing(Mesh& mesh, double x_front, double x_rear, double z_front, double z_rear, double half_span,
              double thickness) {
  std::vector<std::vector<Vec3>> rings;
  for (int k = -4; k <= 4; ++k) {
    const double y = half_span * k / 4;
    std::vector<Vec3> ring;
    for (int i = 0; i <= 4; ++i) {  // upper side, front to rear
      const double t = i / 4.0, camber = 4 * t * (1 - t) * 0.03;
      ring.push_back({lerp(x_front, x_rear, t), y, lerp(z_front, z_rear, t) - camber + thickness * (1 - t) + 0.004});
    }
    for (int i = 4; i >= 0; --i) {
      const double t = i / 4.0, camber = 4 * t * (1 - t) * 0.03;
      ring.push_back({lerp(x_front, x_rear, t), y, lerp(z_front, z_rear, t) - camber});
    }
    rings.push_back(ring);
  }
  mesh.add_loft(rings);
}

}  // namespace

Mesh make_race_car(Surface surface) {
  constexpr double kFrontAxle = 2.971, kFrontRadius = 0.285, kRearRadius = 0.29;
  constexpr double kTip = kCarCenterXM + kCarLengthM / 2, kTail = kCarCenterXM - kCarLengthM / 2;
  constexpr double kHalfWidth = kCarWidthM / 2;
  const Rigid here;
  Mesh mesh;
  mesh.surface = surface;

  // Nose and tub, cockpit with the computer's cover, air box, engine cover, gearbox.
  mesh.material = MaterialId::paint;
  mesh.add_loft({section(3.95, 0.09, 0.16, 0.27), section(3.75, 0.14, 0.14, 0.32), section(3.40, 0.18, 0.10, 0.39),
                 section(2.97, 0.22, 0.06, 0.46), section(2.60, 0.25, 0.05, 0.53), section(2.30, 0.28, 0.05, 0.585),
                 section(2.00, 0.30, 0.05, 0.62), section(1.70, 0.27, 0.05, 0.66), section(1.45, 0.22, 0.05, 0.70)});
  mesh.add_loft({section(1.45, 0.22, 0.05, 0.70), section(1.25, 0.17, 0.10, 0.86), section(1.05, 0.14, 0.20, 0.93),
                 section(0.70, 0.16, 0.20, 0.86), section(0.30, 0.16, 0.20, 0.70), section(0.00, 0.13, 0.18, 0.56),
                 section(-0.30, 0.11, 0.18, 0.46)});
  mesh.material = MaterialId::dark_carbon;
  mesh.add_loft({section(-0.28, 0.13, 0.15, 0.42), section(-0.60, 0.10, 0.18, 0.38), section(-0.78, 0.09, 0.22, 0.36)});
  // Floor and side pods.
  mesh.add_box(here, {0.25, -0.72, 0.035}, {2.30, 0.72, 0.055});
  for (const double side : {1.0, -1.0}) {
    mesh.material = MaterialId::paint;
    mesh.add_loft({section(2.00, 0.17, 0.08, 0.42, side * 0.50), section(1.80, 0.22, 0.06, 0.48, side * 0.53),
                   section(1.20, 0.23, 0.06, 0.47, side * 0.54), section(0.70, 0.19, 0.06, 0.38, side * 0.48),
                   section(0.35, 0.10, 0.06, 0.26, side * 0.36)});
    mesh.material = MaterialId::dark_carbon;
    mesh.add_box(here, {0.42, side > 0 ? 0.72 : -0.90, 0.05}, {0.46, side > 0 ? 0.90 : -0.72, 0.30});  // tyre ramp
  }
  // Front wing: two elements and end plates; its plates are the widest part of the car.
  mesh.material = MaterialId::paint;
  add_wing(mesh, kTip, 3.72, 0.09, 0.15, kHalfWidth - 0.02, 0.03);
  add_wing(mesh, 3.74, 3.55, 0.18, 0.27, kHalfWidth - 0.04, 0.02);
  for (const double side : {1.0, -1.0}) {
    const double y = side * (kHalfWidth - 0.01);
    mesh.add_box(here, {3.50, y - 0.01, 0.06}, {4.00, y + 0.01, 0.34});
    mesh.add_box(here, {3.70, side * 0.13 - 0.01, 0.12}, {3.90, side * 0.13 + 0.01, 0.22});  // pylon
  }
  // Wheels with their rods.
  for (const double side : {1.0, -1.0}) {
    add_wheel(mesh, kFrontAxle, side * (kHalfWidth - 0.27), side * (kHalfWidth - 0.01), kFrontRadius);
    add_wheel(mesh, 0, side * (kHalfWidth - 0.37), side * (kHalfWidth - 0.01), kRearRadius);
    const double front = side * (kHalfWidth - 0.27), rear = side * (kHalfWidth - 0.37);
    add_tube(mesh, {3.25, side * 0.18, 0.22}, {kFrontAxle, front, 0.20}, 0.014);
    add_tube(mesh, {2.65, side * 0.22, 0.22}, {kFrontAxle, front, 0.20}, 0.014);
    add_tube(mesh, {3.20, side * 0.18, 0.40}, {kFrontAxle, front, 0.42}, 0.014);
    add_tube(mesh, {2.65, side * 0.22, 0.46}, {kFrontAxle, front, 0.42}, 0.014);
    add_tube(mesh, {3.08, side * 0.19, 0.42}, {kFrontAxle, front, 0.22}, 0.012);
    add_tube(mesh, {0.42, side * 0.13, 0.24}, {0, rear, 0.22}, 0.016);
    add_tube(mesh, {-0.30, side * 0.11, 0.24}, {0, rear, 0.22}, 0.016);
    add_tube(mesh, {0.38, side * 0.13, 0.42}, {0, rear, 0.46}, 0.016);
    add_tube(mesh, {-0.28, side * 0.11, 0.42}, {0, rear, 0.46}, 0.016);
    add_tube(mesh, {0.00, side * 0.12, 0.35}, {0, rear, 0.35}, 0.025);  // drive shaft
    // Mirrors on rods beside the tub.
    mesh.material = MaterialId::paint;
    mesh.add_box(here, {2.06, side * 0.47 - 0.07, 0.60}, {2.10, side * 0.47 + 0.07, 0.68});
    add_tube(mesh, {2.08, side * 0.29, 0.52}, {2.08, side * 0.44, 0.62}, 0.010);
  }
  // Rear wing with end plates, two pylons; crash structure, diffuser, rain light.
  mesh.material = MaterialId::dark_carbon;
  add_wing(mesh, -0.38, -0.80, 0.60, 0.66, 0.58, 0.025);
  add_wing(mesh, -0.72, kTail + 0.01, 0.67, 0.73, 0.58, 0.015);
  mesh.material = MaterialId::paint;
  for (const double side : {1.0, -1.0}) {
    mesh.add_box(here, {kTail, side * 0.59 - 0.008, 0.48}, {-0.34, side * 0.59 + 0.008, 0.74});
    mesh.add_box(here, {-0.66, side * 0.08 - 0.008, 0.36}, {-0.50, side * 0.08 + 0.008, 0.62});
  }
  mesh.material = MaterialId::dark_carbon;
  mesh.add_quad({0.25, -0.45, 0.05}, {0.25, 0.45, 0.05}, {-0.55, 0.45, 0.24}, {-0.55, -0.45, 0.24});
  mesh.material = MaterialId::lamp;
  mesh.add_box(here, {-0.82, -0.05, 0.24}, {-0.78, 0.05, 0.34});
  // Sensor pod on the tub: the boxes of the LiDARs, behind their origins.
  mesh.material = MaterialId::dark_carbon;
  mesh.add_box(here, {2.18, -0.10, 0.56}, {2.27, 0.10, 0.70});
  for (const double side : {1.0, -1.0})
    mesh.add_box(here, {1.50, side > 0 ? 0.13 : -0.21, 0.66}, {1.62, side > 0 ? 0.21 : -0.13, 0.80});
  mesh.material = MaterialId::steel;  // antennas
  mesh.add_cylinder({1.05, 0, 0.92}, {1.05, 0, 1.06}, 0.03, 8);
  mesh.add_cylinder({3.30, 0, 0.36}, {3.30, 0, 0.44}, 0.03, 8);
  return mesh;
}

}  // namespace overtake::sim
