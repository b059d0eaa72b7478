// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a sensor costs when there are several: frames of one sensor on one worker, and frames of N sensors on W workers,
// in turn in one run. CPU time of the process from the first push of a frame to its tracks, divided by the sensors; so
// waiting for a CPU does not count. Each sensor gets the recorded scans of the front, left and right sensor in turn.
// No map, no poses. Also the wall clock's time from the first push to the tracks.
//
//   bench_sensors [--preset NAME] [--isa NAME] [--sensors N] [--workers W] [--stream] [--frames N] [--json]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/floor.h"
#include "bench/program.h"
#include "pipeline/overtake.h"
#include "pipeline/stage_clock.h"
#include "tools/client/pieces.h"

namespace overtake::bench {
namespace {

struct Options {
  std::string preset = "best", isa;
  int32_t sensors = 8, workers = 4, frames = 300, pieces = 32;
  bool stream = false, json = false;
};

int64_t process_cpu_ns() {
  timespec at{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
  return int64_t(at.tv_sec) * 1'000'000'000 + at.tv_nsec;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

class Sensors {
 public:
  Sensors(const Options& options, const std::vector<std::vector<Cloud>>& frames, int32_t count, int32_t workers)
      : options_(options), frames_(frames) {
    for (int32_t s = 0; s < count; ++s) {
      sensors_.push_back(frames[0][std::size_t(s) % frames[0].size()].sensor);
      sensors_.back().yaw_rad += 0.3 * double(s / int32_t(frames[0].size()));  // else one sees what another sees
      for (const std::vector<Cloud>& frame : frames)
        sensors_.back().point_capacity =
            std::max(sensors_.back().point_capacity, int32_t(cloud(frame, s).points.size()));
    }
    ovt_params params;
    ovt_params_init(&params, sizeof params, options.preset.c_str());
    ovt_detector_def def = ovt_default_detector_def();
    def.sensors = sensors_.data();
    def.sensor_count = count;
    def.params = &params;
    def.worker_count = workers;
    def.keep_images = 0;
    def.stream = options.stream;
    def.isa = options.isa.empty() ? nullptr : options.isa.c_str();
    char error[200];
    if (ovt_create_detector_verbose(&def, &detector_, error, sizeof error) != OVT_OK) {
      std::fprintf(stderr, "bench_sensors: %s\n", error);
      std::exit(1);
    }
  }
  Sensors(const Sensors&) = delete;
  ~Sensors() { ovt_destroy_detector(detector_); }

  void run_frame(int64_t k) {
    const std::vector<Cloud>& frame = frames_[std::size_t(k) % frames_.size()];
    const int64_t stamp_ns = (1000 + k) * 50'000'000, cpu_ns = process_cpu_ns(), wall_ns = steady_now_ns();
    const auto count = int32_t(sensors_.size());
    for (int32_t i = 0; i < (options_.stream ? options_.pieces : 1); ++i)
      for (int32_t s = 0; s < count; ++s) push(cloud(frame, s), s, stamp_ns, i);
    require(ovt_flush(detector_));
    cpu_us_.push_back(double(process_cpu_ns() - cpu_ns) * 1e-3 / double(count));
    wall_us_.push_back(double(steady_now_ns() - wall_ns) * 1e-3);
  }
  void forget() { cpu_us_.clear(), wall_us_.clear(); }
  double cpu_us() const { return median(cpu_us_); }
  double wall_us() const { return median(wall_us_); }
  int64_t dropped() const {
    ovt_stats stats = ovt_default_stats();
    ovt_read_stats(detector_, &stats);
    return stats.dropped;
  }

 private:
  static const Cloud& cloud(const std::vector<Cloud>& frame, int32_t s) { return frame[std::size_t(s) % frame.size()]; }
  static void require(ovt_status status) {
    if (status == OVT_OK) return;
    std::fprintf(stderr, "bench_sensors: %s\n", ovt_status_text(status));
    std::exit(1);
  }
  void push(const Cloud& cloud, int32_t s, int64_t stamp_ns, int32_t piece) {
    const CloudPoint* at = cloud.points.data();
    ovt_points points = ovt_default_points();
    points.sensor = s;
    points.count = int32_t(cloud.points.size());
    points.stamp_ns = stamp_ns;
    points.x = OVT_FIELD(at, points.count, x_m, OVT_F32);
    points.y = OVT_FIELD(at, points.count, y_m, OVT_F32);
    points.z = OVT_FIELD(at, points.count, z_m, OVT_F32);
    points.intensity = OVT_FIELD(at, points.count, intensity, OVT_F32);
    points.layer = OVT_FIELD(at, points.count, layer, OVT_U16);
    if (!options_.stream) return require(ovt_push_scan(detector_, &points));
    const auto cut = [&](int32_t i) { return int32_t(int64_t(points.count) * i / options_.pieces); };
    const ovt_points part = cli::piece_of(points, cut(piece), cut(piece + 1));
    require(ovt_push_points(detector_, &part));
    if (piece + 1 == options_.pieces) require(ovt_end_scan(detector_, s, stamp_ns, points.count));
  }

  const Options& options_;
  const std::vector<std::vector<Cloud>>& frames_;
  std::vector<ovt_sensor_def> sensors_;
  ovt_detector* detector_ = nullptr;
  std::vector<double> cpu_us_, wall_us_;
};

int run(const Options& options) {
  std::vector<std::vector<Cloud>> frames;
  for (int32_t frame = 0; frame < kRacecarFrames; ++frame) frames.push_back(racecar_clouds(frame));
  // The sensors differ by what they see, so the one sensor is the mean of the three.
  std::vector<std::vector<std::vector<Cloud>>> alone(frames[0].size());
  for (std::size_t s = 0; s < alone.size(); ++s)
    for (const std::vector<Cloud>& frame : frames) alone[s].push_back({frame[s]});
  std::vector<std::unique_ptr<Sensors>> one;
  for (const auto& cloud : alone) one.push_back(std::make_unique<Sensors>(options, cloud, 1, 1));
  Sensors inline_several(options, frames, options.sensors, 1),
      several(options, frames, options.sensors, options.workers);
  FloorScan floor_scan(frames[0][0]);
  const Loops loops = find_loops(options.isa);
  std::vector<double> floor_us;
  constexpr int32_t kWarmUp = 20;
  for (int32_t k = 0; k < kWarmUp + options.frames; ++k) {
    if (k == kWarmUp) {
      for (const auto& sensor : one) sensor->forget();
      inline_several.forget(), several.forget();
      floor_us.clear();
    }
    const int64_t start_ns = process_cpu_ns();
    segment_floor(loops, floor_scan);
    floor_us.push_back(double(process_cpu_ns() - start_ns) * 1e-3);
    for (const auto& sensor : one) sensor->run_frame(k);
    inline_several.run_frame(k);
    several.run_frame(k);
  }
  // Of as many sensors of each kind as there are among the several.
  double one_us = 0;
  for (int32_t s = 0; s < options.sensors; ++s) one_us += one[std::size_t(s) % one.size()]->cpu_us() / options.sensors;
  const double floor = median(floor_us);
  const int64_t dropped = several.dropped();
  const struct {
    const char* name;
    int32_t sensors, workers;
    double cpu_us, wall_us;
  } rows[] = {{"one", 1, 1, one_us, 0},
              {"several_inline", options.sensors, 1, inline_several.cpu_us(), inline_several.wall_us()},
              {"several", options.sensors, options.workers, several.cpu_us(), several.wall_us()}};
  if (options.json) {
    nlohmann::ordered_json json = {{"preset", options.preset}, {"source", cloud_source()}, {"stream", options.stream},
                                   {"frames", options.frames}, {"floor_us", floor},        {"dropped", dropped}};
    for (const auto& row : rows)
      json[row.name] = {{"sensors", row.sensors},          {"workers", row.workers},
                        {"cpu_us_per_sensor", row.cpu_us}, {"floors", row.cpu_us / floor},
                        {"ratio", row.cpu_us / one_us},    {"wall_us", row.wall_us}};
    std::printf("%s\n", json.dump(2).c_str());
    return 0;
  }
  std::printf("%s scans, %s, %s, %d frames; segment_floor %.1f us\n\n", cloud_source(), options.preset.c_str(),
              options.stream ? "in pieces" : "whole", options.frames, floor);
  std::printf("%8s %8s %22s %8s %8s %12s\n", "sensors", "workers", "CPU us per sensor", "floors", "ratio", "wall us");
  for (const auto& row : rows)
    std::printf("%8d %8d %22.1f %8.2f %8.2f %12.1f\n", row.sensors, row.workers, row.cpu_us, row.cpu_us / floor,
                row.cpu_us / one_us, row.wall_us);
  std::printf("\nscans that were replaced before a worker was free: %lld\n", static_cast<long long>(dropped));
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--sensors", options.sensors, "default 8")->check(CLI::Range(1, 8));
  app.add_option("--workers", options.workers, "default 4")->check(CLI::Range(1, 64));
  app.add_option("--frames", options.frames, "default 300")->check(CLI::Range(1, 100000));
  app.add_option("--pieces", options.pieces, "of a scan, with --stream; default 32")->check(CLI::Range(1, 100000));
  app.add_flag("--stream", options.stream, "scans in pieces, in turn, with ovt_detector_def.stream");
}

}  // namespace
}  // namespace overtake::bench

int main(int argc, char** argv) {
  using namespace overtake::bench;
  return run_program<Options>(argc, argv, "The cost of a sensor when there are several, against one sensor's",
                              add_options, run);
}
