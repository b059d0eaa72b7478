// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/node.h"

#include <chrono>
#include <cmath>
#include <cstdio>

#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/ros2/graph.h"
#include "tools/ros2/inputs.h"
#include "tools/ros2/outputs.h"

namespace overtake::ros2 {
namespace {

constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr int64_t kWatch_ns = 100'000'000;  // between two looks at the faults

int64_t system_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Node {
 public:
  Node(const cli::Config& config, const NodeOptions& options)
      : config_(config),
        options_(options),
        faults_([](const std::string& line) { std::fprintf(stderr, "overtake: %s\n", cli::printable(line).c_str()); }),
        frames_(first_frames(options)),
        names_(options.name_space, options.name, options.remaps, options.file_remaps),
        participant_(options.domain, options.interface),
        discovery_(participant_),
        outputs_(participant_, names_, frames_.map, frames_.vehicle),
        session_(config, &Outputs::on_frame, &outputs_),
        inputs_(participant_, names_, config.rig, options, frames_, session_, faults_),
        graph_(participant_, names_, gid_bytes_of(options.ros_distro)) {}

  void run() {
    say_hello();
    graph_.update();
    if (options_.publish_tf) outputs_.publish_transforms(config_.rig, frames_.vehicle, system_ns());
    int64_t watched_ns = 0, reported_ns = steady_ns();
    while (!cli::interrupted()) {
      participant_.wait(kWait_ns);
      int64_t now_ns = steady_ns();
      if (discovery_.update()) inputs_.follow(discovery_), graph_.update();
      inputs_.take(now_ns);
      follow_frames();
      now_ns = steady_ns();
      inputs_.advance(now_ns);
      if (now_ns - watched_ns >= kWatch_ns) {
        watched_ns = now_ns;
        inputs_.follow(discovery_);
        inputs_.watch(discovery_, now_ns);
        watch_outputs(now_ns);
      }
      if (now_ns - reported_ns >= kSecond_ns) {
        reported_ns = now_ns;
        watch_network(now_ns);
        report(now_ns);
      }
    }
    session_.flush();
    report(steady_ns());
    say_goodbye();
  }

 private:
  static FrameNames first_frames(const NodeOptions& options) {
    FrameNames frames;
    if (!options.map_frame.empty()) frames.map = options.map_frame, frames.map_fixed = true;
    if (!options.vehicle_frame.empty()) frames.vehicle = options.vehicle_frame, frames.vehicle_fixed = true;
    return frames;
  }

  void say_hello() const {
    const int32_t granted = look_at_sockets().receive_buffer;
    if (granted < kReceiveBuffer)
      std::fprintf(stderr,
                   "overtake: note: the receive buffer has %s, %s are wanted, so that no clouds are lost: "
                   "sysctl -w net.core.rmem_max=%d\n",
                   io::format_size(uint64_t(granted)).c_str(), io::format_size(kReceiveBuffer).c_str(), kReceiveBuffer);
    if (options_.quiet) return;
    std::fprintf(stderr, "overtake: domain %d, rig %s, preset %s, results on %s and the like; Ctrl-C ends it\n",
                 options_.domain, config_.rig.name.c_str(), config_.preset.c_str(), outputs_.topics()[0].c_str());
    for (const std::string& note : session_.file_notes())
      std::fprintf(stderr, "overtake: note: %s\n", cli::printable(note).c_str());
  }

  void say_goodbye() {
    if (options_.quiet) return;
    const ovt_stats stats = session_.stats();
    std::fprintf(stderr, "overtake: %s, %lld detections; %s received, %lld used\n",
                 io::counted(stats.frames, "frame").c_str(), static_cast<long long>(stats.detections),
                 io::counted(stats.pushed, "scan").c_str(), static_cast<long long>(stats.used));
  }

  // The first pose names the frames of reference, unless options do.
  void follow_frames() {
    if (frames_.map == said_.map && frames_.vehicle == said_.vehicle) return;
    const bool moved = frames_.vehicle != said_.vehicle && !said_.vehicle.empty();
    said_ = frames_;
    outputs_.set_frames(frames_.map, frames_.vehicle);
    if (options_.publish_tf && moved) outputs_.publish_transforms(config_.rig, frames_.vehicle, system_ns());
  }

  void watch_outputs(int64_t now_ns) {
    faults_.pass(now_ns);
    for (std::size_t i = 0; i < outputs_.writers().size(); ++i) {
      const std::string& topic = outputs_.topics()[i];
      dds_offered_incompatible_qos_status_t qos{};
      dds_get_offered_incompatible_qos_status(outputs_.writers()[i], &qos);
      if (qos.total_count_change > 0)
        faults_.note("results", "qos " + topic, Level::kWarning,
                     "the quality of service of a subscriber of " + topic + " does not match: its " +
                         policy_name(qos.last_policy_id) + " asks for more than is offered",
                     now_ns);
      for (const auto& [handle, endpoint] : discovery_.endpoints())
        if (!endpoint.writes && endpoint.topic == topic && endpoint.type != outputs_.types()[i])
          faults_.note(
              "results", "type " + topic, Level::kWarning,
              "a subscriber of " + topic + " expects the type " + endpoint.type + ", it is " + outputs_.types()[i],
              now_ns);
    }
    watch_frames(now_ns);
  }

  // Faults that the frames' flags and the library's counters show.
  void watch_frames(int64_t now_ns) {
    const Outputs::Report report = outputs_.take_report(now_ns);
    if (report.suspect_mask != 0) {
      std::vector<std::string> sources;
      for (std::size_t s = 0; s < config_.rig.sensors.size(); ++s)
        if (report.suspect_mask >> s & 1) sources.push_back(config_.rig.sensors[s].name);
      if (report.suspect_mask & OVT_SUSPECT_DETECTIONS) sources.emplace_back("the external detections");
      if (report.suspect_mask & OVT_SUSPECT_EGO) sources.emplace_back("the poses");
      faults_.note("detector", "suspect", Level::kError,
                   "the clock of " + io::join(sources, ", ") + " does not fit the others': its stamps are not used",
                   now_ns);
    }
    struct Flag {
      uint32_t bit;
      const char* kind;
      Level level;
      const char* sentence;
    };
    static constexpr Flag kFlags[] = {
        {OVT_FLAG_CLOCK_JUMP, "jump", Level::kWarning, "the stamps of the sensors jumped: the tracker started again"},
        {OVT_FLAG_EGO_STALE, "stale ego", Level::kWarning, "the ego pose is older than 100 ms"},
        {OVT_FLAG_NO_DATA, "no data", Level::kError, "no scan of a frame has a usable point: this is not 'all clear'"},
        {OVT_FLAG_CLOUD_DEGRADED, "degraded", Level::kWarning,
         "most points of a scan are bad, or in each other's pixels"},
        {OVT_FLAG_NO_GROUND, "no ground", Level::kError,
         "a scan shows hardly any ground: something covers a sensor, or the poses' pitch or roll, a mounting or the "
         "map "
         "is wrong"},
        {OVT_FLAG_EGO_JUMP, "ego jump", Level::kWarning, "the ego poses jump"},
        {OVT_FLAG_VIEW_BLOCKED, "view blocked", Level::kWarning,
         "a part of a sensor's view has no returns: something on its window, the own car, a crest?"},
        {OVT_FLAG_EGO_OFF_MAP, "off map", Level::kError, "the ego vehicle is outside of the map: the map is not used"},
        {OVT_FLAG_SENSOR_MISSING, "missing", Level::kWarning, "frames lack a sensor"},
        {OVT_FLAG_DEADLINE_MISSED, "deadline", Level::kWarning, "frames missed the deadline"},
        {OVT_FLAG_WORK_LIMIT, "work", Level::kWarning, "the tracker reached its work limit in dense clutter"},
        {OVT_FLAG_EXCEPTION, "exception", Level::kError, "a stage of the detector failed"}};
    for (const Flag& flag : kFlags)
      if (report.flags & flag.bit) faults_.note("detector", flag.kind, flag.level, flag.sentence, now_ns);
    if (report.not_sent > 0)
      faults_.note("results", "sent", Level::kWarning, "results were not sent, because a subscriber is too slow",
                   now_ns);
    if (report.unnumbered_tracks > 0)
      faults_.note("results", "numbers", Level::kWarning,
                   "more than " + std::to_string(kTrackTopics) +
                       " confirmed tracks: the others have no odometry and no path (all are in tracks)",
                   now_ns);
    const ovt_stats stats = session_.stats();
    const auto count = [&](const char* kind, int64_t now, int64_t& before, const char* sentence) {
      if (now > before) faults_.note("detector", kind, Level::kWarning, io::counted(now, "scan") + sentence, now_ns);
      before = now;
    };
    count("late", stats.late, late_, " came too late or did not fit the clock, and were not used");
    count("dropped", stats.dropped, dropped_,
          " were not used: replaced by newer ones, too large, or at a jump of the stamps");
    newest_ = report;
  }

  // The kernel drops datagrams when their receive buffer is full; a cloud that lacks one is torn, and never arrives.
  void watch_network(int64_t now_ns) {
    const Sockets sockets = look_at_sockets();
    if (sockets.dropped > dropped_datagrams_)
      faults_.note("network", "dropped", Level::kError,
                   "the kernel dropped " + io::counted(sockets.dropped, "datagram") +
                       " since the start, so clouds are torn and do not arrive: the receive buffer of " +
                       io::format_size(uint64_t(sockets.receive_buffer)) +
                       " is too small (sysctl -w net.core.rmem_max=" + std::to_string(kReceiveBuffer) + ")",
                   now_ns);
    dropped_datagrams_ = sockets.dropped;
  }

  static void add(Status& status, const std::string& key, const std::string& value) {
    status.values.emplace_back(key, value);
  }
  static void add(Status& status, const std::string& key, int64_t value) { add(status, key, std::to_string(value)); }

  // The worst fault is the message; the others are values.
  void judge(Status& status, const std::string& part, const std::string& good) const {
    const auto faults = faults_.of(part);
    status.level = faults.empty() ? Level::kOk : faults[0].level;
    status.message = faults.empty() ? good : faults[0].sentence;
    for (std::size_t i = 1; i < faults.size(); ++i) add(status, "also", faults[i].sentence);
  }

  Status status_of(const Input& input, const std::string& how, int64_t now_ns) const {
    Status status;
    status.name = options_.name + ": " + input.part;
    judge(status, input.part, input.last_ns != 0 ? "received" : input.needed ? "waits for it" : "none");
    add(status, "topic", input.topic.empty() ? "(not found)" : input.topic);
    add(status, "publishers", int64_t(input.publishers));
    add(status, "rate_hz", cli::fixed(input.arrivals.rate(), 1));
    add(status, "received", input.received);
    add(status, "refused", input.refused);
    add(status, "lost", input.lost);
    if (input.last_ns != 0) add(status, "age_ms", cli::fixed(double(now_ns - input.last_ns) * 1e-6, 0));
    if (input.transport_ms.count() > 0) {
      add(status, "transport_p50_ms", cli::fixed(input.transport_ms.quantile(0.5), 2));
      add(status, "transport_p99_ms", cli::fixed(input.transport_ms.quantile(0.99), 2));
    }
    if (!how.empty()) add(status, "read", how);
    return status;
  }

  void report(int64_t now_ns) {
    std::vector<Status> all;
    const ovt_stats stats = session_.stats();
    Status detector;
    detector.name = options_.name + ": detector";
    judge(detector, "detector", stats.frames > 0 ? "runs" : "waits for scans");
    add(detector, "frame_rate_hz", cli::fixed(newest_.rate, 1));
    add(detector, "latency_p50_ms", cli::fixed(newest_.latency_p50_ms, 2));
    add(detector, "latency_p99_ms", cli::fixed(newest_.latency_p99_ms, 2));
    add(detector, "deadline_ms", cli::fixed(double(config_.deadline_ns) * 1e-6, 1));
    add(detector, "deadline_missed", stats.deadline_missed);
    add(detector, "frames", stats.frames);
    add(detector, "scans", stats.pushed);
    add(detector, "scans_used", stats.used);
    add(detector, "scans_dropped", stats.dropped);
    add(detector, "scans_late", stats.late);
    add(detector, "scans_duplicate", stats.dup);
    add(detector, "clock_jumps", stats.clock_jumps);
    add(detector, "ego_poses", stats.ego_poses);
    add(detector, "ego_dropped", stats.ego_dropped);
    add(detector, "ego_held", stats.ego_held);
    add(detector, "ego_rates_wrong", stats.ego_rates_wrong);
    add(detector, "ego_noisy", stats.ego_noisy);
    add(detector, "detections", int64_t(newest_.detections));
    add(detector, "tracks", int64_t(newest_.tracks));
    add(detector, "tracks_confirmed", int64_t(newest_.confirmed));
    for (const std::string& sentence : session_.full_capacities()) add(detector, "capacity", sentence);
    all.push_back(std::move(detector));
    for (std::size_t i = 0; i < inputs_.clouds().size(); ++i)
      all.push_back(status_of(inputs_.clouds()[i], inputs_.how_read(i), now_ns));
    all.push_back(status_of(inputs_.poses(), "", now_ns));
    all.push_back(status_of(inputs_.detections(), "", now_ns));
    if (inputs_.use_sim_time()) all.push_back(status_of(inputs_.clock(), "", now_ns));
    Status results;
    results.name = options_.name + ": results";
    judge(results, "results", "published");
    add(results, "publish_p50_ms", cli::fixed(newest_.publish_p50_ms, 2));
    add(results, "publish_p99_ms", cli::fixed(newest_.publish_p99_ms, 2));
    add(results, "not_sent", newest_.all_not_sent);
    all.push_back(std::move(results));
    const Sockets sockets = look_at_sockets();
    Status network;
    network.name = options_.name + ": network";
    judge(network, "network", "no datagrams lost");
    add(network, "domain", int64_t(options_.domain));
    add(network, "receive_buffer", io::format_size(uint64_t(sockets.receive_buffer)));
    add(network, "datagrams_dropped", sockets.dropped);
    all.push_back(std::move(network));
    const int64_t stamp_ns = inputs_.use_sim_time() && inputs_.sim_ns() != 0 ? inputs_.sim_ns() : system_ns();
    outputs_.publish_diagnostics(all, stamp_ns);
  }

  const cli::Config config_;
  const NodeOptions options_;
  Faults faults_;
  FrameNames frames_, said_{"", "", false, false};
  Names names_;
  Participant participant_;
  Discovery discovery_;
  Outputs outputs_;  // outlives the session, which calls it
  cli::Session session_;
  Inputs inputs_;
  Graph graph_;
  Outputs::Report newest_;
  int64_t late_ = 0, dropped_ = 0, dropped_datagrams_ = 0;
};

}  // namespace

bool is_built() { return true; }

void run_node(cli::Config config, const NodeOptions& options) {
  config.live = true;
  config.keep_images = false;
  config.deadline_ns = options.deadline_ms >= 0 ? std::llround(options.deadline_ms * 1e6) : config.rig.period_ns();
  cli::catch_interrupt();
  Node node(config, options);
  node.run();
}

}  // namespace overtake::ros2
