// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Threads that share the indices of a loop. The loop's results must not depend on which thread runs which index.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace overtake::sim {

class Workers {
 public:
  explicit Workers(int32_t count);  // 0: one per CPU
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  // Calls body(0..count-1), each once; returns when all are done. Rethrows the first exception.
  void for_each(int32_t count, const std::function<void(int32_t)>& body);
  int32_t count() const { return int32_t(threads_.size()) + 1; }

 private:
  void work();
  void take(const std::function<void(int32_t)>& body, int32_t count);

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable begin_, end_;
  const std::function<void(int32_t)>* body_ = nullptr;
  int32_t loop_count_ = 0, busy_ = 0;
  uint64_t loop_ = 0;
  bool stop_ = false;
  std::atomic<int32_t> next_{0};
  std::exception_ptr error_;
};

}  // namespace overtake::sim
