// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/variant.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <random>

#include "tools/io/angles.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::evaluation {
namespace {

io::CloudColumn take(const io::CloudColumn& column, const std::vector<int32_t>& rows) {
  io::CloudColumn out;
  out.type = column.type;
  if (column.bytes.empty()) return out;
  const std::size_t size = io::size_of(column.type);
  out.bytes.resize(rows.size() * size);
  for (std::size_t i = 0; i < rows.size(); ++i)
    std::memcpy(&out.bytes[i * size], &column.bytes[std::size_t(rows[i]) * size], size);
  return out;
}

}  // namespace

std::string config_name(const std::string& file) {
  const std::filesystem::path path(file);
  return (path.extension() == ".toml" ? path.stem() : path.filename()).string();
}

cli::Options options_of(const std::string& name, const ConfigFiles& files) {
  cli::Options options;
  const auto file = files.find(name);
  (file == files.end() ? options.preset : options.config) = file == files.end() ? name : file->second;
  return options;
}

std::vector<std::string> variant_names() {
  return {"ground", "clusters", "heading", "relay", "ego", "mounting", "empty", "shuffled", "late_truth"};
}

std::vector<std::string> condition_names() { return {"no_map", "no_poses"}; }

// Signs that differ between sensors and axes: the bits of a small hash.
io::Rig misplace(io::Rig rig) {
  for (std::size_t k = 0; k < rig.sensors.size(); ++k) {
    const uint64_t bits = (k + 1) * 0x9e3779b97f4a7c15u;
    const auto sign = [bits](int32_t axis) { return bits >> (20 + 5 * axis) & 1 ? 1.0 : -1.0; };
    io::RigSensor& s = rig.sensors[k];
    s.x_m += 0.02 * sign(0), s.y_m += 0.02 * sign(1), s.z_m += 0.02 * sign(2);
    s.roll_deg += 0.2 * sign(3), s.pitch_deg += 0.2 * sign(4), s.yaw_deg += 0.2 * sign(5);
  }
  return rig;
}

namespace {

// The lowest ground point of each column of the sensor's image.
std::vector<bool> lowest_ground(const io::SensorScan& scan, const std::vector<uint16_t>& surface,
                                const io::RigSensor& sensor) {
  std::vector<int32_t> lowest(std::size_t(sensor.cols), -1);
  std::vector<double> tangent(std::size_t(sensor.cols), 0.0);
  for (std::size_t i = 0; i < surface.size(); ++i) {
    if (kind_of(surface[i]) != Kind::kGround) continue;
    const double x = scan.x.value(i), y = scan.y.value(i), z = scan.z.value(i);
    const double from_left = sensor.azimuth_left_deg - std::atan2(y, x) * 180 / io::kPi;
    const double column = from_left / (sensor.azimuth_left_deg - sensor.azimuth_right_deg) * sensor.cols;
    if (!(column >= 0 && column < sensor.cols)) continue;
    const std::size_t c = std::size_t(column);
    const double t = z / std::hypot(x, y);
    if (lowest[c] < 0 || t < tangent[c]) lowest[c] = int32_t(i), tangent[c] = t;
  }
  std::vector<bool> keep(surface.size(), false);
  for (const int32_t i : lowest)
    if (i >= 0) keep[std::size_t(i)] = true;
  return keep;
}

// The preset's parameters with the changed one.
cli::Config read_name(const std::string& name, const ConfigFiles& files, std::string& variant) {
  if (name.empty()) throw io::Error("--preset", 0, "a name is empty");
  const std::size_t at = name.find('@'), colon = name.find(':');
  cli::Options options = options_of(name.substr(0, std::min(at, colon)), files);
  if (at != std::string::npos) options.set.push_back(name.substr(at + 1));
  if (at == std::string::npos && colon != std::string::npos) {
    variant = name.substr(colon + 1);
    auto known = variant_names();
    for (const std::string& condition : condition_names()) known.push_back(condition);
    if (std::find(known.begin(), known.end(), variant) == known.end())
      throw io::Error(
          "--preset " + name, 0,
          "no variant '" + variant + "'; there are " + io::join(known, ", ") + io::did_you_mean(variant, known));
  }
  cli::Config config = cli::load_config(options);
  if (variant == "ground" && !cli::reads_param(config.params, "ground.threshold_deg"))
    throw io::Error("--preset " + name, 0,
                    "this method does not judge ground by angles: it has no oracle of the ground");
  return config;
}

}  // namespace

