// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One sensor in pieces: the time in the pieces, and the time after the last point, beside whole scans of the same
// points and segment_floor, in turn in one run on one core. The front scans of four frames follow each other.
// worker_count 1, no map, no poses. Ratios to the floor are the result; a machine's microseconds are not.
//
//   bench_stream [--preset NAME] [--isa NAME] [--points N] [--changing] [--scans N] [--core N] [--json]
#include <sched.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/floor.h"
#include "bench/program.h"
#include "pipeline/overtake.h"
#include "pipeline/stage_clock.h"

namespace overtake::bench {
namespace {

struct Options {
  std::string preset = "best", isa;
  int32_t points = 0;  // of a piece; 0: a line
  int32_t scans = 1000, core = -1;
  bool json = false;
  bool changing = false;  // each scan has its lines in the reverse order of the scan before
};

// Microseconds, one value for each scan.
struct Times {
  std::vector<double> us;
  void add(int64_t ns) { us.push_back(double(ns) * 1e-3); }
  double quantile(double q) const {
    std::vector<double> sorted = us;
    std::sort(sorted.begin(), sorted.end());
    return sorted[std::min(sorted.size() - 1, std::size_t(q * double(sorted.size())))];
  }
};

// The stages of a segmentation that run for a whole scan.
constexpr struct {
  ovt_stage stage;
  const char* text;
} kStages[] = {{OVT_STAGE_PROJECT, "project"}, {OVT_STAGE_GAPS, "gaps"},     {OVT_STAGE_ANGLE, "angle"},
               {OVT_STAGE_SMOOTH, "smooth"},   {OVT_STAGE_GROUND, "ground"}, {OVT_STAGE_REPAIR, "repair"},
               {OVT_STAGE_LINK, "links"},      {OVT_STAGE_LABEL, "labels"},  {OVT_STAGE_CLUSTERS, "clusters"}};

// A detector with one sensor; the spans of its last segmentation, by the steady clock.
class OneSensor {
 public:
  OneSensor(const Options& options, const Cloud& cloud, bool stream) {
    ovt_params_init(&params_, sizeof params_, options.preset.c_str());
    ovt_detector_def def = ovt_default_detector_def();
    def.sensors = &cloud.sensor;
    def.sensor_count = 1;
    def.params = &params_;
    def.keep_images = 0;
    def.stream = stream;
    def.isa = options.isa.empty() ? nullptr : options.isa.c_str();
    def.user = this;
    def.on_frame = [](ovt_reader* reader, void* user) {
      for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage)
        ovt_read_span(reader, 0, ovt_stage(stage), &static_cast<OneSensor*>(user)->spans[std::size_t(stage)]);
    };
    char error[200];
    if (ovt_create_detector_verbose(&def, &detector_, error, sizeof error) != OVT_OK) {
      std::fprintf(stderr, "bench_stream: %s\n", error);
      std::exit(1);
    }
  }
  OneSensor(const OneSensor&) = delete;
  ~OneSensor() { ovt_destroy_detector(detector_); }

  // Points [first, last) of a scan.
  ovt_points points(const Cloud& cloud, int64_t stamp_ns, int32_t first, int32_t last) const {
    ovt_points points = ovt_default_points();
    const CloudPoint* at = cloud.points.data() + first;
    points.count = last - first;
    points.first = first;
    points.stamp_ns = stamp_ns;
    points.x = OVT_FIELD(at, points.count, x_m, OVT_F32);
    points.y = OVT_FIELD(at, points.count, y_m, OVT_F32);
    points.z = OVT_FIELD(at, points.count, z_m, OVT_F32);
    points.intensity = OVT_FIELD(at, points.count, intensity, OVT_F32);
    points.layer = OVT_FIELD(at, points.count, layer, OVT_U16);
    points.time = OVT_FIELD(at, points.count, time_ns, OVT_U32);
    return points;
  }
  ovt_detector* detector() const { return detector_; }
  int64_t memory_bytes() const {
    ovt_runtime_info info{};
    ovt_read_runtime_info(detector_, &info);
    return info.memory_bytes;
  }
  int64_t segmented_ns() const { return spans[OVT_STAGE_SEGMENT].start_ns + spans[OVT_STAGE_SEGMENT].duration_ns; }
  std::array<ovt_span, OVT_STAGE_COUNT> spans{};

