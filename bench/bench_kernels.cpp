// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every kernel of the manifest on every ISA this CPU has, the whole segmentation of one scan, and the whole chain of
// three. Names are paths: smooth_sg/avx2/32x857, segment/avx512/racecar_front, chain/ref/racecar. The scalar twin is
// the ISA `ref`.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>

#include "bench/work.h"

namespace overtake::bench {
namespace {

// What a kernel goes through, and the bytes it reads and writes per item.
struct Traffic {
  enum class Item { point, pixel, layer, cluster, fit_point } item;
  int64_t bytes;
};
Traffic traffic_of(Step step) {
  using Item = Traffic::Item;
  switch (step) {
    case Step::load_points: return {Item::point, 24 + 24};
    case Step::project_points: return {Item::point, 16 + 13};
    case Step::rank_layers: return {Item::layer, 24};
    case Step::scatter_points: return {Item::point, 20 + 17};
    case Step::fill_gaps: return {Item::pixel, 8 + 8};
    case Step::angle_image: return {Item::pixel, 8 + 4};
    case Step::smooth_sg: return {Item::pixel, 4 + 4};
    case Step::mark_ground: return {Item::pixel, 12};
    case Step::repair_range: return {Item::pixel, 8 + 8};
    case Step::link_pixels: return {Item::pixel, 8};
    case Step::label_bfs: return {Item::pixel, 4 + 4};
    case Step::label_points: return {Item::point, 20 + 5};
    case Step::build_clusters: return {Item::point, 20 + 16};
    case Step::merge_seams: return {Item::cluster, 120};
    case Step::gate_clusters: return {Item::cluster, 32};
    case Step::fit_rectangle: return {Item::fit_point, 8};
    case Step::kCount: break;
  }
  return {Item::pixel, 0};
}

void bench_kernel(benchmark::State& state, const KernelTable* kernels, Step step, const Cloud& cloud) {
  Work& work = work_of(cloud);
  for (auto _ : state) work.run(*kernels, step);
  const Traffic traffic = traffic_of(step);
  using Item = Traffic::Item;
  const int64_t items = traffic.item == Item::point     ? work.points()
                        : traffic.item == Item::pixel   ? work.pixels()
                        : traffic.item == Item::layer   ? work.part.row_count
                        : traffic.item == Item::cluster ? work.frame.members.count
                                                        : work.fit_count;
  state.SetItemsProcessed(int64_t(state.iterations()) * items);
  state.SetBytesProcessed(int64_t(state.iterations()) * items * traffic.bytes);
}

// Images made to hurt: repair, links and labels of a mask of non-ground pixels at equal ranges.
void bench_adversarial(benchmark::State& state, const KernelTable* kernels, const std::string& pattern) {
  Work work(make_cloud(32, 857));
  RangeImages& m = work.part.images;
  const int32_t rows = m.nonground.rows, cols = m.nonground.cols;
  const auto is_set = [&](int32_t r, int32_t c) {
    if (pattern == "checkerboard") return (r + c) % 2 == 0;
    if (pattern == "comb") return c % 2 == 0 || r == rows - 1;
    if (pattern == "full") return true;
    // spiral: rings three pixels apart, each opened beside the one before
    const int32_t ring = std::min(std::min(r, rows - 1 - r), std::min(c, cols - 1 - c));
    return ring % 2 == 0 ? !(r == ring + 1 && c == ring) : (r == ring && c == ring);
  };
  if (pattern != "nominal")
    for (int32_t r = 0; r < rows; ++r) {
      m.nonground.clear_row(r);
      for (int32_t c = 0; c < cols; ++c) {
        m.range_filled_m.at(r, c) = 20.0f;
        if (is_set(r, c)) m.nonground.set(r, c);
      }
    }
  for (auto _ : state)
    for (const Step step : {Step::repair_range, Step::link_pixels, Step::label_bfs}) work.run(*kernels, step);
  state.SetItemsProcessed(int64_t(state.iterations()) * work.pixels());
}

// Three sensors from the caller's bytes to tracks, through the C API without a graph.
void bench_chain(benchmark::State& state, const char* isa, const std::vector<Cloud>& clouds) {
  std::vector<ovt_sensor_def> sensors;
  for (const Cloud& cloud : clouds) sensors.push_back(cloud.sensor);
  ovt_detector_def def = ovt_default_detector_def();
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

void add_all() {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  // Kept for the benchmarks, which hold pointers to them.
  static const std::vector<Cloud> sizes = {make_cloud(32, 857), make_cloud(64, 2048), make_cloud(128, 2048)};
  static const std::vector<Cloud> racecar = racecar_clouds();
  static std::vector<Cloud> scans = racecar;
  scans.push_back(kitti_cloud());
  scans.push_back(nuscenes_cloud());
  scans.push_back(make_one_pixel_cloud());

  // ISAs innermost: what is compared runs close together.
#define OVT_KERNEL(kernel, agreement)                                     \
  for (const Cloud& cloud : sizes)                                        \
    for (int32_t t = 0; t < table_count; ++t)                             \
      add(std::string(#kernel) + "/" + tables[t]->isa + "/" + cloud.name, \
          [table = tables[t], &cloud](benchmark::State& state) { bench_kernel(state, table, Step::kernel, cloud); });
#include "kernels/kernels.def"
#undef OVT_KERNEL
  for (const Cloud& cloud : scans)
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("segment/") + tables[t]->isa + "/" + cloud.name,
          [table = tables[t], &cloud](benchmark::State& state) { bench_segment(state, table, cloud); });
  for (const char* pattern : {"nominal", "checkerboard", "comb", "spiral", "full"})
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("adversarial/") + tables[t]->isa + "/" + pattern,
          [table = tables[t], pattern](benchmark::State& state) { bench_adversarial(state, table, pattern); });
  for (int32_t t = 0; t < table_count; ++t)
    add(std::string("chain/") + tables[t]->isa + "/racecar",
        [isa = tables[t]->isa](benchmark::State& state) { bench_chain(state, isa, racecar); });
  add_tasks(tables, table_count, scans[0], scans[racecar.size() + 1]);
}

}  // namespace

Work& work_of(const Cloud& cloud) {
  static std::map<std::string, std::unique_ptr<Work>> works;
  std::unique_ptr<Work>& work = works[cloud.name];
  if (!work) work = std::make_unique<Work>(cloud);
  return *work;
}

void bench_segment(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud) {
  Work& work = work_of(cloud);
  work.context.kernels = kernels;
  for (auto _ : state) {
    work.load(*kernels);
    segment_scan(work.context, 0, work.part, work.scratch);
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