std::vector<std::string> variants_of(const std::string& name, const ConfigFiles& files) {
  std::string none;
  const bool has_ground = cli::reads_param(read_name(name, files, none).params, "ground.threshold_deg");
  std::vector<std::string> names = variant_names();
  if (!has_ground) std::erase(names, "ground");
  return names;
}

LogFrame take_points(const LogFrame& frame, const std::vector<std::vector<int32_t>>& rows) {
  LogFrame out;
  out.scans.frame = frame.scans.frame;
  for (std::size_t k = 0; k < frame.scans.scans.size(); ++k) {
    const io::SensorScan& from = frame.scans.scans[k];
    io::SensorScan scan;
    scan.sensor = from.sensor, scan.path = from.path, scan.stamp_ns = from.stamp_ns, scan.frame_id = from.frame_id;
    scan.count = int32_t(rows[k].size());
    scan.x = take(from.x, rows[k]), scan.y = take(from.y, rows[k]), scan.z = take(from.z, rows[k]);
    scan.layer = take(from.layer, rows[k]), scan.intensity = take(from.intensity, rows[k]);
    std::vector<uint16_t> surface;
    for (const int32_t r : rows[k]) {
      if (!frame.surface.empty()) surface.push_back(frame.surface[k][std::size_t(r)]);
      if (!from.time_offset_ns.empty()) scan.time_offset_ns.push_back(from.time_offset_ns[std::size_t(r)]);
    }
    out.scans.scans.push_back(std::move(scan));
    if (!frame.surface.empty()) out.surface.push_back(std::move(surface));
  }
  return out;
}

void check_variant(const std::string& name, const ConfigFiles& files) {
  std::string variant;
  read_name(name, files, variant);
}

Variant::Variant(const std::string& name, const TruthLog& log, const std::string& map_file, int32_t every,
                 const ConfigFiles& files)
    : name_(name), log_(log), every_(is_of_sweep(name) ? every : 1), map_file_(map_file) {
  cli::Config config = read_name(name, files, variant_);
  config.map = variant_ == "no_map" ? "" : map_file;
  config.ego.clear(), config.own_map = config.own_ego = false;
  config.workers = 1;
  config.rig = variant_ == "mounting" ? misplace(log.rig()) : log.rig();
  config.has_rig = true;
  std::string period;
  io::append_number(period, log.rig().period_s * every_);
  if (ovt_set_param(&config.params, "frame.period_s", period.c_str()) != OVT_OK)
    throw io::Error("--every " + std::to_string(every), 0, "a sweep needs frames that are at most 10 s apart");
  if (variant_ == "ground") config.params.ground_threshold_rad = 0;
  params_ = config.params;
  evaluator_ = std::make_unique<Evaluator>(log, config.params, variant_ == "late_truth" ? log.rig().period_ns() : 0);
  if (!map_file.empty()) evaluator_->use_circuit(map_file);
  without_poses_ = variant_ == "no_poses" || (variant_ != "ego" && lacks(log, "poses"));
  if (variant_ == "ego" || without_poses_) evaluator_->use_poses(true_poses_);
  if (variant_ == "heading" || variant_ == "clusters" || variant_ == "relay")
    replay_ = std::make_unique<TrackerReplay>(variant_, log, config);
  session_ = std::make_unique<cli::Session>(config, &Variant::on_frame, this);
}

void Variant::take_pictures() { picker_ = std::make_unique<SnapshotPicker>(log_, params_, map_file_); }

