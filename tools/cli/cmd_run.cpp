// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake run: detects and tracks on a recording; detections.csv, tracks.csv, timing.csv, config.toml.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <thread>

#include "tools/cli/command.h"
#include "tools/cli/command_options.h"
#include "tools/cli/file_sinks.h"
#include "tools/cli/summary_sinks.h"
#include "tools/cli/truth_sink.h"
#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/serve/live_view.h"
#include "tools/serve/view_server.h"

namespace overtake::cli {
namespace {

struct RunOptions : Options {
  std::string trace, mcap, mcap_images, truth;
  std::vector<std::string> allow_origins;
  int64_t picture_at = -1;
  int32_t live = -1;         // port; 0: a free one
  int32_t live_clients = 0;  // to wait for
  double rate = 0;           // of time; 0: as fast as possible
  bool stream = false;
};

// The ego vehicle is outside of the map in most frames.
bool is_wrong_map(const CountSink& counts) { return 2 * counts.frames_with(OVT_FLAG_EGO_OFF_MAP) > counts.frames(); }

std::string format_off_map(const CountSink& counts) {
  return "the ego vehicle is outside of this map in " + std::to_string(counts.frames_with(OVT_FLAG_EGO_OFF_MAP)) +
         " of " + std::to_string(counts.frames()) + " frames, by up to " + fixed(counts.off_map_m(), 1) + " m";
}

void print_notes(const CountSink& counts, const Session& session) {
  const ovt_stats stats = session.stats();
  static constexpr struct {
    uint32_t flag;
    const char* text;
  } kNotes[] = {{OVT_FLAG_NO_EGO, "no ego poses: tracks are in the vehicle frame"},
                {OVT_FLAG_NO_MAP, "no map: no map gate, the reference heading is the ego vehicle's"},
                {OVT_FLAG_NO_DATA, "no scan of a frame has a usable point: this is not 'all clear'"},
                {OVT_FLAG_SENSOR_MISSING, "a sensor is missing"},
                {OVT_FLAG_EGO_STALE, "no recent ego pose"},
                {OVT_FLAG_CLOUD_DEGRADED, "most points of a scan are bad, or in each other's pixels"},
                {OVT_FLAG_CLOCK_JUMP, "the stamps jump"},
                {OVT_FLAG_CLOCK_SUSPECT, "stamps of a sensor, of detections or of ego poses do not fit the others'"},
                {OVT_FLAG_SCAN_INCOMPLETE, "a scan lacks points"},
                {OVT_FLAG_NO_GROUND,
                 "a scan shows hardly any ground: something covers a sensor, or the pitch or roll of the ego poses, a "
                 "mounting or the map is wrong"},
                {OVT_FLAG_EGO_JUMP, "the ego poses jump"},
                {OVT_FLAG_VIEW_BLOCKED,
                 "a part of a sensor's view has no returns: something on its window, the own car, a crest?"},
                {OVT_FLAG_WORK_LIMIT, "the tracker reached its work limit in dense clutter"}};
  for (const auto& note : kNotes) {
    const int64_t count = counts.frames_with(note.flag);
    if (count > 0 && count < counts.frames())
      std::printf("note: %s (in %lld of %lld frames)\n", note.text, static_cast<long long>(count),
                  static_cast<long long>(counts.frames()));
    else if (count > 0)
      std::printf("note: %s\n", note.text);
  }
  for (const std::string& sentence : session.full_capacities()) std::printf("note: %s\n", printable(sentence).c_str());
  for (const std::string& note : session.file_notes()) std::printf("note: %s\n", printable(note).c_str());
  if (const std::string bad = session.bad_poses(); !bad.empty()) std::printf("note: %s\n", bad.c_str());
  if (stats.pushed != stats.used)
    std::printf("note: of %s %lld %s not used (late %lld, repeated stamp %lld, dropped %lld)\n",
                io::counted(stats.pushed, "scan").c_str(), static_cast<long long>(stats.pushed - stats.used),
                stats.pushed - stats.used == 1 ? "was" : "were", static_cast<long long>(stats.late),
                static_cast<long long>(stats.dup), static_cast<long long>(stats.dropped));
}

// Notes, once per sensor, how missing ring ids were recovered.
class LineNotes {
 public:
  void add(const io::FrameScans& frame) {
    for (const io::SensorScan& scan : frame.scans)
      if (!scan.lines_how.empty()) notes_.emplace(scan.sensor, scan.lines_how);
  }
  void print(const io::Rig& rig) const {
    for (const auto& [sensor, how] : notes_)
      std::printf("note: the clouds of sensor '%s' have no ring field: %s\n",
                  rig.sensors[std::size_t(sensor)].name.c_str(), printable(how).c_str());
  }

