// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/detector.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/client/covariance.h"

namespace overtake::python {
namespace {

template <class T>
void take(const py::dict& from, const char* name, T& to) {
  if (!from.contains(name)) return;
  const py::object value = from[name];
  if (!value.is_none()) to = to_number<T>(value, name);
}

ovt_sensor_def to_sensor(const py::dict& from) {
  ovt_sensor_def def = ovt_default_sensor_def();
  bool wraps = false;
  take(from, "wraps", wraps);
  def.wraps = wraps;
  take(from, "compensated_to_s", def.compensated_to_s);
#define OVT_SENSOR_FIELD(field) take(from, #field, def.field);
#include "tools/python/sensor_fields.def"
  return def;
}

// The columns lie in the arrays of `fields`, or in those of `kept`.
ovt_map_def to_map(const py::dict& fields, std::vector<py::object>& kept) {
  ovt_map_def def = ovt_default_map_def();
  const auto column = [&](const char* name, RowCount& rows) {
    return fields.contains(name) ? as_doubles(fields[name], name, rows, kept) : nullptr;
  };
  RowCount center, left, right;
  def.x_m = column("x_m", center), def.y_m = column("y_m", center);
  def.width_left_m = column("width_left_m", center), def.width_right_m = column("width_right_m", center);
  def.banking_rad = column("banking_rad", center);
  def.left_x_m = column("left_x_m", left), def.left_y_m = column("left_y_m", left);
  def.right_x_m = column("right_x_m", right), def.right_y_m = column("right_y_m", right);
  def.count = center.value("map");
  def.left_count = left.value("map");
  def.right_count = right.value("map");
  bool closed = true;
  take(fields, "closed", closed);
  def.closed = closed;
  return def;
}

void take_options(const py::dict& options, ovt_detector_def& def) {
  // clang-format off
#define OVT_TAKE(name) take(options, #name, def.name);
  OVT_TAKE(worker_count) OVT_TAKE(push_policy) OVT_TAKE(cluster_capacity) OVT_TAKE(candidate_capacity)
  OVT_TAKE(track_capacity) OVT_TAKE(frames_in_flight) OVT_TAKE(ego_pose_capacity) OVT_TAKE(fifo_priority)
  OVT_TAKE(memory) OVT_TAKE(spin_us) OVT_TAKE(deadline_ns) OVT_TAKE(watchdog_ns) OVT_TAKE(keep_images)
  OVT_TAKE(stream);
#undef OVT_TAKE
  // clang-format on
}

}  // namespace

// A call into the library without the GIL. Meanwhile close() is refused.
class Detector::Call {
 public:
  explicit Call(Detector& detector, bool* busy = nullptr) : detector_(detector), busy_(busy) {
    detector.check_open();
    if (busy && *busy) throw StatusError(OVT_WRONG_THREAD, ovt_status_text(OVT_WRONG_THREAD));
    ++detector_.calls_;
    if (busy_) *busy_ = true;
  }
  ~Call() {
    --detector_.calls_;
    if (busy_) *busy_ = false;
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

  template <class Work>
  ovt_status without_gil(Work&& work) {
    const py::gil_scoped_release release;
    return work(detector_.detector_);
  }

 private:
  Detector& detector_;
  bool* const busy_;
};

Detector::Detector(const py::list& sensors, const ParamSet& params, const py::object& map, const py::dict& options)
    : forks_(fork_count()) {
  std::vector<ovt_sensor_def> defs;
  auto names = std::make_shared<SensorNames>();
  for (const py::handle item : sensors) {
    const auto fields = py::reinterpret_borrow<py::dict>(item);
    defs.push_back(to_sensor(fields));
    std::string name = py::cast<std::string>(py::str(fields["name"]));
    if (std::find(names->begin(), names->end(), name) != names->end())
      throw py::value_error("two sensors are named '" + name + "'");
    names->push_back(std::move(name));
    point_capacity_.push_back(defs.back().point_capacity);
  }
  sensors_ = names;

  std::vector<py::object> kept;
  ovt_map_def map_def = ovt_default_map_def();
  if (!map.is_none()) map_def = to_map(py::reinterpret_borrow<py::dict>(map), kept);

  bool every_frame = false;
  CopyOptions copies;
  copies.sensor_count = int32_t(defs.size());
  std::string isa;
  std::vector<int32_t> cpus;
  py::object path_horizon_s = py::none();
  take(options, "frame_capacity", frame_capacity_);
  take(options, "path_horizon_s", path_horizon_s);
  take(options, "every_frame", every_frame);
  take(options, "copy_labels", copies.labels);
  take(options, "copy_images", copies.images);
  take(options, "isa", isa);
  if (frame_capacity_ < 1)
    throw py::value_error("frame_capacity is " + std::to_string(frame_capacity_) + "; 1 or more is needed");
  copies.path_horizon_s = path_horizon_s_ = to_horizon(path_horizon_s, params.values);

  ovt_detector_def def = ovt_default_detector_def();
  take_options(options, def);
  def.sensors = defs.data();
  def.sensor_count = int32_t(defs.size());
  def.params = &params.values;
  def.map = map.is_none() ? nullptr : &map_def;
  def.isa = isa.empty() ? nullptr : isa.c_str();
  def.reader_capacity = frame_capacity_;
  if (options.contains("cpus") && !py::object(options["cpus"]).is_none()) {
    for (const py::handle cpu : options["cpus"]) cpus.push_back(to_number<int32_t>(cpu, "cpus"));
    def.cpus = cpus.data();
    def.cpu_count = int32_t(cpus.size());
  }
  if (every_frame) {
    queue_ = std::make_unique<FrameQueue>(copies);
    def.on_frame = &FrameQueue::on_frame;
    def.user = queue_.get();
  }
  char error[256] = "";
  ovt_status status = OVT_INTERNAL;
  {
    const py::gil_scoped_release release;
    status = ovt_create_detector_verbose(&def, &detector_, error, sizeof error);
  }
  if (status != OVT_OK) throw StatusError(status, *error ? error : ovt_status_text(status));
  pool_ = std::make_shared<ReaderPool>(detector_);
}

Detector::~Detector() {
  if (!detector_) return;
  pool_->close();
  const py::gil_scoped_release release;  // the library's threads may hold locks of other Python threads' calls
  ovt_destroy_detector(detector_);
}

void Detector::close() {
  if (!detector_) return;
  if (calls_ > 0) throw StatusError(OVT_WRONG_THREAD, "close(): another thread is in a call of this detector");
  pool_->close();
  ovt_detector* detector = std::exchange(detector_, nullptr);
  const py::gil_scoped_release release;
  ovt_destroy_detector(detector);
}

void Detector::check_open() const {
  if (!detector_) throw ReleasedError("this detector is closed");
  if (forks_ != fork_count())
    throw ReleasedError("this process was forked after the detector was made: make a new one here");
}

py::object Detector::accept(ovt_status status, const std::string& call) const {
  if (status == OVT_OK || status == OVT_DUPLICATE || status == OVT_LATE) return status_object(status);
  throw StatusError(status, call + ": " + ovt_status_text(status));
}

py::object Detector::accept_points(ovt_status status, const char* call, const ovt_points& points) const {
  if (status != OVT_TOO_MANY) return accept(status, call);
  const auto sensor = std::size_t(points.sensor);
  throw StatusError(status, std::string(call) + ": " + std::to_string(points.count) + " points, but sensor '" +
                                (*sensors_)[sensor] + "' has point_capacity " +
                                std::to_string(point_capacity_[sensor]));
}

void Detector::prepare(const py::object& points, int64_t stamp_ns, const py::object& sensor, const py::object& fields,
                       double time_unit_ns, ovt_points& out, BorrowedArrays& kept) {
  out.sensor = sensor_index(*sensors_, sensor);
  out.stamp_ns = stamp_ns;
  out.time_unit_ns = time_unit_ns;
  reader_.read(points, fields, out, kept);
}

py::object Detector::push_scan(const py::object& points, int64_t stamp_ns, const py::object& sensor,
                               const py::object& fields, double time_unit_ns) {
  ovt_points scan = ovt_default_points();
  BorrowedArrays kept;
  prepare(points, stamp_ns, sensor, fields, time_unit_ns, scan, kept);
  Call call(*this);
  const ovt_status status = call.without_gil([&](ovt_detector* detector) { return ovt_push_scan(detector, &scan); });
  return accept_points(status, "push_scan", scan);
}

py::object Detector::push_points(const py::object& points, int64_t stamp_ns, const py::object& sensor,
                                 const py::object& first, const py::object& fields, double time_unit_ns) {
  ovt_points piece = ovt_default_points();
  BorrowedArrays kept;
  prepare(points, stamp_ns, sensor, fields, time_unit_ns, piece, kept);
  if (!first.is_none()) {
    piece.first = to_number<int32_t>(first, "first");
    if (piece.first < 0) throw py::value_error("first is " + std::to_string(piece.first) + "; 0 or more is needed");
  }
  Call call(*this);
  const ovt_status status = call.without_gil([&](ovt_detector* detector) { return ovt_push_points(detector, &piece); });
  return accept_points(status, "push_points", piece);
}

py::object Detector::end_scan(int64_t stamp_ns, const py::object& sensor, const py::object& point_count) {
  const int32_t index = sensor_index(*sensors_, sensor);
  const int32_t count = point_count.is_none() ? -1 : to_number<int32_t>(point_count, "point_count");
  Call call(*this);
  const ovt_status status =
      call.without_gil([&](ovt_detector* detector) { return ovt_end_scan(detector, index, stamp_ns, count); });
  return accept(status, "end_scan");
}

py::object Detector::push_ego_pose(int64_t stamp_ns, double x_m, double y_m, double yaw_rad, double speed_mps,
                                   double yaw_rate_rps, double z_m, double roll_rad, double pitch_rad) {
  check_open();
  ovt_ego_pose pose;
  check(ovt_ego_pose_init(&pose, sizeof pose), "push_ego_pose");
  pose.stamp_ns = stamp_ns;
  pose.x_m = x_m, pose.y_m = y_m, pose.z_m = z_m;
  pose.roll_rad = roll_rad, pose.pitch_rad = pitch_rad, pose.yaw_rad = yaw_rad;
  pose.speed_mps = speed_mps, pose.yaw_rate_rps = yaw_rate_rps;
  return accept(ovt_push_ego_pose(detector_, &pose), "push_ego_pose");  // with the GIL: one thread at a time
}

py::object Detector::push_detections(int64_t stamp_ns, const py::dict& columns, const std::string& reference) {
  ovt_external_detections rows;
  check(ovt_external_detections_init(&rows, sizeof rows), "push_detections");
  rows.stamp_ns = stamp_ns;
  if (reference == "map")
    rows.reference = OVT_REFERENCE_MAP;
  else if (reference == "vehicle")
    rows.reference = OVT_REFERENCE_VEHICLE;
  else
    throw py::value_error("reference is '" + reference + "'; 'map' or 'vehicle' is needed");
  std::vector<py::object> kept;
  RowCount count;
  // clang-format off
#define OVT_TAKE(name) rows.name = as_doubles(columns[#name], #name, count, kept);
  OVT_TAKE(x_m) OVT_TAKE(y_m) OVT_TAKE(heading_rad) OVT_TAKE(var_x) OVT_TAKE(var_y) OVT_TAKE(cov_xy)
  OVT_TAKE(length_m) OVT_TAKE(width_m) OVT_TAKE(height_m) OVT_TAKE(score);
#undef OVT_TAKE
  // clang-format on
  rows.count = count.value("push_detections");
  const auto value = [](const double* column, int32_t i) { return column ? column[i] : std::nan(""); };
  for (int32_t i = 0; i < rows.count; ++i)
    if (const char* fault =
            cli::find_covariance_fault(value(rows.var_x, i), value(rows.var_y, i), value(rows.cov_xy, i)))
      throw py::value_error("row " + std::to_string(i) + ": " + fault);
  Call call(*this, &detections_busy_);
  const ovt_status status =
      call.without_gil([&](ovt_detector* detector) { return ovt_push_detections(detector, &rows); });
  return accept(status, "push_detections");
}

py::object Detector::advance(int64_t now_ns) {
  Call call(*this, &time_busy_);
  return accept(call.without_gil([&](ovt_detector* detector) { return ovt_advance(detector, now_ns); }), "advance");
}

py::object Detector::flush() {
  Call call(*this, &time_busy_);
  return accept(call.without_gil([](ovt_detector* detector) { return ovt_flush(detector); }), "flush");
}

py::object Detector::next_frame() {
  if (forks_ != fork_count()) check_open();
  if (queue_) {  // frames that were copied stay after close()
    CopiedFrame frame;
    if (queue_->pop(frame)) return make_frame(frame.info, std::move(frame.source), sensors_, frame.info.sequence);
    check_open();
    return py::none();
  }
  check_open();
  ovt_frame_info info;
  auto source = pool_->take(pool_, info, frame_capacity_, path_horizon_s_);
  return source ? make_frame(info, std::move(source), sensors_, info.sequence) : py::none();
}

py::dict Detector::stats() const {
  check_open();
  ovt_stats stats = ovt_default_stats();
  check(ovt_read_stats(detector_, &stats), "stats");
  py::dict out;
#define OVT_COUNTER(name, ...) out[#name] = stats.name;
#define OVT_GAUGE OVT_COUNTER
#define OVT_COUNTERS(name, size, ...)                          \
  {                                                            \
    py::list list;                                             \
    for (const int64_t value : stats.name) list.append(value); \
    out[#name] = list;                                         \
  }
#include "pipeline/stats.def"
  return out;
}

py::dict Detector::runtime_info() const {
  check_open();
  ovt_runtime_info info;
  check(ovt_read_runtime_info(detector_, &info), "runtime_info");
  py::dict out;
  // clang-format off
#define OVT_PUT(name) out[#name] = info.name;
  OVT_PUT(isa) OVT_PUT(worker_count) OVT_PUT(pinned) OVT_PUT(fifo) OVT_PUT(memory_bytes) OVT_PUT(locked_bytes)
  OVT_PUT(huge_bytes) OVT_PUT(process_locked);
#undef OVT_PUT
  // clang-format on
  return out;
}

void add_detector(py::module_& module) {
  const auto zero = py::arg("sensor") = 0;
  py::class_<Detector>(module, "DetectorBase")
      .def(py::init<const py::list&, const ParamSet&, const py::object&, const py::dict&>(), py::arg("sensors"),
           py::arg("params"), py::arg("map"), py::arg("options"))
      .def("push_scan", &Detector::push_scan, py::arg("points"), py::arg("stamp_ns"), zero,
           py::arg("fields") = py::none(), py::arg("time_unit_ns") = 1.0, R"(Pushes one scan of one sensor.

points: in the sensor's frame, m; never copied here. One of
  - an (n, k) array, float32 or float64; fields names its columns, by default (x, y, z, intensity, layer)
  - a structured array with fields x, y, z, layer (or ring, line), and if wanted intensity, time
  - a dict of arrays (n,) with these names
Strides may be any number of bytes from an element's size on: rows, columns, slices and packed records pass as they
are.
layer is the ring of each point. time is each point's offset after stamp_ns, in units of time_unit_ns.
sensor: name or index.

Returns Status.OK, or DUPLICATE: the scan's stamp came before. Raises TypeError or ValueError that names the column
with a wrong type, shape or stride; TooManyError; WrongThreadError. Releases the GIL.)")
      .def("push_points", &Detector::push_points, py::arg("points"), py::arg("stamp_ns"), zero,
           py::arg("first") = py::none(), py::arg("fields") = py::none(), py::arg("time_unit_ns") = 1.0,
           R"(Pushes a piece of a scan while the sensor still measures; end_scan ends it.

points, fields, time_unit_ns as in push_scan; stamp_ns is that of the whole scan. first is the index of the piece's
first point in the scan: with it, lost, doubled and reordered pieces are recognised.
Returns Status.OK, DUPLICATE or LATE. Releases the GIL.)")
      .def("end_scan", &Detector::end_scan, py::arg("stamp_ns"), zero, py::arg("point_count") = py::none(),
           "Ends a scan in pieces. point_count: how many points the sensor sent, if known. Releases the GIL.")
      .def("push_ego_pose", &Detector::push_ego_pose, py::arg("stamp_ns"), py::arg("x_m"), py::arg("y_m"),
           py::arg("yaw_rad"), py::arg("speed_mps"), py::arg("yaw_rate_rps") = 0.0, py::arg("z_m") = 0.0,
           py::arg("roll_rad") = 0.0, py::arg("pitch_rad") = 0.0,
           "Pushes a pose of the own vehicle in the map (m, rad, m/s, rad/s). A frame uses the poses pushed before its "
           "last scan. Returns Status.OK, DUPLICATE or LATE.")
      .def("_push_detections", &Detector::push_detections)
      .def("advance", &Detector::advance, py::arg("now_ns"),
           "Tells the time: closes a frame that waits for a silent sensor, predicts tracks. Releases the GIL.")
      .def("flush", &Detector::flush, "Finishes every pushed scan. Releases the GIL.")
      .def("next_frame", &Detector::next_frame,
           "The latest finished Frame, or None if there is none after the last one. With every_frame: each finished "
           "frame in turn. Raises TooManyError while frame_capacity frames are held.")
      .def("close", &Detector::close,
           "Waits for the frames in work and gives the detector's memory back. Frames and arrays stay valid.")
      .def_property_readonly("closed", &Detector::closed, "Whether close() was called.")
      .def_property_readonly(
          "sensors", [](const Detector& detector) { return py::cast(detector.sensors()); }, "Names of the sensors.")
      .def_property_readonly("stats", &Detector::stats, "Counters since the start, by name (ovt_stats).")
      .def_property_readonly("runtime_info", &Detector::runtime_info,
                             "What the detector was granted (isa, workers, memory).")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Detector& detector, const py::args&) { detector.close(); });
}

}  // namespace overtake::python
