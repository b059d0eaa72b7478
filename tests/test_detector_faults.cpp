// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Faults below the C API: exceptions, deadlines, hanging frames, older callers.
#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <vector>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"

using namespace overtake::test;
using overtake::HookPoint;
using overtake::TestHook;

namespace {

constexpr int64_t kMs = 1'000'000;

void set_hook(DetectorBench& bench, void (*call)(void*, HookPoint, overtake::Frame&, int32_t), void* user) {
  reinterpret_cast<overtake::Detector*>(bench.detector)->set_hook(TestHook{call, user});
}

void sleep_ms(int64_t ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

}  // namespace

TEST_CASE("detector faults: an exception in any stage is caught and counted, and the next frame is unaffected") {
  DetectorBench good({.workers = 1});
  good.create();
  for (std::size_t k = 0; k < 6; ++k) good.push_frame(k);
  good.flush();

  struct Fault {
    HookPoint body;
    int32_t sensor;
    int64_t stamp_ns;  // stamp of the frame's first scan, and of that sensor's scan
  };
  for (const int32_t workers : {1, 2})
    for (const HookPoint body : {HookPoint::kSegment, HookPoint::kDetect, HookPoint::kTrack, HookPoint::kFinish}) {
      CAPTURE(workers);
      CAPTURE(int32_t(body));
      const Fault fault{body, body == HookPoint::kSegment ? 0 : -1, demo_frame(2).stamp_ns};
      DetectorBench bench({.workers = workers});
      bench.create();
      set_hook(
          bench,
          [](void* user, HookPoint at, overtake::Frame& frame, int32_t sensor) {
            const auto& f = *static_cast<const Fault*>(user);
            if (at != f.body || sensor != f.sensor) return;
            // A segmentation starts while other scans still join the frame: it may read only its own stamp.
            const int64_t stamp_ns = sensor >= 0 ? frame.sensors[sensor].stamp_ns : frame.first_stamp_ns;
            if (stamp_ns == f.stamp_ns) throw std::runtime_error("injected");
          },
          const_cast<Fault*>(&fault));
      for (std::size_t k = 0; k < 6; ++k) bench.push_frame(k);
      bench.flush();
      CHECK(bench.stats().exceptions == 1);
      CHECK(adds_up(bench.stats()));
      REQUIRE(bench.records.size() == 6);
      for (std::size_t k = 0; k < 6; ++k) {
        CAPTURE(k);
        CHECK(bench.records[k].info.sequence == int64_t(k));
        if (k != 2) CHECK(bench.records[k].detections == good.records[k].detections);
      }
      const ovt_frame_info& faulty = bench.records[2].info;
      const bool known = body != HookPoint::kFinish;
      for (std::size_t k = 0; k < 6; ++k)
        CHECK(((bench.records[k].info.flags & OVT_FLAG_EXCEPTION) != 0) == (known && k == 2));
      CHECK(faulty.sensor_mask == (body == HookPoint::kSegment ? 6u : 7u));
      CHECK(((faulty.flags & OVT_FLAG_SENSOR_MISSING) != 0) == (body == HookPoint::kSegment));
      if (body == HookPoint::kSegment) CHECK(bench.records[2].detections != good.records[2].detections);
      if (body == HookPoint::kDetect) CHECK(faulty.detection_count == 0);
      CHECK(faulty.track_count > 0);  // predicted, without new information
    }
}

TEST_CASE("detector faults: a scan whose segmentation threw publishes no result of any stage") {
  for (const int32_t workers : {1, 2})
    for (const HookPoint body : {HookPoint::kSegment, HookPoint::kSegmented}) {
      CAPTURE(workers);
      CAPTURE(int32_t(body));
      DetectorBench bench({.workers = workers, .record = false});
      struct Seen {
        HookPoint body;
        int64_t stamp_ns;
        std::vector<ovt_status> labels, images, others;
      } seen{body, demo_frame(1).stamp_ns, {}, {}, {}};
      bench.def.user = &seen;
      bench.def.on_frame = [](ovt_reader* reader, void* user) {
        auto& s = *static_cast<Seen*>(user);
        ovt_labels labels;
        ovt_image image;
        s.labels.push_back(ovt_read_labels(reader, 1, &labels));
        s.images.push_back(ovt_read_image(reader, 1, OVT_IMAGE_LABELS, &image));
        s.others.push_back(ovt_read_labels(reader, 0, &labels));
      };
      bench.create();
      set_hook(
          bench,
          [](void* user, HookPoint at, overtake::Frame& frame, int32_t sensor) {
            const auto& s = *static_cast<const Seen*>(user);
            if (at == s.body && sensor == 1 && frame.sensors[1].stamp_ns == s.stamp_ns)
              throw std::runtime_error("injected");
          },
          &seen);
      for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
      bench.flush();
      const std::vector<ovt_status> all(3, OVT_OK), but_one = {OVT_OK, OVT_NO_FRAME, OVT_OK};
      CHECK(seen.labels == but_one);
      CHECK(seen.images == but_one);
      CHECK(seen.others == all);
    }
}

TEST_CASE("detector faults: when detection threw, tracks are predicted and none counts a miss") {
  for (const int32_t workers : {1, 2}) {
    DetectorBench bench({.workers = workers, .record = false});
    struct Seen {
      std::vector<std::vector<int32_t>> age;
      std::vector<int64_t> stamp_ns;
    } seen;
    bench.def.user = &seen;
    bench.def.on_frame = [](ovt_reader* reader, void* user) {
      ovt_tracks t;
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      static_cast<Seen*>(user)->age.emplace_back(t.age, t.age + t.count);
      static_cast<Seen*>(user)->stamp_ns.push_back(t.publish_ns);
    };
    bench.create();
    set_hook(
        bench,
        [](void*, HookPoint at, overtake::Frame& frame, int32_t) {
          if (at == HookPoint::kDetect && frame.sequence == 3) throw std::runtime_error("injected");
        },
        nullptr);
    for (std::size_t k = 0; k < 5; ++k) bench.push_frame(k);
    bench.flush();
    REQUIRE(seen.age.size() == 5);
    REQUIRE(!seen.age[2].empty());
    CHECK(seen.age[3] == seen.age[2]);
    CHECK(seen.stamp_ns[3] == demo_frame(3).stamp_ns);
    CHECK(seen.age[4] != seen.age[3]);
  }
}

TEST_CASE("detector faults: a frame beyond its deadline is published with a flag and counted") {
  for (const int32_t workers : {1, 2}) {
    DetectorBench bench({.workers = workers});
    bench.def.deadline_ns = 10'000 * kMs;
    bench.create();
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
    bench.flush();
    CHECK(bench.stats().deadline_missed == 0);
    bench.destroy();

    bench.records.clear();
    bench.def.deadline_ns = 20 * kMs;
    bench.create();
    set_hook(
        bench,
        [](void*, HookPoint at, overtake::Frame& frame, int32_t) {
          if (at == HookPoint::kTrack && frame.sequence == 1) sleep_ms(25);
        },
        nullptr);
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k), bench.flush();
    REQUIRE(bench.records.size() == 3);
    CHECK((bench.records[1].info.flags & OVT_FLAG_DEADLINE_MISSED) != 0);
    CHECK(bench.stats().deadline_missed >= 1);  // a busy machine may miss more
  }
}

