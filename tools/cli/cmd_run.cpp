// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// overtake run: detects and tracks on a recording; detections.csv, tracks.csv, timing.csv, config.toml.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <tuple>

#include "tools/cli/commands.h"
#include "tools/cli/trace_file.h"
#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/angles.h"
#include "tools/io/box_file.h"
#include "tools/io/error.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/view/frame_picture.h"
#include "tools/view/mcap_view.h"

namespace overtake::cli {
namespace {

struct Announced {
  int64_t frame = 0;
  std::optional<io::Box> box;  // where the opponent is known to be
};

double distance(const ovt_frame_info& info, const ovt_tracks& tracks, int32_t i) {
  const Place place = place_of(info, tracks, i);
  return std::hypot(place.ahead_m, place.left_m);
}

int32_t nearest_track(const ovt_frame_info& info, const ovt_tracks& tracks, double ahead_m, double left_m) {
  int32_t best = -1;
  double best_m = HUGE_VAL;
  for (int32_t i = 0; i < tracks.count; ++i) {
    const Place place = place_of(info, tracks, i);
    const double m = std::hypot(place.ahead_m - ahead_m, place.left_m - left_m);
    if (m < best_m) best = i, best_m = m;
  }
  return best;
}

// For the table only: walls and posts are thinner than any side of a car.
bool looks_like_car(const ovt_tracks& tracks, int32_t i) {
  return std::min(tracks.length_m[i], tracks.width_m[i]) > 0.5 && std::max(tracks.length_m[i], tracks.width_m[i]) > 1.2;
}

// Receives the frames in order, on whichever thread finished them.
class RunResult {
 public:
  // trace: file for the stages' spans, "" for none.
  RunResult(const std::string& folder, const io::Rig& rig, const std::string& trace)
      : rig_(rig),
        detections_(folder + "/detections.csv", detections_header()),
        tracks_(folder + "/tracks.csv", tracks_header()),
        timing_(folder + "/timing.csv", kTimingHeader) {
    if (!trace.empty()) trace_.emplace(trace, rig);
  }

  // Where the frames are to go besides; outlives this.
  void set_view(McapView* view) { view_ = view; }
  // Draws one frame to a file. The parameters are borrowed.
  void draw_at(int64_t frame, const std::string& path, const ovt_params& params) {
    picture_ = {frame, path, &params, false};
  }
  bool drew() const { return picture_.done; }
  // Not from the callback: the library's counters are not to be asked for there.
  void add_counters(const ovt_stats& stats) {
    const std::lock_guard lock(mutex_);
    if (frame_count_ > 0) view_->add_counters(last_stamp_ns_, stats);
  }

  // Before its scans are pushed: which frame a stamp belongs to.
  void announce(const io::FrameScans& frame) {
    const std::lock_guard lock(mutex_);
    const Announced announced{frame.frame, frame.opponent ? frame.opponent : io::read_box_beside(frame)};
    for (const io::SensorScan& scan : frame.scans) announced_[scan.stamp_ns] = announced;
  }

  static void on_frame(ovt_reader* reader, void* self) {
    auto& result = *static_cast<RunResult*>(self);
    try {
      const std::lock_guard lock(result.mutex_);
      if (!result.failure_) result.add(reader);
    } catch (...) {  // a full disk must not travel through the library
      result.failure_ = std::current_exception();
    }
  }

