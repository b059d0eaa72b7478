// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/image.h"

#include <algorithm>

#include "tools/io/lettering.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

Rgb mix(const Rgb& a, const Rgb& b, double share) {
  Rgb out;
  for (std::size_t i = 0; i < 3; ++i) out[i] = uint8_t(a[i] + (b[i] - a[i]) * share + 0.5);
  return out;
}

Rgb hue_color(double hue, double lightness, double strength) {  // hue in turns
  Rgb out;
  for (std::size_t i = 0; i < 3; ++i) {
    double h = hue + double(i) / 3;
    h -= double(int64_t(h));
    const double ramp = std::clamp(std::abs(6 * h - 3) - 1, 0.0, 1.0);
    out[i] = uint8_t(255 * lightness * (1 - strength * (1 - ramp)) + 0.5);
  }
  return out;
}

}  // namespace

Picture::Picture(int32_t w, int32_t h, Rgb fill) : width(w), height(h), pixels(std::size_t(w) * std::size_t(h), fill) {}

Rgb scale_color(double share) {
  static constexpr Rgb kStops[] = {{38, 20, 84},   {50, 60, 135},  {44, 100, 150}, {36, 135, 150},
                                   {40, 170, 130}, {105, 200, 90}, {190, 220, 60}, {253, 240, 110}};
  constexpr int32_t kSteps = int32_t(std::size(kStops)) - 1;
  const double at = share > 0.0 ? std::min(share, 1.0) * kSteps : 0.0;  // also of NaN
  const int32_t stop = std::min(int32_t(at), kSteps - 1);
  return mix(kStops[stop], kStops[stop + 1], at - stop);
}

Rgb label_color(int32_t label) {
  if (label < 0) return {0, 0, 0};
  if (label == 0) return {60, 60, 60};
  static constexpr double kLightness[] = {1.0, 0.72, 0.86};
  const double turns = label * 0.61803398874989485;  // the golden angle spreads consecutive numbers over all hues
  return hue_color(turns, kLightness[label % 3], label % 2 ? 0.85 : 0.6);
}

Picture render_image(int32_t rows, int32_t cols, const std::vector<Rgb>& colors, const ImageStyle& style) {
  constexpr int32_t kHead = 20, kBar = 160;
  constexpr Rgb kPaper = {24, 24, 28}, kInk = {230, 230, 230};
  Picture picture(std::max(cols * style.zoom_x, 320), rows * style.zoom_y + kHead, kPaper);
  draw_text(picture, 6, 5, style.caption, kInk, kCaptionSize);
  if (style.scaled) {
    const int32_t high = picture.width - text_width(style.high_text, kCaptionSize) - 4, bar = high - kBar - 8;
    draw_text(picture, high, 5, style.high_text, kInk, kCaptionSize);
    draw_text(picture, bar - text_width(style.low_text, kCaptionSize) - 6, 5, style.low_text, kInk, kCaptionSize);
    for (int32_t x = 0; x < kBar; ++x)
      for (int32_t y = 4; y < kHead - 5; ++y)
        if (bar + x >= 0) picture.at(bar + x, y) = scale_color(double(x) / (kBar - 1));
  }
  for (int32_t y = 0; y < rows * style.zoom_y; ++y)
    for (int32_t x = 0; x < cols * style.zoom_x; ++x)
      picture.at(x, y + kHead) =
          colors[std::size_t(y / style.zoom_y) * std::size_t(cols) + std::size_t(x / style.zoom_x)];
  return picture;
}

}  // namespace overtake::io
