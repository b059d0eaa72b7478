// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What our threads run as: name, CPU, SCHED_FIFO. TBB's workers belong to the whole process: each takes our settings
// with its first task of ours, keeps them while it sleeps (it must wake up with its priority), and gets its own back
// when the detector is destroyed.
#pragma once

#include <sched.h>

#include <atomic>
#include <cstdint>
#include <vector>

namespace overtake {

struct ThreadSettings {
  std::vector<int32_t> cpus;  // empty: anywhere
  int32_t fifo_priority = 0;  // 0: as it is
};

// CPUs this process may use.
int32_t count_usable_cpus() noexcept;
bool is_usable_cpu(int32_t cpu) noexcept;

// Settings of one detector's threads, and how many of them obtained what was asked for.
class ThreadRoster {
 public:
  ThreadRoster(ThreadSettings settings, int32_t worker_count);

  // On the thread itself. Worker i is pinned to cpus[i % n]; the intake may use any. Cheap when it is already so.
  void enter_worker(int32_t worker) noexcept;
  void release_worker() noexcept;
  void enter_intake() noexcept;

  int32_t pinned() const noexcept { return count(kPinned); }
  int32_t fifo() const noexcept { return count(kFifo); }

 private:
  static constexpr uint8_t kPinned = 1, kFifo = 2;
  uint8_t apply(int32_t first_cpu, int32_t cpu_count) const noexcept;
  int32_t count(uint8_t bit) const noexcept;
  const uint64_t id_;  // no two in a process
  ThreadSettings settings_;
  std::vector<std::atomic<uint8_t>> obtained_;  // [worker_count + 1]: the last is the intake's
};

// About a microsecond in a loop that looks for work. A thread of the same priority that waits for this CPU gets it:
// with SCHED_FIFO it would wait for the end of the loop, and be it the very one with the work.
inline void idle_briefly() noexcept {
  for (int32_t i = 0; i < 16; ++i) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }
  sched_yield();
}

}  // namespace overtake
