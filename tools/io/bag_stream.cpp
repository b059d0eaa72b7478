// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/bag_stream.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "tools/io/angles.h"
#include "tools/io/cloud_message.h"
#include "tools/io/error.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::io {
namespace {

constexpr std::size_t kMostWaiting = 64;  // frames held for an ego pose that may never come
constexpr double kLate_s = 0.5;           // a scan that comes so late still finds its frame; the tracker's limit, too
constexpr int64_t kMostUnreadable = 100;  // messages at the start of a topic
constexpr std::size_t kMostPoses = 4096;

// The text that the * of a pattern matches in a topic; nothing if the pattern does not match.
std::optional<std::string> match(const std::string& pattern, const std::string& topic) {
  const auto star = pattern.find('*');
  if (star == std::string::npos) return pattern == topic ? std::optional<std::string>("") : std::nullopt;
  const std::string head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  if (topic.size() <= head.size() + tail.size() || !topic.starts_with(head) || !topic.ends_with(tail))
    return std::nullopt;
  return topic.substr(head.size(), topic.size() - head.size() - tail.size());
}

// The pose between the neighbours of a time; nothing outside of them.
std::optional<EgoRow> pose_at(const std::deque<EgoRow>& rows, int64_t stamp_ns) {
  const auto after = std::lower_bound(rows.begin(), rows.end(), stamp_ns,
                                      [](const EgoRow& row, int64_t t) { return row.stamp_ns < t; });
  if (after == rows.end() || (after == rows.begin() && after->stamp_ns != stamp_ns)) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return *after;
  const EgoRow& a = *(after - 1);
  const EgoRow& b = *after;
  const double share = double(stamp_ns - a.stamp_ns) / double(b.stamp_ns - a.stamp_ns);
  EgoRow row = a;
  row.stamp_ns = stamp_ns;
  row.x_m += share * (b.x_m - a.x_m);
  row.y_m += share * (b.y_m - a.y_m);
  row.z_m += share * (b.z_m - a.z_m);
  row.yaw_rad += share * wrap_angle(b.yaw_rad - a.yaw_rad);
  return row;
}

uint64_t distance_ns(int64_t a, int64_t b) { return a > b ? uint64_t(a) - uint64_t(b) : uint64_t(b) - uint64_t(a); }

uint64_t bytes_of(const SensorScan& scan) {
  uint64_t bytes = sizeof scan + scan.time_offset_ns.size() * sizeof scan.time_offset_ns[0];
  for (const CloudColumn* column : {&scan.x, &scan.y, &scan.z, &scan.layer, &scan.intensity})
    bytes += column->bytes.size();
  return bytes;
}

void remember(std::deque<EgoRow>& rows, const EgoRow& row) {
  if (!rows.empty() && row.stamp_ns <= rows.back().stamp_ns) return;
  rows.push_back(row);
  if (rows.size() > kMostPoses) rows.pop_front();
}

}  // namespace

bool is_type(const BagTopic& topic, const char* name) {
  return topic.type == name && (topic.encoding.empty() || topic.encoding == "cdr");
}

std::vector<std::string> topics_of(const RigSensor& sensor) {
  if (!sensor.topics.empty()) return sensor.topics;
  return {"/" + sensor.name + "/points", "/" + sensor.name + "_points", "/luminar_" + sensor.name + "_points",
          "/luminar_" + sensor.name + "/points", "/lidar_" + sensor.name + "/points"};
}

std::vector<std::string> ego_topics_of(const Rig& rig) {
  return rig.ego_topics.empty() ? std::vector<std::string>{"/ego/odometry"} : rig.ego_topics;
}

std::vector<std::string> opponent_topics_of(const Rig& rig) {
  return rig.opponent_topics.empty() ? std::vector<std::string>{"/opponent/odometry"} : rig.opponent_topics;
}