  void rethrow_failure() {
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  // Everything is in the files.
  void finish() {
    const std::lock_guard lock(mutex_);
    for (io::CsvWriter* table : {&detections_, &tracks_, &timing_}) table->flush();
    if (trace_) trace_->finish();
  }

  int64_t frame_count() const { return frame_count_; }
  std::string format_frames() const;
  std::string format_times() const;
  std::string format_tracks() const { return last_tracks_.format(); }
  std::size_t confirmed_count() const { return confirmed_count_; }
  uint64_t hash() const { return hash_.value(); }
  bool any_box() const { return any_box_; }
  int64_t frames_with(uint32_t flag) const {
    const auto known = frames_with_.find(flag);
    return known == frames_with_.end() ? 0 : known->second;
  }
  int64_t ego_count() const { return ego_count_; }  // frames with a recent ego pose
  int64_t first_stamp_ns() const { return first_stamp_ns_; }
  int64_t last_stamp_ns() const { return last_stamp_ns_; }
  // The ego vehicle is outside of the map in most frames.
  bool is_wrong_map() const { return 2 * off_map_count() > frame_count_; }
  int64_t off_map_count() const { return frames_with(OVT_FLAG_EGO_OFF_MAP); }
  // "" when the ego vehicle never was outside of the map by more than its margin.
  std::string format_off_map() const {
    if (off_map_count() == 0) return "";
    return "the ego vehicle is outside of this map in " + std::to_string(off_map_count()) + " of " +
           std::to_string(frame_count_) + " frames, by up to " + fixed(off_map_m_, 1) + " m";
  }

 private:
  void add(ovt_reader* reader) {
    ovt_frame_info info;
    ovt_detections detections;
    ovt_tracks tracks;
    check(ovt_read_info(reader, &info), "frame");
    check(ovt_read_detections(reader, &detections), "detections");
    check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks), "tracks");
    Announced announced{info.sequence, std::nullopt};
    const auto known = announced_.find(info.first_stamp_ns);
    if (known != announced_.end()) announced = known->second;
    announced_.erase(announced_.begin(), known);
    const int64_t frame = announced.frame;

    if (view_) view_->add(reader);
    if (frame_count_ == 0) first_stamp_ns_ = info.first_stamp_ns;
    last_stamp_ns_ = info.stamp_ns;
    hash_.add(info, detections, tracks);
    write_detections(detections_, frame, detections);
    write_tracks(tracks_, frame, info, tracks);
    write_times(timing_, frame, info.stamp_ns, rig_, reader);
    if (trace_) trace_->add(frame, reader);
    if (picture_.params && frame == picture_.frame) {
      const std::string caption = "frame " + std::to_string(frame) +
                                  ", grid 10 m: points of detections and their "
                                  "rectangles, confirmed tracks with id, speed, path over " +
                                  fixed(tracks.path_points * tracks.path_step_s, 1) + " s and its 95 % ellipses";
      io::write_png(picture_.path, draw_frame(reader, rig_, *picture_.params, caption));
      picture_.done = true;
    }
    detections_.flush();  // Ctrl-C, or worse, keeps what is done
    tracks_.flush();
    timing_.flush();

    double pose_us = 0;  // without a map most of it is done sensor by sensor
    for (int32_t sensor = -1; sensor < int32_t(rig_.sensors.size()); ++sensor)
      for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
        const double us = read_time_us(reader, sensor, ovt_stage(stage));
        if (std::isnan(us)) continue;
        if (stage == OVT_STAGE_POSE)
          pose_us += us;
        else
          times_us_[stage].push_back(us);
      }
    if (!std::isnan(read_time_us(reader, -1, OVT_STAGE_POSE))) times_us_[OVT_STAGE_POSE].push_back(pose_us);
    add_row(announced, info, tracks, read_time_us(reader, -1, OVT_STAGE_FRAME));
    list_tracks(info, tracks);
    for (uint32_t flag = 1; flag != 0; flag <<= 1)
      if (info.flags & flag) ++frames_with_[flag];
    if (info.flags & OVT_FLAG_EGO_OFF_MAP) off_map_m_ = std::max(off_map_m_, info.ego_off_map_m);
    ego_count_ += info.ego_known && !(info.flags & OVT_FLAG_EGO_STALE);
    ++frame_count_;
  }

  void add_row(const Announced& announced, const ovt_frame_info& info, const ovt_tracks& tracks, double time_us) {
    const int32_t t = announced.box ? nearest_track(info, tracks, announced.box->x_m, announced.box->y_m) : int32_t(-1);
    const Place place = t < 0 ? Place{NAN, NAN} : place_of(info, tracks, t);
    std::vector<std::string> row = {std::to_string(announced.frame), std::to_string(info.point_count),
                                    std::to_string(info.cluster_count), std::to_string(info.detection_count),
                                    std::to_string(tracks.count)};
    row.push_back(t < 0 ? "-" : tracks.state[t] == OVT_CONFIRMED ? "confirmed" : "tentative");
    row.push_back(fixed(place.ahead_m, 2));
    row.push_back(fixed(place.left_m, 2));
    row.push_back(fixed(t < 0 ? NAN : tracks.heading_rad[t] * kDegreesPerRadian, 1));
    row.push_back(fixed(t < 0 ? NAN : tracks.speed_mps[t], 1));
    row.push_back(fixed(
        announced.box ? std::hypot(place.ahead_m - announced.box->x_m, place.left_m - announced.box->y_m) : NAN, 2));
    row.push_back(fixed(time_us * 1e-3, 2));
    frames_.push_back(row);
    any_box_ = any_box_ || announced.box;
  }

