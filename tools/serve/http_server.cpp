// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/http_server.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <new>
#include <set>

#include "tools/io/error.h"

namespace overtake::serve {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using net::ip::tcp;
using RawRequest = http::request<http::empty_body>;
using Headers = std::vector<std::pair<std::string, std::string>>;

constexpr auto kPatience = std::chrono::seconds(30);  // for a request, and for the next bytes of a response to be taken
constexpr std::size_t kPieceBytes = 256 << 10;        // of a file, in memory

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

Request request_of(const RawRequest& raw) {
  const auto header = [&](http::field field) {
    return raw.count(field) == 1 ? view_of(raw[field]) : std::string_view();
  };
  const std::string_view target = view_of(raw.target());
  const std::string_view origin = raw.count(http::field::origin) > 1 ? kManyOrigins : header(http::field::origin);
  return {view_of(raw.method_string()), target.substr(0, target.find('?')), header(http::field::host),    origin,
          header(http::field::range),   header(http::field::if_match),      header(http::field::if_range)};
}

// Reads up to `size` bytes from a place of a file. Fewer: the file is shorter now, or damaged.
std::size_t read_at(int fd, uint64_t first, char* out, std::size_t size) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = pread(fd, out + done, size - done, off_t(first + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += std::size_t(got);
  }
  return done;
}

}  // namespace

File::~File() { close(fd_); }

// The loop's thread alone touches connections and the list of them.
class HttpServer::Loop {
 public:
  Loop(const std::string& address, int32_t port, HttpHandler& handler, std::chrono::milliseconds most_silence);
  void run() {
    while (!io_.stopped()) try {
        io_.run();
      } catch (const std::exception&) {  // no memory for one client: its connection is gone, the others go on
      }
  }
  void stop() { io_.stop(); }
  int32_t port() const { return acceptor_.local_endpoint().port(); }

 private:
  class Connection;
  class Socket;
  void accept();
  void make_room();

  HttpHandler& handler_;
  const std::chrono::milliseconds most_silence_;
  std::set<Connection*> connections_;  // outlives io_, which destroys the connections
  uint64_t next_number_ = 0;
  net::io_context io_{1};
  tcp::acceptor acceptor_{io_};
  net::steady_timer pause_{io_};
};

// A WebSocket after its handshake.
class HttpServer::Loop::Socket : public std::enable_shared_from_this<Socket> {
 public:
  Socket(beast::tcp_stream stream, RawRequest request, std::shared_ptr<SocketClient> client)
      : stream_(std::move(stream)), request_(std::move(request)), client_(std::move(client)) {}

  // headers: of a response that refuses a bad handshake.
  void start(const std::string& protocol, const Headers& headers, std::chrono::milliseconds most_silence) {
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout{kPatience, most_silence, true});
    stream_.set_option(websocket::stream_base::decorator([protocol, headers](websocket::response_type& response) {
      response.set(http::field::server, "overtake");
      if (response.result() == http::status::switching_protocols)
        response.set(http::field::sec_websocket_protocol, protocol);
      else
        for (const auto& [name, value] : headers) response.set(name, value);
    }));
    stream_.read_message_max(64 << 10);
    stream_.auto_fragment(false);
    stream_.async_accept(request_, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->open_ = true;
      self->read();
      self->pump();
    });
  }

  // Sends what the client has.
  void pump() {
    if (!open_ || writing_ || !client_->next(out_)) return;
    writing_ = true;
    stream_.text(out_.text);
    const std::array<net::const_buffer, 2> buffers = {net::buffer(out_.head),
                                                      out_.body ? net::buffer(*out_.body) : net::const_buffer()};
    stream_.async_write(buffers, [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->writing_ = false;
      self->out_ = {};
      if (error) return self->end();
      self->pump();
    });
  }

 private:
  void read() {
    stream_.async_read(in_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return self->end();
      const auto bytes = self->in_.cdata();
      if (!self->client_->receive({static_cast<const char*>(bytes.data()), bytes.size()}, self->stream_.got_text()))
        return self->end();
      self->in_.consume(self->in_.size());
      self->pump();
      self->read();
    });
  }

  void end() {
    open_ = false;
    beast::get_lowest_layer(stream_).close();
  }

  websocket::stream<beast::tcp_stream> stream_;
  RawRequest request_;
  std::shared_ptr<SocketClient> client_;
  beast::flat_buffer in_;
  SocketMessage out_;
  bool open_ = false, writing_ = false;
};

