// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/simulated_log.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/ros_messages.h"

namespace overtake::evaluation {
namespace {

std::vector<uint16_t> decode_surface(const std::string& path, const io::PointCloud2& cloud) {
  const uint64_t count = uint64_t(cloud.width) * cloud.height;
  for (const io::PointField& field : cloud.fields) {
    if (field.name != "surface") continue;
    if (field.datatype != io::PointField::kUint16 || uint64_t(field.offset) + 2 > cloud.point_step ||
        count > uint64_t(INT32_MAX) || count * cloud.point_step > cloud.data.size())
      throw io::Error(path, 0, "the surfaces of a scan do not fit their message");
    std::vector<uint16_t> out(count);
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(&out[i], cloud.data.data() + i * cloud.point_step + field.offset, 2);
    return out;
  }
  throw io::Error(path, 0, "the truth of a scan has no field 'surface'");
}

TruthFrame decode_cars(const std::string& path, std::string_view text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    TruthFrame out{json.at("stamp_ns").get<int64_t>(), json.at("frame").get<int64_t>(), {}};
    for (const auto& c : json.at("cars"))
      out.cars.push_back({c.at("car"), c.at("is_ego"), c.at("x_m"), c.at("y_m"), c.at("z_m"), c.at("roll_rad"),
                          c.at("pitch_rad"), c.at("heading_rad"), c.at("course_rad"), c.at("speed_mps"),
                          c.at("yaw_rate_rps"), c.value("d_m", std::numeric_limits<double>::quiet_NaN())});
    return out;
  } catch (const nlohmann::json::exception& error) {
    throw io::Error(path, 0, std::string("/truth/cars: ") + error.what());
  }
}

}  // namespace

SimulatedLog::SimulatedLog(const std::string& path) : reader_(path) { start(); }

// The mounting is the first message; metadata, rig and map come before it.
void SimulatedLog::start() {
  while (true) {
    for (const io::McapAttachment& a : reader_.attachments()) {
      if (a.name == "rig.toml" && rig_.sensors.empty()) rig_ = io::parse_rig(reader_.path() + ": rig.toml", a.data);
      if (a.name == "map.csv") map_text_ = a.data;
    }
    const auto found = reader_.metadata().find("overtake");
    if (found != reader_.metadata().end()) about_ = found->second;
    if (!rig_.sensors.empty() && !about_.empty() && (!map_text_.empty() || lacks(*this, "map"))) return;
    if (!read_message())
      throw io::Error(reader_.path(), 0, "no log of overtake simulate: its rig, map or metadata is missing");
  }
}

bool SimulatedLog::read_message() {
  io::McapMessage message;
  if (ended_ || !reader_.next(message)) {
    ended_ = true;
    return false;
  }
  newest_ns_ = message.log_ns;
  const std::string& topic = reader_.channels().at(message.channel_id).topic;
  try {
    take_message(topic, message);
  } catch (const io::Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw io::Error(reader_.path() + ": " + topic, 0, error.what());
  }
  return true;
}

void SimulatedLog::take_message(const std::string& topic, const io::McapMessage& message) {
  if (topic == "/truth/cars") {
    truth_.push_back(decode_cars(reader_.path(), message.data));
    return;
  }
  if (topic == "/ego/odometry" || topic == "/truth/ego/odometry") {
    const io::Odometry odometry = io::decode_odometry(message.data);
    const io::RollPitchYaw angles = io::rotation_of(odometry.pose);
    const io::RosPose& p = odometry.pose;
    if (topic == "/ego/odometry") {
      const io::EgoRow row{odometry.header.stamp_ns, p.x_m,          p.y_m,           p.z_m,          angles.roll_rad,
                           angles.pitch_rad,         angles.yaw_rad, odometry.vx_mps, odometry.wz_rps};
      poses_.push_back({row, message.publish_ns});
    } else {
      ego_truth_[odometry.header.stamp_ns] = {
          -1, true, p.x_m, p.y_m, p.z_m, angles.roll_rad, angles.pitch_rad, angles.yaw_rad, 0, 0, 0};
    }
    return;
  }
  for (int32_t s = 0; s < int32_t(rig_.sensors.size()); ++s) {
    const std::string& name = rig_.sensors[std::size_t(s)].name;
    const bool is_scan = topic == "/" + name + "/points", is_truth = topic == "/truth/" + name + "/surface";
    if (!is_scan && !is_truth) continue;
    const io::PointCloud2 cloud = io::decode_point_cloud2(message.data);
    const std::string place = reader_.path() + ": " + topic;
    Half& half = waiting_[{cloud.header.stamp_ns, s}];
    if (first_scan_ns_ == INT64_MIN) first_scan_ns_ = cloud.header.stamp_ns;
    if (cloud.header.stamp_ns - first_scan_ns_ < skip_ns_) {  // the frame without its points
      half.scan.sensor = s, half.scan.stamp_ns = cloud.header.stamp_ns;
      (is_scan ? half.has_scan : half.has_surface) = true;
      continue;
    }
    if (is_scan) {
      half.scan = io::make_scan(place, io::read_cloud_message(place, cloud), rig_, s, cloud.header.stamp_ns);
      half.has_scan = true;
    } else {
      half.surface = decode_surface(place, cloud);
      half.has_surface = true;
    }
  }
}

void SimulatedLog::forget() {
  waiting_.clear(), poses_.clear(), truth_.clear(), ego_truth_.clear();
  newest_ns_ = INT64_MIN, ended_ = false;
}

