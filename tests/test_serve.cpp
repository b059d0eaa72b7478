// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The server of `overtake view`: who may ask, what is there, ranges, and attacks.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "tests/support/http_client.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/view_server.h"
#include "tools/view/web/pages.h"

using namespace overtake;
using overtake::test::HttpClient;
using overtake::test::HttpResponse;

namespace {

// A server of one log, whose byte i is a function of i.
struct OneLog {
  TempFolder folder;
  std::string text, path;
  serve::ViewServer server;

  explicit OneLog(std::size_t bytes = 1000, const std::string& at = "")
      : text(make_text(bytes)),
        path(folder.write("view.mcap", text)),
        server({"127.0.0.1", 0, {path}, at, {}, nullptr}) {}
  static std::string make_text(std::size_t bytes) {
    std::string text(bytes, '\0');
    for (std::size_t i = 0; i < bytes; ++i) text[i] = char((i * 31 + i / 256) % 251);
    return text;
  }
  HttpClient client() const { return HttpClient(server.port()); }
  HttpResponse get(const std::string& target, const std::string& headers = "") const {
    return client().get(target, headers);
  }
};

std::string range(const std::string& text) { return "Range: " + text + "\r\n"; }

}  // namespace

TEST_CASE("parse_range: one range of bytes, and 416 for what cannot be given") {
  using serve::ByteRange;
  using serve::parse_range;
  struct Case {
    const char* header;
    uint64_t bytes;
    int64_t first, size;  // first -1: no range is meant
  };
  constexpr uint64_t kLarge = uint64_t(5) << 30;
  const Case cases[] = {{"bytes=0-0", 10, 0, 1},
                        {"bytes=0-9", 10, 0, 10},
                        {"bytes=0-10", 10, 0, 10},
                        {"bytes=9-9", 10, 9, 1},
                        {"bytes=9-", 10, 9, 1},
                        {"bytes=0-", 10, 0, 10},
                        {"bytes=10-", 10, 0, 0},
                        {"bytes=10-12", 10, 0, 0},
                        {"bytes=-1", 10, 9, 1},
                        {"bytes=-10", 10, 0, 10},
                        {"bytes=-99", 10, 0, 10},
                        {"bytes=-0", 10, 0, 0},
                        {"bytes=-1", 0, 0, 0},
                        {"bytes=0-0", 0, 0, 0},
                        {"bytes=5-4", 10, 0, 0},
                        {"bytes=5-2", 10, 0, 0},
                        {"bytes=", 10, 0, 0},
                        {"bytes=-", 10, 0, 0},
                        {"bytes=a-b", 10, 0, 0},
                        {"bytes=1-b", 10, 0, 0},
                        {"bytes= 1-2", 10, 0, 0},
                        {"bytes=+1-2", 10, 0, 0},
                        {"bytes=1--2", 10, 0, 0},
                        {"bytes=0-1,3-4", 10, 0, 0},
                        {"bytes=18446744073709551616-", 10, 0, 0},
                        {"bytes=0-18446744073709551616", 10, 0, 0},
                        {"bytes=0-18446744073709551615", 10, 0, 10},
                        {"bytes=-18446744073709551615", 10, 0, 10},
                        {"bytes=2147483647-2147483648", kLarge, 2147483647, 2},
                        {"bytes=4294967295-4294967296", kLarge, 4294967295, 2},
                        {"bytes=-4294967297", kLarge, int64_t(kLarge - 4294967297), 4294967297},
                        {"", 10, -1, 0},
                        {"lines=1-2", 10, -1, 0},
                        {"Bytes=1-2", 10, -1, 0}};
  for (const Case& c : cases) {
    CAPTURE(c.header);
    const auto found = parse_range(c.header, c.bytes);
    CHECK(found.has_value() == (c.first >= 0));
    if (!found) continue;
    CHECK(found->size == uint64_t(c.size));
    if (c.size > 0) CHECK(found->first == uint64_t(c.first));
  }
}

