// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Macros that every file needs: inlining, and checks of contracts inside the library.
#pragma once

#include <cstdio>
#include <cstdlib>

#define OVT_INLINE inline __attribute__((always_inline))
#define OVT_INLINED __attribute__((always_inline))  // of a lambda: [&](int32_t i) OVT_INLINED { ... }
#define OVT_RESTRICT __restrict__

// Reports a broken contract inside the library. Bad arguments from a caller and bad data are errors, never checks.
// On in debug and in optimised test builds (-DOVT_CHECKS=ON), off in release.
#if defined(OVT_ENABLE_CHECKS)
#define OVT_CHECK(condition)                                                                \
  do {                                                                                      \
    if (!(condition)) {                                                                     \
      std::fprintf(stderr, "%s:%d: broken contract: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                         \
    }                                                                                       \
  } while (false)
#else
#define OVT_CHECK(condition) static_cast<void>(sizeof(!(condition)))  // compiled, never evaluated
#endif
