// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line. commands.def lists the commands.
#include <cstdio>
#include <exception>
#include <new>

#include "tools/cli/command_line.h"
#include "tools/client/console.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"

int main(int argc, char** argv) {
  constexpr int kFailed = 1;
  try {
    const int code = overtake::cli::run_command_line(argc, argv);
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    std::fprintf(stderr, "overtake: the output could not be written\n");
    return kFailed;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "overtake: out of memory; --max-memory limits the memory for reading a file (now %s)\n",
                 overtake::io::format_size(overtake::io::memory_limit()).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "overtake: %s\n", overtake::cli::printable(error.what()).c_str());
  } catch (...) {
    std::fprintf(stderr, "overtake: an unknown error\n");
  }
  return kFailed;
}
