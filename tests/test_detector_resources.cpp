// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Resources that create requests from the system: threads and their CPUs, locked and huge memory. Also: what a fork
// does to this memory, and threads that spin before they sleep.
#include <dirent.h>
#include <doctest/doctest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/can_lock.h"
#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

void sleep_ms(int64_t ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

// Names of this process's threads, and the CPUs that each may use.
std::multiset<std::string> threads_on(int32_t cpu, const std::string& prefix) {
  std::multiset<std::string> found;
  DIR* folder = opendir("/proc/self/task");
  REQUIRE(folder);
  while (const dirent* entry = readdir(folder)) {
    const std::string task = std::string("/proc/self/task/") + entry->d_name;
    std::string name;
    std::getline(std::ifstream(task + "/comm") >> std::ws, name);
    cpu_set_t set;
    if (name.rfind(prefix, 0) != 0 || sched_getaffinity(std::stoi(entry->d_name), sizeof set, &set) != 0) continue;
    if (cpu < 0 || (CPU_COUNT(&set) == 1 && CPU_ISSET(cpu, &set))) found.insert(name);
  }
  closedir(folder);
  return found;
}

int32_t first_cpu() {
  cpu_set_t set;
  sched_getaffinity(0, sizeof set, &set);
  int32_t cpu = 0;
  while (!CPU_ISSET(cpu, &set)) ++cpu;
  return cpu;
}

}  // namespace

TEST_CASE("detector resources: workers and intake have names and run on the def's CPUs, as reported") {
  const int32_t cpu = first_cpu();
  DetectorBench bench({.workers = 2});
  bench.def.cpus = &cpu;
  bench.def.cpu_count = 1;
  bench.def.fifo_priority = 1;
  bench.create();
  ovt_runtime_info info;
  REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
  CHECK(info.worker_count == 2);
  CHECK(info.pinned == 3);
  CHECK((info.fifo == 0 || info.fifo == 3));  // with or without the permission
  CHECK(threads_on(cpu, "ovt-intake").size() == 1);
  for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
  bench.flush();
  CHECK(bench.records.size() == 3);
  bench.destroy();
  CHECK(threads_on(-1, "ovt-intake").empty());

  DetectorBench counted({.workers = 0});  // as many workers as listed CPUs
  const int32_t twice[2] = {cpu, cpu};
  counted.def.cpus = twice;
  counted.def.cpu_count = 2;
  counted.create();
  REQUIRE(ovt_read_runtime_info(counted.detector, &info) == OVT_OK);
  CHECK(info.worker_count == 2);
}

TEST_CASE("detector resources: locked and huge memory is reported, and the results are the same") {
  std::vector<FrameRecord> expected;
  for (const int32_t flags : {0, int32_t(OVT_MEMORY_LOCK), OVT_MEMORY_LOCK | OVT_MEMORY_HUGE}) {
    CAPTURE(flags);
    DetectorBench bench({.workers = 1});
    bench.def.memory = flags;
    bench.create();
    ovt_runtime_info info;
    REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
    CHECK(info.memory_bytes > 0);
    CHECK(info.locked_bytes <= info.memory_bytes);
    CHECK(info.huge_bytes <= info.memory_bytes);
    CHECK((info.locked_bytes > 0) <= ((flags & OVT_MEMORY_LOCK) != 0));
    if ((flags & OVT_MEMORY_LOCK) && can_lock(info.memory_bytes)) CHECK(info.locked_bytes == info.memory_bytes);
    CHECK((info.huge_bytes > 0) <= ((flags & OVT_MEMORY_HUGE) != 0));
    CHECK(info.process_locked == 0);
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
    bench.flush();
    if (expected.empty()) expected = bench.records;
    CHECK(bench.records == expected);

    for (int32_t i = 0; i < 3; ++i) {  // a reader frees its memory
      ovt_reader* reader = nullptr;
      REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
      ovt_runtime_info with;
      REQUIRE(ovt_read_runtime_info(bench.detector, &with) == OVT_OK);
      CHECK(with.memory_bytes > info.memory_bytes);
      CHECK((with.locked_bytes > info.locked_bytes) <= (info.locked_bytes > 0));
      ovt_destroy_reader(reader);
      ovt_runtime_info without;
      REQUIRE(ovt_read_runtime_info(bench.detector, &without) == OVT_OK);
      CHECK(without.memory_bytes == info.memory_bytes);
      CHECK(without.locked_bytes == info.locked_bytes);
      CHECK(without.huge_bytes == info.huge_bytes);
    }
  }
}

