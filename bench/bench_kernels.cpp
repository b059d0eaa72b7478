// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every kernel of the manifest on every ISA of this CPU, the whole segmentation of one scan, and the whole chain of
// three scans. Names are paths: smooth_sg/avx2/32x857, segment/avx512/racecar_front, chain/ref/racecar. The ISA `ref`
// is the scalar reference. segment and chain are those of preset paper, segment_best and chain_best those of best:
// without a pose, so that the road is fitted to the scan; segment_best_known: on a level road that is known.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <utility>

#include "bench/work.h"
#include "core/math.h"
#include "pipeline/method/steps.h"

namespace overtake::bench {
namespace {

// The items that a kernel processes, and the bytes that it reads and writes: for a step, those of its columns.
struct Traffic {
  int64_t items, bytes;
};
Traffic traffic_of(const Work& work, const Step& step) {
  const SensorPart& part = work.part;
  Columns moved = step.reads | step.writes;
  Traffic traffic = {work.pixels(), 0};
  if (moved & columns_of(Extent::points)) traffic.items = work.points();
  if (moved & columns_of(Extent::layers) && traffic.items != work.points()) traffic.items = part.row_count;
  for_each_segment_column(part, work.views, [&](Column column, auto extent, const auto& view) {
    if (!has(moved, column)) return;
    if constexpr (extent == Extent::points) {
      traffic.bytes += work.points() * int64_t(sizeof *view);
    } else if constexpr (extent == Extent::pixels) {
      if constexpr (std::is_same_v<decltype(view), const BitPlane&>)
        traffic.bytes += work.pixels() / 8;
      else
        traffic.bytes += work.pixels() * int64_t(sizeof *view.data);
    }
  });
  if (has(moved, Column::scan)) traffic.bytes += work.points() * 16;  // four columns of four bytes
  if (has(moved, Column::row_of_layer) && has(moved, Column::layer_sums)) traffic.bytes += part.row_count * 24;
  if (has(moved, Column::cluster_points)) traffic.bytes += part.cluster_points.count * 16;
  return traffic;
}
Traffic traffic_of(const Work& work, Kernel kernel) {
  if (const Step* step = find_step(kernel)) return traffic_of(work, *step);
  if (kernel == Kernel::load_points) return {work.points(), work.points() * (24 + 24)};
  if (kernel == Kernel::fit_road) return {work.part.row_count * 20, work.part.row_count * 20 * 8};
  if (kernel == Kernel::predict_paths) return {kPathCars * 30, kPathCars * 30 * 7 * 8};
  if (kernel == Kernel::place_path) return {kPathBlock, kPathBlock * 20 * 8};
  if (kernel == Kernel::fit_rectangle) return {work.fit_count, work.fit_count * 8};
  return {work.frame.members.count, work.frame.members.count * int64_t(kernel == Kernel::merge_seams ? 120 : 32)};
}

void bench_kernel(benchmark::State& state, const KernelTable* kernels, Kernel kernel, const Cloud& cloud) {
  Work& work = work_of(cloud, method_of(kernel));
  for (auto _ : state) work.run(*kernels, kernel);
  const Traffic traffic = traffic_of(work, kernel);
  state.SetItemsProcessed(int64_t(state.iterations()) * traffic.items);
  state.SetBytesProcessed(int64_t(state.iterations()) * traffic.bytes);
}

// Adversarial images: repair, links and labels of a mask of non-ground pixels. Ranges alternate every two columns by
// more than repair bridges, so that the holes stay; at this distance such pixels still link.
void bench_adversarial(benchmark::State& state, const KernelTable* kernels, const std::string& pattern) {
  Work work(make_cloud(32, 857));
  RangeImages& m = work.views.images;
  const int32_t rows = m.nonground.rows, cols = m.nonground.cols;
  const auto is_set = [&](int32_t r, int32_t c) {
    if (pattern == "checkerboard") return (r + c) % 2 == 0;
    if (pattern == "comb") return c % 2 == 0 || r == rows - 1;
    if (pattern == "full") return true;
    // spiral: every second ring, opened at its end and joined there to the next one
    const int32_t ring = std::min(std::min(r, rows - 1 - r), std::min(c, cols - 1 - c));
    return (ring % 2 == 0) != (r == ring + 1 && c == ring);
  };
  const float near_m = 150.0f, far_m = near_m + 1.1f * work.context.segment[0].repair_range.range_limit_m;
  if (pattern != "nominal")
    for (int32_t r = 0; r < rows; ++r) {
      m.nonground.clear_row(r);
      for (int32_t c = 0; c < cols; ++c) {
        m.range_filled_m.at(r, c) = c / 2 % 2 == 0 ? near_m : far_m;
        m.elevation_filled_rad.at(r, c) = -0.01f * float(r);
        if (is_set(r, c)) m.nonground.set(r, c);
      }
    }
  const auto run = [&] {
    for (const Step& step : {step::repair_range, step::link_pixels, step::label_bfs}) work.run(*kernels, step);
  };
  run();
  if (pattern != "nominal") {
    int32_t pixels = 0, clusters = 0;
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        pixels += is_set(r, c);
        clusters = std::max(clusters, m.labels.at(r, c));
        if (m.nonground_repaired.test(r, c) != is_set(r, c)) return state.SkipWithError("repair fills the holes");
      }
    if (clusters != (pattern == "checkerboard" ? pixels : 1)) return state.SkipWithError("other clusters than drawn");
  }
  for (auto _ : state) run();
  state.SetItemsProcessed(int64_t(state.iterations()) * work.pixels());
}

// Three sensors from the caller's bytes to tracks, through the C API, without the graph.
void bench_chain(benchmark::State& state, const char* isa, const std::vector<Cloud>& clouds, const Method& method) {
  ovt_params params;
  if (ovt_params_init(&params, sizeof params, method.name) != OVT_OK) return state.SkipWithError("no such preset");
  std::vector<ovt_sensor_def> sensors;
  for (const Cloud& cloud : clouds) sensors.push_back(cloud.sensor);
  ovt_detector_def def = ovt_default_detector_def();
  def.params = &params;
  def.sensors = sensors.data();
  def.sensor_count = int32_t(sensors.size());
  def.worker_count = 1;
  def.keep_images = 0;
  def.isa = isa;
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) return state.SkipWithError("no detector");
  int64_t stamp_ns = 1000000000, points = 0;
  for (const Cloud& cloud : clouds) points += int64_t(cloud.points.size());
  for (auto _ : state) {
    for (std::size_t s = 0; s < clouds.size(); ++s) {
      const std::vector<CloudPoint>& p = clouds[s].points;
      const auto column = [&](const void* at, int32_t type) {
        const std::size_t offset = std::size_t(static_cast<const char*>(at) - reinterpret_cast<const char*>(p.data()));
        return ovt_column{at, p.size() * sizeof(CloudPoint) - offset, sizeof(CloudPoint), type};
      };
      ovt_points scan;
      ovt_points_init(&scan, sizeof scan);
      scan.sensor = int32_t(s);
      scan.count = int32_t(p.size());
      scan.stamp_ns = stamp_ns;
      scan.x = column(&p[0].x_m, OVT_F32);
      scan.y = column(&p[0].y_m, OVT_F32);
      scan.z = column(&p[0].z_m, OVT_F32);
      scan.intensity = column(&p[0].intensity, OVT_F32);
      scan.layer = column(&p[0].layer, OVT_U16);
      scan.time = column(&p[0].time_ns, OVT_U32);
      scan.time_unit_ns = 1.0;
      if (ovt_push_scan(detector, &scan) != OVT_OK) state.SkipWithError("a scan was refused");
    }
    stamp_ns += 50000000;
  }
  ovt_destroy_detector(detector);
  state.SetItemsProcessed(int64_t(state.iterations()) * points);
}

