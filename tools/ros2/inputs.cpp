// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/inputs.h"

#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "messages.h"
#include "tools/client/console.h"
#include "tools/client/covariance.h"
#include "tools/io/bag_stream.h"
#include "tools/io/cloud_view.h"
#include "tools/io/error.h"
#include "tools/io/ros_messages.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::ros2 {

// A received message in its serialised form, as it lies in the memory of Cyclone DDS.
class Serialised {
 public:
  explicit Serialised(ddsi_serdata* sample) : sample_(sample) {
    held_ = ddsi_serdata_to_ser_ref(sample_, 0, ddsi_serdata_size(sample_), &part_);
  }
  ~Serialised() {
    ddsi_serdata_to_ser_unref(held_, &part_);
    ddsi_serdata_unref(sample_);
  }
  Serialised(const Serialised&) = delete;
  Serialised& operator=(const Serialised&) = delete;
  std::string_view bytes() const { return {static_cast<const char*>(part_.iov_base), part_.iov_len}; }

 private:
  ddsi_serdata *sample_, *held_;
  ddsrt_iovec_t part_{};
};

namespace {

constexpr const char* kDetectionsType = "vision_msgs/msg/Detection3DArray";
constexpr const char* kClockType = "rosgraph_msgs/msg/Clock";
constexpr int64_t kStart_ns = 2'000'000'000;       // publishers need some time to be found
constexpr int64_t kSilent_ns = 500'000'000;        // without a sample: a fault
constexpr int64_t kLongestGap_ns = 5'000'000'000;  // a longer one is a pause, or another race
constexpr int64_t kMixed_ns = 500'000'000;         // two publishers send for so long at the same time: a fault
constexpr int64_t kQuiet_ns = 3'000'000'000;       // a publisher that has sent nothing for so long is not counted
constexpr int64_t kClockBack_ns = -100'000'000;

std::string seconds(int64_t ns) { return cli::fixed(double(ns) * 1e-9, 1) + " s"; }

// Calls use(sample, info) for each sample that waits, and returns their number.
template <class Use>
int64_t take_serialised(dds_entity_t reader, Use&& use) {
  constexpr int32_t kMost = 16;
  int64_t taken = 0;
  for (;;) {
    ddsi_serdata* samples[kMost];
    dds_sample_info_t infos[kMost];
    const dds_return_t count = reader > 0 ? dds_takecdr(reader, samples, kMost, infos, DDS_ANY_STATE) : 0;
    for (int32_t i = 0; i < count; ++i) {
      auto sample = std::make_unique<Serialised>(samples[i]);
      if (!infos[i].valid_data) continue;  // the publisher is gone
      ++taken;
      use(std::move(sample), infos[i]);
    }
    if (count < kMost) return taken;
  }
}

// The same for short messages, as structs of the generated types.
template <class Message, class Use>
int64_t take_structs(dds_entity_t reader, Use&& use) {
  constexpr int32_t kMost = 16;
  int64_t taken = 0;
  for (;;) {
    void* samples[kMost] = {};
    dds_sample_info_t infos[kMost];
    const dds_return_t count = reader > 0 ? dds_take(reader, samples, infos, kMost, kMost) : 0;
    for (int32_t i = 0; i < count; ++i) {
      if (!infos[i].valid_data) continue;
      ++taken;
      use(*static_cast<const Message*>(samples[i]), infos[i]);
    }
    if (count > 0) dds_return_loan(reader, samples, count);
    if (count < kMost) return taken;
  }
}

int64_t stamp_of(const builtin_interfaces_msg_dds__Time_& time) {
  return int64_t(time.sec) * 1'000'000'000 + int64_t(time.nanosec);
}

Input make_input(Names& names, const std::string& part, const std::string& name, const char* type,
                 std::vector<std::string> otherwise) {
  Input input;
  input.part = part;
  input.type = type;
  input.wanted = std::move(otherwise);
  const bool renamed = names.is_remapped(name);
  const std::string resolved = names.resolve(name);
  if (renamed || input.wanted.empty()) input.wanted = {resolved}, input.topic = resolved;
  return input;
}

// How many publishers send at the same time. One that crashed and started again is another publisher, and both match
// until the lease of the first is over; but the first one's last message came before the second one's first.
int64_t count_senders(const Input& input, int64_t now_ns) {
  int64_t newest_ns = 0, senders = 0;
  for (const Input::Source& source : input.sources) newest_ns = std::max(newest_ns, source.first_ns);
  for (const Input::Source& source : input.sources)
    senders += now_ns - source.last_ns < kQuiet_ns && source.last_ns - newest_ns > kMixed_ns;
  return senders;
}

// A topic that has no name of its own to wait for is looked up among those that exist.
bool is_fixed(const Input& input) { return !input.topic.empty(); }

// What publishers of the domain write, by names without the prefix.
std::vector<io::BagTopic> topics_of(const Discovery& discovery, const std::string& prefix) {
  std::vector<io::BagTopic> topics;
  for (const auto& [handle, endpoint] : discovery.endpoints())
    if (endpoint.writes && endpoint.topic.starts_with(prefix + "/"))
      topics.push_back({endpoint.topic.substr(prefix.size()), endpoint.type, "cdr"});
  return topics;
}

// A message of one input is none of another one.
void check_distinct(const std::vector<const Input*>& inputs) {
  std::map<std::string, std::string> parts;  // by topic
  for (const Input* input : inputs) {
    if (!is_fixed(*input)) continue;
    const auto [other, is_new] = parts.try_emplace(input->topic, input->part);
    if (!is_new)
      throw io::Error("--remap", 0,
                      "two inputs, " + other->second + " and " + input->part + ", have the topic " + input->topic);
  }
}

void leave(Input& input) {
  dds_delete(input.reader);
  input.reader = 0;
  input.topic.clear();
  input.is_only_cloud = false;
}

}  // namespace

