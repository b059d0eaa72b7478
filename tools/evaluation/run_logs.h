// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs variants on logs; the folder of their results:
//
//   OUT/runs/VARIANT/LOG/*.csv       the tables of the evaluator (evaluator.h); VARIANT is folder_name() of the variant
//   OUT/runs/VARIANT/LOG/about.json  the run's build and inputs (kept_runs.h); written last: without it, or if it
//                                    differs, the run is repeated
//   OUT/metrics.json  OUT/report.html  OUT/*.csv    made from all existing runs
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/evaluator.h"

namespace overtake::evaluation {

struct RunOptions {
  std::vector<std::string> logs, presets;
  std::vector<std::string> configs;  // files; read_configs gives their names
  std::string out, sweep;            // "group.name=FROM:TO:STEP" or ""
  std::string rig,
      map;             // for recordings with the odometry of two cars as truth; without rig: logs of overtake simulate
  int32_t every = 10;  // interval in frames of the baselines and of the sweep
  int32_t compare_every = 1;  // interval of the frames that are compared with the truth; the pipeline gets all frames
  bool only_figures = false;  // no baselines, times or pictures: the fastest way to the figures
  int64_t most_frames = INT64_MAX;
  // A piece of each log (pieces.h): its frames from here until before there, after the frames of the warm-up.
  double from_s = 0, to_s = -1, warm_up_s = 10;  // seconds after the first scan; to_s negative: until the end
  int32_t workers = 0;                           // variants at once; 0: one per CPU
  bool quiet = false;
  double progress_s = -1;  // seconds between two progress lines; negative: a bar on a terminal
};

// The variant's name with + instead of each colon ("paper+clusters"): scp and rsync read a colon as the end of a host's
// name, and Windows forbids it. run_logs renames folders of earlier results with a colon; reading accepts them.
std::string folder_name(std::string variant);
// The configurations by their names, those of the files without ".toml". Throws io::Error for a name that two files or
// a preset have, or that a variant's name cannot contain.
std::map<std::string, std::string> read_configs(const std::vector<std::string>& files);
// The presets and configurations, and the first one's sweep values. Throws io::Error if one of them cannot run.
std::vector<std::string> variants_to_run(const RunOptions& options);

// Throws io::Error. Returns false when interrupted: finished logs are kept. `damages` gets a sentence for each damaged
// log, also for one that was done before: its results are from the part before the damage.
bool run_logs(const RunOptions& options, std::vector<std::string>* damages = nullptr);

struct Run {
  std::string variant, log;
  std::map<std::string, std::string> about;
  Tables tables;
  std::string folder = {};  // the folder it was read from
};
// All finished runs (with about.json), by name. Throws io::Error for a folder without runs, for runs of two builds, and
// for a run whose tables are not whole (read_tables).
std::vector<Run> read_runs(const std::string& out);
// Copies the finished runs of `from` that are missing in `out`, and joins the pieces of a log (pieces.h). An equal run
// is kept: every table but `times` is equal, and about.json without what depends on files and machines.
// Throws io::Error for two different runs of one variant and log, and as read_runs does.
void merge_runs(const std::vector<std::string>& from, const std::string& out);
// {"group.name=1", "group.name=1.5", ...}. Throws io::Error for an invalid range.
std::vector<std::string> sweep_values(const std::string& text);

}  // namespace overtake::evaluation
