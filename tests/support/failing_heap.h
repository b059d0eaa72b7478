// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A heap that refuses its k-th request, for a separate program: malloc and its family for the whole process, including
// libtbb and the C++ library, and pthread_create likewise.
#pragma once

#include <cstdint>

namespace overtake::test {

// A sanitizer brings its own heap; with it nothing can be refused.
bool can_refuse();

// Starts counting; the `request`-th (from 1) is refused. 0: none.
void refuse_heap(int64_t request);
void refuse_thread(int64_t request);
int64_t heap_requests();    // since refuse_heap()
int64_t thread_requests();  // since refuse_thread()
int64_t live_blocks();      // allocated and not freed

// The source of the refused request: object files and functions on the stack, innermost first. Call describe_refusal()
// after the refusal, and prepare_refusal() once before the first one (it allocates the memory that a backtrace needs).
void prepare_refusal();
bool was_refused();
bool refused_inside(const char* object);
void describe_refusal(char* text, int32_t size);

}  // namespace overtake::test