TEST_CASE("detector faults: the watchdog reports a hanging frame once, and all continues after it") {
  DetectorBench bench({.workers = 2});
  static std::atomic<int32_t> told;
  told = 0;
  bench.def.watchdog_ns = 400 * kMs;
  bench.def.log = [](ovt_log_level level, const char* text, void*) {
    if (level == OVT_LOG_ERROR && std::strstr(text, "watchdog")) ++told;
  };
  bench.create();
  std::atomic<bool> released{false};
  set_hook(
      bench,
      [](void* user, HookPoint at, overtake::Frame& frame, int32_t) {
        auto& go_on = *static_cast<std::atomic<bool>*>(user);
        while (at == HookPoint::kTrack && frame.sequence == 1 && !go_on) sleep_ms(1);
      },
      &released);
  bench.push_frame(0);
  bench.flush();
  bench.push_frame(1);
  // A busy machine may begin the frame late. Each call runs the watchdog.
  for (int32_t i = 0; i < 1000 && bench.stats().stalled == 0; ++i) {
    sleep_ms(20);
    ovt_advance(bench.detector, 0);
  }
  CHECK(bench.stats().in_flight >= 1);
  for (int32_t i = 0; i < 2; ++i) {
    bench.push_scan(2, i);  // the frame stays open
    sleep_ms(20);
  }
  CHECK(bench.stats().stalled == 1);
  CHECK(told == 1);
  released = true;
  bench.flush();
  CHECK(bench.stats().in_flight == 0);
  CHECK(bench.records.size() == 3);
}

