// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Lost, doubled and late pieces are counted and flagged, and what an incomplete scan does not show is not free.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/detector.h"
#include "tests/support/frame_rules.h"
#include "tests/support/one_sensor_detector.h"
#include "tests/support/small_scene.h"
#include "tests/support/stream_bench.h"

using namespace overtake::test;

namespace {

int64_t sum_of_pieces(const ovt_stats& s) { return s.pieces_used + s.pieces_dup + s.pieces_late + s.pieces_dropped; }

}  // namespace

TEST_CASE("stream: a lost piece leaves a scan of the other points, flagged and counted") {
  const Range lost[] = {{0, 40}, {1000, 1300}, {1, 2}};
  for (const Range& gone : lost) {
    OneSensor whole, streamed;
    whole.create();
    streamed.create();
    const ovt_points points = streamed.points(0, 0);
    for (const Range& range : {Range{0, gone.first}, Range{gone.last, points.count}})
      REQUIRE(streamed.push_piece(points, range) == OVT_OK);
    REQUIRE(streamed.end(points) == OVT_OK);
    whole.push_without(0, gone);
    whole.flush();
    streamed.flush();
    REQUIRE(streamed.records.size() == 1);
    const ovt_frame_info& info = streamed.records[0].info;
    CHECK(same_segmentation(streamed.records[0], whole.records[0]));
    CHECK(info.point_count == points.count - (gone.last - gone.first));
    CHECK((info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0);
    CHECK(info.incomplete_mask == 1);
    CHECK(whole.records[0].info.incomplete_mask == 0);
    CHECK((whole.records[0].info.flags & OVT_FLAG_SCAN_INCOMPLETE) == 0);
    CHECK(streamed.stats().points_missing == gone.last - gone.first);
    CHECK(streamed.stats().scans_incomplete == 1);
    CHECK(streamed.stats().scans_unended == 0);
  }
}

TEST_CASE("stream: a lost last piece is noticed by the scan's number of points") {
  for (const bool with_count : {false, true}) {
    OneSensor bench;
    bench.create();
    const ovt_points points = bench.points(0, 0);
    REQUIRE(bench.push_piece(points, {0, points.count - 10}) == OVT_OK);
    CHECK(bench.end(points, points.count - 11) == OVT_BAD_ARGUMENT);  // a point beyond it came
    REQUIRE(bench.end(points, with_count ? points.count : -1) == OVT_OK);
    bench.flush();
    REQUIRE(bench.records.size() == 1);
    CHECK(((bench.records[0].info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0) == with_count);
    CHECK(bench.stats().points_missing == (with_count ? 10 : 0));
  }
}

TEST_CASE("stream: a doubled piece is refused as a whole and changes nothing") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  REQUIRE(streamed.push_piece(points, {0, 500}) == OVT_OK);
  REQUIRE(streamed.push_piece(points, {700, 900}) == OVT_OK);
  for (const Range& again : {Range{0, 500}, Range{499, 600}, Range{600, 701}, Range{899, 950}, Range{600, 1000}})
    CHECK(streamed.push_piece(points, again) == OVT_DUPLICATE);
  REQUIRE(streamed.push_piece(points, {500, 700}) == OVT_OK);
  REQUIRE(streamed.push_piece(points, {900, points.count}) == OVT_OK);
  REQUIRE(streamed.end(points, points.count) == OVT_OK);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  const ovt_stats stats = streamed.stats();
  CHECK(stats.pieces_dup == 5);
  CHECK(stats.pieces_used == 4);
  CHECK(stats.pieces == sum_of_pieces(stats));
}

TEST_CASE("stream: a piece of a scan that ended is late and changes nothing") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  int64_t late = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const ovt_points points = streamed.points(k, 0);
    REQUIRE(streamed.push_piece(points, {0, 1000}) == OVT_OK);
    for (std::size_t earlier = 0; earlier < k; ++earlier, ++late)
      CHECK(streamed.push_piece(streamed.points(earlier, 0), {0, 100}) == OVT_LATE);
    ovt_points lost = points;  // of a scan whose other pieces are all lost
    lost.stamp_ns -= 7 * kMs;
    CHECK(streamed.push_piece(lost, {0, 100}) == OVT_LATE);
    CHECK(streamed.end(lost) == OVT_LATE);
    ++late;
    REQUIRE(streamed.push_piece(points, {1000, points.count}) == OVT_OK);
    REQUIRE(streamed.end(points) == OVT_OK);
    CHECK(streamed.push_piece(points, {0, 1000}) == OVT_LATE);
    CHECK(streamed.end(points) == OVT_LATE);
    ++late;
    whole.push_without(k, {0, 0});
  }
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  CHECK(streamed.stats().pieces_late == late);
  CHECK(streamed.stats().pieces == sum_of_pieces(streamed.stats()));
  CHECK(streamed.stats().pushed == 3);
}