struct Inputs::Waiting {
  std::unique_ptr<Serialised> sample;
  io::PointCloud2 cloud;  // points into the sample
};

Inputs::Inputs(Participant& participant, Names& names, const io::Rig& rig, const NodeOptions& options,
               FrameNames& frames, cli::Session& session, Faults& faults)
    : participant_(participant),
      rig_(rig),
      use_sim_time_(options.use_sim_time),
      frames_(frames),
      session_(session),
      faults_(faults),
      name_space_(names.name_space()),
      search_{.knows_all = false, .vehicle = {}},
      begin_ns_(steady_ns()) {
  for (const io::RigSensor& sensor : rig_.sensors) {
    clouds_.push_back(
        make_input(names, sensor.name, sensor.name + "/points", io::kPointCloud2Name, io::topics_of(sensor)));
    if (rig_.shared_cloud) break;
  }
  how_.resize(clouds_.size());
  waiting_.resize(clouds_.size());
  poses_ = make_input(names, "ego", "ego/odometry", io::kOdometryName, io::ego_topics_of(rig_));
  poses_.needed = false;
  detections_ = make_input(names, "detections", "external_detections", kDetectionsType, {});
  detections_.needed = false;
  clock_ = make_input(names, "clock", "/clock", kClockType, {});
  names.check_used();
  std::vector<const Input*> inputs = {&poses_, &detections_};
  if (use_sim_time_) inputs.push_back(&clock_);
  for (const Input& cloud : clouds_) inputs.push_back(&cloud);
  check_distinct(inputs);
  for (Input& cloud : clouds_)
    if (is_fixed(cloud)) subscribe(cloud, cloud.topic);
  if (is_fixed(poses_)) subscribe(poses_, poses_.topic);
  subscribe(detections_, detections_.topic);
  if (use_sim_time_) subscribe(clock_, clock_.topic);
}

Inputs::~Inputs() = default;  // the participant deletes the readers

void Inputs::subscribe(Input& input, const std::string& topic) {
  const bool cloud = input.type == io::kPointCloud2Name, pose = input.type == io::kOdometryName;
  const bool clock = input.type == kClockType;
  input.topic = topic;
  input.reader = participant_.create_reader(topic,
                                            cloud   ? sensor_msgs_msg_dds__PointCloud2__desc
                                            : pose  ? nav_msgs_msg_dds__Odometry__desc
                                            : clock ? rosgraph_msgs_msg_dds__Clock__desc
                                                    : vision_msgs_msg_dds__Detection3DArray__desc,
                                            cloud   ? Qos::kSensor
                                            : clock ? Qos::kClock
                                                    : Qos::kPoses);
}

