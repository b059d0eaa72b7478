// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Name, CPU and SCHED_FIFO priority of the library's threads. TBB's workers belong to the whole process. Each gets
// these settings with its first task of a detector, keeps them while it sleeps (it must wake up with its priority), and
// gets its previous settings back when the detector is destroyed, wherever the worker is then: the thread that destroys
// sets them.
#pragma once

#include <sched.h>

#include <atomic>
#include <cstdint>
#include <vector>

namespace overtake {

struct ThreadSettings {
  std::vector<int32_t> cpus;  // empty: any CPU
  int32_t fifo_priority = 0;  // 0: unchanged
};

// CPUs that this process may use.
int32_t count_usable_cpus() noexcept;
bool is_usable_cpu(int32_t cpu) noexcept;

// Settings of one detector's threads, and the number of threads for which the system granted them.
class ThreadSetup {
 public:
  ThreadSetup(ThreadSettings settings, int32_t worker_count);

  // Call on a worker before its first frame: a thread's first call allocates memory.
  static void list_this_thread() noexcept;
  // Call on the thread itself. Worker i is pinned to cpus[i % n]; the intake may use any. Cheap if already set.
  void enter_worker(int32_t worker) noexcept;
  void enter_intake() noexcept;
  // Gives all workers their previous settings. Any thread; none of this detector's tasks may run.
  void release_workers() noexcept;

  int32_t pinned() const noexcept { return count(kPinned); }
  int32_t fifo() const noexcept { return count(kFifo); }

 private:
  static constexpr uint8_t kPinned = 1, kFifo = 2;
  uint8_t apply(int32_t first_cpu, int32_t cpu_count) const noexcept;
  int32_t count(uint8_t bit) const noexcept;
  const uint64_t id_;  // unique in the process
  ThreadSettings settings_;
  std::vector<std::atomic<uint8_t>> granted_;  // [worker_count + 1]: the last is the intake's
};

// One round of a loop that waits for another thread, which is about to be ready.
inline void pause_cpu() noexcept {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// About a microsecond in a loop that looks for work. Yields the CPU to a thread of the same priority: with SCHED_FIFO
// that thread would otherwise wait until the loop ends, and it may be the one that brings the work.
inline void idle_briefly() noexcept {
  for (int32_t i = 0; i < 16; ++i) pause_cpu();
  sched_yield();
}

}  // namespace overtake
