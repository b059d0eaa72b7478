// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A participant of a DDS domain (Cyclone DDS) with the quality of service that ROS 2 uses, and what it discovers.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace overtake::ros2 {

enum class Qos {
  kSensor,   // best effort, volatile, the last 5
  kPoses,    // the same, the last 100: best effort also matches reliable publishers
  kClock,    // the same, the last 1
  kResult,   // reliable, volatile, the last 1
  kLatched,  // reliable, transient local, the last 1: late subscribers get it, too
};

// How long a reliable writer may wait for a slow subscriber. Longer would delay the detector.
inline constexpr int64_t kMostWait_ns = 2'000'000;

// Size of the receive buffers that is asked for: fragments of clouds wait in them.
inline constexpr int32_t kReceiveBuffer = 8 << 20;
// The UDP sockets of this process.
struct Sockets {
  int32_t receive_buffer = 0;  // of the largest, bytes, as the kernel granted it
  int64_t dropped = 0;         // datagrams that did not fit
};
Sockets look_at_sockets();

class Participant {
 public:
  // interface: its name, "": Cyclone DDS chooses. CYCLONEDDS_URI, if set, has the last word. Throws io::Error.
  Participant(int32_t domain, const std::string& interface);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  // name: as ROS 2 writes it. Throws io::Error if the participant has the topic with another type.
  dds_entity_t create_reader(const std::string& name, const dds_topic_descriptor_t& type, Qos qos);
  dds_entity_t create_writer(const std::string& name, const dds_topic_descriptor_t& type, Qos qos);
  void wait(int64_t most_ns);  // until a reader has samples
  dds_entity_t entity() const { return participant_; }
  const dds_guid_t& guid() const { return guid_; }
  const std::vector<dds_guid_t>& readers() const { return readers_; }
  const std::vector<dds_guid_t>& writers() const { return writers_; }

 private:
  dds_entity_t create_topic(const std::string& name, const dds_topic_descriptor_t& type);
  dds_entity_t domain_ = 0, participant_ = 0, waitset_ = 0;
  dds_guid_t guid_{};
  std::vector<dds_guid_t> readers_, writers_;  // in the order of their creation
};

// The readers and writers of other participants.
class Discovery {
 public:
  explicit Discovery(const Participant& participant);
  struct Endpoint {
    std::string topic, type;  // as ROS 2 writes them
    bool writes = false;
  };
  bool update();  // true: something came or went
  const std::map<dds_instance_handle_t, Endpoint>& endpoints() const { return endpoints_; }

 private:
  bool take(dds_entity_t reader, bool writes);
  dds_guid_t own_;
  dds_entity_t publications_, subscriptions_;
  std::map<dds_instance_handle_t, Endpoint> endpoints_;
};

// "reliability", "durability": a policy that did not match.
std::string policy_name(uint32_t id);

}  // namespace overtake::ros2