// Topics of the domain whose names begin with the prefix, by the rules for recordings (tools/io/bag_stream.h).
void Inputs::find_topics(const Discovery& discovery, const std::string& prefix) {
  const std::vector<io::BagTopic> topics = topics_of(discovery, prefix);
  const io::TopicRoles roles = io::find_topic_roles(topics, rig_, search_);
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const int32_t sensor = roles.sensor_of[i];
    if (sensor < 0 || std::size_t(sensor) >= clouds_.size()) continue;
    Input& cloud = clouds_[std::size_t(sensor)];
    if (cloud.is_only_cloud) {  // a topic with the sensor's name has appeared
      leave(cloud);
      waiting_[std::size_t(sensor)].clear();
    }
    if (!is_fixed(cloud)) subscribe(cloud, prefix + topics[i].name);
  }
  if (roles.ego >= 0 && !is_fixed(poses_)) subscribe(poses_, prefix + topics[std::size_t(roles.ego)].name);
}

// One sensor and one cloud topic: no name is needed. Only after some time, when the others have been found, too.
void Inputs::find_only_cloud(const Discovery& discovery) {
  Input& cloud = clouds_[0];
  if (!rig_.sensors[0].topics.empty() || steady_ns() - begin_ns_ < kStart_ns) return;
  const auto find_in = [&](const std::string& prefix) {
    const std::vector<io::BagTopic> topics = topics_of(discovery, prefix);
    const io::TopicRoles roles = io::find_topic_roles(topics, rig_);
    const auto found = std::find(roles.sensor_of.begin(), roles.sensor_of.end(), 0);
    if (found == roles.sensor_of.end()) return;
    if (is_fixed(cloud)) leave(cloud), waiting_[0].clear();
    subscribe(cloud, prefix + topics[std::size_t(found - roles.sensor_of.begin())].name);
    cloud.is_only_cloud = true;
  };
  const bool is_elsewhere = cloud.is_only_cloud && !cloud.topic.starts_with(name_space_ + "/");
  if (!name_space_.empty() && (!is_fixed(cloud) || is_elsewhere)) find_in(name_space_);
  if (!is_fixed(cloud)) find_in("");
}

void Inputs::follow(const Discovery& discovery) {
  if (!name_space_.empty()) find_topics(discovery, name_space_);
  find_topics(discovery, "");
  if (clouds_.size() == 1) find_only_cloud(discovery);
}

int64_t Inputs::take(int64_t now_ns) {
  int64_t taken = take_clock(now_ns) + take_poses(now_ns);
  for (std::size_t cloud = 0; cloud < clouds_.size(); ++cloud) taken += take_clouds(cloud, now_ns);
  push_clouds(now_ns);
  return taken + take_detections(now_ns);
}

