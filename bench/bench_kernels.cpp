// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every kernel of the manifest on every ISA this CPU has, the whole segmentation of one scan, and the whole chain of
// three. Names are paths: smooth_sg/avx2/32x857, segment/avx512/racecar_front, chain/ref/racecar. The scalar twin is
// the ISA `ref`.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>

#include "bench/clouds.h"
#include "pipeline/stages.h"

namespace overtake::bench {
namespace {

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
    if (!build_frame(frame, sizes, default_allocator())) std::abort();
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
    LayerSums& sums = part.layer_sums;
    switch (step) {
      case Step::load_points:
        load(k);
        break;
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
        part.row_count = k.rank_layers(sensor.rows, sums, part.row_of_layer, part.layer_order);
        break;
      case Step::scatter_points:
        k.scatter_points(part.scan, part.row_of_layer, part.points, m);
        break;
      case Step::fill_gaps:
        k.fill_gaps(p.fill_gaps, m.range_m, m.elevation_rad, m.range_filled_m, m.elevation_filled_rad);
        break;
      case Step::angle_image:
        k.angle_image(p.angle_image, m.range_filled_m, m.elevation_filled_rad, m.angle_rad);
        break;
      case Step::smooth_sg:
        k.smooth_sg(p.smooth_sg, sensor.rows - 1, m.angle_rad, m.angle_smooth_rad);
        break;
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
                                       m.labels, part.queue);
        break;
      case Step::label_points:
        k.label_points(p.label_points, m, part.points);
        break;
      case Step::build_clusters:
        k.build_clusters(sensor.T_vehicle_sensor, part.scan, part.points, part.label_count, part.clusters,
                         part.cluster_points, part.row_of_label, part.cursor, part.order);
        break;
      case Step::merge_seams: {
        SeamSide sides[3];
        for (int32_t s = 0; s < 3; ++s)
          sides[s] = {true,
                      &context.sensors[s],
                      &m,
                      &part.scan,
                      &part.points,
                      &part.clusters,
                      &part.cluster_points,
                      part.row_of_label,
                      0};
        k.merge_seams(context.detect.merge_seams, sides, 3, frame.members, frame.merged, frame.seam);
        break;
      }
      case Step::gate_clusters:
        k.gate_clusters(context.detect.gate_clusters, frame.merged, frame.kept);
        break;
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
      case Step::kCount:
        break;
    }
  }

  int64_t points() const { return int64_t(cloud.points.size()); }
  int64_t pixels() const { return int64_t(context.sensors[0].rows) * context.sensors[0].cols; }

  Cloud cloud;
  StageContext context;
  Frame frame;
  SensorPart& part = frame.sensors[0];
  int32_t fit_count = 0;

 private:
  struct LayerSum {
    int32_t id, points;
    int64_t elevation;
  };
  std::vector<LayerSum> layers_;
};

// What a kernel goes through, and the bytes it reads and writes per item.
struct Traffic {
  enum class Item { point, pixel, layer, cluster, fit_point } item;
  int64_t bytes;
};
Traffic traffic_of(Step step) {
  using Item = Traffic::Item;
  switch (step) {
    case Step::load_points:
      return {Item::point, 24 + 24};
    case Step::project_points:
      return {Item::point, 16 + 13};
    case Step::rank_layers:
      return {Item::layer, 24};
    case Step::scatter_points:
      return {Item::point, 20 + 17};
    case Step::fill_gaps:
      return {Item::pixel, 8 + 8};
    case Step::angle_image:
      return {Item::pixel, 8 + 4};
    case Step::smooth_sg:
      return {Item::pixel, 4 + 4};
    case Step::mark_ground:
      return {Item::pixel, 12};
    case Step::repair_range:
      return {Item::pixel, 8 + 8};
    case Step::link_pixels:
      return {Item::pixel, 8};
    case Step::label_bfs:
      return {Item::pixel, 4 + 4};
    case Step::label_points:
      return {Item::point, 20 + 5};
    case Step::build_clusters:
      return {Item::point, 20 + 16};
    case Step::merge_seams:
      return {Item::cluster, 120};
    case Step::gate_clusters:
      return {Item::cluster, 32};
    case Step::fit_rectangle:
      return {Item::fit_point, 8};
    case Step::kCount:
      break;
  }
  return {Item::pixel, 0};
}

// Worlds are built on first use and shared by all ISAs, so a filtered run builds only what it needs.
std::shared_ptr<Work> work_of(const std::string& name, const Cloud& cloud) {
  static std::map<std::string, std::weak_ptr<Work>> works;
  std::shared_ptr<Work> work = works[name].lock();
  if (!work) works[name] = work = std::make_shared<Work>(cloud);
  return work;
}

void bench_kernel(benchmark::State& state, const KernelTable* kernels, Step step, const Cloud& cloud) {
  const std::shared_ptr<Work> work = work_of(cloud.name, cloud);
  for (auto _ : state) work->run(*kernels, step);
  const Traffic traffic = traffic_of(step);
  using Item = Traffic::Item;
  const int64_t items = traffic.item == Item::point     ? work->points()
                        : traffic.item == Item::pixel   ? work->pixels()
                        : traffic.item == Item::layer   ? work->part.row_count
                        : traffic.item == Item::cluster ? work->frame.members.count
                                                        : work->fit_count;
  state.SetItemsProcessed(int64_t(state.iterations()) * items);
  state.SetBytesProcessed(int64_t(state.iterations()) * items * traffic.bytes);
}

void bench_segment(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud) {
  const std::shared_ptr<Work> work = work_of(cloud.name, cloud);
  work->context.kernels = kernels;
  for (auto _ : state) {
    work->load(*kernels);
    segment_scan(work->context, 0, work->part);
  }
  state.SetItemsProcessed(int64_t(state.iterations()) * work->points());
  state.SetBytesProcessed(int64_t(state.iterations()) * work->points() * int64_t(sizeof(CloudPoint)));
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

void add(const std::string& name, const std::function<void(benchmark::State&)>& run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMicrosecond);
}

void add_all() {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  const std::vector<Cloud> sizes = {make_cloud(32, 857), make_cloud(64, 2048), make_cloud(128, 2048)};
  const std::vector<Cloud> racecar = racecar_clouds();
  std::vector<Cloud> scans = racecar;
  scans.push_back(kitti_cloud());
  scans.push_back(nuscenes_cloud());
  scans.push_back(make_one_pixel_cloud());

  // ISAs innermost: what is compared runs close together.
#define OVT_KERNEL(kernel, agreement)                                     \
  for (const Cloud& cloud : sizes)                                        \
    for (int32_t t = 0; t < table_count; ++t)                             \
      add(std::string(#kernel) + "/" + tables[t]->isa + "/" + cloud.name, \
          [=](benchmark::State& state) { bench_kernel(state, tables[t], Step::kernel, cloud); });
#include "kernels/kernels.def"
#undef OVT_KERNEL
  for (const Cloud& cloud : scans)
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("segment/") + tables[t]->isa + "/" + cloud.name,
          [=](benchmark::State& state) { bench_segment(state, tables[t], cloud); });
  for (const char* pattern : {"nominal", "checkerboard", "comb", "spiral", "full"})
    for (int32_t t = 0; t < table_count; ++t)
      add(std::string("adversarial/") + tables[t]->isa + "/" + pattern,
          [=](benchmark::State& state) { bench_adversarial(state, tables[t], pattern); });
  for (int32_t t = 0; t < table_count; ++t)
    add(std::string("chain/") + tables[t]->isa + "/racecar",
        [=](benchmark::State& state) { bench_chain(state, tables[t]->isa, racecar); });
}

}  // namespace
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
