// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/python/files.h"

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <utility>

#include "tools/client/config.h"
#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/output.h"
#include "tools/io/scan_stream.h"
#include "tools/io/words.h"
#include "tools/python/params.h"
#include "tools/sim/log_writer.h"

namespace overtake::python {
namespace {

PyObject* file_error = nullptr;  // these live as long as the interpreter
PyObject* damage_warning = nullptr;

void warn(const std::string& sentence) {
  if (PyErr_WarnEx(damage_warning, sentence.c_str(), 1) != 0) throw py::error_already_set();
}

// One thread at a time in an iterator that reads without the GIL.
class Busy {
 public:
  explicit Busy(bool& busy) : busy_(busy) {
    if (busy) throw StatusError(OVT_WRONG_THREAD, "another thread reads from this object");
    busy_ = true;
  }
  ~Busy() { busy_ = false; }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;

 private:
  bool& busy_;
};

// ---- rigs and maps --------------------------------------------------------------------------------------------------

py::dict load_rig(const std::string& name) {
  const io::Rig rig = io::load_rig(name);
  py::list sensors;
  for (const io::RigSensor& sensor : rig.sensors) {
    const ovt_sensor_def def = cli::to_sensor_def(sensor);
    py::dict fields;
    fields["name"] = sensor.name;
#define OVT_PUT(field) fields[#field] = def.field;
    OVT_PUT(x_m) OVT_PUT(y_m) OVT_PUT(z_m) OVT_PUT(roll_rad) OVT_PUT(pitch_rad) OVT_PUT(yaw_rad)
    OVT_PUT(rows) OVT_PUT(cols) OVT_PUT(azimuth_left_rad) OVT_PUT(azimuth_right_rad)
    OVT_PUT(range_min_m) OVT_PUT(range_max_m) OVT_PUT(layer_first) OVT_PUT(layer_last) OVT_PUT(point_capacity)
#undef OVT_PUT
    fields["wraps"] = def.wraps != 0;
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
  const io::MapData map = io::read_map(path);
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

// ---- scans ----------------------------------------------------------------------------------------------------------

const char* numpy_type(io::ValueType type) {
  static constexpr const char* kTypes[] = {"f4", "f8", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"};
  return kTypes[std::size_t(type)];
}

// Writable arrays over memory that `owner` keeps: nobody else reads it.
py::array array_over(const std::shared_ptr<const void>& owner, const char* type, const void* data,
                     std::vector<py::ssize_t> shape) {
  const py::capsule base(new std::shared_ptr<const void>(owner),
                         [](void* kept) { delete static_cast<std::shared_ptr<const void>*>(kept); });
  return py::array(py::dtype(type), std::move(shape), {}, data, base);
}

void put_column(py::dict& points, const char* name, const std::shared_ptr<const void>& owner,
                const io::CloudColumn& column, int64_t count) {
  if (column.bytes.empty() && count > 0) return;
  std::vector<py::ssize_t> shape{py::ssize_t(count)};
  if (column.count > 1) shape.push_back(py::ssize_t(column.count));
  points[name] = array_over(owner, numpy_type(column.type), column.data(), std::move(shape));
}

py::dict pose_fields(const io::EgoRow& row) {
  py::dict out;
#define OVT_PUT(field) out[#field] = row.field;
  OVT_PUT(stamp_ns) OVT_PUT(x_m) OVT_PUT(y_m) OVT_PUT(yaw_rad) OVT_PUT(speed_mps) OVT_PUT(yaw_rate_rps) OVT_PUT(z_m)
  OVT_PUT(roll_rad) OVT_PUT(pitch_rad)
#undef OVT_PUT
  return out;
}

struct PyScan {
  std::string sensor, path;
  int64_t frame = 0, stamp_ns = 0;
  int64_t count = 0;
  py::dict points;
  py::list ego_poses;
};

PyScan make_scan(const io::Rig& rig, int64_t frame, io::SensorScan&& given) {
  const auto scan = std::make_shared<const io::SensorScan>(std::move(given));
  PyScan out;
  out.sensor = rig.sensors[std::size_t(scan->sensor)].name;
  out.path = scan->path;
  out.frame = frame;
  out.stamp_ns = scan->stamp_ns;
  out.count = scan->count;
  put_column(out.points, "x", scan, scan->x, scan->count);
  put_column(out.points, "y", scan, scan->y, scan->count);
  put_column(out.points, "z", scan, scan->z, scan->count);
  put_column(out.points, "layer", scan, scan->layer, scan->count);
  if (!scan->intensity.bytes.empty()) put_column(out.points, "intensity", scan, scan->intensity, scan->count);
  if (!scan->time_offset_ns.empty())
    out.points["time"] = array_over(scan, "i4", scan->time_offset_ns.data(), {py::ssize_t(scan->count)});
  return out;
}

PyScan make_cloud_scan(const std::string& sensor, const std::string& path, int64_t frame, int64_t stamp_ns,
                       io::Cloud&& given) {
  const auto cloud = std::make_shared<const io::Cloud>(std::move(given));
  PyScan out;
  out.sensor = sensor;
  out.path = path;
  out.frame = frame;
  out.stamp_ns = stamp_ns;
  out.count = cloud->points;
  for (std::size_t i = 0; i < cloud->fields.size(); ++i)
    put_column(out.points, cloud->fields[i].name.c_str(), cloud, cloud->columns[i], cloud->points);
  return out;
}

// ---- recordings -----------------------------------------------------------------------------------------------------

class ScanReader {
 public:
  virtual ~ScanReader() = default;
  virtual bool next(PyScan& out) = 0;
  virtual std::string damage() const = 0;
  virtual py::list sensors() const = 0;
};

// With a rig: the scans of its sensors, and the own poses that belong to them.
class RigReader : public ScanReader {
 public:
  explicit RigReader(const cli::Config& config) : config_(config) {
    if (!config_.ego.empty()) ego_ = io::read_ego_file(config_.ego);
    stream_ = io::open_scans(config_.input, config_.rig);
  }

  bool next(PyScan& out) override {
    while (scans_.empty()) {
      io::FrameScans frame;
      {
        const py::gil_scoped_release release;
        if (!stream_->next(frame)) return false;
        if (config_.ego.empty() && !config_.no_ego) {
          const std::vector<io::EgoRow> rows = stream_->take_ego();
          ego_.insert(ego_.end(), rows.begin(), rows.end());
        }
      }
      py::list poses;
      for (const io::SensorScan& scan : frame.scans) take_poses(scan.stamp_ns + config_.rig.period_ns(), poses);
      for (io::SensorScan& scan : frame.scans) {
        scans_.push_back(make_scan(config_.rig, frame.frame, std::move(scan)));
        scans_.back().ego_poses = std::exchange(poses, py::list());
      }
    }
    out = std::move(scans_.front());
    scans_.pop_front();
    return true;
  }
  std::string damage() const override {
    if (!stream_->damage().empty()) return stream_->damage();
    if (stream_->lost_count() == 0) return "";
    return io::counted(stream_->lost_count(), "file") + " could not be read; the first: " + stream_->first_loss();
  }
  py::list sensors() const override {
    py::list names;
    for (const io::RigSensor& sensor : config_.rig.sensors) names.append(sensor.name);
    return names;
  }

 private:
  // Those up to the first one at or after the stamp: as overtake run pushes them.
  void take_poses(int64_t stamp_ns, py::list& out) {
    while (next_ego_ < ego_.size() && (next_ego_ == 0 || ego_[next_ego_ - 1].stamp_ns < stamp_ns))
      out.append(pose_fields(ego_[next_ego_++]));
  }

  const cli::Config config_;
  std::unique_ptr<io::ScanStream> stream_;
  std::vector<io::EgoRow> ego_;
  std::size_t next_ego_ = 0;
  std::deque<PyScan> scans_;
};

// Without a rig: every cloud of a recording with topics, with the fields that have a role.
class BagReader : public ScanReader {
 public:
  explicit BagReader(const std::string& path) : path_(path), bag_(io::open_bag(path)) {}

  bool next(PyScan& out) override {
    io::BagMessage message;
    io::Cloud cloud;
    int64_t stamp_ns = 0;
    bool found = false;
    {
      const py::gil_scoped_release release;
      while (!found && bag_->next(message)) {
        if (!io::is_type(bag_->topics()[std::size_t(message.topic)], io::kPointCloud2Name)) continue;
        const io::PointCloud2 points = io::decode_point_cloud2(message.data);
        cloud = io::read_cloud_message(path_ + ": message " + std::to_string(message.number), points);
        stamp_ns = points.header.stamp_ns;
        found = true;
      }
    }
    if (!found) return false;
    out = make_cloud_scan(bag_->topics()[std::size_t(message.topic)].name, path_, frame_++, stamp_ns, std::move(cloud));
    return true;
  }
  std::string damage() const override { return bag_->damage(); }
  py::list sensors() const override {
    py::list names;
    for (const io::BagTopic& topic : bag_->topics())
      if (io::is_type(topic, io::kPointCloud2Name)) names.append(topic.name);
    return names;
  }

 private:
  const std::string path_;
  std::unique_ptr<io::BagReader> bag_;
  int64_t frame_ = 0;
};

// Without a rig: the files of a folder in the order of their names, or one file, with all fields.
class FileReader : public ScanReader {
 public:
  explicit FileReader(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code code;
    if (fs::is_directory(path, code)) {
      for (const auto& entry : fs::directory_iterator(path)) {
        const io::Format* format = io::find_format_by_name(entry.path().string());
        if (format && format->cloud) files_.push_back(entry.path().string());
      }
      std::sort(files_.begin(), files_.end());
    } else if (fs::exists(path, code)) {
      files_.push_back(path);
    } else {
      throw io::Error(path, 0, "no such file or folder");
    }
    if (files_.empty()) throw io::Error(path, 0, "holds no recording: no " + io::list_extensions());
  }

  bool next(PyScan& out) override {
    if (next_ == files_.size()) return false;
    const std::string& file = files_[next_];
    io::Cloud cloud;
    {
      const py::gil_scoped_release release;
      cloud = io::read_cloud(file);
    }
    out = make_cloud_scan(sensor_of(file), file, int64_t(next_++), 0, std::move(cloud));
    return true;
  }
  std::string damage() const override { return ""; }
  py::list sensors() const override {
    std::set<std::string> names;
    for (const std::string& file : files_) names.insert(sensor_of(file));
    return py::list(py::cast(std::vector<std::string>(names.begin(), names.end())));
  }

 private:
  static std::string sensor_of(const std::string& file) {  // FRAME_SENSOR.EXT
    const std::string stem = std::filesystem::path(file).stem().string();
    const auto bar = stem.find('_');
    const bool digits = stem.substr(0, bar).find_first_not_of("0123456789") == std::string::npos;
    return digits && bar != std::string::npos ? stem.substr(bar + 1) : "";
  }

  std::vector<std::string> files_;
  std::size_t next_ = 0;
};

// An iterator over the scans of a recording.
class ScanIterator {
 public:
  explicit ScanIterator(std::unique_ptr<ScanReader> reader) : reader_(std::move(reader)) {}
  PyScan next() {
    const Busy busy(busy_);
    PyScan scan;
    if (!ended_ && reader_->next(scan)) return scan;
    if (!std::exchange(ended_, true) && !reader_->damage().empty())
      warn(reader_->damage() + "; the scans are those before it");
    throw py::stop_iteration();
  }
  std::string damage() const { return reader_->damage(); }
  py::list sensors() const { return reader_->sensors(); }

 private:
  std::unique_ptr<ScanReader> reader_;
  bool busy_ = false, ended_ = false;
};

// ---- runs -----------------------------------------------------------------------------------------------------------

cli::Options to_options(const py::dict& from) {
  cli::Options options;
  options.command = "run";
  const auto take = [&](const char* name, std::string& to) {
    const py::object value = from[name];
    if (!value.is_none()) to = py::cast<std::string>(py::str(value));
  };
  take("input", options.input), take("rig", options.rig), take("urdf", options.urdf), take("preset", options.preset);
  take("map", options.map), take("ego", options.ego), take("config", options.config), take("isa", options.isa);
  options.set = py::cast<std::vector<std::string>>(from["set"]);
  options.capacity = py::cast<std::vector<std::string>>(from["capacity"]);
  if (!py::object(from["workers"]).is_none()) options.workers = py::cast<int32_t>(from["workers"]);
  return options;
}

std::unique_ptr<ScanIterator> open_recording(const py::dict& from) {
  const cli::Options options = to_options(from);
  const cli::Config config = cli::load_config(options);
  if (config.has_rig) return std::make_unique<ScanIterator>(std::make_unique<RigReader>(config));
  io::check_one_kind(options.input);
  if (io::is_bag(options.input)) return std::make_unique<ScanIterator>(std::make_unique<BagReader>(options.input));
  return std::make_unique<ScanIterator>(std::make_unique<FileReader>(options.input));
}

// The part of `overtake run` between the command line and the result files.
class Run {
 public:
  Run(const py::dict& from, const py::object& params) : config_(cli::load_config_with_rig(to_options(from))) {
    if (!params.is_none()) {
      config_.params = py::cast<const ParamSet&>(params).values;
      config_.preset = config_.params.method;
    }
    CopyOptions copies;
    copies.sensor_count = int32_t(config_.rig.sensors.size());
    copies.labels = py::cast<bool>(from["copy_labels"]);
    copies.images = py::cast<bool>(from["copy_images"]);
    if (!py::object(from["path_horizon_s"]).is_none()) copies.path_horizon_s = py::cast<double>(from["path_horizon_s"]);
    config_.keep_images = copies.images;
    config_.in_pieces = py::cast<bool>(from["stream"]);
    auto names = std::make_shared<SensorNames>();
    for (const io::RigSensor& sensor : config_.rig.sensors) names->push_back(sensor.name);
    sensors_ = names;
    const py::gil_scoped_release release;
    stream_ = io::open_scans(config_.input, config_.rig);
    if (!config_.map.empty() && !config_.own_map && config_.ego.empty() && (!stream_->has_ego() || config_.no_ego))
      throw io::Error("map " + config_.map, 0, "has no effect without ego poses, and there are none");
    queue_ = std::make_unique<FrameQueue>(copies);
    session_ = std::make_unique<cli::Session>(config_, &FrameQueue::on_frame, queue_.get());
  }
  ~Run() {
    const py::gil_scoped_release release;
    session_.reset();  // before the queue that it fills
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  py::object next() {
    const Busy busy(busy_);
    CopiedFrame frame;
    while (!queue_->pop(frame)) {
      if (ended_) {
        finish();
        throw py::stop_iteration();
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      const py::gil_scoped_release release;
      push_next();
    }
    count(frame);
    return make_frame(frame.info, std::move(frame.source), sensors_, number_of(frame.info));
  }

  py::dict stats() const {
    const ovt_stats stats = session_->stats();
    py::dict out;
#define OVT_COUNTER(name, ...) out[#name] = stats.name;
#define OVT_GAUGE OVT_COUNTER
#include "pipeline/stats.def"
    return out;
  }
  // As `overtake run` prints it, of the frames so far.
  std::string hash() const {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash_.value()));
    return text;
  }
  std::string damage() const { return stream_->damage(); }
  double progress() const { return ended_ ? 1.0 : stream_->progress(); }
  const SensorNames& sensors() const { return *sensors_; }
  std::string config_text() const { return cli::format_config(config_); }

 private:
  void push_next() {
    io::FrameScans scans;
    if (!stream_->next(scans)) {
      session_->flush();
      ended_ = true;
      return;
    }
    if (config_.ego.empty() && !config_.no_ego) session_->add_ego(stream_->take_ego());
    for (const io::SensorScan& scan : scans.scans) numbers_[scan.stamp_ns] = scans.frame;
    session_->push(scans);
  }
  int64_t number_of(const ovt_frame_info& info) {
    const auto known = numbers_.find(info.first_stamp_ns);
    const int64_t number = known == numbers_.end() ? info.sequence : known->second;
    numbers_.erase(numbers_.begin(), known);
    return number;
  }
  void count(CopiedFrame& frame) {
    ++frames_;
    off_map_ += (frame.info.flags & OVT_FLAG_EGO_OFF_MAP) != 0;
    with_ego_ += frame.info.ego_known != 0;
    ovt_detections detections;
    std::shared_ptr<const TracksCopy> tracks;
    check(frame.source->read_detections(detections), "detections");
    check(frame.source->read_tracks(OVT_AT_FRAME_STAMP, tracks), "tracks");
    hash_.add(frame.info, detections, tracks->rows);
  }
  void finish() {
    if (std::exchange(finished_, true)) return;
    if (!stream_->damage().empty()) warn(config_.input + ": " + stream_->damage() + "; the frames are those before it");
    if (stream_->lost_count() > 0)
      warn(config_.input + ": " + io::counted(stream_->lost_count(), "file") +
           " could not be read, the others are done; the first: " + stream_->first_loss());
    if (2 * off_map_ > frames_)
      warn(config_.map + ": the ego vehicle is outside of this map in " + std::to_string(off_map_) + " of " +
           std::to_string(frames_) + " frames: map and poses are of different courses");
    if (!config_.ego.empty() && 2 * with_ego_ < frames_)
      warn(config_.ego + ": covers only " + std::to_string(with_ego_) + " of " + std::to_string(frames_) + " frames");
  }

  cli::Config config_;
  std::shared_ptr<const SensorNames> sensors_;
  std::unique_ptr<io::ScanStream> stream_;
  std::unique_ptr<FrameQueue> queue_;
  std::unique_ptr<cli::Session> session_;
  std::map<int64_t, int64_t> numbers_;  // of frames, by the stamps of their scans
  cli::ResultHash hash_;
  int64_t frames_ = 0, off_map_ = 0, with_ego_ = 0;
  bool busy_ = false, ended_ = false, finished_ = false;
};

// ---- simulation -----------------------------------------------------------------------------------------------------

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
    for (const auto& [key, values] : numbers) out[key.c_str()] = py::array_t<double>(py::ssize_t(values.size()), values.data());
    return out;
  }
};

py::dict simulate(const std::string& scenario_name, uint64_t seed, const std::string& out, double seconds,
                  const std::string& ego, int32_t workers, bool force) {
  static std::mutex one_guard;  // of outputs exists in a process (tools/io/output.h)
  TruthColumns truth;
  int32_t frames = 0;
  double simulated_s = 0;
  {
    const py::gil_scoped_release release;
    const std::lock_guard lock(one_guard);
    io::OutputGuard guard(force);
    guard.add_input(scenario_name);
    sim::Scenario scenario = sim::load_scenario(scenario_name);
    if (!ego.empty()) {
      if (scenario.find_car(ego) < 0) throw io::Error(scenario_name, 0, "no car is named '" + ego + "'");
      scenario.ego = ego;
    }
    std::unique_ptr<sim::Simulator> simulator;
    try {
      simulator = std::make_unique<sim::Simulator>(scenario, seed, seconds, workers);
    } catch (const std::invalid_argument& error) {
      throw io::Error(scenario_name, 0, error.what());
    }
    const bool is_mcap = std::filesystem::path(out).extension() == ".mcap";
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
    if (!is_mcap)
      for (const char* ending : {".pcd", "map.csv", "ego.csv"}) guard.remove_leftovers(out, ending);
    guard.commit();
  }
  py::dict made;
  made["frame_count"] = frames;
  made["seconds"] = simulated_s;
  made["truth"] = truth.to_dict();
  return made;
}

PyObject* new_type(py::module_& module, const char* name, const char* text, PyObject* bases) {
  PyObject* type = PyErr_NewExceptionWithDoc((std::string("overtake.") + name).c_str(), text, bases, nullptr);
  if (!type) throw py::error_already_set();
  module.attr(name) = py::handle(type);
  return type;
}

}  // namespace

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
      PyErr_SetString(file_error, error.what());
    }
  });

  module.def("load_rig", &load_rig);
  module.def("load_map", &load_map);
  module.def("rig_names", &io::builtin_rig_names);
  module.def("scenario_names", &sim::builtin_scenario_names);
  module.def("open_recording", &open_recording);
  module.def("simulate", &simulate, py::arg("scenario"), py::arg("seed"), py::arg("out"), py::arg("seconds"),
             py::arg("ego"), py::arg("workers"), py::arg("force"));
  py::class_<PyScan>(module, "Scan", R"(One scan of one sensor, as arrays.

points: a dict of arrays (n,). With a rig: x, y, z in m (sensor frame), layer, and where the recording has them
intensity and time (ns after stamp_ns): what Detector.push_scan takes. Without a rig: the fields of the recording.)")
      .def_readonly("sensor", &PyScan::sensor, "Name of the sensor; without a rig: the topic, or the word of the file.")
      .def_readonly("frame", &PyScan::frame, "Number of the frame in the recording; without a rig: of the scan.")
      .def_readonly("stamp_ns", &PyScan::stamp_ns, "Stamp in ns; 0 where files have none and there is no rig.")
      .def_readonly("path", &PyScan::path, "The file.")
      .def_readonly("points", &PyScan::points, "Columns by name.")
      .def_readonly("ego_poses", &PyScan::ego_poses,
                    "Own poses to push before this scan: dicts of the arguments of push_ego_pose.")
      .def("__len__", [](const PyScan& scan) { return scan.count; })
      .def("__repr__", [](const PyScan& scan) {
        return "<overtake.Scan of " + scan.sensor + ", frame " + std::to_string(scan.frame) + ": " +
               std::to_string(scan.count) + " points>";
      });
  py::class_<ScanIterator>(module, "ScanIterator")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &ScanIterator::next)
      .def_property_readonly("damage", &ScanIterator::damage)
      .def_property_readonly("sensors", &ScanIterator::sensors);
  py::class_<Run>(module, "Run", "The frames of a recording, one after the other: what overtake.run returns.")
      .def(py::init<const py::dict&, const py::object&>())
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Run::next)
      .def_property_readonly("stats", &Run::stats, "Counters so far, by name (ovt_stats).")
      .def_property_readonly("hash", &Run::hash,
                             "Hash of all detections and tracks so far, as `overtake run` prints it at the end.")
      .def_property_readonly("damage", &Run::damage, "Why the recording ended early; empty: it did not.")
      .def_property_readonly("progress", &Run::progress, "Share of the recording that was read, 0 to 1.")
      .def_property_readonly(
          "sensors", [](const Run& run) { return py::cast(run.sensors()); }, "Names of the rig's sensors.")
      .def_property_readonly("config", &Run::config_text,
                             "The configuration as a TOML text, as `overtake run` writes it to config.toml.");
}

}  // namespace overtake::python
