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

#include <algorithm>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "bench/clouds.h"
#include "core/math.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace overtake::bench {
namespace {

struct Loops {
  const char* isa;
  uint64_t (*sum)(const uint64_t* from, std::size_t count);
  void (*copy)(const uint64_t* from, uint64_t* to, std::size_t count);
  void (*clear)(float* to, std::size_t count);
  void (*atan2)(const float* y, const float* x, float* to, std::size_t count);
  void (*filter)(const float* const* rows, float* to, std::size_t count);  // five rows to one
  bool can_run;
};

// Eight independent sums: one chain of additions would measure its own latency.
#define OVT_FLOOR_LOOPS(name, attributes)                                                                  \
  namespace name {                                                                                         \
  attributes uint64_t sum(const uint64_t* from, std::size_t count) {                                       \
    uint64_t s[64] = {};                                                                                   \
    for (std::size_t i = 0; i + 64 <= count; i += 64)                                                      \
      for (std::size_t k = 0; k < 64; ++k) s[k] += from[i + k];                                            \
    for (std::size_t k = 1; k < 64; ++k) s[0] += s[k];                                                     \
    return s[0];                                                                                           \
  }                                                                                                        \
  attributes void copy(const uint64_t* __restrict from, uint64_t* __restrict to, std::size_t count) {      \
    for (std::size_t i = 0; i < count; ++i) to[i] = from[i] + 1; /* + 1: or it becomes a call of memcpy */ \
  }                                                                                                        \
  attributes void clear(float* to, std::size_t count) {                                                    \
    for (std::size_t i = 0; i < count; ++i) to[i] = 0.5f; /* 0: or it becomes a call of memset */          \
  }                                                                                                        \
  attributes void atan2(const float* __restrict y, const float* __restrict x, float* __restrict to,        \
                        std::size_t count) {                                                               \
    for (std::size_t i = 0; i < count; ++i) to[i] = atan2_of(y[i], x[i]);                                  \
  }                                                                                                        \
  attributes void filter(const float* const* rows, float* __restrict to, std::size_t count) {              \
    const float *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3], *e = rows[4];                      \
    for (std::size_t i = 0; i < count; ++i)                                                                \
      to[i] = 0.4857f * c[i] + 0.3429f * (b[i] + d[i]) - 0.0857f * (a[i] + e[i]);                          \
  }                                                                                                        \
  }

#if defined(__x86_64__)
#if defined(__clang__)
#define OVT_FLOOR_512 __attribute__((noinline, target("avx512f,avx512dq,avx512bw,avx512vl"), min_vector_width(512)))
#else
#define OVT_FLOOR_512 __attribute__((noinline, target("avx512f,avx512dq,avx512bw,avx512vl,prefer-vector-width=512")))
#endif
OVT_FLOOR_LOOPS(sse2, __attribute__((noinline)))
OVT_FLOOR_LOOPS(avx2, __attribute__((noinline, target("avx2"))))
OVT_FLOOR_LOOPS(avx512, OVT_FLOOR_512)
#else
OVT_FLOOR_LOOPS(neon64, __attribute__((noinline)))
#endif

#define OVT_FLOOR_ROW(name, can_run) \
  Loops { #name, name::sum, name::copy, name::clear, name::atan2, name::filter, can_run }
std::vector<Loops> all_loops() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  return {OVT_FLOOR_ROW(sse2, true), OVT_FLOOR_ROW(avx2, __builtin_cpu_supports("avx2") != 0),
          OVT_FLOOR_ROW(avx512, __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))};
#else
  return {OVT_FLOOR_ROW(neon64, true)};
#endif
}

constexpr int32_t kRows = 32, kCols = 857;
constexpr std::size_t kPixels = std::size_t(kRows) * kCols;

// The scan in the form that the passes need. Arrays are padded, so that loops may read whole vectors.
struct Scan {
  std::vector<CloudPoint> points;
  std::vector<float> x, y, azimuth, intensity;
  std::vector<int32_t> pixel, shuffled, labels;
  std::vector<float> images[7], out;

