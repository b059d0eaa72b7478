// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stages 0 to 7 of one sensor in order, by the kernels of any ISA, on memory of its own: what a test needs to see a
// whole scan through. Preset `paper`.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/range_image.h"
#include "core/table.h"
#include "kernels/kernel_table.h"

namespace overtake::test {

struct TestPoint {
  float x_m = 0, y_m = 0, z_m = 0, intensity = 1, layer = 0;
};

inline PointFields fields_of(const std::vector<TestPoint>& points) {
  const TestPoint* first = points.data();
  auto field = [](const float* at) { return PointField{at, std::ptrdiff_t(sizeof(TestPoint)), FieldType::kFloat32}; };
  PointFields fields;
  if (points.empty()) return fields;
  fields.x = field(&first->x_m);
  fields.y = field(&first->y_m);
  fields.z = field(&first->z_m);
  fields.intensity = field(&first->intensity);
  fields.layer = field(&first->layer);
  return fields;
}

class SegmentChain {
 public:
  SegmentChain(const SensorModel& model, int32_t capacity) : sensor(model) {
    const auto carve = [&](Carver& carver) {
      carve_table(carver, scan, capacity);
      carve_table(carver, points, capacity);
      carve_range_images(carver, images, sensor.rows, sensor.cols);
      sums.touched = carver.take<int32_t>(kLayerIds);
      sums.point_count = carver.take<int32_t>(kLayerIds);
      sums.elevation_sum = carver.take<int64_t>(kLayerIds);
      row_of_layer = carver.take<int32_t>(kLayerIds);
      layer_order_ = carver.take<int32_t>(kLayerIds);
      queue_ = carver.take<int32_t>(std::size_t(sensor.rows) * std::size_t(sensor.cols));
    };
    if (!arena_.build(default_allocator(), carve)) std::abort();
    make_smooth_sg(5, 2, &smooth);
    repair.wraps = links.wraps = sensor.wraps;
    links.sin_pitch = sensor.sin_pitch;
    links.cos_pitch = sensor.cos_pitch;
  }

  void run(const std::vector<TestPoint>& cloud) {
    const KernelTable& k = *kernels;
    k.load_points(fields_of(cloud), int32_t(cloud.size()), scan);
    k.project_points(sensor, scan, points, sums);
    row_count = k.rank_layers(sensor.rows, sums, row_of_layer, layer_order_);
    k.scatter_points(scan, row_of_layer, points, images);
    k.fill_gaps(fill, images.range_m, images.elevation_rad, images.range_filled_m, images.elevation_filled_rad);
    k.angle_image(angle, images.range_filled_m, images.elevation_filled_rad, images.angle_rad);
    k.smooth_sg(smooth, row_count > 0 ? row_count - 1 : 0, images.angle_rad, images.angle_smooth_rad);
    k.mark_ground(ground, row_count, images.angle_smooth_rad, images.range_filled_m, images.pixel_point,
                  images.nonground);
    k.repair_range(repair, images.range_filled_m, images.elevation_filled_rad, images.nonground,
                   images.range_repaired_m, images.elevation_repaired_rad, images.nonground_repaired);
    k.link_pixels(links, images.range_repaired_m, images.elevation_repaired_rad, images.nonground_repaired,
                  images.link_right, images.link_down);
    cluster_count = k.label_bfs(sensor.wraps, images.range_filled_m, images.nonground_repaired, images.link_right,
                                images.link_down, images.labels, queue_);
    k.label_points(label, images, points);
  }

  Reason reason(int32_t i) const { return Reason(points.reason[i]); }

  const KernelTable* kernels = find_kernels(nullptr);  // the best
  SensorModel sensor;
  FillGapsParams fill;
  AngleImageParams angle;
  SmoothSgParams smooth;
  MarkGroundParams ground;
  RepairRangeParams repair;
  LinkPixelsParams links;
  LabelPointsParams label;

  ScanTable scan;
  PointTable points;
  LayerSums sums;
  RangeImages images;
  int32_t* row_of_layer = nullptr;
  int32_t row_count = 0, cluster_count = 0;

 private:
  Arena arena_;
  int32_t *layer_order_ = nullptr, *queue_ = nullptr;
};

}  // namespace overtake::test
