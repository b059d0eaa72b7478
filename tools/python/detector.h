// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake.Detector on the C API. Python threads share it as C threads do: pushes release the GIL, and the library
// refuses calls that exclude each other. Where it does not look (workers other than 1), this class does.
#pragma once

#include <memory>
#include <string>

#include "tools/python/frame.h"
#include "tools/python/params.h"
#include "tools/python/point_columns.h"

namespace overtake::python {

class Detector {
 public:
  // sensors: dicts of fields of ovt_sensor_def and a name. map: a dict of fields of ovt_map_def, or None. options: a
  // dict of fields of ovt_detector_def and of frame_capacity, every_frame, copy_labels, copy_images, path_horizon_s.
  Detector(const py::list& sensors, const ParamSet& params, const py::object& map, const py::dict& options);
  ~Detector();
  Detector(const Detector&) = delete;
  Detector& operator=(const Detector&) = delete;

  py::object push_scan(const py::object& points, int64_t stamp_ns, const py::object& sensor, const py::object& fields,
                       double time_unit_ns);
  py::object push_points(const py::object& points, int64_t stamp_ns, const py::object& sensor, const py::object& first,
                         const py::object& fields, double time_unit_ns);
  py::object end_scan(int64_t stamp_ns, const py::object& sensor, const py::object& point_count);
  py::object push_ego_pose(int64_t stamp_ns, double x_m, double y_m, double yaw_rad, double speed_mps,
                           double yaw_rate_rps, double z_m, double roll_rad, double pitch_rad);
  py::object push_detections(int64_t stamp_ns, const py::dict& columns, const std::string& reference);
  py::object advance(int64_t now_ns);
  py::object flush();
  py::object next_frame();
  py::dict stats() const;
  py::dict runtime_info() const;
  void close();
  bool closed() const { return !detector_; }
  const SensorNames& sensors() const { return *sensors_; }

 private:
  class Call;
  void check_open() const;
  void prepare(const py::object& points, int64_t stamp_ns, const py::object& sensor, const py::object& fields,
               double time_unit_ns, ovt_points& out, BorrowedArrays& kept);
  py::object accept(ovt_status status, const std::string& call) const;
  py::object accept_points(ovt_status status, const char* call, const ovt_points& points) const;

  ovt_detector* detector_ = nullptr;
  const int32_t forks_;
  int32_t calls_ = 0;  // in the library, without the GIL
  bool detections_busy_ = false, time_busy_ = false;
  std::shared_ptr<const SensorNames> sensors_;
  std::vector<int32_t> point_capacity_;
  PointReader reader_;
  int32_t frame_capacity_ = 4;
  double path_horizon_s_ = -1;
  std::unique_ptr<FrameQueue> queue_;  // every_frame
  std::shared_ptr<ReaderPool> pool_;
};

void add_detector(py::module_& module);

}  // namespace overtake::python
