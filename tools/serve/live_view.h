// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A run's messages for WebSocket clients, by Foxglove's protocol
// (github.com/foxglove/ws-protocol/blob/main/docs/spec.md), for our pages, Foxglove and Lichtblick.
//
// A client has one slot: a frame that it has not taken yet is replaced by the next one and counted. So a slow client
// gets the newest frame, and no client ever delays the run. A message that nobody subscribed to, and one for clients
// that have taken nothing for 0.1 s, is not encoded. What a frame has is settled at its begin: a client that subscribes
// in the middle of a frame gets the next one, never a part.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tools/serve/view_server.h"
#include "tools/view/view_sink.h"

namespace overtake::serve {

inline constexpr std::size_t kMostLiveClients = 16;

class LiveView : public cli::ViewSink, public SocketAcceptor {
 public:
  LiveView();
  ~LiveView() override;

  // The run's side: one thread at a time.
  void add_channel(const cli::ViewChannel& channel) override;
  bool wants(uint16_t channel) const override;
  void write(uint16_t channel, int64_t stamp_ns, std::string_view data) override;
  void begin_frame() override;
  void end_frame() override;

  struct Counts {
    int64_t clients = 0;            // that connected so far
    int64_t subscribed = 0;         // of them: those that asked for a channel
    int64_t frames = 0;             // that the run wrote
    int64_t sent = 0, dropped = 0;  // frames, over all clients
    bool operator==(const Counts&) const = default;
  };
  Counts counts() const;
  // Waits until the clients have what was written, but not for one that has taken nothing for 0.2 s.
  void drain(std::chrono::milliseconds most) const;

  std::shared_ptr<SocketClient> accept(const std::vector<std::string>& protocols, std::function<void()> wake,
                                       std::string& chosen, Response& refusal) override;

 private:
  class Client;
  struct State;
  std::shared_ptr<State> state_;  // clients hold it, too
};

}  // namespace overtake::serve
