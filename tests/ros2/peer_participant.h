// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A participant of Fast DDS on the loopback interface.
#pragma once

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace overtake::ros2_peer {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

template <class Guid>
std::string hex(const Guid& guid) {
  std::string text;
  for (const auto byte : guid) {
    char two[3];
    std::snprintf(two, sizeof two, "%02x", unsigned(uint8_t(byte)));
    text += two;
  }
  return text;
}
inline std::string hex(const rtps::GUID_t& guid) { return hex(guid.guidPrefix.value) + hex(guid.entityId.value); }

class Peer {
 public:
  // What this participant sees of the others: kind "participant" (its user data as type), "writer" or "reader".
  using Discovered =
      std::function<void(const char* kind, const std::string& topic, const std::string& type, const std::string& guid)>;
  Peer(uint32_t domain, Discovered discovered) : listener_(std::move(discovered)) {
    dds::DomainParticipantQos qos;
    qos.name("ros2_peer");
    const auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    udp->sendBufferSize = udp->receiveBufferSize = 4 << 20;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    // As on a machine without multicast: one peer by its address.
    rtps::Locator_t peer;
    rtps::IPLocator::setIPv4(peer, "127.0.0.1");
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos, &listener_,
                                                                                     dds::StatusMask::none());
    if (!participant_) throw std::runtime_error("Fast DDS: no participant");
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  ~Peer() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  template <class Type>
  dds::DataWriter* writer(const std::string& name, bool reliable, const std::string& type_name = "",
                          bool exclusive = false) {
    dds::DataWriterQos qos;
    qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.history().depth = reliable ? 1000 : 5;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.publish_mode().kind = reliable ? dds::SYNCHRONOUS_PUBLISH_MODE : dds::ASYNCHRONOUS_PUBLISH_MODE;
    if (exclusive) qos.ownership().kind = dds::EXCLUSIVE_OWNERSHIP_QOS;
    return publisher_->create_datawriter(topic<Type>(name, type_name), qos);
  }

  template <class Type, class Message>
  dds::DataReader* reader(const std::string& name, bool latched, std::function<void(const Message&)> use,
                          const std::string& type_name = "") {
    struct Listener : dds::DataReaderListener {
      explicit Listener(std::function<void(const Message&)> f) : use(std::move(f)) {}
      void on_data_available(dds::DataReader* from) override {
        Message message;
        dds::SampleInfo info;
        while (from->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK)
          if (info.valid_data) use(message);
      }
      std::function<void(const Message&)> use;
    };
    dds::DataReaderQos qos;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = 200;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    auto listener = std::make_shared<Listener>(std::move(use));
    listeners_.push_back(listener);
    return subscriber_->create_datareader(topic<Type>(name, type_name), qos, listener.get());
  }

 private:
  template <class Type>
  dds::Topic* topic(const std::string& name, const std::string& type_name) {
    dds::TypeSupport type(new Type());
    if (!type_name.empty()) type->setName(type_name.c_str());
    type.register_type(participant_);
    return participant_->create_topic(name.starts_with("/") ? "rt" + name : name, type.get_type_name(),
                                      dds::TOPIC_QOS_DEFAULT);
  }
  struct DiscoveryListener : dds::DomainParticipantListener {
    explicit DiscoveryListener(Discovered f) : discovered(std::move(f)) {}
    void on_participant_discovery(dds::DomainParticipant*, rtps::ParticipantDiscoveryInfo&& found) override {
      if (found.status != rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT) return;
      const auto& data = found.info.m_userData.data_vec();
      discovered("participant", "", std::string(data.begin(), data.end()), hex(found.info.m_guid));
    }
    void on_publisher_discovery(dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& found) override {
      if (found.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER)
        discovered("writer", found.info.topicName().to_string(), found.info.typeName().to_string(),
                   hex(found.info.guid()));
    }
    void on_subscriber_discovery(dds::DomainParticipant*, rtps::ReaderDiscoveryInfo&& found) override {
      if (found.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER)
        discovered("reader", found.info.topicName().to_string(), found.info.typeName().to_string(),
                   hex(found.info.guid()));
    }
    Discovered discovered;
  };
  DiscoveryListener listener_;
  dds::DomainParticipant* participant_;
  dds::Publisher* publisher_;
  dds::Subscriber* subscriber_;
  std::vector<std::shared_ptr<dds::DataReaderListener>> listeners_;
};

inline int32_t matched(dds::DataWriter* writer) {
  dds::PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count;
}
inline int32_t matched(dds::DataReader* reader) {
  dds::SubscriptionMatchedStatus status;
  reader->get_subscription_matched_status(status);
  return status.current_count;
}

}  // namespace overtake::ros2_peer
