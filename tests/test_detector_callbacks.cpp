// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Callbacks of the C API: the frames, the log, and the memory of the caller; their exceptions.
#include <doctest/doctest.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/overtake.hpp"
#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

}  // namespace

TEST_CASE("detector: an exception from the callback is counted, and the next frame works") {
  struct Thrower {
    static void throws(ovt_reader*, void*) { throw std::runtime_error("from the callback"); }
  };
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.def.on_frame = Thrower::throws;
    small.create();
    const Posts posts(2);
    for (int64_t k = 0; k < 10; ++k) {
      const ovt_points points = posts.points(k * 50 * kMs);
      CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
    }
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.stats().frames == 10);
    CHECK(small.stats().exceptions == 10);
  }
}

TEST_CASE("detector: the log contains the choices of create, missing inputs, and every caught exception") {
  struct Listener {
    std::vector<std::string> lines;
    static void hear(ovt_log_level level, const char* text, void* user) {
      static_cast<Listener*>(user)->lines.push_back(std::to_string(level) + " " + text);
    }
    static void throws_log(ovt_log_level, const char*, void*) { throw std::runtime_error("from the log"); }
    static void throws(ovt_reader*, void*) { throw std::runtime_error("from the callback"); }
  };
  for (const bool log_throws : {false, true}) {
    Listener listener;
    Small small(1, 1);
    small.def.isa = "ref";
    small.def.user = &listener;
    small.def.log = log_throws ? Listener::throws_log : Listener::hear;
    small.def.on_frame = Listener::throws;
    small.create();
    const Posts posts(2);
    const ovt_points points = posts.points(0);
    CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.stats().exceptions == 1);
    if (log_throws) continue;
    CHECK(listener.lines == std::vector<std::string>{"2 isa ref, 1 worker",
                                                     "1 no map: no map gate, psi_REF is the ego heading",
                                                     "0 on_frame threw an exception"});
  }
}

TEST_CASE("detector: many creates and destroys, with any refused block, free all memory") {
  struct Heap {
    int64_t bytes = 0;
    int32_t left = 0;
    static void* take(size_t size, size_t alignment, void* user) {
      auto* heap = static_cast<Heap*>(user);
      if (heap->left-- <= 0) return nullptr;
      heap->bytes += int64_t(size);
      return std::aligned_alloc(alignment, size);
    }
    static void give(void* block, size_t size, void* user) {
      static_cast<Heap*>(user)->bytes -= int64_t(size);
      std::free(block);
    }
  };
  int32_t created = 0, refused = 0;
  for (int32_t allowed = 0; allowed < 100; ++allowed) {
    Heap heap;
    heap.left = allowed;
    ovt_sensor_def sensor = ovt_default_sensor_def();
    sensor.rows = 8, sensor.cols = 64, sensor.point_capacity = 512;
    ovt_detector_def def = ovt_default_detector_def();
    def.sensors = &sensor;
    def.sensor_count = 1;
    def.worker_count = allowed % 2 ? 2 : 1;
    def.cluster_capacity = def.candidate_capacity = def.track_capacity = 16;
    def.alloc = Heap::take;
    def.free = Heap::give;
    def.user = &heap;
    ovt_detector* detector = nullptr;
    const ovt_status status = ovt_create_detector(&def, &detector);
    CHECK((status == OVT_OK || status == OVT_NO_MEMORY));
    CHECK((status == OVT_OK) == (detector != nullptr));
    (status == OVT_OK ? created : refused) += 1;
    if (detector) {
      ovt_points empty;
      ovt_points_init(&empty, sizeof empty);
      empty.x.type = empty.y.type = empty.z.type = OVT_F32;
      empty.layer.type = OVT_U8;
      ovt_push_scan(detector, &empty);
      ovt_reader* reader = nullptr;
      const ovt_status got = ovt_create_reader(detector, &reader);
      CHECK((got == OVT_OK || got == OVT_NO_MEMORY));
      ovt_destroy_reader(reader);
    }
    ovt_destroy_detector(detector);
    CHECK(heap.bytes == 0);
  }
  CHECK(refused > 3);
  CHECK(created > 50);
  ovt_destroy_detector(nullptr);
}

TEST_CASE("detector: an exception of alloc counts as no memory, at create and for a reader") {
  struct Heap {
    int32_t left = 0, blocks = 0;
    static void* take(size_t size, size_t alignment, void* user) {
      auto* heap = static_cast<Heap*>(user);
      if (heap->left-- <= 0) throw std::runtime_error("no memory");
      ++heap->blocks;
      return std::aligned_alloc(alignment, size);
    }
    static void give(void* block, size_t, void* user) {
      --static_cast<Heap*>(user)->blocks;
      std::free(block);
    }
  } heap;
  Small small;
  small.def.alloc = Heap::take;
  small.def.free = Heap::give;
  small.def.user = &heap;
  small.def.on_frame = nullptr;
  CHECK(ovt_create_detector(&small.def, &small.detector) == OVT_NO_MEMORY);
  CHECK(small.detector == nullptr);
  heap.left = 1000;
  small.create();
  heap.left = 0;
  ovt_reader* reader = nullptr;
  CHECK(ovt_create_reader(small.detector, &reader) == OVT_NO_MEMORY);
  CHECK(reader == nullptr);
  ovt_destroy_detector(small.detector);
  small.detector = nullptr;
  CHECK(heap.blocks == 0);
}

TEST_CASE("detector: a def that is bound to a second handler calls nothing of the first") {
  struct Everything {
    void on_frame(ovt::FrameView) noexcept {}
    void log(ovt_log_level, std::string_view) noexcept {}
    void* allocate(size_t, size_t) noexcept { return nullptr; }
    void release(void*, size_t) noexcept {}
  } everything;
  struct Frames {
    void on_frame(ovt::FrameView) noexcept {}
  } frames;
  struct Lines {
    void log(ovt_log_level, std::string_view) noexcept {}
  } lines;
  ovt_detector_def def = ovt_default_detector_def();
  ovt::bind(def, everything);
  CHECK((def.on_frame && def.log && def.alloc && def.free && def.user == &everything));
  ovt::bind(def, frames);
  CHECK((def.on_frame && !def.log && !def.alloc && !def.free && def.user == &frames));
  ovt::bind(def, lines);
  CHECK((!def.on_frame && def.log && !def.alloc && !def.free && def.user == &lines));
}
