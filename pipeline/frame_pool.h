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
  Frame* pin_latest() noexcept;         // reader: the latest, held until release; null when there is none
  // Of the latest, -1 when there is none: pin_latest will not give an older one.
  int64_t latest_sequence() const noexcept { return latest_sequence_.load(std::memory_order_acquire); }
  void release(Frame* frame) noexcept;  // reader
  int64_t count_in_flight() const noexcept { return in_flight_.load(std::memory_order_acquire); }
  // Frames that were closed more than limit_ns ago, are in flight, and were not counted before.
  int32_t count_stalled(int64_t now_ns, int64_t limit_ns) noexcept;
  void set_event(Event* event) noexcept { event_ = event; }  // told when a slot becomes free

 private:
  static constexpr uint64_t kFinished = uint64_t(1) << 63;
  static constexpr uint64_t kHolders = 0xffffffffu;
  std::unique_ptr<Frame[]> slots_;
  int32_t slot_count_ = 0, max_in_flight_ = 0;
  std::atomic<int32_t> in_flight_{0};  // taken and not finished
  std::atomic<Frame*> latest_{nullptr};
  std::atomic<int64_t> latest_sequence_{-1};
  Event* event_ = nullptr;
};

}  // namespace overtake
