// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/views.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/io/angles.h"
#include "tools/io/lettering.h"

namespace overtake::cli {
namespace {

using io::Rgb;

constexpr Rgb kBlack = {0, 0, 0}, kUndefined = {70, 30, 70}, kGround = {60, 60, 60}, kObstacle = {250, 215, 90};

// Ends of the colour scale, without the outermost 0.5 % of the values on either side.
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

template <class Share>
std::vector<Rgb> color_shares(const DenseImage& image, Share&& share_of) {
  std::vector<Rgb> colors(image.real.size(), kBlack);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const double share = share_of(i);
    if (!std::isnan(share)) colors[i] = io::scale_color(share);
  }
  return colors;
}

ColoredImage color_range(const DenseImage& image) {
  std::vector<float> known;
  for (const float r : image.real)
    if (r > 0) known.push_back(r);
  const Limits limits = find_limits(known);
  const double low = std::log(limits.low), high = std::log(limits.high);  // near detail and far cars in one picture
  const auto share_of = [&](std::size_t i) {
    return image.real[i] > 0 ? (std::log(double(image.real[i])) - low) / (high - low) : NAN;
  };
  return {color_shares(image, share_of), fixed(limits.low, 1) + " m", fixed(limits.high, 1) + " m (log)"};
}

ColoredImage color_elevation(const DenseImage& image, const DenseImage& returns) {
  std::vector<float> known;
  for (std::size_t i = 0; i < image.real.size(); ++i)
    if (returns.real[i] > 0) known.push_back(image.real[i]);
  const Limits limits = find_limits(known);
  const auto share_of = [&](std::size_t i) {
    return returns.real[i] > 0 ? (double(image.real[i]) - limits.low) / (limits.high - limits.low) : NAN;
  };
  return {color_shares(image, share_of), fixed(io::deg(limits.low), 1) + " deg",
          fixed(io::deg(limits.high), 1) + " deg"};
}

ColoredImage color_angle(const DenseImage& image) {
  auto colors = color_shares(
      image, [&](std::size_t i) { return image.real[i] >= 0 ? double(image.real[i]) / (io::kPi / 2) : NAN; });
  for (std::size_t i = 0; i < colors.size(); ++i)
    if (image.real[i] < -1.5f) colors[i] = kUndefined;  // skipped
  return {colors, "level 0", "90 deg upright"};
}

// A fixed scale: pictures of several scans compare. The road is blue, and the top of a car is green.
ColoredImage color_height(const DenseImage& image, const DenseImage& returns) {
  constexpr double kLow_m = -0.5, kHigh_m = 2.0;
  const auto share_of = [&](std::size_t i) {
    return returns.real[i] > 0 ? (double(image.real[i]) - kLow_m) / (kHigh_m - kLow_m) : NAN;
  };
  return {color_shares(image, share_of), fixed(kLow_m, 1) + " m", fixed(kHigh_m, 1) + " m"};
}

int32_t largest_of(const DenseImage& image) {
  return image.integer.empty() ? 0 : *std::max_element(image.integer.begin(), image.integer.end());
}

ColoredImage color_integers(const DenseImage& image, const DenseImage& returns) {
  std::vector<Rgb> colors(image.integer.size(), kBlack);
  const int32_t largest = largest_of(image);
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const int32_t value = image.integer[i];
    if (image.is_bits)
      colors[i] = value ? kObstacle : returns.real[i] > 0 ? kGround : kBlack;
    else if (image.name == "labels")
      colors[i] = io::label_color(value);
    else if (value >= 0)
      colors[i] = io::scale_color(double(value) / std::max(1, largest));
  }
  return {colors, "", ""};
}

}  // namespace

DenseImage read_image(ovt_reader* reader, int32_t sensor, int32_t id) {
  ovt_image image;
  check(ovt_read_image(reader, sensor, ovt_image_id(id), &image), ovt_image_name(id));
  DenseImage out;
  out.name = ovt_image_name(id);
  out.rows = image.rows;
  out.cols = image.cols;
  out.is_float = image.type == OVT_IMAGE_F32;
  out.is_bits = image.type == OVT_IMAGE_BITS;
  const std::size_t cols = std::size_t(image.cols), pixels = std::size_t(image.rows) * cols;
  if (out.is_float)
    out.real.resize(pixels);
  else
    out.integer.resize(pixels);
  for (int32_t r = 0; r < image.rows; ++r) {
    const char* row = static_cast<const char*>(image.data) + std::size_t(r) * image.stride_bytes;
    const std::size_t at = std::size_t(r) * cols;
    if (out.is_float)
      std::memcpy(out.real.data() + at, row, cols * sizeof(float));
    else if (!out.is_bits)
      std::memcpy(out.integer.data() + at, row, cols * sizeof(int32_t));
    else
      for (std::size_t c = 0; c < cols; ++c) {
        uint64_t word;
        std::memcpy(&word, row + c / 64 * 8, sizeof word);
        out.integer[at + c] = int32_t(word >> (c % 64) & 1);
      }
  }
  return out;
}

std::map<int32_t, DenseImage> read_images(ovt_reader* reader, int32_t sensor) {
  std::map<int32_t, DenseImage> images;
  for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
    ovt_image image;
    if (ovt_read_image(reader, sensor, ovt_image_id(id), &image) != OVT_NOT_COMPUTED)
      images[id] = read_image(reader, sensor, id);
  }
  return images;
}

ColoredImage color_image(const DenseImage& image, const DenseImage& returns) {
  if (!image.is_float) return color_integers(image, returns);
  if (image.name.rfind("angle", 0) == 0) return color_angle(image);
  if (image.name.rfind("elevation", 0) == 0) return color_elevation(image, returns);
  if (image.name == "height") return color_height(image, returns);
  return color_range(image);
}

io::Picture draw_image(const DenseImage& image, const DenseImage& returns) {
  const ColoredImage colored = color_image(image, returns);
  io::ImageStyle style;
  style.zoom_x = std::max(1, 1714 / std::max(1, image.cols));
  style.zoom_y = std::max(2, 420 / std::max(1, image.rows));
  style.caption = image.name;
  if (!image.is_float && !image.is_bits) style.caption += " 0 to " + std::to_string(largest_of(image));
  style.scaled = !colored.low_text.empty();
  style.low_text = colored.low_text, style.high_text = colored.high_text;
  return io::render_image(image.rows, image.cols, colored.colors, style);
}

io::Picture draw_top_view(const float* x_m, const float* y_m, const std::vector<Rgb>& colors, double reach_m,
                          const std::string& caption) {
  constexpr int32_t kSide = 1400, kHead = 20;
  constexpr Rgb kGrid = {40, 40, 48}, kInk = {230, 230, 230};
  // The rectangle of the points within reach; at least 20 m a side.
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
  io::draw_text(picture, 6, 5, caption + ", grid " + fixed(grid_m, 0) + " m, x up", kInk, io::kCaptionSize);
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
