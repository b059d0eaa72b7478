// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/floor.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace overtake::bench {
namespace {

volatile uint64_t keep;  // a sum that nothing reads would not be computed

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
}  // namespace

std::vector<Loops> all_loops() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  return {OVT_FLOOR_ROW(sse2, true), OVT_FLOOR_ROW(avx2, __builtin_cpu_supports("avx2") != 0),
          OVT_FLOOR_ROW(avx512, __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))};
#else
  return {OVT_FLOOR_ROW(neon64, true)};
#endif
}

Loops find_loops(const std::string& isa) {
  const std::vector<Loops> all = all_loops();
  Loops found = all.front();
  for (const Loops& loops : all)
    if (loops.can_run && (isa.empty() || isa == loops.isa)) found = loops;
  return found;
}

__attribute__((noinline)) void floor_scatter(const std::vector<int32_t>& pixel, const std::vector<float>& value,
                                             std::vector<float>& image) {
  for (std::size_t i = 0; i < pixel.size(); ++i) image[std::size_t(pixel[i])] = value[i];
}
__attribute__((noinline)) void floor_scatter_largest(const std::vector<int32_t>& pixel, const std::vector<float>& value,
                                                     std::vector<float>& image) {
  for (std::size_t i = 0; i < pixel.size(); ++i) {
    float& at = image[std::size_t(pixel[i])];
    at = value[i] > at ? value[i] : at;
  }
}
__attribute__((noinline)) static void gather(const std::vector<int32_t>& pixel, const std::vector<float>& image,
                                             std::vector<int32_t>& labels) {
  for (std::size_t i = 0; i < pixel.size(); ++i) labels[i] = int32_t(image[std::size_t(pixel[i])]);
}

void floor_filter(const Loops& loops, const std::vector<float>& from, std::vector<float>& to) {
  for (int32_t r = 0; r < kFloorRows; ++r) {
    const float* rows[5];
    for (int32_t k = 0; k < 5; ++k) rows[k] = from.data() + std::clamp(r + k - 2, 0, kFloorRows - 1) * kFloorCols;
    loops.filter(rows, to.data() + r * kFloorCols, kFloorCols);
  }
}

void segment_floor(const Loops& loops, FloorScan& scan) {
  keep = loops.sum(scan.raw(), scan.words());
  loops.atan2(scan.y.data(), scan.x.data(), scan.azimuth.data(), scan.count());
  loops.clear(scan.images[0].data(), kFloorPixels);
  loops.clear(scan.images[1].data(), kFloorPixels);
  floor_scatter(scan.pixel, scan.intensity, scan.images[0]);
  floor_scatter(scan.pixel, scan.azimuth, scan.images[1]);
  loops.atan2(scan.images[0].data(), scan.images[1].data(), scan.images[2].data(), kFloorPixels);
  for (std::size_t k = 2; k < 6; ++k) floor_filter(loops, scan.images[k], scan.images[k + 1]);
  floor_filter(loops, scan.images[6], scan.out);
  gather(scan.pixel, scan.out, scan.labels);
}

}  // namespace overtake::bench
