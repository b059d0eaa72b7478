// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Threads of oneTBB that share the indices of a loop. The loop's results must not depend on which thread runs which
// index.
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <cstdint>
#include <optional>

namespace overtake::sim {

class Workers {
 public:
  explicit Workers(int32_t count)  // 0: one per CPU
      : arena_(count > 0 ? count : oneapi::tbb::task_arena::automatic) {
    const std::size_t threads = std::size_t(arena_.max_concurrency());
    if (threads > Limit::active_value(Limit::max_allowed_parallelism))
      more_.emplace(Limit::max_allowed_parallelism, threads);
  }

  // Calls body(0..count-1), each once; returns when all are done. Rethrows the first exception; the other indices may
  // then be left out.
  template <class Body>
  void for_each(int32_t count, const Body& body) {
    arena_.execute([&] { oneapi::tbb::parallel_for(int32_t(0), count, body, oneapi::tbb::simple_partitioner()); });
  }
  int32_t count() const { return arena_.max_concurrency(); }

 private:
  using Limit = oneapi::tbb::global_control;
  oneapi::tbb::task_arena arena_;  // starts no thread before its first use
  std::optional<Limit> more_;      // more threads than CPUs
};

}  // namespace overtake::sim