TEST_CASE("is_own_host: names of this machine with the server's port") {
  for (const char* host : {"localhost:8123", "127.0.0.1:8123", "LOCALHOST:8123"})
    CHECK(serve::is_own_host(host, 8123, false));
  for (const char* host :
       {"", "localhost", "127.0.0.1", "localhost:8124", "localhost:81230", "localhost:08123", "localhost:8123 ",
        "evil.example:8123", "127.0.0.1.evil.example:8123", "localhost.:8123", "127.0.0.2:8123", "0.0.0.0:8123",
        "[::1]:8123", "127.1:8123", "2130706433:8123", "a@localhost:8123", ":8123"})
    CHECK_FALSE_MESSAGE(serve::is_own_host(host, 8123, false), host);
  CHECK(serve::is_own_host("localhost", 80, false));
  for (const char* host : {"192.168.1.7:8123", "[fe80::1]:8123", "localhost:8123"})
    CHECK(serve::is_own_host(host, 8123, true));
  for (const char* host : {"Race-PC:8123", "race-pc:8123", "RACE-PC:8123"}) {
    CHECK(serve::is_own_host(host, 8123, true, "Race-PC"));
    CHECK_FALSE(serve::is_own_host(host, 8123, false, "Race-PC"));
  }
  CHECK_FALSE(serve::is_own_host(":8123", 8123, true, ""));
  for (const char* host : {"evil.example:8123", "192.168.1.7", "192.168.1.7.evil.example:8123", "[evil]:8123", ":8123"})
    CHECK_FALSE_MESSAGE(serve::is_own_host(host, 8123, true), host);
}

TEST_CASE("serve: the list of logs, a log, HEAD") {
  const OneLog one(1000, "1700000000000025378");
  CHECK(one.server.url() == "http://127.0.0.1:" + std::to_string(one.server.port()) + "/#at=1700000000000025378");
  const HttpResponse list = one.get("/logs.json");
  CHECK(list.status == 200);
  CHECK(list.headers.at("content-type") == "application/json");
  const auto json = nlohmann::json::parse(list.body);
  CHECK(json.at("live") == false);
  CHECK(json.at("at") == "1700000000000025378");
  REQUIRE(json.at("logs").size() == 1);
  CHECK(json.at("logs")[0].at("url") == "/log/0");
  CHECK(json.at("logs")[0].at("name") == "view.mcap");
  CHECK(json.at("logs")[0].at("bytes") == "1000");
  HttpClient client = one.client();
  const HttpResponse whole = client.get("/log/0");
  CHECK(whole.status == 200);
  CHECK(whole.body == one.text);
  CHECK(whole.headers.at("etag") == json.at("logs")[0].at("etag"));
  CHECK(whole.headers.at("accept-ranges") == "bytes");
  const HttpResponse head = client.request("HEAD", "/log/0", range("bytes=0-3"));  // on the same connection
  CHECK(head.status == 200);
  CHECK(head.headers.at("content-length") == "1000");
  CHECK(client.get("/log/0", range("bytes=1-3")).body == one.text.substr(1, 3));
}

TEST_CASE("serve: every response forbids caching, other sites and foreign code") {
  const OneLog one;
  for (const char* target : {"/logs.json", "/log/0", "/", "/nothing"}) {
    HttpResponse response = one.get(target);
    CHECK(response.headers["cache-control"] == "no-store");
    CHECK(response.headers["x-content-type-options"] == "nosniff");
    CHECK(response.headers["cross-origin-resource-policy"] == "same-origin");
    const std::string policy = response.headers["content-security-policy"];
    for (const char* part : {"default-src 'self';", "script-src 'self' 'wasm-unsafe-eval';", "worker-src 'self';",
                             "frame-ancestors 'none'", "object-src 'none';"})
      CHECK_MESSAGE(policy.find(part) != std::string::npos, part);
    CHECK(policy.find("unsafe-eval'") == policy.find("'wasm-unsafe-eval'") + 6);  // the only one
    CHECK(policy.find('*') == std::string::npos);
  }
}

