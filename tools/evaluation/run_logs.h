// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Contestants on logs, and the folder of their results:
//
//   OUT/runs/CONTESTANT/LOG/*.csv       the judge's tables (judge.h); CONTESTANT is its folder_name()
//   OUT/runs/CONTESTANT/LOG/about.json  what was run, by which build and with what (kept_runs.h); written last: without
//                                       it, or where that differs, a run is done again
//   OUT/metrics.json  OUT/report.html  OUT/*.csv    made from all the runs there are
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/evaluation/judge.h"

namespace overtake::evaluation {

struct RunOptions {
  std::vector<std::string> logs, presets;
  std::string out, sweep;  // "group.name=FROM:TO:STEP" or ""
  std::string rig,
      map;             // of recordings whose truth is the odometry of two cars; without rig: logs of overtake simulate
  int32_t every = 10;  // frames between two of the baselines and of the sweep
  int64_t most_frames = INT64_MAX;
  int32_t workers = 0;  // contestants at once; 0: one a CPU
  bool quiet = false;
  double progress_s = -1;  // seconds between two lines that say how far it is; negative: a bar on a terminal
};

// The contestant's name with + for each colon ("paper+clusters"): scp and rsync take a colon for the end of a host's
// name, and Windows allows none. Folders of earlier results with a colon are renamed by run_logs, and read as they are.
std::string folder_name(std::string contestant);
// The presets and the sweep's values of the first one. Throws io::Error where one of them cannot be run.
std::vector<std::string> contestant_names(const RunOptions& options);

// Throws io::Error. Returns false when interrupted: the logs done are kept.
bool run_logs(const RunOptions& options);

struct Run {
  std::string contestant, log;
  std::map<std::string, std::string> about;
  Tables tables;
  std::string folder = {};  // where it was read from
};
// All that are whole, by name. Throws io::Error: a folder without runs, or runs of two builds.
std::vector<Run> read_runs(const std::string& out);
// Copies the whole runs of `from` that `out` has not. Throws io::Error: a folder without runs, or two different runs of
// one contestant and log.
void merge_runs(const std::vector<std::string>& from, const std::string& out);
// {"group.name=1", "group.name=1.5", ...}. Throws io::Error where the text is no such range.
std::vector<std::string> sweep_values(const std::string& text);

}  // namespace overtake::evaluation