TEST_CASE("detector resources: a destroyed detector leaves the locked pages of others locked") {
  // So small that the heap places their blocks side by side.
  const auto make_small = [](DetectorBench& bench) {
    bench.def.memory = OVT_MEMORY_LOCK;
    for (ovt_sensor_def& sensor : bench.sensors) sensor.rows = 4, sensor.cols = 16, sensor.point_capacity = 64;
    bench.def.cluster_capacity = bench.def.candidate_capacity = bench.def.track_capacity = 16;
    bench.def.ego_pose_capacity = 16;
    bench.create();
  };
  DetectorBench first({.workers = 1, .map = false}), goes({.workers = 1, .map = false}),
      second({.workers = 1, .map = false});
  const long before = locked_kb();
  make_small(first);
  const long alone = locked_kb() - before;
  ovt_runtime_info info;
  REQUIRE(ovt_read_runtime_info(first.detector, &info) == OVT_OK);
  const int64_t alone_bytes = info.memory_bytes;
  make_small(goes);
  make_small(second);
  goes.destroy();
  CHECK(locked_kb() - before >= 2 * alone);
  if (can_lock(alone_bytes)) CHECK(alone * 1024 >= alone_bytes);  // else nothing was locked at all
}

namespace {
// The kernel's flags of the pages that hold this address in this process (VmFlags of /proc/self/smaps), "" if nothing
// is mapped.
std::string page_flags(const void* address) {
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  bool here = false;
  std::ifstream smaps("/proc/self/smaps");
  for (std::string line; std::getline(smaps, line);) {
    unsigned long long from = 0, to = 0;
    if (std::sscanf(line.c_str(), "%llx-%llx ", &from, &to) == 2) here = wanted >= from && wanted < to;
    if (here && line.rfind("VmFlags:", 0) == 0) return line;
  }
  return "";
}
// Addresses in a frame slot, in a sensor's scan and in a reader, of a detector that has finished one frame. The reader
// exists until close().
struct Places {
  std::vector<const void*> of;
  ovt_reader* reader = nullptr;
  explicit Places(DetectorBench& bench) {
    bench.create();
    bench.push_frame(0);
    ovt_detections d;
    ovt_labels l;
    ovt_tracks t;
    REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
    REQUIRE(ovt_read_detections(reader, &d) == OVT_OK);
    REQUIRE(ovt_read_labels(reader, 0, &l) == OVT_OK);
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) == OVT_OK);
    of = {d.x_m, l.x_m, t.x_m};
  }
  Places(const Places&) = delete;
  ~Places() { close(); }
  void close() {
    ovt_destroy_reader(reader);
    reader = nullptr;
  }
  bool all(const char* flag) const {
    return std::all_of(of.begin(), of.end(),
                       [&](const void* p) { return page_flags(p).find(flag) != std::string::npos; });
  }
  bool none(const char* flag) const {
    return std::none_of(of.begin(), of.end(),
                        [&](const void* p) { return page_flags(p).find(flag) != std::string::npos; });
  }
};
}  // namespace

