// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Worker threads: a single CPU, a process that gives oneTBB few threads or none, several detectors.
#include <doctest/doctest.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_group.h>
#include <pthread.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"
#include "tests/support/detector_log.h"

using namespace overtake::test;
using overtake::HookPoint;
using overtake::TestHook;

namespace {

ovt_status try_create(DetectorBench& bench, std::string& error) {
  char text[256];
  const ovt_status status = ovt_create_detector_verbose(&bench.def, &bench.detector, text, sizeof text);
  error = text;
  return status;
}

}  // namespace

TEST_CASE("detector workers: if oneTBB has no thread create fails, if it has fewer create uses them") {
  using oneapi::tbb::global_control;
  DetectorBench good({.workers = 1});
  good.create();
  for (std::size_t k = 0; k < 3; ++k) good.push_frame(k);
  good.flush();

  std::string error;
  {
    const global_control none(global_control::max_allowed_parallelism, 1);
    DetectorBench bench({.workers = 2});
    CHECK(try_create(bench, error) == OVT_NO_THREADS);
    CHECK(error.find("global_control") != std::string::npos);
    CHECK(bench.detector == nullptr);
  }
  {
    const global_control one(global_control::max_allowed_parallelism, 2);
    Log log;
    DetectorBench bench({.workers = 2, .record = false});
    keep_log(bench, log);
    REQUIRE(try_create(bench, error) == OVT_OK);
    ovt_runtime_info info;
    REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
    CHECK(info.worker_count == 1);
    CHECK(log.holds("workers: 1 of 2"));
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
    bench.flush();
    CHECK(bench.stats().frames == 3);
  }
  DetectorBench bench({.workers = 2});
  REQUIRE(try_create(bench, error) == OVT_OK);
  ovt_runtime_info info;
  REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
  CHECK(info.worker_count == 2);
  for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
  bench.flush();
  CHECK(bench.records == good.records);
}

TEST_CASE("detector workers: a detector takes no thread of oneTBB from the process") {
  using oneapi::tbb::global_control;
  const auto allowed = [] { return global_control::active_value(global_control::max_allowed_parallelism); };
  const global_control many(global_control::max_allowed_parallelism, 16);
  const std::size_t before = allowed();
  CHECK(before == 16);
  {
    DetectorBench one({.workers = 2}), other({.workers = 3});
    one.create();
    CHECK(allowed() == before);
    other.create();
    CHECK(allowed() == before);
  }
  CHECK(allowed() == before);
}

TEST_CASE("detector workers: of two detectors, the frames of each run on its own CPUs") {
  cpu_set_t all;
  REQUIRE(sched_getaffinity(0, sizeof all, &all) == 0);
  int32_t first = 0;
  while (!CPU_ISSET(first, &all)) ++first;
  struct Seen {
    std::atomic<int32_t> frames{0}, pinned{0};
  };
  Seen seen[2];
  DetectorBench pinned({.workers = 2, .record = false}), free({.workers = 2, .record = false});
  pinned.def.cpus = &first;
  pinned.def.cpu_count = 1;
  DetectorBench* const benches[] = {&pinned, &free};
  for (std::size_t i = 0; i < 2; ++i) {
    benches[i]->def.user = &seen[i];
    benches[i]->def.on_frame = [](ovt_reader*, void* user) {
      auto& s = *static_cast<Seen*>(user);
      cpu_set_t set;
      if (sched_getaffinity(0, sizeof set, &set) == 0) s.pinned += CPU_COUNT(&set) == 1;
      ++s.frames;
    };
    benches[i]->create();
  }
  for (std::size_t k = 0; k < 60; ++k)
    for (DetectorBench* bench : benches) {
      bench->push_frame(k);
      bench->flush();
    }
  CHECK(seen[0].frames == 60);
  CHECK(seen[0].pinned == 60);
  CHECK(seen[1].frames == 60);
  if (CPU_COUNT(&all) > 1) CHECK(seen[1].pinned == 0);
}

namespace {

// Keeps every worker of oneTBB in a task from `hold` until `release`. Then each looks at its own CPUs and policy.
class OtherArena {
 public:
  void hold() {
    arena_.execute([&] {
      for (int32_t i = 0; i < workers_; ++i)
        tasks_.run([&] {
          pinned_before += is_pinned();
          ++inside_;
          while (!go_.load()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
          pinned += is_pinned();
          fifo += sched_getscheduler(0) == SCHED_FIFO;
          pthread_getname_np(pthread_self(), names_[std::size_t(looked_++)].data(), 16);
        });
    });
    const int64_t until = overtake::steady_now_ns() + 10'000'000'000;
    while (inside_.load() < workers_ && overtake::steady_now_ns() < until) std::this_thread::yield();
    CHECK(inside_.load() == workers_);
  }
  void release() {
    go_.store(true);
    arena_.execute([&] { tasks_.wait(); });
    for (const auto& name : names_) named += std::string(name.data()).rfind("ovt-worker", 0) == 0;
  }
  std::atomic<int32_t> pinned_before{0}, pinned{0}, fifo{0};
  int32_t named = 0;

 private:
  static bool is_pinned() {
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 && CPU_COUNT(&set) == 1;
  }
  const int32_t workers_ =
      int32_t(oneapi::tbb::global_control::active_value(oneapi::tbb::global_control::max_allowed_parallelism)) - 1;
  oneapi::tbb::task_arena arena_{workers_ + 1, 1};
  oneapi::tbb::task_group tasks_;
  std::atomic<int32_t> inside_{0}, looked_{0};
  std::atomic<bool> go_{false};
  std::vector<std::array<char, 16>> names_{std::size_t(workers_)};
};

int32_t count_threads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return int32_t(std::distance(begin(tasks), end(tasks)));
}

}  // namespace