  explicit Scan(const Cloud& cloud) : points(cloud.points) {
    const float left = float(cloud.sensor.azimuth_left_rad), right = float(cloud.sensor.azimuth_right_rad);
    for (const CloudPoint& p : points) {
      x.push_back(p.x_m);
      y.push_back(p.y_m);
      intensity.push_back(p.intensity);
      const int32_t column = int32_t((left - atan2_f32(p.y_m, p.x_m)) / (left - right) * float(kCols));
      pixel.push_back(std::clamp(column, 0, kCols - 1) + p.layer % kRows * kCols);
    }
    azimuth.resize(x.size());
    labels.resize(x.size());
    shuffled = pixel;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
    for (std::vector<float>& image : images) image.assign(kPixels, 1.5f);
    out.resize(kPixels);
  }
  std::size_t count() const { return points.size(); }
  std::size_t words() const { return count() * sizeof(CloudPoint) / 8; }
  const uint64_t* raw() const { return reinterpret_cast<const uint64_t*>(points.data()); }
};

__attribute__((noinline)) void scatter(const std::vector<int32_t>& pixel, const std::vector<float>& value,
                                       std::vector<float>& image) {
  for (std::size_t i = 0; i < pixel.size(); ++i) image[std::size_t(pixel[i])] = value[i];
}
__attribute__((noinline)) void scatter_largest(const std::vector<int32_t>& pixel, const std::vector<float>& value,
                                               std::vector<float>& image) {
  for (std::size_t i = 0; i < pixel.size(); ++i) {
    float& at = image[std::size_t(pixel[i])];
    at = value[i] > at ? value[i] : at;
  }
}
__attribute__((noinline)) void gather(const std::vector<int32_t>& pixel, const std::vector<float>& image,
                                      std::vector<int32_t>& labels) {
  for (std::size_t i = 0; i < pixel.size(); ++i) labels[i] = int32_t(image[std::size_t(pixel[i])]);
}

void filter_image(const Loops& loops, const std::vector<float>& from, std::vector<float>& to) {
  for (int32_t r = 0; r < kRows; ++r) {
    const float* rows[5];
    for (int32_t k = 0; k < 5; ++k) rows[k] = from.data() + std::clamp(r + k - 2, 0, kRows - 1) * kCols;
    loops.filter(rows, to.data() + r * kCols, kCols);
  }
}

void segment_floor(const Loops& loops, Scan& scan) {
  benchmark::DoNotOptimize(loops.sum(scan.raw(), scan.words()));
  loops.atan2(scan.y.data(), scan.x.data(), scan.azimuth.data(), scan.count());
  loops.clear(scan.images[0].data(), kPixels);
  loops.clear(scan.images[1].data(), kPixels);
  scatter(scan.pixel, scan.intensity, scan.images[0]);
  scatter(scan.pixel, scan.azimuth, scan.images[1]);
  loops.atan2(scan.images[0].data(), scan.images[1].data(), scan.images[2].data(), kPixels);
  for (std::size_t k = 2; k < 6; ++k) filter_image(loops, scan.images[k], scan.images[k + 1]);
  filter_image(loops, scan.images[6], scan.out);
  gather(scan.pixel, scan.out, scan.labels);
}

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
void add_cold(const Loops& loops, const Scan& scan) {
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
  static Scan scan(racecar_clouds()[0]);
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
    add("clear" + isa + "one", 4 * kPixels, kPixels, [&loops] { loops.clear(scan.images[0].data(), kPixels); });
    add("clear" + isa + "seven", 28 * kPixels, 7 * kPixels, [&loops] {
      for (std::vector<float>& image : scan.images) loops.clear(image.data(), kPixels);
    });
    add("column_filter" + isa + "5tap", 8 * kPixels, kPixels,
        [&loops] { filter_image(loops, scan.images[0], scan.images[1]); });
    add("segment_floor" + isa + "racecar_front", n * sizeof(CloudPoint), n, [&loops] { segment_floor(loops, scan); });
  }
  add("scatter/scan", 12 * n, n, [] { scatter(scan.pixel, scan.intensity, scan.images[0]); });
  add("scatter/random", 12 * n, n, [] { scatter(scan.shuffled, scan.intensity, scan.images[0]); });
  add("scatter/keep_largest", 12 * n, n, [] { scatter_largest(scan.pixel, scan.intensity, scan.images[0]); });
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
