// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The time that this machine needs for the memory traffic and arithmetic of a scan alone, on the scan of the kernel
// benchmarks (racecar_front). tools/dev/bench compares the kernels with this floor. Plain loops, compiled for each ISA.
//
//   stream_read/<isa>/<size>   stream_copy/<isa>/<size>     bandwidth of the caches and of memory
//   read_points/<isa>/{warm,cold}                           24 bytes per point, once
//   atan2/<isa>/points                                      the project's polynomial, once per point
//   scatter/{scan,random,keep_largest}                      4 bytes per point into an image of 32 x 857
//   clear/<isa>/{one,seven}                                 images of 32 x 857
//   column_filter/<isa>/5tap                                five taps down each column of one image
//   segment_floor/<isa>/racecar_front                       the minimum of a segmentation: read, atan2 per point,
//                                                           clear and scatter into two images, atan2 per pixel, five
//                                                           column filters, gather labels back to points
#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "bench/clouds.h"
#include "bench/floor.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace overtake::bench {
namespace {

// Adds a benchmark with its bytes and items per iteration.
void add(const std::string& name, std::size_t bytes, std::size_t items, const std::function<void()>& run) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
    for (auto _ : state) {
      run();
      benchmark::ClobberMemory();
    }
    state.SetBytesProcessed(int64_t(state.iterations()) * int64_t(bytes));
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(items));
  })->Unit(benchmark::kMicrosecond);
}

#if defined(__x86_64__)
void flush(const void* data, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; i += 64) _mm_clflush(static_cast<const char*>(data) + i);
  _mm_mfence();
}
// The points come from a driver on another core, so they are not in this core's cache.
void add_cold(const Loops& loops, const FloorScan& scan) {
  const std::string name = std::string("read_points/") + loops.isa + "/cold";
  benchmark::RegisterBenchmark(name.c_str(), [&loops, &scan](benchmark::State& state) {
    for (auto _ : state) {
      state.PauseTiming();
      flush(scan.raw(), scan.words() * 8);
      state.ResumeTiming();
      benchmark::DoNotOptimize(loops.sum(scan.raw(), scan.words()));
    }
    state.SetBytesProcessed(int64_t(state.iterations()) * int64_t(scan.words() * 8));
    state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(scan.count()));
  })->Unit(benchmark::kMicrosecond);
}
#endif

void add_all() {
  static const std::vector<Loops> all = all_loops();
  static FloorScan scan(racecar_clouds()[0]);
  static std::vector<uint64_t> from(std::size_t(64) << 17, 3), to(std::size_t(64) << 17);
  const std::size_t n = scan.count();
  const std::pair<const char*, std::size_t> sizes[] = {
      {"24kB", 24u << 10}, {"512kB", 512u << 10}, {"1MB", 1u << 20}, {"8MB", 8u << 20}, {"64MB", 64u << 20}};
  for (const Loops& loops : all) {
    if (!loops.can_run) continue;
    const std::string isa = std::string("/") + loops.isa + "/";
    for (const auto& [name, bytes] : sizes) {
      const std::size_t words = bytes / 8;
      add("stream_read" + isa + name, bytes, words,
          [&loops, words] { benchmark::DoNotOptimize(loops.sum(from.data(), words)); });
      // The same total number of bytes: half are read, half written.
      add("stream_copy" + isa + name, bytes, words / 2,
          [&loops, words] { loops.copy(from.data(), to.data(), words / 2); });
    }
    add("read_points" + isa + "warm", n * sizeof(CloudPoint), n,
        [&loops] { benchmark::DoNotOptimize(loops.sum(scan.raw(), scan.words())); });
#if defined(__x86_64__)
    add_cold(loops, scan);
#endif
    add("atan2" + isa + "points", 12 * n, n,
        [&loops, n] { loops.atan2(scan.y.data(), scan.x.data(), scan.azimuth.data(), n); });
    add("clear" + isa + "one", 4 * kFloorPixels, kFloorPixels,
        [&loops] { loops.clear(scan.images[0].data(), kFloorPixels); });
    add("clear" + isa + "seven", 28 * kFloorPixels, 7 * kFloorPixels, [&loops] {
      for (std::vector<float>& image : scan.images) loops.clear(image.data(), kFloorPixels);
    });
    add("column_filter" + isa + "5tap", 8 * kFloorPixels, kFloorPixels,
        [&loops] { floor_filter(loops, scan.images[0], scan.images[1]); });
    add("segment_floor" + isa + "racecar_front", n * sizeof(CloudPoint), n, [&loops] { segment_floor(loops, scan); });
  }
  add("scatter/scan", 12 * n, n, [] { floor_scatter(scan.pixel, scan.intensity, scan.images[0]); });
  add("scatter/random", 12 * n, n, [] { floor_scatter(scan.shuffled, scan.intensity, scan.images[0]); });
  add("scatter/keep_largest", 12 * n, n, [] { floor_scatter_largest(scan.pixel, scan.intensity, scan.images[0]); });
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