TEST_CASE("detector workers: no thread of oneTBB keeps the CPUs or the priority of a destroyed detector") {
  cpu_set_t all;
  REQUIRE(sched_getaffinity(0, sizeof all, &all) == 0);
  if (CPU_COUNT(&all) < 2) {
    MESSAGE("skipped: one CPU");
    return;
  }
  int32_t first = 0;
  while (!CPU_ISSET(first, &all)) ++first;
  for (const int32_t priority : {0, 1}) {
    CAPTURE(priority);
    DetectorBench one({.workers = 2, .record = false}), other({.workers = 2, .record = false});
    for (DetectorBench* bench : {&one, &other}) {
      bench->def.cpus = &first;
      bench->def.cpu_count = 1;
      bench->def.fifo_priority = priority;
      bench->create();
    }
    ovt_runtime_info info;
    REQUIRE(ovt_read_runtime_info(one.detector, &info) == OVT_OK);
    if (priority > 0 && info.fifo == 0) {
      MESSAGE("skipped: no permission for SCHED_FIFO");
      continue;
    }
    for (std::size_t k = 0; k < 20; ++k)
      for (DetectorBench* bench : {&one, &other}) {
        bench->push_frame(k);
        bench->flush();
      }
    OtherArena arena;  // its tasks keep the workers from any task of the detectors
    arena.hold();
    CHECK(arena.pinned_before >= 2);
    one.destroy();
    other.destroy();
    arena.release();
    CHECK(arena.pinned == 0);
    CHECK(arena.fifo == 0);
    CHECK(arena.named == 0);
  }
}

TEST_CASE("detector workers: the first frames of a second detector start no thread, though the first one was idle") {
  constexpr int32_t kWorkers = 6, kFrames = 2, kScans = 3 * kFrames;  // of each detector
  struct Full {
    std::atomic<int32_t> inside{0};
    std::atomic<bool> go{false};
  } full;
  DetectorBench one({.workers = kWorkers, .record = false}), other({.workers = kWorkers, .record = false});
  for (std::size_t k = 0; k < std::size_t(kFrames); ++k) (void)demo_frame(k);
  for (DetectorBench* bench : {&one, &other}) {
    bench->create();
    reinterpret_cast<overtake::Detector*>(bench->detector)
        ->set_hook(TestHook{[](void* user, HookPoint at, overtake::Frame&, int32_t) {
                              auto& f = *static_cast<Full*>(user);
                              if (at != HookPoint::kSegment) return;
                              ++f.inside;
                              while (!f.go.load()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                            },
                            &full});
  }
  const int32_t before = count_threads();
  for (std::size_t k = 0; k < std::size_t(kFrames); ++k)
    for (DetectorBench* bench : {&one, &other}) bench->push_frame(k);
  const int64_t until = overtake::steady_now_ns() + 10'000'000'000;
  while (full.inside.load() < 2 * kScans && overtake::steady_now_ns() < until) std::this_thread::yield();
  CHECK(full.inside.load() == 2 * kScans);  // all workers of both are at work
  CHECK(count_threads() == before);
  full.go.store(true);
  one.flush();
  other.flush();
}

// The last one: threads that oneTBB starts here, and those that they start later, inherit the one CPU.
TEST_CASE("detector workers: worker_count 0 starts threads also on one CPU, so a thread per sensor may push") {
  cpu_set_t all, one;
  REQUIRE(sched_getaffinity(0, sizeof all, &all) == 0);
  int32_t cpu = 0;
  while (!CPU_ISSET(cpu, &all)) ++cpu;
  CPU_ZERO(&one);
  CPU_SET(cpu, &one);
  REQUIRE(sched_setaffinity(0, sizeof one, &one) == 0);
  {
    DetectorBench bench({.workers = 0});
    bench.create();
    ovt_runtime_info info;
    REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
    CHECK(info.worker_count == 2);
    for (std::size_t k = 0; k < 4; ++k) {
      bench.push_ego(k);
      (void)demo_frame(k);
      std::vector<std::thread> threads;
      std::atomic<int32_t> taken{0};
      for (int32_t s = 0; s < 3; ++s) threads.emplace_back([&, s] { taken += bench.push_scan(k, s) == OVT_OK; });
      for (std::thread& thread : threads) thread.join();
      CHECK(taken == 3);
    }
    bench.flush();
    CHECK(bench.records.size() == 4);
  }
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    CAPTURE(thread.path().string());
    const bool given = sched_setaffinity(std::stoi(thread.path().filename()), sizeof all, &all) == 0;
    CHECK((given || errno == ESRCH));  // ESRCH: a joined thread that is still listed
  }
}