  void list_tracks(const ovt_frame_info& info, const ovt_tracks& tracks) {
    confirmed_count_ = 0;
    std::vector<int32_t> order;
    for (int32_t i = 0; i < tracks.count; ++i)
      if (tracks.state[i] == OVT_CONFIRMED) order.push_back(i);
    confirmed_count_ = order.size();
    const auto looks = [&](int32_t i) { return looks_like_car(tracks, i); };
    std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
      return std::tuple(!looks(a), -tracks.hits[a], distance(info, tracks, a)) <
             std::tuple(!looks(b), -tracks.hits[b], distance(info, tracks, b));
    });
    order.resize(std::min<std::size_t>(order.size(), 10));
    last_tracks_ = make_track_table();
    for (const int32_t i : order)
      last_tracks_.add({track_name(tracks.id[i]), info.reference == OVT_REFERENCE_MAP ? "map" : "vehicle",
                        fixed(tracks.x_m[i], 2), fixed(tracks.y_m[i], 2), fixed(tracks.speed_mps[i], 1),
                        fixed(tracks.course_rad[i] * kDegreesPerRadian, 1),
                        fixed(tracks.heading_rad[i] * kDegreesPerRadian, 1), fixed(tracks.length_m[i], 2),
                        fixed(tracks.width_m[i], 2), std::to_string(tracks.hits[i]), std::to_string(tracks.age[i])});
  }

  static TextTable make_track_table() {
    return TextTable({"name", "in frame", "x m", "y m", "speed m/s", "course deg", "heading deg", "seen length m",
                      "seen width m", "hits", "age"});
  }

  const io::Rig rig_;
  std::mutex mutex_;
  io::CsvWriter detections_, tracks_, timing_;
  std::optional<TraceFile> trace_;
  std::map<int64_t, Announced> announced_;  // by stamp
  std::exception_ptr failure_;
  McapView* view_ = nullptr;
  struct {
    int64_t frame = -1;
    std::string path;
    const ovt_params* params = nullptr;
    bool done = false;
  } picture_;
  int64_t last_stamp_ns_ = 0;
  ResultHash hash_;
  int64_t frame_count_ = 0, ego_count_ = 0, first_stamp_ns_ = 0;
  std::map<uint32_t, int64_t> frames_with_;  // by flag
  double off_map_m_ = 0;                     // the farthest that the ego vehicle was outside of the map
  std::map<int32_t, std::vector<double>> times_us_;
  bool any_box_ = false;
  std::size_t confirmed_count_ = 0;
  std::vector<std::vector<std::string>> frames_;  // rows of format_frames
  TextTable last_tracks_ = make_track_table();
};

// The opponent's columns only where the recording says where it is: which track it is nobody else knows.
std::string RunResult::format_frames() const {
  std::vector<std::string> header = {"scan",    "points", "clusters",    "detections", "tracks",    "opponent",
                                     "ahead m", "left m", "heading deg", "speed m/s",  "off box m", "ms"};
  constexpr std::ptrdiff_t kOpponentBegin = 5, kOpponentEnd = 11;
  const auto strip = [this](std::vector<std::string> row) {
    if (!any_box_) row.erase(row.begin() + kOpponentBegin, row.begin() + kOpponentEnd);
    return row;
  };
  TextTable table(strip(header));
  for (const auto& row : frames_) table.add(strip(row));
  return table.format(24);
}

// Per stage over all frames and sensors.
std::string RunResult::format_times() const {
  TextTable table({"stage", "median ms", "p99 ms", "max ms"});
  for (const auto& entry : times_us_) {
    std::vector<double> times = entry.second;
    std::sort(times.begin(), times.end());
    const auto share = [&](double p) {
      return times[std::min(times.size() - 1, std::size_t(p * double(times.size())))] * 1e-3;
    };
    table.add(
        {ovt_stage_name(entry.first), fixed(share(0.5), 3), fixed(share(0.99), 3), fixed(times.back() * 1e-3, 3)});
  }
  return table.format();
}

