// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Calls from several threads, from on_frame, and in an order: what comes first is used first.
#include <doctest/doctest.h>
#include <oneapi/tbb/task_group.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"
#include "tests/support/detector_log.h"
#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;
using overtake::HookPoint;
using overtake::TestHook;

TEST_CASE("detector threads: with worker_count 1 a second thread during a call is refused and changes nothing") {
  DetectorBench bench({.workers = 1, .record = false});
  Log log;
  keep_log(bench, log);
  bench.create();
  bench.push_frame(0);
  struct Meeting {
    std::atomic<bool> inside{false}, done{false};
  } meeting;
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook(TestHook{[](void* user, HookPoint at, overtake::Frame&, int32_t) {
                            auto& m = *static_cast<Meeting*>(user);
                            if (at != HookPoint::kTrack) return;
                            m.inside.store(true);
                            while (!m.done.load()) std::this_thread::yield();
                          },
                          &meeting});
  std::thread pusher([&] { bench.push_frame(1); });
  while (!meeting.inside.load()) std::this_thread::yield();
  const ovt_stats before = bench.stats();
  ovt_external_detections none;
  ovt_external_detections_init(&none, sizeof none);
  CHECK(bench.push_scan(2, 0) == OVT_WRONG_THREAD);
  CHECK(ovt_push_detections(bench.detector, &none) == OVT_WRONG_THREAD);
  CHECK(ovt_advance(bench.detector, INT64_MAX) == OVT_WRONG_THREAD);
  CHECK(ovt_flush(bench.detector) == OVT_WRONG_THREAD);
  CHECK(bench.stats().pushed == before.pushed);
  CHECK(bench.stats().refused == before.refused + 4);
  meeting.done.store(true);
  pusher.join();
  CHECK(log.holds("a second thread"));
  CHECK(bench.push_scan(2, 0) == OVT_OK);  // one after the other is allowed
  bench.flush();
  CHECK(bench.stats().frames == 3);
  CHECK(bench.stats().refused == 4);
  CHECK(adds_up(bench.stats()));
}

TEST_CASE("detector threads: with worker_count 1 a callback that pushes is refused") {
  DetectorBench bench({.workers = 1, .record = false});
  struct Call {
    DetectorBench* bench;
    ovt_status status = OVT_OK;
  } call{&bench};
  bench.def.user = &call;
  bench.def.on_frame = [](ovt_reader*, void* user) {
    auto& c = *static_cast<Call*>(user);
    c.status = ovt_advance(c.bench->detector, 0);
  };
  bench.create();
  bench.push_frame(0);
  CHECK(call.status == OVT_WRONG_THREAD);
}

TEST_CASE("detector threads: with any worker_count, calls that would wait for on_frame are refused in it") {
  for (const int32_t workers : {1, 2}) {
    for (const int32_t policy : {OVT_PUSH_WAIT, OVT_PUSH_REPLACE}) {
      CAPTURE(workers);
      DetectorBench bench({.workers = workers, .push_policy = policy, .record = false});
      struct Call {
        DetectorBench* bench;
        ovt_status flush = OVT_OK, advance = OVT_OK, scan = OVT_OK, detections = OVT_OK, other = OVT_INTERNAL;
        ovt_detector* elsewhere = nullptr;
      } call{&bench};
      DetectorBench elsewhere({.workers = 1, .record = false});
      elsewhere.create();
      call.elsewhere = elsewhere.detector;
      bench.def.user = &call;
      bench.def.on_frame = [](ovt_reader*, void* user) {
        auto& c = *static_cast<Call*>(user);
        ovt_external_detections none;
        ovt_external_detections_init(&none, sizeof none);
        c.flush = ovt_flush(c.bench->detector);
        c.advance = ovt_advance(c.bench->detector, 0);
        c.scan = c.bench->push_scan(1, 0);
        c.detections = ovt_push_detections(c.bench->detector, &none);
        c.other = ovt_flush(c.elsewhere);
      };
      (void)demo_frame(1);  // made before there are threads
      bench.create();
      bench.push_frame(0);
      bench.flush();
      for (const ovt_status status : {call.flush, call.advance, call.scan, call.detections})
        CHECK(status == OVT_WRONG_THREAD);
      CHECK(call.other == OVT_OK);  // another detector is not affected
      CHECK(bench.stats().pushed == 3);
      CHECK(bench.stats().refused == 4);
      CHECK(elsewhere.stats().refused == 0);
      CHECK(bench.push_scan(1, 0) == OVT_OK);
      bench.destroy();  // finishes that frame, too, before `call` ends
    }
  }
}

