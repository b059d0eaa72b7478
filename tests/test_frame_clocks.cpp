// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames under late, repeated and wrong stamps, gaps, and clocks that step.
#include "tests/support/assembler_bench.h"

#include <algorithm>
#include <array>
#include <vector>

using namespace overtake;
using namespace overtake::test;

TEST_CASE("frame_assembler: a scan that is more than half a second old is late") {
  AssemblerBench bench;
  bench.sweep(1000);                                 // 1000, 1001, 1002 ms
  CHECK(bench.scan(0, 502) == IntakeResult::kUsed);  // exactly at the limit
  CHECK(bench.scan(0, 501) == IntakeResult::kLate);
  CHECK(bench.scan_ns(1, 502 * kMs - 1) == IntakeResult::kLate);
  CHECK(bench.count() == 2);
}

TEST_CASE("frame_assembler: pushed detections ahead of the sensors make no scan late") {
  AssemblerBench bench;
  bench.sweep(1000);                                   // 1000, 1001, 1002 ms
  CHECK(bench.external(1072) == IntakeResult::kUsed);  // as near as the next scans may be
  CHECK(bench.scan(0, 502) == IntakeResult::kUsed);    // half a second before the sensors' newest stamp
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) != 0);
  CHECK(bench.scan(0, 501) == IntakeResult::kLate);
}

TEST_CASE("frame_assembler: a repeated stamp of a sensor is a duplicate, also out of sequence") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 5; ++k) bench.sweep(50 * k);
  CHECK(bench.scan(0, 100) == IntakeResult::kDuplicate);
  CHECK(bench.scan(1, 151) == IntakeResult::kDuplicate);
  CHECK(bench.scan(0, 101) == IntakeResult::kUsed);  // another sensor's stamp
  CHECK(bench.scan(0, 101) == IntakeResult::kDuplicate);
  CHECK(bench.count() == 6);
}

TEST_CASE("frame_assembler: repeated stamps of half a second are duplicates, also at 1 kHz and in any order") {
  for (const int64_t period_ms : {50, 10, 2, 1}) {
    for (const bool pushed : {false, true}) {
      CAPTURE(period_ms);
      CAPTURE(pushed);
      AssemblerBench bench(pushed ? 0 : 1, period_ms * kMs);
      const auto offer = [&](int64_t ms) { return pushed ? bench.external(ms) : bench.scan(0, ms); };
      int32_t used = 0, again = 0;
      for (int64_t ms = 0; ms < 3000; ms += 2 * period_ms) {  // each second one is out of sequence
        used += offer(ms + period_ms) == IntakeResult::kUsed;
        used += offer(ms) == IntakeResult::kUsed;
      }
      CHECK(used == 3000 / period_ms);
      const int64_t newest_ms = 3000 - period_ms;
      for (int64_t ms = newest_ms; ms >= newest_ms - 500; ms -= period_ms)
        again += offer(ms) != IntakeResult::kDuplicate;
      CHECK(again == 0);
    }
  }
}

TEST_CASE("frame_assembler: of more stamps than half a second has at 1 kHz, the last used ones are duplicates") {
  AssemblerBench bench(0);
  for (int64_t k = 0; k < 3000; ++k) REQUIRE(bench.external_ns(k * kMs / 4) == IntakeResult::kUsed);
  for (int64_t k = 2999; k > 2999 - 500; --k) REQUIRE(bench.external_ns(k * kMs / 4) == IntakeResult::kDuplicate);
  CHECK(bench.external_ns(1001 * kMs / 4) == IntakeResult::kUsed);
}

TEST_CASE("frame_assembler: a clock that goes back by whole periods restarts at its third stamp, a used one") {
  for (const int64_t back : {20, 30}) {  // periods: 1 and 1.5 s
    CAPTURE(back);
    AssemblerBench bench;
    for (int64_t k = 0; k < 100; ++k) bench.sweep(50 * k);
    for (int64_t k = 100 - back; k < 102 - back; ++k)
      for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 50 * k + s) == IntakeResult::kLate);
    CHECK(bench.count() == 100);
    bench.sweep(50 * (102 - back));
    REQUIRE(bench.count() == 101);
    CHECK(bench.last().mask == 7);
    CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
    CHECK(bench.assembler.clock_jumps() == 1);
  }
}

