// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What the node receives: clouds of the rig's sensors, poses of the ego vehicle, detections of another detector, the
// clock of a simulation. It pushes them into the detector, and says in words why something is not used.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "tools/client/session.h"
#include "tools/io/bag_stream.h"
#include "tools/io/rig.h"
#include "tools/ros2/faults.h"
#include "tools/ros2/names.h"
#include "tools/ros2/node_options.h"
#include "tools/ros2/participant.h"
#include "tools/ros2/window.h"

namespace overtake::ros2 {

inline constexpr int64_t kWait_ns = 20'000'000;  // the node waits for samples at most so long, then calls advance

// One subscription, from the search for its topic on.
struct Input {
  std::string part;                 // in faults: "front", "ego", "detections", "clock"
  std::string type;                 // as ROS 2 writes it
  std::vector<std::string> wanted;  // names that it may have; a * stands for any text
  std::string topic;                // "": not found yet
  bool is_only_cloud = false;       // the topic has no wanted name; it was the only one of a cloud
  bool needed = true;               // its absence is a fault
  dds_entity_t reader = 0;
  uint32_t publishers = 0;
  int64_t found_ns = 0;  // when it had its first publisher; 0: never yet
  int64_t received = 0, refused = 0, lost = 0;
  int64_t stamp_ns = 0;  // of the newest scan
  int64_t last_ns = 0;   // of arrival, by the steady clock; 0: none yet
  int64_t gone_ns = 0;   // since when it has had no publisher; 0: it has, or never had one
  struct Source {        // a publisher that sends
    dds_instance_handle_t handle;
    int64_t first_ns, last_ns;  // of arrival
  };
  std::vector<Source> sources;
  Window arrivals, transport_ms;  // from the publisher's write to here, if the clocks agree
};

// The frames of reference that the messages named.
struct FrameNames {
  std::string map = "map", vehicle = "base_link";
  bool map_fixed = false, vehicle_fixed = false;  // by an option, or by the first pose
};

class Inputs {
 public:
  Inputs(Participant& participant, Names& names, const io::Rig& rig, const NodeOptions& options, FrameNames& frames,
         cli::Session& session, Faults& faults);
  ~Inputs();
  Inputs(const Inputs&) = delete;
  Inputs& operator=(const Inputs&) = delete;

  // Subscribes to topics that have appeared. Often enough also without news: time counts, too.
  void follow(const Discovery& discovery);
  // Takes all samples: poses first, because a frame uses the poses pushed before its last scan. Returns how many.
  int64_t take(int64_t now_ns);
  // Reports the time to the library while no scan comes.
  void advance(int64_t now_ns);
  // Faults that a time without samples makes, and those that Cyclone DDS counts.
  void watch(const Discovery& discovery, int64_t now_ns);

  const std::vector<Input>& clouds() const { return clouds_; }  // by sensor; a shared cloud is the first one's alone
  const Input& poses() const { return poses_; }
  const Input& detections() const { return detections_; }
  const Input& clock() const { return clock_; }
  const std::string& how_read(std::size_t cloud) const { return how_[cloud]; }  // "in place", or why not
  int64_t sim_ns() const { return sim_ns_; }                                    // the time of /clock; 0: none
  bool use_sim_time() const { return use_sim_time_; }

 private:
  struct Waiting;  // a scan that was taken and not pushed yet
  void subscribe(Input& input, const std::string& topic);
  void find_topics(const Discovery& discovery, const std::string& prefix);
  void find_only_cloud(const Discovery& discovery);
  int64_t take_clouds(std::size_t cloud, int64_t now_ns);
  int64_t take_poses(int64_t now_ns);
  int64_t take_detections(int64_t now_ns);
  int64_t take_clock(int64_t now_ns);
  void push_clouds(int64_t now_ns);
  void push_cloud(std::size_t cloud, const Waiting& waiting, int64_t now_ns);
  void push_scan(Input& input, int32_t sensor, const ovt_points& points, int64_t now_ns);
  void push_pose(std::string_view message, int64_t now_ns);
  bool accept_frame(const io::RigSensor& sensor, Input& input, const std::string& frame_id, int64_t now_ns);
  void refuse(Input& input, const char* kind, const std::string& sentence, int64_t now_ns);
  void count(Input& input, const dds_sample_info_t& info, int64_t now_ns);
  void watch_input(Input& input, const Discovery& discovery, int64_t now_ns);

  Participant& participant_;
  const io::Rig rig_;
  const bool use_sim_time_;
  FrameNames& frames_;
  cli::Session& session_;
  Faults& faults_;
  std::string name_space_;
  io::TopicSearch search_;
  std::vector<Input> clouds_;
  std::vector<std::deque<Waiting>> waiting_;  // by cloud
  std::vector<std::string> how_;
  Input poses_, detections_, clock_;
  const int64_t begin_ns_;
  int64_t newest_scan_ns_ = 0, newest_arrival_ns_ = 0, advanced_ns_ = 0, last_advance_ns_ = 0, sim_ns_ = 0;
  bool any_scan_ = false;
};

}  // namespace overtake::ros2
