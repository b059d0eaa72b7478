// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/workers.h"

#include <algorithm>

namespace overtake::sim {

Workers::Workers(int32_t count) {
  if (count <= 0) count = std::max(1, int32_t(std::thread::hardware_concurrency()));
  for (int32_t i = 1; i < count; ++i) threads_.emplace_back([this] { work(); });
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  begin_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::take(const std::function<void(int32_t)>& body, int32_t count) {
  for (int32_t i = next_++; i < count; i = next_++) {
    try {
      body(i);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }
}

void Workers::work() {
  uint64_t seen = 0;
  for (;;) {
    std::unique_lock lock(mutex_);
    begin_.wait(lock, [&] { return stop_ || loop_ != seen; });
    if (stop_) return;
    seen = loop_;
    const auto* body = body_;
    const int32_t count = loop_count_;
    lock.unlock();
    take(*body, count);
    lock.lock();
    if (--busy_ == 0) end_.notify_one();
  }
}

void Workers::for_each(int32_t count, const std::function<void(int32_t)>& body) {
  {
    const std::lock_guard lock(mutex_);
    body_ = &body;
    loop_count_ = count;
    busy_ = int32_t(threads_.size());
    error_ = nullptr;
    next_ = 0;
    ++loop_;
  }
  begin_.notify_all();
  take(body, count);
  std::unique_lock lock(mutex_);
  end_.wait(lock, [&] { return busy_ == 0; });
  if (error_) std::rethrow_exception(error_);
}

}  // namespace overtake::sim