TEST_CASE("frame_assembler: the last stamp of a sensor is a duplicate, however old it is; earlier ones are late then") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
  for (int64_t k = 4; k < 20; ++k) bench.sweep(50 * k, {0, 1});  // the driver of sensor 2 repeats its last scan
  for (int64_t k = 20; k < 40; ++k) {
    CHECK(bench.scan(2, 152) == IntakeResult::kDuplicate);
    bench.sweep(50 * k, {0, 1});
  }
  CHECK(bench.scan(2, 102) == IntakeResult::kLate);
  CHECK(bench.assembler.clock_jumps() == 0);
}

TEST_CASE("frame_assembler: after a gap of all sensors the first frame has them all, in any order of arrival") {
  for (const std::vector<int32_t>& order : {std::vector<int32_t>{0, 1, 2}, {2, 1, 0}, {1, 2, 0}}) {
    AssemblerBench bench;
    for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
    bench.sweep_after_gap(350, order);  // 200 ms after the last one
    REQUIRE(bench.count() == 5);
    CHECK(bench.last().mask == 7);
    CHECK(bench.last().flags == 0);
    for (int64_t k = 0; k < 5; ++k) bench.sweep_after_gap(450 + 100 * k, order);  // slower than frame.period_s
    REQUIRE(bench.count() == 10);
    for (std::size_t k = 5; k < 10; ++k) CHECK(bench.runner.closed[k].mask == 7);
  }
}

TEST_CASE("frame_assembler: after a gap of all sensors a frame does not wait for one that was silent before") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 4; ++k) bench.sweep(50 * k);
  for (int64_t k = 4; k < 8; ++k) bench.sweep(50 * k, {0, 1});
  CHECK(bench.count() == 8);
  bench.sweep_after_gap(600, {1, 0});
  REQUIRE(bench.count() == 9);
  CHECK(bench.last().mask == 3);
  CHECK(bench.scan(2, 601) == IntakeResult::kUsed);  // a frame of its own: the next one has it
  bench.sweep(650, {0, 1, 2});
  CHECK(bench.last().mask == 7);
  // One that does not come back after the gap is waited for once.
  bench.sweep_after_gap(900, {0, 1});
  const std::size_t before = bench.count();
  bench.sweep(950, {0, 1});
  CHECK(bench.count() == before + 2);
  bench.sweep(1000, {0, 1});
  CHECK(bench.count() == before + 3);
}

TEST_CASE("frame_assembler: after a gap of over a second the third consistent stamp restarts the clock") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 3; ++k) bench.sweep(50 * k);
  for (int64_t k = 0; k < 2; ++k)
    for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 5000 + 50 * k + s) == IntakeResult::kLate);
  CHECK(bench.count() == 3);
  bench.sweep(5100);
  REQUIRE(bench.count() == 4);
  CHECK(bench.last().mask == 7);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.assembler.take_settled().late_before_jump == 6);  // they belong to the new clock
  bench.sweep(5150);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) == 0);
}

TEST_CASE("frame_assembler: a source alone may be slower than 1 Hz: after one restart of the clock all is used") {
  for (const bool pushed : {false, true}) {
    for (const int64_t interval_ms : {950, 1100, 2000, 5000}) {
      CAPTURE(pushed);
      CAPTURE(interval_ms);
      AssemblerBench bench(pushed ? 0 : 1);
      int64_t ms = 0;
      const auto offer = [&](int64_t step_ms) {
        ms += step_ms;
        return pushed ? bench.external(ms) : bench.scan(0, ms);
      };
      int32_t refused = 0;
      for (int64_t k = 0; k < 20; ++k) refused += offer(interval_ms + 20 * (k % 3)) != IntakeResult::kUsed;
      CHECK(refused == (interval_ms > 1000 ? 2 : 0));
      CHECK(bench.assembler.clock_jumps() == (interval_ms > 1000 ? 1 : 0));
      CHECK(bench.assembler.take_settled().late_before_jump == (pushed ? 0 : refused));
      if (interval_ms < 1000) continue;
      CHECK(offer(2 * interval_ms) == IntakeResult::kUsed);  // one was lost
      CHECK(offer(4 * interval_ms) == IntakeResult::kLate);
    }
  }
}

