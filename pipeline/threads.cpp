// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/threads.h"

#include <pthread.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace overtake {
namespace {

// A thread's settings before a detector changed them, and the detector that changed them.
struct Before {
  uint64_t owner = 0;  // id of a ThreadSetup, 0 none
  int32_t worker = -1;
  bool pinned = false, fifo = false;
  cpu_set_t cpus;
  int policy = SCHED_OTHER;
  sched_param param{};
  char name[16] = "";
};
// initial-exec: the first use on a thread allocates no memory, also in a shared library.
[[gnu::tls_model("initial-exec")]] thread_local Before before;

void restore_settings() noexcept {
  if (std::exchange(before.pinned, false)) sched_setaffinity(0, sizeof before.cpus, &before.cpus);
  if (std::exchange(before.fifo, false)) pthread_setschedparam(pthread_self(), before.policy, &before.param);
}

uint64_t next_setup_id() noexcept {
  static std::atomic<uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

int32_t count_usable_cpus() noexcept {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return std::max(1, CPU_COUNT(&set));
  return 1;
}

bool is_usable_cpu(int32_t cpu) noexcept {
  cpu_set_t set;
  return cpu >= 0 && cpu < CPU_SETSIZE && sched_getaffinity(0, sizeof set, &set) == 0 && CPU_ISSET(cpu, &set);
}

ThreadSetup::ThreadSetup(ThreadSettings settings, int32_t worker_count)
    : id_(next_setup_id()), settings_(std::move(settings)), granted_(std::size_t(worker_count) + 1) {}

uint8_t ThreadSetup::apply(int32_t first_cpu, int32_t cpu_count) const noexcept {
  uint8_t granted = 0;
  if (cpu_count > 0) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (int32_t i = first_cpu; i < first_cpu + cpu_count; ++i) CPU_SET(settings_.cpus[std::size_t(i)], &set);
    if (sched_setaffinity(0, sizeof set, &set) == 0) granted |= kPinned;
  }
  if (settings_.fifo_priority > 0) {
    sched_param param{};
    param.sched_priority = settings_.fifo_priority;
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) == 0) granted |= kFifo;
  }
  return granted;
}

void ThreadSetup::enter_worker(int32_t worker) noexcept {
  if (worker < 0 || std::size_t(worker) + 1 >= granted_.size()) return;
  if (before.owner == id_ && before.worker == worker) return;
  if (before.owner != 0 && before.owner != id_) restore_settings();  // of another detector
  if (before.owner == 0) {
    pthread_getname_np(pthread_self(), before.name, sizeof before.name);
    sched_getaffinity(0, sizeof before.cpus, &before.cpus);
    pthread_getschedparam(pthread_self(), &before.policy, &before.param);
  }
  char name[16];
  std::snprintf(name, sizeof name, "ovt-worker-%d", worker % 1000);
  pthread_setname_np(pthread_self(), name);
  const bool pins = !settings_.cpus.empty();
  const uint8_t granted = apply(pins ? worker % int32_t(settings_.cpus.size()) : 0, pins ? 1 : 0);
  before.owner = id_;
  before.worker = worker;
  before.pinned |= (granted & kPinned) != 0;
  before.fifo |= (granted & kFifo) != 0;
  granted_[std::size_t(worker)].store(granted, std::memory_order_relaxed);
}

void ThreadSetup::release_worker() noexcept {
  if (before.owner != id_) return;
  restore_settings();
  pthread_setname_np(pthread_self(), before.name);
  before = Before{};
}

void ThreadSetup::enter_intake() noexcept {
  pthread_setname_np(pthread_self(), "ovt-intake");
  granted_.back().store(apply(0, int32_t(settings_.cpus.size())), std::memory_order_relaxed);
}

int32_t ThreadSetup::count(uint8_t bit) const noexcept {
  return int32_t(std::count_if(granted_.begin(), granted_.end(),
                               [bit](const auto& o) { return o.load(std::memory_order_relaxed) & bit; }));
}

}  // namespace overtake
