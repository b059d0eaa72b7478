// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A counter of events that one thread sleeps on. Without locks; it costs a futex call only while the thread sleeps.
#pragma once

#include <atomic>
#include <cstdint>

namespace overtake {

class Event {
 public:
  uint32_t look() const noexcept { return count_.load(std::memory_order_acquire); }
  // Sleeps until the counter changes from `seen`.
  void wait(uint32_t seen) const noexcept { count_.wait(seen, std::memory_order_acquire); }
  void signal() noexcept {
    count_.fetch_add(1, std::memory_order_seq_cst);  // must come before notify_all looks for sleepers, on any CPU
    count_.notify_all();
  }

 private:
  std::atomic<uint32_t> count_{0};
};

}  // namespace overtake
