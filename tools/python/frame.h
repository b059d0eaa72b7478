// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake.Frame and its tables. A column becomes a read-only NumPy array over the source's memory.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tools/python/frame_source.h"

namespace overtake::python {

using SensorNames = std::vector<std::string>;

// Index of a sensor given by its name or index. Throws StatusError.
int32_t sensor_index(const SensorNames& names, py::handle sensor);

// Counts the forks between the first process and this one: memory of a detector does not exist in a child.
int32_t fork_count();

struct FrameHold {
  std::shared_ptr<FrameSource> source;  // null: released
  std::shared_ptr<const SensorNames> sensors;
  int32_t forks = fork_count();

  const std::shared_ptr<FrameSource>& get() const;  // throws ReleasedError
};

// number: of the frame in its recording.
py::object make_frame(const ovt_frame_info& info, std::unique_ptr<FrameSource> source,
                      std::shared_ptr<const SensorNames> sensors, int64_t number);
void add_frames(py::module_& module);

}  // namespace overtake::python