 private:
  std::map<int32_t, std::string> notes_;
};

std::string span_text(int64_t first_ns, int64_t last_ns) {
  return fixed(double(first_ns) * 1e-9, 2) + " to " + fixed(double(last_ns) * 1e-9, 2) + " s";
}

std::string share_text(int64_t part, int64_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole) + " frames (" +
         fixed(whole > 0 ? 100.0 * double(part) / double(whole) : 0.0, part > 0 && part < whole ? 1 : 0) + " %)";
}

// An option without effect is a mistake of the user: reports it as early as possible.
void check_map_has_effect(const Config& config, bool ego_can_come) {
  if (config.map.empty() || config.own_map || ego_can_come) return;
  throw io::Error("--map " + config.map, 0,
                  "has no effect without ego poses, and there are none: give --ego, or leave the map out");
}

void check_ego_has_effect(const Config& config, const Session& session, const CountSink& counts) {
  if (config.ego.empty() || counts.frames() == 0 || counts.frames_with_ego() > 0) return;
  const bool overlaps =
      session.ego_first_ns() <= counts.last_stamp_ns() && counts.first_stamp_ns() <= session.ego_last_ns();
  if (const std::string bad = session.bad_poses(); overlaps && !bad.empty())
    throw io::Error("--ego " + config.ego, 0, "has no effect: " + bad);
  throw io::Error("--ego " + config.ego, 0,
                  "has no effect: its poses are from " + span_text(session.ego_first_ns(), session.ego_last_ns()) +
                      ", the scans from " + span_text(counts.first_stamp_ns(), counts.last_stamp_ns()));
}

std::string own_parts(const Config& config) {
  std::vector<std::string> parts;
  if (config.own_rig) parts.push_back("the rig");
  if (config.own_map) parts.push_back("the map");
  if (config.own_ego) parts.push_back("the ego poses");
  if (parts.empty()) return "";
  const std::string last = parts.back();
  parts.pop_back();
  return (parts.empty() ? "" : io::join(parts, ", ") + " and ") + last + (parts.empty() ? " is" : " are");
}

// One sentence for each reason to return kDamaged although the results are complete.
std::vector<std::string> find_faults(const Config& config, const io::ScanStream& stream, const Session& session,
                                     const CountSink& counts) {
  std::vector<std::string> faults;
  if (!stream.damage().empty())
    faults.push_back(config.input + ": " + stream.damage() + "; results are from the part before it");
  if (stream.lost_count() > 0) faults.push_back(config.input + ": " + stream.losses());
  if (is_wrong_map(counts))
    faults.push_back(config.map + ": " + format_off_map(counts) +
                     ": map and poses are of different courses; the run did not use the map there");
  if (session.direction().is_against())
    faults.push_back(config.map + ": " + session.direction().sentence("this map") + ": turn its lines round");
  if (!config.ego.empty() && 2 * counts.frames_with_ego() < counts.frames())
    faults.push_back("--ego " + config.ego + ": covers only " + share_text(counts.frames_with_ego(), counts.frames()));
  return faults;
}

McapImages images_of(const RunOptions& options) {
  return options.mcap_images == "none"     ? McapImages::kNone
         : options.mcap_images == "labels" ? McapImages::kLabels
                                           : McapImages::kAll;
}

// Holds frames back until their time, at `rate` times the recording's speed. After a jump of the stamps the next frame
// is due at once: nobody waits for an hour that a clock was set forward, or until the old time comes again.
class Pace {
 public:
  explicit Pace(double rate) : rate_(rate) {}
  void wait(const io::FrameScans& frame) {
    if (rate_ <= 0 || frame.scans.empty()) return;
    const double stamp_s = double(frame.scans[0].stamp_ns) * 1e-9;
    if (!(std::abs(stamp_s - last_s_) <= kJump_s)) first_s_ = stamp_s, begin_ = Clock::now();
    last_s_ = stamp_s;
    const std::chrono::duration<double> ahead((stamp_s - first_s_) / rate_);
    const auto due = begin_ + std::chrono::duration_cast<Clock::duration>(ahead);
    while (!interrupted() && Clock::now() < due)
      std::this_thread::sleep_until(std::min(due, Clock::now() + std::chrono::milliseconds(100)));
  }
  // The next frame is due at once.
  void restart() { last_s_ = std::nan(""); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kJump_s = 2;
  double rate_, first_s_ = 0, last_s_ = std::nan("");  // no frame yet
  Clock::time_point begin_;
};

// The clients of --live and the server in front of them.
struct Live {
  Live(int32_t port, const std::vector<std::string>& allow_origins)
      : server({"127.0.0.1", port, {}, "", allow_origins, &view}) {}
  // Until `count` clients have connected and, once they could learn the channels from a frame, subscribed; or until an
  // interrupt. True if it had to wait.
  bool wait_for(int32_t count) const {
    const auto lacks = [&] {
      const serve::LiveView::Counts counts = view.counts();
      return counts.clients < count || (counts.frames > 0 && counts.subscribed < count);
    };
    bool waited = false;
    for (; !interrupted() && lacks(); waited = true) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return waited;
  }
  serve::LiveView view;
  serve::ViewServer server;
};

// The sinks of a run, in the order in which they get a frame.
struct Sinks {
  // Opens the files: `folder` must exist.
  Sinks(const RunOptions& options, const Config& config, ViewSink* live)
      : tables(options.out, config.rig), times(config.rig), track_table(config.params.tracker_window) {
    if (!options.trace.empty()) trace.emplace(options.trace, config.rig);
    if (!options.mcap.empty() || live) view.emplace(config, options.mcap, images_of(options), live);
    if (options.picture_at >= 0) picture.emplace(options.picture_at, options.out, config);
    if (!options.truth.empty()) truth.emplace(options.truth);
  }
  std::vector<FrameSink*> all() {
    std::vector<FrameSink*> sinks;
    const auto add = [&](auto& sink) {
      if (sink) sinks.push_back(&*sink);
    };
    add(view);
    sinks.insert(sinks.end(), {&hash, &tables});
    add(trace);
    add(picture);
    sinks.insert(sinks.end(), {&times, &frame_table, &track_table, &counts});
    add(truth);
    return sinks;
  }

