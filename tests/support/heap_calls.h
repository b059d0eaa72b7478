// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How often this process has asked the heap for memory: malloc, calloc, realloc, aligned forms, and so operator new.
#pragma once

#include <cstdint>

namespace overtake_test {

// Under a sanitizer, which brings its own heap, nothing is counted and can_count_heap_calls() is false.
bool can_count_heap_calls();
int64_t count_heap_calls();

}  // namespace overtake_test
