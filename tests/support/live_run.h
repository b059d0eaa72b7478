// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A live run of three channels, its server, and what a WebSocket client of it sends and gets.
#pragma once

#include <doctest/doctest.h>

#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/http_client.h"
#include "tools/serve/live_view.h"

namespace overtake::test {

using Json = nlohmann::json;

inline constexpr const char* kBoth = "foxglove.sdk.v1, foxglove.websocket.v1";
inline constexpr uint16_t kNumbers = 1, kClouds = 2, kMap = 3;

inline cli::ViewChannel channel(uint16_t id, const std::string& topic, bool once = false) {
  return {id, topic, "json", "overtake.Test", "jsonschema", "{\"type\":\"object\"}", cli::ViewKind::kNumbers, once};
}

// A live run of three channels. Members end in the other order: the server goes first.
struct LiveRun {
  serve::LiveView view;
  serve::ViewServer server;

  explicit LiveRun(bool with_channels = true, std::chrono::milliseconds most_silence = serve::kMostSilence)
      : server({"127.0.0.1", 0, {}, "", {"https://app.example"}, &view, most_silence}) {
    if (!with_channels) return;
    view.add_channel(channel(kNumbers, "/numbers"));
    view.add_channel(channel(kClouds, "/clouds"));
    view.add_channel(channel(kMap, "/map", true));
  }
  // As McapView does: writes what is wanted. Returns the channels that were.
  std::set<uint16_t> frame(int64_t stamp_ns, const std::string& text) {
    std::set<uint16_t> wanted;
    view.begin_frame();
    for (const uint16_t id : {kNumbers, kClouds, kMap})
      if (write(id, stamp_ns, text)) wanted.insert(id);
    view.end_frame();
    return wanted;
  }
  bool write(uint16_t id, int64_t stamp_ns, const std::string& text) {
    const bool wanted = view.wants(id);
    if (wanted) view.write(id, stamp_ns, text);
    return wanted;
  }
  SocketPeer peer(const std::string& protocols = kBoth) const { return SocketPeer(server.port(), protocols); }
  // Until any (or no) client wants the channel: a request takes its time to arrive.
  bool becomes_wanted(uint16_t id, bool wanted = true) const {
    for (int32_t i = 0; i < 2000 && view.wants(id) != wanted; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return view.wants(id) == wanted;
  }
};

inline std::string subscribe(const std::vector<std::pair<uint32_t, uint16_t>>& wishes) {
  Json list = Json::array();
  for (const auto& [id, wish] : wishes) list.push_back({{"id", id}, {"channelId", wish}});
  return Json{{"op", "subscribe"}, {"subscriptions", list}}.dump();
}

inline Json text_of(const SocketFrame& frame) {
  REQUIRE(frame.opcode == 1);
  return Json::parse(frame.data);
}

// The next text message of an operation.
inline Json next_op(SocketPeer& peer, const std::string& op) {
  while (true) {
    const SocketFrame frame = peer.next();
    REQUIRE(frame.opcode > 0);
    if (frame.opcode != 1) continue;
    const Json json = Json::parse(frame.data);
    if (json.at("op") == op) return json;
  }
}

// Until the server has read all that the peer has sent.
inline void settle(SocketPeer& peer) {
  peer.send("settled", 9);
  while (true) {
    const SocketFrame frame = peer.next();
    REQUIRE(frame.opcode > 0);
    REQUIRE(frame.opcode != 2);
    if (frame.opcode == 10) return;
  }
}

// A message of a channel.
struct Data {
  uint32_t subscription;
  int64_t stamp_ns;
  std::string text;
  bool operator==(const Data&) const = default;
};
inline Data next_data(SocketPeer& peer) {
  while (true) {
    const SocketFrame frame = peer.next();
    REQUIRE(frame.opcode > 0);
    if (frame.opcode != 2) continue;
    REQUIRE(frame.data.size() >= 13);
    REQUIRE(frame.data[0] == 1);
    Data out{0, 0, frame.data.substr(13)};
    std::memcpy(&out.subscription, frame.data.data() + 1, 4);
    std::memcpy(&out.stamp_ns, frame.data.data() + 5, 8);
    return out;
  }
}

}  // namespace overtake::test
