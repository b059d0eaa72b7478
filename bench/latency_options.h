// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// bench_latency's command line.
#pragma once

#include <string>

#include "bench/latency_run.h"

namespace overtake::bench {

struct LatencyOptions {
  ReplayDef input;
  LatencyRunDef run;
  bool json = false;      // print JSON instead of text
  std::string out, hgrm;  // files; empty: none
};

struct ParsedOptions {
  LatencyOptions options;
  bool run = false;  // false: print `text` and exit with `exit_code`
  int exit_code = 0;
  std::string text;  // help, or the error
};

ParsedOptions parse_latency_options(int argc, const char* const* argv);

}  // namespace overtake::bench
