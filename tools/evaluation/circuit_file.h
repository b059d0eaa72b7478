// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A circuit map from a map file (tools/io/map_file.h).
#pragma once

#include <string>

#include "core/circuit_map.h"

namespace overtake::evaluation {

// Throws io::Error.
void build_circuit(const std::string& map_file, CircuitMap& map);

}  // namespace overtake::evaluation