std::string list_topics(const std::vector<BagTopic>& topics, const std::string& type) {
  std::vector<std::string> words;
  for (const BagTopic& topic : topics) {
    if (!type.empty() && topic.type != type) continue;
    const bool other = !type.empty() && !is_type(topic, type.c_str());
    words.push_back(topic.name + " (" + topic.type +
                    (other ? ", serialization format " + topic.encoding + ", cdr is needed)" : ")"));
  }
  return words.empty() ? "none" : join(words, ", ");
}

TopicRoles find_topic_roles(const std::vector<BagTopic>& topics, const Rig& rig) {
  TopicSearch search;
  return find_topic_roles(topics, rig, search);
}

TopicRoles find_topic_roles(const std::vector<BagTopic>& topics, const Rig& rig, TopicSearch& search) {
  TopicRoles roles;
  roles.sensor_of.assign(topics.size(), -1);
  std::optional<std::string>& vehicle = search.vehicle;
  // Uses every channel of a topic name.
  const auto find = [&](const std::vector<std::string>& patterns, const char* type, bool same_vehicle) {
    for (const std::string& pattern : patterns)
      for (std::size_t i = 0; i < topics.size(); ++i) {
        if (!is_type(topics[i], type)) continue;
        const auto star = match(pattern, topics[i].name);
        if (!star) continue;
        const bool has_star = pattern.find('*') != std::string::npos;
        if (has_star && vehicle && (*star == *vehicle) != same_vehicle) continue;
        if (has_star && same_vehicle && !vehicle) vehicle = star;
        return int32_t(i);
      }
    return -1;
  };
  for (int32_t s = 0; s < int32_t(rig.sensors.size()); ++s) {
    const int32_t topic = find(topics_of(rig.sensors[std::size_t(s)]), kPointCloud2Name, true);
    if (topic < 0) continue;
    for (std::size_t i = 0; i < topics.size(); ++i)
      if (topics[i].name == topics[std::size_t(topic)].name) roles.sensor_of[i] = s;
  }
  // One sensor and one cloud topic: no name is needed.
  if (search.knows_all && (rig.sensors.size() == 1 || rig.shared_cloud)) {
    std::vector<int32_t> clouds;
    for (std::size_t i = 0; i < topics.size(); ++i)
      if (is_type(topics[i], kPointCloud2Name)) clouds.push_back(int32_t(i));
    if (clouds.size() == 1 && rig.sensors[0].topics.empty()) roles.sensor_of[std::size_t(clouds[0])] = 0;
  }
  roles.ego = find(ego_topics_of(rig), kOdometryName, true);
  roles.opponent = find(opponent_topics_of(rig), kOdometryName, false);
  if (roles.opponent == roles.ego) roles.opponent = -1;
  for (std::size_t i = 0; i < topics.size(); ++i)
    if (topics[i].name == kCarStatesTopic && topics[i].type == kCarStatesName && topics[i].encoding == "json")
      roles.cars = int32_t(i);
  return roles;
}

SensorScan scan_of_message(const std::string& place, std::string_view data, const Rig& rig, int32_t sensor) {
  const PointCloud2 cloud = decode_point_cloud2(data);
  SensorScan scan = make_scan(place, read_cloud_message(place, cloud), rig, sensor, cloud.header.stamp_ns);
  scan.frame_id = cloud.header.frame_id;
  return scan;
}

EgoRow ego_of_odometry(const Odometry& o) {
  const RollPitchYaw angles = rotation_of(o.pose);
  return {o.header.stamp_ns, o.pose.x_m,     o.pose.y_m, o.pose.z_m, angles.roll_rad,
          angles.pitch_rad,  angles.yaw_rad, o.vx_mps,   o.wz_rps};
}

