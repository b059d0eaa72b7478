// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The scenarios of tools/sim/scenarios as text in the binary, so that their names work in every folder.
#pragma once

#include <cstdint>

namespace overtake::sim {

struct BuiltinScenario {
  const char *name, *text;
};
extern const BuiltinScenario kBuiltinScenarios[];
extern const int32_t kBuiltinScenarioCount;

}  // namespace overtake::sim