namespace {

// Holds the intake, once armed, where it has looked for scans, until it may go on.
struct Meeting {
  explicit Meeting(overtake::Detector& detector) {
    detector.set_gather_hook(
        [](void* user) {
          auto& m = *static_cast<Meeting*>(user);
          if (!m.armed.exchange(false)) return;
          m.looked.store(true);
          while (!m.go_on.load()) std::this_thread::yield();
        },
        this);
  }
  std::atomic<bool> armed{false}, looked{false}, go_on{false};
};

}  // namespace

TEST_CASE("detector threads: a flush waits for a scan pushed just after the intake has looked") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE});
  bench.create();
  auto& detector = *reinterpret_cast<overtake::Detector*>(bench.detector);
  Meeting meeting(detector);
  detector.set_hook(TestHook{[](void* user, HookPoint at, overtake::Frame& frame, int32_t) {
                               auto& m = *static_cast<Meeting*>(user);
                               if (at == HookPoint::kTrack && frame.sequence == 0) m.armed.store(true);
                             },
                             &meeting});
  bench.push_frame(0);  // its end wakes the intake, which then finds nothing
  while (!meeting.looked.load()) std::this_thread::yield();
  while (bench.stats().frames < 1) std::this_thread::yield();
  REQUIRE(bench.push_scan(1, 0) == OVT_OK);
  std::thread flusher([&] { ovt_flush(bench.detector); });
  while (detector.flushes_asked() == 0) std::this_thread::yield();
  meeting.go_on.store(true);
  flusher.join();
  CHECK(bench.records.size() == 2);  // only the flush closes the frame of that scan
}

TEST_CASE("detector threads: a prediction uses the poses that were pushed before ovt_advance") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE});
  bench.create();
  auto& detector = *reinterpret_cast<overtake::Detector*>(bench.detector);
  Meeting meeting(detector);
  bench.push_frame(0);
  bench.flush();
  REQUIRE(bench.records.size() == 1);
  const int64_t stamp_ns = bench.records[0].info.stamp_ns;
  meeting.armed.store(true);
  REQUIRE(ovt_advance(bench.detector, INT64_MIN) == OVT_OK);  // wakes the intake, and predicts nothing
  while (!meeting.looked.load()) std::this_thread::yield();
  REQUIRE(ovt_advance(bench.detector, stamp_ns + 200'000'000) == OVT_OK);
  ovt_ego_pose pose;
  REQUIRE(ovt_ego_pose_init(&pose, sizeof pose) == OVT_OK);
  pose.stamp_ns = stamp_ns + 60'000'000;
  pose.x_m = 12345;
  CHECK(ovt_push_ego_pose(bench.detector, &pose) == OVT_OK);
  meeting.go_on.store(true);
  while (bench.stats().frames < 2) std::this_thread::yield();
  bench.destroy();
  REQUIRE(bench.records.size() >= 2);
  for (std::size_t k = 1; k < bench.records.size(); ++k) {
    CHECK((bench.records[k].info.flags & OVT_FLAG_PREDICTION) != 0);
    CHECK(bench.records[k].info.ego_x_m < 10000);
  }
}

TEST_CASE("detector threads: flush and advance come before a scan that is pushed after them") {
  for (const bool flushes : {true, false}) {
    CAPTURE(flushes);
    DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE});
    bench.create();
    auto& detector = *reinterpret_cast<overtake::Detector*>(bench.detector);
    Meeting meeting(detector);
    meeting.armed.store(true);
    REQUIRE(bench.push_scan(0, 0) == OVT_OK);  // opens a frame that waits for the other sensors
    while (!meeting.looked.load()) std::this_thread::yield();
    std::thread flusher;
    if (flushes) {
      flusher = std::thread([&] { ovt_flush(bench.detector); });
      while (detector.flushes_asked() == 0) std::this_thread::yield();
    } else {
      REQUIRE(ovt_advance(bench.detector, demo_frame(0).stamp_ns + 100'000'000) == OVT_OK);
    }
    REQUIRE(bench.push_scan(0, 1) == OVT_OK);  // would have joined that frame
    meeting.go_on.store(true);
    if (flushes) flusher.join();
    bench.flush();
    std::vector<uint32_t> masks;
    for (const FrameRecord& record : bench.records)
      if ((record.info.flags & OVT_FLAG_PREDICTION) == 0) masks.push_back(record.info.sensor_mask);
    CHECK(masks == std::vector<uint32_t>{1, 2});
  }
}

