// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// An HTTP/1.1 server with WebSockets on one thread of its own. Knows no file and no path: a handler makes each
// response. Only http_server.cpp includes the library behind it (Boost.Beast).
//
// A slow or silent client costs others nothing: nothing blocks, a request must arrive within 30 s, and beyond
// kMostConnections the longest silent connection is closed for a new one. Requests have no body and 8 KiB at most.
// A silent WebSocket is pinged, and closed if it does not answer: its peer may be gone without a word.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace overtake::serve {

inline constexpr std::size_t kMostConnections = 256;
inline constexpr std::chrono::milliseconds kMostSilence(60'000);  // of a WebSocket; a ping comes after half of it

// Valid during the call that receives it. A header that is missing, or there twice, is "". Two origins are
// kManyOrigins, which no origin equals: "" would be a request of no page.
inline constexpr std::string_view kManyOrigins = "(many)";
struct Request {
  std::string_view method, path;  // path: without the query, not decoded
  std::string_view host, origin, range, if_match, if_range;
  bool is_head() const { return method == "HEAD"; }
};

// An open regular file; closed with the last owner.
class File {
 public:
  explicit File(int fd) : fd_(fd) {}
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

// Bytes of a file as the body. The connection ends early if the file has become shorter.
struct FilePart {
  std::shared_ptr<const File> file;
  uint64_t first = 0, size = 0;
};

struct Response {
  int32_t status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  std::optional<FilePart> part;  // instead of body
};

struct SocketMessage {
  bool text = false;
  std::string head;                         // the message is head and body
  std::shared_ptr<const std::string> body;  // null: head only
};

// One WebSocket connection. The server's thread calls these functions; it destroys the object when the connection ends.
class SocketClient {
 public:
  virtual ~SocketClient() = default;
  // The next message to send, once the one before is sent. False: none until wake() is called.
  virtual bool next(SocketMessage& out) = 0;
  // A message of at most 64 KiB. False: close the connection.
  virtual bool receive(std::string_view data, bool text) = 0;
};

class HttpHandler {
 public:
  virtual ~HttpHandler() = default;
  // Called on the server's thread.
  virtual Response respond(const Request& request) = 0;
  // A response to what is no request (400), or to one whose response failed (500).
  virtual Response explain(int32_t status, const std::string& text) = 0;
  // A WebSocket. Null: refused, with the status of `refusal`. `chosen`: the subprotocol. `wake` may be called on any
  // thread for as long as the server exists.
  virtual std::shared_ptr<SocketClient> accept(const Request& request, const std::vector<std::string>& protocols,
                                               std::function<void()> wake, std::string& chosen, Response& refusal) = 0;
};

class HttpServer {
 public:
  // Takes the port (0: a free one). The handler must outlive the server. Throws io::Error if the port is taken or the
  // address is not one of this machine.
  HttpServer(const std::string& address, int32_t port, HttpHandler& handler,
             std::chrono::milliseconds most_silence = kMostSilence);
  ~HttpServer();  // ends every connection at once
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  int32_t port() const;
  void start();  // answers from now on

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
  std::thread thread_;
};

}  // namespace overtake::serve
