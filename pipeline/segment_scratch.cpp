// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/segment_scratch.h"

#include <algorithm>

namespace overtake {

bool build_scratch(SegmentScratch& scratch, const FrameSizes& sizes, const Allocator& allocator) {
  std::size_t pixels = 0, plane = 0, words = 0, points = 0;
  for (int32_t s = 0; s < sizes.sensor_count; ++s) {
    const int32_t rows = sizes.sensors[s].rows, cols = sizes.sensors[s].cols;
    pixels = std::max(pixels, std::size_t(rows) * std::size_t(cols));
    plane = std::max(plane, plane_elements(rows, cols));
    words = std::max(words, std::size_t(rows) * std::size_t(round_up(cols, 64) / 64));
    points = std::max(points, std::size_t(round_up(sizes.point_capacity[s], kRowAlign)));
  }
  return scratch.arena.build(allocator, [&](Carver& carver) {
    scratch.layer_sums.touched = carver.take<int32_t>(kLayerIds);
    scratch.layer_sums.point_count = carver.take<int32_t>(kLayerIds);
    scratch.layer_sums.elevation_sum = carver.take<int64_t>(kLayerIds);
    scratch.row_of_layer = carver.take<int32_t>(kLayerIds);
    scratch.layer_order = carver.take<int32_t>(kLayerIds);
    for (int32_t** column : {&scratch.queue, &scratch.cursor, &scratch.order})
      *column = carver.take<int32_t>(pixels + 1);
    if (sizes.keep_images) return;
    for (float*& data : scratch.plane) data = carver.take<float>(plane);
    for (uint64_t*& data : scratch.bits) data = carver.take<uint64_t>(words);
    scratch.range_m = carver.take<float>(points);
    scratch.elevation_rad = carver.take<float>(points);
    scratch.column = carver.take<int32_t>(points);
    scratch.pixel = carver.take<int32_t>(points);
    scratch.lost = carver.take<uint8_t>(points);
  });
}

void lend(const SegmentScratch& scratch, const SensorModel& sensor, SensorPart& part) noexcept {
  if (!scratch.plane[0]) return;
  const auto plane_at = [&](int32_t i) { return plane_of(scratch.plane[i], sensor.rows, sensor.cols); };
  const auto bits_at = [&](int32_t i) {
    return BitPlane{scratch.bits[i], sensor.rows, sensor.cols, round_up(sensor.cols, 64) / 64};
  };
  RangeImages& m = part.images;
  m.range_m = plane_at(0);
  m.elevation_rad = m.angle_rad = m.range_repaired_m = plane_at(1);
  m.range_filled_m = plane_at(2);
  m.elevation_filled_rad = plane_at(3);
  m.labels = plane_of(reinterpret_cast<int32_t*>(scratch.plane[3]), sensor.rows, sensor.cols);
  m.angle_smooth_rad = m.elevation_repaired_rad = plane_at(4);
  m.nonground = bits_at(0);
  m.nonground_repaired = bits_at(1);
  m.link_right = bits_at(2);
  m.link_down = bits_at(3);
  PointTable& points = part.points;
  points.range_m = scratch.range_m;
  points.elevation_rad = scratch.elevation_rad;
  points.column = scratch.column;
  points.pixel = scratch.pixel;
  points.lost = scratch.lost;
}

}  // namespace overtake