// A level road along a circle, all of it known.
struct LevelRoad {
  CircuitMap map;
  RoadData road;

  LevelRoad() {
    constexpr double kRadius_m = 400.0, kWidth_m = 7.5;
    constexpr int32_t kCount = 1200;
    std::vector<double> x, y, width(kCount, kWidth_m);
    for (int32_t i = 0; i < kCount; ++i) {
      double s, c;
      sin_cos_f64(kTwoPi * i / kCount, s, c);
      x.push_back(kRadius_m * s);
      y.push_back(kRadius_m * (1.0 - c));
    }
    if (!map.build(x.data(), y.data(), width.data(), width.data(), nullptr, kCount, true, nullptr)) std::abort();
    road.has_pose = true;
    road.map = &map;
    road.curvature_per_m = 1.0 / kRadius_m;
    std::fill_n(road.known, RoadData::kStations, true);
  }
};

void add_all() {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  // static: the benchmarks keep pointers to these.
  static const std::vector<Cloud> sizes = {make_cloud(32, 857), make_cloud(64, 2048), make_cloud(128, 2048)};
  static const std::vector<Cloud> racecar = racecar_clouds();
  static std::vector<Cloud> scans = racecar;
  scans.push_back(kitti_cloud());
  scans.push_back(nuscenes_cloud());
  scans.push_back(make_one_pixel_cloud());

  // ISAs innermost: what is compared runs close together.
#define OVT_KERNEL(kernel, form, caller)                                  \
  for (const Cloud& cloud : sizes)                                        \
    for (int32_t t = 0; t < table_count; ++t)                             \
      add(std::string(#kernel) + "/" + tables[t]->isa + "/" + cloud.name, \
          [table = tables[t], &cloud](benchmark::State& state) {          \
            bench_kernel(state, table, Kernel::kernel, cloud);            \
          });
#include "kernels/kernels.def"
#undef OVT_KERNEL
  for (const Cloud& cloud : scans)
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("segment/") + tables[t]->isa + "/" + cloud.name,
          [table = tables[t], &cloud](benchmark::State& state) { bench_segment(state, table, cloud); });
  static const LevelRoad level;
  for (const Cloud& cloud : scans)
    for (int32_t t = 0; t < table_count; ++t) {
      const auto add_best = [&](const char* kind, const RoadData& road) {
        add(kind + std::string("/") + tables[t]->isa + "/" + cloud.name,
            [table = tables[t], &cloud, &road](benchmark::State& state) {
              bench_segment(state, table, cloud, kBest, road);
            });
      };
      static const RoadData unknown;
      add_best("segment_best", unknown);
      add_best("segment_best_known", level.road);
    }
  for (const char* pattern : {"nominal", "checkerboard", "comb", "spiral", "full"})
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("adversarial/") + tables[t]->isa + "/" + pattern,
          [table = tables[t], pattern](benchmark::State& state) { bench_adversarial(state, table, pattern); });
  for (int32_t t = 0; t < table_count; ++t)
    for (const Method* method : {&kPaper, &kBest})
      add(std::string(method == &kPaper ? "chain/" : "chain_best/") + tables[t]->isa + "/racecar",
          [isa = tables[t]->isa, method](benchmark::State& state) { bench_chain(state, isa, racecar, *method); });
  add_tasks(tables, table_count, scans[0], scans[racecar.size() + 1]);
}

}  // namespace

