// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Dots, lines and text in metres on a picture: `right` and `up` are the coordinates that grow to the right and up.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "tools/io/image.h"

namespace overtake::cli {

struct PlanePoint {
  double right_m, up_m;
};

class Canvas {
 public:
  static constexpr int32_t kHead = 20;  // rows above the plane, for a caption

  // left_m, top_m: edge of the plane. width, height: its size in pixels, without the head.
  Canvas(double left_m, double top_m, double pixels_per_m, int32_t width, int32_t height, io::Rgb paper);

  void dot(PlanePoint at, io::Rgb color, int32_t size);
  void line(PlanePoint from, PlanePoint to, io::Rgb color, int32_t size);
  void polygon(const std::vector<PlanePoint>& corners, io::Rgb color, int32_t size);  // closed
  // Writes beside a point: the text's lower left corner is `pixels` to the right of it and above it.
  void label(PlanePoint at, std::string_view text, io::Rgb color, int32_t size, int32_t pixels);

  io::Picture picture;

 private:
  double left_m_, top_m_, scale_;
};

// Halves both sides; each pixel is the mean of four, which smooths edges.
io::Picture halve(const io::Picture& picture);

}  // namespace overtake::cli
