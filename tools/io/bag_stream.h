// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads scans and ego poses from a recording with topics.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/io/bag_reader.h"
#include "tools/io/known_cars.h"
#include "tools/io/ros_messages.h"
#include "tools/io/scan_stream.h"

namespace overtake::io {

// The roles of topics, found by the rig's names and the recording's types.
struct TopicRoles {
  std::vector<int32_t> sensor_of;              // per topic: sensor of the rig, -1 none
  int32_t ego = -1, opponent = -1, cars = -1;  // topics
};
TopicRoles find_topic_roles(const std::vector<BagTopic>& topics, const Rig& rig);

// The same among topics that appear one by one.
struct TopicSearch {
  bool knows_all = true;               // where one sensor and one cloud topic need no name, the topic is the sensor's
  std::optional<std::string> vehicle;  // the text of * in the topics that are used already
};
TopicRoles find_topic_roles(const std::vector<BagTopic>& topics, const Rig& rig, TopicSearch& search);
// "/a (sensor_msgs/msg/PointCloud2), ..." for error texts.
std::string list_topics(const std::vector<BagTopic>& topics, const std::string& type);
// The topic names that a sensor of the rig may have.
std::vector<std::string> topics_of(const RigSensor& sensor);
std::vector<std::string> ego_topics_of(const Rig& rig);
std::vector<std::string> opponent_topics_of(const Rig& rig);

// Throws std::runtime_error or Error if the message is not a cloud or lacks a needed field.
SensorScan scan_of_message(const std::string& place, std::string_view data, const Rig& rig, int32_t sensor);
EgoRow ego_of_odometry(const Odometry& odometry);
bool is_type(const BagTopic& topic, const char* name);

class BagStream : public ScanStream {
 public:
  BagStream(const std::string& path, const Rig& rig);
  bool next(FrameScans& out) override;
  std::vector<EgoRow> take_ego() override;
  const std::string& damage() const override { return damage_; }
  double progress() const override { return bag_->progress(); }
  bool has_ego() const override { return roles_.ego >= 0; }
  std::string note() const override;
  int64_t lost_count() const override { return lost_count_; }
  std::string first_loss() const override { return first_loss_; }
  const char* lost_noun() const override { return "message"; }

 private:
  struct TopicReads {
    int64_t messages = 0, lost = 0;
    std::string first_loss;
  };
  bool read_message();  // false: the end
  void read_input(const BagMessage& message, int32_t sensor);
  void refuse_unreadable(int32_t topic) const;
  void read_truth(const BagMessage& message);
  void add_scan(SensorScan scan);
  void set_opponent(FrameScans& frame) const;

  std::string path_, damage_;
  const Rig rig_;
  std::unique_ptr<BagReader> bag_;
  TopicRoles roles_;
  std::deque<FrameScans> frames_;  // still open, in the order of their first scans
  const std::size_t held_;         // frames that stay open
  std::vector<EgoRow> ego_new_;
  std::deque<EgoRow> ego_, opponent_;  // those of the last seconds
  KnownCars cars_;
  std::map<int32_t, TopicReads> reads_;  // by topic, of those that the detector needs
  int64_t lost_count_ = 0, odd_truths_ = 0;
  std::string first_loss_, first_odd_truth_;
  int64_t last_ego_ns_ = INT64_MIN, next_frame_ = 0;
  uint64_t waiting_bytes_ = 0, ego_rows_ = 0;  // of frames_; total number, because the receiver keeps all
  bool ended_ = false;
};

}  // namespace overtake::io