TEST_CASE("detector threads: destroy finishes the frames of all that was pushed, with any worker_count") {
  for (const int32_t workers : {1, 2, 4})
    for (const int32_t policy : {OVT_PUSH_WAIT, OVT_PUSH_REPLACE}) {
      CAPTURE(workers);
      CAPTURE(policy);
      DetectorBench bench({.workers = workers, .push_policy = policy});
      bench.create();
      ovt_reader* reader = nullptr;
      REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
      bench.push_frame(0);
      bench.flush();
      REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);         // holds that frame, also while destroy runs
      const std::size_t whole = policy == OVT_PUSH_WAIT ? 5 : 1;  // OVT_PUSH_REPLACE may drop scans
      for (std::size_t k = 1; k < whole; ++k) bench.push_frame(k);
      REQUIRE(bench.push_scan(whole, 0) == OVT_OK);  // waits for the other sensors
      bench.destroy();
      std::vector<uint32_t> masks;
      for (const FrameRecord& record : bench.records) masks.push_back(record.info.sensor_mask);
      std::vector<uint32_t> expected(whole, 7);
      expected.push_back(1);
      CHECK(masks == expected);
      ovt_destroy_reader(reader);
    }
}

TEST_CASE("detector threads: flush returns while frames take longer than their scans take to come") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE});
  bench.create();
  auto& detector = *reinterpret_cast<overtake::Detector*>(bench.detector);
  detector.set_hook(TestHook{[](void*, HookPoint at, overtake::Frame&, int32_t) {
                               if (at == HookPoint::kTrack) std::this_thread::sleep_for(std::chrono::milliseconds(6));
                             },
                             nullptr});
  constexpr int64_t kMostFrames = 100;
  std::atomic<bool> returned{false}, gave_up{false};
  std::vector<std::thread> producers;
  for (int32_t sensor = 0; sensor < 3; ++sensor)
    producers.emplace_back([&, sensor] {
      for (int32_t k = 0; !returned.load() && !gave_up.load(); ++k) {
        ovt_points empty = ovt_default_points();
        empty.x.type = empty.y.type = empty.z.type = OVT_F32, empty.layer.type = OVT_I32;
        empty.sensor = sensor;
        empty.stamp_ns = int64_t(k) * 50'000'000 + sensor;
        ovt_push_scan(bench.detector, &empty);
        ovt_stats stats = ovt_default_stats();
        if (ovt_read_stats(bench.detector, &stats) == OVT_OK && stats.frames >= kMostFrames) gave_up.store(true);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  while (bench.stats().frames < 5) std::this_thread::yield();
  CHECK(ovt_flush(bench.detector) == OVT_OK);
  CHECK_FALSE(gave_up.load());
  returned.store(true);
  for (std::thread& producer : producers) producer.join();
}

TEST_CASE("detector threads: a later ovt_advance replaces an earlier one as a whole") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE});
  bench.create();
  auto& detector = *reinterpret_cast<overtake::Detector*>(bench.detector);
  Meeting meeting(detector);
  const int64_t stamp_ns = demo_frame(0).stamp_ns;
  const auto advance = [&](int64_t ms) { REQUIRE(ovt_advance(bench.detector, stamp_ns + ms * 1'000'000) == OVT_OK); };
  SUBCASE("what is pushed between them comes before the later one") {
    REQUIRE(bench.push_scan(0, 0) == OVT_OK);  // opens a frame that waits for the other sensors
    while (bench.stats().used < 1) std::this_thread::yield();
    meeting.armed.store(true);
    advance(10);
    while (!meeting.looked.load()) std::this_thread::yield();
    REQUIRE(bench.push_scan(0, 1) == OVT_OK);
    advance(100);
    meeting.go_on.store(true);
    bench.flush();
    REQUIRE(bench.records.size() >= 1);
    CHECK(bench.records[0].info.sensor_mask == 3);
  }
  SUBCASE("its time is used once") {
    bench.push_frame(0);
    bench.flush();
    meeting.armed.store(true);
    advance(10);
    while (!meeting.looked.load()) std::this_thread::yield();
    advance(200);
    meeting.go_on.store(true);
    bench.flush();
    CHECK(bench.records.size() == 2);
  }
}

