// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What needs the tools: rigs and maps by name, recordings as arrays, runs over them, the simulator.
#pragma once

#include "tools/client/config.h"
#include "tools/python/frame.h"

namespace overtake::python {

void add_files(py::module_& module);
void add_recordings(py::module_& module);
void add_runs(py::module_& module);
void add_races(py::module_& module);

// The options of a dict that _files.py makes, as the command line has them.
cli::Options to_options(const py::dict& from);
int32_t to_workers(py::handle value);    // throws TypeError or ValueError
void warn(const std::string& sentence);  // issues a UserWarning; what is not UTF-8 becomes U+FFFD
// Issues a DamageWarning.
void warn_of_damage(const std::string& sentence);

template <class Work>
auto without_gil(Work&& work) {
  const py::gil_scoped_release release;
  return work();
}

// One thread at a time in an iterator that reads without the GIL.
class Busy {
 public:
  explicit Busy(bool& busy) : busy_(busy) {
    if (busy) throw StatusError(OVT_WRONG_THREAD, "another thread reads from this object");
    busy_ = true;
  }
  ~Busy() { busy_ = false; }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

 private:
  bool& busy_;
};

}  // namespace overtake::python
