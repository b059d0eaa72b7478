// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/point_columns.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace overtake::python {
namespace {

// The names that a field of a record, or a key of a dict, may have. No other name means the time after the scan's
// stamp: recordings use "t" and "timestamp" for other times, too.
constexpr const char* kNames[kRoleCount][3] = {
    {"x"}, {"y"}, {"z"}, {"layer", "ring", "line"}, {"intensity", "reflectivity", "reflectance"}, {"time"}};

int find_role(std::string_view name) {
  for (int role = 0; role < kRoleCount; ++role)
    for (const char* known : kNames[role])
      if (known && name == known) return role;
  return -1;
}

std::string all_names() {
  std::string text;
  for (const auto& names : kNames) {
    for (std::size_t i = 0; i < std::size(names) && names[i]; ++i)
      text += (i > 0 ? " or " : text.empty() ? "" : ", ") + std::string(names[i]);
  }
  return text;
}

ovt_column& column_of(ovt_points& points, int role) {
  ovt_column* columns[kRoleCount] = {&points.x, &points.y, &points.z, &points.layer, &points.intensity, &points.time};
  return *columns[role];
}

int32_t type_of(char kind, py::ssize_t size) {
  if (kind == 'f') return size == 4 ? OVT_F32 : size == 8 ? OVT_F64 : OVT_NONE;
  if (kind == 'i') return size == 1 ? OVT_I8 : size == 2 ? OVT_I16 : size == 4 ? OVT_I32 : OVT_NONE;
  if (kind == 'u') return size == 1 ? OVT_U8 : size == 2 ? OVT_U16 : size == 4 ? OVT_U32 : OVT_NONE;
  return OVT_NONE;
}

std::string type_name(char kind, char byteorder, py::ssize_t size) {
  const std::string bits = std::to_string(8 * size);
  const std::string order = byteorder == '>' ? "big-endian " : "";
  switch (kind) {
    case 'f': return order + "float" + bits;
    case 'i': return order + "int" + bits;
    case 'u': return order + "uint" + bits;
    case 'b': return "bool";
    case 'c': return order + "complex" + bits;
    default: return "dtype of kind '" + std::string(1, kind) + "'";
  }
}

void set_column(ovt_points& points, int role, const void* data, char kind, char byteorder, py::ssize_t size,
                py::ssize_t stride) {
  const auto name = [&] { return std::string(kRoleNames[role]); };
  const int32_t type = byteorder == '>' ? int32_t(OVT_NONE) : type_of(kind, size);
  const bool floats = role == kX || role == kY || role == kZ;
  if (type == OVT_NONE || (floats && kind != 'f'))
    throw py::type_error(
        name() + " is " + type_name(kind, byteorder, size) + "; " +
        (floats ? "float32 or float64 is needed" : "float32, float64 or an integer of 8, 16 or 32 bits is needed"));
  if (points.count <= 1) stride = size;  // NumPy's stride has no meaning then
  if (stride < size)
    throw py::value_error(name() + " has a stride of " + std::to_string(stride) + " bytes; at least " +
                          std::to_string(size) + " is needed, or a copy (numpy.ascontiguousarray)");
  ovt_column& column = column_of(points, role);
  column.data = data;
  column.size_bytes = points.count > 0 ? std::size_t(points.count - 1) * std::size_t(stride) + std::size_t(size) : 0;
  column.stride = std::size_t(stride);
  column.type = type;
}

void set_count(ovt_points& points, py::ssize_t count) {
  if (count > std::numeric_limits<int32_t>::max())
    throw StatusError(OVT_TOO_MANY, "a scan of " + std::to_string(count) + " points");
  points.count = int32_t(count);
}

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i)
    text += (i > 0 ? ", " : "") + std::to_string(array.shape(i)) + (array.ndim() == 1 ? "," : "");
  return text + ")";
}

void need_columns(const ovt_points& points, const std::string& what) {
  for (const int role : {kX, kY, kZ, kLayer})
    if (column_of(const_cast<ovt_points&>(points), role).type == OVT_NONE)
      throw py::value_error(what + " has no " + kRoleNames[role] +
                            (role == kLayer ? " (or ring, line: the id of each point's ring)" : ""));
}

[[noreturn]] void fail_twice(const std::string& what, int role) {
  throw py::value_error(what + " has two columns " + kRoleNames[role]);
}

}  // namespace

