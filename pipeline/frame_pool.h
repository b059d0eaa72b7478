// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frame slots as tokens: without a free slot no frame starts. A slot is free, in flight, or finished; the pool (for the
// latest frame) and readers hold finished slots.
//
//   references of a slot:  low 32 bits: holders     bit 63: finished
//     free       0 holders
//     in flight  1 holder (the pipeline), not finished: readers cannot acquire it
//     finished   1 (the pool, while it is the latest) + readers
#pragma once

#include <atomic>
#include <memory>

#include "pipeline/event.h"
#include "pipeline/frame.h"

namespace overtake {

class FramePool {
 public:
  // At most max_in_flight slots are acquired and not finished at a time. So scans wait in the mailboxes, where the
  // newest replaces older ones, and not in the graph.
  [[nodiscard]] bool build(int32_t slot_count, int32_t max_in_flight, const FrameSizes& sizes,
                           const Allocator& allocator);

  Frame* acquire() noexcept;            // intake: a free slot, reset; null if there is none
  bool has_free() const noexcept;       // intake: whether acquire would return a slot
  void publish(Frame* frame) noexcept;  // pipeline: the frame is finished and becomes the latest
  Frame* pin_latest() noexcept {        // reader: the latest frame, held until release; null if there is none
    return pin_latest([] {});
  }
  // Sequence of the latest frame, -1 if there is none: pin_latest never returns an older one.
  int64_t latest_sequence() const noexcept { return latest_sequence_.load(std::memory_order_acquire); }
  void release(Frame* frame) noexcept;  // reader
  int64_t count_in_flight() const noexcept { return in_flight_.load(std::memory_order_acquire); }
  // Number of frames that were closed more than limit_ns ago, are in flight, and were not counted before.
  int32_t count_stalled(int64_t now_ns, int64_t limit_ns) noexcept;
  void set_event(Event* event) noexcept { event_ = event; }  // signalled when a slot becomes free

 private:
  friend struct FramePoolSteps;  // tests: actions of other threads in the middle of a call
  // `between` runs after the latest is read and before it is pinned.
  template <class Between>
  Frame* pin_latest(Between&& between) noexcept;
  void mark_finished(Frame* frame) noexcept;  // publish calls this, then updates the latest
  void make_latest(Frame* frame, int64_t sequence) noexcept;
  static constexpr uint64_t kFinished = uint64_t(1) << 63;
  static constexpr uint64_t kHolders = 0xffffffffu;
  std::unique_ptr<Frame[]> slots_;
  int32_t slot_count_ = 0, max_in_flight_ = 0;
  std::atomic<int32_t> in_flight_{0};  // acquired and not finished
  std::atomic<Frame*> latest_{nullptr};
  std::atomic<int64_t> latest_sequence_{-1};
  Event* event_ = nullptr;
};

// Between the two loads, the latest frame may have been replaced, freed, acquired again and finished again. So the
// function checks again after pinning: the slot may hold a frame that is not the latest yet, and the next pin would
// then return an older one.
template <class Between>
Frame* FramePool::pin_latest(Between&& between) noexcept {
  while (Frame* frame = latest_.load(std::memory_order_acquire)) {
    between();
    uint64_t old = frame->references.load(std::memory_order_acquire);
    if (!(old & kFinished) || (old & kHolders) == 0 ||
        !frame->references.compare_exchange_weak(old, old + 1, std::memory_order_acq_rel))
      continue;
    if (latest_.load(std::memory_order_acquire) == frame) return frame;
    release(frame);
  }
  return nullptr;
}

}  // namespace overtake
