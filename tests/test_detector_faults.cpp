// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Faults below or around the detector: exceptions, deadlines, hanging frames, clocks, older callers, threads and memory
// that the system refuses.
#include <dirent.h>
#include <doctest/doctest.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "pipeline/detector.h"
#include "tests/support/can_lock.h"
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
  sleep_ms(500);
  CHECK(bench.stats().in_flight >= 1);
  for (int32_t i = 0; i < 2; ++i) {
    bench.push_scan(2, i);  // each push runs the watchdog; the frame stays open
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

TEST_CASE("detector faults: workers and intake have names and run on the def's CPUs, as reported") {
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

TEST_CASE("detector faults: locked and huge memory is reported, and the results are the same") {
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

TEST_CASE("detector faults: a destroyed detector leaves the locked pages of others locked") {
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
// Addresses in a frame slot, in a sensor's scan and in a reader.
struct Places {
  std::vector<const void*> of;
  explicit Places(DetectorBench& bench, ovt_reader** reader) {
    ovt_detections d;
    ovt_labels l;
    ovt_tracks t;
    REQUIRE(ovt_create_reader(bench.detector, reader) == OVT_OK);
    REQUIRE(ovt_next_frame(*reader, nullptr) == OVT_OK);
    REQUIRE(ovt_read_detections(*reader, &d) == OVT_OK);
    REQUIRE(ovt_read_labels(*reader, 0, &l) == OVT_OK);
    REQUIRE(ovt_read_tracks(*reader, OVT_AT_FRAME_STAMP, &t) == OVT_OK);
    of = {d.x_m, l.x_m, t.x_m};
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

TEST_CASE("detector faults: a child process does not get the blocks, and destroy returns them to the system") {
#if defined(__SANITIZE_ADDRESS__)
  MESSAGE("skipped: with this sanitizer blocks come from its heap");
#else
  for (const int32_t flags : {0, int32_t(OVT_MEMORY_LOCK), int32_t(OVT_MEMORY_HUGE)}) {
    CAPTURE(flags);
    DetectorBench bench({.workers = 1, .record = false});
    bench.def.memory = flags;
    bench.create();
    bench.push_frame(0);
    ovt_reader* reader = nullptr;
    const Places places(bench, &reader);
    CHECK(places.all(" dc"));
    ovt_destroy_reader(reader);
    bench.destroy();
    CHECK(places.none(" dc"));  // not mapped, or mapped by somebody else: never pages without a copy in children
  }
  DetectorBench own({.workers = 1, .record = false});  // pages of the caller's allocator stay unchanged
  own.def.memory = OVT_MEMORY_LOCK;
  own.def.alloc = [](size_t bytes, size_t alignment, void*) { return std::aligned_alloc(alignment, bytes); };
  own.def.free = [](void* block, size_t, void*) { std::free(block); };
  own.create();
  own.push_frame(0);
  ovt_reader* reader = nullptr;
  const Places places(own, &reader);
  CHECK(places.none(" dc"));
  ovt_destroy_reader(reader);
#endif
}

TEST_CASE("detector faults: a process that forks is unaffected; the child may destroy the detector") {
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

TEST_CASE("detector faults: threads that spin before they sleep give the same bytes") {
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

TEST_CASE("detector faults: frames that the intake closes do not wait for spinning threads") {
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

TEST_CASE("detector faults: a clock jump restarts the tracker at the third stamp, and no id returns") {
  for (const int32_t workers : {1, 2})
    for (const int64_t jump_ns : {3'600'000 * kMs, -3'600'000 * kMs}) {
      CAPTURE(jump_ns);
      DetectorBench bench({.workers = workers, .map = false});
      std::set<uint64_t> before, after;
      struct Seen {
        std::set<uint64_t>* ids;
        std::vector<uint32_t> flags;
      } seen{&before, {}};
      bench.def.user = &seen;
      bench.def.on_frame = [](ovt_reader* reader, void* user) {
        auto& s = *static_cast<Seen*>(user);
        ovt_tracks tracks;
        ovt_frame_info info;
        ovt_read_info(reader, &info);
        ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks);
        s.ids->insert(tracks.id, tracks.id + tracks.count);
        s.flags.push_back(info.flags);
      };
      bench.create();
      const auto push = [&](std::size_t k, int64_t shift_ns) {
        for (int32_t s = 0; s < 3; ++s) {
          const overtake::SceneFrame& frame = demo_frame(k);
          const ovt_points points = points_of(frame.scan[s], s, frame.stamp_ns + shift_ns);
          REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
        }
      };
      for (std::size_t k = 0; k < 4; ++k) push(k, 0);
      bench.flush();
      seen.ids = &after;
      for (std::size_t k = 4; k < 9; ++k) push(k, jump_ns);
      bench.flush();
      const ovt_stats stats = bench.stats();
      CHECK(adds_up(stats));
      CHECK(stats.clock_jumps == 1);
      CHECK(stats.used == 12 + 9);
      CHECK(stats.dropped == 6);
      CHECK(stats.late == 0);
      REQUIRE(seen.flags.size() == 7);
      for (std::size_t i = 0; i < 7; ++i) CHECK(((seen.flags[i] & OVT_FLAG_CLOCK_JUMP) != 0) == (i == 4));
      CHECK(!before.empty());
      CHECK(!after.empty());
      for (const uint64_t id : after) CHECK(before.count(id) == 0);
    }
}

TEST_CASE("detector faults: late scans are inserted at their stamp; the tracks equal those of sorted order") {
  struct Last {
    std::vector<double> state;
    std::vector<uint64_t> ids;
    std::set<uint64_t> confirmed;  // all ids ever published as confirmed
    int32_t late_frames = 0, refiltered = 0, frames = 0;
  };
  const auto run = [](int32_t workers, const std::vector<std::size_t>& order) {
    Last last;
    DetectorBench bench({.workers = workers});
    bench.def.sensor_count = 1;
    bench.def.user = &last;
    bench.def.on_frame = [](ovt_reader* reader, void* user) {
      auto& l = *static_cast<Last*>(user);
      ovt_frame_info info;
      ovt_tracks t;
      ovt_read_info(reader, &info);
      ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t);
      ++l.frames;
      if (info.flags & OVT_FLAG_OUT_OF_SEQUENCE) {
        ++l.late_frames;
        CHECK(info.tracks_stamp_ns > info.stamp_ns);
      } else {
        CHECK(info.tracks_stamp_ns == info.stamp_ns);
      }
      l.refiltered += info.refiltered;
      l.state.clear();
      l.ids.assign(t.id, t.id + t.count);
      for (int32_t i = 0; i < t.count; ++i) {
        for (const double* c : {t.x_m, t.y_m, t.speed_mps, t.course_rad, t.yaw_rate_rps}) l.state.push_back(c[i]);
        for (const double* c : t.covariance) l.state.push_back(c[i]);
        if (t.state[i] == OVT_CONFIRMED) l.confirmed.insert(t.id[i]);
        CHECK(((t.flags[i] & OVT_TRACK_STALE) != 0) == (info.tracks_stamp_ns - t.measured_ns[i] > 500 * kMs));
        CHECK(((t.flags[i] & OVT_TRACK_COASTING) == 0) == (t.detection[i] >= 0));
      }
    };
    bench.create();
    for (std::size_t k = 0; k < order.size(); ++k) bench.push_ego(k);
    for (const std::size_t k : order) REQUIRE(bench.push_scan(k, 0) == OVT_OK);
    bench.flush();
    const ovt_stats s = bench.stats();
    CHECK(s.used == int64_t(order.size()));
    CHECK(s.refiltered == last.late_frames);
    CHECK(s.measurements > 0);
    CHECK(s.measurements ==
          s.measurements_used + s.measurements_unborn + s.measurements_rejected + s.measurements_late);
    return last;
  };
  const Last sorted = run(1, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  CHECK(sorted.late_frames == 0);
  REQUIRE(!sorted.state.empty());
  for (const int32_t workers : {1, 2}) {
    const Last mixed = run(workers, {0, 1, 3, 2, 4, 7, 6, 5, 8, 10, 11, 9});
    CHECK(mixed.frames == 12);
    CHECK(mixed.late_frames == 4);
    CHECK(mixed.refiltered == 1 + 1 + 2 + 2);
    CHECK(mixed.state == sorted.state);  // bit by bit
    CHECK(!mixed.confirmed.empty());
    for (const uint64_t id : mixed.confirmed)  // a published id stays with its car
      CHECK(std::count(mixed.ids.begin(), mixed.ids.end(), id) == 1);
  }
}
