// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/participant.h"

#include <linux/sock_diag.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "tools/io/error.h"
#include "tools/ros2/names.h"

namespace overtake::ros2 {
namespace {

dds_entity_t check(dds_entity_t entity, const std::string& what) {
  if (entity < 0) throw io::Error(what, 0, std::string("Cyclone DDS refuses it: ") + dds_strretcode(entity));
  return entity;
}

// Cyclone DDS finds others on an interface without multicast, such as lo, only by their address.
std::string config_of(const std::string& interface) {
  std::string text = "<CycloneDDS><Domain id=\"any\">";
  if (!interface.empty())
    text += "<General><Interfaces><NetworkInterface name=\"" + interface + "\"/></Interfaces>" +
            (interface == "lo" ? "<AllowMulticast>false</AllowMulticast>" : "") + "</General>";
  text += "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>";
  if (interface == "lo") text += "<Peers><Peer address=\"127.0.0.1\"/></Peers>";
  text += "</Discovery><Internal><SocketReceiveBufferSize max=\"" + std::to_string(kReceiveBuffer) +
          "B\"/></Internal></Domain></CycloneDDS>";
  if (const char* own = std::getenv("CYCLONEDDS_URI"); own && *own) text += std::string(",") + own;
  return text;
}

struct QosHolder {
  dds_qos_t* qos = dds_create_qos();
  QosHolder() = default;
  ~QosHolder() { dds_delete_qos(qos); }
  QosHolder(const QosHolder&) = delete;
  QosHolder& operator=(const QosHolder&) = delete;
};

void set(dds_qos_t* qos, Qos kind) {
  const bool reliable = kind == Qos::kResult || kind == Qos::kLatched;
  dds_qset_reliability(qos, reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, kMostWait_ns);
  dds_qset_durability(qos, kind == Qos::kLatched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, kind == Qos::kSensor ? 5 : kind == Qos::kPoses ? 100 : 1);
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;  // ROS 2 has no other one
  dds_qset_data_representation(qos, 1, &xcdr1);
}

dds_guid_t guid_of(dds_entity_t entity, const std::string& what) {
  dds_guid_t guid;
  check(dds_get_guid(entity, &guid), what);
  return guid;
}

bool equal(const dds_guid_t& a, const dds_guid_t& b) { return std::memcmp(a.v, b.v, sizeof a.v) == 0; }

}  // namespace

Sockets look_at_sockets() {
  Sockets sockets;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", code)) {
    const int file = std::atoi(entry.path().filename().c_str());
    int kind = 0, bytes = 0;
    socklen_t size = sizeof kind;
    if (getsockopt(file, SOL_SOCKET, SO_TYPE, &kind, &size) != 0 || kind != SOCK_DGRAM) continue;
    size = sizeof bytes;
    getsockopt(file, SOL_SOCKET, SO_RCVBUF, &bytes, &size);
    sockets.receive_buffer = std::max(sockets.receive_buffer, bytes / 2);  // Linux doubles it, for its own records
    uint32_t memory[SK_MEMINFO_VARS] = {};
    size = sizeof memory;
    if (getsockopt(file, SOL_SOCKET, SO_MEMINFO, memory, &size) == 0) sockets.dropped += memory[SK_MEMINFO_DROPS];
  }
  return sockets;
}

Participant::Participant(int32_t domain, const std::string& interface) {
  const std::string place = "domain " + std::to_string(domain);
  domain_ = dds_create_domain(dds_domainid_t(domain), config_of(interface).c_str());
  if (domain_ < 0)
    throw io::Error(interface.empty() ? place : "--interface " + interface, 0,
                    "Cyclone DDS cannot join the domain (its message is above)");
  // ROS 2 takes only participants with an enclave into its graph; "/" is the one without security.
  const QosHolder holder;
  constexpr std::string_view kEnclave = "enclave=/;";
  dds_qset_userdata(holder.qos, kEnclave.data(), kEnclave.size());
  participant_ = check(dds_create_participant(dds_domainid_t(domain), holder.qos, nullptr), place);
  guid_ = guid_of(participant_, place);
  waitset_ = check(dds_create_waitset(participant_), place);
}

