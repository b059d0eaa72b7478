// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/memory_limit.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr uint64_t kUnit = 1024, kLeast = uint64_t(1) << 20;

std::atomic<uint64_t> chosen{0};  // 0: the default

uint64_t default_limit() {
  uint64_t bytes = uint64_t(std::max(sysconf(_SC_PHYS_PAGES), 1L)) * uint64_t(std::max(sysconf(_SC_PAGESIZE), 1L));
  for (const char* file : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    uint64_t group = 0;  // "max" is not a number
    if (std::ifstream(file) >> group && group > 0) bytes = std::min(bytes, group);
  }
  rlimit shell{};
  if (getrlimit(RLIMIT_AS, &shell) == 0 && shell.rlim_cur != RLIM_INFINITY)
    bytes = std::min(bytes, uint64_t(shell.rlim_cur));
  return std::max(bytes / 2, kLeast);
}

}  // namespace

uint64_t memory_limit() {
  const uint64_t set = chosen.load(std::memory_order_relaxed);
  static const uint64_t by_default = default_limit();
  return set ? set : by_default;
}

void set_memory_limit(uint64_t bytes) { chosen.store(bytes, std::memory_order_relaxed); }

std::string beyond_memory(uint64_t bytes, std::string_view what) {
  if (bytes <= memory_limit()) return "";
  return std::string(what) + " needs " + format_size(bytes) + ", the memory limit is " + format_size(memory_limit()) +
         " (--max-memory)";
}

void check_memory(const std::string& path, uint64_t bytes, std::string_view what) {
  const std::string beyond = beyond_memory(bytes, what);
  if (!beyond.empty()) throw Error(path, 0, beyond);
}

bool parse_size(std::string_view text, uint64_t& bytes) {
  text = trim(text);
  const auto digits_end = std::min(text.find_first_not_of("0123456789."), text.size());
  double value = 0;
  if (digits_end == 0 || !parse_number(text.substr(0, digits_end), value)) return false;
  std::string unit = lower_case(trim(text.substr(digits_end)));
  double factor = 1;
  if (!unit.empty() && unit != "b") {
    const auto power = std::string_view("kmgt").find(unit[0]);
    const std::string rest = unit.substr(1);
    if (power == std::string_view::npos || !(rest.empty() || rest == "b" || rest == "ib")) return false;
    for (std::size_t i = 0; i <= power; ++i) factor *= double(kUnit);
  }
  value *= factor;
  if (!(value >= double(kLeast) && value < 0x1p62)) return false;
  bytes = uint64_t(value);
  return true;
}

std::string format_size(uint64_t bytes) {
  if (bytes < kUnit) return std::to_string(bytes) + " bytes";
  static constexpr const char* kNames[] = {"KiB", "MiB", "GiB", "TiB", "PiB", "EiB"};
  double value = double(bytes) / double(kUnit);
  std::size_t name = 0;
  while (value >= double(kUnit) && name + 1 < std::size(kNames)) value /= double(kUnit), ++name;
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %s", value, kNames[name]);
  return text;
}

}  // namespace overtake::io