FieldList::FieldList() : roles_{kX, kY, kZ, kIntensity, kLayer} {}

FieldList::FieldList(py::handle sequence) {
  for (const py::handle item : sequence) {
    const std::string name = item.is_none() ? "" : py::cast<std::string>(item);
    roles_.push_back(name.empty() ? -1 : find_role(name));
    if (name.empty()) continue;
    if (roles_.back() < 0) throw py::value_error("fields: '" + name + "' is none of " + all_names());
    if (std::count(roles_.begin(), roles_.end(), roles_.back()) > 1) fail_twice("fields", roles_.back());
  }
}

std::string FieldList::text() const {
  std::string text;
  for (const int role : roles_) text += (text.empty() ? "" : ", ") + std::string(role < 0 ? "-" : kRoleNames[role]);
  return text;
}

namespace {

void refuse_mask(py::handle object, const char* name) {
  if (py::isinstance(object, py::module_::import("numpy").attr("ma").attr("MaskedArray")))
    throw py::type_error(std::string(name) + " is a masked array, whose mask has no effect here; give the values " +
                         "that count (numpy.ma.compressed), or NaN for those not measured (filled)");
}

}  // namespace

py::array as_array(py::handle object, const char* name) {
  refuse_mask(object, name);
  if (py::isinstance<py::array>(object)) return py::reinterpret_borrow<py::array>(object);
  if (!PyObject_CheckBuffer(object.ptr()) || PyBytes_Check(object.ptr()) || PyByteArray_Check(object.ptr()))
    throw py::type_error(std::string(name) + " is a " + Py_TYPE(object.ptr())->tp_name +
                         "; an array is needed (numpy.ndarray, or an object with the buffer protocol)");
  // asarray of a memoryview is a view of its memory.
  return py::module_::import("numpy").attr("asarray")(py::memoryview(py::reinterpret_borrow<py::object>(object)));
}

int32_t RowCount::value(const char* table) const {
  if (rows > std::numeric_limits<int32_t>::max())
    throw StatusError(OVT_TOO_MANY, std::string(table) + ": " + first + " has " + std::to_string(rows) + " rows");
  return int32_t(std::max(rows, py::ssize_t(0)));
}

namespace {

// A list or another sequence of numbers.
py::array to_doubles(py::handle sequence, const char* name) {
  try {
    return py::module_::import("numpy").attr("asarray")(sequence, "f8");
  } catch (const py::error_already_set& error) {
    const std::string sentence = std::string(name) + ": " + py::cast<std::string>(py::str(error.value()));
    if (error.matches(PyExc_TypeError)) throw py::type_error(sentence);
    if (error.matches(PyExc_ValueError)) throw py::value_error(sentence);
    throw;
  }
}

}  // namespace

const double* as_doubles(py::handle object, const char* name, RowCount& count, std::vector<py::object>& kept) {
  if (object.is_none()) return nullptr;
  const bool is_array = py::isinstance<py::array>(object) || PyObject_CheckBuffer(object.ptr());
  const py::array given =
      py::isinstance<py::sequence>(object) && !is_array ? to_doubles(object, name) : as_array(object, name);
  if (given.ndim() != 1)
    throw py::value_error(std::string(name) + " has shape " + shape_text(given) + "; (n,) is needed");
  if (std::string("fiu").find(given.dtype().kind()) == std::string::npos)
    throw py::type_error(std::string(name) + " is " +
                         type_name(given.dtype().kind(), given.dtype().byteorder(), given.itemsize()) +
                         "; numbers are needed");
  if (count.rows >= 0 && given.shape(0) != count.rows)
    throw py::value_error(std::string(name) + " has " + std::to_string(given.shape(0)) + " rows, " + count.first +
                          " has " + std::to_string(count.rows));
  if (count.rows < 0) count = {given.shape(0), name};
  const auto doubles = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
  if (!doubles) throw py::error_already_set();
  kept.push_back(doubles);
  return doubles.data();
}

void PointReader::read(py::handle points, py::handle fields, ovt_points& out, BorrowedArrays& kept) {
  if (py::isinstance<py::dict>(points)) {
    read_columns(py::reinterpret_borrow<py::dict>(points), out, kept);
    return;
  }
  py::array array = as_array(points, "points");
  kept.arrays[0] = array;
  if (array.dtype().has_fields())
    read_records(array, out);
  else
    read_matrix(array, fields, out);
}