TEST_CASE("stream: a scan beyond the capacity is dropped as a whole, as one push of it") {
  OneSensor bench;
  bench.sensors[0].point_capacity = 1000;
  bench.create();
  const ovt_points points = bench.points(0, 0), next = bench.points(1, 0);
  REQUIRE(bench.push_piece(points, {0, 999}) == OVT_OK);
  CHECK(bench.push_piece(points, {999, 1001}) == OVT_TOO_MANY);
  CHECK(bench.push_piece(points, {999, 1000}) == OVT_TOO_MANY);
  CHECK(bench.end(points) == OVT_TOO_MANY);
  CHECK(bench.push_piece(points, {0, 1}) == OVT_LATE);
  REQUIRE(bench.push_piece(next, {0, 1000}) == OVT_OK);
  REQUIRE(bench.end(next) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  CHECK(bench.records[0].info.point_count == 1000);
  const ovt_stats stats = bench.stats();
  CHECK(stats.pieces_dropped == 2);
  CHECK(stats.dropped == 1);
  CHECK(stats.pushed == 2);
  CHECK(stats.scans_incomplete == 0);
  CHECK(stats.pieces == sum_of_pieces(stats));
}

TEST_CASE("stream: a piece without points is never beyond the capacity") {
  OneSensor bench;
  bench.sensors[0].point_capacity = 1000;
  bench.create();
  const ovt_points points = bench.points(0, 0);
  REQUIRE(bench.push_piece(points, {0, 1000}) == OVT_OK);
  CHECK(bench.push_piece(points, {1001, 1001}) == OVT_OK);
  CHECK(bench.end(points, 1000) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  CHECK(bench.records[0].info.point_count == 1000);
  CHECK(bench.stats().scans_incomplete == 0);
}

TEST_CASE("stream: an end without pieces is an empty scan, and incomplete if points were sent") {
  OneSensor bench;
  bench.create();
  const ovt_points a = bench.points(0, 0), b = bench.points(1, 0);
  REQUIRE(bench.end(a, 0) == OVT_OK);
  REQUIRE(bench.end(b, 77) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 2);
  CHECK(bench.records[0].info.incomplete_mask == 0);
  CHECK((bench.records[0].info.flags & OVT_FLAG_NO_DATA) != 0);
  CHECK(bench.records[1].info.incomplete_mask == 1);
  CHECK(bench.stats().points_missing == 77);
}

TEST_CASE("stream: a whole scan of the stamp that is open is a duplicate, and the open scan goes on") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  REQUIRE(streamed.push_piece(points, {0, 1000}) == OVT_OK);
  CHECK(ovt_push_scan(streamed.detector, &points) == OVT_DUPLICATE);
  REQUIRE(streamed.push_piece(points, {1000, points.count}) == OVT_OK);
  REQUIRE(streamed.end(points) == OVT_OK);
  CHECK(ovt_push_scan(streamed.detector, &points) == OVT_DUPLICATE);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
  CHECK(streamed.stats().dup == 2);
  CHECK(adds_up(streamed.stats()));
}

TEST_CASE("stream: bad arguments change nothing") {
  OneSensor bench;
  bench.create();
  const ovt_points points = bench.points(0, 0);
  const auto push = [&](auto change) {
    ovt_points piece = piece_of(points, 0, 100);
    change(piece);
    return ovt_push_points(bench.detector, &piece);
  };
  CHECK(ovt_push_points(nullptr, &points) == OVT_BAD_ARGUMENT);
  CHECK(ovt_push_points(bench.detector, nullptr) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.first = -2; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.sensor = 1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.count = -1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.x.type = OVT_NONE; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.z.size_bytes = 4 * 100 - 1; }) == OVT_BAD_ARGUMENT);
  CHECK(push([](ovt_points& p) { p.struct_size = 8; }) == OVT_BAD_VERSION);
  CHECK(ovt_end_scan(nullptr, 0, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, 1, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, -1, 0, -1) == OVT_BAD_ARGUMENT);
  CHECK(ovt_end_scan(bench.detector, 0, 0, -2) == OVT_BAD_ARGUMENT);
  CHECK(bench.stats().pieces == 0);
  CHECK(bench.stats().pushed == 0);
  // Of a caller's header without `first`: its pieces follow one another.
  CHECK(push([](ovt_points& p) { p.first = 5, p.struct_size = offsetof(ovt_points, first); }) == OVT_OK);
  REQUIRE(bench.end(points) == OVT_OK);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  CHECK(bench.records[0].info.point_count == 100);
  CHECK(bench.records[0].info.incomplete_mask == 0);
}

