// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <map>

#include "tools/io/mcap_writer.h"
#include "tools/io/output.h"
#include "tools/io/ros_messages.h"
#include "tools/io/text.h"
#include "tools/sim/log_writer.h"

namespace overtake::sim {
namespace {

constexpr const char* kCarsSchema = R"({"title":"overtake.CarStates","type":"object","properties":{
"frame":{"type":"integer"},"stamp_ns":{"type":"integer"},"cars":{"type":"array","items":{"type":"object","properties":{
"car":{"type":"integer"},"name":{"type":"string"},"is_ego":{"type":"boolean"},
"x_m":{"type":"number"},"y_m":{"type":"number"},"z_m":{"type":"number"},
"roll_rad":{"type":"number"},"pitch_rad":{"type":"number"},
"heading_rad":{"type":"number"},"course_rad":{"type":"number"},
"speed_mps":{"type":"number"},"yaw_rate_rps":{"type":"number"},
"accel_along_mps2":{"type":"number"},"accel_across_mps2":{"type":"number"},
"s_m":{"type":"number"},"d_m":{"type":"number"},"length_m":{"type":"number"},"width_m":{"type":"number"}}}}}})";

// The unit quaternion of a rotation, from the largest of its four terms; uses no libm function except sqrt.
void set_rotation(io::RosPose& pose, const Mat3& m) {
  const double trace = m.x.x + m.y.y + m.z.z;
  double q[4];  // w x y z
  if (trace > 0) {
    const double s = 2 * std::sqrt(1 + trace);
    q[0] = s / 4, q[1] = (m.y.z - m.z.y) / s, q[2] = (m.z.x - m.x.z) / s, q[3] = (m.x.y - m.y.x) / s;
  } else if (m.x.x > m.y.y && m.x.x > m.z.z) {
    const double s = 2 * std::sqrt(1 + m.x.x - m.y.y - m.z.z);
    q[0] = (m.y.z - m.z.y) / s, q[1] = s / 4, q[2] = (m.x.y + m.y.x) / s, q[3] = (m.z.x + m.x.z) / s;
  } else if (m.y.y > m.z.z) {
    const double s = 2 * std::sqrt(1 + m.y.y - m.x.x - m.z.z);
    q[0] = (m.z.x - m.x.z) / s, q[1] = (m.x.y + m.y.x) / s, q[2] = s / 4, q[3] = (m.y.z + m.z.y) / s;
  } else {
    const double s = 2 * std::sqrt(1 + m.z.z - m.x.x - m.y.y);
    q[0] = (m.x.y - m.y.x) / s, q[1] = (m.z.x + m.x.z) / s, q[2] = (m.y.z + m.z.y) / s, q[3] = s / 4;
  }
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  pose.qw = q[0] / size, pose.qx = q[1] / size, pose.qy = q[2] / size, pose.qz = q[3] / size;
}

template <class T>
void put(std::string& to, T value) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  to.append(bytes, sizeof(T));
}

class McapLog : public LogWriter {
 public:
  McapLog(const std::string& path, const Simulator& simulator, uint64_t seed)
      : simulator_(simulator),
        log_(path),
        ego_(simulator.scenario().without_poses ? std::vector<EgoPose>() : simulator.ego_poses()) {
    const Scenario& scenario = simulator.scenario();
    const uint16_t clouds = log_.add_schema(io::kPointCloud2Name, "ros2msg", io::kPointCloud2Schema);
    const uint16_t odometry = log_.add_schema(io::kOdometryName, "ros2msg", io::kOdometrySchema);
    const uint16_t transforms = log_.add_schema(io::kTransformsName, "ros2msg", io::kTransformsSchema);
    const uint16_t cars = log_.add_schema("overtake.CarStates", "jsonschema", kCarsSchema);
    for (int32_t s = 0; s < kSensors; ++s) {
      const std::string sensor = kSensorName[s];
      cloud_channel_[s] = log_.add_channel(clouds, "/" + sensor + "/points", "cdr");
      surface_channel_[s] = log_.add_channel(clouds, "/truth/" + sensor + "/surface", "cdr");
    }
    if (!ego_.empty()) ego_channel_ = log_.add_channel(odometry, "/ego/odometry", "cdr");
    cars_channel_ = log_.add_channel(cars, "/truth/cars", "json");
    ego_truth_channel_ = log_.add_channel(odometry, "/truth/ego/odometry", "cdr");
    int32_t opponents = 0;
    for (std::size_t i = 0; i < scenario.cars.size(); ++i) {
      if (int32_t(i) == simulator.world().ego) {
        car_channel_.push_back(ego_truth_channel_);
        continue;
      }
      const std::string topic = ++opponents == 1 ? "/opponent" : "/opponent_" + std::to_string(opponents);
      car_channel_.push_back(log_.add_channel(odometry, topic + "/odometry", "cdr"));
    }
    static_channel_ = log_.add_channel(transforms, "/tf_static", "cdr");
    queue(0, static_channel_, 0, mounting());
    std::map<std::string, std::string> about = {{"writer", "overtake simulate"}, {"simulated", "true"},
                                                {"scenario", scenario.name},     {"seed", std::to_string(seed)},
                                                {"ego", scenario.ego},           {"track", scenario.track}};
    if (scenario.without_map || scenario.without_poses)
      about["without"] = !scenario.without_poses ? "map" : scenario.without_map ? "map,poses" : "poses";
    log_.add_metadata("overtake", about);
    log_.add_attachment("rig.toml", "application/toml", rig_text(simulator));
    if (!scenario.without_map) log_.add_attachment("map.csv", "text/csv", map_text(simulator));
  }

