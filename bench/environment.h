// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The sheet that makes a measurement readable later: which machine, which kernel, what it had been told to leave alone.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace overtake::bench {

// Name and value, in the order to print them. "unknown" where the system does not say, "none" where there is none.
//   cpu  cpu_count  virtual  cache  governor  clock_source  kernel  preemption  isolated  nohz_full  rcu_nocbs
//   command_line (of the kernel: the words that concern latency)  load  swap  version  commit  compiler  isas
using EnvironmentSheet = std::vector<std::pair<std::string, std::string>>;

// `cpu`: the one whose governor is asked.
EnvironmentSheet read_environment(int cpu);

}  // namespace overtake::bench
