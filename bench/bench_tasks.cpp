// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Benchmarks of more than one kernel on one image: assignment, the paths that readers get, the rectangle of 500
// points, other orders of points, and our clusters beside those of PCL on the same non-ground points.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <tuple>

#include "bench/work.h"
#include "pipeline/method/steps.h"
#include "pipeline/track/cvtr_tracker.h"
#include "pipeline/track/lane_tracker.h"
#include "pipeline/track/munkres.h"

#if defined(OVT_BENCH_PCL)
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>
#endif

namespace overtake::bench {
namespace {

struct AssignPair {
  int32_t row, column;
  double cost;
};

// n tracks and detections, all pairs feasible.
std::vector<AssignPair> dense_pairs(int32_t n) {
  std::mt19937 random(5);
  std::vector<AssignPair> pairs;
  for (int32_t row = 0; row < n; ++row)
    for (int32_t column = 0; column < n; ++column) pairs.push_back({row, column, double(random() % 65536) / 6553.6});
  return pairs;
}
// Cars spread over a field of 200 x 200 m, each seen with 1 m of noise; the tracker's gate of 8 m.
std::vector<AssignPair> gated_pairs(int32_t n) {
  std::mt19937 random(5);
  const auto uniform = [&] { return double(random() % 65536) / 65536.0; };
  std::vector<double> x, y, seen_x, seen_y;
  for (int32_t i = 0; i < n; ++i) {
    x.push_back(200.0 * uniform());
    y.push_back(200.0 * uniform());
    seen_x.push_back(x.back() + 2.0 * uniform() - 1.0);
    seen_y.push_back(y.back() + 2.0 * uniform() - 1.0);
  }
  std::vector<AssignPair> pairs;
  for (int32_t row = 0; row < n; ++row)
    for (int32_t column = 0; column < n; ++column) {
      const double dx = x[std::size_t(row)] - seen_x[std::size_t(column)];
      const double dy = y[std::size_t(row)] - seen_y[std::size_t(column)];
      if (dx * dx + dy * dy <= 64.0) pairs.push_back({row, column, dx * dx + dy * dy});
    }
  return pairs;
}
// Five random partners per row: no geometry gives such gates, and all rows form one block.
std::vector<AssignPair> tangled_pairs(int32_t n) {
  std::mt19937 random(5);
  std::vector<AssignPair> pairs;
  for (int32_t row = 0; row < n; ++row)
    for (int32_t k = 0; k < 5; ++k)
      pairs.push_back({row, int32_t(random() % uint32_t(n)), double(random() % 65536) / 6553.6});
  std::stable_sort(pairs.begin(), pairs.end(), [](const AssignPair& a, const AssignPair& b) {
    return std::tie(a.row, a.column) < std::tie(b.row, b.column);
  });
  return pairs;
}

void bench_assign(benchmark::State& state, int32_t n, const std::vector<AssignPair>& pairs) {
  Munkres munkres(n, n, int32_t(pairs.size()));
  std::vector<int32_t> column_of_row(std::size_t(n), 0);
  for (auto _ : state) {
    munkres.clear(n, n);
    for (const AssignPair& pair : pairs) munkres.add(pair.row, pair.column, pair.cost);
    benchmark::DoNotOptimize(munkres.solve(column_of_row.data()));
  }
  state.SetItemsProcessed(int64_t(state.iterations()) * n);
}

// Two sides of a car, rotated by 20 degrees, 1 cm of noise. The kernel fits both headings.
void bench_rectangle(benchmark::State& state, const KernelTable* kernels, int32_t count) {
  std::vector<float> x(std::size_t(count + kRowAlign)), y(std::size_t(count + kRowAlign));
  std::mt19937 random(3);
  const auto uniform = [&] { return double(random() % 65536) / 65536.0; };
  for (std::size_t i = 0; i < std::size_t(count); ++i) {
    const bool side = uniform() < 0.6;
    const double along = side ? 4.9 * uniform() : 0.0, across = side ? 0.0 : 1.9 * uniform();
    const double c = std::cos(0.35), s = std::sin(0.35);
    x[i] = float(15.0 + c * along - s * across + 0.01 * uniform());
    y[i] = float(3.0 + s * along + c * across + 0.01 * uniform());
  }
  const FitRectangleParams params = make_detect_params(ovt_default_params()).fit_rectangle;
  for (auto _ : state)
    benchmark::DoNotOptimize(kernels->fit_rectangle(params, x.data(), y.data(), count, 0.1f, 2.3f, 0.0f));
  state.SetItemsProcessed(int64_t(state.iterations()) * count);
}

// Orders in which drivers deliver a cloud's points.
enum class Order { line, interleaved, firing };
Cloud reordered(const Cloud& source, const char* name, Order order) {
  Cloud cloud = source;
  cloud.name += std::string("/") + name;
  struct Key {
    int64_t major, minor;
    std::size_t point;
  };
  const SensorModel sensor = to_sensor_model(source.sensor);
  const double left = source.sensor.azimuth_left_rad, width = left - source.sensor.azimuth_right_rad;
  std::vector<Key> keys;
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    const CloudPoint& p = source.points[i];
    const double place = (left - std::atan2(double(p.y_m), double(p.x_m))) / width;  // 0 left, 1 right
    const int64_t column = int64_t(place * sensor.cols), layer = p.layer;
    const int64_t fine = int64_t(place * 1e6);
    switch (order) {
      case Order::line: keys.push_back({layer, fine, i}); break;
      case Order::interleaved: keys.push_back({layer, fine % 500000 * 2 + fine / 500000, i}); break;
      case Order::firing: keys.push_back({column, layer, i}); break;
    }
  }
  std::stable_sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return a.major != b.major ? a.major < b.major : a.minor < b.minor;
  });
  for (std::size_t i = 0; i < keys.size(); ++i) cloud.points[i] = source.points[keys[i].point];
  return cloud;
}