TEST_CASE("serve: a page that the build has, or a sentence that it has none") {
  const OneLog one;
  HttpResponse page = one.get("/");
  if (cli::pages().empty()) {
    CHECK(page.status == 404);
    CHECK(page.body.find("was built without the pages of its viewer") != std::string::npos);
  } else {
    CHECK(page.status == 200);
    CHECK(page.headers["content-encoding"] == "gzip");
    CHECK(page.body.size() > 18);
  }
}

TEST_CASE("serve: another Host or Origin gets nothing") {
  const OneLog one;
  const std::string port = std::to_string(one.server.port());
  for (const std::string& host : std::vector<std::string>{"evil.example", "evil.example:" + port, "127.0.0.1",
                                                          "localhost:1", "127.0.0.1:" + port + ".evil", ""}) {
    const HttpResponse response = one.get("/log/0", "Host: " + host + "\r\n");
    CHECK_MESSAGE(response.status == 403, host);
    CHECK(response.body.size() < 100);
  }
  HttpClient without = one.client();
  without.send("GET /log/0 HTTP/1.1\r\n\r\n");
  CHECK(without.response().status == 403);
  HttpClient twice = one.client();
  twice.send("GET /log/0 HTTP/1.1\r\nHost: " + twice.own_host() + "\r\nHost: evil.example\r\n\r\n");
  CHECK(twice.response().status == 403);
  for (const std::string& origin :
       std::vector<std::string>{"http://evil.example", "https://127.0.0.1:" + port, "null", "http://127.0.0.1",
                                "http://localhost.evil.example:" + port, "file://"})
    CHECK_MESSAGE(one.get("/log/0", "Origin: " + origin + "\r\n").status == 403, origin);
  for (const std::string& origin : std::vector<std::string>{"http://127.0.0.1:" + port, "http://localhost:" + port})
    CHECK_MESSAGE(one.get("/log/0", "Origin: " + origin + "\r\n").status == 200, origin);
  const std::string own = "Origin: http://127.0.0.1:" + port + "\r\n", evil = "Origin: http://evil.example\r\n";
  for (const std::string& both : {own + evil, evil + own, evil + evil, own + own})
    CHECK_MESSAGE(one.get("/log/0", both).status == 403, both);
  CHECK(one.get("/log/0", "Host: localhost:" + port + "\r\n").status == 200);
}

TEST_CASE("serve: an allowed origin, and only that one, may read") {
  const TempFolder folder;
  const serve::ViewServer server(
      {"127.0.0.1", 0, {folder.write("a.mcap", "abc")}, "", {"https://app.example"}, nullptr});
  HttpResponse allowed = HttpClient(server.port()).get("/log/0", "Origin: https://app.example\r\n");
  CHECK(allowed.status == 200);
  CHECK(allowed.headers["access-control-allow-origin"] == "https://app.example");
  CHECK(allowed.headers.count("cross-origin-resource-policy") == 0);
  CHECK(HttpClient(server.port()).get("/log/0", "Origin: https://app.example.evil\r\n").status == 403);
  CHECK(HttpClient(server.port()).get("/log/0").headers.count("access-control-allow-origin") == 0);
}

TEST_CASE("serve: an origin that no page has is refused at the start") {
  for (const char* good :
       {"https://app.example", "http://localhost:8080", "http://[::1]:80", "app://page", "null", "file://"})
    CHECK_MESSAGE(serve::can_be_origin(good), good);
  for (const char* bad :
       {"", "app.example", "https://", "://app.example", "https://app.example/", "https://App.example",
        "https://app.example/x", "https://*.example", "https://a b", "https://me@app.example"})
    CHECK_MESSAGE(!serve::can_be_origin(bad), bad);
  const serve::ViewServerOptions options{"127.0.0.1", 0, {}, "", {"https://app.example/"}, nullptr};
  CHECK(error_of([&] { serve::ViewServer server(options); }) ==
        "--allow-origin https://app.example/: is the origin of no page: scheme://host[:port] is needed");
}