TEST_CASE("stream: pieces may differ in the types of their fields") {
  OneSensor whole, streamed;
  whole.create();
  streamed.create();
  const ovt_points points = streamed.points(0, 0);
  std::vector<double> x;
  std::vector<int32_t> layer;
  for (const float v : thin_scan(0, 0).x_m) x.push_back(double(v));
  for (const uint16_t v : thin_scan(0, 0).layer) layer.push_back(v);
  ovt_points other = points;
  other.x = column_of(x, OVT_F64);
  other.layer = column_of(layer, OVT_I32);
  for (int32_t first = 0; first < points.count; first += 333) {
    const Range range = {first, std::min(first + 333, points.count)};
    REQUIRE(streamed.push_piece(first % 2 ? other : points, range) == OVT_OK);
  }
  REQUIRE(streamed.end(points) == OVT_OK);
  whole.push_without(0, {0, 0});
  whole.flush();
  streamed.flush();
  CHECK(streamed.records == whole.records);
}

TEST_CASE("stream: the newest scan wins, and an open scan replaces nothing") {
  struct Block {
    std::atomic<bool> inside{false}, go{false};
  } block;
  Thin bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  bench.def.sensor_count = 1;
  bench.def.frames_in_flight = 1;
  bench.create();
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook(overtake::TestHook{[](void* user, overtake::HookPoint at, overtake::Frame&, int32_t) {
                                      auto& b = *static_cast<Block*>(user);
                                      if (at != overtake::HookPoint::kTrack) return;
                                      b.inside.store(true);
                                      while (!b.go.load()) std::this_thread::yield();
                                    },
                                    &block});
  const auto stream_scan = [&](std::size_t k, bool ends) {
    const ovt_points points = bench.points(k, 0);
    REQUIRE(bench.push_piece(points, {0, 1000}) == OVT_OK);
    REQUIRE(bench.push_piece(points, {1000, points.count}) == OVT_OK);
    if (ends) REQUIRE(bench.end(points) == OVT_OK);
  };
  stream_scan(0, true);
  while (!block.inside.load()) std::this_thread::yield();
  // Both frame slots are taken with scan 1; scan 2 waits in the mailbox.
  stream_scan(1, true);
  while (bench.stats().used < 2) std::this_thread::yield();
  stream_scan(2, true);
  const int64_t dropped = bench.stats().dropped;
  stream_scan(3, false);
  CHECK(bench.stats().dropped == dropped);
  REQUIRE(bench.end(bench.points(3, 0)) == OVT_OK);
  block.go.store(true);
  bench.flush();
  CHECK(bench.stats().dropped == dropped + 1);
  CHECK(bench.stats().used == 3);
  CHECK(adds_up(bench.stats()));
}

TEST_CASE("stream: three producers in pieces, with other threads that close their scans, lose no scan") {
  Thin bench({.workers = 2, .push_policy = OVT_PUSH_WAIT, .record = false});
  bench.params.frame_scan_limit = 1;
  bench.create();
  std::atomic<int64_t> scans{0}, ends_late{0};
  std::atomic<bool> stop{false};
  std::vector<std::thread> producers;
  for (int32_t s = 0; s < 3; ++s)
    producers.emplace_back([&, s] {
      std::mt19937_64 random(uint64_t(s) + 1);
      for (int64_t k = 0; k < 60; ++k) {
        ovt_points points = bench.points(std::size_t(k) % kFrames, s);
        points.stamp_ns = 1000 * kMs + k * 50 * kMs + s;
        for (const Range& range : cut_randomly(points.count, random)) {
          const ovt_status status = bench.push_piece(points, range);
          if (status != OVT_OK && status != OVT_LATE) std::abort();
        }
        scans.fetch_add(1);
        if (bench.end(points) == OVT_LATE) ends_late.fetch_add(1);
      }
    });
  std::thread clock([&] {
    for (int64_t now = 1000 * kMs; !stop.load(); now += 5 * kMs) ovt_advance(bench.detector, now);
  });
  for (std::thread& producer : producers) producer.join();
  stop.store(true);
  clock.join();
  bench.flush();
  const ovt_stats stats = bench.stats();
  CHECK(stats.pushed == scans.load());
  CHECK(stats.scans_unended == ends_late.load());
  CHECK(stats.pieces == sum_of_pieces(stats));
  CHECK(adds_up(stats));
}

