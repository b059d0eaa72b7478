// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the machine takes of a thread that does nothing: one thread a CPU, with the drivers' policy (under SCHED_FIFO
// one step above the workers, so that a worker that spins is no noise; without it, it is), that wakes once a frame, in
// the middle between two arrivals, and then spins for a while.
//
//   late      its wake-up after the time it asked for
//   stolen    what the spinning loop did not get of the CPU: all gaps in its clock of more than 2 us, until it has had
//             `window_ns` of its own; other threads, interrupts and the hypervisor look the same from here
//   noise     late + stolen of one wake-up: what a frame of that length would have lost
//
// Of several CPUs the worst at each wake-up counts. The same threads empty the caches between frames (--cold).
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace overtake::bench {

struct NoiseSample {
  int64_t late_ns = -1, stolen_ns = -1;  // -1: not measured
};

// Until the caller has had window_ns.
int64_t measure_stolen_ns(int64_t window_ns) noexcept;

// Reads and writes a block of memory from end to end.
class CacheEvictor {
 public:
  explicit CacheEvictor(std::size_t bytes) : block_(bytes / sizeof(uint64_t), 1) {}
  void walk() noexcept;

 private:
  std::vector<uint64_t> block_;
  uint64_t sum_ = 0;
};

// Bytes of the largest cache of CPU 0; 32 MiB where the system does not say.
std::size_t largest_cache_bytes();

struct NoiseDef {
  std::vector<int32_t> cpus;  // one thread each
  int32_t fifo_priority = 0;
  int64_t window_ns = 1'000'000;
  std::size_t evict_bytes = 0;  // each thread walks that much; 0: caches stay as they are
  int32_t tick_count = 0;
};

class NoiseFloor {
 public:
  explicit NoiseFloor(const NoiseDef& def);  // memory and threads; they wait for what comes first
  ~NoiseFloor();                             // ticks that are left are not done
  NoiseFloor(const NoiseFloor&) = delete;
  NoiseFloor& operator=(const NoiseFloor&) = delete;

  // Open loop: tick k is at first_ns + k * period_ns.
  void start_schedule(int64_t first_ns, int64_t period_ns);
  // Closed loop: the next tick now; returns when every thread has done it. No wake-up is timed.
  void tick();

  int32_t fifo_count() const { return fifo_count_.load(); }  // threads that run SCHED_FIFO
  // Waits for the ticks of a schedule, ends the threads; the worst of all of them, per tick.
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
