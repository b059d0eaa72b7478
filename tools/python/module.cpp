// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The extension module overtake._overtake. The package's __init__.py gives it its names.
#include "tools/python/detector.h"
#ifdef OVT_PYTHON_FILES
#include "tools/python/files.h"
#endif

namespace {

namespace py = pybind11;

py::dict build_info() {
  ovt_build_info info;
  ovt_read_build_info(&info);
  py::dict out;
  out["version"] = info.version_text;
  out["commit"] = info.commit;
  out["compiler"] = info.compiler;
  out["isas"] = info.isas;
  return out;
}

}  // namespace

PYBIND11_MODULE(_overtake, module) {
  using namespace overtake::python;
  add_enums(module);
  add_errors(module);
  add_params(module);
  add_frames(module);
  add_detector(module);
  module.def("build_info", &build_info, "Version, commit, compiler and ISAs of the library, by name.");
#ifdef OVT_PYTHON_FILES
  add_files(module);
  module.attr("has_files") = true;
#else
  module.attr("has_files") = false;
#endif
}