Work& work_of(const Cloud& cloud, const Method& method) {
  static std::map<std::pair<std::string, std::string>, std::unique_ptr<Work>> works;
  std::unique_ptr<Work>& work = works[{cloud.name, method.name}];
  if (!work) work = std::make_unique<Work>(cloud, method);
  return *work;
}

const Method& method_of(Kernel kernel) {
  const Step* const step = find_step(kernel);
  const Method* methods[kMaxMethods] = {};
  const int32_t count = list_methods(methods);
  for (int32_t i = 0; step && i < count; ++i)
    for (const Step& used : methods[i]->segment)
      if (used.run == step->run) return *methods[i];
  return kPaper;
}

void bench_segment(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud, const Method& method,
                   const RoadData& road) {
  Work& work = work_of(cloud, method);
  work.context.kernels = kernels;
  work.part.road = road;
  for (auto _ : state) {
    work.load(*kernels);
    segment_scan(work.context, 0, work.part, 0);
  }
  state.SetItemsProcessed(int64_t(state.iterations()) * work.points());
  state.SetBytesProcessed(int64_t(state.iterations()) * work.points() * int64_t(sizeof(CloudPoint)));
}

void add(const std::string& name, const std::function<void(benchmark::State&)>& run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

}  // namespace overtake::bench

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::AddCustomContext("scans", overtake::bench::cloud_source());
  overtake::bench::add_all();
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
