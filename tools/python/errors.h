// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Statuses of the C API as Python exceptions and enums.
#pragma once

#include <pybind11/pybind11.h>

#include <stdexcept>
#include <string>
#include <type_traits>

#include "pipeline/overtake.h"

namespace overtake::python {

namespace py = pybind11;

// Becomes the Python exception of its status.
class StatusError : public std::runtime_error {
 public:
  StatusError(ovt_status status, const std::string& sentence) : std::runtime_error(sentence), status_(status) {}
  ovt_status status() const { return status_; }

 private:
  ovt_status status_;
};

// A table, frame or detector that was released or closed. Becomes overtake.ReleasedError.
class ReleasedError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline void check(ovt_status status, const std::string& what) {
  if (status != OVT_OK) throw StatusError(status, what + ": " + ovt_status_text(status));
}

// A number, True or False, or one of NumPy's scalars. Throws TypeError that names it.
template <class T>
T to_number(py::handle value, const std::string& name) {
  try {
    return py::cast<T>(value);
  } catch (const py::cast_error&) {
    throw py::type_error(name + " is " + py::cast<std::string>(py::repr(value)) + "; " +
                         (std::is_same_v<T, bool>       ? "True or False"
                          : std::is_floating_point_v<T> ? "a number"
                                                        : "a whole number") +
                         " is needed");
  }
}

// A member of overtake.Status.
py::object status_object(ovt_status status);
// A value of overtake.Flag.
py::object flags_object(uint32_t flags);

void add_errors(py::module_& module);
void add_enums(py::module_& module);

}  // namespace overtake::python
