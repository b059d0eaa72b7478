// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// How often code of this program has asked for a lock of the C library's: mutex, read-write lock, spin lock, condition
// variable, semaphore, and so std::mutex and its kin. Calls out of libtbb are oneTBB's own and not counted.
#pragma once

#include <cstdint>

namespace overtake_test {

int64_t count_lock_calls();

}  // namespace overtake_test
