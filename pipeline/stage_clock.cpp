// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stage_clock.h"

#include <chrono>

namespace overtake {
namespace {

// initial-exec: the first use on a thread allocates no memory, also in a shared library.
[[gnu::tls_model("initial-exec")]] thread_local int32_t worker_number = -1;

}  // namespace

int64_t steady_now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

int32_t this_worker() noexcept { return worker_number; }
void set_this_worker(int32_t worker) noexcept { worker_number = worker; }

}  // namespace overtake