TEST_CASE("frame_assembler: a source alone whose intervals are longer than 10 s, or of any length, is not its clock") {
  for (const std::vector<int64_t>& steps : {std::vector<int64_t>{11'000}, {1100, 2300}, {3000, 9000, 1200}}) {
    AssemblerBench bench(0);
    CHECK(bench.external(0) == IntakeResult::kUsed);
    int64_t ms = 0;
    for (std::size_t k = 0; k < 20; ++k) CHECK(bench.external(ms += steps[k % steps.size()]) == IntakeResult::kLate);
    CHECK(bench.assembler.clock_jumps() == 0);
  }
}

TEST_CASE("frame_assembler: held scans that belong to the new clock after a jump count as dropped") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 3; ++k) bench.sweep(50 * k);
  CHECK(bench.scan(0, 1000) == IntakeResult::kHeld);  // less than a second ahead: the others may follow
  CHECK(bench.scan(0, 1050) == IntakeResult::kHeld);
  CHECK(bench.scan(0, 1150) == IntakeResult::kUsed);  // the third that agrees, and no other sensor was heard meanwhile
  CHECK(bench.assembler.clock_jumps() == 1);
  const Settled settled = bench.assembler.take_settled();
  CHECK(settled.late == 2);
  CHECK(settled.late_before_jump == 2);
  CHECK(settled.used == 0);
}

