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

namespace {

// A source's stamps: one each interval, which arrives at once and is wrong by offset_ns.
struct Feed {
  int32_t source;
  int64_t from_ns, until_ns, interval_ns, offset_ns;
};

struct Verdicts {
  int32_t jumps = 0;          // of the clock, after the first stamp
  int64_t last_jump_ns = 0;   // its time
  std::vector<int32_t> lost;  // stamps of each feed that are late or rejected; of detections also held ones
};

// The stamps of all feeds in the order of their arrival.
Verdicts classify(const std::vector<Feed>& feeds, int32_t sensor_count, int64_t period_ns) {
  struct Arrival {
    int64_t ns;
    std::size_t feed;
  };
  std::vector<Arrival> arrivals;
  for (std::size_t i = 0; i < feeds.size(); ++i)
    for (int64_t ns = feeds[i].from_ns; ns < feeds[i].until_ns; ns += feeds[i].interval_ns) arrivals.push_back({ns, i});
  std::stable_sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.ns < b.ns; });
  ClockWatch watch(sensor_count, period_ns, period_ns / 2);
  Verdicts out{.lost = std::vector<int32_t>(feeds.size())};
  for (const Arrival& arrival : arrivals) {
    const Feed& feed = feeds[arrival.feed];
    const StampVerdict verdict = watch.classify(feed.source, arrival.ns + feed.offset_ns);
    if (verdict == StampVerdict::kJump) ++out.jumps, out.last_jump_ns = arrival.ns;
    const bool is_held = verdict == StampVerdict::kHold && feed.source == ClockWatch::kExternal;
    out.lost[arrival.feed] += verdict == StampVerdict::kLate || is_held;
    const uint32_t rejected = watch.take_rejected();
    for (std::size_t i = 0; i < feeds.size(); ++i) out.lost[i] += int32_t(rejected >> feeds[i].source & 1u);
  }
  return out;
}

constexpr int64_t kSecond = 1'000 * kMs, kLidar = 50 * kMs;

}  // namespace

