// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Describes the machine, the kernel and its settings, so that a measurement can be interpreted later.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace overtake::bench {

// Name and value, in the order to print them. "unknown" if the system does not tell, "none" if there is none.
//   cpu  cpu_count  virtual  cache  governor  clock_source  kernel  preemption  isolated  nohz_full  rcu_nocbs
//   command_line (of the kernel: options that affect latency)  load  swap  version  commit  compiler  isas
using EnvironmentSheet = std::vector<std::pair<std::string, std::string>>;

// `cpu`: the CPU whose governor to read.
EnvironmentSheet read_environment(int cpu);

}  // namespace overtake::bench
