// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reflectivity of surfaces at 1550 nm, and the list of surfaces. A material's reflectivity is that of a white
// Lambertian target seen head-on with the same return:
//
//     g(theta) = diffuse * (A cos theta + B sin^2 theta)      rough diffuse (Oren & Nayar 1994), lit from the eye
//              + gloss * exp(-(theta / gloss_width)^2)         specular lobe of lacquer, carbon, glass
//              + retro * cos theta                             reflectors
//
// A = 1 - s^2 / (2 (s^2 + 0.33)), B = 0.45 s^2 / (s^2 + 0.09), s the roughness (standard deviation of facet slopes).
// Asphalt is rough: it keeps its brightness at grazing angles; a painted car does not.
#pragma once

#include <cstdint>
#include <iterator>

#include "tools/sim/sim_math.h"

namespace overtake::sim {

enum class MaterialId : uint8_t {
  asphalt,
  white_line,
  concrete,
  grass,
  safer_wall,
  steel,
  fence_wire,
  sign,
  building,
  reflector,
  paint,
  dark_carbon,
  tyre,
  alloy,
  lamp,
  truck,
  debris,
  count
};

struct Material {
  double diffuse, roughness, gloss, gloss_width_rad, retro;
  double wire_m;  // 0: solid; else a mesh of wires this thick, kMeshPitch apart
};

inline constexpr double kMeshPitch = 0.05;

// Estimates from the literature on reflectances of such surfaces at 1.5 um, rounded. Only asphalt follows the recorded
// scans, where its intensity is the same from 9 to 2 deg of incidence (0.11, 0.14 and 0.17 in three lanes).
inline const Material& material_of(MaterialId id) {
  static constexpr Material kMaterials[int(MaterialId::count)] = {
      {0.35, 0.60, 0, 1, 0, 0},         // asphalt
      {0.55, 0.60, 0, 1, 0.1, 0},       // white line: paint with some glass beads
      {0.40, 0.30, 0, 1, 0, 0},         // concrete
      {0.35, 0.60, 0, 1, 0, 0},         // grass
      {0.60, 0.15, 0, 1, 0, 0},         // SAFER wall: painted steel tubes, white
      {0.40, 0.10, 0.5, 0.15, 0, 0},    // galvanised steel: posts, gantries
      {0.40, 0.30, 0, 1, 0, 0.0025},    // wire mesh
      {0.55, 0.10, 0, 1, 0.5, 0},       // signs
      {0.35, 0.30, 0, 1, 0, 0},         // stands, buildings
      {0.30, 0.10, 0, 1, 30, 0},        // retro-reflectors
      {0.30, 0.05, 1.0, 0.10, 0, 0},    // lacquered bodywork
      {0.02, 0.05, 0.8, 0.08, 0, 0},    // bare carbon: black, specular
      {0.025, 0.30, 0.02, 0.30, 0, 0},  // tyres
      {0.30, 0.10, 0.5, 0.12, 0, 0},    // rims, uprights
      {0.20, 0.10, 0, 1, 12, 0},        // rain light
      {0.45, 0.10, 0.5, 0.10, 0, 0},    // parked trucks
      {0.10, 0.40, 0, 1, 0, 0},         // debris: rubber and carbon
  };
  return kMaterials[int(id)];
}

inline double returned_share(const Material& m, double cos_incidence) {
  const double c = clamp(cos_incidence, 0, 1), s2 = square(m.roughness);
  const double a = 1 - 0.5 * s2 / (s2 + 0.33), b = 0.45 * s2 / (s2 + 0.09);
  double g = m.diffuse * (a * c + b * (1 - c * c)) + m.retro * c;
  if (m.gloss > 0) {
    const double theta2 = 2 * (1 - c);  // theta^2, within 1 % at 20 deg
    g += m.gloss * exp_of(-theta2 / square(m.gloss_width_rad));
  }
  return g;
}

// The truth of a point. Cars are `car` + their number in the scenario; the ego's own is `own_car`.
enum class Surface : uint16_t {
  none = 0,
  road,
  apron_grass,
  outer_wall,
  inner_wall,
  fence_post,
  fence_wire,
  gantry_sign,
  building,
  parked_vehicle,
  smoke_dust,
  debris,
  blooming,
  own_car,
  rain,
  car = 100
};
inline const char* surface_name(uint16_t surface) {
  constexpr const char* kNames[] = {"none",       "road",       "apron_grass", "outer_wall", "inner_wall",
                                    "fence_post", "fence_wire", "gantry_sign", "building",   "parked_vehicle",
                                    "smoke_dust", "debris",     "blooming",    "own_car",    "rain"};
  return surface < std::size(kNames) ? kNames[surface] : surface >= uint16_t(Surface::car) ? "car" : "unknown";
}

}  // namespace overtake::sim
