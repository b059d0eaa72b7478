// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A live run for WebSocket clients: handshake, channels, subscriptions, whole frames; what is encoded.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <memory>

#include "tests/support/live_run.h"
#include "tests/support/run_command.h"
#include "tools/client/session.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/scan_stream.h"
#include "tools/view/mcap_view.h"

namespace overtake::test {
namespace {

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

}  // namespace
}  // namespace overtake::test
