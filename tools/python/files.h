// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What needs the tools: rigs and maps by name, recordings as arrays, runs over them, the simulator.
#pragma once

#include "tools/python/frame.h"

namespace overtake::python {

void add_files(py::module_& module);

}  // namespace overtake::python