// From the non-ground image to a label per point.
void bench_clusters(benchmark::State& state, const KernelTable* kernels, const Cloud& cloud) {
  Work& work = work_of(cloud);
  for (auto _ : state)
    for (const Step& step : {step::repair_range, step::link_pixels, step::label_bfs, step::label_points})
      work.run(*kernels, step);
  state.SetItemsProcessed(int64_t(state.iterations()) * work.points());
}

#if defined(OVT_BENCH_PCL)
// The same points: those on non-ground pixels. Tree and clusters as in PCL's tutorial.
void bench_pcl(benchmark::State& state, const Cloud& cloud) {
  const Work& work = work_of(cloud);
  const RangeImages& m = work.views.images;
  const auto points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int32_t r = 0; r < m.nonground.rows; ++r)
    for (int32_t c = 0; c < m.nonground.cols; ++c) {
      const int32_t i = m.pixel_point.at(r, c);
      if (i < 0 || !m.nonground.test(r, c)) continue;
      points->push_back({work.part.scan.x_m[i], work.part.scan.y_m[i], work.part.scan.z_m[i]});
    }
  for (auto _ : state) {
    const auto tree = std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
    tree->setInputCloud(points);
    pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
    extraction.setClusterTolerance(0.5);
    extraction.setSearchMethod(tree);
    extraction.setInputCloud(points);
    std::vector<pcl::PointIndices> clusters;
    extraction.extract(clusters);
    benchmark::DoNotOptimize(clusters.data());
  }
  state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(points->size()));
}
#endif

// The tracks of 47 cars on a circle of 400 m, and what ovt_read_tracks computes of them.
constexpr int32_t kPathTracks = 47, kPathPoints = 30;
template <class Policy>
struct TracksOf {
  CircuitMap map;
  TrackerParams params;
  std::unique_ptr<ReplayTracker<Policy>> tracker;
  std::unique_ptr<Policy> policy;  // for the paths step by step
  Arena arena;
  TrackTable rows, tracks;
  OptionalTrackTable optional;
  PathTable paths;
  std::byte* states = nullptr;
  int64_t stamp_ns = 0;

