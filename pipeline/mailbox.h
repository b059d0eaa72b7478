// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A producer's mailbox: a triple buffer. It keeps the newest slot (a scan, or a table of detections); a newer one
// replaces it. One producer, one consumer, and neither waits for the other: each exchanges its slot for the middle one
// with one atomic instruction.
//
//   three slots:  written (producer)   middle: fresh or stale   acquired: pending or stale (consumer)
#pragma once

#include <atomic>
#include <cstdint>

#include "core/point_table.h"
#include "core/table.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/stage_clock.h"

namespace overtake {

struct EarlyColumns;

struct Scan {
  ScanTable table;
  int64_t stamp_ns = 0;
  uint64_t ticket = 0;    // pushes of all sources before this one
  EgoRange ego;           // ego poses that were pushed before this scan
  StageSpan load;         // time of the copy; of a scan in pieces, the sum
  int64_t pushed_ns = 0;  // steady clock: the copy, or the call that ended a scan in pieces
  bool is_incomplete = false;
  EarlyColumns* early = nullptr;  // null: none. Stays here, for the next scan, unless a frame takes it
};

template <class Slot>  // has a `table`
class Mailbox {
 public:
  [[nodiscard]] bool build(int32_t row_capacity, const Allocator& allocator) {
    return arena_.build(allocator, [&](Carver& carver) {
      for (Slot& slot : slots_) carve_table(carver, slot.table, row_capacity);
    });
  }

  // Producer: fill the slot, then post it. post() returns true if it replaced a fresh slot.
  Slot& writable() noexcept { return slots_[writing_]; }
  bool post() noexcept {
    const int32_t old = middle_.exchange(writing_ | kFresh, std::memory_order_seq_cst);
    writing_ = old & kIndex;
    return old & kFresh;
  }
  // Producer: sleeps while the middle slot is fresh.
  void wait_until_acquired() const noexcept {
    for (int32_t seen; (seen = middle_.load(std::memory_order_acquire)) & kFresh;)
      middle_.wait(seen, std::memory_order_acquire);
  }

  // Consumer: acquires a fresh slot; false if there is none. `replaced`: the earlier one was still pending.
  bool acquire(bool& replaced) noexcept {
    if (!(middle_.load(std::memory_order_acquire) & kFresh)) return false;  // only the consumer makes it stale
    reading_ = middle_.exchange(reading_, std::memory_order_seq_cst) & kIndex;
    middle_.notify_all();
    replaced = is_pending_;
    is_pending_ = true;
    return true;
  }
  Slot* pending() noexcept { return is_pending_ ? &slots_[reading_] : nullptr; }
  void release() noexcept { is_pending_ = false; }

 private:
  static constexpr int32_t kIndex = 3, kFresh = 4;
  Arena arena_;
  Slot slots_[3];
  std::atomic<int32_t> middle_{1};  // index, and kFresh if it is not yet acquired
  int32_t writing_ = 0;             // written by the producer only
  int32_t reading_ = 2;             // written by the consumer only
  bool is_pending_ = false;         // the consumer acquired the slot and did not release it
};

}  // namespace overtake
