// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/errors.h"

#include <array>
#include <initializer_list>
#include <utility>

namespace overtake::python {
namespace {

// These live as long as the interpreter: no destructor runs after its end.
PyObject* base_error = nullptr;
PyObject* released_error = nullptr;
std::array<PyObject*, OVT_NOT_COMPUTED + 1> error_of_status{};
std::array<PyObject*, OVT_NOT_COMPUTED + 1> status_members{};
PyObject* flag_class = nullptr;

PyObject* new_error(py::module_& module, const char* name, const char* text, PyObject* second_base, py::object status) {
  const std::string full_name = std::string("overtake.") + name;
  py::tuple bases =
      second_base ? py::make_tuple(py::handle(base_error ? base_error : PyExc_RuntimeError), py::handle(second_base))
                  : py::make_tuple(py::handle(base_error ? base_error : PyExc_RuntimeError));
  PyObject* error = PyErr_NewExceptionWithDoc(full_name.c_str(), text, bases.ptr(), nullptr);
  if (!error) throw py::error_already_set();
  py::setattr(error, "status", std::move(status));
  module.attr(name) = py::handle(error);
  return error;
}

using Members = std::initializer_list<std::pair<const char*, int>>;

py::object new_enum(py::module_& module, const char* kind, const char* name, const char* text, Members members) {
  py::list pairs;
  for (const auto& [member, value] : members) pairs.append(py::make_tuple(member, value));
  py::object made = py::module_::import("enum").attr(kind)(name, pairs, py::arg("module") = "overtake");
  made.attr("__doc__") = text;
  module.attr(name) = made;
  return made;
}

}  // namespace

py::object status_object(ovt_status status) {
  return py::reinterpret_borrow<py::object>(status_members[std::size_t(status)]);
}

py::object flags_object(uint32_t flags) { return py::handle(flag_class)(flags); }

void add_enums(py::module_& module) {
  py::object status = new_enum(module, "IntEnum", "Status", "What became of a call, as ovt_status of the C API.",
                               {{"OK", OVT_OK},
                                {"BAD_ARGUMENT", OVT_BAD_ARGUMENT},
                                {"BAD_VERSION", OVT_BAD_VERSION},
                                {"UNKNOWN_NAME", OVT_UNKNOWN_NAME},
                                {"OUT_OF_RANGE", OVT_OUT_OF_RANGE},
                                {"NO_MEMORY", OVT_NO_MEMORY},
                                {"NO_THREADS", OVT_NO_THREADS},
                                {"NO_FRAME", OVT_NO_FRAME},
                                {"DUPLICATE", OVT_DUPLICATE},
                                {"LATE", OVT_LATE},
                                {"TOO_MANY", OVT_TOO_MANY},
                                {"INTERNAL", OVT_INTERNAL},
                                {"NOT_KEPT", OVT_NOT_KEPT},
                                {"WRONG_THREAD", OVT_WRONG_THREAD},
                                {"NOT_COMPUTED", OVT_NOT_COMPUTED}});
  for (std::size_t i = 0; i < status_members.size(); ++i) status_members[i] = status(py::int_(i)).release().ptr();
  const Members flags = {
#define OVT_FRAME_FLAG(name) {#name, OVT_FLAG_##name},
#include "pipeline/stats.def"
  };
  flag_class =
      new_enum(module, "IntFlag", "Flag", "Bits of Frame.flags, as OVT_FLAG_... of the C API.", flags).release().ptr();
  new_enum(module, "IntFlag", "TrackFlag", "Bits of Tracks.flags.",
           {{"COASTING", OVT_TRACK_COASTING}, {"UNOBSERVED", OVT_TRACK_UNOBSERVED}, {"STALE", OVT_TRACK_STALE}});
  new_enum(module, "IntEnum", "TrackState", "Values of Tracks.state.",
           {{"TENTATIVE", OVT_TENTATIVE}, {"CONFIRMED", OVT_CONFIRMED}});
  new_enum(module, "IntEnum", "Visibility", "Values of Tracks.visibility.",
           {{"SEEN", OVT_VISIBILITY_SEEN},
            {"MISSED", OVT_VISIBILITY_MISSED},
            {"HIDDEN", OVT_VISIBILITY_HIDDEN},
            {"OWN_SHADOW", OVT_VISIBILITY_OWN_SHADOW},
            {"OUTSIDE", OVT_VISIBILITY_OUTSIDE}});
  new_enum(module, "IntEnum", "View", "Values of Detections.view: the side of the car that the sensor faces.",
           {{"REAR", OVT_VIEW_REAR}, {"FRONT", OVT_VIEW_FRONT}, {"SIDE", OVT_VIEW_SIDE}});
  new_enum(module, "IntEnum", "ObjectClass", "Values of object_class.",
           {{"UNKNOWN", OVT_CLASS_UNKNOWN}, {"CAR", OVT_CLASS_CAR}, {"DEBRIS", OVT_CLASS_DEBRIS}});
  new_enum(module, "IntEnum", "Reference", "Frame of reference: the vehicle (rear axle, on the ground) or the map.",
           {{"VEHICLE", OVT_REFERENCE_VEHICLE}, {"MAP", OVT_REFERENCE_MAP}});
}

void add_errors(py::module_& module) {
  base_error =
      new_error(module, "Error", "A call failed. `status` is the overtake.Status, or None.", nullptr, py::none());
  released_error = new_error(module, "ReleasedError",
                             "A frame, or a table of it, was used after Frame.release(), or a detector after close().",
                             PyExc_ValueError, py::none());
  const auto add = [&](ovt_status status, const char* name, const char* text, PyObject* second_base = nullptr) {
    error_of_status[std::size_t(status)] = new_error(module, name, text, second_base, status_object(status));
  };
  add(OVT_BAD_ARGUMENT, "ArgumentError", "A count, value or combination of arguments is out of bounds.",
      PyExc_ValueError);
  add(OVT_BAD_VERSION, "VersionError", "The module does not match its library.");
  add(OVT_UNKNOWN_NAME, "UnknownNameError", "No preset, parameter, sensor, image or ISA of that name.",
      PyExc_LookupError);
  add(OVT_OUT_OF_RANGE, "OutOfRangeError", "A parameter's value is outside of its limits.", PyExc_ValueError);
  add(OVT_NO_MEMORY, "OutOfMemoryError", "No memory; nothing was kept.", PyExc_MemoryError);
  add(OVT_NO_THREADS, "NoThreadsError", "The system refused a thread.");
  add(OVT_NO_FRAME, "NoFrameError", "The frame has no scan of that sensor.");
  add(OVT_TOO_MANY, "TooManyError", "More points, rows or frames than the detector's capacity.");
  add(OVT_INTERNAL, "InternalError", "The library caught an exception; the next call works.");
  add(OVT_NOT_KEPT, "NotKeptError", "The frame does not hold this: see keep_images, copy_labels and copy_images.");
  add(OVT_WRONG_THREAD, "WrongThreadError",
      "Another thread is in a call of this detector that excludes this one (the threads of overtake.h).");
  add(OVT_NOT_COMPUTED, "NotComputedError", "The detector's preset has no such image or stage.");

  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const StatusError& error) {
      PyObject* type = error_of_status[std::size_t(error.status())];
      PyErr_SetString(type ? type : base_error, error.what());
    } catch (const ReleasedError& error) {
      PyErr_SetString(released_error, error.what());
    }
  });
}

}  // namespace overtake::python