BagStream::BagStream(const std::string& path, const Rig& rig)
    : path_(path),
      rig_(rig),
      bag_(open_bag(path)),
      held_(std::min(kMostWaiting, std::size_t(std::ceil(kLate_s / rig.period_s)))) {
  roles_ = find_topic_roles(bag_->topics(), rig_);
  if (std::all_of(roles_.sensor_of.begin(), roles_.sensor_of.end(), [](int32_t s) { return s < 0; })) {
    std::vector<std::string> looked;
    for (const RigSensor& sensor : rig_.sensors) looked.push_back(topics_of(sensor)[0]);
    const std::string damage = bag_->damage_of_search();
    if (!damage.empty() && bag_->topics().empty()) throw Error(path, 0, damage);
    throw Error(path, 0,
                "no topic of the rig's sensors is in it (looked for " + join(looked, ", ") +
                    " and the like; clouds in it: " + list_topics(bag_->topics(), kPointCloud2Name) +
                    "). Name the topics in the rig file" + (damage.empty() ? "" : ". The file is " + damage));
  }
}

void BagStream::add_scan(SensorScan scan) {
  const auto half = uint64_t(rig_.period_ns() / 2);
  const auto joins = [&](const FrameScans& frame) {
    return distance_ns(scan.stamp_ns, frame.scans[0].stamp_ns) <= half &&
           std::none_of(frame.scans.begin(), frame.scans.end(),
                        [&](const SensorScan& other) { return other.sensor == scan.sensor; });
  };
  const auto newest = std::find_if(frames_.rbegin(), frames_.rend(), joins);
  FrameScans* open = newest == frames_.rend() ? nullptr : &*newest;
  if (!open) {
    // By stamp also where the first scan of a frame comes late; behind the others where no frame is later.
    auto place = frames_.end();
    while (place != frames_.begin() && (place - 1)->scans[0].stamp_ns > scan.stamp_ns &&
           distance_ns((place - 1)->scans[0].stamp_ns, scan.stamp_ns) <= uint64_t(kLate_s * 1e9))
      --place;
    open = &*frames_.emplace(place);
  }
  waiting_bytes_ += bytes_of(scan);
  const auto behind = std::find_if(open->scans.begin(), open->scans.end(),
                                   [&](const SensorScan& other) { return other.sensor > scan.sensor; });
  open->scans.insert(behind, std::move(scan));
}

bool BagStream::read_message() {
  BagMessage message;
  if (ended_ || !bag_->next(message)) {
    if (ended_) return false;
    ended_ = true;
    damage_ = bag_->damage();
    const bool has_scans = std::any_of(reads_.begin(), reads_.end(), [&](const auto& topic) {
      return topic.first != roles_.ego && topic.second.lost < topic.second.messages;
    });
    if (has_scans) return false;
    for (const auto& [topic, reads] : reads_)
      if (reads.lost == reads.messages) refuse_unreadable(topic);
    return false;
  }
  const std::string beyond = beyond_memory(waiting_bytes_ + ego_rows_ * sizeof(EgoRow), "scans and poses in work");
  if (!beyond.empty()) throw Error(path_, 0, beyond);
  const auto topic = std::size_t(message.topic);
  const int32_t sensor = topic < roles_.sensor_of.size() ? roles_.sensor_of[topic] : -1;
  if (sensor >= 0 || message.topic == roles_.ego) read_input(message, sensor);
  read_truth(message);
  return true;
}

// Leaves out a message that cannot be decoded, and counts it. Throws Error where a topic begins with many of them.
void BagStream::read_input(const BagMessage& message, int32_t sensor) {
  const std::string name =
      "message " + std::to_string(message.number) + " on " + bag_->topics()[std::size_t(message.topic)].name;
  const std::string place = path_ + ": " + name;
  TopicReads& reads = reads_[message.topic];
  ++reads.messages;
  try {
    std::vector<SensorScan> scans;
    if (sensor >= 0 && !rig_.shared_cloud) scans.push_back(scan_of_message(place, message.data, rig_, sensor));
    if (sensor >= 0 && rig_.shared_cloud)
      for (int32_t s = 0; s < int32_t(rig_.sensors.size()); ++s)
        scans.push_back(scan_of_message(place, message.data, rig_, s));
    for (SensorScan& scan : scans) add_scan(std::move(scan));
    if (message.topic == roles_.ego) {
      const EgoRow row = ego_of_odometry(decode_odometry(message.data));
      ++ego_rows_;
      last_ego_ns_ = std::max(last_ego_ns_, row.stamp_ns);
      ego_new_.push_back(row);
      if (is_finite(row)) remember(ego_, row);
    }
  } catch (const std::runtime_error& error) {
    const std::string what = error.what(), head = place + ": ";
    char log_time[64];
    std::snprintf(log_time, sizeof log_time, " (log time %.3f s): ", double(message.log_ns) * 1e-9);
    const std::string loss = name + log_time + (what.starts_with(head) ? what.substr(head.size()) : what);
    if (lost_count_++ == 0) first_loss_ = loss;
    if (reads.lost++ == 0) reads.first_loss = loss;
    if (reads.lost == kMostUnreadable && reads.messages == kMostUnreadable) refuse_unreadable(message.topic);
  }
}

