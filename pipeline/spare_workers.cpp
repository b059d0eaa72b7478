// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/spare_workers.h"

#include "core/check.h"
#include "pipeline/threads.h"

namespace overtake {

SpareWorkers::SpareWorkers(int32_t threads, int32_t most_parts)
    : threads_(threads), most_parts_(most_parts), offers_(std::make_unique<Offer[]>(std::size_t(threads))) {}

bool SpareWorkers::take(Offer& offer) noexcept {
  int32_t left = offer.left.load(std::memory_order_relaxed);
  while (left > 0)
    if (offer.left.compare_exchange_weak(left, left - 1, std::memory_order_acquire, std::memory_order_relaxed)) {
      offer.body(offer.user, left - 1);
      offer.done.fetch_add(1, std::memory_order_release);
      return true;
    }
  return false;
}

void SpareWorkers::run(int32_t thread, int32_t count, Body* body, void* user) noexcept {
  OVT_CHECK(thread >= 0 && thread < threads_);
  Offer& offer = offers_[std::size_t(thread)];
  offer.body = body;
  offer.user = user;
  offer.done.store(0, std::memory_order_relaxed);
  offer.left.store(count, std::memory_order_release);
  while (take(offer)) {
  }
  constexpr int32_t kPatience = 4096;  // a part takes microseconds, unless the system took the worker's CPU
  for (int32_t i = 0; offer.done.load(std::memory_order_acquire) < count; ++i)
    i < kPatience ? pause_cpu() : idle_briefly();
}

bool SpareWorkers::Visit::take_part() noexcept {
  for (int32_t i = 0; i < workers_.threads_; ++i)
    if (take(workers_.offers_[std::size_t(i)])) return true;
  return false;
}

}  // namespace overtake
