// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/image.h"

#include <algorithm>

#include "tools/io/text.h"

namespace overtake::io {
namespace {

// Three bits per line, top line in the highest bits, left pixel first.
struct Glyph {
  char letter;
  uint16_t bits;
};
constexpr Glyph kFont[] = {
    {'0', 075557}, {'1', 026227}, {'2', 071747}, {'3', 071717}, {'4', 055711}, {'5', 074717}, {'6', 074757},
    {'7', 071122}, {'8', 075757}, {'9', 075717}, {'A', 025755}, {'B', 065656}, {'C', 034443}, {'D', 065556},
    {'E', 074647}, {'F', 074644}, {'G', 034553}, {'H', 055755}, {'I', 072227}, {'J', 011152}, {'K', 055655},
    {'L', 044447}, {'M', 057755}, {'N', 065555}, {'O', 025552}, {'P', 065644}, {'Q', 025563}, {'R', 065655},
    {'S', 034216}, {'T', 072222}, {'U', 055557}, {'V', 055552}, {'W', 055775}, {'X', 055255}, {'Y', 055222},
    {'Z', 071247}, {'.', 000002}, {':', 002020}, {',', 000024}, {'-', 000700}, {'+', 002720}, {'/', 011244},
    {'_', 000007}, {'(', 012221}, {')', 042224}, {'%', 051245}, {'=', 007070},
};

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
  const double at = std::clamp(share, 0.0, 1.0) * kSteps;
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

void draw_text(Picture& picture, int32_t x, int32_t y, std::string_view text, Rgb color, int32_t zoom) {
  for (char c : text) {
    if (c >= 'a' && c <= 'z') c = char(c - 'a' + 'A');
    const auto* glyph = std::find_if(std::begin(kFont), std::end(kFont), [c](const Glyph& g) { return g.letter == c; });
    if (glyph != std::end(kFont))
      for (int32_t py = 0; py < 5 * zoom; ++py)
        for (int32_t px = 0; px < 3 * zoom; ++px) {
          const bool lit = (glyph->bits >> (14 - py / zoom * 3 - px / zoom)) & 1;
          if (lit && x + px >= 0 && x + px < picture.width && y + py >= 0 && y + py < picture.height)
            picture.at(x + px, y + py) = color;
        }
    x += 4 * zoom;
  }
}

Picture render_image(int32_t rows, int32_t cols, const std::vector<Rgb>& colors, const ImageStyle& style) {
  constexpr int32_t kTextZoom = 2, kHead = 5 * kTextZoom + 10, kBar = 160;
  constexpr Rgb kPaper = {24, 24, 28}, kInk = {230, 230, 230};
  Picture picture(std::max(cols * style.zoom_x, 320), rows * style.zoom_y + kHead, kPaper);
  draw_text(picture, 6, 5, style.caption, kInk, kTextZoom);
  if (style.scaled) {
    const auto width_of = [](const std::string& text) { return int32_t(text.size()) * 4 * kTextZoom; };
    const int32_t high = picture.width - width_of(style.high_text) - 4, bar = high - kBar - 8;
    draw_text(picture, high, 5, style.high_text, kInk, kTextZoom);
    draw_text(picture, bar - width_of(style.low_text) - 6, 5, style.low_text, kInk, kTextZoom);
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
