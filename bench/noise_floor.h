// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Measures the delays of an idle thread on this machine. One thread per CPU, with the drivers' policy, wakes once per
// frame, in the middle between two arrivals, and then spins for a while. Under SCHED_FIFO it runs one step above the
// workers, so a spinning worker is not noise; without SCHED_FIFO it is.
//
//   late      delay of the wake-up
//   stolen    CPU time that the spinning loop did not get: the sum of all gaps in its clock of more than 2 us, until it
//             ran for `window_ns`. Other threads, interrupts and the hypervisor cannot be distinguished
//   noise     late + stolen of one wake-up: the time that a frame of that length would have lost
//
// With several CPUs, the worst one at each wake-up counts. The same threads evict the caches between frames (--cold).
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace overtake::bench {

struct NoiseSample {
  int64_t late_ns = -1, stolen_ns = -1;  // -1: not measured
};

// Spins until the calling thread has run for window_ns.
int64_t measure_stolen_ns(int64_t window_ns) noexcept;

// Reads and writes a block of memory from start to end.
class CacheEvictor {
 public:
  explicit CacheEvictor(std::size_t bytes) : block_(bytes / sizeof(uint64_t), 1) {}
  void walk() noexcept;

 private:
  std::vector<uint64_t> block_;
  uint64_t sum_ = 0;
};

// Size of the largest cache of CPU 0; 32 MiB if the system does not tell.
std::size_t largest_cache_bytes();

struct NoiseDef {
  std::vector<int32_t> cpus;  // one thread each
  int32_t fifo_priority = 0;
  int64_t window_ns = 1'000'000;
  std::size_t evict_bytes = 0;  // memory that each thread touches; 0: the caches are not evicted
  int32_t tick_count = 0;
};

class NoiseFloor {
 public:
  explicit NoiseFloor(const NoiseDef& def);  // allocates memory and starts threads, which then wait
  ~NoiseFloor();                             // skips the remaining ticks
  NoiseFloor(const NoiseFloor&) = delete;
  NoiseFloor& operator=(const NoiseFloor&) = delete;

  // Open loop: tick k is at first_ns + k * period_ns.
  void start_schedule(int64_t first_ns, int64_t period_ns);
  // Closed loop: runs one tick now; returns when every thread has done it. Does not measure wake-ups.
  void tick();

  int32_t fifo_count() const { return fifo_count_.load(); }  // threads that run SCHED_FIFO
  // Waits for the end of the schedule, ends the threads, and returns the worst of all threads per tick.
  std::vector<NoiseSample> take();

 private:
  enum Mode : int32_t { kWaiting, kSchedule, kTicks };
  void run(std::size_t thread);
  void stop();
  void join();

  NoiseDef def_;
  std::vector<std::vector<NoiseSample>> samples_;  // per thread and tick
  std::vector<CacheEvictor> evictors_;
  std::vector<std::thread> threads_;
  std::atomic<int32_t> mode_{kWaiting}, wanted_{0}, done_{0}, ready_{0}, fifo_count_{0};
  std::atomic<bool> stop_{false};
  int64_t first_ns_ = 0, period_ns_ = 0;
  int32_t ticks_ = 0;
};

}  // namespace overtake::bench
