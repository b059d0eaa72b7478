// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/serve/view_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "pipeline/overtake.h"
#include "tools/io/error.h"
#include "tools/io/json_text.h"
#include "tools/io/text.h"
#include "tools/view/web/pages.h"

namespace overtake::serve {
namespace {

constexpr const char* kNoPages =
    "This overtake was built without the pages of its viewer (tools/setup --node, then build again).\n"
    "Foxglove and Lichtblick open its logs and connect to its live runs.\n";

Response text_response(int32_t status, std::string text) {
  Response response;
  response.status = status;
  response.body = std::move(text);
  return response;
}

// The whole text as a number; nothing for signs, blanks, or more than 64 bits.
std::optional<uint64_t> parse_digits(std::string_view text) {
  uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

struct OpenLog {
  std::shared_ptr<const File> file;
  uint64_t bytes = 0;
  std::string etag;
};

// Nothing: the file is gone, or is no regular file any more.
std::optional<OpenLog> open_log(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return std::nullopt;
  OpenLog log{std::make_shared<const File>(fd), 0, ""};
  struct stat status;
  if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  log.bytes = uint64_t(status.st_size);
  char tag[96];
  std::snprintf(tag, sizeof tag, "\"%llx-%llx.%lx-%llx\"", static_cast<unsigned long long>(status.st_size),
                static_cast<unsigned long long>(status.st_mtim.tv_sec),
                static_cast<unsigned long>(status.st_mtim.tv_nsec), static_cast<unsigned long long>(status.st_ino));
  log.etag = tag;
  return log;
}

// Whether an If-Match header, a list of tags, has the tag.
bool matches(std::string_view if_match, const std::string& etag) {
  while (!if_match.empty()) {
    const auto comma = if_match.find(',');
    const std::string_view tag = io::trim(if_match.substr(0, comma));
    if (tag == "*" || tag == etag) return true;
    if_match.remove_prefix(comma == std::string_view::npos ? if_match.size() : comma + 1);
  }
  return false;
}

bool is_numeric_address(const std::string& host) {
  unsigned char bytes[16];
  if (host.size() > 2 && host.front() == '[' && host.back() == ']')
    return inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), bytes) == 1;
  return inet_pton(AF_INET, host.c_str(), bytes) == 1;
}

}  // namespace

std::string machine_name() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return name;
}

std::optional<ByteRange> parse_range(std::string_view header, uint64_t bytes) {
  constexpr std::string_view kUnit = "bytes=";
  if (!header.starts_with(kUnit)) return std::nullopt;
  header.remove_prefix(kUnit.size());
  const auto dash = header.find('-');
  if (dash == std::string_view::npos) return ByteRange{};
  const std::string_view before = header.substr(0, dash), after = header.substr(dash + 1);
  const auto first = parse_digits(before), last = parse_digits(after);
  if (before.empty()) {  // the last n bytes
    if (!last || *last == 0 || bytes == 0) return ByteRange{};
    const uint64_t size = std::min(*last, bytes);
    return ByteRange{bytes - size, size};
  }
  if (!first || (!after.empty() && !last) || *first >= bytes || (last && *last < *first)) return ByteRange{};
  const uint64_t end = last ? std::min(*last, bytes - 1) : bytes - 1;
  return ByteRange{*first, end - *first + 1};
}

bool is_own_host(std::string_view host, int32_t port, bool open, const std::string& machine) {
  std::string name(host);
  const std::string suffix = ":" + std::to_string(port);
  if (name.ends_with(suffix))
    name.resize(name.size() - suffix.size());
  else if (port != 80)
    return false;
  name = io::lower_case(name);
  if (name == "localhost" || name == "127.0.0.1") return true;
  return open && (is_numeric_address(name) || (!name.empty() && name == io::lower_case(machine)));
}

bool can_be_origin(std::string_view origin) {
  if (origin == "null" || origin == "file://") return true;  // of pages from files
  const std::size_t end = origin.find("://");
  if (end == 0 || end == std::string_view::npos || io::lower_case(origin) != origin) return false;
  const std::string_view host = origin.substr(end + 3);
  return !host.empty() && host.find_first_of("/?#@ \\*") == std::string_view::npos;
}

ViewServer::ViewServer(const ViewServerOptions& options) : options_(options) {
  for (const std::string& origin : options_.allow_origins)
    if (!can_be_origin(origin))
      throw io::Error("--allow-origin " + origin, 0, "is the origin of no page: scheme://host[:port] is needed");
  server_ = std::make_unique<HttpServer>(options_.address, options_.port, *this, options_.most_silence);
  server_->start();
}

bool ViewServer::is_open() const { return options_.address != "127.0.0.1"; }

std::string ViewServer::url() const {
  const bool v6 = options_.address.find(':') != std::string::npos;
  return "http://" + (v6 ? "[" + options_.address + "]" : options_.address) + ":" + std::to_string(port()) + "/" +
         (options_.at.empty() ? "" : "#at=" + options_.at);
}

std::optional<Response> ViewServer::refuse(const Request& request) const {
  if (!is_own_host(request.host, port(), is_open()))
    return text_response(403, "This server answers to localhost and 127.0.0.1 only.\n");
  if (request.origin.empty()) return std::nullopt;
  constexpr std::string_view kScheme = "http://";
  const bool own =
      request.origin.starts_with(kScheme) && is_own_host(request.origin.substr(kScheme.size()), port(), is_open());
  const auto& allowed = options_.allow_origins;
  if (own || std::find(allowed.begin(), allowed.end(), request.origin) != allowed.end()) return std::nullopt;
  return text_response(403, "Pages of other sites may not read this server (--allow-origin).\n");
}

