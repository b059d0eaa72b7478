// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "bench/latency_options.h"

#include <CLI/CLI.hpp>
#include <sstream>
#include <stdexcept>

#include "bench/measuring_thread.h"

namespace overtake::bench {
namespace {

constexpr int kBadUsage = 2;

std::string check_cpus(const std::string& text) {
  try {
    parse_cpus(text);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

}  // namespace

ParsedOptions parse_latency_options(int argc, const char* const* argv) {
  ParsedOptions parsed;
  LatencyOptions& o = parsed.options;
  o.input.rig = "av21";
  CLI::App app("Latency from the arrival of a frame's last scan to its tracks.", "bench_latency");
  std::string loop = "open", cpus;
  double deadline_us = 0;
  bool lock = false, huge = false, stream = false;

  auto* input =
      app.add_option("--input", o.input.recording, "recording instead of the demo scene, as for overtake run");
  app.add_option("--rig", o.input.rig, "its sensors")->needs(input)->capture_default_str();
  app.add_option("--map", o.input.map, "the recording's track map")->needs(input);
  app.add_option("--ego", o.input.ego, "the recording's ego poses")->needs(input);
  app.add_option("--seed", o.input.scene_seed, "seed of the demo scene")->capture_default_str();
  auto* loop_option =
      app.add_option("--loop", loop, "open: scans arrive by the clock; closed: each frame starts when the last is done")
          ->check(CLI::IsMember({"open", "closed"}))
          ->capture_default_str();
  auto* rate =
      app.add_option("--rate", o.run.rate_hz, "open loop: scans a second of each sensor; default as recorded (20)")
          ->check(CLI::Range(0.1, 10000.0));
  auto* stagger = app.add_option("--stagger-us", o.run.stagger_us, "open loop: sensor s arrives s times this later")
                      ->check(CLI::Range(0, 1000000));
  auto* stream_option =
      app.add_flag("--stream", stream, "open loop: the points of a scan come in pieces before its arrival");
  app.add_option("--pieces", o.run.pieces, "of a scan, with --stream; default 32")->check(CLI::Range(1, 100000));
  app.add_option("--preset", o.run.preset, "paper (default) or best");
  app.add_option("--cpus", cpus, "CPUs for all threads: \"2,3\", \"0-1\"; worker i is pinned to the i-th")
      ->check(check_cpus);
  app.add_option("--workers", o.run.workers, "1: no threads of the library; 0: one per CPU, at least two (default)")
      ->check(CLI::Range(0, 256));
  app.add_option("--parts", o.run.parts, "segment.parts: of a segmentation on several workers")
      ->check(CLI::Range(1, 4));
  app.add_option("--fifo", o.run.fifo_priority, "SCHED_FIFO of the library's threads; drivers run one step above")
      ->check(CLI::Range(0, 99));
  app.add_option("--spin-us", o.run.spin_us, "workers look for work this long before they sleep")
      ->check(CLI::Range(0, 1000000));
  app.add_option("--isa", o.run.isa, "force an instruction set (ref: the scalar reference)");
  app.add_flag("--cold", o.run.cold, "evict the caches of every CPU between two frames");
  app.add_flag("--lock", lock, "lock the library's memory");
  app.add_flag("--keep-images", o.run.keep_images, "frames keep every image for their readers");
  app.add_flag("--huge", huge, "huge pages for the library's memory");
  app.add_option("--deadline-us", deadline_us, "count frames later than this after their last push")
      ->check(CLI::Range(0.0, 1e9));
  app.add_option("--frames", o.run.frames, "frames measured")->check(CLI::Range(1, 200000))->capture_default_str();
  app.add_option("--warmup", o.run.warmup, "frames before these, reported separately")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  app.add_flag("--json", o.json, "print JSON instead of tables");
  app.add_option("--out", o.out, "write the JSON to this file");
  app.add_option("--hgrm", o.hgrm,
                 "write the end-to-end histogram (HdrHistogram percentiles, us) to this file, and the "
                 "noise beside it to FILE.noise");
  try {
    app.parse(argc, argv);
    for (const CLI::Option* open_only : {rate, stagger, stream_option})
      if (loop == "closed" && open_only->count() > 0)
        throw CLI::ValidationError(loop_option->get_name(), "closed excludes " + open_only->get_name() +
                                                                ": each frame starts when the last is done");
  } catch (const CLI::ParseError& error) {
    std::ostringstream text;
    parsed.exit_code = app.exit(error, text, text) == 0 ? 0 : kBadUsage;
    parsed.text = text.str();
    return parsed;
  }
  o.run.closed_loop = loop == "closed";
  if (!stream)
    o.run.pieces = 0;
  else if (o.run.pieces == 0)
    o.run.pieces = 32;
  if (!cpus.empty()) o.run.cpus = parse_cpus(cpus);
  o.run.deadline_ns = int64_t(deadline_us * 1000 + 0.5);
  o.run.memory = (lock ? int32_t(OVT_MEMORY_LOCK) : 0) | (huge ? int32_t(OVT_MEMORY_HUGE) : 0);
  parsed.run = true;
  return parsed;
}

}  // namespace overtake::bench