TEST_CASE("detector threads: a call that another detector's on_frame makes from on_frame is refused, too") {
  DetectorBench outer({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  DetectorBench inner({.workers = 1, .record = false});
  struct Calls {
    DetectorBench *outer, *inner;
    ovt_status push = OVT_INTERNAL, advance = OVT_INTERNAL;
  } calls{&outer, &inner};
  outer.def.user = inner.def.user = &calls;
  outer.def.on_frame = [](ovt_reader*, void* user) {
    auto& c = *static_cast<Calls*>(user);
    c.push = c.inner->push_scan(0, 0);
    ovt_flush(c.inner->detector);
  };
  inner.def.on_frame = [](ovt_reader*, void* user) {
    auto& c = *static_cast<Calls*>(user);
    c.advance = ovt_advance(c.outer->detector, 0);  // ovt_flush would wait for the outer on_frame
  };
  (void)demo_frame(0);
  inner.create();
  outer.create();
  outer.push_frame(0);
  outer.flush();
  CHECK(calls.push == OVT_OK);
  CHECK(calls.advance == OVT_WRONG_THREAD);
  CHECK(outer.stats().refused == 1);
}

namespace {
thread_local bool is_in_on_frame = false;
}

TEST_CASE("detector threads: an on_frame that waits for tasks of its own runs no stage meanwhile") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  struct Scene {
    std::atomic<bool> began{false}, pushed{false}, is_nested{false}, first{true};
  } scene;
  bench.def.user = &scene;
  bench.def.on_frame = [](ovt_reader*, void* user) {
    auto& s = *static_cast<Scene*>(user);
    if (!s.first.exchange(false)) return;
    is_in_on_frame = true;
    const auto patience = [] { return std::chrono::steady_clock::now() + std::chrono::seconds(5); };
    oneapi::tbb::task_group group;
    group.run([&s, patience] {
      s.began.store(true);
      for (const auto end = patience(); !s.pushed.load() && std::chrono::steady_clock::now() < end;)
        std::this_thread::yield();
      for (const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
           !s.is_nested.load() && std::chrono::steady_clock::now() < end;)
        std::this_thread::yield();
    });
    for (const auto end = patience(); !s.began.load() && std::chrono::steady_clock::now() < end;)
      std::this_thread::yield();  // the other worker takes the task
    group.wait();
    is_in_on_frame = false;
  };
  (void)demo_frame(1);
  bench.create();
  reinterpret_cast<overtake::Detector*>(bench.detector)
      ->set_hook(TestHook{[](void* user, HookPoint at, overtake::Frame&, int32_t) {
                            if (at == HookPoint::kSegment && is_in_on_frame)
                              static_cast<Scene*>(user)->is_nested.store(true);
                          },
                          &scene});
  bench.push_frame(0);
  while (!scene.began.load()) std::this_thread::yield();
  REQUIRE(bench.push_scan(1, 0) == OVT_OK);
  scene.pushed.store(true);
  bench.flush();
  CHECK_FALSE(scene.is_nested.load());
  CHECK(bench.stats().frames == 2);
  bench.destroy();
}

TEST_CASE("detector threads: a replay uses the same ego poses with any worker_count, however many lie between scans") {
  for (const int32_t between : {50, 250, 400, 900}) {
    std::vector<std::vector<double>> places;
    for (const int32_t workers : {1, 2, 3}) {
      Small small(1, workers);
      std::vector<double> x_m;
      small.def.user = &x_m;
      small.def.on_frame = [](ovt_reader* reader, void* user) {
        ovt_frame_info info;
        ovt_read_info(reader, &info);
        static_cast<std::vector<double>*>(user)->push_back(info.ego_known ? info.ego_x_m : -1);
      };
      small.create();
      const Posts posts(1);
      int64_t stamp_ns = 0;
      for (int32_t k = 0; k < 40; ++k) {
        for (int32_t i = 0; i < between; ++i) {
          ovt_ego_pose pose;
          REQUIRE(ovt_ego_pose_init(&pose, sizeof pose) == OVT_OK);
          pose.stamp_ns = stamp_ns += 1'000'000;
          pose.x_m = double(stamp_ns) * 50e-9;
          pose.speed_mps = 50;
          REQUIRE(ovt_push_ego_pose(small.detector, &pose) == OVT_OK);
        }
        const ovt_points points = posts.points(stamp_ns);
        REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
      }
      REQUIRE(ovt_flush(small.detector) == OVT_OK);
      places.push_back(x_m);
      ovt_destroy_detector(std::exchange(small.detector, nullptr));
    }
    CAPTURE(between);
    CHECK(places[0].size() >= 39);
    CHECK(places[1] == places[0]);
    CHECK(places[2] == places[0]);
  }
}
