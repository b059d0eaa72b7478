// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a processed scan: each image in its own colours, and the points from above.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/io/image.h"

namespace overtake::cli {

// An image without padding. One of the two columns is filled, depending on the image's type; bits are integers 0, 1.
struct DenseImage {
  std::string name;
  int32_t rows = 0, cols = 0;
  bool is_float = false, is_bits = false;
  std::vector<float> real;
  std::vector<int32_t> integer;
};

// The image `id` of a sensor's scan in the reader's frame. Throws io::Error.
DenseImage read_image(ovt_reader* reader, int32_t sensor, int32_t id);

// Ids of the images that the detector's method computes. Throws io::Error.
std::map<int32_t, DenseImage> read_images(ovt_reader* reader, int32_t sensor);

// A colour for every pixel, and the values at the ends of the colour scale ("": no scale).
struct ColoredImage {
  std::vector<io::Rgb> colors;
  std::string low_text, high_text;
};
ColoredImage color_image(const DenseImage& image, const DenseImage& returns);

// `returns` is the range image (0: no return). Images that need it are black where there is no return.
io::Picture draw_image(const DenseImage& image, const DenseImage& returns);

// Stacks the pictures one below the other, left-aligned.
io::Picture stack_pictures(const std::vector<io::Picture>& pictures);

// Draws all points within reach_m of the sensor along both axes from above, x up, y left. Later points cover earlier
// ones.
io::Picture draw_top_view(const float* x_m, const float* y_m, const std::vector<io::Rgb>& colors, double reach_m,
                          const std::string& caption);

}  // namespace overtake::cli
