// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/noise_floor.h"

#include <algorithm>
#include <fstream>
#include <string>

#include "bench/measuring_thread.h"

namespace overtake::bench {

int64_t measure_stolen_ns(int64_t window_ns) noexcept {
  constexpr int64_t kGapNs = 2'000;  // two readings of the clock are about 50 ns apart
  const int64_t start = now_ns();
  int64_t last = start, stolen = 0;
  while (last - start - stolen < window_ns) {
    const int64_t now = now_ns();
    if (now - last > kGapNs) stolen += now - last;
    last = now;
  }
  return stolen;
}

void CacheEvictor::walk() noexcept {
  for (std::size_t i = 0; i < block_.size(); i += 8) sum_ += block_[i]++;  // one element per cache line
}

std::size_t largest_cache_bytes() {
  // Not sysconf: in a virtual machine its value is multiplied by the host's cores.
  std::size_t kib = 0;
  for (int32_t index = 0; index < 8; ++index) {
    std::ifstream file("/sys/devices/system/cpu/cpu0/cache/index" + std::to_string(index) + "/size");
    std::size_t size = 0;
    char unit = 'K';
    if (file >> size) kib = std::max(kib, file >> unit && unit == 'M' ? size << 10 : size);
  }
  return (kib > 0 ? kib : std::size_t(32) << 10) << 10;
}

NoiseFloor::NoiseFloor(const NoiseDef& def) : def_(def) {
  samples_.assign(def_.cpus.size(), std::vector<NoiseSample>(std::size_t(def_.tick_count)));
  for (std::size_t i = 0; i < def_.cpus.size(); ++i) evictors_.emplace_back(def_.evict_bytes);
  for (std::size_t i = 0; i < def_.cpus.size(); ++i) threads_.emplace_back([this, i] { run(i); });
  for (int32_t ready; (ready = ready_.load()) < int32_t(threads_.size());) ready_.wait(ready);
}

NoiseFloor::~NoiseFloor() {
  stop();
  join();
}

void NoiseFloor::stop() {
  stop_.store(true);
  int32_t waiting = kWaiting;
  mode_.compare_exchange_strong(waiting, kTicks);
  mode_.notify_all();
  wanted_.store(def_.tick_count);
  wanted_.notify_all();
}

void NoiseFloor::join() {
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void NoiseFloor::start_schedule(int64_t first_ns, int64_t period_ns) {
  first_ns_ = first_ns;
  period_ns_ = period_ns;
  mode_.store(kSchedule);
  mode_.notify_all();
}

void NoiseFloor::tick() {
  if (ticks_ == 0) {
    mode_.store(kTicks);
    mode_.notify_all();
  }
  done_.store(0);
  wanted_.store(++ticks_);
  wanted_.notify_all();
  for (int32_t done; (done = done_.load()) < int32_t(threads_.size());) done_.wait(done);
}

void NoiseFloor::run(std::size_t thread) {
  name_thread("bench-noise");
  run_on({def_.cpus[thread]});
  if (def_.fifo_priority > 0 && run_fifo(def_.fifo_priority)) fifo_count_.fetch_add(1);
  ready_.fetch_add(1);
  ready_.notify_all();
  mode_.wait(kWaiting);
  for (int32_t k = 0; k < def_.tick_count; ++k) {
    NoiseSample& sample = samples_[thread][std::size_t(k)];
    const bool scheduled = mode_.load() == kSchedule;
    if (scheduled) {
      const int64_t at = first_ns_ + k * period_ns_;
      sleep_until(at);
      sample.late_ns = now_ns() - at;
    } else {
      for (int32_t wanted; (wanted = wanted_.load()) <= k;) wanted_.wait(wanted);
    }
    if (stop_.load()) return;
    sample.stolen_ns = measure_stolen_ns(def_.window_ns);
    if (def_.evict_bytes > 0) evictors_[thread].walk();
    if (!scheduled) {
      done_.fetch_add(1);
      done_.notify_all();
    }
  }
}

std::vector<NoiseSample> NoiseFloor::take() {
  if (mode_.load() != kSchedule) stop();
  join();
  std::vector<NoiseSample> worst(std::size_t(def_.tick_count));
  for (std::size_t k = 0; k < worst.size(); ++k)
    for (const std::vector<NoiseSample>& of_thread : samples_) {
      const NoiseSample& sample = of_thread[k];
      if (sample.late_ns + sample.stolen_ns >= worst[k].late_ns + worst[k].stolen_ns) worst[k] = sample;
    }
  return worst;
}

}  // namespace overtake::bench