TEST_CASE(
    "frame_assembler: a clock that went back is accepted at the third stamp; the two before it count as dropped") {
  AssemblerBench bench;
  bench.sweep(100'000);
  for (int64_t k = 0; k < 2; ++k)
    for (const int32_t s : {0, 1, 2}) CHECK(bench.scan(s, 50 * k + s) == IntakeResult::kLate);
  bench.sweep(100);
  CHECK((bench.last().flags & OVT_FLAG_CLOCK_JUMP) != 0);
  CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
  CHECK(bench.assembler.take_settled().late_before_jump == 6);
  CHECK(bench.assembler.take_settled().late_before_jump == 0);
}

TEST_CASE("frame_assembler: one sensor's bad clock cannot move the others, two of three can") {
  AssemblerBench bench;
  bench.sweep(0);
  for (int64_t k = 1; k < 10; ++k) {
    CHECK(bench.scan(0, 50 * k) == IntakeResult::kUsed);
    CHECK(bench.scan(1, 50 * k + 1) == IntakeResult::kUsed);
    CHECK(bench.scan(2, 60'000 + 50 * k) == IntakeResult::kLate);
  }
  CHECK(bench.assembler.clock_jumps() == 0);
  for (int64_t k = 0; k < 3; ++k) {
    CHECK(bench.scan(0, 500 + 50 * k) == IntakeResult::kUsed);
    const IntakeResult before = k < 2 ? IntakeResult::kLate : IntakeResult::kUsed;
    const IntakeResult first = bench.scan(1, 60'500 + 50 * k);
    CHECK(first == before);
    if (k < 2) CHECK(bench.scan(2, 60'500 + 50 * k) == IntakeResult::kLate);
  }
  CHECK(bench.assembler.clock_jumps() == 1);
}

TEST_CASE("frame_assembler: inconsistent stamps do not change the clock") {
  AssemblerBench bench;
  bench.sweep(100'000);
  for (const int64_t ms : {10'000, 20'000, 30'000, 29'000, 28'000, 50'000, 52'000, 54'000})
    CHECK(bench.scan(0, ms) == IntakeResult::kLate);
  for (const int64_t ms : {200'000, 300'000, 400'000}) CHECK(bench.scan(0, ms) == IntakeResult::kLate);
  CHECK(bench.assembler.clock_jumps() == 0);
}

TEST_CASE("frame_assembler: a clock that is known to be wrong is not believed in a short gap of the others") {
  for (const int64_t ahead_ms : {200, 300, 490, 520, 700, 990, 1500})
    for (const int64_t lost : {1, 2, 4, 8})
      for (const bool is_radar : {false, true}) {
        CAPTURE(ahead_ms);
        CAPTURE(lost);
        CAPTURE(is_radar);
        AssemblerBench bench;
        for (int64_t k = 0; k < 60; ++k) {
          const bool is_gap = k >= 40 && k < 40 + lost;
          const int64_t wrong_ms = 50 * k + 1 + (k >= 20 ? ahead_ms : 0);
          if (is_radar)
            bench.external(wrong_ms);
          else
            bench.scan(1, wrong_ms);
          if (is_gap) continue;
          CHECK(bench.scan(0, 50 * k) == (k == 40 + lost ? IntakeResult::kHeld : IntakeResult::kUsed));
          CHECK(bench.scan(2, 50 * k + 2) == IntakeResult::kUsed);
        }
        CHECK(bench.assembler.take_settled().used == 1);  // the scan that was held after the gap
        CHECK(bench.assembler.clock_jumps() == 0);
        CHECK((bench.last().flags & OVT_FLAG_OUT_OF_SEQUENCE) == 0);
        CHECK((bench.last().mask & 5u) == 5u);
      }
}

TEST_CASE("frame_assembler: a clock that steps ahead by little more than allowed does not divide the others' frames") {
  for (const int64_t ahead_ms : {78, 90, 100, 110, 125, 150}) {
    std::array<int32_t, 3> order = {0, 1, 2};
    do {
      CAPTURE(ahead_ms);
      CAPTURE(order);
      AssemblerBench bench;
      int32_t refused = 0;
      for (int64_t k = 0; k < 60; ++k)
        for (const int32_t s : order) {
          const bool is_wrong = s == 1 && k >= 20;
          const IntakeResult result = bench.scan(s, 50 * k + (is_wrong ? ahead_ms : 0));
          CHECK((is_wrong || result == IntakeResult::kUsed));
          refused += is_wrong && result != IntakeResult::kUsed;
        }
      bench.assembler.flush();
      const auto together = std::count_if(bench.runner.closed.begin(), bench.runner.closed.end(),
                                          [](const ClosedFrame& frame) { return (frame.mask & 5u) == 5u; });
      CHECK(together == 60);
      CHECK(refused == 40);
      CHECK(bench.assembler.take_settled().used == 0);
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST_CASE("frame_assembler: after a gap of all sensors a sensor of another phase loses nothing, in any order") {
  for (const int64_t phase_ms : {10, 40, 49})
    for (const int64_t gap_ms : {100, 300, 900}) {
      std::array<int32_t, 3> order = {0, 1, 2};
      do {
        CAPTURE(phase_ms);
        CAPTURE(gap_ms);
        CAPTURE(order);
        AssemblerBench bench;
        int64_t used = 0;
        for (int64_t k = 0; k < 40; ++k)
          for (const int32_t s : order) {
            const int64_t ms = 50 * k + (k >= 20 ? gap_ms : 0) + (s == 1 ? phase_ms : 0);
            used += bench.scan(s, ms) == IntakeResult::kUsed;
          }
        bench.assembler.flush();
        CHECK(used + bench.assembler.take_settled().used == 120);
      } while (std::next_permutation(order.begin(), order.end()));
    }
}

TEST_CASE("frame_assembler: a sensor that is faster than the others by over a period loses nothing after a gap") {
  struct Arrival {
    int64_t ms;
    int32_t sensor;
    int64_t stamp_ms;
  };
  for (const int64_t faster_ms : {30, 60, 90})
    for (const int64_t lost : {1, 2, 7, 60}) {
      CAPTURE(faster_ms);
      CAPTURE(lost);
      std::vector<Arrival> arrivals;
      for (int64_t k = 0; k < 200; ++k)
        for (const int32_t s : {0, 1, 2}) {
          if (s == 1 && k >= 40 && k < 40 + lost) continue;
          arrivals.push_back({50 * k + (s == 1 ? 0 : faster_ms + s), s, 50 * k + s});
        }
      std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.ms < b.ms; });
      AssemblerBench bench;
      int64_t used = 0;
      for (const Arrival& a : arrivals) used += bench.scan(a.sensor, a.stamp_ms) == IntakeResult::kUsed;
      bench.assembler.flush();
      const auto settled = bench.assembler.take_settled();
      used += settled.used;
      // The flush refuses what is still held.
      CHECK(int64_t(arrivals.size()) - used == settled.late);
      CHECK(settled.late <= 1);
    }
}

TEST_CASE("frame_assembler: stamps at both ends of int64 work") {
  AssemblerBench bench;
  CHECK(bench.scan_ns(0, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.scan_ns(1, INT64_MAX) == IntakeResult::kHeld);  // one against one at the very start
  CHECK(bench.scan_ns(2, 0) == IntakeResult::kHeld);
  CHECK(bench.scan_ns(1, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.scan_ns(2, INT64_MIN) == IntakeResult::kUsed);
  CHECK(bench.assembler.take_settled().late == 2);
  for (const int64_t back : {2, 1}) CHECK(bench.scan_ns(0, INT64_MAX - back * kMs) == IntakeResult::kLate);
  CHECK(bench.scan_ns(0, INT64_MAX) ==
        IntakeResult::kUsed);  // the third that agrees, and no other sensor was heard meanwhile
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.scan_ns(2, INT64_MIN) == IntakeResult::kHeld);
  CHECK(bench.scan_ns(2, INT64_MAX) == IntakeResult::kUsed);
  CHECK(bench.assembler.advance(INT64_MIN));
  CHECK(bench.assembler.advance(INT64_MAX));
  bench.assembler.flush();
}