TEST_CASE("detector resources: a child process does not get the blocks, and destroy returns them to the system") {
#if defined(__SANITIZE_ADDRESS__)
  MESSAGE("skipped: with this sanitizer blocks come from its heap");
#else
  for (const int32_t flags : {0, int32_t(OVT_MEMORY_LOCK), int32_t(OVT_MEMORY_HUGE)}) {
    CAPTURE(flags);
    DetectorBench bench({.workers = 1, .record = false});
    bench.def.memory = flags;
    Places places(bench);
    CHECK(places.all(" dc"));
    places.close();
    bench.destroy();
    CHECK(places.none(" dc"));  // not mapped, or mapped by somebody else: never pages without a copy in children
  }
  DetectorBench own({.workers = 1, .record = false});  // pages of the caller's allocator stay unchanged
  own.def.memory = OVT_MEMORY_LOCK;
  own.def.alloc = [](size_t bytes, size_t alignment, void*) { return std::aligned_alloc(alignment, bytes); };
  own.def.free = [](void* block, size_t, void*) { std::free(block); };
  CHECK(Places(own).none(" dc"));
#endif
}

TEST_CASE("detector resources: a process that forks is unaffected; the child may destroy the detector") {
#if defined(__SANITIZE_THREAD__)
  MESSAGE("skipped: this sanitizer forbids threads after a fork");
#else
  DetectorBench expected({.workers = 2});
  expected.create();
  for (std::size_t k = 0; k < 8; ++k) expected.push_frame(k);
  expected.flush();
  for (const int32_t workers : {1, 2}) {
    CAPTURE(workers);
    DetectorBench bench({.workers = workers});
    bench.create();
    ovt_reader* reader = nullptr;  // without a reader, destroying the detector frees the blocks
    if (workers == 2) REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
    for (std::size_t k = 0; k < 8; ++k) {
      const pid_t child = fork();
      REQUIRE(child >= 0);
      if (child == 0) {  // what a host's exit handlers may do
        ovt_destroy_reader(reader);
        ovt_destroy_detector(bench.detector);
        _exit(7);
      }
      bench.push_frame(k);
      int status = 0;
      REQUIRE(waitpid(child, &status, 0) == child);
      REQUIRE(WIFEXITED(status));
      CHECK(WEXITSTATUS(status) == 7);
    }
    bench.flush();
    CHECK(bench.records == expected.records);
    ovt_destroy_reader(reader);
  }
#endif
}

TEST_CASE("detector resources: threads that spin before they sleep give the same bytes") {
  std::vector<FrameRecord> expected;
  for (const int32_t spin_us : {0, 200}) {
    DetectorBench bench({.workers = 2});
    bench.def.spin_us = spin_us;
    bench.create();
    for (std::size_t k = 0; k < 8; ++k) {
      bench.push_frame(k);
      if (k % 3 == 0) sleep_ms(2);
    }
    bench.flush();
    if (expected.empty()) expected = bench.records;
    CHECK(bench.records.size() == 8);
    CHECK(bench.records == expected);
  }
}

TEST_CASE("detector resources: frames that the intake closes do not wait for spinning threads") {
  DetectorBench bench({.workers = 2});
  bench.def.spin_us = 1'000'000;  // from the last scan on
  bench.create();
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  const auto comes = [&](int64_t sequence) {  // while they spin
    ovt_frame_info info{};
    info.sequence = -1;
    for (int32_t k = 0; k < 400 && info.sequence < sequence; ++k) {
      sleep_ms(1);
      if (ovt_next_frame(reader, nullptr) == OVT_OK) ovt_read_info(reader, &info);
    }
    return info.sequence == sequence;
  };
  bench.push_frame(0);
  CHECK(comes(0));
  const double place_m = 30;
  ovt_external_detections d;
  ovt_external_detections_init(&d, sizeof d);
  d.stamp_ns = demo_frame(0).stamp_ns + 10 * kMs;
  d.count = 1;
  d.x_m = d.y_m = &place_m;
  REQUIRE(ovt_push_detections(bench.detector, &d) == OVT_OK);
  CHECK(comes(1));
  bench.push_frame(1, {0, 1});
  sleep_ms(50);  // both are segmented, and the frame waits for the third sensor
  REQUIRE(ovt_advance(bench.detector, demo_frame(3).stamp_ns) == OVT_OK);
  CHECK(comes(2));
  ovt_destroy_reader(reader);
}
