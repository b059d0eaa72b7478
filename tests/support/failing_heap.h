// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A heap that refuses its k-th request, for a program of its own: malloc and its family for the whole process, libtbb
// and the C++ library included, and pthread_create likewise.
#pragma once

#include <cstdint>

namespace overtake_test {

// Under a sanitizer, which brings its own heap, nothing can be refused.
bool can_refuse();

// From now on counts; the `request`-th (from 1) is refused. 0: none is.
void refuse_heap(int64_t request);
void refuse_thread(int64_t request);
int64_t heap_requests();    // since refuse_heap()
int64_t thread_requests();  // since refuse_thread()
int64_t live_blocks();      // given and not given back

// Who asked for what was refused: the object files and functions on the stack, innermost first. Call describe_refusal()
// outside of a refusal; prepare_refusal() once before the first (it takes the memory that a backtrace needs).
void prepare_refusal();
bool was_refused();
bool refused_inside(const char* object);
void describe_refusal(char* text, int32_t size);

}  // namespace overtake_test
