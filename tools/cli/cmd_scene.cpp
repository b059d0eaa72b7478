// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake scene: removed. In this version it prints its replacement, `overtake simulate demo`, and runs that.
#include <cstdio>
#include <filesystem>

#include "tools/cli/cmd_simulate.h"
#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/io/error.h"
#include "tools/sim/scenario.h"

namespace overtake::cli {
namespace {

constexpr double kFrame_s = 0.05;

struct SceneOptions {
  std::string out;
  int32_t frames = 80;
  uint64_t seed = 1;
  bool force = false;
};

void add_scene_options(CLI::App& command, SceneOptions& options) {
  command.add_option("--out", options.out, "folder for the scans, made if needed")->required();
  command.add_option("--frames", options.frames, "number of frames, 50 ms each")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "seed of everything random")->check(whole_number())->capture_default_str();
  add_force_option(command, options.force);
}

int simulate_instead(const SceneOptions& options) {
  SimulateOptions simulated;
  simulated.scenario = "demo";
  simulated.out = options.out;
  if (std::filesystem::path(options.out).has_extension()) simulated.out += '/';  // marks it as a folder
  simulated.seconds = options.frames * kFrame_s;
  simulated.seed = options.seed;
  simulated.force = options.force;
  std::fprintf(stderr,
               "overtake: scene is gone and its name goes with the next version; use: overtake simulate demo "
               "--seconds %g --seed %llu --out %s\n",
               simulated.seconds, static_cast<unsigned long long>(options.seed), printable(options.out).c_str());
  const double longest_s = sim::load_scenario("demo").seconds;
  if (simulated.seconds > longest_s + kFrame_s / 2)
    throw io::Error("--frames " + std::to_string(options.frames), 0,
                    "the scenario demo has " + std::to_string(int32_t(longest_s / kFrame_s + 0.5)) +
                        " frames; overtake simulate --help lists longer ones");
  return simulate(simulated);
}

}  // namespace

Command scene_command() {
  return make_command("scene", "gone: overtake simulate demo does its work", kHidden, add_scene_options,
                      simulate_instead);
}

}  // namespace overtake::cli
