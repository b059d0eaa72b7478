// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The method that a suite runs: the environment's OVT_TEST_METHOD, else paper. A suite that proves a guarantee takes
// its parameters from here and runs once per method (tests/CMakeLists.txt).
#pragma once

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "pipeline/overtake.h"

namespace overtake::test {

inline const char* test_method() {
  const char* name = std::getenv("OVT_TEST_METHOD");
  return name && *name ? name : "paper";
}
inline bool tests_paper() { return std::strcmp(test_method(), "paper") == 0; }
inline bool tests_best() { return std::strcmp(test_method(), "best") == 0; }

inline ovt_params test_params() {
  ovt_params params;
  if (ovt_params_init(&params, sizeof params, test_method()) == OVT_OK) return params;
  std::fprintf(stderr, "OVT_TEST_METHOD: there is no method %s\n", test_method());
  std::exit(2);
}

}  // namespace overtake::test
