// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/graph.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <vector>

#include "messages.h"

namespace overtake::ros2 {
namespace {

constexpr const char* kTopic = "ros_discovery_info";

bool is(const dds_guid_t& a, const dds_guid_t& b) { return std::memcmp(a.v, b.v, sizeof a.v) == 0; }

// The bytes of the GUID, then zeros.
template <class Gid>
Gid to_gid(const dds_guid_t& guid) {
  Gid gid{};
  static_assert(sizeof gid.data >= sizeof guid.v);
  std::memcpy(gid.data, guid.v, sizeof guid.v);
  return gid;
}

template <class Sequence, class Row>
void point_to(Sequence& sequence, std::vector<Row>& rows) {
  sequence._maximum = sequence._length = uint32_t(rows.size());
  sequence._buffer = rows.data();
}

}  // namespace

Graph::Graph(Participant& participant, const Names& names, int32_t gid_bytes)
    : participant_(participant),
      name_space_(names.name_space().empty() ? "/" : names.name_space()),
      node_(names.node()),
      gid_bytes_(gid_bytes) {
  const dds_topic_descriptor_t& humble = rmw_dds_common_msg_dds__ParticipantEntitiesInfo__desc;
  dds_topic_descriptor_t iron = rmw_dds_common_iron_msg_dds__ParticipantEntitiesInfo__desc;
  iron.m_typename = humble.m_typename;
  writer_ = participant.create_writer(kTopic, gid_bytes_ == 16 ? iron : humble, Qos::kLatched);
  own_ = participant.writers().back();
}

void Graph::update() {
  const std::size_t count = participant_.readers().size() + participant_.writers().size();
  if (count == said_) return;
  said_ = count;
  if (gid_bytes_ == 16)
    publish<rmw_dds_common_iron_msg_dds__ParticipantEntitiesInfo_, rmw_dds_common_iron_msg_dds__Gid_>();
  else
    publish<rmw_dds_common_msg_dds__ParticipantEntitiesInfo_, rmw_dds_common_msg_dds__Gid_>();
}

template <class Message, class Gid>
void Graph::publish() const {
  using Node = std::remove_pointer_t<decltype(Message{}.node_entities_info_seq._buffer)>;
  std::vector<Gid> readers, writers;
  for (const dds_guid_t& guid : participant_.readers()) readers.push_back(to_gid<Gid>(guid));
  for (const dds_guid_t& guid : participant_.writers())
    if (!is(guid, own_)) writers.push_back(to_gid<Gid>(guid));
  // Cyclone DDS takes pointers to char and only reads them.
  std::string name_space = name_space_, node = node_;
  std::vector<Node> nodes(1);
  nodes[0].node_namespace = name_space.data();
  nodes[0].node_name = node.data();
  point_to(nodes[0].reader_gid_seq, readers);
  point_to(nodes[0].writer_gid_seq, writers);
  Message message{};
  message.gid = to_gid<Gid>(participant_.guid());
  point_to(message.node_entities_info_seq, nodes);
  dds_write(writer_, &message);
}

}  // namespace overtake::ros2
