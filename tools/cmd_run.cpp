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

#include "tools/commands.h"
#include "tools/console.h"
#include "tools/frame_picture.h"
#include "tools/io/box_file.h"
#include "tools/io/error.h"
#include "tools/io/scan_stream.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/mcap_view.h"
#include "tools/result_files.h"
#include "tools/session.h"
#include "tools/trace_file.h"

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

// The track to show where nobody says which one is the opponent: confirmed before tentative, what looks like a car
// before what does not, then more hits, then the nearer one.
int32_t likely_opponent(const ovt_frame_info& info, const ovt_tracks& tracks) {
  int32_t best = -1;
  const auto key = [&](int32_t i) {
    return std::tuple(-tracks.state[i], !looks_like_car(tracks, i), -tracks.hits[i], distance(info, tracks, i));
  };
  for (int32_t i = 0; i < tracks.count; ++i)
    if (best < 0 || key(i) < key(best)) best = i;
  return best;
}

constexpr double kDegreesPerRadian = 180.0 / 3.14159265358979323846;

// Receives the frames in order, on whichever thread finished them.
class RunResult {
 public:
  // trace: file for the stages' spans, "" for none.
  RunResult(const std::string& folder, const io::Rig& rig, const std::string& trace)
      : rig_(rig),
        detections_(folder + "/detections.csv", kDetectionsHeader),
        tracks_(folder + "/tracks.csv", kTracksHeader),
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

  void finish_trace() {
    const std::lock_guard lock(mutex_);
    if (trace_) trace_->finish();
  }

  int64_t frame_count() const { return frame_count_; }
  std::string format_frames() const { return frames_.format(24); }
  std::string format_times() const;
  std::string format_tracks() const { return last_tracks_.format(); }
  std::size_t confirmed_count() const { return confirmed_count_; }
  uint64_t hash() const { return hash_.value(); }
  bool any_box() const { return any_box_; }
  uint32_t flags_of_all() const { return flags_of_all_; }
  int64_t off_map_count() const { return off_map_count_; }
  // "" when the ego vehicle never was outside of the map by more than its margin.
  std::string format_off_map() const {
    if (off_map_count_ == 0) return "";
    return "the ego vehicle is outside of this map in " + std::to_string(off_map_count_) + " of " +
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
    last_stamp_ns_ = info.stamp_ns;
    add_to_hash(hash_, info, detections, tracks);
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
    flags_of_all_ |= info.flags;
    if (info.flags & OVT_FLAG_EGO_OFF_MAP) {
      ++off_map_count_;
      off_map_m_ = std::max(off_map_m_, info.ego_off_map_m);
    }
    ++frame_count_;
  }