void Inputs::count(Input& input, const dds_sample_info_t& info, int64_t now_ns) {
  ++input.received;
  input.arrivals.add(now_ns, 0);
  const double transport_ms = double(dds_time() - info.source_timestamp) * 1e-6;
  if (transport_ms >= 0 && transport_ms < 60'000) input.transport_ms.add(now_ns, transport_ms);
  if (input.last_ns != 0 && now_ns - input.last_ns > kSilent_ns)
    faults_.lower(input.part, "silent", "comes again, after " + seconds(now_ns - input.last_ns));
  input.last_ns = now_ns;
  std::erase_if(input.sources, [&](const Input::Source& source) { return now_ns - source.last_ns > kQuiet_ns; });
  for (Input::Source& source : input.sources)
    if (source.handle == info.publication_handle) {
      source.last_ns = now_ns;
      return;
    }
  input.sources.push_back({info.publication_handle, now_ns, now_ns});
}

void Inputs::refuse(Input& input, const char* kind, const std::string& sentence, int64_t now_ns) {
  ++input.refused;
  faults_.note(input.part, kind, Level::kError, sentence, now_ns);
}

int64_t Inputs::take_clouds(std::size_t cloud, int64_t now_ns) {
  Input& input = clouds_[cloud];
  return take_serialised(input.reader, [&](std::unique_ptr<Serialised> sample, const dds_sample_info_t& info) {
    count(input, info, now_ns);
    try {
      const io::PointCloud2 decoded = io::decode_point_cloud2(sample->bytes());
      if (decoded.header.stamp_ns == 0)
        return refuse(input, "stamp", "its clouds have no stamp (header.stamp is 0): not used", now_ns);
      waiting_[cloud].push_back({std::move(sample), decoded});
    } catch (const std::runtime_error& error) {
      refuse(input, "cloud", "a message on " + input.topic + " is not used: " + error.what(), now_ns);
    }
  });
}

// In the order of stamps, each sensor's in their order: after a pause of this process several scans of each sensor
// wait, and the second one of a sensor would close the frame of the first.
void Inputs::push_clouds(int64_t now_ns) {
  for (;;) {
    std::size_t first = waiting_.size();
    for (std::size_t cloud = 0; cloud < waiting_.size(); ++cloud) {
      if (waiting_[cloud].empty()) continue;
      const auto stamp = [&](std::size_t i) { return waiting_[i].front().cloud.header.stamp_ns; };
      if (first == waiting_.size() || stamp(cloud) < stamp(first)) first = cloud;
    }
    if (first == waiting_.size()) return;
    push_cloud(first, waiting_[first].front(), now_ns);
    waiting_[first].pop_front();
  }
}

bool Inputs::accept_frame(const io::RigSensor& sensor, Input& input, const std::string& frame_id, int64_t now_ns) {
  if (sensor.frame_id.empty() || sensor.frame_id == frame_id) return true;
  refuse(input, "frame",
         "its clouds on " + input.topic + " are in frame_id '" + frame_id + "', the rig '" + rig_.name + "' says '" +
             sensor.frame_id + "': not used (correct frame_id in the rig file)",
         now_ns);
  return false;
}

void Inputs::push_cloud(std::size_t cloud, const Waiting& waiting, int64_t now_ns) {
  Input& input = clouds_[cloud];
  const auto first = int32_t(cloud);
  const int32_t last = rig_.shared_cloud ? int32_t(rig_.sensors.size()) - 1 : first;
  try {
    for (int32_t sensor = first; sensor <= last; ++sensor) {
      if (!accept_frame(rig_.sensors[std::size_t(sensor)], input, waiting.cloud.header.frame_id, now_ns)) continue;
      io::CloudView view;
      const std::string why_not = io::view_in_place(waiting.cloud, rig_, sensor, view);
      how_[cloud] = why_not.empty() ? "in place" : "by a copy: " + why_not;
      if (why_not.empty())
        push_scan(input, sensor, cli::to_points(view, sensor), now_ns);
      else
        push_scan(input, sensor,
                  cli::to_points(io::scan_of_message(input.topic, waiting.sample->bytes(), rig_, sensor)), now_ns);
    }
  } catch (const std::runtime_error& error) {  // also io::Error
    refuse(input, "cloud", std::string("a cloud is not used: ") + error.what(), now_ns);
  }
}

void Inputs::push_scan(Input& input, int32_t sensor, const ovt_points& points, int64_t now_ns) {
  const io::RigSensor& model = rig_.sensors[std::size_t(sensor)];
  if (points.count > model.point_capacity) {
    const int64_t enough = (int64_t(points.count) * 11 / 10 + 999) / 1000 * 1000;  // scans differ
    refuse(input, "capacity",
           "a scan has " + std::to_string(points.count) + " points, point_capacity of the rig is " +
               std::to_string(model.point_capacity) + ": not used (--capacity points=" + std::to_string(enough) +
               " raises it)",
           now_ns);
  }
  if (points.count == 0)
    faults_.note(input.part, "empty", Level::kWarning, "clouds on " + input.topic + " have no points", now_ns);
  const ovt_status status = session_.push_scan(points);
  if (status == OVT_DUPLICATE)
    refuse(input, "duplicate", "a scan has the stamp of the scan before: not used", now_ns);
  else if (status != OVT_OK && status != OVT_LATE && status != OVT_TOO_MANY)
    refuse(input, "push", std::string("a scan is not used: ") + ovt_status_text(status), now_ns);
  if (status != OVT_OK) return;
  const int64_t gap_ns = points.stamp_ns - input.stamp_ns;
  if (input.stamp_ns != 0 && 2 * gap_ns > 3 * rig_.period_ns() && gap_ns < kLongestGap_ns) {
    input.lost += (gap_ns + rig_.period_ns() / 2) / rig_.period_ns() - 1;
    faults_.note(input.part, "lost", Level::kWarning,
                 io::counted(input.lost, "scan") + " of " + input.topic +
                     " missing since the start, by the stamps of the others: not sent, or lost or torn on the way",
                 now_ns);
  }
  input.stamp_ns = points.stamp_ns;
  if (!any_scan_ || points.stamp_ns > newest_scan_ns_ || newest_scan_ns_ - points.stamp_ns > 1'000'000'000)
    newest_scan_ns_ = points.stamp_ns;
  any_scan_ = true;
  newest_arrival_ns_ = now_ns;
}

int64_t Inputs::take_poses(int64_t now_ns) {
  return take_serialised(poses_.reader, [&](std::unique_ptr<Serialised> sample, const dds_sample_info_t& info) {
    count(poses_, info, now_ns);
    push_pose(sample->bytes(), now_ns);
  });
}

void Inputs::push_pose(std::string_view message, int64_t now_ns) {
  try {
    const io::Odometry odometry = io::decode_odometry(message);
    const auto fits = [&](const std::string& id, std::string& name, bool& fixed, const char* field) {
      if (!fixed && !id.empty()) name = id, fixed = true;
      if (id == name) return true;
      refuse(poses_, field,
             std::string(field) + " of a pose on " + poses_.topic + " is '" + id + "', not '" + name + "': not used",
             now_ns);
      return false;
    };
    if (!fits(odometry.header.frame_id, frames_.map, frames_.map_fixed, "frame_id") ||
        !fits(odometry.child_frame_id, frames_.vehicle, frames_.vehicle_fixed, "child_frame_id"))
      return;
    const ovt_ego_pose pose = cli::to_pose(io::ego_of_odometry(odometry));
    const ovt_status status = ovt_push_ego_pose(session_.detector(), &pose);
    if (status == OVT_LATE)
      refuse(poses_, "late", "a pose is older than the one before: not used", now_ns);
    else if (status != OVT_OK && status != OVT_DUPLICATE)
      refuse(poses_, "push", std::string("a pose is not used: ") + ovt_status_text(status), now_ns);
  } catch (const std::runtime_error& error) {
    refuse(poses_, "pose", "a message on " + poses_.topic + " is not used: " + error.what(), now_ns);
  }
}

int64_t Inputs::take_detections(int64_t now_ns) {
  using Message = vision_msgs_msg_dds__Detection3DArray_;
  return take_structs<Message>(detections_.reader, [&](const Message& message, const dds_sample_info_t& info) {
    count(detections_, info, now_ns);
    const std::string frame = message.header.frame_id ? message.header.frame_id : "";
    if (frame != frames_.map && frame != frames_.vehicle)
      return refuse(detections_, "frame",
                    "detections on " + detections_.topic + " are in frame_id '" + frame + "', neither '" + frames_.map +
                        "' nor '" + frames_.vehicle + "': not used",
                    now_ns);
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    const std::size_t count = message.detections._length;
    std::vector<double> x(count), y(count), heading(count), var_x(count, unknown), var_y(count, unknown),
        cov_xy(count, 0), length(count), width(count), height(count), score(count, unknown);
    const auto known = [&](double value) { return value > 0 ? value : unknown; };
    for (std::size_t i = 0; i < count; ++i) {
      const vision_msgs_msg_dds__Detection3D_& row = message.detections._buffer[i];
      const auto& at = row.bbox.center.position;
      const auto& turn = row.bbox.center.orientation;
      x[i] = at.x, y[i] = at.y;
      heading[i] = io::known_yaw_rad({at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w});
      length[i] = known(row.bbox.size.x), width[i] = known(row.bbox.size.y), height[i] = known(row.bbox.size.z);
      for (uint32_t k = 0; k < row.results._length; ++k) {
        const auto& result = row.results._buffer[k];
        if (!(result.hypothesis.score <= score[i])) score[i] = result.hypothesis.score;
        if (k == 0 && result.pose.covariance[0] > 0 && result.pose.covariance[7] > 0)
          var_x[i] = result.pose.covariance[0], var_y[i] = result.pose.covariance[7],
          cov_xy[i] = result.pose.covariance[1];
      }
      if (const char* fault = cli::find_covariance_fault(var_x[i], var_y[i], var_x[i] > 0 ? cov_xy[i] : unknown))
        faults_.note("detections", "covariance", Level::kWarning,
                     std::string("the covariance of a row is not used: ") + fault, now_ns);
    }
    ovt_external_detections rows;
    ovt_external_detections_init(&rows, sizeof rows);
    rows.stamp_ns = stamp_of(message.header.stamp);
    rows.count = int32_t(count);
    rows.reference = frame == frames_.map ? OVT_REFERENCE_MAP : OVT_REFERENCE_VEHICLE;
    rows.x_m = x.data(), rows.y_m = y.data(), rows.heading_rad = heading.data();
    rows.var_x = var_x.data(), rows.var_y = var_y.data(), rows.cov_xy = cov_xy.data();
    rows.length_m = length.data(), rows.width_m = width.data(), rows.height_m = height.data();
    rows.score = score.data();
    const ovt_status status = ovt_push_detections(session_.detector(), &rows);
    if (status != OVT_OK)
      refuse(detections_, "push", std::string("detections are not used: ") + ovt_status_text(status), now_ns);
  });
}

int64_t Inputs::take_clock(int64_t now_ns) {
  using Message = rosgraph_msgs_msg_dds__Clock_;
  return take_structs<Message>(clock_.reader, [&](const Message& message, const dds_sample_info_t& info) {
    count(clock_, info, now_ns);
    const int64_t time_ns = stamp_of(message.clock);
    if (sim_ns_ != 0 && time_ns - sim_ns_ < kClockBack_ns)
      faults_.note("clock", "back", Level::kWarning, clock_.topic + " went back by " + seconds(sim_ns_ - time_ns),
                   now_ns);
    sim_ns_ = time_ns;
  });
}

// The library needs the time only when all sensors are silent: otherwise the next scan closes a frame. A scan is sent
// at its end, a period after its stamp, and /clock may be ahead of it by another one. Without /clock, time passes since
// the newest scan's arrival, so that no clock of this machine has to agree with the stamps.
void Inputs::advance(int64_t now_ns) {
  const int64_t period_ns = rig_.period_ns();
  // After a pause of this process, scans may wait that it has not seen yet.
  const bool paused = now_ns - last_advance_ns_ > period_ns + kWait_ns;
  last_advance_ns_ = now_ns;
  if (!any_scan_ || paused) return;
  const int64_t elapsed_ns = use_sim_time_ ? sim_ns_ - newest_scan_ns_ : now_ns - newest_arrival_ns_;
  if (elapsed_ns < 3 * period_ns || elapsed_ns > 60'000'000'000) return;
  const int64_t time_ns = newest_scan_ns_ + elapsed_ns;
  if (advanced_ns_ != 0 && time_ns > advanced_ns_ && time_ns - advanced_ns_ < period_ns) return;
  advanced_ns_ = time_ns;
  ovt_advance(session_.detector(), time_ns);
}

void Inputs::watch_input(Input& input, const Discovery& discovery, int64_t now_ns) {
  input.arrivals.pass(now_ns);
  input.transport_ms.pass(now_ns);
  // Publishers of the topic with another type.
  std::string other;
  std::vector<std::string> same_type;
  bool published = false;
  for (const auto& [handle, endpoint] : discovery.endpoints()) {
    if (!endpoint.writes) continue;
    if (endpoint.type == input.type) same_type.push_back(endpoint.topic);
    const std::string& wanted = input.topic.empty() ? input.wanted[0] : input.topic;
    const bool named = std::find(input.wanted.begin(), input.wanted.end(), endpoint.topic) != input.wanted.end();
    if (endpoint.topic != wanted && !(input.topic.empty() && named)) continue;
    if (endpoint.type != input.type)
      other = endpoint.topic + " has the type " + endpoint.type + ", " + input.type + " is needed: not used";
    else
      published = true;
  }
  if (!other.empty()) {
    faults_.raise(input.part, "type", Level::kError, other, now_ns);
    faults_.lower(input.part, "topic");
  } else {
    faults_.lower(input.part, "type", "nobody publishes it with the wrong type any more");
  }
  dds_subscription_matched_status_t matched{};
  if (input.reader > 0) dds_get_subscription_matched_status(input.reader, &matched);
  if (input.found_ns == 0 && matched.current_count > 0) input.found_ns = now_ns;
  if (input.found_ns == 0 && input.needed && other.empty() && now_ns - begin_ns_ > kStart_ns) {
    std::sort(same_type.begin(), same_type.end());
    same_type.erase(std::unique(same_type.begin(), same_type.end()), same_type.end());
    const std::string wanted = input.topic.empty() ? io::join(input.wanted, " or ") : input.topic;
    const std::string others = same_type.empty() ? "none" : io::join(same_type, ", ");
    const bool cloud = input.type == io::kPointCloud2Name;
    faults_.raise(input.part, "topic", Level::kError,
                  "nobody publishes " + wanted + "; of type " + input.type + " there is " + others +
                      (cloud ? " (--remap " + input.part + "/points:=NAME)" : ""),
                  now_ns);
  }
  if (input.reader <= 0) return;
  if (input.found_ns != 0) faults_.lower(input.part, "topic", "found on " + input.topic);

  if (matched.current_count == 0 && input.publishers > 0) {
    input.gone_ns = now_ns;
    faults_.raise(input.part, "gone", input.needed ? Level::kError : Level::kWarning,
                  "the publisher of " + input.topic + " is gone", now_ns);
  } else if (matched.current_count > 0 && input.gone_ns != 0) {
    faults_.lower(input.part, "gone",
                  "the publisher of " + input.topic + " is back, after " + seconds(now_ns - input.gone_ns));
    input.gone_ns = 0;
  }
  input.publishers = matched.current_count;
  if (const int64_t senders = count_senders(input, now_ns); senders > 1)
    faults_.raise(
        input.part, "several", Level::kWarning,
        std::to_string(senders) + " publishers of " + input.topic + " send at the same time: their messages mix",
        now_ns);
  else
    faults_.lower(input.part, "several", "only one publisher of " + input.topic + " sends now");

  dds_requested_incompatible_qos_status_t qos{};
  dds_get_requested_incompatible_qos_status(input.reader, &qos);
  if (qos.total_count_change > 0)
    faults_.raise(input.part, "qos", Level::kError,
                  "the quality of service of a publisher of " + input.topic + " does not match: its " +
                      policy_name(qos.last_policy_id),
                  now_ns);
  else if (matched.current_count > 0 || !published)
    faults_.lower(input.part, "qos");

  if (input.last_ns != 0 && now_ns - input.last_ns > kSilent_ns && (input.needed || input.part != "detections"))
    faults_.raise(input.part, "silent", input.needed ? Level::kStale : Level::kWarning,
                  "nothing on " + input.topic + " for " + seconds(now_ns - input.last_ns), now_ns);
  else if (input.last_ns == 0 && input.needed && matched.current_count > 0 && now_ns - input.found_ns > kStart_ns)
    faults_.raise(input.part, "silent", Level::kStale,
                  "nothing on " + input.topic + " yet, although it has a publisher", now_ns);
  else if (input.last_ns != 0)
    faults_.lower(input.part, "silent");
}

void Inputs::watch(const Discovery& discovery, int64_t now_ns) {
  for (Input& cloud : clouds_) watch_input(cloud, discovery, now_ns);
  watch_input(poses_, discovery, now_ns);
  watch_input(detections_, discovery, now_ns);
  if (use_sim_time_) watch_input(clock_, discovery, now_ns);
}

}  // namespace overtake::ros2
