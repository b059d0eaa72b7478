// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Producers faster than the pipeline: the newest scan is used, every other one is counted, no thread waits, and no
// memory grows.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <thread>
#include <vector>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"
#include "tests/support/heap_calls.h"

using namespace overtake::test;
using overtake::steady_now_ns;

namespace {

constexpr int64_t kMs = 1'000'000, kPeriod = 5 * kMs;  // 200 Hz
constexpr int32_t kPoints = 64;                        // few points: a push costs little besides its copy

int64_t resident_pages() {
  int64_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident;
}

struct Age {
  std::vector<int64_t> ns;     // of the scans whose segmentation began
  std::vector<int64_t> newer;  // scans of the same sensor pushed before this one was acquired
  std::atomic<int64_t> posted[3] = {-1, -1, -1};
  int64_t last = 0;                    // last scan of each sensor: no newer one replaces it
  std::atomic<int64_t> slowest_ns{0};  // time a frame spent in the slow stage
};

struct Outcome {
  ovt_stats stats;
  std::vector<int64_t> push_ns;
  int64_t pages_grown = 0, heap_calls = 0;
};

// Three producers at 200 Hz against a tracker that takes 25 ms per frame.
Outcome flood(double seconds, Age& age) {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .map = false, .record = false});
  bench.params.frame_period_s = 0.005;
  bench.params.frame_tolerance_s = 0.0025;
  bench.create();
  age.ns.reserve(std::size_t(seconds * 1000));
  age.newer.reserve(std::size_t(seconds * 1000));
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook({[](void* user, overtake::HookPoint at, overtake::Frame& frame, int32_t sensor) {
                    auto& a = *static_cast<Age*>(user);
                    if (at == overtake::HookPoint::kTake) {
                      if (a.newer.size() < a.newer.capacity())
                        a.newer.push_back(a.posted[sensor] - frame.sensors[sensor].stamp_ns / kPeriod);
                    } else if (at == overtake::HookPoint::kTrack) {
                      const int64_t from = steady_now_ns();
                      std::this_thread::sleep_for(std::chrono::milliseconds(25));
                      a.slowest_ns = std::max(a.slowest_ns.load(), steady_now_ns() - from);  // one frame at a time
                    } else if (at == overtake::HookPoint::kFinish) {
                      for (int32_t s = 0; s < 3; ++s) {
                        const overtake::SensorPart& part = frame.sensors[s];
                        const overtake::StageSpan& load = part.spans[OVT_STAGE_LOAD];
                        if (part.present && a.posted[s] < a.last && a.ns.size() < a.ns.capacity())
                          a.ns.push_back(part.spans[OVT_STAGE_PROJECT].start_ns - load.start_ns - load.duration_ns);
                      }
                    }
                  },
                  &age});
  const auto count = int64_t(seconds * 1e9) / kPeriod;
  age.last = count - 1;
  std::vector<std::vector<int64_t>> push_ns(3, std::vector<int64_t>(std::size_t(count)));
  std::vector<float> x(kPoints, 20.0f), y(kPoints, 1.0f), z(kPoints, 0.5f);
  const std::vector<uint8_t> layer(kPoints, 3);
  Outcome out;
  std::atomic<int64_t> pages{0}, heap{0};
  const int64_t start = steady_now_ns() + 20 * kMs;
  const auto produce = [&](int32_t sensor) {
    ovt_points points;
    ovt_points_init(&points, sizeof points);
    points.sensor = sensor;
    points.count = kPoints;
    points.x = column_of(x, OVT_F32);
    points.y = column_of(y, OVT_F32);
    points.z = column_of(z, OVT_F32);
    points.layer = column_of(layer, OVT_U8);
    for (int64_t k = 0; k < count; ++k) {
      const int64_t due = start + k * kPeriod;
      timespec at{due / 1'000'000'000, due % 1'000'000'000};
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr);
      points.stamp_ns = k * kPeriod;
      const int64_t before = steady_now_ns();
      if (ovt_push_scan(bench.detector, &points) != OVT_OK) return;
      push_ns[std::size_t(sensor)][std::size_t(k)] = steady_now_ns() - before;
      age.posted[sensor] = k;
      if (sensor == 0 && k == count / 10) {  // now all memory of the first pushes has been touched
        pages = resident_pages();
        heap = can_count_heap_calls() ? count_heap_calls() : 0;
      }
    }
  };
  std::thread a(produce, 0), b(produce, 1), c(produce, 2);
  a.join(), b.join(), c.join();
  out.heap_calls = can_count_heap_calls() ? count_heap_calls() - heap : 0;
  out.pages_grown = resident_pages() - pages;
  bench.flush();
  out.stats = bench.stats();
  for (const std::vector<int64_t>& sensor : push_ns)
    out.push_ns.insert(out.push_ns.end(), sensor.begin(), sensor.end());
  return out;
}

int64_t quantile(std::vector<int64_t> v, double q) {
  std::sort(v.begin(), v.end());
  return v.empty() ? 0 : v[std::min(v.size() - 1, std::size_t(q * double(v.size())))];
}

void check_flood(double seconds) {
  Age age;
  const Outcome out = flood(seconds, age);
  const ovt_stats& s = out.stats;
  char text[500];
  std::snprintf(text, sizeof text,
                "pushed %" PRId64 " used %" PRId64 " dropped %" PRId64 " late %" PRId64 " frames %" PRId64
                "; push p50 %.1f p99 %.1f max %.1f us; age p50 %.1f p99 %.1f max %.1f ms, slow stage at most %.1f ms; "
                "newer scans when one was taken: p99 %" PRId64
                "; "
                "%" PRId64 " pages, %" PRId64 " heap calls",
                s.pushed, s.used, s.dropped, s.late, s.frames, double(quantile(out.push_ns, 0.5)) * 1e-3,
                double(quantile(out.push_ns, 0.99)) * 1e-3, double(quantile(out.push_ns, 1)) * 1e-3,
                double(quantile(age.ns, 0.5)) * 1e-6, double(quantile(age.ns, 0.99)) * 1e-6,
                double(quantile(age.ns, 1)) * 1e-6, double(age.slowest_ns) * 1e-6, quantile(age.newer, 0.99),
                out.pages_grown, out.heap_calls);
  MESSAGE(text);
  CHECK(s.pushed == int64_t(out.push_ns.size()));
  CHECK(adds_up(s));
  CHECK(s.late * 100 <= s.pushed);  // a busy machine stops a producer while the others go on
  CHECK(s.dropped * 2 >= s.pushed);
  CHECK(s.in_flight == 0);
  CHECK(out.heap_calls <= 0);
  if (can_count_heap_calls())  // a sanitizer's memory grows
    CHECK(out.pages_grown * sysconf(_SC_PAGESIZE) <= 256 * 1024);
  REQUIRE(!age.ns.empty());
  // The intake takes the newest scan; one more may be pushed on the way. The median judges: an intake that kept older
  // scans would be late with every one, and a busy machine stops this thread between the take and the look at its age.
  CHECK(quantile(age.newer, 0.5) <= 1);
  CHECK(quantile(age.ns, 0.5) <= kPeriod + age.slowest_ns);
}

}  // namespace

TEST_CASE("flood: three sensors at 200 Hz and a slow tracker for two seconds") { check_flood(2); }

TEST_SUITE("long") {
  TEST_CASE("flood: three sensors at 200 Hz and a slow tracker for a minute") { check_flood(60); }
}
