// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// main() of the doctest executable.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