  TracksOf(const KernelTable* kernels, const char* preset) {
    std::vector<double> x, y, width;
    for (int32_t i = 0; i < 500; ++i) {
      x.push_back(400 * std::cos(kTwoPi * i / 500));
      y.push_back(400 * std::sin(kTwoPi * i / 500));
      width.push_back(10);
    }
    const char* error = nullptr;
    ovt_params of_preset;
    if (!map.build(x.data(), y.data(), width.data(), width.data(), nullptr, 500, true, &error) ||
        ovt_params_init(&of_preset, sizeof of_preset, preset) != OVT_OK)
      std::abort();
    params = make_tracker_params(of_preset, 64, 64);
    params.kernels = kernels;
    tracker = std::make_unique<ReplayTracker<Policy>>(params, &map);
    policy = std::make_unique<Policy>(params, &map, default_allocator());
    arena.build_or_throw(default_allocator(), [&](Carver& carver) {
      carve_table(carver, rows, 64);
      carve_table(carver, tracks, 64);
      carve_table(carver, optional, 64);
      carve_table(carver, paths, 64 * kPathPoints);
      states = carver.take<std::byte>(64 * tracker->state_bytes());
    });
    for (int32_t frame = 0; frame < 30; ++frame) {
      Measurement z[kPathTracks];
      stamp_ns = frame * int64_t(50'000'000);
      for (int32_t i = 0; i < kPathTracks; ++i) {
        const double radius = 394 + i % 3 * 6, angle = kTwoPi * i / kPathTracks + 60 * 0.05 * frame / radius;
        z[i] = {.x_m = radius * std::cos(angle), .y_m = radius * std::sin(angle), .stamp_ns = stamp_ns};
        z[i].var_x = z[i].var_y = 0.05;
        z[i].cov_xy = 0;
      }
      TrackerFrame in;
      in.stamp_ns = stamp_ns;
      in.measurements = z;
      in.ego = {true, 0, 0, 0, 60};
      tracker->step(in, nullptr);
    }
    tracker->snapshot(rows, states);
    if (rows.count != kPathTracks) std::abort();
  }
  // To the frame's stamp, as readers mostly do.
  void read(int32_t points) {
    paths.points_per_track = points;
    tracker->publish(rows, states, stamp_ns, tracks, &optional, &paths);
    benchmark::DoNotOptimize(paths.x_m);
  }
  // The same without the path kernels: every point is a prediction of the whole track from the one before.
  void read_step_by_step() {
    read(0);
    const PathRows points = {paths.x_m,   paths.y_m,   paths.course_rad, paths.speed_mps,
                             paths.var_x, paths.var_y, paths.cov_xy};
    for (int32_t i = 0; i < rows.count; ++i) {
      typename Policy::State state;
      std::memcpy(&state, states + std::size_t(i) * sizeof state, sizeof state);
      for (int32_t k = 0; k < kPathPoints; ++k) {
        policy->predict(state, params.horizon_step_s);
        write_point(state.estimate, points, i * kPathPoints + k);
      }
    }
    benchmark::DoNotOptimize(paths.x_m);
  }
};

template <class Policy>
void add_reads(const KernelTable* const* tables, int32_t table_count, const char* preset) {
  const auto bench = [preset](const KernelTable* kernels, auto&& read) {
    return [preset, kernels, read](benchmark::State& state) {
      TracksOf<Policy> of(kernels, preset);
      for (auto _ : state) read(of);
      state.SetItemsProcessed(int64_t(state.iterations()) * kPathTracks);
    };
  };
  const std::string name = std::string("read_tracks/") + preset + "/";
  add(name + "step_by_step", bench(tables[0], [](auto& of) { of.read_step_by_step(); }));
  add(name + "no_paths", bench(tables[0], [](auto& of) { of.read(0); }));
  for (int32_t t = 0; t < table_count; ++t)
    add(name + tables[t]->isa, bench(tables[t], [](auto& of) { of.read(kPathPoints); }));
}

// One frame of a tracker in steady traffic: cars 3 m a frame round a ring of 768 frames, and clutter on the road.
constexpr int32_t kLapFrames = 768, kRaceCars = 10;
constexpr double kLapRadius_m = 768 * 3.0 / kTwoPi;

// Rows that another detector pushes, or clusters with their features as the library's own detections have them.
enum class Rows { kPushed, kClusters };

std::vector<std::vector<Measurement>> make_lap(int32_t rows, Rows kind) {
  std::mt19937 random(11);
  const auto draw = [&random](double low, double high) {
    return low + (high - low) * double(random() % 65536) / 65536;
  };
  std::vector<std::vector<Measurement>> lap(kLapFrames);
  for (int32_t frame = 0; frame < kLapFrames; ++frame)
    for (int32_t i = 0; i < rows; ++i) {
      const bool is_car = i < kRaceCars;
      const double radius_m = kLapRadius_m + (is_car ? 0.0 : draw(-8, 8));
      const double angle = is_car ? kTwoPi * (double(i) / kRaceCars + double(frame) / kLapFrames) : draw(0, kTwoPi);
      Measurement z{.x_m = radius_m * std::cos(angle), .y_m = radius_m * std::sin(angle), .stamp_ns = 0};
      z.var_x = z.var_y = 0.05;
      z.cov_xy = 0;
      if (kind == Rows::kClusters) {
        z.points = is_car ? 200 : 4;
        z.height_m = is_car ? 1.1 : 0.5;
        z.width_m = is_car ? 1.9 : 0.6;
        z.object_class = int32_t(is_car ? ObjectClass::kCar : ObjectClass::kUnknown);
        z.view = int32_t(CarView::kRear);
      }
      lap[std::size_t(frame)].push_back(z);
    }
  return lap;
}

