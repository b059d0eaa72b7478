// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A client of HTTP and of WebSockets on a plain socket: it can send what no library would.
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <string_view>

#include "tools/io/text.h"

namespace overtake::test {

struct HttpResponse {
  int status = 0;                              // 0: the connection ended without a response
  std::map<std::string, std::string> headers;  // names in lower case
  std::string body;                            // shorter than content-length: the connection ended
};

class HttpClient {
 public:
  explicit HttpClient(int32_t port, const char* address = "127.0.0.1") : port_(port) {
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(uint16_t(port));
    inet_pton(AF_INET, address, &place.sin_addr);
    const timeval patience{20, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    connected_ = connect(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0;
  }
  ~HttpClient() {
    if (socket_ >= 0) close(socket_);
  }
  HttpClient(HttpClient&& other) noexcept
      : port_(other.port_), socket_(other.socket_), connected_(other.connected_), read_(std::move(other.read_)) {
    other.socket_ = -1;
  }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  bool connected() const { return connected_; }
  int fd() const { return socket_; }
  std::string own_host() const { return "127.0.0.1:" + std::to_string(port_); }

  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes.remove_prefix(std::size_t(sent));
    }
    return true;
  }
  // Up to `size` bytes; fewer when the connection ends.
  std::string take(std::size_t size) {
    while (read_.size() < size && receive()) {
    }
    std::string out = read_.substr(0, size);
    read_.erase(0, size);
    return out;
  }
  HttpResponse response(bool has_body = true) {
    HttpResponse out;
    std::size_t end;
    while ((end = read_.find("\r\n\r\n")) == std::string::npos)
      if (!receive()) return out;
    const std::string head = read_.substr(0, end + 2);
    read_.erase(0, end + 4);
    out.status = std::atoi(head.c_str() + 9);
    for (std::size_t at = head.find("\r\n") + 2; at < head.size();) {
      const std::size_t colon = head.find(':', at), line_end = head.find("\r\n", at);
      out.headers[io::lower_case(head.substr(at, colon - at))] =
          std::string(io::trim(head.substr(colon + 1, line_end - colon - 1)));
      at = line_end + 2;
    }
    if (has_body && out.status != 101)
      out.body = take(std::size_t(std::strtoull(out.headers["content-length"].c_str(), nullptr, 10)));
    return out;
  }
  // headers: lines that end with CR LF. A Host header is added unless there is one.
  HttpResponse request(const std::string& method, const std::string& target, const std::string& headers = "") {
    const bool has_host = headers.find("Host:") != std::string::npos;
    send(method + " " + target + " HTTP/1.1\r\n" + (has_host ? "" : "Host: " + own_host() + "\r\n") + headers + "\r\n");
    return response(method != "HEAD");
  }
  HttpResponse get(const std::string& target, const std::string& headers = "") {
    return request("GET", target, headers);
  }

 private:
  bool receive() {
    char piece[1 << 16];
    const ssize_t got = recv(socket_, piece, sizeof piece, 0);
    if (got <= 0) return false;
    read_.append(piece, std::size_t(got));
    return true;
  }

  int32_t port_;
  int socket_ = -1;
  bool connected_ = false;
  std::string read_;
};

struct SocketFrame {
  int32_t opcode = -1;  // 1 text, 2 binary, 8 close, 9 ping, 10 pong; -1: the connection ended
  std::string data;
};

// A WebSocket on such a client.
class SocketPeer {
 public:
  SocketPeer(int32_t port, const std::string& protocols, const std::string& headers = "",
             const std::string& target = "/")
      : http_(port) {
    opened = http_.get(target,
                       "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                       "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
                           (protocols.empty() ? "" : "Sec-WebSocket-Protocol: " + protocols + "\r\n") + headers);
  }
  HttpResponse opened;

  // fin: the last part of the message. Opcode 0 continues it.
  bool send(std::string_view data, int32_t opcode = 1, bool fin = true) {
    std::string frame(1, char((fin ? 0x80 : 0) | opcode));
    if (data.size() < 126) {
      frame += char(0x80 | data.size());
    } else {
      const bool is_long = data.size() > 65535;
      frame += char(0x80 | (is_long ? 127 : 126));
      for (int32_t shift = is_long ? 56 : 8; shift >= 0; shift -= 8)
        frame += char(uint64_t(data.size()) >> shift & 255);
    }
    const std::string mask = "abcd";
    frame += mask;
    for (std::size_t i = 0; i < data.size(); ++i) frame += char(data[i] ^ mask[i % 4]);
    return http_.send(frame);
  }
  SocketFrame next() {
    SocketFrame out;
    const std::string head = http_.take(2);
    if (head.size() < 2) return out;
    uint64_t size = uint8_t(head[1]) & 127;
    if (size >= 126) {
      const std::size_t bytes = size == 126 ? 2 : 8;
      size = 0;
      for (const char c : http_.take(bytes)) size = size << 8 | uint8_t(c);
    }
    out.data = http_.take(std::size_t(size));
    if (out.data.size() == size) out.opcode = head[0] & 15;
    return out;
  }
  HttpClient& http() { return http_; }

 private:
  HttpClient http_;
};

}  // namespace overtake::test
