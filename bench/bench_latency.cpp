// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Latency from the arrival of a frame's last scan to its tracks, and the delay of an idle thread on the same machine,
// measured in the same run.
#include <cstdio>
#include <exception>

#include "bench/latency_options.h"
#include "bench/latency_report.h"
#include "tools/io/text.h"

namespace overtake::bench {
namespace {

constexpr int kFailed = 1;

int run_main(int argc, char** argv) {
  const ParsedOptions parsed = parse_latency_options(argc, argv);
  if (!parsed.run) {
    std::fputs(parsed.text.c_str(), parsed.exit_code ? stderr : stdout);
    return parsed.exit_code;
  }
  const LatencyOptions& options = parsed.options;
  const EnvironmentSheet environment = read_environment(options.run.cpus.empty() ? 0 : options.run.cpus[0]);
  const LatencyInput input(options.input);
  const LatencyRun run = run_latency(input, options.run);
  const LatencyReport report = make_report(run, options.run);
  const std::string json = format_json(report, run, options.run, input.source(), environment);
  if (!options.out.empty()) io::write_whole_file(options.out, json);
  if (!options.hgrm.empty()) {
    io::write_whole_file(options.hgrm, report.end_to_end.format_hgrm(1000));
    io::write_whole_file(options.hgrm + ".noise", report.noise.format_hgrm(1000));
  }
  std::fputs(options.json ? json.c_str() : format_text(report, run, options.run, input.source(), environment).c_str(),
             stdout);
  return report.end_to_end.count() > 0 ? 0 : kFailed;
}

}  // namespace
}  // namespace overtake::bench

int main(int argc, char** argv) {
  try {
    return overtake::bench::run_main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_latency: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "bench_latency: an unknown error\n");
  }
  return overtake::bench::kFailed;
}
