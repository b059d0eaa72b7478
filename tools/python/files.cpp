// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/files.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/sim/scenario.h"

namespace overtake::python {
namespace {

PyObject* file_error = nullptr;  // these live as long as the interpreter
PyObject* damage_warning = nullptr;

py::dict load_rig(const std::string& name) {
  const auto rig = without_gil([&] { return io::load_rig(name); });
  py::list sensors;
  for (const io::RigSensor& sensor : rig.sensors) {
    const ovt_sensor_def def = cli::to_sensor_def(sensor);
    py::dict fields;
    fields["name"] = sensor.name;
#define OVT_SENSOR_FIELD(field) fields[#field] = def.field;
#include "tools/python/sensor_fields.def"
    fields["wraps"] = def.wraps != 0;
    fields["compensated_to_s"] = sensor.compensated_to_s;
    sensors.append(fields);
  }
  py::dict capacities;
  for (const io::CapacityKey& key : io::kCapacityKeys)
    if (rig.capacities.*key.rows > 0) capacities[key.name] = rig.capacities.*key.rows;
  py::dict out;
  out["name"] = rig.name;
  out["period_s"] = rig.period_s;
  out["sensors"] = sensors;
  out["capacities"] = capacities;
  return out;
}

py::dict load_map(const std::string& path) {
  const auto map = without_gil([&] { return io::read_map(path); });
  for (const std::string& note : map.notes) warn(note);
  py::dict out;
  out["closed"] = map.closed;
  const auto put = [&](const char* name, const std::vector<double>& values) {
    if (!values.empty()) out[name] = py::array_t<double>(py::ssize_t(values.size()), values.data());
  };
  put("x_m", map.x_m), put("y_m", map.y_m);
  put("width_left_m", map.width_left_m), put("width_right_m", map.width_right_m);
  put("banking_rad", map.banking_rad);
  put("left_x_m", map.left_x_m), put("left_y_m", map.left_y_m);
  put("right_x_m", map.right_x_m), put("right_y_m", map.right_y_m);
  return out;
}

PyObject* new_type(py::module_& module, const char* name, const char* text, PyObject* bases) {
  PyObject* type = PyErr_NewExceptionWithDoc((std::string("overtake.") + name).c_str(), text, bases, nullptr);
  if (!type) throw py::error_already_set();
  module.attr(name) = py::handle(type);
  return type;
}

}  // namespace

void warn(const std::string& sentence) {
  if (PyErr_WarnFormat(PyExc_UserWarning, 1, "%s", sentence.c_str()) != 0) throw py::error_already_set();
}

void warn_of_damage(const std::string& sentence) {
  if (PyErr_WarnFormat(damage_warning, 1, "%s", sentence.c_str()) != 0) throw py::error_already_set();
}

int32_t to_workers(py::handle value) {
  const auto workers = to_number<int32_t>(value, "workers");
  constexpr int32_t kMost = 256;  // as of the command line and of a detector
  if (workers < 0 || workers > kMost)
    throw py::value_error("workers is " + std::to_string(workers) + "; 0 to " + std::to_string(kMost) + " is needed");
  return workers;
}

cli::Options to_options(const py::dict& from) {
  cli::Options options;
  options.command = "run";
  const auto take = [&](const char* name, std::string& to) {
    const py::object value = from[name];
    if (value.is_none()) return;
    if (!py::isinstance<py::str>(value) && !py::isinstance<py::bytes>(value))
      throw py::type_error(std::string(name) + " is " + py::cast<std::string>(py::repr(value)) + "; a text is needed");
    to = py::cast<std::string>(value);
  };
  take("input", options.input), take("rig", options.rig), take("urdf", options.urdf), take("preset", options.preset);
  take("map", options.map), take("ego", options.ego), take("config", options.config), take("isa", options.isa);
  options.set = py::cast<std::vector<std::string>>(from["set"]);
  options.capacity = py::cast<std::vector<std::string>>(from["capacity"]);
  if (const py::object workers = from["workers"]; !workers.is_none()) options.workers = to_workers(workers);
  return options;
}

void add_files(py::module_& module) {
  const py::tuple bases = py::make_tuple(module.attr("Error"), py::handle(PyExc_ValueError));
  file_error = new_type(module, "FileError", "A file is missing, damaged or of another kind; the sentence names it.",
                        bases.ptr());
  damage_warning = new_type(module, "DamageWarning",
                            "A recording is damaged, or its map or own poses do not fit it; what came before is good.",
                            PyExc_UserWarning);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const io::Error& error) {
      PyErr_Format(file_error, "%s", error.what());  // a path in it need not be UTF-8
    }
  });

  module.def("load_rig", &load_rig);
  module.def("load_map", &load_map);
  module.def("rig_names", &io::builtin_rig_names);
  module.def("scenario_names", &sim::builtin_scenario_names);
  add_recordings(module);
  add_runs(module);
  add_races(module);
}

}  // namespace overtake::python
