// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the parts of a segmentation save: each step of whole scans on one core, and in parts on two (segment.parts),
// where a second thread waits for parts all the time. The front scans of four frames follow each other; blocks of scans
// in one piece and in parts take turns. No map, no poses.
//
//   bench_parts [--preset NAME] [--isa NAME] [--parts N] [--scans N] [--cores A,B] [--json]
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "bench/measuring_thread.h"
#include "bench/program.h"
#include "bench/work.h"
#include "pipeline/method/step_parts.h"
#include "pipeline/stage_clock.h"
#include "pipeline/threads.h"

namespace overtake::bench {
namespace {

struct Options {
  std::string preset = "best", isa, cores;
  int32_t parts = 2, scans = 2000;
  bool json = false;
};

double median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

int run(const Options& options) {
  const Method* method = find_method(options.preset.c_str());
  const KernelTable* kernels = find_kernels(options.isa.empty() ? nullptr : options.isa.c_str());
  const std::vector<int32_t> cores = options.cores.empty() ? usable_cpus() : parse_cpus(options.cores);
  if (!method || !kernels || cores.size() < 2) {
    std::fprintf(stderr, "bench_parts: needs a preset, an ISA and two cores that exist\n");
    return 1;
  }
  std::vector<Cloud> clouds;
  for (int32_t frame = 0; frame < kRacecarFrames; ++frame) clouds.push_back(racecar_clouds(frame)[0]);
  const Cloud& largest = *std::max_element(
      clouds.begin(), clouds.end(), [](const Cloud& a, const Cloud& b) { return a.points.size() < b.points.size(); });
  Work work(largest, *method);
  SegmentScratch scratch;  // as a worker's
  if (!build_scratch(scratch, work.sizes, default_allocator(), options.parts)) return 1;
  work.context.kernels = kernels;

  SpareWorkers workers(2, options.parts);
  std::atomic<bool> ends{false};
  std::thread helper([&] {
    run_on({cores[1]});
    SpareWorkers::Visit visit(workers);
    while (!ends.load(std::memory_order_relaxed))
      if (!visit.take_part()) idle_briefly();
  });
  run_on({cores[0]});

  // Times of each step, of the whole segmentation, of a step that does nothing, and of 64 KiB of cache lines: to be
  // written where they are (whole), and after the other core wrote them (in parts).
  const std::size_t steps = method->segment.size();
  std::vector<std::vector<double>> us[2];
  for (auto& of : us) of.resize(steps + 3);
  std::vector<uint64_t> lines(65536 / sizeof(uint64_t));
  const auto touch = [&] {
    for (std::size_t i = 0; i < lines.size(); i += kCacheLine / sizeof(uint64_t)) ++lines[i];
  };
  const std::thread::id owner = std::this_thread::get_id();
  constexpr int32_t kBlock = 8, kWarm = 64;
  for (int32_t scan = 0; scan < kWarm + options.scans; ++scan) {
    work.cloud.points = clouds[std::size_t(scan % kRacecarFrames)].points;
    work.load(*kernels);
    const int32_t way = scan / kBlock % 2, parts = way == 0 ? 1 : options.parts;
    SegmentViews views = bind_views(work.context.sensors[0], work.part, scratch);
    Segment segment = {work.context.sensors[0], work.context.segment[0], work.part, views};
    const int64_t begin = steady_now_ns();
    int64_t last = begin;
    const auto note = [&](std::size_t i) {
      const int64_t now = steady_now_ns();
      if (scan >= kWarm) us[way][i].push_back(double(now - last) * 1e-3);
      last = now;
    };
    for (std::size_t i = 0; i < steps; ++i) {
      const Step& step = method->segment[i];
      if (parts == 1 || step.cut.by == Cut::kNone) {
        step.run(*kernels, segment);
      } else {
        workers.run(0, parts, [&](int32_t part) { run_part(*kernels, step, segment, part, parts); });
        if (step.cut.join) workers.run(0, parts, [&](int32_t part) { step.cut.join(segment, part, parts); });
      }
      note(i);
    }
    if (scan >= kWarm) us[way][steps].push_back(double(last - begin) * 1e-3);
    if (parts > 1) workers.run(0, parts, [](int32_t) {});
    note(steps + 1);
    if (parts > 1) {
      std::atomic<bool> touched{false};
      workers.run(0, 2, [&](int32_t) {
        if (std::this_thread::get_id() != owner) {
          touch();
          touched.store(true, std::memory_order_release);
        }
        while (!touched.load(std::memory_order_acquire)) pause_cpu();
      });
    } else {
      touch();
    }
    last = steady_now_ns();
    touch();
    note(steps + 2);
  }
  ends.store(true);
  helper.join();

  nlohmann::ordered_json json = {
      {"preset", method->name}, {"isa", kernels->isa}, {"parts", options.parts}, {"source", cloud_source()}};
  if (!options.json)
    std::printf("%s scans, %s, %s, %d parts; us, medians\n\n%-16s %8s %8s\n", cloud_source(), method->name,
                kernels->isa, options.parts, "", "whole", "parts");
  for (std::size_t i = 0; i < steps + 3; ++i) {
    const std::string name = i < steps        ? method->segment[i].name
                             : i == steps     ? "all"
                             : i == steps + 1 ? "nothing"
                                              : "64 KiB";
    const double whole = median(us[0][i]), parts = median(us[1][i]);
    json["us"][name] = {whole, parts};
    if (!options.json)
      std::printf("%-16s %8.1f %8.1f%s\n", name.c_str(), whole, parts,
                  i < steps && method->segment[i].cut.by == Cut::kNone ? "   not cut" : "");
  }
  if (options.json) std::printf("%s\n", json.dump(1).c_str());
  return 0;
}

}  // namespace
}  // namespace overtake::bench

int main(int argc, char** argv) {
  using namespace overtake::bench;
  return run_program<Options>(
      argc, argv, "The steps of a segmentation whole and in parts",
      [](CLI::App& app, Options& options) {
        app.add_option("--parts", options.parts)->check(CLI::Range(2, 4));
        app.add_option("--scans", options.scans)->check(CLI::Range(100, 1000000));
        app.add_option("--cores", options.cores, "two: \"0,1\"");
      },
      &run);
}
