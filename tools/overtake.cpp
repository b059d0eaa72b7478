// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line: overtake run | inspect | track | info | doctor | scene | simulate | evaluate | merge |
// label | params.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "tools/cmd_evaluate.h"
#include "tools/cmd_label.h"
#include "tools/cmd_scene.h"
#include "tools/cmd_simulate.h"
#include "tools/commands.h"
#include "tools/io/rig.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

constexpr int kFailed = 1, kBadUsage = 2;
constexpr const char* kInputText =
    "folder of scans (FRAME_SENSOR.pcd, FRAME.pcd, KITTI's .bin) or one such file; rosbag2 folder or .db3; MCAP";

std::string version_text() {
  ovt_build_info build;
  ovt_read_build_info(&build);
  return "overtake " + std::string(build.version_text) + "\ncommit   " + build.commit + "\ncompiler " + build.compiler +
         "\nISAs     " + build.isas;
}

// map_default: what is taken without --map.
void add_common(CLI::App& command, Options& options, const std::string& map_default = "none") {
  command.add_option("--preset", options.preset, "parameters to start from (paper)");
  command.add_option("--set", options.set, "key=value: one parameter (overtake params lists them); may be repeated")
      ->expected(1)
      ->take_all();
  command.add_option("--config", options.config,
                     "TOML file: parameters, rig, map, ego (every result has one beside it)");
  command.add_option(
      "--map", options.map,
      "track map: centre line with widths, or two bounds FILE1,FILE2; none: without (default: " + map_default + ")");
  command.add_option("--out", options.out, "folder for the results, made if needed")->required();
  add_force_option(command, options.force);
  command.add_flag("--quiet", options.quiet, "print nothing but errors");
}

void add_detector(CLI::App& command, Options& options) {
  command.add_option("input", options.input, kInputText)->required();
  command.add_option("--rig", options.rig,
                     "sensors: a TOML file, or " + io::join(io::builtin_rig_names(), ", ") +
                         " (default: the rig that an MCAP log holds, if any)");
  command.add_option("--urdf", options.urdf,
                     "FILE[,LINK]: mounting of the rig's sensors from a URDF, as seen from LINK (default: its root)");
  command.add_option("--isa", options.isa, "force an instruction set (ref: the scalar truth)");
}

int run_main(int argc, char** argv) {
  CLI::App app("Sees and tracks other cars with LiDAR.", "overtake");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text);
  Options options;

  CLI::App& run = *app.add_subcommand("run", "detects and tracks on a recording");
  add_detector(run, options);
  add_common(run, options, "the map that an MCAP log holds, if any");
  run.add_option("--ego", options.ego,
                 "CSV of ego poses: stamp_ns,x_m,y_m[,z_m][,roll_rad,pitch_rad],yaw_rad,speed_mps[,yaw_rate_rps] "
                 "(default: the recording's own, if any); none: without");
  run.add_option("--mcap", options.mcap,
                 "also writes what the pipeline saw, to open in Foxglove: clouds with labels, "
                 "images, candidates, tracks, map, times, counters");
  run.add_option("--workers", options.workers, "threads; 1: none but the main one (default), 0: one per CPU")
      ->check(CLI::Range(0, 256));
  run.add_option("--trace", options.trace,
                 "FILE: every stage of every frame on its thread, as Chrome trace JSON (ui.perfetto.dev)");

  CLI::App& inspect = *app.add_subcommand("inspect", "writes every image of one scan as NPY and PNG");
  add_detector(inspect, options);
  add_common(inspect, options);
  inspect.add_option("--frame", options.frame,
                     "the number in the scan's file name (may be left out where there is one frame)");
  inspect.add_option("--sensor", options.sensor, "sensor of the rig (may be left out where it has one)");

  CLI::App& track = *app.add_subcommand("track", "the tracker alone on detections");
  track
      .add_option("input", options.input,
                  "CSV: stamp_ns,x_m,y_m[,heading_rad][,var_x,var_y[,cov_xy]] in the map frame; rows of one stamp are "
                  "one scan, a row without x and y is an empty scan")
      ->required();
  add_common(track, options);
  track.add_option("--ego", options.ego, "CSV of ego poses");

  CLI::App& info = *app.add_subcommand("info", "says what a recording holds");
  info.add_option("input", options.input, kInputText)->required();

  CLI::App& doctor = *app.add_subcommand("doctor", "says what is wrong with a recording for a rig, and what to do");
  add_detector(doctor, options);
  doctor.add_option("--config", options.config, "TOML file with the rig");
  doctor.add_option("--ego", options.ego, "CSV of ego poses, as for run");

  add_scene_command(app);
  add_simulate_command(app);
  add_evaluate_command(app);
  add_merge_command(app);
  add_label_command(app);
  CLI::App& params = *app.add_subcommand("params", "lists the parameters");

  try {
    app.parse(argc, argv);
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();  // of a command: it has said why
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadUsage;
  }
  if (params.parsed()) {
    std::fputs(list_params().c_str(), stdout);
    return 0;
  }
  if (run.parsed()) return options.command = "run", run_command(options);
  if (inspect.parsed()) return options.command = "inspect", inspect_command(options);
  if (info.parsed()) return options.command = "info", info_command(options);
  if (doctor.parsed()) return options.command = "doctor", doctor_command(options);
  if (track.parsed()) return options.command = "track", track_command(options);
  return 0;  // scene, simulate, evaluate, merge and label have done their work while they were parsed
}

}  // namespace
}  // namespace overtake::cli

int main(int argc, char** argv) {
  try {
    return overtake::cli::run_main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "overtake: %s\n", error.what());
  } catch (...) {
    std::fprintf(stderr, "overtake: an unknown error\n");
  }
  return overtake::cli::kFailed;
}