TEST_CASE("serve: a log has a number, no path reaches another file") {
  const OneLog one;
  one.folder.write("secret.txt", "secret");
  for (const std::string& target : std::vector<std::string>{"/log/1",
                                                            "/log/00",
                                                            "/log/",
                                                            "/log",
                                                            "/log/0/",
                                                            "/log/0/../0",
                                                            "/log/-1",
                                                            "/log/0x0",
                                                            "/../log/0",
                                                            "/log/../secret.txt",
                                                            "/..%2f..%2fetc/passwd",
                                                            "/%2e%2e/%2e%2e/etc/passwd",
                                                            "/../../../../etc/passwd",
                                                            "//etc/passwd",
                                                            "/etc/passwd",
                                                            "/log/0%00",
                                                            "/secret.txt",
                                                            "/index.html/../secret.txt",
                                                            "http://evil.example/log/0",
                                                            "*",
                                                            "/log/\\..\\secret.txt"}) {
    const HttpResponse response = one.get(target);
    CHECK_MESSAGE(response.status == 404, target);
    CHECK(response.body.find("secret") == std::string::npos);
    CHECK(response.body.find("root:") == std::string::npos);
  }
  CHECK(one.get("/log/0?x=1").body == one.text);  // a query means nothing
}

TEST_CASE("serve: ranges over the wire") {
  const OneLog one;
  const auto part = [&](const std::string& header) { return one.get("/log/0", range(header)); };
  HttpResponse first = part("bytes=0-0");
  CHECK(first.status == 206);
  CHECK(first.body == one.text.substr(0, 1));
  CHECK(first.headers["content-range"] == "bytes 0-0/1000");
  CHECK(part("bytes=999-999").body == one.text.substr(999));
  CHECK(part("bytes=990-2000").headers["content-range"] == "bytes 990-999/1000");
  CHECK(part("bytes=-10").body == one.text.substr(990));
  CHECK(part("bytes=100-").body == one.text.substr(100));
  for (const char* header : {"bytes=1000-", "bytes=5-4", "bytes=0-1,5-6", "bytes=-0", "bytes=x"}) {
    HttpResponse response = part(header);
    CHECK_MESSAGE(response.status == 416, header);
    CHECK(response.headers["content-range"] == "bytes */1000");
    CHECK(response.body.size() < 100);
  }
  CHECK(part("lines=1-2").status == 200);
  HttpResponse twice = one.get("/log/0", range("bytes=0-1") + range("bytes=2-3"));  // two headers: as none
  CHECK(twice.status == 200);
  CHECK(one.get("/log/0", range("bytes=0-1") + "If-Range: \"other\"\r\n").status == 200);
  CHECK(one.get("/log/0", range("bytes=0-1") + "If-Range: " + first.headers["etag"] + "\r\n").status == 206);
}

