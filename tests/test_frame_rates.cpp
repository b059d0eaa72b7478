// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames of sensors of different rates.
#include "tests/support/assembler_bench.h"

#include <algorithm>
#include <random>
#include <vector>

using namespace overtake;
using namespace overtake::test;

namespace {

// Sensors with a period each, in the order of their stamps, or each stamp's sensors in the opposite order.
struct Rates {
  std::vector<int64_t> period_ms, phase_ms;
  int64_t jitter_ms = 0;
  bool slow_first = false;
  std::vector<int32_t> lost_percent = {0, 0, 0};
  int64_t stops_ms = INT64_MAX;  // the last sensor
  int64_t end_ms = 6000;
};

struct Arrival {
  int64_t due_ms, stamp_ms;
  int32_t sensor;
  int32_t group;  // scans of one group arrive in either order
};

std::vector<Arrival> arrivals_of(const Rates& rates, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Arrival> all;
  for (std::size_t s = 0; s < rates.period_ms.size(); ++s)
    for (int64_t t = 0; t < rates.end_ms; t += rates.period_ms[s]) {
      const int64_t jitter_ms =
          rates.jitter_ms ? int64_t(random() % uint32_t(2 * rates.jitter_ms + 1)) - rates.jitter_ms : 0;
      const bool lost = int32_t(random() % 100) < rates.lost_percent[s];
      const bool stopped = s + 1 == rates.period_ms.size() && t >= rates.stops_ms;
      if (!lost && !stopped) all.push_back({t, 1000 + t + rates.phase_ms[s] + jitter_ms, int32_t(s), int32_t(t / 50)});
    }
  std::sort(all.begin(), all.end(), [&](const Arrival& a, const Arrival& b) {
    if (a.group != b.group) return a.group < b.group;
    return rates.slow_first ? a.sensor > b.sensor : a.sensor < b.sensor;
  });
  return all;
}

constexpr int64_t kLearnedMs = 1000 + 2500;  // until then the stamps teach the intervals

uint32_t sensors_at(const std::vector<Arrival>& all, int32_t group) {
  uint32_t mask = 0;
  for (const Arrival& a : all)
    if (a.group == group) mask |= 1u << a.sensor;
  return mask;
}

}  // namespace

TEST_CASE("frame_assembler: of sensors of two rates, no frame waits for one that is not due, and none is silent") {
  for (const Rates& rates :
       {Rates{{50, 100}, {0, 0}}, Rates{{50, 100}, {0, 15}}, Rates{{50, 100}, {15, 0}}, Rates{{50, 50, 100}, {0, 3, 7}},
        Rates{{50, 100, 100}, {0, 5, 10}}, Rates{{50, 100, 150}, {0, 5, 10}}, Rates{{50, 50, 200}, {0, 0, 0}}})
    for (const int64_t jitter_ms : {0, 2})
      for (const bool slow_first : {false, true}) {
        Rates changed = rates;
        changed.jitter_ms = jitter_ms;
        changed.slow_first = slow_first;
        CAPTURE(rates.period_ms.size());
        CAPTURE(rates.period_ms.back());
        CAPTURE(jitter_ms);
        CAPTURE(slow_first);
        AssemblerBench bench(int32_t(rates.period_ms.size()));
        const std::vector<Arrival> all = arrivals_of(changed, 1);
        for (std::size_t i = 0; i < all.size(); ++i) {
          CHECK(bench.scan(all[i].sensor, all[i].stamp_ms) == IntakeResult::kUsed);
          if (all[i].stamp_ms < kLearnedMs) continue;
          // The frame closes with its last scan, not before and not later.
          const bool is_last = i + 1 == all.size() || all[i + 1].group != all[i].group;
          CHECK(bench.assembler.has_open() == !is_last);
          if (!is_last) continue;
          CHECK(bench.last().mask == sensors_at(all, all[i].group));
          CHECK((bench.last().flags & ~OVT_FLAG_SENSOR_MISSING) == 0);
        }
      }
}

TEST_CASE("frame_assembler: a slower sensor that stops is silent after 1.5 of its own intervals") {
  AssemblerBench bench(2);
  Rates rates{{50, 100}, {0, 5}};
  rates.stops_ms = 4050;  // its last scan: 5005 ms
  for (const Arrival& a : arrivals_of(rates, 1)) bench.scan(a.sensor, a.stamp_ms);
  for (const ClosedFrame& c : bench.runner.closed)
    if (c.first_ms >= kLearnedMs) {
      CAPTURE(c.first_ms);
      CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.last_ms > 5005 + 150));
    }
  CHECK(bench.assembler.has_open() == false);  // nobody waits for it
}

