// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts the heap requests of this process: malloc, calloc, realloc, aligned forms, and so operator new.
#pragma once

#include <cstdint>

namespace overtake::test {

// A sanitizer brings its own heap: then nothing is counted and can_count_heap_calls() is false.
bool can_count_heap_calls();
int64_t count_heap_calls();

}  // namespace overtake::test