  CsvSink tables;
  std::optional<TraceSink> trace;
  std::optional<ViewFrames> view;
  std::optional<PictureSink> picture;
  std::optional<TruthSink> truth;
  HashSink hash;
  TimesSink times;
  FrameTableSink frame_table;
  TrackTableSink track_table;
  CountSink counts;
};

void check_effects(const RunOptions& options, const Config& config, const io::ScanStream& stream,
                   const Session& session, const Sinks& sinks) {
  if (sinks.counts.frames_with(OVT_FLAG_NO_DATA) == sinks.counts.frames())
    throw io::Error(config.input, 0, session.why_no_data(stream.damage()));
  check_ego_has_effect(config, session, sinks.counts);
  if (sinks.picture && !sinks.picture->drew())
    throw io::Error("--picture-at " + std::to_string(options.picture_at), 0,
                    "has no effect: the recording has no frame of that number");
  if (sinks.truth && sinks.truth->frame_count() == 0)
    throw io::Error("--truth " + options.truth, 0, "has no effect: it has no row for any frame of the recording");
  check_map_has_effect(config,
                       sinks.counts.frames() == 0 || sinks.counts.frames_with(OVT_FLAG_NO_EGO) < sinks.counts.frames());
}

void print_result(const RunOptions& options, const Config& config, const Session& session, const Sinks& sinks,
                  const LineNotes& lines, const std::vector<std::string>& input_notes) {
  std::printf("%s\n%s", sinks.frame_table.format().c_str(), sinks.times.format().c_str());
  const std::size_t confirmed = sinks.track_table.count();
  if (confirmed > 0) {
    std::printf("\n%s at the end%s:\n%s", io::counted(int64_t(confirmed), "confirmed track").c_str(),
                confirmed > TrackTableSink::kMost ? ", ten of them (all are in tracks.csv)" : "",
                sinks.track_table.format().c_str());
  }
  std::printf("\n%s. Written to %s: detections.csv tracks.csv timing.csv config.toml%s\n",
              io::counted(sinks.counts.frames(), "frame").c_str(), options.out.c_str(),
              interrupted() ? ", each name followed by .part" : "");
  std::printf("Hash of all detections and tracks: %016llx\n", static_cast<unsigned long long>(sinks.hash.value()));
  if (sinks.frame_table.any_opponent())
    std::printf("note: the opponent shown is the track nearest to where the recording says it is\n");
  if (!own_parts(config).empty()) std::printf("note: %s from the log itself\n", own_parts(config).c_str());
  if (!config.ego.empty())
    std::printf("note: the ego poses cover %s\n",
                share_text(sinks.counts.frames_with_ego(), sinks.counts.frames()).c_str());
  if (const std::string why = io::why_partial(config.input); !why.empty())
    std::printf("note: this log is partial: %s\n", why.c_str());
  for (const std::string& note : input_notes)
    if (!note.empty()) std::printf("note: %s\n", printable(note).c_str());
  lines.print(config.rig);
  print_notes(sinks.counts, session);
  if (sinks.counts.frames_with(OVT_FLAG_EGO_OFF_MAP) > 0 && !is_wrong_map(sinks.counts))
    std::printf("note: %s: the map is not used there\n", format_off_map(sinks.counts).c_str());
  if (sinks.truth) std::printf("\n%s", sinks.truth->format().c_str());
}

void check_options(const RunOptions& options) {
  if (!options.mcap_images.empty() && options.mcap.empty())
    throw io::Error("--mcap-images " + options.mcap_images, 0, "has no effect without --mcap");
  if (!options.allow_origins.empty() && options.live < 0)
    throw io::Error("--allow-origin " + options.allow_origins[0], 0, "has no effect without --live");
  if (options.live_clients > 0 && options.live < 0)
    throw io::Error("--live-clients " + std::to_string(options.live_clients), 0, "has no effect without --live");
}

// Gives the clients a second for the frames that they have not read yet.
void close_live(const RunOptions& options, Live& live) {
  live.view.drain(std::chrono::seconds(1));
  const auto counts = live.view.counts();
  if (!options.quiet)
    std::printf("note: live: %s, %s sent, %lld not sent to slow ones\n", io::counted(counts.clients, "client").c_str(),
                io::counted(counts.sent, "frame").c_str(), static_cast<long long>(counts.dropped));
}

int run(const RunOptions& options) {
  Config config = load_config_with_rig(options);
  check_options(options);
  // Only the view shows images.
  config.keep_images = options.live >= 0 || (!options.mcap.empty() && images_of(options) != McapImages::kNone);
  config.in_pieces = options.stream;
  io::OutputGuard guard(options.force);
  add_inputs(guard, options, config);
  if (options.truth != TruthSink::kOwnTruth) guard.add_input(options.truth);
  const auto stream = io::open_scans(config.input, config.rig);
  catch_interrupt();  // before the address is told: who reads it may interrupt
  std::optional<Live> live;
  if (options.live >= 0) live.emplace(options.live, options.allow_origins);
  if (live && !options.quiet)
    std::fprintf(stderr, "overtake: live at %s (Foxglove, Lichtblick: ws://127.0.0.1:%d)\n", live->server.url().c_str(),
                 live->server.port());
  guard.add_folder(options.out);
  Sinks sinks(options, config, live ? &live->view : nullptr);
  FrameSinks frames(sinks.all());
  Session session(config, &FrameSinks::on_frame, &frames);
  const auto add_counters = [&] {
    if (!sinks.view) return;
    const ovt_stats stats = session.stats();
    frames.between_frames([&] { sinks.view->add_counters(stats); });
  };
  check_map_has_effect(config, !config.ego.empty() || (stream->has_ego() && !config.no_ego));
  io::write_whole_file(options.out + "/config.toml", format_config(config));

  Progress progress(1000, options.quiet);
  LineNotes lines;
  Pace pace(options.rate);
  io::FrameScans scans;
  while (!interrupted() && stream->next(scans)) {
    if (live && live->wait_for(options.live_clients)) pace.restart();
    pace.wait(scans);
    lines.add(scans);
    if (config.ego.empty() && !config.no_ego) session.add_ego(stream->take_ego());
    frames.announce(scans);
    session.push(scans);
    guard.keep();
    frames.rethrow_failure();
    add_counters();
    progress.show(int64_t(1000 * stream->progress()));
  }
  session.flush();
  frames.rethrow_failure();
  add_counters();
  progress.clear();
  const bool stopped = interrupted();  // from here on a signal changes nothing
  const std::string partial = stopped ? "interrupted after " + io::counted(sinks.counts.frames(), "frame") : "";
  if (sinks.view) sinks.view->close(partial);
  frames.finish();
  if (!stopped) {
    guard.keep(false);  // an option without effect: the results are not what the user asked for
    check_effects(options, config, *stream, session, sinks);
    guard.remove_leftovers(options.out, PictureSink::kNameBegin, ".png");  // of another run's --picture-at
    guard.commit();
  } else {
    guard.keep();
  }
  if (!options.quiet) print_result(options, config, session, sinks, lines, {stream->note(), frames.note()});
  if (live) close_live(options, *live);
  const std::vector<std::string> faults = find_faults(config, *stream, session, sinks.counts);
  for (const std::string& fault : faults) std::fprintf(stderr, "overtake: %s\n", printable(fault).c_str());
  if (stopped) {
    std::fprintf(stderr, "overtake: %s; the results so far are kept in files that end in .part\n", partial.c_str());
    return kInterrupted;
  }
  return faults.empty() ? 0 : kDamaged;
}

void add_run_options(CLI::App& command, RunOptions& options) {
  options.command = "run";
  add_detector_options(command, options);
  add_common_options(command, options);
  add_map_option(command, options.map, "that of a simulated log or folder");
  command.add_option(
      "--ego", options.ego,
      "CSV of ego poses: stamp_ns (or timestamp_ns, or time_s),x_m,y_m,yaw_rad[,z_m][,roll_rad,pitch_rad]"
      "[,speed_mps][,yaw_rate_rps] "
      "(default: the recording's own, if any); none: without");
  command.add_option("--mcap", options.mcap,
                     "also writes the pipeline's input and results for Foxglove: clouds with labels, "
                     "images, candidates, tracks, map, times, counters");
  command
      .add_option("--mcap-images", options.mcap_images,
                  "images in the file of --mcap: none, labels or all (default); they are a third of its bytes")
      ->check(CLI::IsMember({"none", "labels", "all"}));
  command
      .add_option("--live", options.live,
                  "PORT: shows the run in a browser, in Foxglove or Lichtblick while it runs; 0: a free port")
      ->check(CLI::Range(0, 65535));
  command
      .add_option("--live-clients", options.live_clients,
                  "COUNT: begins when so many clients of --live have connected, goes on after its first frame when "
                  "they have subscribed (default: 0)")
      ->check(CLI::Range(0, int(serve::kMostLiveClients)));
  command.add_option("--allow-origin", options.allow_origins,
                     "ORIGIN (https://app.foxglove.dev): pages of this site may connect to --live, too");
  command.add_option("--rate", options.rate, "of time, for --live: 1 real time, 0.5 half of it (default: no limit)")
      ->check(in_range(0.001, 1000.0));
  command.add_option("--workers", options.workers, "threads; 1: the main thread only (default), 0: one per CPU")
      ->check(CLI::Range(0, 256));
  command.add_flag("--stream", options.stream,
                   "pushes the scans in pieces of 1 ms, by the points' times: the same results as without");
  command.add_option("--trace", options.trace,
                     "FILE: every stage of every frame on its thread, as Chrome trace JSON (ui.perfetto.dev)");
  command
      .add_option("--picture-at", options.picture_at,
                  "FRAME: draws that frame from above, with detections, tracks and paths, to frame_FRAME.png")
      ->check(CLI::Range(int64_t(0), INT64_MAX));
  command.add_option("--truth", options.truth,
                     "CSV of the other cars' positions (truth.csv of simulate), or own: the opponent's position in the "
                     "recording; prints the nearest detections and tracks");
}

}  // namespace

Command run_command() {
  return make_command("run", "detects and tracks on a recording", kListed, add_run_options, run);
}

}  // namespace overtake::cli
