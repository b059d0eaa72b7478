// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The loops of the floor: the memory traffic and arithmetic of a scan alone. See bench_floor.cpp.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "bench/clouds.h"
#include "core/math.h"

namespace overtake::bench {

struct Loops {
  const char* isa;
  uint64_t (*sum)(const uint64_t* from, std::size_t count);
  void (*copy)(const uint64_t* from, uint64_t* to, std::size_t count);
  void (*clear)(float* to, std::size_t count);
  void (*atan2)(const float* y, const float* x, float* to, std::size_t count);
  void (*filter)(const float* const* rows, float* to, std::size_t count);  // five rows to one
  bool can_run;
};

// Of each ISA that this program has; the best one that this CPU runs comes last.
std::vector<Loops> all_loops();
// Those of an ISA; "": the best one that this CPU runs. Of an ISA without loops (ref): the first.
Loops find_loops(const std::string& isa);

inline constexpr int32_t kFloorRows = 32, kFloorCols = 857;
inline constexpr std::size_t kFloorPixels = std::size_t(kFloorRows) * kFloorCols;

// The scan in the form that the passes need. Arrays are padded, so that loops may read whole vectors.
struct FloorScan {
  std::vector<CloudPoint> points;
  std::vector<float> x, y, azimuth, intensity;
  std::vector<int32_t> pixel, shuffled, labels;
  std::vector<float> images[7], out;

  explicit FloorScan(const Cloud& cloud) : points(cloud.points) {
    const float left = float(cloud.sensor.azimuth_left_rad), right = float(cloud.sensor.azimuth_right_rad);
    for (const CloudPoint& p : points) {
      x.push_back(p.x_m);
      y.push_back(p.y_m);
      intensity.push_back(p.intensity);
      const int32_t column = int32_t((left - atan2_f32(p.y_m, p.x_m)) / (left - right) * float(kFloorCols));
      pixel.push_back(std::clamp(column, 0, kFloorCols - 1) + p.layer % kFloorRows * kFloorCols);
    }
    azimuth.resize(x.size());
    labels.resize(x.size());
    shuffled = pixel;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
    for (std::vector<float>& image : images) image.assign(kFloorPixels, 1.5f);
    out.resize(kFloorPixels);
  }
  std::size_t count() const { return points.size(); }
  std::size_t words() const { return count() * sizeof(CloudPoint) / 8; }
  const uint64_t* raw() const { return reinterpret_cast<const uint64_t*>(points.data()); }
};

// The parts of the floor, and the floor of a whole segmentation.
void floor_scatter(const std::vector<int32_t>& pixel, const std::vector<float>& value, std::vector<float>& image);
void floor_scatter_largest(const std::vector<int32_t>& pixel, const std::vector<float>& value,
                           std::vector<float>& image);
void floor_filter(const Loops& loops, const std::vector<float>& from, std::vector<float>& to);
void segment_floor(const Loops& loops, FloorScan& scan);

}  // namespace overtake::bench
