// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory and contents of one sensor's stages, and the code that runs each kernel of the manifest on them.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "bench/clouds.h"
#include "pipeline/method/methods.h"
#include "pipeline/method/steps.h"
#include "pipeline/stages.h"

namespace overtake::bench {

// The kernels of the manifest.
enum class Kernel : int32_t {
#define OVT_KERNEL(name, form, caller) name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
  kCount
};
inline const char* kernel_name(Kernel kernel) {
  constexpr const char* kName[] = {
#define OVT_KERNEL(name, form, caller) #name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
  };
  return kName[int32_t(kernel)];
}
// The step that runs a kernel; null: no segmentation runs it.
inline const Step* find_step(Kernel kernel) { return step::kOfKernel[int32_t(kernel)]; }

// Memory and contents of one sensor's stages, filled by the references. Three sensors share them, so that there are
// seams.
class Work {
 public:
  explicit Work(const Cloud& source, const Method& method = kPaper) : cloud(source) {
    context.method = sizes.method = &method;
    sizes.sensors = context.sensors;
    sizes.point_capacity = point_capacity;
    sizes.sensor_count = context.sensor_count = 3;
    sizes.cluster_capacity = 4096;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = kRowAlign;
    ovt_params params;
    ovt_params_init(&params, sizeof params, method.name);
    for (int32_t s = 0; s < 3; ++s) {
      ovt_sensor_def def = cloud.sensor;
      def.yaw_rad = 2.0943951023931953 * (s == 2 ? -1 : s);
      context.sensors[s] = to_sensor_model(def);
      context.segment[s] = make_segment_params(params, context.sensors[s]);
      point_capacity[s] = s == 0 ? round_up(int32_t(cloud.points.size()), kRowAlign) : kRowAlign;
    }
    context.detect = make_detect_params(params);
    sizes.merge_columns = context.detect.merge_seams.columns;
    if (!build_frame(frame, sizes, default_allocator()) || !build_scratch(scratch, sizes, default_allocator()))
      std::abort();
    context.scratch = &scratch;
    views = part.kept;
    views.layer_sums = scratch.layer_sums;
    const auto carve = [&](Carver& carver) {
      carve_columns(carver, scratch.plan.shared, context.sensors[0], point_capacity[0], views);
    };
    if (!apart_.build(default_allocator(), carve)) std::abort();
    const KernelTable& ref = *find_kernels("ref");
    load(ref);
    for (const Step& step : method.segment) run(ref, step);
    for (const Kernel kernel : {Kernel::merge_seams, Kernel::gate_clusters, Kernel::fit_rectangle}) run(ref, kernel);
  }

  void load(const KernelTable& k) {
    const auto field = [&](const void* at, FieldType type) {
      return PointField{at, std::ptrdiff_t(sizeof(CloudPoint)), type};
    };
    const CloudPoint& first = cloud.points[0];
    PointFields fields;
    fields.x = field(&first.x_m, FieldType::kFloat32);
    fields.y = field(&first.y_m, FieldType::kFloat32);
    fields.z = field(&first.z_m, FieldType::kFloat32);
    fields.intensity = field(&first.intensity, FieldType::kFloat32);
    fields.layer = field(&first.layer, FieldType::kUint16);
    fields.time = field(&first.time_ns, FieldType::kUint32);
    k.load_points(fields, int32_t(cloud.points.size()), part.scan);
  }

  // Runs one step, then restores its consumed input: the sums of the layers.
  void run(const KernelTable& k, const Step& step) {
    LayerSums& sums = views.layer_sums;
    const bool reads_sums = has(step.reads, Column::layer_sums), fills_sums = !has(step.writes, Column::row_of_layer);
    if (reads_sums)
      for (const LayerSum& layer : layers_) {
        sums.point_count[layer.id] = fills_sums ? 0 : layer.points;
        sums.elevation_sum[layer.id] = fills_sums ? 0 : layer.elevation;
      }
    Segment segment = {context.sensors[0], context.segment[0], part, views};
    step.run(k, segment);
    if (reads_sums && fills_sums && layers_.empty())
      for (int32_t i = 0; i < sums.touched_count; ++i)
        layers_.push_back({sums.touched[i], sums.point_count[sums.touched[i]], sums.elevation_sum[sums.touched[i]]});
  }

