// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A circuit map from a map file (tools/io/map_file.h).
#pragma once

#include <string>

#include "core/circuit_map.h"
#include "tools/io/map_file.h"

namespace overtake::cli {

// Both throw io::Error with the file where the data is not a map.
CircuitMap to_circuit(const io::MapData& data, const std::string& file);
CircuitMap read_circuit(const std::string& file);

}  // namespace overtake::cli
