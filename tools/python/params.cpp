// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/params.h"

#include <pybind11/stl.h>

#include <cmath>

namespace overtake::python {
namespace {

ParamSet make_params(const std::string& preset) {
  ParamSet set;
  if (ovt_params_init(&set.values, sizeof set.values, preset.c_str()) == OVT_OK) return set;
  std::string names;
  for (int32_t i = 0; ovt_preset_name(i); ++i) names += (i > 0 ? ", " : "") + std::string(ovt_preset_name(i));
  throw StatusError(OVT_UNKNOWN_NAME, "there is no preset '" + preset + "' (there is: " + names + ")");
}

ovt_param_info info_of(const std::string& name) {
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    if (ovt_describe_param(i, &info) == OVT_OK && name == info.name) return info;
  }
  throw StatusError(OVT_UNKNOWN_NAME, "there is no parameter '" + name + "'");
}

std::string number_text(double value) {
  const bool whole = value == std::floor(value) && std::fabs(value) < 1e15;
  return whole ? std::to_string(std::llround(value)) : py::cast<std::string>(py::repr(py::float_(value)));
}

py::object get_param(const ParamSet& set, const std::string& name) {
  const ovt_param_info info = info_of(name);
  double value = 0;
  check(ovt_get_param(&set.values, info.name, &value), name);
  if (info.is_integer) return py::int_(std::llround(value));
  // Angles are kept in radians; their degrees come back some bits off.
  return py::float_(py::str("{:.12g}").format(value));
}

void set_param(ParamSet& set, const std::string& name, const py::object& value) {
  const ovt_param_info info = info_of(name);
  if (!PyNumber_Check(value.ptr()) || PyComplex_Check(value.ptr()))
    throw py::type_error(name + " is " + py::cast<std::string>(py::repr(value)) + "; a number is needed");
  const std::string text = number_text(py::cast<double>(py::float_(value)));
  const ovt_status status = ovt_set_param(&set.values, info.name, text.c_str());
  if (status == OVT_OK) {
    set.has_period |= name == "frame.period_s";
    return;
  }
  throw StatusError(status, name + " is " + text + "; it takes " + (info.is_integer ? "a whole number" : "a number") +
                                " from " + number_text(info.value_min) + " to " + number_text(info.value_max) +
                                (*info.unit ? " " + std::string(info.unit) : ""));
}

py::list describe_params() {
  py::list list;
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    check(ovt_describe_param(i, &info), "parameter " + std::to_string(i));
    py::dict row;
    row["name"] = info.name;
    row["unit"] = info.unit;
    row["text"] = info.text;
    row["is_integer"] = info.is_integer != 0;
    row["default"] = info.value_default;
    row["min"] = info.value_min;
    row["max"] = info.value_max;
    list.append(row);
  }
  return list;
}

}  // namespace

double to_horizon(const py::object& path_horizon_s, const ovt_params& params) {
  if (path_horizon_s.is_none()) return -1;
  const auto horizon_s = to_number<double>(path_horizon_s, "path_horizon_s");
  double most_s = 0;
  check(ovt_get_param(&params, "tracker.horizon_s", &most_s), "tracker.horizon_s");
  if (horizon_s >= 0 && horizon_s <= most_s) return horizon_s;
  throw py::value_error("path_horizon_s is " + py::cast<std::string>(py::repr(path_horizon_s)) + "; 0 to " +
                        number_text(most_s) + " s (tracker.horizon_s) is needed");
}

void add_params(py::module_& module) {
  py::class_<ParamSet>(module, "ParamSet")
      .def(py::init(&make_params), py::arg("preset"))
      .def("get", &get_param, py::arg("name"))
      .def("set", &set_param, py::arg("name"), py::arg("value"))
      .def("has_effect",
           [](const ParamSet& set, const std::string& name) {
             for (int32_t i = 0; i < ovt_param_count(); ++i) {
               ovt_param_info info;
               if (ovt_describe_param(i, &info) == OVT_OK && name == info.name)
                 return ovt_reads_param(&set.values, i) != 0;
             }
             return false;
           })
      .def("copy", [](const ParamSet& set) { return set; })
      .def_readonly("has_period", &ParamSet::has_period)
      .def_property_readonly("preset", [](const ParamSet& set) { return set.values.method; });
  module.def("describe_params", &describe_params);
  py::list presets;
  for (int32_t i = 0; ovt_preset_name(i); ++i) presets.append(ovt_preset_name(i));
  module.attr("preset_names") = py::tuple(presets);
}

}  // namespace overtake::python
