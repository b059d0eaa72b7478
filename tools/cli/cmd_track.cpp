// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake track: runs the tracker alone on detections in the map frame; writes tracks.csv and config.toml.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>
#include <utility>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/client/console.h"
#include "tools/client/covariance.h"
#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/csv.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

// Detections with the same stamp; all columns have the same length.
struct Scan {
  int64_t stamp_ns = 0;
  std::vector<double> x_m, y_m, heading_rad, var_x, var_y, cov_xy, length_m, width_m, height_m, score;
};

// Rows with the same stamp form one scan; a row with neither x nor y is an empty scan. Adds to `notes` a sentence about
// columns that it does not read.
std::vector<Scan> read_scans(const std::string& path, std::vector<std::string>& notes) {
  const io::Csv csv = io::Csv::read(path);
  const int32_t stamp = csv.need({"stamp_ns", "timestamp_ns"}), x = csv.need({"x_m", "x"}), y = csv.need({"y_m", "y"});
  if (csv.find({"heading_source"}) >= 0)
    throw io::Error(
        path, 0,
        "is detections.csv of overtake run: its positions are in the vehicle frame and each row has a stamp of "
        "its own, track needs the map frame and one stamp a scan. overtake run --set tracker.... tracks again");
  const int32_t heading = csv.find({"heading_rad", "yaw_rad"});
  const int32_t var_x = csv.find({"var_x"}), var_y = csv.find({"var_y"}), cov_xy = csv.find({"cov_xy"});
  const int32_t length = csv.find({"length_m"}), width = csv.find({"width_m"}), height = csv.find({"height_m"});
  const int32_t score = csv.find({"score"});
  csv.note_unread({stamp, x, y, heading, var_x, var_y, cov_xy, length, width, height, score}, notes);
  const auto optional = [&](std::size_t row, int32_t column) {
    return column < 0 || csv.text(row, column).empty() ? std::nan("") : csv.number(row, column);
  };
  const auto size = [&](std::size_t row, int32_t column, const char* name) {
    const double size_m = optional(row, column);
    if (size_m <= 0.0) csv.fail(row, column, std::string(name) + " is not positive");
    return size_m;
  };
  const auto variance = [&](std::size_t row, int32_t column, const char* name) {
    const double value = optional(row, column);
    if (value < 0.0) csv.fail(row, column, std::string(name) + " is negative");
    return value;
  };
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < csv.row_count(); ++i) {
    const int64_t stamp_ns = csv.integer(i, stamp);
    if (scans.empty() || scans.back().stamp_ns != stamp_ns) {
      if (!scans.empty() && stamp_ns < scans.back().stamp_ns) csv.fail(i, stamp, "the stamp goes back");
      scans.emplace_back();
      scans.back().stamp_ns = stamp_ns;
    }
    if (csv.text(i, x).empty() && csv.text(i, y).empty()) continue;
    Scan& scan = scans.back();
    scan.x_m.push_back(csv.number(i, x));
    scan.y_m.push_back(csv.number(i, y));
    scan.heading_rad.push_back(optional(i, heading));
    scan.var_x.push_back(variance(i, var_x, "var_x"));
    scan.var_y.push_back(variance(i, var_y, "var_y"));
    scan.cov_xy.push_back(optional(i, cov_xy));
    if (const char* fault = find_covariance_fault(scan.var_x.back(), scan.var_y.back(), scan.cov_xy.back()))
      csv.fail(i, std::max({var_x, var_y, cov_xy}), fault);
    scan.length_m.push_back(size(i, length, "length_m"));
    scan.width_m.push_back(size(i, width, "width_m"));
    scan.height_m.push_back(size(i, height, "height_m"));
    scan.score.push_back(optional(i, score));
    if (scan.score.back() < 0.0 || scan.score.back() > 1.0) csv.fail(i, score, "score is not between 0 and 1");
  }
  return scans;
}

// Throws io::Error at the first scan that the library would refuse for its number of rows.
void check_row_counts(const std::string& path, const std::vector<Scan>& scans, int32_t capacity) {
  for (const Scan& scan : scans) {
    const auto rows = int64_t(scan.x_m.size());
    if (rows <= capacity) continue;
    int64_t enough = capacity;
    while (enough < rows) enough *= 2;
    throw io::Error(path, 0,
                    "scan " + std::to_string(scan.stamp_ns) + " has " + std::to_string(rows) + " rows, at most " +
                        std::to_string(capacity) + " are taken (--capacity candidates=" + std::to_string(enough) +
                        " raises it)");
  }
}

// Prints what became of the rows that reached no track, by reason.
void print_losses(const ovt_stats& stats, int64_t rows) {
  const std::pair<int64_t, const char*> reasons[] = {
      {stats.measurements_rejected, "without a place that a car can have, or of a wrong stamp"},
      {stats.measurements_unborn, "without a free track"},
      {stats.measurements_late, "too late"},
      {stats.measurements_lost, "of a scan that was not used"}};
  std::vector<std::string> parts;
  int64_t lost = 0;
  for (const auto& [count, reason] : reasons)
    if (count > 0) lost += count, parts.push_back(std::to_string(count) + " " + reason);
  if (lost > 0)
    std::printf("note: of %s %lld %s not used: %s\n", io::counted(rows, "row").c_str(), static_cast<long long>(lost),
                lost == 1 ? "was" : "were", io::join(parts, ", ").c_str());
}

