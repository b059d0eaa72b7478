// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cmd_simulate.h"

#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <chrono>
#include <cstdio>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>

#include "tools/console.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/race_picture.h"
#include "tools/sim/race_log.h"

namespace overtake::cli {
namespace {

struct SimulateOptions {
  std::string scenario, out, ego, pattern, pictures;
  double seconds = 0, picture_at = -1, progress_s = -1;
  uint64_t seed = 1;
  int32_t workers = 0;
  bool quiet = false;
};

bool ends_with(const std::string& text, const std::string& tail) {
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

void simulate(const SimulateOptions& options) {
  sim::Scenario scenario = sim::load_scenario(options.scenario);
  if (!options.ego.empty()) {
    if (scenario.find_car(options.ego) < 0)
      throw io::Error(options.scenario, 0, "no car is named '" + options.ego + "'");
    scenario.ego = options.ego;
  }
  if (!options.pattern.empty())
    for (sim::PatternChange& change : scenario.patterns) change.pattern.kind = sim::pattern_kind(options.pattern);
  std::unique_ptr<sim::Simulator> simulator;
  try {
    simulator = std::make_unique<sim::Simulator>(scenario, options.seed, options.seconds, options.workers);
  } catch (const std::invalid_argument& error) {
    throw io::Error(options.scenario, 0, error.what());
  }
  if (!options.pictures.empty()) {
    const double at = options.picture_at >= 0 ? options.picture_at : simulator->seconds() / 2;
    write_race_pictures(options.pictures, *simulator, at);
    if (!options.quiet) std::printf("%s: above.png front.png left.png right.png\n", options.pictures.c_str());
  }
  if (options.out.empty()) return;
  auto log = ends_with(options.out, ".mcap") ? sim::make_mcap_log(options.out, *simulator, options.seed)
                                             : sim::make_folder_log(options.out, *simulator, options.seed);
  catch_interrupt();
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(simulator->sweep_count(), options.quiet);
  if (options.progress_s >= 0)
    progress.print_lines(scenario.name + " seed " + std::to_string(options.seed) + ": simulated", options.progress_s);
  int64_t points = 0, beams = 0, split = 0;
  int32_t done = 0;
  std::future<void> writing;
  for (; done < simulator->sweep_count() && !interrupted(); ++done) {
    auto sweep = std::make_shared<const sim::Sweep>(simulator->sweep(done));
    if (writing.valid()) writing.get();  // one sweep is written while the next one is simulated
    writing = std::async(std::launch::async, [&log, sweep, done] { log->write(done, *sweep); });
    for (const sim::Scan& scan : sweep->scans)
      points += int64_t(scan.size()), beams += scan.beams, split += scan.split_beams;
    progress.show(done + 1);
  }
  if (writing.valid()) writing.get();
  log->close();
  progress.clear();
  if (options.quiet) return;
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double share = 100.0 * double(split) / double(beams > 0 ? beams : 1);
  std::printf("%s, seed %llu: %s (%.1f s of race), %lld points of %lld beams, %.1f %% of them split; %.1f s on %s\n",
              scenario.name.c_str(), static_cast<unsigned long long>(options.seed), io::counted(done, "sweep").c_str(),
              simulator->seconds(), static_cast<long long>(points), static_cast<long long>(beams), share, took,
              io::counted(simulator->worker_count(), "worker").c_str());
  std::printf("%s\n", options.out.c_str());
}

}  // namespace

CLI::App& add_simulate_command(CLI::App& app) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App& command = *app.add_subcommand("simulate", "drives a simulated race and writes its log");
  command
      .add_option("scenario", options->scenario,
                  "TOML file, or one that is built in: " + io::join(sim::builtin_scenario_names(), ", "))
      ->required();
  auto* out = command.add_option("--out", options->out, "LOG.mcap, or a folder of PCD scans and tables");
  auto* pictures = command.add_option("--pictures", options->pictures,
                                      "folder for pictures of one moment: from above, and of each sensor's scan");
  command.add_option("--picture-at", options->picture_at, "the moment in seconds (default: half-way)")
      ->needs(pictures)
      ->check(CLI::Range(0.0, 36000.0));
  command.add_option("--seed", options->seed, "seed of everything random")->capture_default_str();
  command.add_option("--seconds", options->seconds, "end earlier")->check(CLI::Range(0.05, 36000.0));
  command.add_option("--ego", options->ego, "the car that carries the sensors");
  command.add_option("--pattern", options->pattern, "another distribution of the lines over the field of view")
      ->check(CLI::IsMember({"uniform", "gaussian", "horizon_dense"}));
  command.add_option("--workers", options->workers, "threads, 0: one per CPU; the result is the same")
      ->check(CLI::Range(0, 256));
  command.add_flag("--quiet", options->quiet, "print nothing but errors");
  command
      .add_option("--progress", options->progress_s, "a line every so many seconds instead of the bar, quiet or not")
      ->check(CLI::Range(0.0, 36000.0));
  command.callback([options, out, pictures] {
    if (out->count() + pictures->count() == 0) throw CLI::RequiredError("--out or --pictures");
    simulate(*options);
  });
  return command;
}

}  // namespace overtake::cli