// The chunk where reading goes on may begin within a frame: the log leaves out this frame, too.
int64_t SimulatedLog::skip_frames(int64_t until_ns, int64_t pose_count) {
  constexpr int64_t kFirstBack = 2'000'000'000;
  skip_ns_ = until_ns;
  const int64_t until = first_scan_ns_ + until_ns, period = rig_.period_ns();
  if (until - kFirstBack <= newest_ns_) return 0;
  const int64_t wanted = lacks(*this, "poses") ? 0 : pose_count;
  for (int64_t back = kFirstBack;; back *= 2) {
    bool is_first = false;
    if (!reader_.seek(until - back, is_first)) return 0;
    forget();
    while (newest_ns_ < until && read_message()) {
    }
    const auto known = std::count_if(poses_.begin(), poses_.end(),
                                     [&](const PublishedPose& pose) { return pose.publish_ns <= until; });
    if (known < wanted && !is_first) continue;
    for (const TruthFrame& truth : truth_) {
      if (waiting_.empty() || truth.stamp_ns < waiting_.begin()->first.first + period) continue;
      waiting_.erase(waiting_.begin(), waiting_.lower_bound({truth.stamp_ns - period / 2, 0}));
      return truth.frame - std::exchange(frame_, truth.frame);
    }
    if (is_first) return 0;
  }
}

bool SimulatedLog::next(LogFrame& out) {
  const int64_t period = rig_.period_ns();
  while (waiting_.empty() || newest_ns_ < waiting_.begin()->first.first + 3 * period)
    if (!read_message()) break;
  if (waiting_.empty()) return false;
  out = LogFrame();
  out.scans.frame = frame_++;
  const int64_t first = waiting_.begin()->first.first;
  std::map<int32_t, Half> of_sensor;
  while (!waiting_.empty() && waiting_.begin()->first.first < first + period / 2) {
    const int32_t sensor = waiting_.begin()->first.second;
    Half half = std::move(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
    if (half.has_scan && half.has_surface) of_sensor[sensor] = std::move(half);
  }
  for (auto& [sensor, half] : of_sensor) {
    if (half.surface.size() != std::size_t(half.scan.count))
      throw io::Error(half.scan.path, 0, "a scan and its truth have different numbers of points");
    out.scans.scans.push_back(std::move(half.scan));
    out.surface.push_back(std::move(half.surface));
  }
  if (out.scans.scans.empty()) return next(out);  // the log ends between a scan and its truth
  return true;
}

std::vector<CarTruth> SimulatedLog::cars_at(int64_t stamp_ns) const {
  auto above = std::lower_bound(truth_.begin(), truth_.end(), stamp_ns,
                                [](const TruthFrame& f, int64_t t) { return f.stamp_ns < t; });
  if (truth_.empty()) return {};
  // Beyond an end, the line through its two frames goes on: course and speed keep their rates.
  if (truth_.size() > 1) above = std::clamp(above, truth_.begin() + 1, truth_.end() - 1);
  const TruthFrame& b = above == truth_.end() ? truth_.back() : *above;
  const TruthFrame& a = above == truth_.begin() || above == truth_.end() ? b : *(above - 1);
  constexpr int64_t kHeld = 100'000'000;
  if (stamp_ns > b.stamp_ns + kHeld || stamp_ns < a.stamp_ns - kHeld) return {};
  const double w = a.stamp_ns == b.stamp_ns ? 0 : double(stamp_ns - a.stamp_ns) / double(b.stamp_ns - a.stamp_ns);
  // Of a single frame.
  const double on_s = a.stamp_ns == b.stamp_ns ? double(stamp_ns - a.stamp_ns) * 1e-9 : 0;
  std::vector<CarTruth> out;
  for (std::size_t i = 0; i < std::min(a.cars.size(), b.cars.size()); ++i) {
    CarTruth p = a.cars[i], q = b.cars[i];
    if (p.is_ego) {
      const auto pe = ego_truth_.find(a.stamp_ns), qe = ego_truth_.find(b.stamp_ns);
      if (pe != ego_truth_.end() && qe != ego_truth_.end()) {
        for (auto [to, from] : {std::pair(&p, &pe->second), std::pair(&q, &qe->second)})
          to->x_m = from->x_m, to->y_m = from->y_m, to->z_m = from->z_m;
      }
    }
    const auto mix = [w](double x, double y) { return x + w * (y - x); };
    const auto turn = [w](double x, double y) { return wrap_angle(x + w * wrap_angle(y - x)); };
    CarTruth c = p;
    c.x_m = mix(p.x_m, q.x_m) + p.speed_mps * on_s * std::cos(p.course_rad);
    c.y_m = mix(p.y_m, q.y_m) + p.speed_mps * on_s * std::sin(p.course_rad);
    c.z_m = mix(p.z_m, q.z_m);
    c.roll_rad = turn(p.roll_rad, q.roll_rad), c.pitch_rad = turn(p.pitch_rad, q.pitch_rad);
    c.heading_rad = turn(p.heading_rad, q.heading_rad), c.course_rad = turn(p.course_rad, q.course_rad);
    c.offset_m = mix(p.offset_m, q.offset_m);
    c.speed_mps = mix(p.speed_mps, q.speed_mps), c.yaw_rate_rps = mix(p.yaw_rate_rps, q.yaw_rate_rps);
    out.push_back(c);
  }
  return out;
}

}  // namespace overtake::evaluation
