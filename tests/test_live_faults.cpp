// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A live run with clients that are slow, stopped, silent or hostile, that leave and come again; the end of the server.
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>

#include "tests/support/live_run.h"

namespace overtake::test {
namespace {

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
           R"({"op":"unsubscribe","subscriptionIds":["x"]})", R"({"op":"unsubscribe","subscriptionIds":[4294967301]})",
           R"({"op":"subscribe","subscriptions":[{"id":4294967297,"channelId":1}]})",
           R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
           R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
           R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":4294967297}]})", subscribe({{1, 77}}),
           subscribe({{1, 0}}), std::string(60000, '[')}) {
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

}  // namespace
}  // namespace overtake::test
