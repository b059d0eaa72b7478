// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/views.h"

#include <algorithm>
#include <cmath>

#include "tools/console.h"

namespace overtake::cli {
namespace {

using io::Rgb;

constexpr Rgb kBlack = {0, 0, 0}, kUndefined = {70, 30, 70}, kGround = {60, 60, 60}, kObstacle = {250, 215, 90};
constexpr double kHalfPi = 1.57079632679489661923, kDegreesPerRadian = 180.0 / 3.14159265358979323846;

// Where the colours end: all but the outermost 0.5 % of the values on either side.
struct Limits {
  double low = 0, high = 1;
};
Limits find_limits(std::vector<float> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t skip = values.size() / 200;
  const Limits limits{double(values[skip]), double(values[values.size() - 1 - skip])};
  return limits.high > limits.low ? limits : Limits{limits.low, limits.low + 1};
}

io::ImageStyle make_style(const DenseImage& image) {
  io::ImageStyle style;
  style.zoom_x = std::max(1, 1714 / std::max(1, image.cols));
  style.zoom_y = std::max(2, 420 / std::max(1, image.rows));
  style.caption = image.name;
  return style;
}

template <class Share>
std::vector<Rgb> color_shares(const DenseImage& image, Share&& share_of) {
  std::vector<Rgb> colors(image.real.size(), kBlack);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double share = share_of(i);
    if (!std::isnan(share)) colors[i] = io::scale_color(share);
  }
  return colors;
}

io::Picture draw_range(const DenseImage& image) {
  std::vector<float> known;
  for (const float r : image.real)
    if (r > 0) known.push_back(r);
  const Limits limits = find_limits(known);
  const double low = std::log(limits.low), high = std::log(limits.high);  // near detail and far cars in one picture
  io::ImageStyle style = make_style(image);
  style.scaled = true;
  style.low_text = fixed(limits.low, 1) + " m";
  style.high_text = fixed(limits.high, 1) + " m (log)";
  const auto share_of = [&](std::size_t i) {
    return image.real[i] > 0 ? (std::log(double(image.real[i])) - low) / (high - low) : NAN;
  };
  return io::render_image(image.rows, image.cols, color_shares(image, share_of), style);
}

io::Picture draw_elevation(const DenseImage& image, const DenseImage& returns) {
  std::vector<float> known;
  for (std::size_t i = 0; i < image.real.size(); ++i)
    if (returns.real[i] > 0) known.push_back(image.real[i]);
  const Limits limits = find_limits(known);
  io::ImageStyle style = make_style(image);
  style.scaled = true;
  style.low_text = fixed(limits.low * kDegreesPerRadian, 1) + " deg";
  style.high_text = fixed(limits.high * kDegreesPerRadian, 1) + " deg";
  const auto share_of = [&](std::size_t i) {
    return returns.real[i] > 0 ? (double(image.real[i]) - limits.low) / (limits.high - limits.low) : NAN;
  };
  return io::render_image(image.rows, image.cols, color_shares(image, share_of), style);
}

io::Picture draw_angle(const DenseImage& image) {
  io::ImageStyle style = make_style(image);
  style.scaled = true;
  style.low_text = "level 0";
  style.high_text = "90 deg upright";
  auto colors =
      color_shares(image, [&](std::size_t i) { return image.real[i] >= 0 ? double(image.real[i]) / kHalfPi : NAN; });
  for (std::size_t i = 0; i < colors.size(); ++i)
    if (image.real[i] < -1.5f) colors[i] = kUndefined;  // skipped
  return io::render_image(image.rows, image.cols, colors, style);
}

io::Picture draw_integers(const DenseImage& image, const DenseImage& returns) {
  io::ImageStyle style = make_style(image);
  std::vector<Rgb> colors(image.integer.size(), kBlack);
  const int32_t largest = image.integer.empty() ? 0 : *std::max_element(image.integer.begin(), image.integer.end());
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const int32_t value = image.integer[i];
    if (image.is_bits)
      colors[i] = value ? kObstacle : returns.real[i] > 0 ? kGround : kBlack;
    else if (image.name == "labels")
      colors[i] = io::label_color(value);
    else if (value >= 0)
      colors[i] = io::scale_color(double(value) / std::max(1, largest));
  }
  if (!image.is_bits) style.caption += " 0 to " + std::to_string(largest);
  return io::render_image(image.rows, image.cols, colors, style);
}

}  // namespace

