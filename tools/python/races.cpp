// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake.simulate: writes the log of a simulated race and returns its truth.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <map>
#include <mutex>

#include "tools/io/output.h"
#include "tools/python/files.h"
#include "tools/sim/log_writer.h"

namespace overtake::python {
namespace {

struct TruthColumns {
  std::vector<int64_t> frame, stamp_ns;
  std::vector<int32_t> car;
  std::vector<std::string> name;
  std::vector<bool> is_ego;
  std::map<std::string, std::vector<double>> numbers;

  void add(int64_t index, int64_t begin_ns, const sim::TruthRow& r) {
    frame.push_back(index);
    stamp_ns.push_back(sim::kEpochNs + begin_ns);
    car.push_back(r.car);
    name.push_back(r.name);
    is_ego.push_back(r.is_ego);
    const std::pair<const char*, double> values[] = {{"x_m", r.center.x},
                                                     {"y_m", r.center.y},
                                                     {"z_m", r.center.z},
                                                     {"heading_rad", r.angles.yaw},
                                                     {"course_rad", r.state.course_rad},
                                                     {"speed_mps", r.state.speed_mps},
                                                     {"yaw_rate_rps", r.state.yaw_rate_rps},
                                                     {"s_m", r.state.s_m},
                                                     {"d_m", r.state.d_m},
                                                     {"ego_x_m", r.in_ego.x},
                                                     {"ego_y_m", r.in_ego.y},
                                                     {"ego_heading_rad", r.heading_in_ego}};
    for (const auto& [key, value] : values) numbers[key].push_back(value);
  }
  py::dict to_dict() const {
    py::dict out;
    out["frame"] = py::array_t<int64_t>(py::ssize_t(frame.size()), frame.data());
    out["stamp_ns"] = py::array_t<int64_t>(py::ssize_t(stamp_ns.size()), stamp_ns.data());
    out["car"] = py::array_t<int32_t>(py::ssize_t(car.size()), car.data());
    out["name"] = py::module_::import("numpy").attr("array")(name);
    out["is_ego"] = py::module_::import("numpy").attr("array")(is_ego, "?");
    for (const auto& [key, values] : numbers)
      out[key.c_str()] = py::array_t<double>(py::ssize_t(values.size()), values.data());
    return out;
  }
};

py::dict simulate(const std::string& scenario, uint64_t seed, const std::string& out, double seconds,
                  const std::string& ego, const py::object& workers_given, bool force) {
  static std::mutex one_guard;  // of outputs exists in a process (tools/io/output.h)
  const int32_t workers = to_workers(workers_given);
  TruthColumns truth;
  int32_t frames = 0;
  double simulated_s = 0;
  {
    const py::gil_scoped_release release;
    const std::lock_guard lock(one_guard);
    io::OutputGuard guard(force);
    if (!sim::is_builtin_scenario(scenario)) guard.add_input(scenario);
    const auto simulator = sim::make_simulator(scenario, ego, "", seed, seconds, workers);
    const bool is_mcap = sim::is_mcap_name(out, out);
    if (!is_mcap) guard.add_folder(out);
    const auto log = is_mcap ? sim::make_mcap_log(out, *simulator, seed) : sim::make_folder_log(out, *simulator, seed);
    frames = simulator->frame_count();
    simulated_s = simulator->seconds();
    for (int32_t i = 0; i < frames; ++i) {
      const sim::SimFrame frame = simulator->frame(i);
      log->write(i, frame);
      for (const sim::TruthRow& row : sim::truth_at(simulator->world(), double(frame.begin_ns) * 1e-9))
        truth.add(i, frame.begin_ns, row);
      const py::gil_scoped_acquire acquire;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    log->close("");
    guard.commit();
  }
  py::dict made;
  made["frame_count"] = frames;
  made["seconds"] = simulated_s;
  made["truth"] = truth.to_dict();
  return made;
}

}  // namespace

void add_races(py::module_& module) {
  module.def("simulate", &simulate, py::arg("scenario"), py::arg("seed"), py::arg("out"), py::arg("seconds"),
             py::arg("ego"), py::arg("workers"), py::arg("force"));
}

}  // namespace overtake::python
