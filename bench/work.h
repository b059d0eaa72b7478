// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Memory and contents of one sensor's stages, and a step per kernel of the manifest: what bench_kernels runs.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "bench/clouds.h"
#include "pipeline/stages.h"

namespace overtake::bench {

enum class Step : int32_t {
#define OVT_KERNEL(name, agreement) name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
  kCount
};

// Memory and contents of one sensor's stages, filled by the scalar twins. Three sensors share it, so that seams exist.
class Work {
 public:
  explicit Work(const Cloud& source) : cloud(source) {
    FrameSizes sizes;
    int32_t point_capacity[3];
    sizes.sensors = context.sensors;
    sizes.point_capacity = point_capacity;
    sizes.sensor_count = context.sensor_count = 3;
    sizes.cluster_capacity = 4096;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = kRowAlign;
    ovt_params params;
    ovt_params_init(&params, sizeof params, "paper");
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
    const KernelTable& ref = *find_kernels("ref");
    for (int32_t s = 0; s < int32_t(Step::kCount); ++s) run(ref, Step(s));
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

  // One kernel; what it uses up is put back.
  void run(const KernelTable& k, Step step) {
    const SensorModel& sensor = context.sensors[0];
    const SegmentParams& p = context.segment[0];
    RangeImages& m = part.images;
    LayerSums& sums = scratch.layer_sums;
    switch (step) {
      case Step::load_points: load(k); break;
      case Step::project_points:
        for (const LayerSum& layer : layers_) sums.point_count[layer.id] = 0, sums.elevation_sum[layer.id] = 0;
        k.project_points(sensor, part.scan, part.points, sums);
        if (layers_.empty())
          for (int32_t i = 0; i < sums.touched_count; ++i)
            layers_.push_back(
                {sums.touched[i], sums.point_count[sums.touched[i]], sums.elevation_sum[sums.touched[i]]});
        break;
      case Step::rank_layers:
        for (const LayerSum& layer : layers_) {
          sums.point_count[layer.id] = layer.points;
          sums.elevation_sum[layer.id] = layer.elevation;
        }
        part.row_count = k.rank_layers(sensor.rows, sums, scratch.row_of_layer, scratch.layer_order);
        break;
      case Step::scatter_points: k.scatter_points(part.scan, scratch.row_of_layer, part.points, m); break;
      case Step::fill_gaps:
        k.fill_gaps(p.fill_gaps, m.range_m, m.elevation_rad, m.range_filled_m, m.elevation_filled_rad);
        break;
      case Step::angle_image:
        k.angle_image(p.angle_image, m.range_filled_m, m.elevation_filled_rad, m.angle_rad);
        break;
      case Step::smooth_sg: k.smooth_sg(p.smooth_sg, sensor.rows - 1, m.angle_rad, m.angle_smooth_rad); break;
      case Step::mark_ground:
        k.mark_ground(p.mark_ground, part.row_count, m.angle_smooth_rad, m.range_filled_m, m.pixel_point, m.nonground);
        break;
      case Step::repair_range:
        k.repair_range(p.repair_range, m.range_filled_m, m.elevation_filled_rad, m.nonground, m.range_repaired_m,
                       m.elevation_repaired_rad, m.nonground_repaired);
        break;
      case Step::link_pixels:
        k.link_pixels(p.link_pixels, m.range_repaired_m, m.elevation_repaired_rad, m.nonground_repaired, m.link_right,
                      m.link_down);
        break;
      case Step::label_bfs:
        part.label_count = k.label_bfs(sensor.wraps, m.range_filled_m, m.nonground_repaired, m.link_right, m.link_down,
                                       m.labels, scratch.queue);
        break;
      case Step::label_points: k.label_points(p.label_points, m, part.points); break;
      case Step::build_clusters:
        k.build_clusters(sensor.T_vehicle_sensor, part.scan, part.points, part.label_count, part.clusters,
                         part.cluster_points, part.row_of_label, scratch.cursor, scratch.order);
        break;
      case Step::merge_seams: {
        SeamSide sides[3];
        for (int32_t s = 0; s < 3; ++s)
          sides[s] = {true, &context.sensors[s], &m, &part.scan, &part.points, &part.clusters, part.row_of_label, 0};
        k.merge_seams(context.detect.merge_seams, sides, 3, frame.members, frame.merged, frame.seam);
        break;
      }
      case Step::gate_clusters: k.gate_clusters(context.detect.gate_clusters, frame.merged, frame.kept); break;
      case Step::fit_rectangle: {
        // The largest cluster, at most 500 points of it.
        int32_t row = 0;
        for (int32_t i = 0; i < part.clusters.count; ++i)
          if (part.clusters.point_count[i] > part.clusters.point_count[row]) row = i;
        const int32_t begin = part.clusters.point_begin[row];
        fit_count = std::min(part.clusters.point_count[row], 500);
        benchmark::DoNotOptimize(k.fit_rectangle(context.detect.fit_rectangle, part.cluster_points.x_m + begin,
                                                 part.cluster_points.y_m + begin, fit_count, 0.1f, 0.0f, 0.0f));
        break;
      }
      case Step::kCount: break;
    }
  }

  int64_t points() const { return int64_t(cloud.points.size()); }
  int64_t pixels() const { return int64_t(context.sensors[0].rows) * context.sensors[0].cols; }

  Cloud cloud;
  StageContext context;
  Frame frame;
  SensorPart& part = frame.sensors[0];
  SegmentScratch scratch;
  int32_t fit_count = 0;

 private:
  struct LayerSum {
    int32_t id, points;
    int64_t elevation;
  };
  std::vector<LayerSum> layers_;
};

// Worlds are built on first use and shared by all ISAs, so a filtered run builds only what it needs. They stay: under
// random interleaving every repetition comes back to them.
Work& work_of(const Cloud& cloud);

void add(const std::string& name, const std::function<void(benchmark::State&)>& run);

// What is not one kernel: assignment, the rectangle of 500 points, points in other orders, the clusters of peers.
void add_tasks(const KernelTable* const* tables, int32_t table_count, const Cloud& racecar_front,
               const Cloud& nuscenes);
void bench_segment(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud);

}  // namespace overtake::bench
