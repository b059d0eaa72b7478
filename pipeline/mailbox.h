// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A producer's mailbox: the newest letter (a scan, a table of detections) waits, an older one that still waited is
// replaced. One producer, one taker; neither ever waits for the other: each swaps its own letter for the one in the
// middle, in one instruction.
//
//   three letters:  being written (producer)   in the middle, fresh or stale   in hand or stale (taker)
#pragma once

#include <atomic>
#include <cstdint>

#include "core/point_table.h"
#include "core/table.h"
#include "pipeline/ego_buffer.h"
#include "pipeline/stage_clock.h"

namespace overtake {

struct Scan {
  ScanTable table;
  int64_t stamp_ns = 0;
  uint64_t ticket = 0;  // pushes before it, of all sources
  EgoMark ego;          // ego poses that were pushed before it
  StageSpan load;       // its copy
};

template <class Letter>  // with a `table`
class Mailbox {
 public:
  [[nodiscard]] bool build(int32_t row_capacity, const Allocator& allocator) {
    return arena_.build(allocator, [&](Carver& carver) {
      for (Letter& letter : letters_) carve_table(carver, letter.table, row_capacity);
    });
  }

  // Producer: fill it, then post it. post() is true when it replaced a letter that still waited.
  Letter& writable() noexcept { return letters_[writing_]; }
  bool post() noexcept {
    const int32_t old = middle_.exchange(writing_ | kFresh, std::memory_order_seq_cst);
    writing_ = old & kIndex;
    return old & kFresh;
  }
  // Producer: sleeps while a letter waits.
  void wait_until_taken() const noexcept {
    for (int32_t seen; (seen = middle_.load(std::memory_order_acquire)) & kFresh;)
      middle_.wait(seen, std::memory_order_acquire);
  }

  // Taker: takes the waiting letter in hand (giving back an older one in hand: true in `replaced`). False: none waits.
  bool take(bool& replaced) noexcept {
    if (!(middle_.load(std::memory_order_acquire) & kFresh)) return false;  // only the taker makes it stale
    reading_ = middle_.exchange(reading_, std::memory_order_seq_cst) & kIndex;
    middle_.notify_all();
    replaced = in_hand_;
    in_hand_ = true;
    return true;
  }
  Letter* in_hand() noexcept { return in_hand_ ? &letters_[reading_] : nullptr; }
  void drop_hand() noexcept { in_hand_ = false; }

 private:
  static constexpr int32_t kIndex = 3, kFresh = 4;
  Arena arena_;
  Letter letters_[3];
  std::atomic<int32_t> middle_{1};  // index, and whether it waits to be taken
  int32_t writing_ = 0;             // producer's
  int32_t reading_ = 2;             // taker's
  bool in_hand_ = false;            // taker's: what it reads is not done with
};

}  // namespace overtake
