// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_pool.h"

#include <new>

namespace overtake {

bool FramePool::build(int32_t slot_count, int32_t max_in_flight, const FrameSizes& sizes, const Allocator& allocator) {
  slots_.reset(new (std::nothrow) Frame[std::size_t(slot_count)]);
  if (!slots_) return false;
  slot_count_ = slot_count;
  max_in_flight_ = max_in_flight;
  for (int32_t i = 0; i < slot_count; ++i)
    if (!build_frame(slots_[std::size_t(i)], sizes, allocator)) return false;
  return true;
}

// Returns the lowest free slot: the slot used last is most likely in the cache.
Frame* FramePool::acquire() noexcept {
  if (in_flight_.load(std::memory_order_acquire) >= max_in_flight_) return nullptr;
  for (int32_t i = 0; i < slot_count_; ++i) {
    Frame& frame = slots_[std::size_t(i)];
    uint64_t old = frame.references.load(std::memory_order_acquire);
    if ((old & kHolders) == 0 && frame.references.compare_exchange_strong(old, 1, std::memory_order_acq_rel)) {
      in_flight_.fetch_add(1, std::memory_order_relaxed);
      reset_frame(frame);
      return &frame;
    }
  }
  return nullptr;
}

bool FramePool::has_free() const noexcept {
  if (in_flight_.load(std::memory_order_acquire) >= max_in_flight_) return false;
  for (int32_t i = 0; i < slot_count_; ++i)
    if ((slots_[std::size_t(i)].references.load(std::memory_order_acquire) & kHolders) == 0) return true;
  return false;
}

void FramePool::publish(Frame* frame) noexcept {
  const int64_t sequence = frame->sequence;  // read before the release: a reader may free the slot during this call
  mark_finished(frame);
  make_latest(frame, sequence);
}

void FramePool::mark_finished(Frame* frame) noexcept {
  frame->references.store(kFinished | 1, std::memory_order_release);
}

void FramePool::make_latest(Frame* frame, int64_t sequence) noexcept {
  Frame* old = latest_.exchange(frame, std::memory_order_acq_rel);
  latest_sequence_.store(sequence, std::memory_order_release);
  in_flight_.fetch_sub(1, std::memory_order_release);
  if (old) release(old);
}

int32_t FramePool::count_stalled(int64_t now_ns, int64_t limit_ns) noexcept {
  int32_t count = 0;
  for (int32_t i = 0; i < slot_count_; ++i) {
    Frame& frame = slots_[std::size_t(i)];
    const uint64_t references = frame.references.load(std::memory_order_acquire);
    if ((references & kHolders) != 1 || (references & kFinished)) continue;
    const int64_t closed_ns = frame.closed_ns.load(std::memory_order_relaxed);
    if (closed_ns == 0 || now_ns - closed_ns <= limit_ns || frame.stall_counted) continue;
    frame.stall_counted = true;
    ++count;
  }
  return count;
}

void FramePool::release(Frame* frame) noexcept {
  const uint64_t old = frame->references.fetch_sub(1, std::memory_order_acq_rel);
  if ((old & kHolders) == 1 && event_) event_->signal();
}

}  // namespace overtake
