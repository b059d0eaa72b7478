// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The memory that reading one file may take. Readers check a file's declared sizes against its real size and against
// this limit before they allocate memory. The command line sets the limit (--max-memory).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace overtake::io {

// Default: half of the memory that the machine, its container (cgroup) and the shell (ulimit -v) allow.
uint64_t memory_limit();
void set_memory_limit(uint64_t bytes);  // before anything is read; 0: the default

// Tables are parsed into cells, which may take 32 times the text.
inline constexpr uint64_t kMemoryPerText = 32;
inline uint64_t text_limit() { return memory_limit() / kMemoryPerText; }

// Throws Error: "FILE: WHAT needs 12.0 GiB, the memory limit is 4.0 GiB (--max-memory)".
void check_memory(const std::string& path, uint64_t bytes, std::string_view what);
// The same sentence, for readers that report damage instead; "" within the limit.
std::string beyond_memory(uint64_t bytes, std::string_view what);

// "4G", "512M", "1.5 GiB", "300000": units of 1024. False: not a size, or below 1 MiB.
bool parse_size(std::string_view text, uint64_t& bytes);
std::string format_size(uint64_t bytes);  // "4.0 GiB", "37 bytes"

}  // namespace overtake::io
