// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A live run for WebSocket clients: handshake, subscriptions, slow, stopped and hostile clients; what is encoded.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/run_command.h"
#include "tools/client/session.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/scan_stream.h"
#include "tools/serve/live_view.h"
#include "tools/view/mcap_view.h"

using namespace overtake;
using Json = nlohmann::json;
using overtake::test::HttpResponse;
using overtake::test::SocketFrame;
using overtake::test::SocketPeer;

namespace {

constexpr const char* kBoth = "foxglove.sdk.v1, foxglove.websocket.v1";
constexpr uint16_t kNumbers = 1, kClouds = 2, kMap = 3;

cli::ViewChannel channel(uint16_t id, const std::string& topic, bool once = false) {
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

std::string subscribe(const std::vector<std::pair<uint32_t, uint16_t>>& wishes) {
  Json list = Json::array();
  for (const auto& [id, wish] : wishes) list.push_back({{"id", id}, {"channelId", wish}});
  return Json{{"op", "subscribe"}, {"subscriptions", list}}.dump();
}

Json text_of(const SocketFrame& frame) {
  REQUIRE(frame.opcode == 1);
  return Json::parse(frame.data);
}

// The next text message of an operation.
Json next_op(SocketPeer& peer, const std::string& op) {
  while (true) {
    const SocketFrame frame = peer.next();
    REQUIRE(frame.opcode > 0);
    if (frame.opcode != 1) continue;
    const Json json = Json::parse(frame.data);
    if (json.at("op") == op) return json;
  }
}

struct Data {
  uint32_t subscription;
  int64_t stamp_ns;
  std::string text;
  bool operator==(const Data&) const = default;
};
// Until the server has read all that the peer has sent.
void settle(SocketPeer& peer) {
  peer.send("settled", 9);
  while (true) {
    const SocketFrame frame = peer.next();
    REQUIRE(frame.opcode > 0);
    REQUIRE(frame.opcode != 2);
    if (frame.opcode == 10) return;
  }
}
Data next_data(SocketPeer& peer) {
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

}  // namespace

TEST_CASE("live: handshake with either subprotocol, and with no other") {
  LiveRun run;
  const auto protocol_of = [&](const std::string& offered) {
    SocketPeer peer = run.peer(offered);
    return peer.opened.status == 101 ? peer.opened.headers["sec-websocket-protocol"]
                                     : std::to_string(peer.opened.status);
  };
  CHECK(protocol_of("foxglove.websocket.v1") == "foxglove.websocket.v1");
  CHECK(protocol_of("foxglove.sdk.v1") == "foxglove.sdk.v1");
  CHECK(protocol_of("other, foxglove.websocket.v1") == "foxglove.websocket.v1");
  CHECK(protocol_of(kBoth) == "foxglove.sdk.v1");
  for (const char* offered : {"", "other", "foxglove.websocket.v2", "foxglove.websocket.v1x"})
    CHECK(protocol_of(offered) == "400");
  SocketPeer peer = run.peer();
  CHECK(peer.opened.headers["sec-websocket-accept"] == "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  CHECK(peer.opened.headers.count("sec-websocket-extensions") == 0);
  CHECK(Json::parse(test::HttpClient(run.server.port()).get("/logs.json").body).at("live") == true);
}

TEST_CASE("live: another Host, Origin or path gets no WebSocket, an allowed origin does") {
  LiveRun run;
  const int32_t port = run.server.port();
  const auto status = [&](const std::string& headers, const std::string& target = "/") {
    return SocketPeer(port, kBoth, headers, target).opened.status;
  };
  CHECK(status("Host: evil.example:" + std::to_string(port) + "\r\n") == 403);
  for (const char* origin : {"http://evil.example", "null", "https://app.example.evil", "file://"})
    CHECK(status(std::string("Origin: ") + origin + "\r\n") == 403);
  CHECK(status("Origin: http://localhost:" + std::to_string(port) + "\r\n") == 101);
  CHECK(status("Origin: https://app.example\r\n") == 101);
  CHECK(status("", "/live") == 404);
  CHECK(status("", "/logs.json") == 404);
}

TEST_CASE("live: serverInfo first, then the channels, also those that come later") {
  LiveRun run(false);
  SocketPeer peer = run.peer();
  const Json info = text_of(peer.next());
  CHECK(info.at("op") == "serverInfo");
  CHECK(info.at("capabilities").empty());
  CHECK_FALSE(info.at("sessionId").get<std::string>().empty());
  cli::ViewChannel binary = channel(1, "/clouds");
  binary.encoding = binary.schema_encoding = "protobuf";
  binary.schema_data = std::string("\x00\xff\x10\x7f", 4);
  run.view.add_channel(binary);
  const Json first = next_op(peer, "advertise").at("channels");
  REQUIRE(first.size() == 1);
  CHECK(first[0] == Json{{"id", 1},
                         {"topic", "/clouds"},
                         {"encoding", "protobuf"},
                         {"schemaName", "overtake.Test"},
                         {"schema", "AP8Qfw=="},
                         {"schemaEncoding", "protobuf"}});
  run.view.add_channel(channel(2, "/numbers"));
  const Json second = next_op(peer, "advertise").at("channels");
  REQUIRE(second.size() == 1);
  CHECK(second[0].at("schema") == "{\"type\":\"object\"}");
  SocketPeer late = run.peer();
  CHECK(text_of(late.next()).at("op") == "serverInfo");
  CHECK(next_op(late, "advertise").at("channels").size() == 2);
}

TEST_CASE("live: only what a client subscribed to is encoded and sent, with the client's number") {
  LiveRun run;
  CHECK(run.frame(1, "nobody").empty());
  SocketPeer a = run.peer(), b = run.peer("foxglove.websocket.v1");
  next_op(a, "advertise");
  next_op(b, "advertise");
  CHECK(run.frame(2, "nobody").empty());
  a.send(subscribe({{7, kNumbers}}));
  REQUIRE(run.becomes_wanted(kNumbers));
  CHECK(run.view.counts().subscribed == 1);  // of two that connected
  CHECK(run.frame(3, "three") == std::set<uint16_t>{kNumbers});
  CHECK(next_data(a) == Data{7, 3, "three"});
  b.send(subscribe({{4000000000, kClouds}, {1, kNumbers}}));
  REQUIRE(run.becomes_wanted(kClouds));
  CHECK(run.frame(1700000000000025378, "four") == std::set<uint16_t>{kNumbers, kClouds});
  CHECK(next_data(a) == Data{7, 1700000000000025378, "four"});
  CHECK(next_data(b) == Data{1, 1700000000000025378, "four"});
  CHECK(next_data(b) == Data{4000000000, 1700000000000025378, "four"});
  b.send(R"({"op":"unsubscribe","subscriptionIds":[4000000000]})");
  REQUIRE(run.becomes_wanted(kClouds, false));
  { const SocketPeer gone = std::move(b); }  // ends without a word
  CHECK(run.becomes_wanted(kNumbers));
  { const SocketPeer gone = std::move(a); }
  CHECK(run.becomes_wanted(kNumbers, false));
  CHECK(run.frame(5, "nobody").empty());
  const serve::LiveView::Counts expected{.clients = 2, .subscribed = 2, .frames = 5, .sent = 3, .dropped = 0};
  CHECK(run.view.counts() == expected);
}

TEST_CASE("live: a message that is needed once reaches each client once, however late it comes") {
  LiveRun run;
  SocketPeer a = run.peer();
  a.send(subscribe({{1, kMap}, {2, kNumbers}}));
  REQUIRE(run.becomes_wanted(kMap));
  CHECK(run.frame(1, "map 1").contains(kMap));
  CHECK(next_data(a) == Data{1, 1, "map 1"});
  CHECK(next_data(a) == Data{2, 1, "map 1"});
  CHECK(run.frame(2, "x") == std::set<uint16_t>{kNumbers});
  CHECK(next_data(a) == Data{2, 2, "x"});
  SocketPeer b = run.peer();
  b.send(subscribe({{9, kMap}}));
  REQUIRE(run.becomes_wanted(kMap));
  CHECK(run.frame(3, "map 3").contains(kMap));
  CHECK(next_data(b) == Data{9, 3, "map 3"});
  CHECK(next_data(a) == Data{2, 3, "map 3"});  // as its numbers; the map does not come again
  run.frame(4, "y");
  CHECK(next_data(a) == Data{2, 4, "y"});
}

TEST_CASE("live: a client that subscribes again gets what is needed once again") {
  LiveRun run;
  SocketPeer peer = run.peer();
  peer.send(subscribe({{1, kMap}, {2, kNumbers}}));
  REQUIRE(run.becomes_wanted(kMap));
  run.frame(1, "first");
  CHECK(next_data(peer) == Data{1, 1, "first"});
  CHECK(next_data(peer) == Data{2, 1, "first"});
  peer.send(R"({"op":"unsubscribe","subscriptionIds":[1]})");
  settle(peer);
  CHECK(run.frame(2, "none") == std::set<uint16_t>{kNumbers});
  CHECK(next_data(peer) == Data{2, 2, "none"});
  peer.send(subscribe({{3, kMap}}));
  REQUIRE(run.becomes_wanted(kMap));
  run.frame(3, "again");
  CHECK(next_data(peer) == Data{3, 3, "again"});
}

TEST_CASE("live: a client that subscribes in the middle of a frame gets no part of it") {
  LiveRun run;
  SocketPeer first = run.peer(), second = run.peer(), third = run.peer();
  first.send(subscribe({{1, kNumbers}, {2, kClouds}}));
  third.send(subscribe({{6, kClouds}}));
  settle(first);
  settle(third);
  next_op(second, "advertise");
  run.view.begin_frame();
  CHECK(run.write(kNumbers, 1, "part"));
  second.send(subscribe({{3, kNumbers}, {4, kClouds}}));
  first.send(subscribe({{5, kMap}}));
  third.send(subscribe({{7, kNumbers}}));
  settle(second);
  settle(first);
  settle(third);
  CHECK(run.write(kClouds, 1, "rest"));
  CHECK(run.write(kMap, 1, "map"));  // belongs to no frame
  run.view.end_frame();
  CHECK(next_data(first) == Data{5, 1, "map"});
  CHECK(next_data(first) == Data{1, 1, "part"});
  CHECK(next_data(first) == Data{2, 1, "rest"});
  CHECK(run.frame(2, "whole") == std::set<uint16_t>{kNumbers, kClouds});
  CHECK(next_data(second) == Data{3, 2, "whole"});
  CHECK(next_data(second) == Data{4, 2, "whole"});
  CHECK(next_data(third) == Data{6, 1, "rest"});  // what it had asked for before the frame
  CHECK(next_data(third) == Data{7, 2, "whole"});
  CHECK(next_data(third) == Data{6, 2, "whole"});
  CHECK(run.view.counts().dropped == 0);
}

TEST_CASE("live: a channel that nobody had before a frame is not encoded in its middle") {
  LiveRun run;
  SocketPeer peer = run.peer();
  next_op(peer, "advertise");
  run.view.begin_frame();
  CHECK_FALSE(run.write(kNumbers, 1, "x"));
  peer.send(subscribe({{1, kNumbers}, {2, kClouds}}));
  settle(peer);
  CHECK_FALSE(run.write(kClouds, 1, "x"));
  run.view.end_frame();
  CHECK(run.frame(2, "y") == std::set<uint16_t>{kNumbers, kClouds});
  CHECK(next_data(peer) == Data{1, 2, "y"});
}

TEST_CASE("live: a client that wakes up in the middle of a frame gets no part of it") {
  LiveRun run;
  SocketPeer sleeper = run.peer(), other = run.peer();
  sleeper.send(subscribe({{1, kNumbers}, {2, kClouds}}));
  other.send(subscribe({{3, kNumbers}}));
  REQUIRE(run.becomes_wanted(kClouds));
  const std::string large(8 << 20, 'c');
  std::map<int64_t, std::set<uint16_t>> encoded;
  int64_t stamp = 0;
  int32_t quiet = 0;
  while (stamp < 400 && quiet < 20) {  // for half a second only the other's messages are encoded
    ++stamp;
    encoded[stamp] = run.frame(stamp, large);
    REQUIRE(encoded[stamp].contains(kNumbers));
    CHECK(next_data(other).stamp_ns == stamp);
    quiet = encoded[stamp].contains(kClouds) ? 0 : quiet + 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  }
  REQUIRE(quiet == 20);
  run.view.begin_frame();
  CHECK(run.write(kNumbers, ++stamp, "numbers"));
  std::map<int64_t, int32_t> received;
  const int64_t newest = std::find_if(encoded.rbegin(), encoded.rend(), [](const auto& entry) {
                           return entry.second.contains(kClouds);
                         })->first;
  while (received[newest] < 2) ++received[next_data(sleeper).stamp_ns];
  CHECK_FALSE(run.write(kClouds, stamp, "clouds"));
  run.view.end_frame();
  CHECK(next_data(other).stamp_ns == stamp);
  CHECK(run.frame(++stamp, "last").contains(kClouds));
  while (received[stamp] < 2) ++received[next_data(sleeper).stamp_ns];
  for (const auto& [at, messages] : received) CHECK_MESSAGE((messages == 0 || messages == 2), at);
  CHECK(received[stamp - 1] == 0);
}

TEST_CASE("live: a client that had nothing to take for long is not one that takes nothing") {
  LiveRun run;
  SocketPeer peer = run.peer();
  peer.send(subscribe({{1, kNumbers}}));
  REQUIRE(run.becomes_wanted(kNumbers));
  for (int64_t i = 1; i <= 10; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    CHECK(run.frame(i, "x").contains(kNumbers));
    CHECK(run.view.wants(kNumbers));  // at once, before the server's thread sends the frame
    CHECK(next_data(peer).stamp_ns == i);
  }
}

TEST_CASE("live: a silent client is pinged, and closed if it does not answer") {
  LiveRun run(true, std::chrono::milliseconds(600));
  SocketPeer dead = run.peer(), alive = run.peer();
  alive.send(subscribe({{1, kNumbers}}));
  REQUIRE(run.becomes_wanted(kNumbers));
  int32_t pings = 0;
  for (SocketFrame frame; pings < 4;) {
    frame = alive.next();
    REQUIRE(frame.opcode > 0);
    if (frame.opcode != 9) continue;
    ++pings;
    alive.send(frame.data, 10);
  }
  bool was_pinged = false;
  for (SocketFrame frame = dead.next(); frame.opcode >= 0; frame = dead.next()) was_pinged |= frame.opcode == 9;
  CHECK(was_pinged);
  run.frame(1, "still here");
  CHECK(next_data(alive) == Data{1, 1, "still here"});
}

TEST_CASE("live: a handshake without a key is refused under the same policy as other requests") {
  LiveRun run;
  HttpResponse response = test::HttpClient(run.server.port())
                              .get("/",
                                   "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                   "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n");
  CHECK(response.status == 400);
  CHECK(response.headers["content-security-policy"].find("default-src 'self'") == 0);
  CHECK(response.headers["x-content-type-options"] == "nosniff");
}

TEST_CASE("live: a client that stops reading loses frames, and nobody else does") {
  LiveRun run;
  SocketPeer stopped = run.peer(), reader = run.peer();
  stopped.send(subscribe({{1, kClouds}}));
  reader.send(subscribe({{1, kNumbers}}));
  REQUIRE(run.becomes_wanted(kClouds));
  REQUIRE(run.becomes_wanted(kNumbers));
  const std::string large(1 << 20, 'c');
  constexpr int64_t kFrames = 100;
  for (int64_t i = 1; i <= kFrames; ++i) {  // would never end if the stopped one were waited for
    CHECK(run.frame(i, large).contains(kNumbers));
    CHECK(next_data(reader).stamp_ns == i);
  }
  const auto counts = run.view.counts();
  CHECK(counts.dropped > kFrames / 2);
  CHECK(counts.dropped < kFrames);
  // Once it reads again, it gets newer and newer frames up to the newest, and is told what it lost.
  int64_t newest = 0, received = 0, last = kFrames;
  std::string told;
  while (newest <= kFrames) {
    const SocketFrame frame = stopped.next();
    REQUIRE(frame.opcode > 0);
    if (frame.opcode == 2) {
      int64_t stamp_ns;
      std::memcpy(&stamp_ns, frame.data.data() + 5, 8);
      CHECK(stamp_ns > newest);
      newest = stamp_ns;
      received += stamp_ns <= kFrames;
      run.frame(++last, "small");
    } else if (const Json json = Json::parse(frame.data); json.at("op") == "status") {
      told = json.at("message");
      CHECK(json.at("level") == 1);
    }
  }
  CHECK(received + counts.dropped <= kFrames);
  CHECK(received + counts.dropped >= kFrames - 1);  // one may have waited in the slot, and be replaced now
  CHECK(std::stoll(told) >= counts.dropped);
  CHECK(told.find(" frames were not sent: this client is slower than the run") != std::string::npos);
}

TEST_CASE("live: the frame after the one in transfer is the newest, not the next") {
  LiveRun run;
  SocketPeer slow = run.peer();
  slow.send(subscribe({{1, kClouds}}));
  REQUIRE(run.becomes_wanted(kClouds));
  const std::string large(16 << 20, 'c');  // no socket takes that at once
  int64_t newest = 0;
  for (int64_t i = 1; i <= 5; ++i)
    if (run.frame(i, large).contains(kClouds)) newest = i;
  CHECK(newest > 1);
  const int64_t first = next_data(slow).stamp_ns;
  if (first < newest) CHECK(next_data(slow).stamp_ns == newest);
}

TEST_CASE("live: nothing is encoded for a client that has taken nothing for a while") {
  LiveRun run;
  SocketPeer stopped = run.peer();
  stopped.send(subscribe({{1, kClouds}}));
  REQUIRE(run.becomes_wanted(kClouds));
  const std::string large(8 << 20, 'c');
  int64_t stamp = 0, newest = 0;
  int32_t quiet = 0;  // for half a second: the server's thread has had its turn
  while (stamp < 400 && quiet < 20) {
    const bool encoded = run.frame(++stamp, large).contains(kClouds);
    if (encoded) newest = stamp;
    quiet = encoded ? 0 : quiet + 1;
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
  }
  REQUIRE(quiet == 20);
  const int64_t dropped = run.view.counts().dropped;
  CHECK(run.frame(++stamp, large).empty());
  CHECK(run.view.counts().dropped == dropped + 1);
  run.view.drain(std::chrono::minutes(5));                                                // does not wait for it
  for (int64_t stamp_ns = 0; stamp_ns < newest;) stamp_ns = next_data(stopped).stamp_ns;  // once it reads again
  CHECK(run.becomes_wanted(kClouds));
}

TEST_CASE("live: requests that make no sense") {
  LiveRun run;
  SocketPeer peer = run.peer();
  next_op(peer, "advertise");
  for (const std::string& request : std::vector<std::string>{
           "", "junk", "[]", "{}", "null", R"({"op":5})", R"({"op":"subscribe"})",
           R"({"op":"subscribe","subscriptions":[{}]})", R"({"op":"subscribe","subscriptions":{"id":1}})",
           R"({"op":"unsubscribe","subscriptionIds":["x"]})", subscribe({{1, 77}}), subscribe({{1, 0}}),
           std::string(60000, '[')}) {
    REQUIRE(peer.send(request));
    CHECK(next_op(peer, "status").at("level") == 2);
  }
  peer.send(std::string("\x01\x00\x00\x00\x00", 5), 2);
  CHECK(next_op(peer, "status").at("level") == 2);
  peer.send(R"({"op":"unknown to us"})");  // of a later version of the protocol
  peer.send("hello", 9);
  CHECK(peer.next().opcode == 10);
  const std::string request = subscribe({{5, kNumbers}});
  peer.send(request.substr(0, 9), 1, false);  // in two parts
  peer.send(request.substr(9), 0, true);
  REQUIRE(run.becomes_wanted(kNumbers));
  run.frame(1, "after all that");
  CHECK(next_data(peer) == Data{5, 1, "after all that"});
  peer.send(std::string(65 << 10, ' '));  // longer than any request
  while (peer.next().opcode >= 0) {
  }
  CHECK(run.becomes_wanted(kNumbers, false));
  SocketPeer no_text = run.peer();  // text must be UTF-8
  no_text.send("{\"op\":\"\xff\xfe\"}");
  while (no_text.next().opcode >= 0) {
  }
  SocketPeer unmasked = run.peer();  // a client must mask
  unmasked.http().send("\x81\x02{}");
  while (unmasked.next().opcode >= 0) {
  }
  SocketPeer flood = run.peer();  // asks for ever and reads no answer
  bool taken = true;  // until the kernel's buffers of both directions are full, as large as the machine has them
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
  while (taken && std::chrono::steady_clock::now() < end) taken = flood.send("junk");
  CHECK_FALSE(taken);
}

TEST_CASE("live: a client that comes again begins anew; there is room for a number of them") {
  LiveRun run;
  for (int64_t i = 0; i < 40; ++i) {
    SocketPeer peer = run.peer();
    REQUIRE(peer.opened.status == 101);
    peer.send(subscribe({{3, kNumbers}, {4, kMap}}));
    REQUIRE(run.becomes_wanted(kMap));
    run.frame(i + 1, "again");
    CHECK(next_data(peer).text == "again");
    CHECK(next_data(peer).text == "again");
  }
  std::vector<SocketPeer> peers;
  for (std::size_t i = 0; i < 200 && peers.size() < serve::kMostLiveClients; ++i) {
    SocketPeer peer = run.peer();  // until the server has seen the last ones of above leave
    if (peer.opened.status == 101) peers.push_back(std::move(peer));
  }
  REQUIRE(peers.size() == serve::kMostLiveClients);
  SocketPeer more = run.peer();
  CHECK(more.opened.status == 503);
  CHECK(more.opened.body == "There are 16 clients already.\n");
}

TEST_CASE("live: the end of the server ends its clients, in the middle of a message, too") {
  auto run = std::make_unique<LiveRun>();
  SocketPeer idle = run->peer(), busy = run->peer();
  busy.send(subscribe({{1, kClouds}}));
  REQUIRE(run->becomes_wanted(kClouds));
  run->frame(1, std::string(64 << 20, 'c'));
  run.reset();
  while (idle.next().opcode >= 0) {
  }
  while (busy.next().opcode >= 0) {
  }
}

TEST_CASE("view: a sink gets the channels that it wants, and their messages alone are encoded") {
  struct PickySink : cli::ViewSink {
    std::set<std::string> wanted, written, known;
    std::vector<std::string> topics;
    mutable std::map<std::string, int64_t> asked;
    int64_t frames = 0;
    void add_channel(const cli::ViewChannel& added) override {
      CHECK(added.id == topics.size() + 1);
      CHECK(known.insert(added.topic).second);
      topics.push_back(added.topic);
    }
    bool wants(uint16_t id) const override {
      ++asked[topics[std::size_t(id - 1)]];
      return wanted.contains(topics[std::size_t(id - 1)]);
    }
    void write(uint16_t id, int64_t, std::string_view data) override {
      CHECK(wants(id));
      CHECK(in_frame);
      CHECK_FALSE(data.empty());
      written.insert(topics[std::size_t(id - 1)]);
    }
    bool in_frame = false, keeps = false;
    void begin_frame() override {
      CHECK_FALSE(in_frame);
      in_frame = true;
    }
    void end_frame() override {
      CHECK(in_frame);
      in_frame = false;
      ++frames;
    }
    bool keeps_frames() const override { return keeps; }
  };
  const TempFolder folder;
  const std::string log = folder.path("race.mcap");
  REQUIRE(run_overtake(folder, {"simulate", "demo", "--seconds", "0.2", "--out", log, "--quiet"}).code == 0);
  cli::Options options;
  options.input = log;
  const cli::Config config = cli::load_config_with_rig(options);
  PickySink none, some;
  SUBCASE("sinks without a file") {}
  SUBCASE("a sink that keeps the record of all frames") { some.keeps = true; }
  some.wanted = {"/tf", "/front/points", "/left/image/labels", "/tracks/numbers"};
  cli::McapView view(config, {&none, &some});
  const auto on_frame = [](ovt_reader* reader, void* user) { static_cast<cli::McapView*>(user)->add(reader, {}); };
  cli::Session session(config, on_frame, &view);
  const auto stream = io::open_scans(log, config.rig);
  io::FrameScans scans;
  while (stream->next(scans)) {
    session.add_ego(stream->take_ego());
    session.push(scans);
  }
  session.flush();
  CHECK(none.written.empty());
  CHECK(none.known == some.known);
  CHECK(none.known.contains("/right/image/range"));
  CHECK(some.written == some.wanted);
  CHECK(none.frames == 4);
  // Asked once a frame before the message is encoded, and once more where there is one to write.
  CHECK(none.asked.at("/right/image/range") == 4);
  const std::string path = folder.path("record.mcap");
  cli::McapFile file(path);
  view.close(file);
  io::McapReader record(path);
  record.list_attachments();
  REQUIRE(record.attachments().at(0).name == "frames");
  CHECK(Json::parse(record.attachments()[0].data).at("count") == (some.keeps ? 4 : 0));
  CHECK(none.asked.at("/front/points") == 8);
}