TEST_CASE("serve: offsets beyond 2^31 and 2^32") {
  const TempFolder folder;
  const std::string path = folder.path("large.mcap");
  const uint64_t bytes = (uint64_t(1) << 32) + 5000;
  const int fd = open(path.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
  REQUIRE(ftruncate(fd, off_t(bytes)) == 0);  // sparse
  const uint64_t places[] = {(uint64_t(1) << 31) - 3, (uint64_t(1) << 32) - 3, bytes - 6};
  for (const uint64_t place : places)
    REQUIRE(pwrite(fd, ("at " + std::to_string(place % 1000)).c_str(), 6, off_t(place)) == 6);
  close(fd);
  const serve::ViewServer server({"127.0.0.1", 0, {path}, "", {}, nullptr});
  for (const uint64_t place : places) {
    HttpResponse response =
        HttpClient(server.port())
            .get("/log/0", range("bytes=" + std::to_string(place) + "-" + std::to_string(place + 5)));
    CHECK(response.status == 206);
    CHECK(response.body == "at " + std::to_string(place % 1000));
    CHECK(response.headers["content-range"] ==
          "bytes " + std::to_string(place) + "-" + std::to_string(place + 5) + "/" + std::to_string(bytes));
  }
  CHECK(HttpClient(server.port()).get("/log/0", range("bytes=-6")).body == "at " + std::to_string((bytes - 6) % 1000));
  CHECK(HttpClient(server.port()).request("HEAD", "/log/0").headers["content-length"] == std::to_string(bytes));
  CHECK(nlohmann::json::parse(HttpClient(server.port()).get("/logs.json").body).at("logs")[0].at("bytes") ==
        std::to_string(bytes));
}

TEST_CASE("serve: other methods, bodies and text that is no HTTP are refused") {
  const OneLog one;
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "PROPFIND", "get"}) {
    HttpResponse response = one.client().request(method, "/log/0");
    CHECK_MESSAGE(response.status == 405, method);
    CHECK(response.headers["allow"] == "GET, HEAD");
  }
  for (const std::string& junk :
       {std::string("GET /log/0\r\n\r\n"), std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11),
        std::string(64, '\0'), std::string("GET / HTTP/9.9\r\n\r\n"), std::string("GET  /  HTTP/1.1\r\n\r\n"),
        "GET /" + std::string(20000, 'a') + " HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nX: " + std::string(20000, 'a') + "\r\n\r\n",
        "GET " + std::string(9000, '/') + "?" + std::string(9000, 'q') + " HTTP/1.1\r\n\r\n"}) {
    HttpClient client = one.client();
    client.send(junk);
    HttpResponse response = client.response();
    CHECK(response.status == 400);
    CHECK(response.headers["content-security-policy"].find("default-src 'self'") == 0);
    CHECK(response.headers["x-content-type-options"] == "nosniff");
    CHECK(response.headers["cross-origin-resource-policy"] == "same-origin");
    CHECK(response.headers["cache-control"] == "no-store");
    CHECK(client.take(1).empty());  // and the connection ends
  }
  HttpClient body = one.client();
  CHECK(body.request("POST", "/log/0", "Content-Length: 5\r\n").status != 200);
  HttpClient chunked = one.client();
  chunked.send("GET /log/0 HTTP/1.1\r\nHost: " + chunked.own_host() +
               "\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n");
  CHECK(chunked.response().status == 400);
  CHECK(one.get("/log/0").body == one.text);  // it still answers
}

TEST_CASE("serve: requests in one piece, byte by byte, and left halfway") {
  const OneLog one;
  HttpClient both = one.client();
  const std::string request = "GET /log/0 HTTP/1.1\r\nHost: " + both.own_host() + "\r\n\r\n";
  both.send(request + request);
  CHECK(both.response().body == one.text);
  CHECK(both.response().body == one.text);
  HttpClient slow = one.client();
  for (const char c : request) slow.send(std::string(1, c));
  CHECK(slow.response().body == one.text);
  for (std::size_t size = 0; size < request.size(); size += 7) {
    HttpClient left = one.client();
    left.send(std::string_view(request).substr(0, size));
  }
  HttpClient closing = one.client();
  CHECK(closing.get("/log/0", "Connection: close\r\n").body == one.text);
  CHECK(closing.take(1).empty());
}

