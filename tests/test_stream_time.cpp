// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which stamps and times end a scan in pieces, and which do not.
#include <doctest/doctest.h>

#include <vector>

#include "pipeline/detector.h"
#include "tests/support/frame_rules.h"
#include "tests/support/stream_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kStart_ms = 10'000;

struct Three : Thin {
  Three() : Thin({.record = false}) { create(); }
  ovt_points at(int32_t sensor, int64_t ms) const {
    ovt_points points = this->points(0, sensor);
    points.stamp_ns = ms * kMs;
    return points;
  }
  ovt_status whole(int32_t sensor, int64_t ms) {
    const ovt_points points = at(sensor, ms);
    return ovt_push_scan(detector, &points);
  }
  ovt_status part(int32_t sensor, int64_t ms, int32_t number, int32_t parts = 2) {
    const ovt_points points = at(sensor, ms);
    return push_piece(points, {points.count * number / parts, points.count * (number + 1) / parts});
  }
  ovt_status finish(int32_t sensor, int64_t ms) { return end(at(sensor, ms), at(sensor, ms).count); }
};

}  // namespace

TEST_CASE("stream: a scan that starts before the last one ended closes it as incomplete") {
  for (const bool by_piece : {true, false}) {
    OneSensor bench;
    bench.create();
    const ovt_points first = bench.points(0, 0), second = bench.points(1, 0);
    REQUIRE(bench.push_piece(first, {0, 2000}) == OVT_OK);
    CHECK(bench.stats().pushed == 0);
    if (by_piece) {
      REQUIRE(bench.push_piece(second, {0, second.count}) == OVT_OK);
      CHECK(bench.stats().pushed == 1);
      REQUIRE(bench.end(second) == OVT_OK);
    } else {
      REQUIRE(ovt_push_scan(bench.detector, &second) == OVT_OK);
    }
    CHECK(bench.push_piece(first, {2000, 2100}) == OVT_LATE);
    bench.flush();
    REQUIRE(bench.records.size() == 2);
    CHECK(bench.records[0].info.incomplete_mask == 1);
    CHECK(bench.records[0].info.point_count == 2000);
    CHECK(bench.records[1].info.incomplete_mask == 0);
    CHECK(bench.records[1].info.point_count == second.count);
    CHECK(bench.stats().scans_unended == 1);
    CHECK(adds_up(bench.stats()));
  }
}

TEST_CASE("stream: the stamps of a slow sensor close a scan that does not end, too") {
  Thin bench({});
  bench.params.frame_period_s = 2;
  bench.create();
  ovt_points dead = bench.points(0, 1), other = bench.points(0, 0);
  dead.stamp_ns = 1000 * kMs;
  REQUIRE(bench.push_piece(dead, {0, 2500}) == OVT_OK);
  for (int64_t k = 0; k < 5; ++k) {
    other.stamp_ns = 1000 * kMs + k * 2000 * kMs;
    REQUIRE(ovt_push_scan(bench.detector, &other) == OVT_OK);
    CHECK(bench.stats().scans_unended == (k >= 3));  // frame.scan_limit: 3 periods
  }
}

TEST_CASE("stream: a clock that went back over a second opens a new scan") {
  OneSensor bench;
  bench.create();
  ovt_points points = bench.points(0, 0);
  points.stamp_ns = 10'000 * kMs;
  REQUIRE(bench.push_piece(points, {0, 100}) == OVT_OK);
  points.stamp_ns = 9'000 * kMs;
  CHECK(bench.push_piece(points, {0, 100}) == OVT_LATE);
  points.stamp_ns -= 1;
  CHECK(bench.push_piece(points, {0, 100}) == OVT_OK);
  CHECK(bench.stats().scans_unended == 1);
}

