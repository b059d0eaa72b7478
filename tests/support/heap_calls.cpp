// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/heap_calls.h"

#include <atomic>

namespace {
std::atomic<int64_t> heap_calls{0};
[[maybe_unused]] bool allow_request() {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return true;
}
[[maybe_unused]] void count_blocks(int) {}
}  // namespace

#include "tests/support/own_heap.h"

namespace overtake::test {

bool can_count_heap_calls() { return OVT_TEST_OWN_HEAP != 0; }
int64_t count_heap_calls() { return heap_calls.load(std::memory_order_relaxed); }

}  // namespace overtake::test
