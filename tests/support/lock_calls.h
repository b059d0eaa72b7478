// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts the calls from code of this program to lock functions of the C library: mutex, read-write lock, spin lock,
// condition variable, semaphore, and so std::mutex and similar classes. Calls from libtbb are not counted.
#pragma once

#include <cstdint>

namespace overtake::test {

int64_t count_lock_calls();

}  // namespace overtake::test
