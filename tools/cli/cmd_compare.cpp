// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake compare: two runs of one recording, without truth; or the results of several evaluations.
#include <cstdio>
#include <filesystem>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/compare_runs.h"
#include "tools/cli/report_json.h"
#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/evaluation/differences.h"
#include "tools/io/angles.h"
#include "tools/io/error.h"

namespace overtake::cli {
namespace {

struct CompareOptions {
  std::string a, b, map;
  std::vector<std::string> more;  // further evaluations
  bool json = false;
};

void add_compare_options(CLI::App& command, CompareOptions& options) {
  command.add_option("run_a", options.a, "folder of overtake run, or result of overtake evaluate")->required();
  command.add_option("run_b", options.b, "the same for another run on this recording, or another result of evaluate")
      ->required();
  command.add_option("more", options.more, "further results of evaluate");
  add_map_option(command, options.map, "none", "; prints where on it the tracks are that only one run has");
  add_json_option(command, options.json);
}

std::string share_of(int64_t part, int64_t whole) {
  return std::to_string(part) + (whole > 0 ? " (" + fixed(100.0 * double(part) / double(whole), 1) + " %)" : "");
}

std::string sizes_of(const metrics::Summary& s, double scale, const char* unit) {
  if (s.count == 0) return "-";
  return fixed(s.median * scale, 3) + ", " + fixed(s.p95 * scale, 3) + ", " + fixed(s.most * scale, 3) + " " + unit;
}

void print_lone_tracks(const char* name, const RunCounts& run, bool on_map) {
  constexpr std::size_t kMost = 40;
  std::printf("\nConfirmed tracks that only %s has: %zu\n", name, run.lone_tracks.size());
  if (run.lone_tracks.empty()) return;
  std::vector<std::string> header = {"track", "from s", "for s",   "frames", "in both",
                                     "x m",   "y m",    "ahead m", "left m"};
  if (on_map) header.insert(header.end(), {"map s m", "map d m"});
  TextTable table(header);
  for (const LoneTrack& t : run.lone_tracks) {
    std::vector<std::string> row = {track_name(t.id),         fixed(t.from_s, 2),        fixed(t.duration_s, 2),
                                    std::to_string(t.frames), std::to_string(t.matched), fixed(t.x_m, 1),
                                    fixed(t.y_m, 1),          fixed(t.ahead_m, 1),       fixed(t.left_m, 1)};
    if (on_map) row.insert(row.end(), {fixed(t.s_m, 1), fixed(t.d_m, 1)});
    table.add(row);
  }
  std::fputs(table.format(kMost).c_str(), stdout);
}

bool is_evaluation(const std::string& path) { return std::filesystem::exists(path + "/metrics.json"); }

int compare_evaluations(const CompareOptions& options) {
  std::vector<std::string> paths = {options.a, options.b};
  paths.insert(paths.end(), options.more.begin(), options.more.end());
  for (const std::string& path : paths)
    if (!is_evaluation(path)) throw io::Error(path, 0, "is no result of overtake evaluate: it has no metrics.json");
  if (!options.map.empty()) throw io::Error("--map", 0, "is for two folders of overtake run");
  const std::vector<evaluation::Run> runs = evaluation::read_results(paths);
  const evaluation::Differences found = evaluation::find_differences(runs, runs.empty() ? "" : runs[0].variant);
  if (found.logs == 0) throw io::Error(options.a, 0, "has no log that all the others have, too, with the same truth");
  if (options.json)
    std::printf("%s\n", evaluation::json_text(found).c_str());
  else
    evaluation::print_differences(found);
  return 0;
}

int compare(const CompareOptions& options) {
  if (is_evaluation(options.a) || !options.more.empty()) return compare_evaluations(options);
  if (is_evaluation(options.b) && !std::filesystem::exists(options.b + "/detections.csv"))
    throw io::Error(options.b, 0, "is a result of overtake evaluate, and " + options.a + " is none: compare two alike");
  const RunTables a = read_run(options.a), b = read_run(options.b);
  RunComparison found = compare_runs(a, b);
  const bool on_map = !options.map.empty() && options.map != "none";
  if (on_map) place_on_map(found, options.map);
  if (options.json) {
    std::fputs(compare_json(options.a, options.b, found).c_str(), stdout);
    return 0;
  }
  TextTable table({"", "A", "B"});
  const auto add = [&](const char* what, int64_t RunCounts::*count) {
    table.add({what, std::to_string(found.a.*count), std::to_string(found.b.*count)});
  };
  add("detections", &RunCounts::detections);
  add("frames with a detection", &RunCounts::frames_with_detections);
  table.add({"detections without one of the other within 2 m", share_of(found.a.lone_detections, found.a.detections),
             share_of(found.b.lone_detections, found.b.detections)});
  add("tracks", &RunCounts::tracks);
  add("confirmed tracks", &RunCounts::confirmed_tracks);
  add("rows of confirmed tracks", &RunCounts::confirmed_rows);
  table.add({"rows without one of the other within 2 m", share_of(found.a.lone_rows, found.a.confirmed_rows),
             share_of(found.b.lone_rows, found.b.confirmed_rows)});
  std::printf("A: %s\nB: %s\n\n%s\n", printable(options.a).c_str(), printable(options.b).c_str(),
              table.format().c_str());
  if (found.by_vehicle) {
    const bool a_in_map = found.a.reference == Reference::kMap;
    std::printf(
        "Tracks of %s are in the map, those of %s in the vehicle frame: matched by ahead_m and left_m, without\n"
        "their speeds.\n\n",
        a_in_map ? "A" : "B", a_in_map ? "B" : "A");
  }
  std::printf("Differences where both found one (median, 95 %%, largest):\n");
  std::printf("  %lld detections: position %s; heading %s\n", static_cast<long long>(found.detection_distance_m.count),
              sizes_of(found.detection_distance_m, 1, "m").c_str(),
              sizes_of(found.detection_turn_rad, io::deg(1), "deg").c_str());
  std::printf("  %lld rows of tracks: position %s; speed %s\n", static_cast<long long>(found.track_distance_m.count),
              sizes_of(found.track_distance_m, 1, "m").c_str(), sizes_of(found.track_speed_mps, 1, "m/s").c_str());
  print_lone_tracks("A", found.a, on_map);
  print_lone_tracks("B", found.b, on_map);
  return 0;
}

}  // namespace

Command compare_command() {
  return make_command("compare",
                      "compares two runs on one recording, without truth; or results of evaluate, with intervals",
                      kListed, add_compare_options, compare);
}

}  // namespace overtake::cli
