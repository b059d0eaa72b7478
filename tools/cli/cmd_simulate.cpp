// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake simulate: simulates a scenario of tools/sim; writes its scans, ego poses and truth.
#include <chrono>
#include <cstdio>
#include <future>
#include <memory>
#include <string>

#include "tools/cli/cmd_simulate.h"
#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/sim/log_writer.h"
#include "tools/view/race_picture.h"

namespace overtake::cli {

int simulate(const SimulateOptions& options) {
  if (options.out.empty() && options.pictures.empty()) throw CLI::RequiredError("--out or --pictures");
  const bool is_mcap = sim::is_mcap_name(options.out, "--out " + options.out);
  io::OutputGuard guard(options.force);
  if (!sim::is_builtin_scenario(options.scenario)) guard.add_input(options.scenario);
  const auto simulator = sim::make_simulator(options.scenario, options.ego, options.pattern, options.seed,
                                             options.seconds, options.workers);
  if (!options.pictures.empty()) {
    const double at = options.picture_at >= 0 ? options.picture_at : simulator->seconds() / 2;
    if (at > simulator->seconds())
      throw io::Error("--picture-at " + fixed(at, 2), 0,
                      "is after the race, which lasts " + fixed(simulator->seconds(), 2) + " s");
    guard.add_folder(options.pictures);
    write_race_pictures(options.pictures, *simulator, at);
    guard.commit();
    if (!options.quiet) std::printf("%s: above.png front.png left.png right.png\n", options.pictures.c_str());
  }
  if (options.out.empty()) return 0;
  if (!is_mcap) guard.add_folder(options.out);
  auto log = is_mcap ? sim::make_mcap_log(options.out, *simulator, options.seed)
                     : sim::make_folder_log(options.out, *simulator, options.seed);
  catch_interrupt();
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(simulator->frame_count(), options.quiet);
  if (options.progress_s >= 0)
    progress.print_lines(simulator->scenario().name + " seed " + std::to_string(options.seed) + ": simulated",
                         options.progress_s);
  int64_t points = 0, beams = 0, split = 0;
  int32_t done = 0;
  std::future<void> writing;
  for (; done < simulator->frame_count() && !interrupted(); ++done) {
    auto frame = std::make_shared<const sim::SimFrame>(simulator->frame(done));
    if (writing.valid()) writing.get();  // one frame is written while the next one is simulated
    writing = std::async(std::launch::async, [&log, frame, done] { log->write(done, *frame); });
    for (const sim::Scan& scan : frame->scans)
      points += int64_t(scan.size()), beams += scan.beams, split += scan.split_beams;
    guard.keep();
    progress.show(done + 1);
  }
  if (writing.valid()) writing.get();
  const bool partial = done < simulator->frame_count();
  const std::string reason = partial ? "interrupted after " + std::to_string(done) + " of " +
                                           std::to_string(simulator->frame_count()) + " frames"
                                     : "";
  log->close(reason);
  progress.clear();
  if (partial) {
    guard.keep();
    std::fprintf(stderr, "overtake: %s; the results so far are kept as %s\n", reason.c_str(),
                 is_mcap ? (options.out + io::kPartSuffix).c_str()
                         : (options.out + ", its names end in " + io::kPartSuffix).c_str());
    return kInterrupted;
  }
  guard.commit();
  if (options.quiet) return 0;
  const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double share = 100.0 * double(split) / double(beams > 0 ? beams : 1);
  std::printf("%s, seed %llu: %s (%.1f s of race), %lld points of %lld beams, %.1f %% of them split; %.1f s on %s\n",
              simulator->scenario().name.c_str(), static_cast<unsigned long long>(options.seed),
              io::counted(done, "frame").c_str(), simulator->seconds(), static_cast<long long>(points),
              static_cast<long long>(beams), share, took, io::counted(simulator->worker_count(), "worker").c_str());
  std::printf("%s\n", options.out.c_str());
  return 0;
}

namespace {

void add_simulate_options(CLI::App& command, SimulateOptions& options) {
  command
      .add_option("scenario", options.scenario,
                  "Built-in scenario, or a TOML file (./NAME if it is named like a built-in one): " +
                      io::join(sim::builtin_scenario_names(), ", "))
      ->required();
  command.add_option("--out", options.out, "LOG.mcap, or a folder of PCD scans and tables");
  auto* pictures = command.add_option("--pictures", options.pictures,
                                      "folder for pictures of one moment: from above, and of each sensor's scan");
  command.add_option("--picture-at", options.picture_at, "the moment in seconds (default: half-way)")
      ->needs(pictures)
      ->check(in_range(0.0, 36000.0));
  command.add_option("--seed", options.seed, "seed of everything random")->check(whole_number())->capture_default_str();
  command.add_option("--seconds", options.seconds, "end earlier")->check(in_range(0.05, 36000.0));
  command.add_option("--ego", options.ego, "the car that carries the sensors");
  command.add_option("--pattern", options.pattern, "another distribution of the lines over the field of view")
      ->check(CLI::IsMember({"uniform", "gaussian", "horizon_dense"}));
  command.add_option("--workers", options.workers, "threads, 0: one per CPU; the result is the same")
      ->check(CLI::Range(0, 256));
  add_force_option(command, options.force);
  add_quiet_option(command, options.quiet);
  add_progress_option(command, options.progress_s);
}

}  // namespace

Command simulate_command() {
  return make_command("simulate", "drives a simulated race and writes its log", kListed, add_simulate_options,
                      simulate);
}

}  // namespace overtake::cli
