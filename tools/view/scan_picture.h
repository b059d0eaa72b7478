// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A scan as it came, recorded or simulated, before anything is made of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/image.h"

namespace overtake::cli {

// Points in the sensor frame. surface: what each of them hit (tools/sim/material.h), null where nobody knows.
struct ScanPoints {
  const float *x_m, *y_m, *z_m;
  std::size_t count;
  const uint16_t* surface;
};

// One below the other: the points over azimuth (left is left) and elevation, coloured by range, 2 to 200 m on a
// logarithmic scale; the same coloured by surface where that is known; from above within 100 m, coloured by height
// over the sensor, -2 to 4 m.
io::Picture draw_scan(const ScanPoints& points, const std::string& caption);

// Colours of surfaces, cars apart from one another.
io::Rgb surface_color(uint16_t surface);
void draw_surface_legend(io::Picture& picture, int32_t x, int32_t y);

}  // namespace overtake::cli