TEST_CASE("serve: 1,000 silent connections keep nobody out") {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
  setrlimit(RLIMIT_NOFILE, &limit);
  REQUIRE(limit.rlim_cur >= 2048);
  const OneLog one;
  HttpClient early = one.client();
  CHECK(early.get("/log/0").body == one.text);
  std::vector<HttpClient> silent;
  for (int i = 0; i < 1000; ++i) {
    silent.push_back(one.client());
    if (i % 2) silent.back().send("GET /log/0 HTTP/1.1\r\nHost: ");  // a request that never ends
  }
  for (int i = 0; i < 20; ++i) CHECK(one.get("/log/0").body == one.text);
  // The oldest ones were closed for the new ones; the newest are still there.
  int64_t ended = 0;
  for (HttpClient& client : silent) {
    char byte;
    ended += recv(client.fd(), &byte, 1, MSG_DONTWAIT) == 0;
  }
  CHECK(ended >= int64_t(1000 - serve::kMostConnections));
  CHECK(ended < 1000);
  silent.back().send("127.0.0.1:" + std::to_string(one.server.port()) + "\r\n\r\n");
  CHECK(silent.back().response().body == one.text);
}

TEST_CASE("serve: connections that read nothing keep nobody out, and do not keep the server from ending") {
  std::vector<HttpClient> greedy;
  {
    const OneLog one(64 << 20);
    for (int i = 0; i < 100; ++i) {
      greedy.push_back(one.client());
      greedy.back().send("GET /log/0 HTTP/1.1\r\nHost: " + greedy.back().own_host() + "\r\n\r\n");
    }
    CHECK(one.get("/log/0", range("bytes=5-9")).body == one.text.substr(5, 5));
  }  // the server ends in the middle of 100 transfers
  for (HttpClient& client : greedy) {
    const HttpResponse response = client.response();
    CHECK(response.body.size() < (64 << 20));
  }
}

TEST_CASE("serve: a port that is taken is a sentence") {
  const OneLog one;
  const auto again = [&] { serve::ViewServer({"127.0.0.1", one.server.port(), {one.path}, "", {}, nullptr}); };
  CHECK(error_of(again) ==
        "port " + std::to_string(one.server.port()) + ": is taken by another program; choose another one");
  CHECK(error_of([&] {
          serve::ViewServer({"203.0.113.9", 0, {one.path}, "", {}, nullptr});
        }).find("cannot be bound") != std::string::npos);
  CHECK(error_of([&] {
          serve::ViewServer({"here", 0, {one.path}, "", {}, nullptr});
        }).find("is not an address") != std::string::npos);
}

TEST_CASE("serve: only 127.0.0.1 is bound") {
  const OneLog one;
  CHECK(HttpClient(one.server.port()).connected());
  std::vector<std::string> others = {"127.0.0.2"};
  ifaddrs* list = nullptr;
  REQUIRE(getifaddrs(&list) == 0);
  for (const ifaddrs* at = list; at; at = at->ifa_next) {
    if (!at->ifa_addr || at->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN];
    inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(at->ifa_addr)->sin_addr, text, sizeof text);
    if (text != std::string("127.0.0.1")) others.push_back(text);
  }
  freeifaddrs(list);
  for (const std::string& address : others)
    CHECK_FALSE_MESSAGE(HttpClient(one.server.port(), address.c_str()).connected(), address);
}

TEST_CASE("serve: bound to another address on purpose, it answers to that address, too") {
  const TempFolder folder;
  const serve::ViewServer server({"127.0.0.2", 0, {folder.write("a.mcap", "abc")}, "", {}, nullptr});
  const std::string port = std::to_string(server.port());
  CHECK(server.url() == "http://127.0.0.2:" + port + "/");
  const auto status = [&](const std::string& host) {
    return HttpClient(server.port(), "127.0.0.2").get("/log/0", "Host: " + host + ":" + port + "\r\n").status;
  };
  CHECK(status("127.0.0.2") == 200);
  CHECK(status("evil.example") == 403);
  CHECK_FALSE(HttpClient(server.port(), "127.0.0.1").connected());
}

