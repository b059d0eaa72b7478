// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// "Something happened": a counter that one thread sleeps on. No lock; a futex wake only while somebody sleeps.
#pragma once

#include <atomic>
#include <cstdint>

namespace overtake {

class Event {
 public:
  uint32_t look() const noexcept { return count_.load(std::memory_order_acquire); }
  // Sleeps until anything was signalled after `seen` was looked at.
  void wait(uint32_t seen) const noexcept { count_.wait(seen, std::memory_order_acquire); }
  void signal() noexcept {
    count_.fetch_add(1, std::memory_order_seq_cst);  // not after notify_all looks for sleepers, on any CPU
    count_.notify_all();
  }

 private:
  std::atomic<uint32_t> count_{0};
};

}  // namespace overtake
