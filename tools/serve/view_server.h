// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Serves the viewer's pages, the logs, and a live run. README.md lists the rules: which Host and Origin it answers,
// which headers a response has, how ranges work.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/serve/http_server.h"

namespace overtake::serve {

// A part of a resource that a Range header asks for; `size` 0: none can be given (416).
struct ByteRange {
  uint64_t first = 0, size = 0;
};
// Nothing: no range is meant (another unit), the whole resource is. Of "bytes=a-b", "bytes=a-", "bytes=-n" only one.
std::optional<ByteRange> parse_range(std::string_view header, uint64_t bytes);

// Of this computer; "" if it has none.
std::string machine_name();

// Whether a Host header names this server: localhost or 127.0.0.1 with its port. open: bound to another address, then
// any numeric address and the machine's name, too. A page of another site cannot use those names (DNS rebinding).
bool is_own_host(std::string_view host, int32_t port, bool open, const std::string& machine = machine_name());

// Whether a browser may send this text as the Origin of a page: scheme://host[:port] in lower case, without a path.
bool can_be_origin(std::string_view origin);

// Takes the WebSocket connections of a live run.
class SocketAcceptor {
 public:
  virtual ~SocketAcceptor() = default;
  virtual std::shared_ptr<SocketClient> accept(const std::vector<std::string>& protocols, std::function<void()> wake,
                                               std::string& chosen, Response& refusal) = 0;
};

struct ViewServerOptions {
  std::string address = "127.0.0.1";
  int32_t port = 0;                        // 0: a free one
  std::vector<std::string> logs;           // their numbers are their addresses
  std::string at;                          // stamp of a frame to show; "": the first
  std::vector<std::string> allow_origins;  // pages of other sites that may connect
  SocketAcceptor* live = nullptr;          // null: no live run. Must outlive the server
  std::chrono::milliseconds most_silence = kMostSilence;
};

class ViewServer final : public HttpHandler {
 public:
  // Throws io::Error where an origin cannot be one, or no server can be started.
  explicit ViewServer(const ViewServerOptions& options);
  int32_t port() const { return server_->port(); }
  // "http://127.0.0.1:8123/", with the fragment #at=STAMP if there is one.
  std::string url() const;

 private:
  Response respond(const Request& request) override;
  Response explain(int32_t status, const std::string& text) override;
  std::shared_ptr<SocketClient> accept(const Request& request, const std::vector<std::string>& protocols,
                                       std::function<void()> wake, std::string& chosen, Response& refusal) override;
  // The reason to refuse a request of this Host and Origin; nothing: it is welcome.
  std::optional<Response> refuse(const Request& request) const;
  Response route(const Request& request) const;
  Response list_logs() const;
  Response serve_log(const Request& request, const std::string& path) const;
  void add_headers(const Request& request, Response& response) const;
  bool is_open() const;

  ViewServerOptions options_;
  std::unique_ptr<HttpServer> server_;
};

}  // namespace overtake::serve