void Variant::on_frame(ovt_reader* reader, void* self) {
  auto& variant = *static_cast<Variant*>(self);
  if (variant.failure_) return;
  try {
    ovt_frame_info info;
    cli::check(ovt_read_info(reader, &info), "frame");
    const bool relayed = variant.replay_ && info.sensor_mask != 0 && variant.input_;
    variant.evaluator_->add(reader, relayed ? &variant.replay_->run(reader, *variant.input_) : nullptr);
    if (variant.picker_) variant.picker_->look(reader);
  } catch (...) {  // must not pass through the library
    variant.failure_ = std::current_exception();
  }
}

// The true poses since the last call, at 100 Hz; the evaluator judges by them.
std::vector<io::EgoRow> Variant::true_poses(int64_t until_ns) {
  std::vector<io::EgoRow> rows;
  if (next_true_ns_ == INT64_MIN) next_true_ns_ = until_ns - 2 * log_.rig().period_ns();
  for (; next_true_ns_ <= until_ns; next_true_ns_ += 10'000'000)
    for (const CarTruth& c : log_.cars_at(next_true_ns_))
      if (c.is_ego) rows.push_back(true_pose(c, next_true_ns_));
  for (const io::EgoRow& row : rows) true_poses_.push_back({row, row.stamp_ns});
  return rows;
}

// Pushes the poses that the localisation has published by the end of the frame, or the truth at 100 Hz.
void Variant::push_poses(int64_t until_ns) {
  std::vector<io::EgoRow> rows;
  if (variant_ == "ego") {
    rows = true_poses(until_ns);
  } else if (without_poses_) {
    true_poses(until_ns);
  } else {
    const auto& poses = log_.poses();
    for (; next_pose_ < poses.size() && poses[next_pose_].publish_ns <= until_ns; ++next_pose_)
      rows.push_back(poses[next_pose_].row);
  }
  session_->add_ego(rows);
  if (replay_) replay_->add_poses(rows);
}

void Variant::push(const LogFrame& frame) {
  const LogFrame* input = &frame;
  LogFrame changed;
  if (variant_ == "ground" || variant_ == "empty" || variant_ == "shuffled") {
    if (frame.surface.size() != frame.scans.scans.size() && variant_ != "shuffled")
      throw io::Error(name_, 0, "the log does not say what each point lies on");
    std::vector<std::vector<int32_t>> rows;
    for (std::size_t k = 0; k < frame.scans.scans.size(); ++k) {
      const io::SensorScan& scan = frame.scans.scans[k];
      std::vector<bool> lowest;
      if (variant_ == "ground")
        lowest = lowest_ground(scan, frame.surface[k], log_.rig().sensors[std::size_t(scan.sensor)]);
      std::vector<int32_t> keep;
      for (int32_t i = 0; i < scan.count; ++i) {
        const Kind kind = frame.surface.empty() ? Kind::kGround : kind_of(frame.surface[k][std::size_t(i)]);
        if (variant_ == "shuffled" || (variant_ == "empty" && kind != Kind::kCar && kind != Kind::kNoise) ||
            (variant_ == "ground" && (is_positive(kind) || lowest[std::size_t(i)])))
          keep.push_back(i);
      }
      if (variant_ == "shuffled") {
        std::mt19937_64 random(uint64_t(frame.scans.frame));
        for (std::size_t i = keep.size(); i > 1; --i) std::swap(keep[i - 1], keep[std::size_t(random() % i)]);
      }
      rows.push_back(std::move(keep));
    }
    changed = take_points(frame, rows);
    input = &changed;
  }
  int64_t first_ns = INT64_MAX;
  for (const io::SensorScan& scan : input->scans.scans) first_ns = std::min(first_ns, scan.stamp_ns);
  push_poses(first_ns + log_.rig().period_ns());
  ++frames_;
  evaluator_->expect(*input);
  input_ = input;
  if (picker_) picker_->expect(*input);
  try {
    session_->push(input->scans);
    session_->flush();  // a sensor may be missing: the frame ends here
  } catch (...) {       // results after the error are not evaluated
    failure_ = std::current_exception();
  }
  evaluator_->expect_nothing();
  input_ = nullptr;
  if (failure_) std::rethrow_exception(failure_);
}

void Variant::finish() {
  session_->flush();
  if (failure_) std::rethrow_exception(failure_);
}

}  // namespace overtake::evaluation
