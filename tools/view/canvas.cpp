// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/canvas.h"

#include <algorithm>
#include <cmath>

#include "tools/io/lettering.h"

namespace overtake::cli {

Canvas::Canvas(double left_m, double top_m, double pixels_per_m, int32_t width, int32_t height, io::Rgb paper)
    : picture(width, height + kHead, paper), left_m_(left_m), top_m_(top_m), scale_(pixels_per_m) {}

void Canvas::dot(PlanePoint at, io::Rgb color, int32_t size) {
  const double x = (at.right_m - left_m_) * scale_, y = (top_m_ - at.up_m) * scale_ + kHead;
  if (!(x >= 0) || !(y >= kHead) || x >= picture.width || y >= picture.height) return;
  for (int32_t dy = 0; dy < size; ++dy)
    for (int32_t dx = 0; dx < size; ++dx)
      picture.at(std::min(int32_t(x) + dx, picture.width - 1), std::min(int32_t(y) + dy, picture.height - 1)) = color;
}

void Canvas::line(PlanePoint from, PlanePoint to, io::Rgb color, int32_t size) {
  const double right = to.right_m - from.right_m, up = to.up_m - from.up_m;
  const int32_t steps = 1 + int32_t(std::min(std::hypot(right, up) * scale_, 1e5));
  for (int32_t i = 0; i <= steps; ++i) {
    const double share = double(i) / steps;
    dot({from.right_m + share * right, from.up_m + share * up}, color, size);
  }
}

void Canvas::polygon(const std::vector<PlanePoint>& corners, io::Rgb color, int32_t size) {
  for (std::size_t i = 0; i < corners.size(); ++i) line(corners[i], corners[(i + 1) % corners.size()], color, size);
}

void Canvas::label(PlanePoint at, std::string_view text, io::Rgb color, int32_t size, int32_t pixels) {
  const double x = (at.right_m - left_m_) * scale_, y = (top_m_ - at.up_m) * scale_ + kHead;
  if (!(x >= 0) || !(y >= kHead) || x >= picture.width || y >= picture.height) return;
  io::draw_text(picture, int32_t(x) + pixels, int32_t(y) - pixels - size * 3 / 4, text, color, size);
}

io::Picture halve(const io::Picture& picture) {
  io::Picture out(picture.width / 2, picture.height / 2);
  for (int32_t y = 0; y < out.height; ++y)
    for (int32_t x = 0; x < out.width; ++x)
      for (std::size_t channel = 0; channel < 3; ++channel) {
        int32_t sum = 2;
        for (const int32_t dy : {0, 1})
          for (const int32_t dx : {0, 1})
            sum +=
                picture.pixels[std::size_t(2 * y + dy) * std::size_t(picture.width) + std::size_t(2 * x + dx)][channel];
        out.at(x, y)[channel] = uint8_t(sum / 4);
      }
  return out;
}

}  // namespace overtake::cli