Participant::~Participant() { dds_delete(domain_); }

dds_entity_t Participant::create_topic(const std::string& name, const dds_topic_descriptor_t& type) {
  const dds_entity_t topic = dds_create_topic(participant_, &type, dds_topic_of(name).c_str(), nullptr, nullptr);
  if (topic < 0)
    throw io::Error(name, 0,
                    "this node has the topic twice, also with another type than " + ros_type_of(type.m_typename));
  return topic;
}

dds_entity_t Participant::create_reader(const std::string& name, const dds_topic_descriptor_t& type, Qos kind) {
  const QosHolder holder;
  set(holder.qos, kind);
  const dds_entity_t reader =
      check(dds_create_reader(participant_, create_topic(name, type), holder.qos, nullptr), name);
  const dds_entity_t samples = check(dds_create_readcondition(reader, DDS_ANY_STATE), name);
  dds_waitset_attach(waitset_, samples, 0);
  readers_.push_back(guid_of(reader, name));
  return reader;
}

dds_entity_t Participant::create_writer(const std::string& name, const dds_topic_descriptor_t& type, Qos kind) {
  const QosHolder holder;
  set(holder.qos, kind);
  const dds_entity_t writer =
      check(dds_create_writer(participant_, create_topic(name, type), holder.qos, nullptr), name);
  writers_.push_back(guid_of(writer, name));
  return writer;
}

void Participant::wait(int64_t most_ns) { dds_waitset_wait(waitset_, nullptr, 0, most_ns); }

Discovery::Discovery(const Participant& participant)
    : own_(participant.guid()),
      publications_(check(dds_create_reader(participant.entity(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
                          "discovery")),
      subscriptions_(check(
          dds_create_reader(participant.entity(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr), "discovery")) {
}

bool Discovery::update() {
  const bool published = take(publications_, true), subscribed = take(subscriptions_, false);
  return published || subscribed;
}

bool Discovery::take(dds_entity_t reader, bool writes) {
  constexpr int32_t kMost = 64;
  bool changed = false;
  for (;;) {
    void* samples[kMost] = {};
    dds_sample_info_t infos[kMost];
    const dds_return_t count = dds_take(reader, samples, infos, kMost, kMost);
    for (int32_t i = 0; i < count; ++i) {
      const auto* endpoint = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      const auto handle = infos[i].instance_handle;
      if (infos[i].instance_state != DDS_IST_ALIVE || !infos[i].valid_data) {
        changed = endpoints_.erase(handle) > 0 || changed;
      } else if (!equal(endpoint->participant_key, own_)) {
        endpoints_[handle] = {ros_topic_of(endpoint->topic_name), ros_type_of(endpoint->type_name), writes};
        changed = true;
      }
    }
    if (count > 0) dds_return_loan(reader, samples, count);
    if (count < kMost) return changed;
  }
}

std::string policy_name(uint32_t id) {
  switch (id) {
    case DDS_RELIABILITY_QOS_POLICY_ID: return "reliability";
    case DDS_DURABILITY_QOS_POLICY_ID: return "durability";
    case DDS_DEADLINE_QOS_POLICY_ID: return "deadline";
    case DDS_LIVELINESS_QOS_POLICY_ID: return "liveliness";
    case DDS_OWNERSHIP_QOS_POLICY_ID: return "ownership";
    case DDS_HISTORY_QOS_POLICY_ID: return "history";
    case DDS_PARTITION_QOS_POLICY_ID: return "partition";
    case DDS_LATENCYBUDGET_QOS_POLICY_ID: return "latency budget";
    case DDS_DESTINATIONORDER_QOS_POLICY_ID: return "destination order";
    case DDS_PRESENTATION_QOS_POLICY_ID: return "presentation";
    case DDS_DATA_REPRESENTATION_QOS_POLICY_ID: return "data representation (XCDR1 is needed)";
    default: return "policy " + std::to_string(id);
  }
}

}  // namespace overtake::ros2