TEST_CASE("clock_watch: a wrong clock that delivers many stamps in each interval of the good sensors is not believed") {
  for (const int32_t right : {1, 3})
    for (const int64_t phase_ms : {0, 16})
      for (const int64_t hz : {10, 20, 30, 60, 100, 200, 300})
        for (const int64_t ahead_ms : {37'000, 900, 700, 600, 300, -600, -1'000, -1'500, -37'000})
          for (const int64_t start_ms : {7, 1'007})
            for (const bool is_sensor : {false, true}) {
              CAPTURE(right);
              CAPTURE(phase_ms);
              CAPTURE(hz);
              CAPTURE(ahead_ms);
              CAPTURE(start_ms);
              CAPTURE(is_sensor);
              std::vector<Feed> feeds;
              for (int32_t s = 0; s < right; ++s) feeds.push_back({s, phase_ms * s * kMs, 3 * kSecond, kLidar, 0});
              const int32_t source = is_sensor ? right : ClockWatch::kExternal;
              const int64_t from_ns = (start_ms + phase_ms * (right - 1)) * kMs;
              feeds.push_back({source, from_ns, 3 * kSecond, kSecond / hz, ahead_ms * kMs});
              const int64_t period_ns = is_sensor ? std::min(kLidar, kSecond / hz) : kLidar;
              const Verdicts out = classify(feeds, right + int32_t(is_sensor), period_ns);
              CHECK(out.jumps == 0);
              for (int32_t s = 0; s < right; ++s) CHECK(out.lost[std::size_t(s)] == 0);
            }
}

TEST_CASE("clock_watch: a fast source that comes back with a wrong clock is not believed") {
  for (const int64_t hz : {20, 60, 200})
    for (const int64_t pause_ms : {100, 500, 2'000})
      for (const int64_t ahead_ms : {37'000, 700, -1'000})
        for (const int32_t source : {1, ClockWatch::kExternal}) {
          CAPTURE(hz);
          CAPTURE(pause_ms);
          CAPTURE(ahead_ms);
          CAPTURE(source);
          const Verdicts out =
              classify({{0, 0, 6 * kSecond, kLidar, 0},
                        {source, 7 * kMs, 2 * kSecond, kSecond / hz, 0},
                        {source, 2 * kSecond + pause_ms * kMs, 6 * kSecond, kSecond / hz, ahead_ms * kMs}},
                       source == 1 ? 2 : 1, kLidar);
          CHECK(out.jumps == 0);
          CHECK(out.lost[0] == 0);
        }
}

TEST_CASE("clock_watch: a sensor that was silent for long takes the clock back from wrong detections, for good") {
  for (const int64_t hz : {20, 60, 100})
    for (const int64_t ahead_ms : {37'000, -37'000}) {
      CAPTURE(hz);
      CAPTURE(ahead_ms);
      const Verdicts out = classify({{0, 0, 3 * kSecond, kLidar, 0},
                                     {0, 5 * kSecond, 9 * kSecond, kLidar, 0},
                                     {ClockWatch::kExternal, 1'007 * kMs, 9 * kSecond, kSecond / hz, ahead_ms * kMs}},
                                    1, kLidar);
      CHECK(out.jumps == 2);
      CHECK(out.last_jump_ns == 5 * kSecond);
      CHECK(out.lost[1] == 0);
    }
}

TEST_CASE("clock_watch: sensors of any rate and phase overrule a wrong clock that had the first stamp") {
  for (const int32_t right : {2, 3, 4})
    for (const int64_t interval_ms : {50, 60, 100, 200, 400})
      for (const int64_t phase : {0, 1, 2, 3})
        for (const int64_t wrong_ms : {50, 100, 200, 400})
          for (const int64_t ahead_ms : {37'000, 1'500, 900, -700, -1'500, -37'000}) {
            CAPTURE(right);
            CAPTURE(interval_ms);
            CAPTURE(phase);
            CAPTURE(wrong_ms);
            CAPTURE(ahead_ms);
            std::vector<Feed> feeds = {{right, 0, 30 * kSecond, wrong_ms * kMs, ahead_ms * kMs}};
            for (int32_t s = 0; s < right; ++s)
              feeds.push_back({s, (5 + interval_ms * phase * s / 4) * kMs, 30 * kSecond, interval_ms * kMs, 0});
            const Verdicts out = classify(feeds, right + 1, kLidar);
            for (int32_t s = 0; s < right; ++s) CHECK(out.lost[std::size_t(s) + 1] <= 3);
          }
}

TEST_CASE("clock_watch: what overrules a wrong clock is no longer named as wrong") {
  ClockWatch watch(3, kLidar, kLidar / 2);
  bool is_overruled = false;
  for (int64_t ms = 0; ms <= 305; ms += 5) {  // two right sensors in turn each 100 ms, and before them one 0.7 s behind
    if (ms % 50 == 0) watch.classify(2, (ms - 700) * kMs);
    if (ms % 100 == 5) is_overruled = watch.classify(ms % 200 == 5 ? 0 : 1, ms * kMs) == StampVerdict::kGood;
    CHECK(is_overruled == (ms == 305));
    if (ms == 300) CHECK(watch.suspect_mask() == 3u);
  }
  CHECK(watch.suspect_mask() == 0u);
}

TEST_CASE("clock_watch: scans that are always longer on their way make no clock wrong, also where some are lost") {
  for (const auto& [interval_ms, late_interval_ms] : {std::pair{50, 50}, {50, 100}, {100, 50}, {25, 25}})
    for (const int64_t late_ms : {40, 60, 80, 120, 200})
      for (int64_t phase_ms = 0; phase_ms < late_interval_ms; phase_ms += 10)
        for (const int32_t lost : {0, 1, 3, 20})
          for (const int32_t late_sensors : {1, 2}) {
            const int64_t period_ms = std::min(interval_ms, late_interval_ms);
            if (late_sensors == 2 && 2 * late_ms > 3 * period_ms) continue;  // a majority against the first one
            CAPTURE(interval_ms);
            CAPTURE(late_interval_ms);
            CAPTURE(late_ms);
            CAPTURE(phase_ms);
            CAPTURE(lost);
            CAPTURE(late_sensors);
            const int64_t step_ns = interval_ms * kMs, gap_ns = 20 * step_ns;
            std::vector<Feed> feeds = {{0, 0, gap_ns, step_ns, 0},
                                       {0, gap_ns + lost * step_ns, gap_ns + 4 * kSecond, step_ns, 0}};
            for (int32_t s = 1; s <= late_sensors; ++s)
              feeds.push_back(
                  {s, (phase_ms + late_ms) * kMs, gap_ns + 4 * kSecond, late_interval_ms * kMs, -late_ms * kMs});
            const Verdicts verdicts = classify(feeds, 1 + late_sensors, period_ms * kMs);
            CHECK(verdicts.jumps == 0);
            const int32_t most = late_sensors == 1 ? 0 : 8;  // of 60 and more
            CHECK(verdicts.lost[0] <= most);
            CHECK(verdicts.lost[1] <= most);
            for (std::size_t i = 2; i < feeds.size(); ++i) CHECK(verdicts.lost[i] == 0);
          }
}

TEST_CASE("clock_watch: a sensor whose stamps are held until the others come near them keeps its lead") {
  // The scans of the two others take 100 ms longer on their way.
  for (const int64_t lost : {0, 1, 5}) {
    CAPTURE(lost);
    const int64_t gap_ns = 20 * kLidar, end_ns = 20 * kSecond;
    const Verdicts verdicts = classify({{0, 0, gap_ns, kLidar, 0},
                                        {0, gap_ns + lost * kLidar, end_ns, kLidar, 0},
                                        {1, 120 * kMs, end_ns, kLidar, -100 * kMs},
                                        {2, 125 * kMs, end_ns, kLidar, -100 * kMs}},
                                       3, kLidar);
    CHECK(verdicts.jumps == 0);
    for (const int32_t n : verdicts.lost) CHECK(n == 0);
  }
}

TEST_CASE("clock_watch: when all sensors stop, detections go on at any rate; those of a new source wait for 24") {
  for (const int64_t hz : {2, 5, 10, 13, 20, 30, 60, 100})
    for (int64_t phase = 0; phase < 4; ++phase) {
      CAPTURE(hz);
      CAPTURE(phase);
      const auto lost = [&](int64_t from_ns) {
        return classify({{0, 0, 3 * kSecond + phase * kLidar, kLidar, 0},
                         {ClockWatch::kExternal, from_ns, 30 * kSecond, kSecond / hz, 0}},
                        1, kLidar)
            .lost[1];
      };
      CHECK(lost(7 * kMs) <= 2);
      CHECK(lost(10 * kSecond) == 24);
    }
}

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

TEST_CASE("frame_assembler: a jump takes back the late scans of its new clock, not those of a third one") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 100; ++k) bench.sweep(50 * k);
  for (int64_t k = 100; k < 120; ++k) {  // the clock of sensor 2 is 10 s ahead
    bench.sweep(50 * k, {0, 1});
    CHECK(bench.scan(2, 50 * k + 10'000) != IntakeResult::kUsed);
  }
  bench.assembler.take_settled();
  for (int64_t k = 0; k < 3; ++k)  // those of 0 and 1 go back by 4 s
    for (const int32_t s : {0, 1}) bench.scan(s, 2010 + 50 * k + s);
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.assembler.take_settled().late_before_jump == 4);
}

TEST_CASE("frame_assembler: rows that were held when the clock stepped back become no frame later") {
  AssemblerBench bench;
  for (int64_t k = 0; k < 800; ++k) bench.sweep(50 * k);
  for (int64_t k = 0; k < 2; ++k) {  // two of three go back by 30 s
    for (const int32_t s : {0, 1}) CHECK(bench.scan(s, 10010 + 50 * k + s) == IntakeResult::kLate);
    CHECK(bench.scan(2, 40002 + 50 * k) == IntakeResult::kUsed);
  }
  CHECK(bench.external(40135) == IntakeResult::kHeld);
  for (int64_t k = 2; k < 700; ++k) {
    for (const int32_t s : {0, 1, 2}) bench.scan(s, 10010 + 50 * k + s);
    for (const ClosedFrame& frame : bench.runner.closed) REQUIRE(frame.kind == FrameKind::kScans);
    bench.runner.closed.clear();
  }
  CHECK(bench.assembler.clock_jumps() == 1);
  CHECK(bench.assembler.take_settled().external_dropped == 1);
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
  for (const int32_t s : {0, 1, 2}) CHECK(bench.scan_ns(s, INT64_MIN + 50 * kMs) == IntakeResult::kUsed);
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

TEST_CASE("frame_assembler: a step back by half of int64 is no interval of a slow source") {
  AssemblerBench bench(1);
  CHECK(bench.scan_ns(0, 4'000'000'000'000'000'000) == IntakeResult::kUsed);
  const int64_t back_ns = 4'000'000'000'000'000'000 + INT64_MIN / 2 - 1, slow_ns = 5 * kSecond;
  for (int64_t k = 0; k < 3; ++k) CHECK(bench.scan_ns(0, back_ns + k * slow_ns) == IntakeResult::kLate);
  CHECK(bench.scan_ns(0, back_ns + 3 * slow_ns) == IntakeResult::kUsed);  // the third of equal steps
}
