// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Replaces the lock functions in this program: each counts its caller and calls the C library's function.
#include "tests/support/lock_calls.h"

#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>

#include <atomic>
#include <cstring>

namespace {

std::atomic<int64_t> lock_calls{0};

void note(const void* caller) {
  Dl_info object;
  if (dladdr(caller, &object) && object.dli_fname && std::strstr(object.dli_fname, "libtbb")) return;
  lock_calls.fetch_add(1, std::memory_order_relaxed);
}

template <class Function>
Function* find_next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// Functions that may block, with one or two arguments.
#define OVT_LOCK1(name, A)                                  \
  int name(A a) {                                           \
    static int (*const next)(A) = find_next<int(A)>(#name); \
    note(__builtin_return_address(0));                      \
    return next(a);                                         \
  }
#define OVT_LOCK2(name, A, B)                                     \
  int name(A a, B b) {                                            \
    static int (*const next)(A, B) = find_next<int(A, B)>(#name); \
    note(__builtin_return_address(0));                            \
    return next(a, b);                                            \
  }

#pragma GCC visibility push(default)
extern "C" {
OVT_LOCK1(pthread_mutex_lock, pthread_mutex_t*)
OVT_LOCK1(pthread_mutex_trylock, pthread_mutex_t*)
OVT_LOCK1(pthread_rwlock_rdlock, pthread_rwlock_t*)
OVT_LOCK1(pthread_rwlock_wrlock, pthread_rwlock_t*)
OVT_LOCK1(pthread_spin_lock, pthread_spinlock_t*)
OVT_LOCK2(pthread_cond_wait, pthread_cond_t*, pthread_mutex_t*)
OVT_LOCK1(sem_wait, sem_t*)
}
#pragma GCC visibility pop

namespace overtake::test {

int64_t count_lock_calls() { return lock_calls.load(std::memory_order_relaxed); }

}  // namespace overtake::test