 private:
  ovt_params params_;
  ovt_detector* detector_ = nullptr;
};

// Where the scan is cut: after each line, or after a number of points.
std::vector<int32_t> find_cuts(const Cloud& cloud, int32_t points) {
  std::vector<int32_t> cuts;
  const auto count = int32_t(cloud.points.size());
  for (int32_t i = 1; i < count; ++i) {
    const bool new_line = cloud.points[std::size_t(i)].layer != cloud.points[std::size_t(i - 1)].layer;
    if (points > 0 ? i % points == 0 : new_line && i - (cuts.empty() ? 0 : cuts.back()) >= 100) cuts.push_back(i);
  }
  cuts.push_back(count);
  return cuts;
}

// The lines of the scan from the last one to the first.
Cloud reverse_lines(const Cloud& cloud) {
  Cloud reverse = cloud;
  reverse.points.clear();
  std::vector<int32_t> cuts = find_cuts(cloud, 0);
  for (std::size_t i = cuts.size(); i-- > 0;)
    reverse.points.insert(reverse.points.end(), cloud.points.begin() + (i > 0 ? cuts[i - 1] : 0),
                          cloud.points.begin() + cuts[i]);
  return reverse;
}

bool require_ok(ovt_status status) {
  if (status != OVT_OK) std::fprintf(stderr, "bench_stream: %s\n", ovt_status_text(status));
  return status == OVT_OK;
}

int run(const Options& options) {
  if (options.core >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    CPU_SET(std::size_t(options.core), &cpus);
    if (sched_setaffinity(0, sizeof cpus, &cpus) != 0) {
      std::fprintf(stderr, "bench_stream: this process may not use CPU %d\n", options.core);
      return 1;
    }
  }
  std::vector<Cloud> clouds;
  std::vector<FloorScan> floor_scans;
  for (int32_t frame = 0; frame < kRacecarFrames; ++frame) {
    clouds.push_back(racecar_clouds(frame)[0]);
    if (options.changing && frame % 2) clouds.back() = reverse_lines(clouds.back());
    floor_scans.emplace_back(clouds.back());
  }
  const Cloud& cloud = clouds[0];
  OneSensor whole(options, cloud, false), pieces(options, cloud, true);
  ovt_runtime_info runtime{};
  ovt_read_runtime_info(pieces.detector(), &runtime);
  const Loops loops = find_loops(options.isa);

  Times floor, batch, batch_tracks, in_pieces, after, after_tracks, both, last_piece, end_scan;
  Times of_stage[std::size(kStages)], of_whole[std::size(kStages)];
  constexpr int32_t kWarmUp = 30;
  std::size_t piece_count = 0;
  for (int32_t k = -kWarmUp; k < options.scans; ++k) {
    const auto frame = std::size_t(k + kWarmUp) % clouds.size();
    const Cloud& now = clouds[frame];
    const auto count = int32_t(now.points.size());
    const std::vector<int32_t> cuts = find_cuts(now, options.points);
    piece_count = cuts.size();
    const int64_t stamp_ns = int64_t(1000 + k) * 50'000'000, t0 = steady_now_ns();
    segment_floor(loops, floor_scans[frame]);
    const int64_t t1 = steady_now_ns();
    const ovt_points scan = whole.points(now, stamp_ns, 0, count);
    if (!require_ok(ovt_push_scan(whole.detector(), &scan))) return 1;
    const int64_t t2 = steady_now_ns();
    int32_t first = 0;
    for (std::size_t i = 0; i + 1 < cuts.size(); first = cuts[i++]) {
      const ovt_points piece = pieces.points(now, stamp_ns, first, cuts[i]);
      if (!require_ok(ovt_push_points(pieces.detector(), &piece))) return 1;
    }
    const int64_t t3 = steady_now_ns();
    const ovt_points last = pieces.points(now, stamp_ns, first, cuts.back());
    if (!require_ok(ovt_push_points(pieces.detector(), &last))) return 1;
    const int64_t t_end = steady_now_ns();
    if (!require_ok(ovt_end_scan(pieces.detector(), 0, stamp_ns, count))) return 1;
    const int64_t t4 = steady_now_ns();
    if (k < 0) continue;
    floor.add(t1 - t0);
    batch.add(whole.segmented_ns() - t1);
    batch_tracks.add(t2 - t1);
    in_pieces.add(t3 - t2);
    after.add(pieces.segmented_ns() - t3);
    after_tracks.add(t4 - t3);
    both.add(pieces.segmented_ns() - t2);
    last_piece.add(t_end - t3);
    const int64_t segment_ns = pieces.spans[OVT_STAGE_SEGMENT].start_ns;
    end_scan.add(segment_ns - t_end);
    for (std::size_t i = 0; i < std::size(kStages); ++i) {
      if (const ovt_span& span = pieces.spans[kStages[i].stage]; span.start_ns >= segment_ns)
        of_stage[i].add(span.duration_ns);
      if (const ovt_span& span = whole.spans[kStages[i].stage]; span.duration_ns >= 0)
        of_whole[i].add(span.duration_ns);
    }
  }
  ovt_stats stats = ovt_default_stats();
  ovt_read_stats(pieces.detector(), &stats);

  struct Row {
    std::string name, text;
    const Times& times;
  };
  std::vector<Row> rows = {{"floor", "segment_floor", floor},
                           {"whole", "whole scan, to the end of its segmentation", batch},
                           {"whole_to_tracks", "whole scan, to tracks", batch_tracks},
                           {"in_pieces", "in the pieces before the last one", in_pieces},
                           {"after", "from the last piece to the end of the segmentation", after},
                           {"sum", "both: a segmentation in pieces", both},
                           {"after_to_tracks", "from the last piece to tracks", after_tracks},
                           {"after_push", "after: the last piece", last_piece},
                           {"after_end", "after: the end of the scan, until the workers' steps", end_scan}};
  for (std::size_t i = 0; i < std::size(kStages); ++i)
    if (!of_whole[i].us.empty())
      rows.push_back({std::string("whole_") + kStages[i].text, std::string("whole: ") + kStages[i].text, of_whole[i]});
  for (std::size_t i = 0; i < std::size(kStages); ++i)
    if (!of_stage[i].us.empty())
      rows.push_back({std::string("after_") + kStages[i].text, std::string("after: ") + kStages[i].text, of_stage[i]});
  const double floor_us = floor.quantile(0.5);
  if (options.json) {
    nlohmann::ordered_json json = {{"cloud", cloud.name},
                                   {"source", cloud_source()},
                                   {"preset", options.preset},
                                   {"isa", runtime.isa},
                                   {"floor_isa", loops.isa},
                                   {"point_count", cloud.points.size()},
                                   {"piece_count", piece_count},
                                   {"scans", options.scans},
                                   {"row_orders_wrong", stats.row_orders_wrong},
                                   {"memory_bytes", whole.memory_bytes()},
                                   {"memory_bytes_stream", pieces.memory_bytes()}};
    for (const Row& row : rows)
      json[row.name] = {{"p50_us", row.times.quantile(0.5)},
                        {"p99_us", row.times.quantile(0.99)},
                        {"floors", row.times.quantile(0.5) / floor_us}};
    std::printf("%s\n", json.dump(2).c_str());
    return 0;
  }
  std::printf("%s (%s), %s, %s, %zu points in %zu pieces, %d scans\n\n", cloud.name.c_str(), cloud_source(),
              options.preset.c_str(), runtime.isa, cloud.points.size(), piece_count, options.scans);
  std::printf("%-52s %9s %9s %7s\n", "", "p50 us", "p99 us", "floors");
  for (const Row& row : rows)
    std::printf("%-52s %9.1f %9.1f %7.2f\n", row.text.c_str(), row.times.quantile(0.5), row.times.quantile(0.99),
                row.times.quantile(0.5) / floor_us);
  std::printf("\nscans with other rows than predicted: %lld\n", static_cast<long long>(stats.row_orders_wrong));
  std::printf("memory: %.1f MiB, with ovt_detector_def.stream %.1f MiB\n", double(whole.memory_bytes()) / (1 << 20),
              double(pieces.memory_bytes()) / (1 << 20));
  return 0;
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--points", options.points, "points of a piece; default: a line")->check(CLI::Range(1, 1000000));
  app.add_option("--scans", options.scans, "default 1000")->check(CLI::Range(1, 1000000));
  app.add_option("--core", options.core, "run on this CPU")->check(CLI::Range(0, 1023));
  app.add_flag("--changing", options.changing, "every other scan has its lines in reverse order");
}

}  // namespace
}  // namespace overtake::bench

int main(int argc, char** argv) {
  using namespace overtake::bench;
  return run_program<Options>(argc, argv,
                              "The time after the last point of a scan that comes in pieces, in floors of the same run",
                              add_options, run);
}
