// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake view: serves logs and the viewer's pages to a browser on this machine, until Ctrl-C.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/io/error.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/text.h"
#include "tools/serve/view_server.h"
#include "tools/view/web/pages.h"

namespace overtake::cli {
namespace {

struct ViewOptions {
  std::vector<std::string> logs, allow_origins;
  std::string bind = "127.0.0.1", at;
  int32_t port = 0;
  bool no_open = false, insecure_bind = false;
};

constexpr std::size_t kMostLogs = 2;

void check_log(const std::string& path) {
  std::error_code code;
  if (std::filesystem::is_directory(path, code))
    throw io::Error(path, 0,
                    "is a folder; view shows MCAP files: those of overtake run --mcap, and recordings in MCAP");
  if (!std::filesystem::exists(path, code)) throw io::Error(path, 0, "no such file");
  io::refuse_special_file(path);
  if (std::filesystem::file_size(path, code) == 0) throw io::Error(path, 0, "is empty (0 bytes)");
  try {
    const io::McapReader is_mcap(path);
  } catch (const io::Error& error) {
    throw io::Error("", 0, std::string(error.what()) + "; overtake run RECORDING --mcap FILE writes a log for view");
  }
}

// Starts the desktop's browser, if there is a desktop. The page's address is printed anyway, so a failure is no error.
void open_browser(const std::string& url) {
  if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) return;
  posix_spawn_file_actions_t silent;
  posix_spawn_file_actions_init(&silent);
  for (const int fd : {0, 1, 2})
    posix_spawn_file_actions_addopen(&silent, fd, "/dev/null", fd == 0 ? O_RDONLY : O_WRONLY, 0);
  std::string program = "xdg-open", address = url;
  char* words[] = {program.data(), address.data(), nullptr};
  pid_t child = 0;
  posix_spawnp(&child, program.c_str(), &silent, nullptr, words, environ);
  posix_spawn_file_actions_destroy(&silent);
}

int view(const ViewOptions& options) {
  const std::string bind = options.bind == "localhost" ? "127.0.0.1" : options.bind;
  if (bind != "127.0.0.1" && !options.insecure_bind)
    throw io::Error("--bind " + options.bind, 0,
                    "lets everyone who reaches this address read the logs: say so with --insecure-bind");
  if (int64_t stamp_ns = 0; !options.at.empty() && (!io::parse_integer(options.at, stamp_ns) || stamp_ns < 0))
    throw io::Error("--at " + options.at, 0, "is not a frame's stamp in ns");
  for (const std::string& path : options.logs) check_log(path);
  if (pages().empty())
    throw io::Error("view", 0, "this overtake has no pages to show: it was built without node (tools/setup --node)");
  catch_interrupt();
  const serve::ViewServer server({bind, options.port, options.logs, options.at, options.allow_origins, nullptr});
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  if (!options.no_open) open_browser(server.url());
  while (!interrupted()) {
    usleep(100'000);
    while (waitpid(-1, nullptr, WNOHANG) > 0) {
    }  // the browser's starter
  }
  return kInterrupted;
}

void add_view_options(CLI::App& command, ViewOptions& options) {
  command.add_option("log", options.logs, "MCAP files: of overtake run --mcap, or recordings; two are shown together")
      ->required()
      ->expected(1, int(kMostLogs));
  command.add_option("--port", options.port, "default: a free one")->check(CLI::Range(1, 65535));
  command.add_flag("--no-open", options.no_open, "only prints the address of the page");
  command.add_option("--at", options.at, "STAMP: shows the frame of this stamp (ns)");
  command.add_option("--bind", options.bind, "ADDRESS: other than 127.0.0.1 only with --insecure-bind");
  command.add_flag("--insecure-bind", options.insecure_bind,
                   "lets everyone who reaches the address of --bind read the logs: there is no password");
  command.add_option("--allow-origin", options.allow_origins,
                     "ORIGIN (https://app.foxglove.dev): pages of this site may read the logs, too");
}

}  // namespace

Command view_command() {
  return make_command("view", "shows logs in a browser on this machine", kListed, add_view_options, view);
}

}  // namespace overtake::cli