void print_notes(const RunResult& result, const Session& session) {
  const ovt_stats stats = session.stats();
  static constexpr struct {
    uint32_t flag;
    const char* text;
  } kNotes[] = {{OVT_FLAG_NO_EGO, "no ego poses: tracks are in the vehicle frame"},
                {OVT_FLAG_NO_MAP, "no map: no map gate, the reference heading is the ego vehicle's"},
                {OVT_FLAG_SENSOR_MISSING, "a sensor is missing"},
                {OVT_FLAG_EGO_STALE, "no recent ego pose"},
                {OVT_FLAG_CLOUD_DEGRADED, "a scan has more bad points than good ones"},
                {OVT_FLAG_CLOCK_JUMP, "the stamps jump"},
                {OVT_FLAG_CLOCK_SUSPECT, "stamps of a sensor, of detections or of ego poses do not fit the others'"},
                {OVT_FLAG_WORK_LIMIT, "clutter so dense that the tracker's work limit was met"}};
  for (const auto& note : kNotes) {
    const int64_t count = result.frames_with(note.flag);
    if (count > 0 && count < result.frame_count())
      std::printf("note: %s (in %lld of %lld frames)\n", note.text, static_cast<long long>(count),
                  static_cast<long long>(result.frame_count()));
    else if (count > 0)
      std::printf("note: %s\n", note.text);
  }
  for (const std::string& sentence : session.full_capacities()) std::printf("note: %s\n", printable(sentence).c_str());
  if (stats.pushed != stats.used)
    std::printf("note: of %s %lld %s not used (late %lld, repeated stamp %lld, dropped %lld)\n",
                io::counted(stats.pushed, "scan").c_str(), static_cast<long long>(stats.pushed - stats.used),
                stats.pushed - stats.used == 1 ? "was" : "were", static_cast<long long>(stats.late),
                static_cast<long long>(stats.dup), static_cast<long long>(stats.dropped));
}

}  // namespace