void ViewServer::add_headers(const Request& request, Response& response) const {
  const std::string own = std::to_string(port());
  const auto& allowed = options_.allow_origins;
  const auto add = [&](const char* name, std::string value) { response.headers.emplace_back(name, std::move(value)); };
  add("Content-Security-Policy",
      "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; worker-src 'self'; "
      "img-src 'self' data: blob:; connect-src 'self' data: ws://127.0.0.1:" +
          own + " ws://localhost:" + own + "; object-src 'none'; base-uri 'none'; form-action 'none'; " +
          "frame-ancestors 'none'");
  add("X-Content-Type-Options", "nosniff");
  add("Referrer-Policy", "no-referrer");
  add("Cross-Origin-Opener-Policy", "same-origin");
  if (std::find(allowed.begin(), allowed.end(), request.origin) != allowed.end()) {
    add("Access-Control-Allow-Origin", std::string(request.origin));
    add("Access-Control-Expose-Headers", "ETag, Content-Range, Accept-Ranges");
    add("Vary", "Origin");
  } else {
    add("Cross-Origin-Resource-Policy", "same-origin");
  }
  const bool any = std::any_of(response.headers.begin(), response.headers.end(),
                               [](const auto& header) { return header.first == "Cache-Control"; });
  if (!any) add("Cache-Control", "no-store");
}

Response ViewServer::respond(const Request& request) {
  auto refusal = refuse(request);
  Response response = refusal ? std::move(*refusal) : route(request);
  add_headers(request, response);
  return response;
}

Response ViewServer::explain(int32_t status, const std::string& text) {
  Response response = text_response(status, text);
  add_headers({}, response);
  return response;
}

Response ViewServer::route(const Request& request) const {
  if (request.method != "GET" && request.method != "HEAD") {
    Response response = text_response(405, "Only GET and HEAD.\n");
    response.headers.emplace_back("Allow", "GET, HEAD");
    return response;
  }
  if (request.path == "/logs.json") return list_logs();
  for (std::size_t i = 0; i < options_.logs.size(); ++i)
    if (request.path == "/log/" + std::to_string(i)) return serve_log(request, options_.logs[i]);
  const std::string_view path = request.path == "/" ? "/index.html" : request.path;
  for (const cli::Page& page : cli::pages()) {
    if (path != page.path) continue;
    Response response;
    response.type = page.mime;
    response.body.assign(reinterpret_cast<const char*>(page.gzip), page.size);
    response.headers = {{"Content-Encoding", "gzip"}};
    return response;
  }
  if (path == "/index.html") return text_response(404, kNoPages);
  return text_response(404, "There is no such page.\n");
}

Response ViewServer::list_logs() const {
  nlohmann::ordered_json logs = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < options_.logs.size(); ++i) {
    const auto log = open_log(options_.logs[i]);
    logs.push_back({{"url", "/log/" + std::to_string(i)},
                    {"name", std::filesystem::path(options_.logs[i]).filename().string()},
                    {"bytes", log ? std::to_string(log->bytes) : "0"},
                    {"etag", log ? log->etag : ""}});
  }
  ovt_build_info build;
  ovt_read_build_info(&build);
  nlohmann::ordered_json all = {{"version", build.version_text}, {"live", options_.live != nullptr}};
  all["at"] = options_.at.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(options_.at);
  all["logs"] = logs;
  Response response;
  response.type = "application/json";
  response.body = io::dump_json(all);
  return response;
}

Response ViewServer::serve_log(const Request& request, const std::string& path) const {
  const auto log = open_log(path);
  if (!log) return text_response(410, "This log is gone.\n");
  if (!request.if_match.empty() && !matches(request.if_match, log->etag))
    return text_response(412, "This log has changed since it was opened.\n");
  Response response;
  response.type = "application/octet-stream";
  response.headers = {{"ETag", log->etag}, {"Accept-Ranges", "bytes"}};
  std::optional<ByteRange> range;
  if (!request.is_head() && (request.if_range.empty() || request.if_range == log->etag))
    range = parse_range(request.range, log->bytes);
  if (range && range->size == 0) {
    response = text_response(416, "There are no such bytes in this log; one range a request.\n");
    response.headers = {{"Content-Range", "bytes */" + std::to_string(log->bytes)}};
    return response;
  }
  response.part = FilePart{log->file, range ? range->first : 0, range ? range->size : log->bytes};
  if (range) {
    response.status = 206;
    response.headers.emplace_back("Content-Range", "bytes " + std::to_string(range->first) + "-" +
                                                       std::to_string(range->first + range->size - 1) + "/" +
                                                       std::to_string(log->bytes));
  }
  return response;
}

std::shared_ptr<SocketClient> ViewServer::accept(const Request& request, const std::vector<std::string>& protocols,
                                                 std::function<void()> wake, std::string& chosen, Response& refusal) {
  if (auto refused = refuse(request))
    refusal = std::move(*refused);
  else if (!options_.live || request.path != "/")
    refusal = text_response(404, "There is no live run here.\n");
  else if (auto client = options_.live->accept(protocols, std::move(wake), chosen, refusal))
    return client;
  add_headers(request, refusal);
  return nullptr;
}

}  // namespace overtake::serve
