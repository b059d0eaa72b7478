// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake.run: a detector over a recording, frame by frame.
#include <pybind11/stl.h>

#include <cstdio>
#include <map>
#include <utility>

#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/scan_stream.h"
#include "tools/io/words.h"
#include "tools/python/files.h"
#include "tools/python/frame.h"
#include "tools/python/params.h"

namespace overtake::python {
namespace {

// The part of `overtake run` between the command line and the result files.
class Run {
 public:
  // kept: what must live as long as the recording is read.
  Run(const py::dict& from, const py::object& params, py::object kept)
      : kept_(std::move(kept)), config_(load_config(to_options(from))) {
    if (!params.is_none()) {
      const double period_s = config_.params.frame_period_s;  // of the rig
      const auto& set = py::cast<const ParamSet&>(params);
      config_.params = set.values;
      config_.preset = config_.params.method;
      if (!set.has_period) config_.params.frame_period_s = period_s;
    }
    CopyOptions copies;
    copies.sensor_count = int32_t(config_.rig.sensors.size());
    copies.labels = to_number<bool>(from["copy_labels"], "copy_labels");
    copies.images = to_number<bool>(from["copy_images"], "copy_images");
    copies.path_horizon_s = to_horizon(from["path_horizon_s"], config_.params);
    config_.keep_images = copies.images;
    config_.in_pieces = to_number<bool>(from["stream"], "stream");
    auto names = std::make_shared<SensorNames>();
    for (const io::RigSensor& sensor : config_.rig.sensors) names->push_back(sensor.name);
    sensors_ = names;
    const py::gil_scoped_release release;
    stream_ = io::open_scans(config_.input, config_.rig);
    if (!config_.map.empty() && !config_.own_map && config_.ego.empty() && (!stream_->has_ego() || config_.no_ego))
      throw io::Error("map " + config_.map, 0, "has no effect without ego poses, and there are none");
    queue_ = std::make_unique<FrameQueue>(copies);
    session_ = std::make_unique<cli::Session>(config_, &FrameQueue::on_frame, queue_.get());
    damage_ = stream_->damage();
  }
  ~Run() {
    const py::gil_scoped_release release;
    session_.reset();  // before the queue that it fills
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  py::object next() {
    check_process();
    const Busy busy(busy_);
    CopiedFrame frame;
    while (!queue_->pop(frame)) {
      if (ended_) {
        finish();
        throw py::stop_iteration();
      }
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      without_gil([&] { push_next(); });
      damage_ = stream_->damage();
      progress_ = ended_ ? 1.0 : stream_->progress();
    }
    count(frame);
    return make_frame(frame.info, std::move(frame.source), sensors_, number_of(frame.info));
  }

  py::dict stats() const {
    check_process();
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
  // Copies: another thread may be in next(), which reads without the GIL.
  const std::string& damage() const { return damage_; }
  double progress() const { return progress_; }
  const SensorNames& sensors() const { return *sensors_; }
  std::string config_text() const { return cli::format_config(config_); }

 private:
  static cli::Config load_config(const cli::Options& options) {
    return without_gil([&] { return cli::load_config_with_rig(options); });
  }
  void check_process() const {
    if (forks_ != fork_count()) throw ReleasedError("this process was forked after the run began: begin it again here");
  }
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
    without_data_ += (frame.info.flags & OVT_FLAG_NO_DATA) != 0;
    ovt_detections detections;
    std::shared_ptr<const TracksCopy> tracks;
    check(frame.source->read_detections(detections), "detections");
    check(frame.source->read_tracks(OVT_AT_FRAME_STAMP, tracks), "tracks");
    hash_.add(frame.info, detections, tracks->rows);
  }
  void finish() {
    if (std::exchange(finished_, true)) return;
    for (const std::string& note : session_->file_notes()) warn(note);
    if (!damage_.empty()) warn_of_damage(config_.input + ": " + damage_ + "; the frames are those before it");
    if (stream_->lost_count() > 0) warn_of_damage(config_.input + ": " + stream_->losses());
    if (without_data_ == frames_) throw io::Error(config_.input, 0, session_->why_no_data(damage_));
    if (2 * off_map_ > frames_)
      warn_of_damage(config_.map + ": the ego vehicle is outside of this map in " + std::to_string(off_map_) + " of " +
                     std::to_string(frames_) + " frames: map and poses are of different courses");
    if (session_->direction().is_against())
      warn_of_damage(config_.map + ": " + session_->direction().sentence("this map") + ": turn its lines round");
    if (!config_.ego.empty() && 2 * with_ego_ < frames_)
      warn_of_damage(config_.ego + ": covers only " + std::to_string(with_ego_) + " of " + std::to_string(frames_) +
                     " frames");
  }

  const py::object kept_;
  cli::Config config_;
  std::shared_ptr<const SensorNames> sensors_;
  std::unique_ptr<io::ScanStream> stream_;
  std::unique_ptr<FrameQueue> queue_;
  std::unique_ptr<cli::Session> session_;
  std::map<int64_t, int64_t> numbers_;  // of frames, by the stamps of their scans
  cli::ResultHash hash_;
  std::string damage_;
  double progress_ = 0;
  int64_t frames_ = 0, off_map_ = 0, with_ego_ = 0, without_data_ = 0;
  const int32_t forks_ = fork_count();
  bool busy_ = false, ended_ = false, finished_ = false;
};

}  // namespace

void add_runs(py::module_& module) {
  py::class_<Run>(module, "Run", "The frames of a recording, one after the other: what overtake.run returns.")
      .def(py::init<const py::dict&, const py::object&, py::object>())
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
