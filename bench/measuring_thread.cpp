// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/measuring_thread.h"

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <stdexcept>

namespace overtake::bench {
namespace {

int32_t parse_cpu(const std::string& all, const std::string& word) {
  int32_t cpu = -1;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), cpu);
  if (error != std::errc() || end != word.data() + word.size() || cpu < 0 || cpu >= CPU_SETSIZE)
    throw std::invalid_argument("CPUs '" + all + "': '" + word + "' is no CPU's number");
  return cpu;
}

}  // namespace

int64_t now_ns() noexcept {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return int64_t(t.tv_sec) * 1'000'000'000 + t.tv_nsec;
}

void sleep_until(int64_t at_ns) noexcept {
  const timespec t{time_t(at_ns / 1'000'000'000), long(at_ns % 1'000'000'000)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

std::vector<int32_t> usable_cpus() {
  cpu_set_t set;
  std::vector<int32_t> cpus;
  if (sched_getaffinity(0, sizeof set, &set) == 0)
    for (int32_t cpu = 0; cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  return cpus;
}

bool run_on(const std::vector<int32_t>& cpus) noexcept {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (int32_t cpu : cpus) CPU_SET(cpu, &set);
  return pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
}

bool run_fifo(int32_t priority) noexcept {
  if (priority <= 0) return true;
  sched_param param{};
  param.sched_priority = std::min(priority, 99);
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) == 0;
}

void name_thread(const char* name) noexcept { pthread_setname_np(pthread_self(), name); }

std::vector<int32_t> parse_cpus(const std::string& text) {
  std::vector<int32_t> cpus;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, comma - begin);
    const std::size_t dash = word.find('-');
    const int32_t first = parse_cpu(text, word.substr(0, dash));
    const int32_t last = dash == std::string::npos ? first : parse_cpu(text, word.substr(dash + 1));
    if (last < first) throw std::invalid_argument("CPUs '" + text + "': '" + word + "' goes backwards");
    for (int32_t cpu = first; cpu <= last; ++cpu) {
      if (std::find(cpus.begin(), cpus.end(), cpu) != cpus.end())
        throw std::invalid_argument("CPUs '" + text + "': " + std::to_string(cpu) + " is named twice");
      cpus.push_back(cpu);
    }
    begin = comma + 1;
  }
  return cpus;
}

}  // namespace overtake::bench
