// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One sensor's mailbox: the newest scan waits, an older one that still waited is replaced. One producer, one taker;
// neither ever waits for the other: each swaps its own scan for the one in the middle, in one instruction.
//
//   three scans:  being written (producer)   in the middle, fresh or stale   in hand or stale (taker)
#pragma once

#include <atomic>
#include <cstdint>

#include "core/table.h"
#include "core/point_table.h"
#include "pipeline/stage_clock.h"

namespace overtake {

struct Scan {
  ScanTable table;
  int64_t stamp_ns = 0;
  int64_t ego_count = 0;       // ego poses that were pushed before it
  StageSpan load;              // its copy
};

class Mailbox {
 public:
  [[nodiscard]] bool build(int32_t point_capacity, const Allocator& allocator) {
    return arena_.build(allocator, [&](Carver& carver) {
      for (Scan& scan : scans_) carve_table(carver, scan.table, point_capacity);
    });
  }

  // Producer: fill it, then post it. post() is true when it replaced a scan that still waited.
  Scan& writable() noexcept { return scans_[writing_]; }
  bool post() noexcept {
    const int32_t old = middle_.exchange(writing_ | kFresh, std::memory_order_seq_cst);
    writing_ = old & kIndex;
    return old & kFresh;
  }
  // Producer: sleeps while a scan waits.
  void wait_until_taken() const noexcept {
    for (int32_t seen; (seen = middle_.load(std::memory_order_acquire)) & kFresh;)
      middle_.wait(seen, std::memory_order_acquire);
  }

  // Taker: takes the waiting scan in hand (giving back an older one in hand: true in `replaced`). False: none waits.
  bool take(bool& replaced) noexcept {
    if (!(middle_.load(std::memory_order_acquire) & kFresh)) return false;   // only the taker makes it stale
    reading_ = middle_.exchange(reading_, std::memory_order_seq_cst) & kIndex;
    middle_.notify_all();
    replaced = in_hand_;
    in_hand_ = true;
    return true;
  }
  Scan* in_hand() noexcept { return in_hand_ ? &scans_[reading_] : nullptr; }
  void drop_hand() noexcept { in_hand_ = false; }

 private:
  static constexpr int32_t kIndex = 3, kFresh = 4;
  Arena arena_;
  Scan scans_[3];
  std::atomic<int32_t> middle_{1};   // index, and whether it waits to be taken
  int32_t writing_ = 0;              // producer's
  int32_t reading_ = 2;              // taker's
  bool in_hand_ = false;             // taker's: what it reads is not done with
};

}  // namespace overtake
