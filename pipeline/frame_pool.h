// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frame slots as tokens: no free slot, no admission. A slot is free, in flight, or finished and held by the pool (as
// the latest) and by readers.
//
//   references of a slot:  low 32 bits: holders     bit 63: finished
//     free       0 holders
//     in flight  1 holder (the pipeline), not finished: readers cannot take it
//     finished   1 (the pool, while it is the latest) + readers
#pragma once

#include <atomic>
#include <memory>

#include "pipeline/event.h"
#include "pipeline/frame.h"

namespace overtake {

class FramePool {
 public:
  // At most max_in_flight slots are taken and not finished at a time: data waits in the mailboxes, where the newest
  // replaces it, not in the graph.
  [[nodiscard]] bool build(int32_t slot_count, int32_t max_in_flight, const FrameSizes& sizes,
                           const Allocator& allocator);

  Frame* acquire() noexcept;            // intake: a free slot, reset, or null
  bool has_free() const noexcept;       // intake: acquire would give one
  void publish(Frame* frame) noexcept;  // pipeline: finished, and the latest from now on
  Frame* pin_latest() noexcept {        // reader: the latest, held until release; null when there is none
    return pin_latest([] {});
  }
  // Of the latest, -1 when there is none: pin_latest will not give an older one.
  int64_t latest_sequence() const noexcept { return latest_sequence_.load(std::memory_order_acquire); }
  void release(Frame* frame) noexcept;  // reader
  int64_t count_in_flight() const noexcept { return in_flight_.load(std::memory_order_acquire); }
  // Frames that were closed more than limit_ns ago, are in flight, and were not counted before.
  int32_t count_stalled(int64_t now_ns, int64_t limit_ns) noexcept;
  void set_event(Event* event) noexcept { event_ = event; }  // told when a slot becomes free

 private:
  friend struct FramePoolSteps;  // tests: what other threads may do in the middle of a call
  // `between` runs when the latest is known and not pinned yet.
  template <class Between>
  Frame* pin_latest(Between&& between) noexcept;
  void mark_finished(Frame* frame) noexcept;  // publish is the one, then the other
  void make_latest(Frame* frame, int64_t sequence) noexcept;
  static constexpr uint64_t kFinished = uint64_t(1) << 63;
  static constexpr uint64_t kHolders = 0xffffffffu;
  std::unique_ptr<Frame[]> slots_;
  int32_t slot_count_ = 0, max_in_flight_ = 0;
  std::atomic<int32_t> in_flight_{0};  // taken and not finished
  std::atomic<Frame*> latest_{nullptr};
  std::atomic<int64_t> latest_sequence_{-1};
  Event* event_ = nullptr;
};

// Between the two loads the latest may have been replaced, freed, taken again and finished again: pinned, it is looked
// at once more, for it may be one that is not the latest yet, and the next pin would go back.
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