// 64 rows in one block of 6 m x 6 m, each in the gate of each track.
std::vector<std::vector<Measurement>> make_block() {
  std::mt19937 random(12);
  std::vector<std::vector<Measurement>> frames(kLapFrames);
  for (auto& rows : frames)
    for (int32_t i = 0; i < 64; ++i) {
      Measurement z{.x_m = double(random() % 6000) * 1e-3, .y_m = double(random() % 6000) * 1e-3, .stamp_ns = 0};
      z.var_x = z.var_y = 0.25;
      z.cov_xy = 0;
      rows.push_back(z);
    }
  return frames;
}

template <class Policy>
void bench_frame(benchmark::State& state, const char* preset, std::vector<std::vector<Measurement>> frames,
                 double ego_mps) {
  ovt_params of_preset;
  if (ovt_params_init(&of_preset, sizeof of_preset, preset) != OVT_OK) std::abort();
  ReplayTracker<Policy> tracker(make_tracker_params(of_preset, 128, 128), nullptr);
  TrackerFrame in;
  in.ego = {true, 0, 0, 0, ego_mps};
  in.in_map = in.ask_map = false;
  const auto step = [&] {
    in.stamp_ns += 50'000'000;
    auto& rows = frames[std::size_t(in.stamp_ns / 50'000'000) % frames.size()];
    for (Measurement& z : rows) z.stamp_ns = in.stamp_ns;
    in.measurements = rows;
    tracker.step(in, nullptr);
  };
  for (int32_t k = 0; k < kLapFrames; ++k) step();
  for (auto _ : state) step();
}

}  // namespace

void add_tasks(const KernelTable* const* tables, int32_t table_count, const Cloud& racecar_front,
               const Cloud& nuscenes) {
  add("assign/dense/32", [](benchmark::State& state) { bench_assign(state, 32, dense_pairs(32)); });
  add("assign/gated/256", [](benchmark::State& state) { bench_assign(state, 256, gated_pairs(256)); });
  add("assign/tangled/256", [](benchmark::State& state) { bench_assign(state, 256, tangled_pairs(256)); });
  // The detections that each preset makes of 10 cars: paper also of the road and of shards.
  add("track_frame/paper/95",
      [](benchmark::State& s) { bench_frame<CvtrPolicy>(s, "paper", make_lap(95, Rows::kPushed), 60); });
  add("track_frame/best/20",
      [](benchmark::State& s) { bench_frame<LanePolicy>(s, "best", make_lap(20, Rows::kPushed), 60); });
  add("track_frame/best/20_clusters",
      [](benchmark::State& s) { bench_frame<LanePolicy>(s, "best", make_lap(20, Rows::kClusters), 60); });
  add("track_frame/best/95",
      [](benchmark::State& s) { bench_frame<LanePolicy>(s, "best", make_lap(95, Rows::kPushed), 60); });
  add("track_frame/paper/block", [](benchmark::State& s) { bench_frame<CvtrPolicy>(s, "paper", make_block(), 0); });
  add("track_frame/best/block", [](benchmark::State& s) { bench_frame<LanePolicy>(s, "best", make_block(), 0); });
  add_reads<CvtrPolicy>(tables, table_count, "paper");
  add_reads<LanePolicy>(tables, table_count, "best");
  const auto add_each = [&](const std::string& before, const std::string& after, const auto& run) {
    for (int32_t t = 0; t < table_count; ++t)
      add(before + "/" + tables[t]->isa + "/" + after,
          [table = tables[t], run](benchmark::State& state) { run(state, table); });
  };
  for (const int32_t count : {500, 2000, 7500})  // ahead, nearby, alongside
    add_each("fit_rectangle", std::to_string(count),
             [count](benchmark::State& state, const KernelTable* kernels) { bench_rectangle(state, kernels, count); });
  static const Cloud orders[] = {reordered(racecar_front, "line", Order::line),
                                 reordered(racecar_front, "interleaved", Order::interleaved),
                                 reordered(racecar_front, "firing", Order::firing)};
  for (const Cloud& cloud : orders)
    add_each("segment", cloud.name,
             [&cloud](benchmark::State& state, const KernelTable* kernels) { bench_segment(state, kernels, cloud); });
  for (const auto& [name, cloud] : {std::pair{"racecar", &racecar_front}, std::pair{"nuscenes", &nuscenes}}) {
    add_each("repair_link_label", name, [cloud = cloud](benchmark::State& state, const KernelTable* kernels) {
      bench_clusters(state, kernels, *cloud);
    });
#if defined(OVT_BENCH_PCL)
    add(std::string("pcl_euclidean/") + name, [cloud = cloud](benchmark::State& state) { bench_pcl(state, *cloud); });
#endif
  }
}

}  // namespace overtake::bench