  void write(int32_t index, const SimFrame& frame) override {
    queue_ego(frame.begin_ns);
    for (int32_t s = 0; s < kSensors; ++s) {
      queue(frame.stamp_ns[s], cloud_channel_[s], frame.stamp_ns[s], points_message(frame, s));
      queue(frame.stamp_ns[s], surface_channel_[s], frame.stamp_ns[s], surface_message(frame, s));
    }
    queue_truth(index, frame.begin_ns);
    last_begin_ns_ = frame.begin_ns;
    flush(frame.begin_ns - 20'000'000);  // stamps are out of order by less than that
  }

  void close(const std::string& partial) override {
    queue_ego(partial.empty() ? INT64_MAX : last_begin_ns_);
    flush(INT64_MAX);
    if (!partial.empty()) log_.add_metadata(io::kPartialMetadata, {{"reason", partial}});
    log_.close();
  }

 private:
  struct Message {
    uint16_t channel;
    int64_t publish_ns;
    std::string data;
  };
  void queue(int64_t log_ns, uint16_t channel, int64_t publish_ns, std::string data) {
    waiting_.emplace(log_ns, Message{channel, publish_ns, std::move(data)});  // equal times keep their order
  }
  void flush(int64_t until_ns) {
    while (!waiting_.empty() && waiting_.begin()->first < until_ns) {
      const auto& [time, message] = *waiting_.begin();
      log_.write(message.channel, kEpochNs + time, message.data, kEpochNs + message.publish_ns);
      waiting_.erase(waiting_.begin());
    }
  }

  std::string mounting() const {
    std::vector<io::RosTransform> list;
    for (int32_t s = 0; s < kSensors; ++s) {
      const Rigid& nominal = simulator_.mounting(s).nominal;
      io::RosTransform t;
      t.header = {kEpochNs, "base_link"};
      t.child_frame_id = kSensorName[s];
      t.pose.x_m = nominal.place.x, t.pose.y_m = nominal.place.y, t.pose.z_m = nominal.place.z;
      set_rotation(t.pose, nominal.rotation);
      list.push_back(t);
    }
    return io::encode_transforms(list);
  }

  static io::PointCloud2 cloud_of(int64_t stamp_ns, int32_t sensor, std::size_t count, uint32_t step,
                                  const std::string& data) {
    io::PointCloud2 cloud;
    cloud.header = {kEpochNs + stamp_ns, kSensorName[sensor]};
    cloud.width = uint32_t(count);
    cloud.point_step = step;
    cloud.row_step = uint32_t(data.size());
    cloud.data = data;
    cloud.is_dense = true;
    return cloud;
  }

