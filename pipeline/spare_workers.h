// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Workers without work of their own take parts of the work of others: a worker that would wait or sleep calls
// take_part instead. Nobody is woken up for a part, nobody waits for work that another worker has not begun, and no
// call allocates memory.
//
//   a worker with a step      offers its parts; runs those that nobody takes; waits for those that were taken
//   a spare worker            looks for offers, and runs a part of one
//
// Without a spare worker nothing is cut.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace overtake {

class SpareWorkers {
 public:
  // threads: how many may call run, each with its own number from 0 on.
  SpareWorkers(int32_t threads, int32_t most_parts);

  // Parts into which work should be cut now: one for the caller and one for each spare worker.
  int32_t count_parts() const noexcept {
    const int32_t parts = 1 + spare_.load(std::memory_order_relaxed);
    return parts < most_parts_ ? parts : most_parts_;
  }
  // Calls body(part) for each part from 0 to count - 1, on this thread and on spare workers. Returns when all have
  // returned.
  template <class Body>
  void run(int32_t thread, int32_t count, Body&& body) noexcept {
    run(
        thread, count, [](void* user, int32_t part) noexcept { (*static_cast<Body*>(user))(part); }, &body);
  }

  // A spare worker's visit, during which count_parts counts it.
  class Visit {
   public:
    explicit Visit(SpareWorkers& workers) : workers_(workers) {
      workers_.spare_.fetch_add(1, std::memory_order_relaxed);
    }
    ~Visit() { workers_.spare_.fetch_sub(1, std::memory_order_relaxed); }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    // Runs a part of another thread's work. False: there was none.
    bool take_part() noexcept;

   private:
    SpareWorkers& workers_;
  };

 private:
  using Body = void(void* user, int32_t part) noexcept;
  // The parts that nobody has taken are 0 to left - 1. Who takes one reads body and user afterwards: the offer stays
  // until all its parts are done.
  struct alignas(64) Offer {
    std::atomic<int32_t> left{0}, done{0};
    Body* body = nullptr;
    void* user = nullptr;
  };
  static bool take(Offer& offer) noexcept;
  void run(int32_t thread, int32_t count, Body* body, void* user) noexcept;

  const int32_t threads_, most_parts_;
  std::unique_ptr<Offer[]> offers_;  // one for each thread
  alignas(64) std::atomic<int32_t> spare_{0};
};

}  // namespace overtake
