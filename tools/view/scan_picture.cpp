// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/scan_picture.h"

#include <algorithm>
#include <cmath>

#include "tools/client/console.h"
#include "tools/io/angles.h"
#include "tools/io/lettering.h"
#include "tools/sim/material.h"
#include "tools/view/views.h"

namespace overtake::cli {
namespace {

using io::Rgb;

constexpr Rgb kInk = {230, 230, 230}, kGrid = {40, 40, 48};
constexpr int32_t kWidth = 1400, kHeight = 420, kHead = 20, kLegendSize = 12;
constexpr double kNearest = 2, kFarthest = 200, kLowest = -2, kHighest = 4;

struct Angles {
  std::vector<double> azimuth_deg, elevation_deg;
  double left = -180, right = 180, top = -90, bottom = 90;  // ends of the picture
};

Angles angles_of(const ScanPoints& points) {
  Angles out;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double x = double(points.x_m[i]), y = double(points.y_m[i]), z = double(points.z_m[i]);
    const bool usable = std::isfinite(x) && std::isfinite(y) && std::isfinite(z) && (x != 0 || y != 0);
    out.azimuth_deg.push_back(usable ? io::deg(std::atan2(y, x)) : NAN);
    out.elevation_deg.push_back(usable ? io::deg(std::atan2(z, std::hypot(x, y))) : NAN);
    if (!usable) continue;
    out.left = std::max(out.left, out.azimuth_deg.back()), out.right = std::min(out.right, out.azimuth_deg.back());
    out.top = std::max(out.top, out.elevation_deg.back()), out.bottom = std::min(out.bottom, out.elevation_deg.back());
  }
  // All sensors' pictures have the same scale: at least +-60.5 by +-11 degrees.
  out.left = std::max(out.left, 60.5), out.right = std::min(out.right, -60.5);
  out.top = std::max(out.top, 11.0), out.bottom = std::min(out.bottom, -11.0);
  return out;
}

io::Picture draw_angles(const Angles& angles, const std::vector<Rgb>& colors, const std::string& caption) {
  io::Picture picture(kWidth, kHeight + kHead);
  const auto column = [&](double a) {
    return int32_t((angles.left - a) / (angles.left - angles.right) * (kWidth - 3));
  };
  const auto line = [&](double e) {
    return kHead + int32_t((angles.top - e) / (angles.top - angles.bottom) * (kHeight - 4));
  };
  for (double e = std::ceil(angles.bottom / 5) * 5; e < angles.top; e += 5)
    for (int32_t x = 0; x < kWidth; ++x) picture.at(x, line(e)) = kGrid;
  for (double a = std::ceil(angles.right / 20) * 20; a < angles.left; a += 20)
    for (int32_t y = kHead; y < kHead + kHeight; ++y) picture.at(column(a), y) = kGrid;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (std::isnan(angles.azimuth_deg[i])) continue;
    const int32_t x = column(angles.azimuth_deg[i]), y = line(angles.elevation_deg[i]);
    for (int32_t k = 0; k < 6; ++k) picture.at(x + k % 2, y + k / 2) = colors[i];
  }
  io::draw_text(picture, 6, 5, caption, kInk, io::kCaptionSize);
  return picture;
}

}  // namespace

Rgb surface_color(uint16_t surface) {
  static constexpr Rgb kColors[] = {{0, 0, 0},       {95, 95, 105},  {70, 130, 60},   {200, 200, 210}, {150, 140, 120},
                                    {60, 170, 255},  {40, 80, 160},  {255, 160, 40},  {140, 90, 60},   {200, 90, 200},
                                    {180, 230, 230}, {255, 120, 90}, {255, 255, 255}, {255, 40, 60},   {250, 250, 120}};
  static constexpr Rgb kCars[] = {{255, 40, 60}, {255, 225, 40}, {60, 240, 90}, {255, 100, 220}};
  if (surface >= uint16_t(sim::Surface::car)) return kCars[(surface - uint16_t(sim::Surface::car)) % std::size(kCars)];
  return surface < std::size(kColors) ? kColors[surface] : Rgb{255, 255, 255};
}

void draw_surface_legend(io::Picture& picture, int32_t x, int32_t y) {
  std::vector<std::pair<std::string, Rgb>> entries;
  for (uint16_t s = 1; s <= uint16_t(sim::Surface::rain); ++s)
    entries.emplace_back(sim::surface_name(s), surface_color(s));
  for (uint16_t car = 0; car < 3; ++car)
    entries.emplace_back("car " + std::to_string(car), surface_color(uint16_t(uint16_t(sim::Surface::car) + car)));
  const int32_t left = x;
  for (const auto& [name, color] : entries) {
    const int32_t width = io::text_width(name, kLegendSize);
    if (x > left && x + width > picture.width) x = left, y += kLegendSize + 3;
    io::draw_text(picture, x, y, name, color, kLegendSize);
    x += width + 10;
  }
}

io::Picture draw_scan(const ScanPoints& points, const std::string& caption) {
  const Angles angles = angles_of(points);
  std::vector<Rgb> by_range, by_height, by_surface;
  for (std::size_t i = 0; i < points.count; ++i) {
    const double range = std::hypot(double(points.x_m[i]), double(points.y_m[i]), double(points.z_m[i]));
    by_range.push_back(
        io::scale_color(std::log(std::max(range, kNearest) / kNearest) / std::log(kFarthest / kNearest)));
    by_height.push_back(io::scale_color((double(points.z_m[i]) - kLowest) / (kHighest - kLowest)));
    if (points.surface) by_surface.push_back(surface_color(points.surface[i]));
  }
  const std::string axes = fixed(angles.left, 0) + " to " + fixed(angles.right, 0) + " deg, " + fixed(angles.top, 0) +
                           " to " + fixed(angles.bottom, 0) + " deg";
  std::vector<io::Picture> parts = {draw_angles(angles, by_range, caption + ", range 2 to 200 m (log), " + axes)};
  if (points.surface) {
    parts.push_back(draw_angles(angles, by_surface, caption + ", surfaces"));
    draw_surface_legend(parts.back(), 6, kHead + kHeight - kLegendSize);
  }
  parts.push_back(draw_top_view(points.x_m, points.y_m, by_height, 100, caption + ", height -2 to 4 m"));
  return stack_pictures(parts);
}

}  // namespace overtake::cli