TEST_CASE("stream: two threads that push scans of one sensor at the same time are told, and once the log is") {
  Thin bench({.workers = 2, .record = false});
  static std::atomic<int32_t> lines;
  lines = 0;
  bench.def.log = [](ovt_log_level, const char* text, void*) {
    if (std::strstr(text, "two threads push scans of one sensor")) ++lines;
  };
  bench.create();
  const ovt_points points = bench.points(0, 0);
  // One thread stays in its call: its mailbox is full, and the intake waits in a hook.
  struct Block {
    std::atomic<bool> go{false};
  } block;
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_gather_hook(
          [](void* user) {
            while (!static_cast<Block*>(user)->go.load()) std::this_thread::yield();
          },
          &block);
  std::atomic<int32_t> pushed{0}, refused{0};
  std::thread producer([&] {
    ovt_points scan = points;
    for (int32_t k = 0; k < 4; ++k, ++scan.stamp_ns) {
      if (ovt_push_scan(bench.detector, &scan) == OVT_WRONG_THREAD) refused.fetch_add(1);
      pushed.fetch_add(1);
    }
  });
  ovt_status status = OVT_OK;
  ovt_points other = points;
  other.stamp_ns += 100;
  for (int64_t until = overtake::steady_now_ns() + 5'000 * kMs; overtake::steady_now_ns() < until;) {
    if (pushed.load() < 1) continue;
    status = bench.push_piece(other, {0, 0});
    if (status == OVT_WRONG_THREAD) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(status == OVT_WRONG_THREAD);
  CHECK(lines == 1);
  CHECK(bench.push_piece(other, {0, 0}) == OVT_WRONG_THREAD);
  block.go.store(true);
  producer.join();
  CHECK(lines == 1);
  CHECK(bench.stats().refused == refused.load() + 2);
}

TEST_CASE("stream: what an incomplete scan does not show is not free: no track misses there") {
  for (int32_t i = 0; i < 4; ++i) {
    const bool incomplete = i % 2;
    const char* const preset = i < 2 ? "paper" : "best";
    CAPTURE(incomplete);
    CAPTURE(std::string(preset));
    ovt_params params;
    REQUIRE(ovt_params_init(&params, sizeof params, preset) == OVT_OK);
    params.tracker_confirm_hits = 3;
    params.tracker_keep_hits = 2;
    Small small;
    small.sensor.z_m = 1.2;
    small.def.params = &params;
    struct Seen {
      std::vector<uint32_t> flags;
      std::vector<int32_t> state;
      ovt_frame_info info{};
      const char* broken = nullptr;
    } seen;
    small.def.user = &seen;
    small.def.on_frame = [](ovt_reader* reader, void* user) {
      auto& s = *static_cast<Seen*>(user);
      ovt_tracks t;
      ovt_read_info(reader, &s.info);
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      s.flags.assign(t.flags, t.flags + t.count);
      s.state.assign(t.state, t.state + t.count);
      if (const char* broken = find_broken_rule(reader, 1, false, {OVT_AT_FRAME_STAMP})) s.broken = broken;
    };
    small.create();
    const int32_t count = look(20.0);
    for (int32_t k = 0; k < 12; ++k) {
      ovt_points points;
      ovt_points_init(&points, sizeof points);
      points.stamp_ns = 50 * kMs * k;
      points.count = count;
      points.x = OVT_FIELD(cloud, count, x, OVT_F32);
      points.y = OVT_FIELD(cloud, count, y, OVT_F32);
      points.z = OVT_FIELD(cloud, count, z, OVT_F32);
      points.layer = OVT_FIELD(cloud, count, layer, OVT_U16);
      // The last scans end, or not, after the first hundred points.
      const ovt_points piece = piece_of(points, 0, k < 8 ? count : 100);
      REQUIRE(ovt_push_points(small.detector, &piece) == OVT_OK);
      REQUIRE(ovt_end_scan(small.detector, 0, points.stamp_ns, incomplete ? count : -1) == OVT_OK);
    }
    REQUIRE(ovt_flush(small.detector) == OVT_OK);
    CHECK(seen.broken == nullptr);
    REQUIRE(!seen.flags.empty());
    for (const uint32_t flags : seen.flags) {
      CHECK((flags & OVT_TRACK_COASTING) != 0);
      CHECK(((flags & OVT_TRACK_UNOBSERVED) != 0) == incomplete);
    }
    CHECK(((seen.info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0) == incomplete);
  }
}