// One connection: request, response, and again.
class HttpServer::Loop::Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Loop& loop, tcp::socket socket) : loop_(loop), number_(loop.next_number_++), stream_(std::move(socket)) {
    loop_.connections_.insert(this);
  }
  ~Connection() { loop_.connections_.erase(this); }

  bool waits() const { return waits_; }
  uint64_t number() const { return number_; }
  void close() {
    loop_.connections_.erase(this);
    stream_.close();
  }

  void read() {
    waits_ = true;
    number_ = loop_.next_number_++;
    parser_.emplace();
    parser_->header_limit(8 << 10);
    parser_->body_limit(0);
    stream_.expires_after(kPatience);
    http::async_read(stream_, in_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->waits_ = false;
      if (!error) return self->answer();
      // A request that is no HTTP, too long or has a body gets a word; a connection that ended does not.
      if (error == http::error::end_of_stream || error.category() != http::make_error_code({}).category())
        return self->close();
      self->keep_alive_ = false;
      self->send(self->loop_.handler_.explain(400, "This request cannot be read.\n"), false, 11);
    });
  }

 private:
  void answer() {
    RawRequest raw = parser_->release();
    keep_alive_ = raw.keep_alive();
    const unsigned version = raw.version();
    const bool is_head = raw.method() == http::verb::head;
    try {
      if (!websocket::is_upgrade(raw)) return send(loop_.handler_.respond(request_of(raw)), is_head, version);
      upgrade(std::move(raw));
    } catch (const std::exception& error) {
      keep_alive_ = false;
      send(loop_.handler_.explain(500, std::string(error.what()) + "\n"), is_head, version);
    }
  }

  void upgrade(RawRequest raw) {
    std::vector<std::string> protocols;
    if (raw.count(http::field::sec_websocket_protocol) == 1)
      for (const auto& token : http::token_list(raw[http::field::sec_websocket_protocol]))
        protocols.emplace_back(token);
    // The client may wake the socket from any thread, but only the loop's thread looks at it.
    const auto later = std::make_shared<std::weak_ptr<Socket>>();
    const auto wake = [&io = loop_.io_, later] {
      net::post(io, [later] {
        if (const auto socket = later->lock()) socket->pump();
      });
    };
    std::string chosen;
    Response refusal;
    auto client = loop_.handler_.accept(request_of(raw), protocols, wake, chosen, refusal);
    if (!client) {
      keep_alive_ = false;
      return send(std::move(refusal), false, raw.version());
    }
    loop_.connections_.erase(this);
    const auto socket = std::make_shared<Socket>(std::move(stream_), std::move(raw), std::move(client));
    *later = socket;
    socket->start(chosen, loop_.handler_.explain(400, "").headers, loop_.most_silence_);
  }

  void send(Response response, bool is_head, unsigned version) {
    const auto fill = [&](auto& message) {
      message.set(http::field::server, "overtake");
      message.set(http::field::content_type, response.type);
      for (const auto& [name, value] : response.headers) message.set(name, value);
      message.keep_alive(keep_alive_);
    };
    const auto status = http::status(response.status);
    if (!is_head && !response.part) {
      const auto message = std::make_shared<http::response<http::string_body>>(status, version);
      fill(*message);
      message->body() = std::move(response.body);
      message->prepare_payload();
      return write(message);
    }
    const auto message = std::make_shared<http::response<http::empty_body>>(status, version);
    fill(*message);
    message->content_length(response.part ? response.part->size : response.body.size());
    if (!is_head) part_ = std::move(response.part);
    write(message);
  }

  template <class Message>
  void write(const std::shared_ptr<Message>& message) {
    stream_.expires_after(kPatience);
    http::async_write(stream_, *message, [self = shared_from_this(), message](beast::error_code error, std::size_t) {
      if (error) return self->close();
      self->write_piece();
    });
  }

  // The next bytes of the file, if there are any; then the next request.
  void write_piece() {
    if (!part_ || part_->size == 0) {
      part_.reset();
      return keep_alive_ ? read() : finish();
    }
    piece_.resize(std::size_t(std::min<uint64_t>(part_->size, kPieceBytes)));
    if (read_at(part_->file->fd(), part_->first, piece_.data(), piece_.size()) != piece_.size()) return close();
    part_->first += piece_.size();
    part_->size -= piece_.size();
    stream_.expires_after(kPatience);
    net::async_write(stream_, net::buffer(piece_), [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return self->close();
      self->write_piece();
    });
  }

  void finish() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    close();
  }

  Loop& loop_;
  uint64_t number_;  // grows with each request: the smallest one waits for the longest time
  beast::tcp_stream stream_;
  beast::flat_buffer in_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<FilePart> part_;
  std::vector<char> piece_;
  bool waits_ = false, keep_alive_ = false;
};