  void add_row(const Announced& announced, const ovt_frame_info& info, const ovt_tracks& tracks, double time_us) {
    const int32_t t = announced.box ? nearest_track(info, tracks, announced.box->x_m, announced.box->y_m)
                                    : likely_opponent(info, tracks);
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
    frames_.add(row);
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
  Hash hash_;
  int64_t frame_count_ = 0;
  uint32_t flags_of_all_ = 0;
  int64_t off_map_count_ = 0;  // frames in which the ego vehicle is outside of the map
  double off_map_m_ = 0;
  std::map<int32_t, std::vector<double>> times_us_;
  bool any_box_ = false;
  std::size_t confirmed_count_ = 0;
  TextTable frames_{{"scan", "points", "clusters", "detections", "tracks", "opponent", "ahead m", "left m",
                     "heading deg", "speed m/s", "off box m", "ms"}};
  TextTable last_tracks_ = make_track_table();
};

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

void print_notes(uint32_t flags, const Session& session) {
  const ovt_stats stats = session.stats();
  static constexpr struct {
    uint32_t flag;
    const char* text;
  } kNotes[] = {{OVT_FLAG_NO_EGO, "no ego poses: tracks are in the vehicle frame"},
                {OVT_FLAG_NO_MAP, "no map: no map gate, the reference heading is the ego vehicle's"},
                {OVT_FLAG_SENSOR_MISSING, "some frames lack a sensor"},
                {OVT_FLAG_EGO_STALE, "some frames have no recent ego pose"},
                {OVT_FLAG_CLOUD_DEGRADED, "some scans have more bad points than good ones"},
                {OVT_FLAG_CLOCK_JUMP, "the stamps jump"},
                {OVT_FLAG_CLOCK_SUSPECT, "stamps of a sensor, of detections or of ego poses do not fit the others'"}};
  for (const auto& note : kNotes)
    if (flags & note.flag) std::printf("note: %s\n", note.text);
  for (const std::string& sentence : session.full_capacities()) std::printf("note: %s\n", sentence.c_str());
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

}  // namespace

int run_command(const Options& options) {
  Config config = load_config_with_rig(options);
  config.keep_images = !options.mcap.empty();  // the view shows them, nothing else here
  const auto stream = io::open_scans(config.input, config.rig);
  make_folder(options.out);
  RunResult result(options.out, config.rig, options.trace);
  std::optional<McapView> view;
  if (!options.mcap.empty()) view.emplace(options.mcap, config);
  result.set_view(view ? &*view : nullptr);
  if (options.picture_at >= 0)
    result.draw_at(options.picture_at, options.out + "/frame_" + std::to_string(options.picture_at) + ".png",
                   config.params);
  Session session(config, &RunResult::on_frame, &result);
  io::write_whole_file(options.out + "/config.toml", format_config(config));

  catch_interrupt();
  Progress progress(1000, options.quiet);
  LineNotes lines;
  io::FrameScans frame;
  while (!interrupted() && stream->next(frame)) {
    lines.add(frame);
    if (config.ego.empty()) session.add_ego(stream->take_ego());
    result.announce(frame);
    session.push(frame);
    result.rethrow_failure();
    if (view) result.add_counters(session.stats());
    progress.show(int64_t(1000 * stream->progress()));
  }
  session.flush();
  result.rethrow_failure();
  result.finish_trace();
  if (view) {
    result.add_counters(session.stats());
    view->close();
  }
  progress.clear();
  const bool is_wrong_map = 2 * result.off_map_count() > result.frame_count();
  if (!options.quiet) {
    std::printf("%s\n%s", result.format_frames().c_str(), result.format_times().c_str());
    if (result.confirmed_count() > 0) {
      std::printf("\n%s at the end%s:\n%s", io::counted(int64_t(result.confirmed_count()), "confirmed track").c_str(),
                  result.confirmed_count() > 10 ? ", ten of them (all are in tracks.csv)" : "",
                  result.format_tracks().c_str());
    }
    std::printf("\n%s. Written to %s: detections.csv tracks.csv timing.csv config.toml\n",
                io::counted(result.frame_count(), "frame").c_str(), options.out.c_str());
    std::printf("Hash of all detections and tracks: %016llx\n", static_cast<unsigned long long>(result.hash()));
    if (result.any_box())
      std::printf("note: the opponent shown is the track nearest to where the recording says it is\n");
    if (config.own_rig || config.own_map)
      std::printf("note: the %s from the log itself\n", !config.own_map   ? "rig is"
                                                        : !config.own_rig ? "map is"
                                                                          : "rig and the map are");
    lines.print(config.rig);
    print_notes(result.flags_of_all(), session);
    if (result.off_map_count() > 0 && !is_wrong_map)
      std::printf("note: %s: the map is not used there\n", result.format_off_map().c_str());
  }
  if (!stream->damage().empty()) {
    std::fprintf(stderr, "overtake: %s: %s; what came before it is done\n", printable(config.input).c_str(),
                 printable(stream->damage()).c_str());
    return kDamaged;
  }
  if (interrupted())
    std::fprintf(stderr, "overtake: interrupted after %s; what is done is kept\n",
                 io::counted(result.frame_count(), "frame").c_str());
  if (is_wrong_map)
    std::fprintf(stderr, "overtake: %s: %s: it is another course's, or the poses are; it was not used there\n",
                 config.map.c_str(), result.format_off_map().c_str());
  return interrupted() ? kInterrupted : is_wrong_map ? kDamaged : 0;
}

}  // namespace overtake::cli
