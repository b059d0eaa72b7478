// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frame slots: free, in flight, finished. Readers hold their frames, and block nothing else.
#include "pipeline/frame_pool.h"

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <thread>

using namespace overtake;

// The steps of a call that another thread may interrupt.
namespace overtake {
struct FramePoolSteps {
  template <class Between>
  static Frame* pin_latest(FramePool& pool, Between&& between) {
    return pool.pin_latest(between);
  }
  static void mark_finished(FramePool& pool, Frame* frame) { pool.mark_finished(frame); }
  static void make_latest(FramePool& pool, Frame* frame) { pool.make_latest(frame, frame->sequence); }
};
}  // namespace overtake

namespace {

FrameSizes small_sizes() {
  FrameSizes sizes;
  sizes.cluster_capacity = sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 16;
  return sizes;
}

Frame* finish_one(FramePool& pool, int64_t sequence) {
  Frame* frame = pool.acquire();
  if (!frame) return nullptr;
  frame->sequence = sequence;
  frame->tracks.x_m[0] = double(sequence);
  pool.publish(frame);
  return frame;
}

}  // namespace

TEST_CASE("frame_pool: as many frames in flight as slots, and no reader sees any of them") {
  FramePool pool;
  REQUIRE(pool.build(3, 3, small_sizes(), default_allocator()));
  Frame* frames[3];
  for (Frame*& frame : frames) REQUIRE((frame = pool.acquire()) != nullptr);
  CHECK(frames[0] != frames[1]);
  CHECK(frames[1] != frames[2]);
  CHECK(frames[0] != frames[2]);
  CHECK(pool.acquire() == nullptr);
  CHECK(pool.pin_latest() == nullptr);
  CHECK(pool.latest_sequence() == -1);
}

TEST_CASE("frame_pool: the latest stays until the next is published, a pinned frame until its readers release it") {
  FramePool pool;
  REQUIRE(pool.build(3, 3, small_sizes(), default_allocator()));
  Event event;
  pool.set_event(&event);
  Frame* first = finish_one(pool, 0);
  CHECK(pool.latest_sequence() == 0);
  REQUIRE(pool.pin_latest() == first);
  REQUIRE(pool.pin_latest() == first);  // two readers
  for (int64_t n = 1; n < 50; ++n) {
    Frame* frame = finish_one(pool, n);
    REQUIRE(frame);
    CHECK(frame != first);
  }
  CHECK(pool.latest_sequence() == 49);
  CHECK(first->tracks.x_m[0] == 0.0);
  Frame* in_flight = pool.acquire();
  REQUIRE(in_flight);
  CHECK(pool.acquire() == nullptr);  // first is pinned, one is the latest, one is in flight
  pool.release(first);
  CHECK(pool.acquire() == nullptr);
  const uint32_t before = event.look();
  pool.release(first);
  CHECK(event.look() != before);  // it wakes threads that wait for a slot
  CHECK(pool.acquire() == first);
}

TEST_CASE("frame_pool: an acquired slot is reset") {
  FramePool pool;
  REQUIRE(pool.build(1, 1, small_sizes(), default_allocator()));
  Frame* frame = pool.acquire();
  REQUIRE(frame);
  frame->flags = 7;
  frame->sensor_mask = 3;
  frame->detections.count = 5;
  frame->tracks.count = 5;
  frame->external.count = 5;
  frame->measurements.count = 5;
  frame->sensors[0].present = true;
  frame->spans[OVT_STAGE_TRACK].duration_ns = 99;
  pool.publish(frame);
  Frame* pinned = pool.pin_latest();
  REQUIRE(pinned == frame);
  pool.release(pinned);
  reset_frame(*frame);
  CHECK(frame->flags == 0);
  CHECK(frame->sensor_mask == 0);
  CHECK(frame->detections.count + frame->tracks.count + frame->external.count + frame->measurements.count == 0);
  CHECK_FALSE(frame->sensors[0].present);
  CHECK(frame->spans[OVT_STAGE_TRACK].duration_ns == -1);
}

TEST_CASE("frame_pool: without memory build fails") {
  const Allocator none = {[](size_t, size_t, void*) -> void* { return nullptr; }, [](void*, size_t, void*) {}, nullptr};
  FramePool pool;
  CHECK_FALSE(pool.build(2, 2, small_sizes(), none));
}

TEST_CASE("frame_pool: readers that race a publisher never see a frame change or an older frame") {
  constexpr int64_t kFrames = 30000;
  constexpr int kReaders = 3;
  FramePool pool;
  REQUIRE(pool.build(2 + kReaders, 2 + kReaders, small_sizes(), default_allocator()));
  std::atomic<bool> done{false};
  std::atomic<int64_t> wrong{0}, seen{0};
  std::thread readers[kReaders];
  for (std::thread& reader : readers)
    reader = std::thread([&] {
      int64_t last = -1;
      while (!done.load()) {
        const int64_t latest = pool.latest_sequence();
        Frame* frame = pool.pin_latest();
        if (!frame) continue;
        const int64_t sequence = frame->sequence;
        if (sequence < last || sequence < latest) ++wrong;
        for (int i = 0; i < 20; ++i)
          if (frame->sequence != sequence || frame->tracks.x_m[0] != double(sequence)) ++wrong;
        last = sequence;
        pool.release(frame);
        ++seen;
      }
    });
  for (int64_t n = 0; n < kFrames; ++n)
    while (!finish_one(pool, n)) std::this_thread::yield();
  while (seen.load() == 0) std::this_thread::yield();
  done.store(true);
  for (std::thread& reader : readers) reader.join();
  CHECK(wrong.load() == 0);
}

// One interleaving of a reader and two publishers, step by step: the reader knows the latest. That slot is replaced,
// freed, acquired again and finished, but is not yet the latest.
TEST_CASE("frame_pool: a slot that finishes again under a reader is not the latest until it is published") {
  FramePool pool;
  REQUIRE(pool.build(3, 3, small_sizes(), default_allocator()));
  Frame* const first = finish_one(pool, 0);
  Frame *second = nullptr, *again = nullptr;
  const auto meanwhile = [&] {
    if (second) return;
    second = finish_one(pool, 1);
    again = pool.acquire();
    again->sequence = 2;
    FramePoolSteps::mark_finished(pool, again);
  };
  Frame* const pinned = FramePoolSteps::pin_latest(pool, meanwhile);
  REQUIRE(again == first);  // the same slot that the reader knew
  Frame* const next = pool.pin_latest();
  REQUIRE(pinned);
  REQUIRE(next);
  CHECK(pinned->sequence == 1);
  CHECK(next->sequence >= pinned->sequence);
  FramePoolSteps::make_latest(pool, again);
  CHECK(pool.pin_latest() == again);
}

TEST_CASE("frame_pool: never more frames in flight than the limit, however many slots are free") {
  FramePool pool;
  REQUIRE(pool.build(5, 2, small_sizes(), default_allocator()));
  Frame* a = pool.acquire();
  Frame* b = pool.acquire();
  REQUIRE(a);
  REQUIRE(b);
  CHECK(pool.count_in_flight() == 2);
  CHECK(pool.acquire() == nullptr);
  pool.publish(a);
  CHECK(pool.count_in_flight() == 1);
  CHECK(pool.acquire() != nullptr);
  CHECK(pool.acquire() == nullptr);
  pool.publish(b);
}