void BagStream::refuse_unreadable(int32_t topic) const {
  const TopicReads& reads = reads_.at(topic);
  throw Error(path_, 0,
              "no message on " + bag_->topics()[std::size_t(topic)].name + " can be read, of " +
                  std::to_string(reads.messages) + (ended_ ? "" : " so far") + "; the first: " + reads.first_loss);
}

// The method never reads the truth, so an odd message of it ends no run.
void BagStream::read_truth(const BagMessage& message) {
  try {
    if (message.topic == roles_.cars) cars_.add(message.data);
    if (message.topic != roles_.opponent) return;
    const EgoRow row = ego_of_odometry(decode_odometry(message.data));
    if (!is_finite(row)) throw std::runtime_error("a value of the pose is not finite");
    remember(opponent_, row);
  } catch (const std::runtime_error& error) {
    if (odd_truths_++ > 0) return;
    first_odd_truth_ = "message " + std::to_string(message.number) + " on " +
                       bag_->topics()[std::size_t(message.topic)].name + ": " + error.what();
  }
}

std::string BagStream::note() const {
  if (odd_truths_ == 0) return "";
  return counted(odd_truths_, "message") + " with the truth could not be read; the first: " + first_odd_truth_;
}

bool BagStream::next(FrameScans& out) {
  // A frame is complete when the ones of the next half second have begun, because its scans may come late; it is ready
  // when the later ego poses are known.
  const auto ready = [&] {
    if (frames_.empty()) return false;
    if (ended_) return true;
    if (frames_.size() <= held_) return false;
    if (roles_.ego < 0 || frames_.size() > kMostWaiting) return true;
    int64_t last_ns = INT64_MIN;
    for (const SensorScan& scan : frames_.front().scans) last_ns = std::max(last_ns, scan.stamp_ns);
    return last_ego_ns_ >= last_ns + std::min(rig_.period_ns(), INT64_MAX - std::max<int64_t>(last_ns, 0));
  };
  while (!ready())
    if (!read_message() && frames_.empty()) return false;
  out = std::move(frames_.front());
  frames_.pop_front();
  out.frame = next_frame_++;
  for (const SensorScan& scan : out.scans) waiting_bytes_ -= bytes_of(scan);
  set_opponent(out);
  int64_t last_ns = INT64_MIN;
  for (const SensorScan& scan : out.scans) last_ns = std::max(last_ns, scan.stamp_ns);
  out.cars = cars_.at(last_ns);
  return true;
}

std::vector<EgoRow> BagStream::take_ego() { return std::exchange(ego_new_, {}); }

// Truth of the other car in the vehicle frame; its size is that of the cars of the series.
void BagStream::set_opponent(FrameScans& frame) const {
  const auto ego = pose_at(ego_, frame.scans[0].stamp_ns), other = pose_at(opponent_, frame.scans[0].stamp_ns);
  if (!ego || !other) return;
  const double dx = other->x_m - ego->x_m, dy = other->y_m - ego->y_m;
  const double c = std::cos(ego->yaw_rad), s = std::sin(ego->yaw_rad);
  frame.opponent =
      Box{dx * c + dy * s, dy * c - dx * s, other->z_m - ego->z_m, 4.921, 1.886, 1.0, other->yaw_rad - ego->yaw_rad};
}

}  // namespace overtake::io