  static std::string points_message(const SimFrame& frame, int32_t s) {
    const Scan& scan = frame.scans[std::size_t(s)];
    std::string data;
    data.reserve(scan.size() * 22);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      put(data, scan.x_m[i]), put(data, scan.y_m[i]), put(data, scan.z_m[i]), put(data, scan.intensity[i]);
      put(data, scan.ring[i]), put(data, scan.time_ns[i]);
    }
    io::PointCloud2 cloud = cloud_of(frame.stamp_ns[s], s, scan.size(), 22, data);
    cloud.fields = {{"x", 0, io::PointField::kFloat32, 1},    {"y", 4, io::PointField::kFloat32, 1},
                    {"z", 8, io::PointField::kFloat32, 1},    {"intensity", 12, io::PointField::kFloat32, 1},
                    {"ring", 16, io::PointField::kUint16, 1}, {"t", 18, io::PointField::kUint32, 1}};
    return io::encode_point_cloud2(cloud);
  }

  static std::string surface_message(const SimFrame& frame, int32_t s) {
    const Scan& scan = frame.scans[std::size_t(s)];
    std::string data;
    for (std::size_t i = 0; i < scan.size(); ++i) put(data, scan.surface[i]), put(data, scan.return_number[i]);
    io::PointCloud2 cloud = cloud_of(frame.stamp_ns[s], s, scan.size(), 3, data);
    cloud.fields = {{"surface", 0, io::PointField::kUint16, 1}, {"return", 2, io::PointField::kUint8, 1}};
    return io::encode_point_cloud2(cloud);
  }

  void queue_ego(int64_t until_ns) {
    const LocalisationErrors& errors = simulator_.scenario().localisation;
    for (; next_ego_ < ego_.size() && ego_[next_ego_].stamp_ns <= until_ns; ++next_ego_) {
      const EgoPose& p = ego_[next_ego_];
      io::Odometry message;
      message.header = {kEpochNs + p.stamp_ns, "map"};
      message.child_frame_id = "base_link";
      message.pose.x_m = p.x_m, message.pose.y_m = p.y_m, message.pose.z_m = p.z_m;
      set_rotation(message.pose, rotation_of(p.roll_rad, p.pitch_rad, p.yaw_rad));
      const double place = square(errors.position_noise_m) + square(errors.drift_m),
                   turn = square(errors.heading_noise_rad);
      for (std::size_t k = 0; k < 6; ++k) message.pose_covariance[7 * k] = k < 3 ? place : turn;
      message.vx_mps = p.speed_mps;
      message.wz_rps = p.yaw_rate_rps;
      queue(p.stamp_ns, ego_channel_, p.publish_ns, io::encode_odometry(message));
    }
  }

  void queue_truth(int32_t index, int64_t stamp_ns) {
    std::string json =
        "{\"frame\":" + std::to_string(index) + ",\"stamp_ns\":" + std::to_string(kEpochNs + stamp_ns) + ",\"cars\":[";
    for (const TruthRow& r : truth_at(simulator_.world(), double(stamp_ns) * 1e-9)) {
      io::Odometry message;
      message.header = {kEpochNs + stamp_ns, "map"};
      message.child_frame_id = r.name;
      message.pose.x_m = r.center.x, message.pose.y_m = r.center.y, message.pose.z_m = r.center.z;
      if (r.is_ego) {  // the origin of the ego's frame is at its rear axle
        const Vec3 axle = r.state.T_map_vehicle.place;
        message.pose.x_m = axle.x, message.pose.y_m = axle.y, message.pose.z_m = axle.z;
        message.child_frame_id = "base_link";
      }
      set_rotation(message.pose, r.state.T_map_vehicle.rotation);
      const SinCos slip = sin_cos(r.state.course_rad - r.state.heading_rad);
      message.vx_mps = r.state.speed_mps * slip.cos;
      message.vy_mps = r.state.speed_mps * slip.sin;
      message.wz_rps = r.state.yaw_rate_rps;
      queue(stamp_ns, car_channel_[std::size_t(r.car)], stamp_ns, io::encode_odometry(message));
      append_json(json, r);
    }
    queue(stamp_ns, cars_channel_, stamp_ns, json + "]}");
  }

  static void append_json(std::string& json, const TruthRow& r) {
    if (json.back() != '[') json += ',';
    json += "{\"car\":" + std::to_string(r.car) + ",\"name\":\"" + r.name +
            "\",\"is_ego\":" + (r.is_ego ? "true" : "false");
    const std::pair<const char*, double> numbers[] = {{"x_m", r.center.x},
                                                      {"y_m", r.center.y},
                                                      {"z_m", r.center.z},
                                                      {"roll_rad", r.angles.roll},
                                                      {"pitch_rad", r.angles.pitch},
                                                      {"heading_rad", r.angles.yaw},
                                                      {"course_rad", wrap_angle(r.state.course_rad)},
                                                      {"speed_mps", r.state.speed_mps},
                                                      {"yaw_rate_rps", r.state.yaw_rate_rps},
                                                      {"accel_along_mps2", r.state.accel_along_mps2},
                                                      {"accel_across_mps2", r.state.accel_across_mps2},
                                                      {"s_m", r.state.s_m},
                                                      {"d_m", r.state.d_m},
                                                      {"length_m", kCarLengthM},
                                                      {"width_m", kCarWidthM}};
    for (const auto& [name, value] : numbers) {
      json += std::string(",\"") + name + "\":";
      io::append_number(json, value);
    }
    json += '}';
  }

  const Simulator& simulator_;
  io::McapWriter log_;
  std::vector<EgoPose> ego_;
  std::size_t next_ego_ = 0;
  int64_t last_begin_ns_ = 0;
  std::multimap<int64_t, Message> waiting_;
  uint16_t cloud_channel_[kSensors], surface_channel_[kSensors], ego_channel_ = 0, ego_truth_channel_, cars_channel_,
                                                                 static_channel_;
  std::vector<uint16_t> car_channel_;
};

}  // namespace

std::unique_ptr<LogWriter> make_mcap_log(const std::string& path, const Simulator& simulator, uint64_t seed) {
  return std::make_unique<McapLog>(path, simulator, seed);
}

}  // namespace overtake::sim
