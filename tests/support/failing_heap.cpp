// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tests/support/failing_heap.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <pthread.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>

namespace {

std::atomic<int64_t> heap_count{0}, heap_refused{0}, thread_count{0}, thread_refused{0}, live{0};
std::atomic<int32_t> depth_refused{0};
void* frames_refused[48];
thread_local bool inside = false;  // of a backtrace: its requests are not counted

void note() {
  inside = true;
  depth_refused.store(backtrace(frames_refused, 48));
  inside = false;
}

[[maybe_unused]] bool allow_request() {
  if (inside) return true;
  if (heap_count.fetch_add(1) + 1 != heap_refused.load()) return true;
  note();
  return false;
}
[[maybe_unused]] void count_blocks(int change) { live.fetch_add(change); }

}  // namespace

#include "tests/support/own_heap.h"

#if OVT_TEST_OWN_HEAP
#pragma GCC visibility push(default)
extern "C" {
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*), void* argument) {
  using Create = int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static Create* const create = reinterpret_cast<Create*>(dlsym(RTLD_NEXT, "pthread_create"));
  if (thread_count.fetch_add(1) + 1 == thread_refused.load()) {
    note();
    return EAGAIN;
  }
  return create(thread, attributes, run, argument);
}
}
#pragma GCC visibility pop
#endif

namespace overtake::test {

bool can_refuse() { return OVT_TEST_OWN_HEAP != 0; }

void refuse_heap(int64_t request) {
  heap_refused.store(0);
  heap_count.store(0);
  heap_refused.store(request);
}
void refuse_thread(int64_t request) {
  thread_refused.store(0);
  thread_count.store(0);
  thread_refused.store(request);
}
int64_t heap_requests() { return heap_count.load(); }
int64_t thread_requests() { return thread_count.load(); }
int64_t live_blocks() { return live.load(); }

void prepare_refusal() {
  note();
  depth_refused.store(0);
}
bool was_refused() { return depth_refused.load() > 0; }

bool refused_inside(const char* object) {
  for (int32_t i = 0; i < depth_refused.load(); ++i) {
    Dl_info info;
    if (dladdr(frames_refused[i], &info) && info.dli_fname && std::strstr(info.dli_fname, object)) return true;
  }
  return false;
}

void describe_refusal(char* text, int32_t size) {
  int32_t used = 0, shown = 0;
  if (size > 0) text[0] = '\0';
  for (int32_t i = 2; i < depth_refused.load() && shown < 6 && used < size; ++i) {
    Dl_info info;
    if (!dladdr(frames_refused[i], &info) || !info.dli_fname) continue;
    const char* slash = std::strrchr(info.dli_fname, '/');
    used += std::snprintf(text + used, std::size_t(size - used), "%s%s", shown++ ? " < " : "",
                          slash ? slash + 1 : info.dli_fname);
    if (used >= size) break;
    if (info.dli_sname)
      used += std::snprintf(text + used, std::size_t(size - used), ":%s", info.dli_sname);
    else
      used += std::snprintf(text + used, std::size_t(size - used), "+0x%zx",
                            std::size_t(static_cast<char*>(frames_refused[i]) - static_cast<char*>(info.dli_fbase)));
  }
}

}  // namespace overtake::test
