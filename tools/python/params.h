// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tools/python/errors.h"

namespace overtake::python {

// The parameters of a preset, by their text names. overtake.Params makes attributes of them.
struct ParamSet {
  ovt_params values;
  bool has_period = false;  // frame.period_s was set: it is not that of the rig
};

// How far tracks have predicted paths: 0 to tracker.horizon_s. None: -1, that of the parameters. Throws ValueError.
double to_horizon(const py::object& path_horizon_s, const ovt_params& params);

void add_params(py::module_& module);

}  // namespace overtake::python