TEST_CASE("frame_assembler: lost scans make no sensor slow, unless eight steps in a row are long") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Rates rates{{50, 50}, {0, 5}};
    rates.lost_percent = {0, 30};
    AssemblerBench bench(2);
    std::vector<int64_t> seen_ms;  // of the lossy sensor
    for (const Arrival& a : arrivals_of(rates, seed)) {
      bench.scan(a.sensor, a.stamp_ms);
      if (a.sensor == 1) seen_ms.push_back(a.stamp_ms);
    }
    // As without any rhythm: silent after 75 ms.
    for (const ClosedFrame& c : bench.runner.closed) {
      const auto next = std::upper_bound(seen_ms.begin(), seen_ms.end(), c.last_ms);
      if (next == seen_ms.begin()) continue;
      CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.last_ms - *(next - 1) > 75));
    }
  }
}

TEST_CASE("frame_assembler: a slower sensor that loses scans is waited for again from its next scan on") {
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    Rates rates{{50, 50, 100}, {0, 3, 7}};
    rates.lost_percent = {0, 0, 30};
    AssemblerBench bench;
    const std::vector<Arrival> all = arrivals_of(rates, seed);
    for (const Arrival& a : all) CHECK(bench.scan(a.sensor, a.stamp_ms) == IntakeResult::kUsed);
    int64_t last_ms = 0;
    for (const Arrival& a : all) {
      if (a.sensor != 2) continue;
      const bool follows = a.stamp_ms - last_ms == 100;
      last_ms = a.stamp_ms;
      if (!follows || a.stamp_ms < kLearnedMs) continue;
      const auto has_it = [&](const ClosedFrame& c) { return c.last_ms == a.stamp_ms && c.mask == 7; };
      CAPTURE(a.stamp_ms);
      CHECK(std::any_of(bench.runner.closed.begin(), bench.runner.closed.end(), has_it));
    }
  }
}

TEST_CASE("frame_assembler: a sensor that delivers at the full rate again is waited for at once") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 40; ++k)
    bench.sweep(50 * k, k % 2 ? std::vector<int32_t>{0, 1} : std::vector<int32_t>{2, 0, 1});
  CHECK(bench.count() == 40);
  bench.sweep(2000);
  bench.sweep(2050, {2, 0, 1});  // half of its interval
  CHECK(bench.count() == 42);
  bench.sweep(2100, {0, 1});
  CHECK(bench.assembler.has_open());
  CHECK(bench.scan(2, 2102) == IntakeResult::kUsed);
  CHECK(bench.count() == 43);
  CHECK(bench.last().mask == 7);
}

TEST_CASE("frame_assembler: a sensor of less than a quarter of the rate counts as silent in between") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 200; ++k)
    bench.sweep(50 * k, k % 5 ? std::vector<int32_t>{0, 1} : std::vector<int32_t>{2, 0, 1});
  for (const ClosedFrame& c : bench.runner.closed) {
    CAPTURE(c.first_ms);
    CHECK(((c.flags & OVT_FLAG_SENSOR_STALE) != 0) == (c.first_ms % 250 >= 100));
  }
}

TEST_CASE("frame_assembler: after a jump of the clock the intervals are those before it") {
  for (const int64_t to_ms : {60'000, 1'000}) {
    CAPTURE(to_ms);
    AssemblerBench bench(2);
    int64_t k = 0;
    for (; k < 40; ++k) bench.sweep(20'000 + 50 * k, k % 2 ? std::vector<int32_t>{0} : std::vector<int32_t>{0, 1});
    for (k = 0; k < 40; ++k)
      for (const int32_t s : {0, 1})
        if (s == 0 || k % 2 == 0) bench.scan(s, to_ms + 50 * k + s);
    CHECK(bench.assembler.clock_jumps() == 1);
    bool after = false;
    for (const ClosedFrame& c : bench.runner.closed) {
      after |= (c.flags & OVT_FLAG_CLOCK_JUMP) != 0;
      if (!after) continue;
      CAPTURE(c.first_ms);
      CHECK((c.flags & OVT_FLAG_SENSOR_STALE) == 0);
      CHECK(c.mask == ((c.first_ms - to_ms) % 100 == 0 ? 3u : 1u));
    }
    CHECK(after);
  }
}
