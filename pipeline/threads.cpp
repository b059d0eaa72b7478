// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/threads.h"

#include <pthread.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <utility>

namespace overtake {
namespace {

constexpr const char* kWorkerName = "ovt-worker-";

struct Settings {
  cpu_set_t cpus{};
  int policy = SCHED_OTHER;
  sched_param param{};
  char name[16] = "";
  void read() noexcept {  // of this thread
    pthread_getname_np(pthread_self(), name, sizeof name);
    sched_getaffinity(0, sizeof cpus, &cpus);
    pthread_getschedparam(pthread_self(), &policy, &param);
  }
};
void set_cpus(pthread_t thread, const Settings& s) { pthread_setaffinity_np(thread, sizeof s.cpus, &s.cpus); }
void set_policy(pthread_t thread, const Settings& s) { pthread_setschedparam(thread, s.policy, &s.param); }
void set_name(pthread_t thread, const Settings& s) { pthread_setname_np(thread, s.name); }

// A thread's settings before a detector changed them, and the detector that changed them.
struct Before {
  pthread_t thread{};
  std::atomic<uint64_t> owner{0};  // id of a ThreadSetup, 0 none: then the thread alone reads and writes all of this
  std::mutex giving_back;
  int32_t worker = -1;
  bool pinned = false, fifo = false;
  Settings settings;
  // In the list: from then on constant, read by other threads.
  Settings first;
  Before *previous = nullptr, *next = nullptr;
};
// initial-exec: the first use on a thread allocates no memory, also in a shared library.
[[gnu::tls_model("initial-exec")]] constinit thread_local Before before;

// All threads that have been workers of a detector, until they end.
std::mutex list_mutex;
Before* first_listed = nullptr;

struct Listing {
  Listing() {
    const std::lock_guard<std::mutex> lock(list_mutex);
    before.thread = pthread_self();
    before.first.read();
    // A thread that a worker started has its settings and its name. Its own are those that the worker once had.
    if (first_listed && std::strncmp(before.first.name, kWorkerName, std::strlen(kWorkerName)) == 0) {
      before.first = first_listed->first;
      set_cpus(before.thread, before.first);
      set_policy(before.thread, before.first);
      set_name(before.thread, before.first);
    }
    before.next = first_listed;
    if (first_listed) first_listed->previous = &before;
    first_listed = &before;
  }
  ~Listing() {
    const std::lock_guard<std::mutex> lock(list_mutex);
    (before.previous ? before.previous->next : first_listed) = before.next;
    if (before.next) before.next->previous = before.previous;
  }
};

// Gives a thread back what it had before this owner. Called by the thread itself, which begins to work for another
// detector, or by the one that destroys the owner: each of them may find it done.
void give_back(Before& of, uint64_t owner) noexcept {
  const std::lock_guard<std::mutex> lock(of.giving_back);
  if (of.owner.load(std::memory_order_acquire) != owner) return;
  if (std::exchange(of.pinned, false)) set_cpus(of.thread, of.settings);
  if (std::exchange(of.fifo, false)) set_policy(of.thread, of.settings);
  set_name(of.thread, of.settings);
  of.worker = -1;
  of.owner.store(0, std::memory_order_release);
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

void ThreadSetup::list_this_thread() noexcept { [[maybe_unused]] static thread_local const Listing listing; }

void ThreadSetup::enter_worker(int32_t worker) noexcept {
  if (worker < 0 || std::size_t(worker) + 1 >= granted_.size()) return;
  const uint64_t owner = before.owner.load(std::memory_order_acquire);
  if (owner == id_ && before.worker == worker) return;
  if (owner != id_) {
    list_this_thread();
    if (owner != 0) give_back(before, owner);
    before.settings.read();
  }
  char name[16];
  std::snprintf(name, sizeof name, "%s%d", kWorkerName, worker % 1000);
  pthread_setname_np(pthread_self(), name);
  const bool pins = !settings_.cpus.empty();
  const uint8_t granted = apply(pins ? worker % int32_t(settings_.cpus.size()) : 0, pins ? 1 : 0);
  before.worker = worker;
  before.pinned |= (granted & kPinned) != 0;
  before.fifo |= (granted & kFifo) != 0;
  before.owner.store(id_, std::memory_order_release);
  granted_[std::size_t(worker)].store(granted, std::memory_order_relaxed);
}

void ThreadSetup::release_workers() noexcept {
  const std::lock_guard<std::mutex> lock(list_mutex);
  for (Before* of = first_listed; of; of = of->next) give_back(*of, id_);
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
