// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake.open: the scans of a recording as arrays over the memory that the reader filled.
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <set>
#include <utility>

#include "tools/client/session.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/scan_stream.h"
#include "tools/io/words.h"
#include "tools/python/files.h"
#include "tools/python/frame.h"

namespace overtake::python {
namespace {

// ---- scans ----------------------------------------------------------------------------------------------------------

const char* numpy_type(io::ValueType type) {
  static constexpr const char* kTypes[] = {"f4", "f8", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"};
  return kTypes[std::size_t(type)];
}

// Names in files may be any bytes: what is not UTF-8 is escaped, as in paths.
py::str to_text(const std::string& name, const char* errors = "surrogateescape") {
  PyObject* text = PyUnicode_DecodeUTF8(name.data(), py::ssize_t(name.size()), errors);
  if (!text) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(text);
}

// Writable arrays over memory that `owner` keeps: nobody else reads it.
py::array array_over(const std::shared_ptr<const void>& owner, const char* type, const void* data,
                     std::vector<py::ssize_t> shape) {
  const py::capsule base(new std::shared_ptr<const void>(owner),
                         [](void* kept) { delete static_cast<std::shared_ptr<const void>*>(kept); });
  return py::array(py::dtype(type), std::move(shape), {}, data, base);
}

void put_column(py::dict& points, const std::string& name, const std::shared_ptr<const void>& owner,
                const io::CloudColumn& column, int64_t count) {
  if (column.bytes.empty() && count > 0) return;
  std::vector<py::ssize_t> shape{py::ssize_t(count)};
  if (column.count > 1) shape.push_back(py::ssize_t(column.count));
  points[to_text(name)] = array_over(owner, numpy_type(column.type), column.data(), std::move(shape));
}

py::dict pose_fields(const io::EgoRow& row) {
  py::dict out;
  // clang-format off
#define OVT_PUT(field) out[#field] = row.field;
  OVT_PUT(stamp_ns) OVT_PUT(x_m) OVT_PUT(y_m) OVT_PUT(yaw_rad) OVT_PUT(speed_mps) OVT_PUT(yaw_rate_rps) OVT_PUT(z_m)
  OVT_PUT(roll_rad) OVT_PUT(pitch_rad);
#undef OVT_PUT
  // clang-format on
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
    put_column(out.points, cloud->fields[i].name, cloud, cloud->columns[i], cloud->points);
  return out;
}

// ---- recordings -----------------------------------------------------------------------------------------------------

class ScanReader {
 public:
  virtual ~ScanReader() = default;
  virtual bool next(PyScan& out) = 0;
  virtual std::string damage() const = 0;            // why it ended early
  virtual std::string losses() const { return ""; }  // what was left out on the way
  virtual py::list sensors() const = 0;
  virtual std::vector<std::string> notes() const { return {}; }  // what the user should know from the start
};

// With a rig: the scans of its sensors, and the own poses that belong to them.
class RigReader : public ScanReader {
 public:
  explicit RigReader(const cli::Config& config) : config_(config) {
    if (!config_.ego.empty()) ego_ = io::read_ego_file(config_.ego, &ego_notes_);
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
  std::string damage() const override { return stream_->damage(); }
  std::string losses() const override { return stream_->losses(); }
  py::list sensors() const override {
    py::list names;
    for (const io::RigSensor& sensor : config_.rig.sensors) names.append(sensor.name);
    return names;
  }
  std::vector<std::string> notes() const override { return ego_notes_; }

 private:
  // Those up to the first one at or after the stamp: as overtake run pushes them.
  void take_poses(int64_t stamp_ns, py::list& out) {
    while (next_ego_ < ego_.size() && (next_ego_ == 0 || ego_[next_ego_ - 1].stamp_ns < stamp_ns))
      out.append(pose_fields(ego_[next_ego_++]));
  }

  const cli::Config config_;
  std::unique_ptr<io::ScanStream> stream_;
  std::vector<io::EgoRow> ego_;
  std::vector<std::string> ego_notes_;
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
        const std::string place = path_ + ": message " + std::to_string(message.number);
        io::PointCloud2 points;
        try {
          points = io::decode_point_cloud2(message.data);
        } catch (const std::runtime_error& error) {
          throw io::Error(place, 0, error.what());
        }
        cloud = io::read_cloud_message(place, points);
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
      if (io::is_type(topic, io::kPointCloud2Name)) names.append(to_text(topic.name));
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

  // Leaves out unreadable files. Throws io::Error, once, if none is readable.
  bool next(PyScan& out) override {
    while (next_ < files_.size()) {
      const auto frame = int64_t(next_);
      const std::string& file = files_[next_++];
      try {
        io::Cloud cloud = without_gil([&] { return io::read_cloud(file); });
        out = make_cloud_scan(sensor_of(file), file, frame, 0, std::move(cloud));
        return true;
      } catch (const io::Error& error) {
        if (lost_count_++ == 0) first_loss_ = error.what();
      }
    }
    if (lost_count_ == int64_t(files_.size()) && !std::exchange(told_, true)) throw io::Error("", 0, first_loss_);
    return false;
  }
  std::string damage() const override { return ""; }
  std::string losses() const override { return io::losses_text(lost_count_, "file", first_loss_); }
  py::list sensors() const override {
    std::set<std::string> names;
    for (const std::string& file : files_) names.insert(sensor_of(file));
    py::list out;
    for (const std::string& name : names) out.append(to_text(name));
    return out;
  }

 private:
  static std::string sensor_of(const std::string& file) {  // FRAME_SENSOR.EXT
    const std::string stem = io::stem_of(file);
    const auto bar = stem.find('_');
    const bool digits = stem.substr(0, bar).find_first_not_of("0123456789") == std::string::npos;
    return digits && bar != std::string::npos ? stem.substr(bar + 1) : "";
  }

  std::vector<std::string> files_;
  std::size_t next_ = 0;
  int64_t lost_count_ = 0;
  std::string first_loss_;
  bool told_ = false;
};

// An iterator over the scans of a recording.
class ScanIterator {
 public:
  // kept: what must live as long as the recording is read.
  ScanIterator(std::string path, std::unique_ptr<ScanReader> reader, py::object kept)
      : path_(std::move(path)),
        kept_(std::move(kept)),
        reader_(std::move(reader)),
        sensors_(reader_->sensors()),
        damage_(reader_->damage()) {}
  PyScan next() {
    if (forks_ != fork_count())
      throw ReleasedError("this process was forked after the recording was opened: open it again here");
    const Busy busy(busy_);
    PyScan scan;
    const bool found = !ended_ && reader_->next(scan);
    damage_ = reader_->damage(), losses_ = reader_->losses();
    if (found) return scan;
    if (!std::exchange(ended_, true)) {
      if (!damage_.empty()) warn_of_damage(path_ + ": " + damage_ + "; the scans are those before it");
      if (!losses_.empty()) warn_of_damage(path_ + ": " + losses_);
    }
    throw py::stop_iteration();
  }
  // Copies: another thread may be in next(), which reads without the GIL.
  const std::string& damage() const { return damage_; }
  const std::string& losses() const { return losses_; }
  const py::list& sensors() const { return sensors_; }

 private:
  const std::string path_;
  const py::object kept_;
  std::unique_ptr<ScanReader> reader_;
  const py::list sensors_;
  std::string damage_, losses_;
  const int32_t forks_ = fork_count();
  bool busy_ = false, ended_ = false;
};

std::unique_ptr<ScanReader> open_reader(const cli::Options& options) {
  const cli::Config config = cli::load_config(options);
  if (config.has_rig) return std::make_unique<RigReader>(config);
  io::check_one_kind(options.input);
  if (io::is_bag(options.input)) return std::make_unique<BagReader>(options.input);
  return std::make_unique<FileReader>(options.input);
}

std::unique_ptr<ScanIterator> open_recording(const py::dict& from, py::object kept) {
  const cli::Options options = to_options(from);
  auto reader = without_gil([&] { return open_reader(options); });
  for (const std::string& note : reader->notes()) warn(note);
  return std::make_unique<ScanIterator>(options.input, std::move(reader), std::move(kept));
}

}  // namespace

void add_recordings(py::module_& module) {
  module.def("open_recording", &open_recording);
  py::class_<PyScan>(module, "Scan", R"(One scan of one sensor, as arrays.

points: a dict of arrays (n,). With a rig: x, y, z in m (sensor frame), layer, and where the recording has them
intensity and time (ns after stamp_ns): what Detector.push_scan takes. Without a rig: the fields of the file; of a
bag x, y, z, intensity, layer and time.)")
      .def_property_readonly(
          "sensor", [](const PyScan& scan) { return to_text(scan.sensor); },
          "Name of the sensor; without a rig: the topic, or the word of the file.")
      .def_readonly("frame", &PyScan::frame, "Number of the frame in the recording; without a rig: of the scan.")
      .def_readonly("stamp_ns", &PyScan::stamp_ns, "Stamp in ns; 0 where files have none and there is no rig.")
      .def_property_readonly(
          "path",
          [](const PyScan& scan) {
            return py::reinterpret_steal<py::str>(
                PyUnicode_DecodeFSDefaultAndSize(scan.path.data(), py::ssize_t(scan.path.size())));
          },
          "The file.")
      .def_readonly("points", &PyScan::points, "Columns by name.")
      .def_readonly("ego_poses", &PyScan::ego_poses,
                    "Own poses to push before this scan: dicts of the arguments of push_ego_pose.")
      .def("__len__", [](const PyScan& scan) { return scan.count; })
      .def("__repr__", [](const PyScan& scan) {
        return to_text("<overtake.Scan of " + scan.sensor + ", frame " + std::to_string(scan.frame) + ": " +
                           std::to_string(scan.count) + " points>",
                       "backslashreplace");
      });
  py::class_<ScanIterator>(module, "ScanIterator")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &ScanIterator::next)
      .def_property_readonly("damage", [](const ScanIterator& scans) { return to_text(scans.damage()); })
      .def_property_readonly("losses", [](const ScanIterator& scans) { return to_text(scans.losses()); })
      .def_property_readonly("sensors", &ScanIterator::sensors);
}

}  // namespace overtake::python
