// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The points of a push as columns of the C API, without a copy: each column is a base address and a stride into the
// caller's array. Throws TypeError for a wrong type, ValueError for a wrong shape or stride; the sentence names the
// column and what it has.
#pragma once

#include <pybind11/numpy.h>

#include <array>
#include <string>
#include <vector>

#include "tools/python/errors.h"

namespace overtake::python {

// The columns of ovt_points, in its order.
enum ColumnRole { kX, kY, kZ, kLayer, kIntensity, kTime, kRoleCount };
inline constexpr const char* kRoleNames[kRoleCount] = {"x", "y", "z", "layer", "intensity", "time"};

// Which role each column of an (n, k) array has.
class FieldList {
 public:
  FieldList();                                              // x, y, z, intensity, layer
  explicit FieldList(py::handle sequence);                  // of names; None or "": the column is not used
  const std::vector<int>& roles() const { return roles_; }  // -1: not used
  std::string text() const;

 private:
  std::vector<int> roles_;
};

// The arrays behind the columns; they must exist until the push returns.
struct BorrowedArrays {
  std::array<py::object, kRoleCount> arrays;
};

class PointReader {
 public:
  // Sets count and columns of `out`. `points`: an (n, k) array, a structured array, or a dict of arrays; each is a
  // numpy.ndarray or has the buffer protocol. `fields`: None, or the names of the columns of an (n, k) array.
  void read(py::handle points, py::handle fields, ovt_points& out, BorrowedArrays& kept);

 private:
  void read_matrix(const py::array& points, py::handle fields, ovt_points& out);
  void read_records(const py::array& points, ovt_points& out);
  void read_columns(const py::dict& columns, ovt_points& out, BorrowedArrays& kept);

  struct Field {
    char kind = 0, byteorder = 0;
    py::ssize_t size = 0, offset = 0;
  };
  using Layout = std::array<Field, kRoleCount>;
  Layout layout_of(const py::dtype& records);

  const FieldList default_fields_;
  py::object records_;  // dtype of the last records, to which layout_ belongs
  Layout layout_;
};

// numpy.ndarray of an array or an object with the buffer protocol, never a copy. Throws TypeError.
py::array as_array(py::handle object, const char* name);

// How many rows the columns of a table have, and the first one's name.
struct RowCount {
  py::ssize_t rows = -1;  // no column yet
  const char* first = "";
  int32_t value(const char* table) const;  // 0 without a column. Throws StatusError
};
// One column as contiguous doubles, for maps and detections: the array itself if it is that, else a converted copy,
// which `kept` holds. None: null. Throws TypeError or ValueError that names the column.
const double* as_doubles(py::handle object, const char* name, RowCount& count, std::vector<py::object>& kept);

}  // namespace overtake::python
