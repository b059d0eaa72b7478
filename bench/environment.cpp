// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/environment.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "bench/noise_floor.h"
#include "pipeline/overtake.h"

namespace overtake::bench {
namespace {

// The first line without surrounding white space; empty if there is no such file.
std::string first_line(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  while (!line.empty() && (line.back() == ' ' || line.back() == '\n')) line.pop_back();
  return line;
}

std::string or_word(const std::string& text, const char* word) { return text.empty() ? word : text; }

// A value from the "name : value" lines of /proc/cpuinfo.
std::string cpuinfo(const std::string& name) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || line.compare(0, name.size(), name) != 0) continue;
    if (line.find_first_not_of(" \t", name.size()) != colon) continue;
    return colon + 2 <= line.size() ? line.substr(colon + 2) : "";
  }
  return "";
}

bool has_word(const std::string& text, const std::string& word) {
  std::istringstream words(text);
  for (std::string w; words >> w;)
    if (w == word) return true;
  return false;
}

// The options of the kernel's command line that affect latency.
std::string latency_words() {
  static constexpr const char* kNames[] = {"isolcpus",
                                           "nohz",
                                           "nohz_full",
                                           "rcu_nocbs",
                                           "idle",
                                           "preempt",
                                           "irqaffinity",
                                           "threadirqs",
                                           "mitigations",
                                           "intel_pstate",
                                           "nosmt",
                                           "skew_tick",
                                           "tsc",
                                           "processor.max_cstate",
                                           "intel_idle.max_cstate"};
  std::istringstream words(first_line("/proc/cmdline"));
  std::string found;
  for (std::string word; words >> word;)
    if (std::find(std::begin(kNames), std::end(kNames), word.substr(0, word.find('='))) != std::end(kNames))
      found += (found.empty() ? "" : " ") + word;
  return or_word(found, "none");
}

std::string command_line_value(const std::string& name) {
  std::istringstream words(first_line("/proc/cmdline"));
  for (std::string word; words >> word;)
    if (word.compare(0, name.size() + 1, name + "=") == 0) return word.substr(name.size() + 1);
  return "none";
}

std::string preemption(const utsname& system) {
  const std::string version = system.version;
  for (const char* word : {"PREEMPT_RT", "PREEMPT_DYNAMIC", "PREEMPT"})
    if (version.find(word) != std::string::npos) return word;
  return "none";
}

// The kernel writes "(null)" for an empty mask.
std::string cpu_mask(const std::string& file) {
  const std::string mask = first_line("/sys/devices/system/cpu/" + file);
  return mask.empty() || mask == "(null)" ? "none" : mask;
}

}  // namespace

EnvironmentSheet read_environment(int cpu) {
  utsname system{};
  uname(&system);
  ovt_build_info build;
  ovt_read_build_info(&build);
  const std::string cpu_folder = "/sys/devices/system/cpu/cpu" + std::to_string(cpu);
  const std::string load = first_line("/proc/loadavg");
  const bool has_swap = [] {
    std::ifstream file("/proc/swaps");
    std::string line;
    return std::getline(file, line) && std::getline(file, line) && !line.empty();
  }();
  return {{"cpu", or_word(cpuinfo("model name"), "unknown")},
          {"cpu_count", std::to_string(sysconf(_SC_NPROCESSORS_ONLN))},
          {"virtual", has_word(cpuinfo("flags"), "hypervisor") ? "yes" : "no"},
          {"cache", std::to_string(largest_cache_bytes() >> 10) + " KiB"},
          {"governor", or_word(first_line(cpu_folder + "/cpufreq/scaling_governor"), "unknown")},
          {"clock_source",
           or_word(first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource"), "unknown")},
          {"kernel", std::string(system.sysname) + " " + system.release},
          {"preemption", preemption(system)},
          {"isolated", cpu_mask("isolated")},
          {"nohz_full", cpu_mask("nohz_full")},
          {"rcu_nocbs", command_line_value("rcu_nocbs")},
          {"command_line", latency_words()},
          {"load", or_word(load.substr(0, load.find(' ')), "unknown")},
          {"swap", has_swap ? "yes" : "no"},
          {"version", build.version_text},
          {"commit", build.commit},
          {"compiler", build.compiler},
          {"isas", build.isas}};
}

}  // namespace overtake::bench
