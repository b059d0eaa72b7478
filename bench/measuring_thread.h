// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// System functions for a measuring thread: clock, CPU, policy, sleep to an absolute time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::bench {

int64_t now_ns() noexcept;                 // CLOCK_MONOTONIC: the library's steady clock
void sleep_until(int64_t at_ns) noexcept;  // absolute: a late wake-up does not delay later ones

std::vector<int32_t> usable_cpus();  // from the calling thread's affinity mask
// Settings of the calling thread. False: the system refused.
bool run_on(const std::vector<int32_t>& cpus) noexcept;
bool run_fifo(int32_t priority) noexcept;     // 0: no change, returns true
void name_thread(const char* name) noexcept;  // at most 15 characters

// "2,3" or "0-3,8". Throws std::invalid_argument with a sentence that quotes the wrong word.
std::vector<int32_t> parse_cpus(const std::string& text);

}  // namespace overtake::bench
