// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A method's segmentation of one sensor with the kernels of any ISA, in separate memory: runs a test's scan through the
// whole chain.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/table.h"
#include "pipeline/method/method.h"
#include "tests/support/paper_params.h"

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
  SegmentChain(const SensorModel& model, int32_t capacity, int32_t cluster_capacity = 1024)
      : sensor(model), params(paper_params(model)) {
    const std::size_t pixels = std::size_t(sensor.rows) * std::size_t(sensor.cols);
    const auto carve = [&](Carver& carver) {
      carve_table(carver, part.scan, capacity);
      carve_table(carver, views.points, capacity);
      carve_range_images(carver, views.images, sensor.rows, sensor.cols);
      carve_table(carver, part.clusters, cluster_capacity);
      carve_table(carver, part.cluster_points, capacity + kRowAlign);
      LayerSums& sums = views.layer_sums;
      for (int32_t** ids : {&sums.touched, &sums.point_count, &views.row_of_layer, &views.layer_order})
        *ids = carver.take<int32_t>(kLayerIds);
      sums.elevation_sum = carver.take<int64_t>(kLayerIds);
      for (int32_t** labels : {&part.row_of_label, &views.queue, &views.cursor, &views.order})
        *labels = carver.take<int32_t>(pixels + 1);
      views.label_extent = carver.take<LabelExtent>(pixels + 1);
    };
    if (!arena_.build(default_allocator(), carve)) std::abort();
    part.clusters.capacity = cluster_capacity;
  }

  void load(const PointFields& fields, int32_t count) { kernels->load_points(fields, count, part.scan); }
  void run_step(const Step& step, const KernelTable& table) {
    Segment segment = {sensor, params, part, views};
    step.run(table, segment);
  }
  void run(const std::vector<TestPoint>& cloud) {
    load(fields_of(cloud), int32_t(cloud.size()));
    for (const Step& step : method->segment) run_step(step, *kernels);
  }
  Reason reason(int32_t i) const { return Reason(views.points.reason[i]); }

  const Method* method = &kPaper;
  const KernelTable* kernels = find_kernels(nullptr);  // the best
  SensorModel sensor;
  SegmentParams params;
  SensorPart part;
  SegmentViews views;

 private:
  Arena arena_;
};

}  // namespace overtake::test
