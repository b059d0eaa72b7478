// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// After create there is no heap call, no lock and, with OVT_MEMORY_LOCK, no page fault. The program counts them over
// many frames from the first push on; each sensor pushes from a separate thread that never pushed before, and a
// callback and a reader read everything.
//
//   zero --workers N --frames N [--pieces N]        in pieces of N points: ovt_push_points
//
// This program replaces malloc and its family and the locks (support/heap_calls, support/lock_calls). With a graph,
// libtbb must come from a folder without libtbbmalloc, so that TBB's allocator is malloc, too; else the program ends
// with an error (tests/CMakeLists.txt).
#include <sys/resource.h>

#include <alloca.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/can_lock.h"
#include "tests/support/golden_scene.h"
#include "tests/support/heap_calls.h"
#include "tests/support/lock_calls.h"
#include "tests/support/pieces.h"
#include "tests/support/test_method.h"

using namespace overtake::test;

namespace {

constexpr int32_t kSensors = kGoldenSensors, kScene = 12;
constexpr int32_t kEvery = 16;  // uses every 16th point of the golden scene: many frames in little time

struct Numbers {
  int64_t heap_calls, lock_calls, page_faults;
};
Numbers count() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return {overtake::test::count_heap_calls(), overtake::test::count_lock_calls(), usage.ru_minflt + usage.ru_majflt};
}

int32_t count_threads() {
  int32_t count = 0;
  for ([[maybe_unused]] const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) ++count;
  return count;
}

bool is_mapped(const char* library) {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);)
    if (line.find(library) != std::string::npos) return true;
  return false;
}

// A thread's owner prepares its stack: touches the pages in advance so that they do not fault.
__attribute__((noinline)) void touch_stack() {
  constexpr std::size_t kBytes = 256 * 1024;
  volatile char* stack = static_cast<volatile char*>(alloca(kBytes));
  for (std::size_t i = 0; i < kBytes; i += 4096) stack[i] = 0;
}

// Reads every number of every column, as users would.
volatile double sink;
int64_t read_all(ovt_reader* reader) {
  ovt_frame_info info;
  ovt_detections d;
  ovt_tracks t;
  ovt_clusters c;
  ovt_labels l;
  if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_detections(reader, &d) != OVT_OK ||
      ovt_read_clusters(reader, &c) != OVT_OK || ovt_read_tracks(reader, info.stamp_ns + 20000000, &t) != OVT_OK)
    return 0;
  double sum = 0;
  for (int32_t i = 0; i < d.count; ++i) sum += double(d.x_m[i] + d.heading_rad[i]);
  for (int32_t i = 0; i < t.count; ++i) sum += t.x_m[i] + t.covariance[14][i];
  for (int32_t i = 0; i < t.count * t.path_points; ++i) sum += t.path_x_m[i];
  for (int32_t s = 0; s < kSensors; ++s)
    if (ovt_read_labels(reader, s, &l) == OVT_OK)
      for (int32_t i = 0; i < l.count; ++i) sum += l.label[i];
  sink = sum;
  return t.count;
}

struct Seen {
  std::atomic<int64_t> frames{0}, tracks{0};
  static void on_frame(ovt_reader* reader, void* user) {
    auto& seen = *static_cast<Seen*>(user);
    seen.tracks.fetch_add(read_all(reader), std::memory_order_relaxed);
    seen.frames.fetch_add(1, std::memory_order_relaxed);
  }
};

// Hands out frames one by one; every thread works on the same frame.
struct Turn {
  std::atomic<int64_t> frame{-1}, done{0}, ready{0};
  std::atomic<bool> stop{false};
  bool wait_for(int64_t k) {
    for (int64_t at; (at = frame.load(std::memory_order_acquire)) < k;) frame.wait(at, std::memory_order_acquire);
    return !stop.load(std::memory_order_acquire);
  }
  void give(int64_t k) {
    frame.store(k, std::memory_order_release);
    frame.notify_all();
  }
  void finish() {
    done.fetch_add(1, std::memory_order_acq_rel);
    done.notify_all();
  }
  void await(int64_t count) {
    for (int64_t at; (at = done.load(std::memory_order_acquire)) < count;) done.wait(at, std::memory_order_acquire);
  }
};