TEST_CASE("detector faults: an older caller's structs are read and filled up to their size only") {
  DetectorBench bench({.workers = 1});
  bench.def.struct_size = offsetof(ovt_detector_def, cpus);
  bench.def.cpus = reinterpret_cast<const int32_t*>(std::uintptr_t(1));  // must not be read

  bench.def.cpu_count = 12345;
  bench.def.fifo_priority = -7;
  bench.create();
  bench.push_frame(0);
  bench.flush();
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);

  const auto check = [](auto&& call, auto& out, std::size_t older, std::size_t first_unknown) {
    std::memset(static_cast<void*>(&out), 0x5a, sizeof out);
    CHECK(call(&out, older - 8) == OVT_BAD_VERSION);
    CHECK(call(&out, sizeof out + 8) == OVT_BAD_VERSION);
    CHECK(call(&out, older + 1) == OVT_BAD_VERSION);
    const auto* bytes = reinterpret_cast<const unsigned char*>(&out);
    const auto untouched = [&](std::size_t from) {
      return std::all_of(bytes + from, bytes + sizeof out, [](unsigned char b) { return b == 0x5a; });
    };
    CHECK(untouched(0));
    CHECK(call(&out, older) == OVT_OK);
    CHECK(untouched(first_unknown));
    CHECK_FALSE(untouched(0));
  };
  ovt_frame_info info;
  std::size_t first = offsetof(ovt_frame_info, refiltered);
  check([&](auto* out, std::size_t size) { return ovt_next_frame_sized(reader, out, size); }, info, first, first);
  check([&](auto* out, std::size_t size) { return ovt_read_info_sized(reader, out, size); }, info, first, first);
  ovt_tracks tracks;
  first = offsetof(ovt_tracks, flags);
  check([&](auto* out, std::size_t size) { return ovt_read_tracks_sized(reader, OVT_AT_FRAME_STAMP, out, size); },
        tracks, first, first);
  ovt_stats stats;
  std::memset(&stats, 0x5a, sizeof stats);
  stats.struct_size = offsetof(ovt_stats, in_flight);
  CHECK(ovt_read_stats(bench.detector, &stats) == OVT_OK);
  CHECK(stats.used == 3);
  CHECK(stats.in_flight == 0x5a5a5a5a5a5a5a5a);
  ovt_destroy_reader(reader);

  std::memset(&stats, 0x5a, sizeof stats);
  CHECK(ovt_stats_init(&stats, offsetof(ovt_stats, in_flight)) == OVT_OK);
  CHECK(stats.struct_size == offsetof(ovt_stats, in_flight));
  CHECK(stats.used == 0);
  CHECK(stats.in_flight == 0x5a5a5a5a5a5a5a5a);
  CHECK(ovt_stats_init(&stats, 4) == OVT_BAD_VERSION);
  ovt_detector_def def;
  std::memset(static_cast<void*>(&def), 0x5a, sizeof def);
  CHECK(ovt_detector_def_init(&def, offsetof(ovt_detector_def, cpus)) == OVT_OK);
  CHECK(def.struct_size == offsetof(ovt_detector_def, cpus));
  CHECK(def.cpu_count == 0x5a5a5a5a);
}
