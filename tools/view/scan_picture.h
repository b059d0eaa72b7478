// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a raw scan, recorded or simulated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/image.h"

namespace overtake::cli {

// Points in the sensor frame. surface: the surface that each point hit (tools/sim/material.h); null where unknown.
struct ScanPoints {
  const float *x_m, *y_m, *z_m;
  std::size_t count;
  const uint16_t* surface;
};

// Three pictures, one below the other:
//   1  azimuth (left is left) over elevation, colour by range: 2 to 200 m, logarithmic
//   2  the same, colour by surface, if the surfaces are known
//   3  from above within 100 m, colour by height over the sensor: -2 to 4 m
io::Picture draw_scan(const ScanPoints& points, const std::string& caption);

// The colour of a surface; each car has its own.
io::Rgb surface_color(uint16_t surface);
// Names of all surfaces, each in its colour, from (x, y) on; goes on in a new line where the picture ends.
void draw_surface_legend(io::Picture& picture, int32_t x, int32_t y);

}  // namespace overtake::cli