void PointReader::read_matrix(const py::array& points, py::handle fields, ovt_points& out) {
  if (points.ndim() != 2)
    throw py::value_error("points has shape " + shape_text(points) +
                          "; (n, k) is needed, a structured array (n,), or a "
                          "dict of columns");
  std::optional<FieldList> given;
  if (!fields.is_none()) given.emplace(fields);
  const FieldList& list = given ? *given : default_fields_;
  if (points.shape(1) != py::ssize_t(list.roles().size()))
    throw py::value_error("points has " + std::to_string(points.shape(1)) + " columns, but fields names " +
                          std::to_string(list.roles().size()) + " (" + list.text() + "): pass fields=(...)");
  set_count(out, points.shape(0));
  const py::dtype type = points.dtype();
  const char kind = type.kind(), order = type.byteorder();
  const char* data = static_cast<const char*>(points.data());
  for (std::size_t k = 0; k < list.roles().size(); ++k)
    if (list.roles()[k] >= 0)
      set_column(out, list.roles()[k], data + py::ssize_t(k) * points.strides(1), kind, order, points.itemsize(),
                 points.strides(0));
  need_columns(out, "fields");
}

PointReader::Layout PointReader::layout_of(const py::dtype& records) {
  if (records.is(records_)) return layout_;
  Layout layout;
  const py::dict fields = records.attr("fields");
  for (const auto& [key, value] : fields) {
    const int role = find_role(py::cast<std::string>(key));
    if (role < 0) continue;
    if (layout[std::size_t(role)].size > 0) {
      if (role == kIntensity) continue;  // some sensors' records have several of them: the first one counts
      fail_twice("points", role);
    }
    const auto entry = py::reinterpret_borrow<py::tuple>(value);
    const auto type = py::reinterpret_borrow<py::dtype>(entry[0]);
    layout[std::size_t(role)] = {type.kind(), type.byteorder(), type.itemsize(), py::cast<py::ssize_t>(entry[1])};
  }
  layout_ = layout;
  records_ = records;
  return layout;
}

void PointReader::read_records(const py::array& points, ovt_points& out) {
  if (points.ndim() != 1)
    throw py::value_error("points has shape " + shape_text(points) + "; a structured array of shape (n,) is needed");
  const Layout layout = layout_of(points.dtype());
  set_count(out, points.shape(0));
  const char* data = static_cast<const char*>(points.data());
  for (int role = 0; role < kRoleCount; ++role) {
    const Field& field = layout[std::size_t(role)];
    if (field.size > 0)
      set_column(out, role, data + field.offset, field.kind, field.byteorder, field.size, points.strides(0));
  }
  need_columns(out, "points");
}

void PointReader::read_columns(const py::dict& columns, ovt_points& out, BorrowedArrays& kept) {
  std::array<bool, kRoleCount> found{};
  py::ssize_t count = -1;
  const char* first = "";
  for (const auto& [key, value] : columns) {
    const char* name = PyUnicode_Check(key.ptr()) ? PyUnicode_AsUTF8(key.ptr()) : nullptr;  // the key's own memory
    if (!name) throw py::type_error("points has a key that is no text");
    const int role = find_role(name);
    if (role < 0) throw py::value_error("points: '" + std::string(name) + "' is none of " + all_names());
    if (found[std::size_t(role)]) fail_twice("points", role);
    found[std::size_t(role)] = true;
    if (value.is_none()) continue;
    py::array array = as_array(value, name);
    if (array.ndim() != 1)
      throw py::value_error(std::string(name) + " has shape " + shape_text(array) + "; (n,) is needed");
    if (count >= 0 && array.shape(0) != count)
      throw py::value_error(std::string(name) + " has " + std::to_string(array.shape(0)) + " points, " + first +
                            " has " + std::to_string(count));
    if (count < 0) first = name, set_count(out, count = array.shape(0));
    const py::dtype type = array.dtype();
    set_column(out, role, array.data(), type.kind(), type.byteorder(), array.itemsize(), array.strides(0));
    kept.arrays[std::size_t(role)] = std::move(array);
  }
  need_columns(out, "points");
}

}  // namespace overtake::python