// Whether a lock of ours would be counted.
bool can_see_locks() {
  std::mutex mutex;
  const int64_t before = overtake::test::count_lock_calls();
  const std::lock_guard<std::mutex> lock(mutex);
  return overtake::test::count_lock_calls() == before + 1;
}

bool failed = false;
void require(bool good, const char* sentence) {
  if (good) return;
  std::printf("zero: %s\n", sentence);
  failed = true;
}

}  // namespace

int main(int argc, char** argv) {
  int32_t workers = 1;
  int64_t frames = 2000;
  int32_t piece_points = 0, parts = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--workers")) workers = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--frames")) frames = std::atoll(argv[i + 1]);
    if (!std::strcmp(argv[i], "--parts")) parts = std::atoi(argv[i + 1]);
    if (!std::strcmp(argv[i], "--pieces")) piece_points = std::atoi(argv[i + 1]);
  }
  if (!overtake::test::can_count_heap_calls()) {
    std::printf("skipped: zero: a sanitizer brings its own heap\n");
    return 77;
  }
  std::vector<GoldenPoint> clouds[kScene][kSensors];
  for (int32_t k = 0; k < kScene; ++k)
    for (int32_t s = 0; s < kSensors; ++s) {
      const std::vector<GoldenPoint> all = golden_cloud(k, s);
      for (std::size_t i = 0; i < all.size(); i += kEvery) clouds[k][s].push_back(all[i]);
    }

  std::vector<ovt_sensor_def> sensors = golden_sensors();
  for (ovt_sensor_def& sensor : sensors) sensor.cols = 107, sensor.point_capacity = 4096;
  const GoldenMap map;
  ovt_params params = test_params();
  params.tracker_confirm_hits = 3, params.tracker_keep_hits = 2;
  params.segment_parts = parts;
  Seen seen;
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = kSensors;
  def.params = &params;
  def.map = &map.def;
  def.worker_count = workers;
  def.keep_images = workers == 1;
  def.stream = piece_points > 0;
  def.push_policy = OVT_PUSH_WAIT;
  def.cluster_capacity = 200, def.candidate_capacity = 32, def.track_capacity = 32;
  def.memory = OVT_MEMORY_LOCK | OVT_MEMORY_LOCK_PROCESS;
  def.on_frame = Seen::on_frame;
  def.user = &seen;
  ovt_detector* detector = nullptr;
  char error[256];
  if (ovt_create_detector_verbose(&def, &detector, error, sizeof error) != OVT_OK) {
    std::printf("zero: %s\n", error);
    return 1;
  }
  // This thread, the intake and the workers. A thread more was not there when the others prepared for their work.
  require(count_threads() <= (workers == 1 ? 1 : 2 + workers), "create started more threads than there are workers");
  ovt_runtime_info runtime{};
  ovt_read_runtime_info(detector, &runtime);
  ovt_reader* reader = nullptr;
  require(ovt_create_reader(detector, &reader) == OVT_OK, "no reader");
  require(workers == 1 || !is_mapped("libtbbmalloc"), "libtbbmalloc is loaded: its heap calls cannot be seen");
  if (failed) return 1;

  const bool can_lock = overtake::test::can_lock(runtime.memory_bytes);

  Turn turn;
  std::atomic<int64_t> refused{0};
  std::vector<std::thread> threads;
  const auto push = [&](int64_t k, int32_t s) {
    const std::vector<GoldenPoint>& cloud = clouds[k % kScene][s];
    ovt_points points;
    ovt_points_init(&points, sizeof points);
    points.sensor = s;
    points.count = int32_t(cloud.size());
    points.stamp_ns = golden_stamp_ns(int32_t(k), s);
    const std::size_t bytes = cloud.size() * sizeof(GoldenPoint), stride = sizeof(GoldenPoint);
    const GoldenPoint& p = cloud[0];
    points.x = {&p.x_m, bytes, stride, OVT_F32};
    points.y = {&p.y_m, bytes - 4, stride, OVT_F32};
    points.z = {&p.z_m, bytes - 8, stride, OVT_F32};
    points.intensity = {&p.intensity, bytes - 12, stride, OVT_F32};
    points.layer = {&p.layer, bytes - 16, stride, OVT_U16};
    points.time = {&p.time_ns, bytes - 20, stride, OVT_U32};
    if (piece_points == 0) {
      if (ovt_push_scan(detector, &points) != OVT_OK) refused.fetch_add(1);
      return;
    }
    for (int32_t first = 0; first < points.count; first += piece_points) {
      const ovt_points piece = piece_of(points, first, std::min(first + piece_points, points.count));
      if (ovt_push_points(detector, &piece) != OVT_OK) refused.fetch_add(1);
    }
    if (ovt_end_scan(detector, s, points.stamp_ns, points.count) != OVT_OK) refused.fetch_add(1);
  };
  // With one worker all pushes belong to one thread: here a thread that never pushed before.
  const int32_t producers = workers == 1 ? 1 : kSensors;
  for (int32_t s = 0; s < producers; ++s)
    threads.emplace_back([&, s] {
      touch_stack();
      turn.ready.fetch_add(1);
      for (int64_t k = 0; turn.wait_for(k); ++k) {
        for (int32_t sensor = s; sensor < kSensors; sensor += producers) {
          if (sensor == 0) {
            ovt_ego_pose pose = golden_ego(golden_stamp_ns(int32_t(k), 0));
            pose.x_m = 40;  // stays in place, or the map would end after a while
            if (ovt_push_ego_pose(detector, &pose) != OVT_OK) refused.fetch_add(1);
          }
          push(k, sensor);
        }
        turn.finish();
      }
    });
  threads.emplace_back([&] {
    touch_stack();
    turn.ready.fetch_add(1);
    for (int64_t k = 0; turn.wait_for(k); ++k) {
      if (ovt_next_frame(reader, nullptr) == OVT_OK) read_all(reader);
      turn.finish();
    }
  });
  touch_stack();
  while (turn.ready.load() < int64_t(threads.size())) std::this_thread::yield();
  ovt_stats stats = ovt_default_stats();
  const auto everyone = int64_t(threads.size());

  const Numbers before = count();
  Numbers first{};
  for (int64_t k = 0; k < frames; ++k) {
    turn.give(k);
    turn.await((k + 1) * everyone);
    if (k == 0) ovt_flush(detector), first = count();
  }
  ovt_flush(detector);
  const Numbers after = count();

  turn.stop.store(true);
  turn.give(frames);
  for (std::thread& thread : threads) thread.join();
  ovt_read_stats(detector, &stats);
  std::printf(
      "workers %d, %lld frames, %lld tracks read: %lld heap calls (%lld of them in the first frame), %lld lock "
      "calls, %lld page faults (%lld); %lld bytes locked\n",
      workers, static_cast<long long>(stats.frames), static_cast<long long>(seen.tracks.load()),
      static_cast<long long>(after.heap_calls - before.heap_calls),
      static_cast<long long>(first.heap_calls - before.heap_calls),
      static_cast<long long>(after.lock_calls - before.lock_calls),
      static_cast<long long>(after.page_faults - before.page_faults),
      static_cast<long long>(first.page_faults - before.page_faults), static_cast<long long>(runtime.locked_bytes));
  require(refused.load() == 0, "a push was refused");
  require(stats.frames == frames && seen.frames.load() == frames, "not every frame came");
  require(seen.tracks.load() > frames, "hardly a track: the scene is not what it should be");
  require(after.heap_calls == before.heap_calls, "the heap was asked after create");
  require(after.lock_calls == before.lock_calls, "a lock was asked for after create");
  require(can_see_locks(), "locks are not seen: nothing was counted");
  if (can_lock) {
    require(runtime.locked_bytes == runtime.memory_bytes, "the system locks memory, and not all of it was");
    require(after.page_faults == before.page_faults, "pages faulted after create");
  } else {
    std::printf("zero: page faults are not judged: the system locks no memory (ulimit -l)\n");
  }
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
  return failed ? 1 : 0;
}
