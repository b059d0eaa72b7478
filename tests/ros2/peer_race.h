// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A recorded race as messages of ROS 2.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "messagesPubSubTypes.h"
#include "peer_options.h"
#include "tools/io/bag_reader.h"
#include "tools/io/ros_messages.h"

namespace overtake::ros2_peer {

struct Scan {
  std::string sensor;
  int64_t stamp_ns = 0;
  std::string message;  // CDR
};
struct Race {
  std::vector<std::vector<Scan>> frames;
  std::vector<io::Odometry> poses;
};

inline Race read_race(const Options& o) {
  Race race;
  const auto bag = io::open_bag(o.log);
  std::map<std::string, std::vector<Scan>> by_sensor;
  io::BagMessage message;
  while (bag->next(message)) {
    const io::BagTopic& topic = bag->topics()[std::size_t(message.topic)];
    if (topic.name == "/ego/odometry") race.poses.push_back(io::decode_odometry(message.data));
    if (topic.name.starts_with("/truth") || topic.type != io::kPointCloud2Name) continue;
    const std::string sensor = topic.name.substr(1, topic.name.find('/', 1) - 1);
    std::vector<Scan>& scans = by_sensor[sensor];
    if (int64_t(scans.size()) >= o.from + o.frames) continue;
    scans.push_back({sensor, io::decode_point_cloud2(message.data).header.stamp_ns, std::string(message.data)});
  }
  for (auto& [sensor, scans] : by_sensor)
    for (std::size_t i = std::size_t(o.from); i < scans.size(); ++i) {
      race.frames.resize(std::max(race.frames.size(), i - std::size_t(o.from) + 1));
      race.frames[i - std::size_t(o.from)].push_back(std::move(scans[i]));
    }
  return race;
}

inline builtin_interfaces::msg::dds_::Time_ to_time(int64_t stamp_ns) {
  builtin_interfaces::msg::dds_::Time_ time;
  time.sec(int32_t(stamp_ns / 1'000'000'000));
  time.nanosec(uint32_t(stamp_ns % 1'000'000'000));
  return time;
}
template <class T>
int64_t stamp_of(const T& time) {
  return int64_t(time.sec()) * 1'000'000'000 + int64_t(time.nanosec());
}

// The left sensor's points stay as recorded (22 bytes, not aligned), the front's take 32 bytes, the others' 24.
inline sensor_msgs::msg::dds_::PointCloud2_ make_cloud(const Options& o, const Scan& scan, int64_t stamp_ns) {
  const io::PointCloud2 in = io::decode_point_cloud2(scan.message);
  sensor_msgs::msg::dds_::PointCloud2_ out;
  out.header().stamp(to_time(stamp_ns));
  const std::string frame = value_for(o.frame_id, scan.sensor);
  out.header().frame_id(frame.empty() ? in.header.frame_id : frame);
  const std::string times = value_for(o.times, scan.sensor);
  const uint32_t copies = times.empty() ? 1 : uint32_t(std::stoul(times));
  const std::size_t count = std::size_t(in.width) * in.height;
  out.height(in.height);
  out.width(in.width * copies);
  const uint32_t step = scan.sensor == "left" ? in.point_step : scan.sensor == "front" ? 32 : 24;
  // Each value aligned to its size.
  uint32_t at = 0;
  std::vector<uint32_t> offsets;
  for (const io::PointField& field : in.fields) {
    static constexpr uint32_t kSize[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
    const uint32_t size = kSize[field.datatype];
    if (step != in.point_step) at = (at + size - 1) / size * size;
    offsets.push_back(at);
    at += size;
    if (o.drop_field == scan.sensor + "." + field.name) continue;
    sensor_msgs::msg::dds_::PointField_ described;
    described.name(field.name);
    described.offset(offsets.back());
    described.datatype(field.datatype);
    described.count(1);
    out.fields().push_back(described);
  }
  out.is_bigendian(false);
  out.point_step(step);
  out.row_step(step * out.width());
  out.data().resize(step * count * copies);
  for (std::size_t f = 0; f < in.fields.size(); ++f) {
    const std::size_t size = (f + 1 < in.fields.size() ? in.fields[f + 1].offset : in.point_step) - in.fields[f].offset;
    for (std::size_t i = 0; i < count * copies; ++i)
      std::copy_n(in.data.data() + i % count * in.point_step + in.fields[f].offset, size,
                  reinterpret_cast<char*>(out.data().data()) + i * step + offsets[f]);
  }
  out.is_dense(true);
  return out;
}

inline nav_msgs::msg::dds_::Odometry_ make_pose(const io::Odometry& in, int64_t stamp_ns, const std::string& frame) {
  nav_msgs::msg::dds_::Odometry_ out;
  out.header().stamp(to_time(stamp_ns));
  out.header().frame_id(frame.empty() ? in.header.frame_id : frame);
  out.child_frame_id(in.child_frame_id);
  auto& pose = out.pose().pose();
  pose.position().x(in.pose.x_m), pose.position().y(in.pose.y_m), pose.position().z(in.pose.z_m);
  pose.orientation().x(in.pose.qx), pose.orientation().y(in.pose.qy), pose.orientation().z(in.pose.qz),
      pose.orientation().w(in.pose.qw);
  auto& twist = out.twist().twist();
  twist.linear().x(in.vx_mps), twist.linear().y(in.vy_mps), twist.linear().z(in.vz_mps);
  twist.angular().x(in.wx_rps), twist.angular().y(in.wy_rps), twist.angular().z(in.wz_rps);
  return out;
}

}  // namespace overtake::ros2_peer