io::Picture draw_image(const DenseImage& image, const DenseImage& returns) {
  if (!image.is_float) return draw_integers(image, returns);
  if (image.name.rfind("angle", 0) == 0) return draw_angle(image);
  if (image.name.rfind("elevation", 0) == 0) return draw_elevation(image, returns);
  return draw_range(image);
}

io::Picture draw_top_view(const float* x_m, const float* y_m, const std::vector<Rgb>& colors, double reach_m,
                          const std::string& caption) {
  constexpr int32_t kSide = 1400, kHead = 20;
  constexpr Rgb kGrid = {40, 40, 48}, kInk = {230, 230, 230};
  // The rectangle of the points within reach, at least 20 m a side.
  double low_x = -10, high_x = 10, low_y = -10, high_y = 10;
  const auto within = [&](std::size_t i) { return std::fabs(x_m[i]) < reach_m && std::fabs(y_m[i]) < reach_m; };
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (!within(i)) continue;
    low_x = std::min(low_x, double(x_m[i]) - 1);
    high_x = std::max(high_x, double(x_m[i]) + 1);
    low_y = std::min(low_y, double(y_m[i]) - 1);
    high_y = std::max(high_y, double(y_m[i]) + 1);
  }
  const double pixels_per_m = kSide / std::max(high_x - low_x, high_y - low_y);
  const int32_t width = int32_t((high_y - low_y) * pixels_per_m) + 1,
                height = int32_t((high_x - low_x) * pixels_per_m) + 1;
  io::Picture picture(std::max(width, 480), height + kHead);
  const auto column = [&](double y) { return int32_t((high_y - y) * pixels_per_m); };
  const auto line = [&](double x) { return int32_t((high_x - x) * pixels_per_m) + kHead; };
  const double grid_m = high_x - low_x > 120 || high_y - low_y > 120 ? 20 : 10;
  for (double x = std::ceil(low_x / grid_m) * grid_m; x < high_x; x += grid_m)
    for (int32_t px = 0; px < width; ++px) picture.at(px, line(x)) = kGrid;
  for (double y = std::ceil(low_y / grid_m) * grid_m; y < high_y; y += grid_m)
    for (int32_t py = 0; py < height; ++py) picture.at(column(y), py + kHead) = kGrid;
  for (std::size_t i = 0; i < colors.size(); ++i)
    if (within(i))
      for (int32_t k = 0; k < 4; ++k)
        picture.at(std::min(column(double(y_m[i])) + k % 2, picture.width - 1),
                   std::min(line(double(x_m[i])) + k / 2, picture.height - 1)) = colors[i];
  io::draw_text(picture, 6, 5, caption + ", grid " + fixed(grid_m, 0) + " m, x up", kInk, 2);
  return picture;
}

io::Picture stack_pictures(const std::vector<io::Picture>& pictures) {
  int32_t width = 0, height = 0;
  for (const io::Picture& picture : pictures) {
    width = std::max(width, picture.width);
    height += picture.height;
  }
  io::Picture out(width, height);
  int32_t top = 0;
  for (const io::Picture& picture : pictures) {
    for (int32_t y = 0; y < picture.height; ++y)
      std::copy_n(picture.pixels.begin() + std::ptrdiff_t(y) * picture.width, picture.width, &out.at(0, top + y));
    top += picture.height;
  }
  return out;
}

}  // namespace overtake::cli