void push_scan(const Session& session, const Scan& scan) {
  ovt_external_detections detections;
  ovt_external_detections_init(&detections, sizeof detections);
  detections.stamp_ns = scan.stamp_ns;
  detections.count = int32_t(scan.x_m.size());
  detections.reference = OVT_REFERENCE_MAP;
  detections.x_m = scan.x_m.data();
  detections.y_m = scan.y_m.data();
  detections.heading_rad = scan.heading_rad.data();
  detections.var_x = scan.var_x.data();
  detections.var_y = scan.var_y.data();
  detections.cov_xy = scan.cov_xy.data();
  detections.length_m = scan.length_m.data();
  detections.width_m = scan.width_m.data();
  detections.height_m = scan.height_m.data();
  detections.score = scan.score.data();
  check(ovt_push_detections(session.detector(), &detections), "scan " + std::to_string(scan.stamp_ns));
}

class Reader {
 public:
  explicit Reader(const Session& session) {
    check(ovt_create_reader(session.detector(), &reader_), "reader");
    check(ovt_set_path_horizon(reader_, 0.0), "paths");  // no file has them
  }
  ~Reader() { ovt_destroy_reader(reader_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ovt_reader* get() const { return reader_; }

 private:
  ovt_reader* reader_ = nullptr;
};

void add_track_options(CLI::App& command, Options& options) {
  options.command = "track";
  command
      .add_option(
          "input", options.input,
          "CSV: stamp_ns,x_m,y_m[,heading_rad][,var_x,var_y[,cov_xy]][,length_m,width_m,height_m][,score] in the map "
          "frame. x_m, y_m: the object's centre; heading_rad from x to y; var_x, var_y, cov_xy in m^2; "
          "length_m, width_m along and across the heading, height_m from the road up; score: the detector's "
          "confidence, 0 to 1. An empty cell is not "
          "measured. Rows of one stamp are one scan, a row without x and y is an empty scan")
      ->required();
  add_common_options(command, options);
  add_map_option(command, options.map, "none");
  command.add_option("--ego", options.ego, "CSV of ego poses");
}

int track(const Options& options) {
  Config config = load_config(options);
  config.has_rig = false;  // no LiDAR: only the library's tracker runs
  config.rig = io::Rig();
  config.workers = 1;  // scans are tracked one after the other: more workers would be idle
  std::vector<std::string> notes;
  const auto scans = read_scans(config.input, notes);
  check_row_counts(config.input, scans, effective_capacities(config).candidates);
  io::OutputGuard guard(options.force);
  add_inputs(guard, options, config);
  guard.add_folder(options.out);
  std::optional<io::CsvWriter> tracks_csv;  // from the first scan on, whose columns the header names
  guard.check(options.out + "/tracks.csv");
  const auto open_table = [&](const ovt_tracks& tracks) {
    if (!tracks_csv) tracks_csv.emplace(options.out + "/tracks.csv", tracks_header(tracks));
  };
  Session session(config, nullptr, nullptr);
  const Reader reader(session);
  io::write_whole_file(options.out + "/config.toml", format_config(config));

  catch_interrupt();
  Progress progress(int64_t(scans.size()), options.quiet);
  std::set<uint64_t> seen, confirmed;
  std::size_t done = 0;
  int64_t held = 0;  // scans without a frame of their own
  for (; done < scans.size() && !interrupted(); ++done) {
    session.push_ego_until(scans[done].stamp_ns);
    push_scan(session, scans[done]);
    session.flush();
    // No frame while a scan after a gap is held, until the next ones agree with its stamp.
    ovt_frame_info info;
    const ovt_status status = ovt_next_frame(reader.get(), &info);
    held += status == OVT_NO_FRAME;
    if (status != OVT_NO_FRAME) {
      check(status, "scan " + std::to_string(scans[done].stamp_ns));
      ovt_tracks tracks;
      check(ovt_read_tracks(reader.get(), OVT_AT_FRAME_STAMP, &tracks), "tracks");
      open_table(tracks);
      write_tracks(*tracks_csv, int64_t(done), info, tracks);
      for (int32_t i = 0; i < tracks.count; ++i) {
        seen.insert(tracks.id[i]);
        if (tracks.state[i] == OVT_CONFIRMED) confirmed.insert(tracks.id[i]);
      }
    }
    guard.keep();
    progress.show(int64_t(done) + 1);
  }
  open_table({});
  tracks_csv->flush();
  progress.clear();
  const bool stopped = interrupted();
  if (stopped)
    guard.keep();
  else
    guard.commit();
  if (!options.quiet)
    std::printf("%s, %s, %zu of them confirmed. Written to %s: tracks.csv config.toml\n",
                io::counted(int64_t(done), "scan").c_str(), io::counted(int64_t(seen.size()), "track").c_str(),
                confirmed.size(), options.out.c_str());
  int64_t rows = 0;
  for (std::size_t i = 0; i < done; ++i) rows += int64_t(scans[i].x_m.size());
  if (!options.quiet) print_losses(session.stats(), rows);
  if (!options.quiet && held > 0)
    std::printf("note: %s after a gap of more than a second: no rows in tracks.csv until the next ones confirmed it\n",
                io::counted(held, "scan").c_str());
  notes.insert(notes.end(), session.file_notes().begin(), session.file_notes().end());
  if (!options.quiet)
    for (const std::string& note : notes) std::printf("note: %s\n", printable(note).c_str());
  if (!options.quiet)
    for (const std::string& sentence : session.full_capacities()) std::printf("note: %s\n", sentence.c_str());
  if (stopped)
    std::fprintf(stderr, "overtake: interrupted after %s; the results so far are kept in files that end in .part\n",
                 io::counted(int64_t(done), "scan").c_str());
  return stopped ? kInterrupted : 0;
}

}  // namespace

Command track_command() {
  return make_command("track", "the tracker alone on detections", kListed, add_track_options, track);
}

}  // namespace overtake::cli
