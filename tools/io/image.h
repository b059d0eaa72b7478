// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of images: colour maps, a caption, PNG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace overtake::io {

using Rgb = std::array<uint8_t, 3>;

struct Picture {
  int32_t width = 0, height = 0;
  std::vector<Rgb> pixels;  // row-major, top row first

  Picture(int32_t w, int32_t h, Rgb fill = {0, 0, 0});
  Rgb& at(int32_t x, int32_t y) { return pixels[std::size_t(y) * std::size_t(width) + std::size_t(x)]; }
};

void write_png(const std::string& path, const Picture& picture);
std::string encode_png(const Picture& picture);  // the bytes of a PNG file
Picture read_png(const std::string& path);

// share 0..1 (clamped) from dark blue to yellow; lightness increases evenly, so that it also works in grey.
Rgb scale_color(double share);
// Colours of labels: neighbouring numbers differ in hue and lightness. -1 is black, 0 (ground) dark grey.
Rgb label_color(int32_t label);

constexpr int32_t kCaptionSize = 14;  // of the font (lettering.h), for a caption in a head of 20 rows

// One picture per image: every pixel is zoom_x * zoom_y large, below a caption; `scaled` adds a colour bar with its
// limits.
struct ImageStyle {
  int32_t zoom_x = 2, zoom_y = 12;
  std::string caption;
  bool scaled = false;
  std::string low_text, high_text;
};
Picture render_image(int32_t rows, int32_t cols, const std::vector<Rgb>& colors, const ImageStyle& style);

}  // namespace overtake::io