  void run(const KernelTable& k, Kernel kernel) {
    if (const Step* step = find_step(kernel)) return run(k, *step);
    switch (kernel) {
      case Kernel::load_points: load(k); break;
      case Kernel::fit_road: {
        RoadShape shape;
        k.fit_road(context.segment[0].running_ground,
                   {{1, 0, 0, 0, 1, 0, 0, 0, 1}, context.sensors[0].T_vehicle_sensor}, context.sensors[0],
                   views.images.range_filled_m, views.images.elevation_filled_rad, shape);
        benchmark::DoNotOptimize(shape.term);
        break;
      }
      case Kernel::merge_seams: {
        SeamSide sides[3];
        for (int32_t s = 0; s < 3; ++s)
          sides[s] = {true,          &context.sensors[s], &views.images,     &part.scan,
                      &views.points, &part.clusters,      part.row_of_label, 0};
        k.merge_seams(context.detect.merge_seams, sides, 3, frame.members, frame.merged, frame.seam);
        break;
      }
      case Kernel::gate_clusters: k.gate_clusters(context.detect.gate_clusters, frame.merged, frame.kept); break;
      case Kernel::fit_rectangle: {
        // Uses the largest cluster, at most 500 of its points.
        int32_t row = 0;
        for (int32_t i = 0; i < part.clusters.count; ++i)
          if (part.clusters.point_count[i] > part.clusters.point_count[row]) row = i;
        const int32_t begin = part.clusters.point_begin[row];
        fit_count = std::min(part.clusters.point_count[row], 500);
        benchmark::DoNotOptimize(k.fit_rectangle(context.detect.fit_rectangle, part.cluster_points.x_m + begin,
                                                 part.cluster_points.y_m + begin, fit_count, 0.1f, 0.0f, 0.0f));
        break;
      }
      case Kernel::predict_paths: {
        double(&out)[7][kPathCars * 30] = cars_out;
        benchmark::DoNotOptimize(k.predict_paths({0.05, 2, {0.005, 0.005, 0.5, 0.005, 0.0005}}, path_cars, kPathCars,
                                                 30, {out[0], out[1], out[2], out[3], out[4], out[5], out[6]}));
        break;
      }
      case Kernel::place_path: {
        double(&in)[13][kPathBlock] = path_in;
        double(&out)[8][kPathBlock] = path_out;
        k.place_path(path_car, {in[0], in[1], in[2], in[3], in[4], in[11], in[12]},
                     {in[5], in[6], in[7], in[8], in[9], in[10]}, kPathBlock,
                     {out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]});
        benchmark::DoNotOptimize(out);
        break;
      }
      default:
        std::fprintf(stderr, "%s: no step runs it, and Work does not either\n", kernel_name(kernel)), std::abort();
    }
  }

  int64_t points() const { return int64_t(cloud.points.size()); }
  int64_t pixels() const { return int64_t(context.sensors[0].rows) * context.sensors[0].cols; }

  Cloud cloud;
  StageContext context;
  FrameSizes sizes;
  int32_t point_capacity[3];
  Frame frame;
  SensorPart& part = frame.sensors[0];
  SegmentScratch scratch;
  SegmentViews views;
  int32_t fit_count = 0;
  PathCar path_car = {.speed_mps = 70, .p_ss = 0.1, .p_dd = 0.1, .p_vv = 1, .p_cc = 1e-3};
  double path_in[13][kPathBlock] = {}, path_out[8][kPathBlock];
  PathCars path_cars;  // at the origin, certain
  double cars_out[7][kPathCars * 30];

 private:
  struct LayerSum {
    int32_t id, points;
    int64_t elevation;
  };
  std::vector<LayerSum> layers_;
  Arena apart_;  // of the columns that share memory in a detector: here any kernel may run after any other
};

// Each Work is built on first use and shared by all ISAs, so a filtered run builds only those it needs. It is never
// freed: with random interleaving, each repetition uses it again.
Work& work_of(const Cloud& cloud, const Method& method = kPaper);

// The first preset that runs a kernel in its segmentation; paper if none does.
const Method& method_of(Kernel kernel);

void add(const std::string& name, const std::function<void(benchmark::State&)>& run);

// Benchmarks of several kernels: assignment, the rectangle of 500 points, other orders of points, PCL's clusters.
void add_tasks(const KernelTable* const* tables, int32_t table_count, const Cloud& racecar_front,
               const Cloud& nuscenes);
void bench_segment(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud,
                   const Method& method = kPaper, const RoadData& road = {});

}  // namespace overtake::bench