TEST_CASE("stream: ovt_advance closes a scan that does not end, by its stamp") {
  for (const int32_t workers : {1, 2}) {
    for (const double limit_s : {0.15, 0.05, 0.0}) {
      OneSensor bench(workers);
      bench.params.frame_scan_limit = limit_s / bench.params.frame_period_s;
      bench.create();
      const ovt_points points = bench.points(0, 0);
      REQUIRE(bench.push_piece(points, {0, 3000}) == OVT_OK);
      const int64_t limit_ns = int64_t(limit_s * 1e9);
      REQUIRE(ovt_advance(bench.detector, points.stamp_ns + limit_ns - 1) == OVT_OK);
      CHECK(bench.stats().scans_unended == 0);
      REQUIRE(ovt_advance(bench.detector, points.stamp_ns + (limit_ns > 0 ? limit_ns : 5000 * kMs)) == OVT_OK);
      CHECK(bench.stats().scans_unended == (limit_ns > 0));
      CHECK(bench.push_piece(points, {3000, 3100}) == (limit_ns > 0 ? OVT_LATE : OVT_OK));
      bench.flush();
      REQUIRE(!bench.records.empty());
      CHECK(bench.records[0].info.incomplete_mask == 1);  // ovt_flush closes a scan without a limit
      CHECK(bench.records[0].info.point_count == (limit_ns > 0 ? 3000 : 3100));
      CHECK(bench.stats().scans_unended == 1);
      CHECK(adds_up(bench.stats()));
    }
  }
}

TEST_CASE("stream: the stamps of other sensors close a scan that does not end, the same with any workers") {
  std::vector<FrameRecord> expected;
  for (const int32_t workers : {1, 2, 4}) {
    Thin bench({.workers = workers});
    bench.create();
    const ovt_points dead = bench.points(0, 1);
    for (int32_t s : {0, 2}) {
      const ovt_points points = bench.points(0, s);
      REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
    }
    REQUIRE(bench.push_piece(dead, {0, 2500}) == OVT_OK);
    for (std::size_t k = 1; k < kFrames; ++k) {
      bench.push_ego(k);
      for (int32_t s : {0, 2}) {
        const ovt_points points = bench.points(k, s);
        REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
        // Scans come every 50 ms: 150 ms have passed with the third of them.
        CHECK(bench.stats().scans_unended == (k >= 3));
      }
    }
    CHECK(bench.push_piece(dead, {2500, 2600}) == OVT_LATE);
    bench.flush();
    if (workers == 1) expected = bench.records;
    CHECK(bench.records == expected);
    int32_t incomplete = 0;
    for (const FrameRecord& record : bench.records)
      if (record.info.incomplete_mask == 2) {
        ++incomplete;
        CHECK(record.info.point_count == 2500);
        CHECK(record.info.stamp_ns == dead.stamp_ns);
      }
    CHECK(incomplete == 1);
    CHECK(adds_up(bench.stats()));
  }
}

