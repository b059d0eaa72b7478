// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/heap_calls.h"

#include <atomic>
#include <cerrno>
#include <cstddef>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define OVT_TEST_OWN_HEAP 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define OVT_TEST_OWN_HEAP 0
#endif
#endif
#if !defined(OVT_TEST_OWN_HEAP)
#if defined(__GLIBC__)
#define OVT_TEST_OWN_HEAP 1
#else
#define OVT_TEST_OWN_HEAP 0
#endif
#endif

namespace {
std::atomic<int64_t> heap_calls{0};
}  // namespace

#if OVT_TEST_OWN_HEAP
// glibc's own functions under their second names; free stays glibc's. Visible, or the C++ library's operator new would
// not find them (the build hides what it defines; clang hides these, too).
#pragma GCC visibility push(default)
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);

void* malloc(std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(count, bytes);
}
void* realloc(void* block, std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(block, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  heap_calls.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return memalign(alignment, bytes); }
int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) {
  *block = memalign(alignment, bytes);
  return *block ? 0 : ENOMEM;
}
}
#pragma GCC visibility pop
#endif

namespace overtake_test {

bool can_count_heap_calls() { return OVT_TEST_OWN_HEAP != 0; }
int64_t count_heap_calls() { return heap_calls.load(std::memory_order_relaxed); }

}  // namespace overtake_test