HttpServer::Loop::Loop(const std::string& address, int32_t port, HttpHandler& handler,
                       std::chrono::milliseconds most_silence)
    : handler_(handler), most_silence_(most_silence) {
  beast::error_code error;
  const auto fail = [&](const std::string& what) {
    if (error) throw io::Error(address + ":" + std::to_string(port), 0, what + ": " + error.message());
  };
  const auto place = net::ip::make_address(address, error);
  fail("is not an address of this machine");
  const tcp::endpoint endpoint(place, uint16_t(port));
  acceptor_.open(endpoint.protocol(), error);
  if (!error) ::fcntl(acceptor_.native_handle(), F_SETFD, FD_CLOEXEC);  // a browser that is started must not keep it
  fail("cannot be opened");
  acceptor_.set_option(net::socket_base::reuse_address(true), error);
  acceptor_.bind(endpoint, error);
  if (error == net::error::address_in_use)
    throw io::Error("port " + std::to_string(port), 0, "is taken by another program; choose another one");
  fail("cannot be bound");
  acceptor_.listen(net::socket_base::max_listen_connections, error);
  fail("cannot be listened to");
  accept();
}

void HttpServer::Loop::accept() {
  acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (error == net::error::operation_aborted) return;
    if (error) {  // no file descriptor is left, for instance
      pause_.expires_after(std::chrono::milliseconds(100));
      pause_.async_wait([this](beast::error_code stopped) {
        if (!stopped) accept();
      });
      return;
    }
    try {
      make_room();
      if (connections_.size() < kMostConnections) {
        beast::error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        ::fcntl(socket.native_handle(), F_SETFD, FD_CLOEXEC);
        std::make_shared<Connection>(*this, std::move(socket))->read();
      }
    } catch (const std::bad_alloc&) {  // this connection is lost; later ones may find memory
    }
    accept();
  });
}

void HttpServer::Loop::make_room() {
  if (connections_.size() < kMostConnections) return;
  Connection* oldest = nullptr;
  for (Connection* connection : connections_)
    if (connection->waits() && (!oldest || connection->number() < oldest->number())) oldest = connection;
  if (oldest) oldest->close();
}

HttpServer::HttpServer(const std::string& address, int32_t port, HttpHandler& handler,
                       std::chrono::milliseconds most_silence)
    : loop_(std::make_unique<Loop>(address, port, handler, most_silence)) {}

void HttpServer::start() {
  thread_ = std::thread([this] { loop_->run(); });
}

HttpServer::~HttpServer() {
  loop_->stop();
  if (thread_.joinable()) thread_.join();
}

int32_t HttpServer::port() const { return loop_->port(); }

}  // namespace overtake::serve