namespace {

// How the lines of sensors without a field for them were found: said once a sensor.
class LineNotes {
 public:
  void add(const io::FrameScans& frame) {
    for (const io::SensorScan& scan : frame.scans)
      if (!scan.lines_how.empty()) notes_.emplace(scan.sensor, scan.lines_how);
  }
  void print(const io::Rig& rig) const {
    for (const auto& [sensor, how] : notes_)
      std::printf("note: the clouds of sensor '%s' say no lines: %s\n", rig.sensors[std::size_t(sensor)].name.c_str(),
                  printable(how).c_str());
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

// An option that was given and changes nothing is a mistake somewhere: said as soon as it is known.
void check_map_has_effect(const Config& config, bool ego_can_come) {
  if (config.map.empty() || config.own_map || ego_can_come) return;
  throw io::Error("--map " + config.map, 0,
                  "has no effect without ego poses, and there are none: give --ego, or leave the map out");
}

void check_ego_has_effect(const Config& config, const Session& session, const RunResult& result) {
  if (config.ego.empty() || result.frame_count() == 0 || result.ego_count() > 0) return;
  throw io::Error("--ego " + config.ego, 0,
                  "has no effect: its poses are from " + span_text(session.ego_first_ns(), session.ego_last_ns()) +
                      ", the scans from " + span_text(result.first_stamp_ns(), result.last_stamp_ns()));
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

// What makes the exit code kDamaged although the results are whole: a sentence each.
std::vector<std::string> find_faults(const Config& config, const io::ScanStream& stream, const RunResult& result) {
  std::vector<std::string> faults;
  if (!stream.damage().empty())
    faults.push_back(config.input + ": " + stream.damage() + "; what came before it is done");
  if (stream.lost_count() > 0)
    faults.push_back(config.input + ": " + std::to_string(stream.lost_count()) +
                     (stream.lost_count() == 1 ? " file" : " files") +
                     " could not be read, the others are done; the first: " + stream.first_loss());
  if (result.is_wrong_map())
    faults.push_back(config.map + ": " + result.format_off_map() +
                     ": it is another course's, or the poses are; it was not used there");
  if (!config.ego.empty() && 2 * result.ego_count() < result.frame_count())
    faults.push_back("--ego " + config.ego + ": covers only " + share_text(result.ego_count(), result.frame_count()));
  return faults;
}

}  // namespace

int run_command(const Options& options) {
  Config config = load_config_with_rig(options);
  config.keep_images = !options.mcap.empty();  // the view shows them, nothing else here
  io::OutputGuard guard(options.force);
  add_inputs(guard, options, config);
  const auto stream = io::open_scans(config.input, config.rig);
  guard.add_folder(options.out);
  RunResult result(options.out, config.rig, options.trace);
  std::optional<McapView> view;
  if (!options.mcap.empty()) view.emplace(options.mcap, config);
  result.set_view(view ? &*view : nullptr);
  if (options.picture_at >= 0)
    result.draw_at(options.picture_at, options.out + "/frame_" + std::to_string(options.picture_at) + ".png",
                   config.params);
  Session session(config, &RunResult::on_frame, &result);
  check_map_has_effect(config, !config.ego.empty() || (stream->has_ego() && !config.no_ego));
  io::write_whole_file(options.out + "/config.toml", format_config(config));

  catch_interrupt();
  Progress progress(1000, options.quiet);
  LineNotes lines;
  io::FrameScans frame;
  while (!interrupted() && stream->next(frame)) {
    lines.add(frame);
    if (config.ego.empty() && !config.no_ego) session.add_ego(stream->take_ego());
    result.announce(frame);
    session.push(frame);
    guard.keep();
    result.rethrow_failure();
    if (view) result.add_counters(session.stats());
    progress.show(int64_t(1000 * stream->progress()));
  }
  session.flush();
  result.rethrow_failure();
  if (view) result.add_counters(session.stats());
  progress.clear();
  const std::string partial = interrupted() ? "interrupted after " + io::counted(result.frame_count(), "frame") : "";
  if (view) view->close(partial);
  result.finish();
  if (!interrupted()) {
    guard.keep(false);  // what follows is no result that anybody asked for
    check_ego_has_effect(config, session, result);
    if (options.picture_at >= 0 && !result.drew())
      throw io::Error("--picture-at " + std::to_string(options.picture_at), 0,
                      "has no effect: the recording has no frame of that number");
    check_map_has_effect(config,
                         result.frame_count() == 0 || result.frames_with(OVT_FLAG_NO_EGO) < result.frame_count());
    guard.commit();
  } else {
    guard.keep();
  }
  if (!options.quiet) {
    std::printf("%s\n%s", result.format_frames().c_str(), result.format_times().c_str());
    if (result.confirmed_count() > 0) {
      std::printf("\n%s at the end%s:\n%s", io::counted(int64_t(result.confirmed_count()), "confirmed track").c_str(),
                  result.confirmed_count() > 10 ? ", ten of them (all are in tracks.csv)" : "",
                  result.format_tracks().c_str());
    }
    std::printf("\n%s. Written to %s: detections.csv tracks.csv timing.csv config.toml%s\n",
                io::counted(result.frame_count(), "frame").c_str(), options.out.c_str(),
                interrupted() ? ", each with .part behind its name" : "");
    std::printf("Hash of all detections and tracks: %016llx\n", static_cast<unsigned long long>(result.hash()));
    if (result.any_box())
      std::printf("note: the opponent shown is the track nearest to where the recording says it is\n");
    if (!own_parts(config).empty()) std::printf("note: %s from the log itself\n", own_parts(config).c_str());
    if (!config.ego.empty())
      std::printf("note: the ego poses cover %s\n", share_text(result.ego_count(), result.frame_count()).c_str());
    if (const std::string why = io::why_partial(config.input); !why.empty())
      std::printf("note: this log is partial: %s\n", why.c_str());
    lines.print(config.rig);
    print_notes(result, session);
    if (result.off_map_count() > 0 && !result.is_wrong_map())
      std::printf("note: %s: the map is not used there\n", result.format_off_map().c_str());
  }
  const std::vector<std::string> faults = find_faults(config, *stream, result);
  for (const std::string& fault : faults) std::fprintf(stderr, "overtake: %s\n", printable(fault).c_str());
  if (interrupted()) {
    std::fprintf(stderr, "overtake: %s; what is done is kept, its names end in .part\n", partial.c_str());
    return kInterrupted;
  }
  return faults.empty() ? 0 : kDamaged;
}

}  // namespace overtake::cli
