// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The log of a simulated race, in one file.
#pragma once

#include <string>

#include "tools/sim/log_writer.h"

namespace overtake::test {

// seconds: 0 for the whole race.
inline void write_race(const sim::Scenario& scenario, uint64_t seed, double seconds, const std::string& path) {
  sim::Simulator simulator(scenario, seed, seconds, 2);
  const auto out = sim::make_mcap_log(path, simulator, seed);
  for (int32_t k = 0; k < simulator.frame_count(); ++k) out->write(k, simulator.frame(k));
  out->close();
}

}  // namespace overtake::test