TEST_CASE("serve: a log that is replaced while it is open has another tag, and the old one is refused") {
  const OneLog one;
  HttpResponse before = one.get("/log/0", range("bytes=0-9"));
  const std::string if_match = "If-Match: " + before.headers["etag"] + "\r\n";
  CHECK(one.get("/log/0", range("bytes=10-19") + if_match).status == 206);
  CHECK(one.get("/log/0", range("bytes=10-19") + "If-Match: \"x\", " + before.headers["etag"] + "\r\n").status == 206);
  CHECK(one.get("/log/0", "If-Match: *\r\n").status == 200);
  SUBCASE("another file of the same size") {
    one.folder.write("new.mcap", std::string(1000, 'n'));
    std::filesystem::rename(one.folder.path("new.mcap"), one.path);
  }
  SUBCASE("shorter") { REQUIRE(truncate(one.path.c_str(), 500) == 0); }
  SUBCASE("longer") { REQUIRE(truncate(one.path.c_str(), 1500) == 0); }
  SUBCASE("written anew") { one.folder.write("view.mcap", std::string(1000, 'n')); }
  const HttpResponse after = one.get("/log/0", range("bytes=10-19") + if_match);
  CHECK(after.status == 412);
  CHECK(after.body.find("has changed") != std::string::npos);
  HttpResponse fresh = one.get("/log/0");
  CHECK(fresh.status == 200);
  CHECK(fresh.headers["etag"] != before.headers["etag"]);
  CHECK(fresh.body == io::read_whole_file(one.path));
}

TEST_CASE("serve: a log that goes away, or becomes something else, is a sentence") {
  const OneLog one;
  std::filesystem::remove(one.path);
  CHECK(one.get("/log/0").status == 410);
  REQUIRE(mkfifo(one.path.c_str(), 0600) == 0);  // must not be waited for
  CHECK(one.get("/log/0").status == 410);
  std::filesystem::remove(one.path);
  std::filesystem::create_directory(one.path);
  CHECK(one.get("/log/0").status == 410);
  CHECK(nlohmann::json::parse(one.get("/logs.json").body).at("logs")[0].at("bytes") == "0");
  std::filesystem::remove(one.path);
  one.folder.write("view.mcap", "back");
  CHECK(one.get("/log/0").body == "back");
  one.folder.write("view.mcap", "");
  const HttpResponse empty = one.get("/log/0");
  CHECK(empty.status == 200);
  CHECK(empty.body.empty());
}

TEST_CASE("serve: a log that is cut during its transfer ends the connection, not the server") {
  const OneLog one(64 << 20);
  HttpClient client = one.client();
  client.send("GET /log/0 HTTP/1.1\r\nHost: " + client.own_host() + "\r\n\r\n");
  CHECK(client.take(1000).substr(0, 15) == "HTTP/1.1 200 OK");
  REQUIRE(truncate(one.path.c_str(), 1 << 20) == 0);
  const std::size_t rest = client.take(128 << 20).size();
  CHECK(rest < (64 << 20) - 1000);
  CHECK(one.get("/log/0").body == one.text.substr(0, 1 << 20));
}

TEST_CASE("serve: many clients at a time get their own bytes") {
  const OneLog one(3 << 20);
  std::atomic<int64_t> right = 0;
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 8; ++t)
    threads.emplace_back([&, t] {
      HttpClient client = one.client();
      for (std::size_t i = 0; i < 40; ++i) {
        const std::size_t first = (i * 7919 + t * 104729) % one.text.size(),
                          last = std::min(first + 60000, one.text.size() - 1);
        right += client.get("/log/0", range("bytes=" + std::to_string(first) + "-" + std::to_string(last))).body ==
                 one.text.substr(first, last + 1 - first);
      }
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(right == 320);
}

TEST_CASE("serve: a WebSocket without a live run is refused") {
  const OneLog one;
  const HttpResponse response =
      one.get("/",
              "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.websocket.v1\r\n");
  CHECK(response.status == 404);
  CHECK(response.body == "There is no live run here.\n");
}
