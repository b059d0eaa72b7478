// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Threads of oneTBB that share the indices of a loop. The loop's results must not depend on which thread runs which
// index.
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstdint>

namespace overtake::sim {

class Workers {
 public:
  explicit Workers(int32_t count)  // 0: one per CPU
      : limit_(Limit::max_allowed_parallelism,
               std::max(std::size_t(std::max(count, 1)), Limit::active_value(Limit::max_allowed_parallelism))),
        arena_(count > 0 ? count : oneapi::tbb::task_arena::automatic) {}

  // Calls body(0..count-1), each once; returns when all are done. Rethrows the first exception; the other indices may
  // then be left out.
  template <class Body>
  void for_each(int32_t count, const Body& body) {
    arena_.execute([&] { oneapi::tbb::parallel_for(int32_t(0), count, body, oneapi::tbb::simple_partitioner()); });
  }
  int32_t count() const { return arena_.max_concurrency(); }

 private:
  using Limit = oneapi::tbb::global_control;
  Limit limit_;  // also more threads than CPUs
  oneapi::tbb::task_arena arena_;
};

}  // namespace overtake::sim