TEST_CASE("stream: another sensor's wrong clock does not close a scan") {
  Thin bench({.workers = 1});
  bench.create();
  const ovt_points open = bench.points(0, 0);
  ovt_points other = bench.points(0, 1);
  REQUIRE(bench.push_piece(open, {0, 1000}) == OVT_OK);
  // Wrong stamps; then late scans, which are no progress of time.
  for (const int64_t stamp_ms : {100'000, 500'000, 20, 400'000, 10, 70, 15, 75, 20, 80, 25, 85, 30, 90}) {
    other.stamp_ns = stamp_ms * kMs;
    REQUIRE(ovt_push_scan(bench.detector, &other) == OVT_OK);
  }
  CHECK(bench.stats().scans_unended == 0);
  CHECK(bench.push_piece(open, {1000, open.count}) == OVT_OK);
}

TEST_CASE("stream: one step of a slow sensor, or of one that comes back, closes no scan that has just begun") {
  for (const int64_t step : {2, 3, 4, 8, 19, 20}) {  // periods of sensor 0
    CAPTURE(step);
    Three bench;
    for (int64_t k = 0; k < 80; ++k) {
      const int64_t ms = kStart_ms + 50 * k;
      for (const int32_t s : {1, 2}) CHECK(bench.part(s, ms + s, 0) == OVT_OK);
      if (k % step == 0) CHECK(bench.whole(0, ms) == OVT_OK);
      for (const int32_t s : {1, 2}) {
        CHECK(bench.part(s, ms + s, 1) == OVT_OK);
        CHECK(bench.finish(s, ms + s) == OVT_OK);
      }
    }
    bench.flush();
    CHECK(bench.stats().scans_incomplete == 0);
    CHECK(bench.stats().used == 160 + (80 + step - 1) / step);
  }
}

TEST_CASE("stream: after a pause of all sensors no scan is closed by the first end of another") {
  for (const int64_t pause : {2, 4, 15, 30}) {  // periods
    CAPTURE(pause);
    Three bench;
    for (int64_t k = 0; k < 20; ++k) {
      const int64_t ms = kStart_ms + 50 * (k < 10 ? k : k + pause);
      for (const int32_t part : {0, 1})
        for (const int32_t s : {0, 1, 2}) CHECK(bench.part(s, ms + s, part) == OVT_OK);
      for (const int32_t s : {0, 1, 2}) CHECK(bench.finish(s, ms + s) == OVT_OK);
    }
    bench.flush();
    CHECK(bench.stats().scans_incomplete == 0);
  }
}

TEST_CASE("stream: one wrong stamp of another sensor closes no scan") {
  for (const int64_t ahead_ms : {60, 120, 200, 300, 900, 1100, 10'000}) {
    CAPTURE(ahead_ms);
    Three bench;
    for (int64_t k = 0; k < 40; ++k) {
      const int64_t ms = kStart_ms + 50 * k;
      for (const int32_t s : {1, 2}) CHECK(bench.part(s, ms + s, 0) == OVT_OK);
      CHECK(bench.whole(0, ms + (k == 20 ? ahead_ms : 0)) == OVT_OK);
      for (const int32_t s : {1, 2}) {
        CHECK(bench.part(s, ms + s, 1) == OVT_OK);
        CHECK(bench.finish(s, ms + s) == OVT_OK);
      }
    }
    bench.flush();
    CHECK(bench.stats().scans_incomplete == 0);
    CHECK(bench.stats().used >= 117);
  }
}

TEST_CASE("stream: a slow sensor has three of its own intervals for a scan, from the second scan on") {
  for (const int64_t interval_ms : {100, 150, 200, 500}) {
    CAPTURE(interval_ms);
    Three bench;
    const int64_t scans = 10, steps = interval_ms / 50;
    for (int64_t k = 0; k < scans; ++k)
      for (int64_t i = 0; i < steps; ++i) {
        const int64_t ms = kStart_ms + interval_ms * k;
        CHECK(bench.whole(0, ms + 50 * i) == OVT_OK);
        const ovt_status status = bench.part(1, ms + 1, int32_t(i), int32_t(steps));
        CHECK((k < 1 || status == OVT_OK));
        if (i + 1 == steps) CHECK((bench.finish(1, ms + 1) == OVT_OK || k < 1));
      }
    CHECK(bench.stats().scans_unended <= 1);
    CHECK(bench.stats().scans_unended >= (interval_ms > 200 ? 1 : 0));
    // One that ends no more is closed all the same.
    const int64_t unended = bench.stats().scans_unended, last_ms = kStart_ms + interval_ms * scans;
    CHECK(bench.part(1, last_ms + 1, 0) == OVT_OK);
    for (int64_t ms = 0; ms <= 4 * interval_ms; ms += 50) {
      CHECK(bench.whole(0, last_ms + ms) == OVT_OK);
      if (ms < 2 * interval_ms) CHECK(bench.stats().scans_unended == unended);
    }
    CHECK(bench.stats().scans_unended == unended + 1);
  }
}

TEST_CASE("stream: a piece with a stamp ahead does not blind its sensor") {
  for (const int64_t ahead_ms : {160, 300, 600, 950, 1500}) {
    CAPTURE(ahead_ms);
    OneSensor bench;
    bench.create();
    const auto at = [&](int64_t ms) {
      ovt_points points = bench.points(0, 0);
      points.stamp_ns = ms * kMs;
      return points;
    };
    constexpr int32_t kParts = 4, kScans = 60;
    int64_t late = 0;
    for (int64_t k = 0; k < kScans; ++k) {
      const int64_t ms = kStart_ms + 50 * k;
      for (int32_t part = 0; part < kParts; ++part) {
        const ovt_points points = at(ms + (k == 30 && part == 2 ? ahead_ms : 0));
        const int32_t n = points.count;
        late += bench.push_piece(points, {n * part / kParts, n * (part + 1) / kParts}) == OVT_LATE;
      }
      CHECK((bench.end(at(ms), at(ms).count) == OVT_OK || k == 30));
    }
    bench.flush();
    CHECK(late == 1);  // the piece behind the wrong one
    CHECK(bench.stats().scans_unended == 2);
    CHECK(bench.stats().used >= kScans - 1);  // the cut scan with half its points; the wrong one where it is plausible
    CHECK(adds_up(bench.stats()));
  }
}

TEST_CASE("stream: pieces of two clocks by turns leave the scans of the later one whole") {
  OneSensor bench;
  bench.create();
  ovt_points early = bench.points(0, 0), later = early;
  for (int64_t k = -10; k < 0; ++k) {  // first the earlier one alone
    early.stamp_ns = (kStart_ms + 50 * k) * kMs;
    CHECK(bench.push_piece(early, {0, early.count}) == OVT_OK);
    CHECK(bench.end(early, early.count) == OVT_OK);
  }
  for (int64_t i = 0; i < 4 * 40; ++i) {
    // The earlier clock's scans begin in the middle of the other one's.
    early.stamp_ns = (kStart_ms + 50 * ((i + 2) / 4)) * kMs;
    later.stamp_ns = (kStart_ms + 50 * (i / 4) + 500) * kMs;
    const auto range_of = [&](int64_t part) {
      return Range{int32_t(later.count * part / 4), int32_t(later.count * (part + 1) / 4)};
    };
    bench.push_piece(later, range_of(i % 4));
    bench.push_piece(early, range_of((i + 2) % 4));
    if (i % 4 == 3) bench.end(later, later.count);
  }
  CHECK(bench.stats().scans_incomplete <= 5);
  CHECK(bench.stats().pushed - bench.stats().scans_incomplete >= 10 + 38);
}

TEST_CASE("stream: a scan after lost ones is not given up for a piece of one of them") {
  for (const int64_t lost : {1, 2}) {
    OneSensor bench;
    bench.create();
    ovt_points points = bench.points(0, 0);
    const auto push = [&](int64_t ms, const Range& range) {
      points.stamp_ns = ms * kMs;
      return bench.push_piece(points, range);
    };
    for (int64_t k = 0; k < 10; ++k) {
      CHECK(push(kStart_ms + 50 * k, {0, points.count}) == OVT_OK);
      CHECK(bench.end(points, points.count) == OVT_OK);
    }
    const int64_t next_ms = kStart_ms + 50 * (10 + lost);
    CHECK(push(next_ms, {0, 100}) == OVT_OK);
    CHECK(push(next_ms - 50 * lost, {0, 100}) == OVT_LATE);
    CHECK(push(next_ms, {100, points.count}) == OVT_OK);
    CHECK(bench.end(points, points.count) == OVT_OK);
    CHECK(bench.stats().scans_incomplete == 0);
  }
}

TEST_CASE("stream: a scan that was given up is forgotten, however many ended before it") {
  for (const int64_t before : {7, 8, 9, 16}) {
    CAPTURE(before);
    OneSensor bench;
    bench.create();
    ovt_points points = bench.points(0, 0);
    const auto push = [&](int64_t scan, const Range& range) {
      points.stamp_ns = (kStart_ms + 50 * scan) * kMs;
      return bench.push_piece(points, range);
    };
    for (int64_t k = 0; k < before; ++k) {
      CHECK(push(k, {0, points.count}) == OVT_OK);
      CHECK(bench.end(points, points.count) == OVT_OK);
    }
    CHECK(push(before + 4, {0, 100}) == OVT_OK);                               // ahead: a wrong stamp
    CHECK(push(before, {0, 100}) == OVT_OK);                                   // which this piece gives up
    CHECK(push(before - std::min<int64_t>(before, 8), {0, 100}) == OVT_LATE);  // the eighth that ended before
    CHECK(push(before + 4, {0, points.count}) == OVT_OK);
    CHECK(bench.end(points, points.count) == OVT_OK);
    CHECK(bench.stats().scans_unended == 2);
  }
}
