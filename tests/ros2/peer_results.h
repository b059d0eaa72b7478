// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What a node sends back, as files of a folder, and what was lost on the way.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "messagesPubSubTypes.h"
#include "peer_participant.h"
#include "peer_race.h"

namespace overtake::ros2_peer {

using Clock = std::chrono::steady_clock;

inline int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}

class Results {
 public:
  explicit Results(const std::string& folder)
      : detections_(open(folder, "detections.csv")),
        tracks_(open(folder, "tracks.csv")),
        others_(open(folder, "others.csv")),
        diagnostics_(open(folder, "diagnostics.txt")),
        endpoints_(open(folder, "endpoints.csv")),
        graph_(open(folder, "graph.csv")),
        times_(open(folder, "times.csv")) {
    std::fprintf(detections_, "frame_ns,stamp_ns,frame_id,x_m,y_m,z_m,qz,qw,length_m,width_m,id\n");
    std::fprintf(tracks_,
                 "stamp_ns,frame_ns,id,state,frame_id,x_m,y_m,speed_mps,course_rad,yaw_rate_rps,heading_rad,"
                 "age,hits,var_x,var_y\n");
    std::fprintf(others_, "topic,stamp_ns,frame_id,child_frame_id,count,x_m,y_m\n");
    std::fprintf(times_, "what,stamp_ns,at_ns\n");
    std::fprintf(endpoints_, "kind,topic,type,guid\n");
    std::fprintf(graph_, "message,participant,namespace,node,kind,guid\n");
  }
  ~Results() {
    for (std::FILE* file : {detections_, tracks_, others_, diagnostics_, endpoints_, graph_, times_}) std::fclose(file);
  }

  void time(const char* what, int64_t stamp_ns, int64_t at_ns) {
    const std::lock_guard lock(mutex_);
    write_time(what, stamp_ns, at_ns);
  }
  void add_endpoint(const char* kind, const std::string& topic, const std::string& type, const std::string& guid) {
    const std::lock_guard lock(mutex_);
    std::fprintf(endpoints_, "%s,%s,%s,%s\n", kind, topic.c_str(), type.c_str(), guid.c_str());
    std::fflush(endpoints_);
  }
  template <class ParticipantEntitiesInfo>
  void add_graph(const ParticipantEntitiesInfo& m) {
    const std::lock_guard lock(mutex_);
    const std::string participant = hex(m.gid().data());
    for (const auto& node : m.node_entities_info_seq()) {
      const auto put = [&](const char* kind, const std::string& guid) {
        std::fprintf(graph_, "%lld,%s,%s,%s,%s,%s\n", static_cast<long long>(graph_messages_), participant.c_str(),
                     node.node_namespace().c_str(), node.node_name().c_str(), kind, guid.c_str());
      };
      for (const auto& gid : node.reader_gid_seq()) put("reader", hex(gid.data()));
      for (const auto& gid : node.writer_gid_seq()) put("writer", hex(gid.data()));
    }
    ++graph_messages_;
    std::fflush(graph_);
  }
  // A frame whose clouds were all written, with its scans' stamps.
  void add_sent(std::set<int64_t> stamps_ns, std::size_t clouds, std::size_t bytes, int64_t written_ns) {
    const std::lock_guard lock(mutex_);
    sent_.push_back({std::move(stamps_ns), written_ns, 0});
    sent_clouds_ += clouds, sent_bytes_ += bytes;
  }
  // What arrives later is in no table, so that the tables have as many rows as the summary says.
  void summarise(std::size_t poses) {
    const std::lock_guard lock(mutex_);
    is_summarised_ = true;
    std::printf("sent      %zu frames, %zu clouds, %.1f MB, %zu poses\n", sent_.size(), sent_clouds_,
                double(sent_bytes_) * 1e-6, poses);
    std::printf("received  %zu frames with %zu detections, %zu of tracks\n", arrived_.size(), rows_, track_frames_);
    for (const auto& [stamp_ns, at_ns] : arrived_)
      for (Sent& frame : sent_)
        if (frame.stamps_ns.count(stamp_ns)) frame.arrived_ns = at_ns;
    std::vector<double> latency_ms;
    std::string lost;
    for (std::size_t i = 0; i < sent_.size(); ++i)
      if (sent_[i].arrived_ns != 0)
        latency_ms.push_back(double(sent_[i].arrived_ns - sent_[i].written_ns) * 1e-6);
      else
        lost += (lost.empty() ? ": " : ", ") + std::to_string(i);
    std::printf("lost      %zu frames%s\n", sent_.size() - latency_ms.size(), lost.c_str());
    if (latency_ms.empty()) return;
    std::sort(latency_ms.begin(), latency_ms.end());
    const auto quantile = [&](double share) {
      return latency_ms[std::size_t(share * double(latency_ms.size() - 1) + 0.5)];
    };
    std::printf(
        "latency   last cloud of a frame written to its detections: p50 %.2f, p90 %.2f, p99 %.2f, max %.2f ms\n",
        quantile(0.5), quantile(0.9), quantile(0.99), latency_ms.back());
  }
  void add(const vision_msgs::msg::dds_::Detection3DArray_& m) {
    const int64_t at = now_ns(), frame = stamp_of(m.header().stamp());
    const std::lock_guard lock(mutex_);
    if (is_summarised_) return;
    write_time("detections", frame, at);
    arrived_.emplace_back(frame, at);
    rows_ += m.detections().size();
    for (const auto& row : m.detections()) {
      const auto& pose = row.results().at(0).pose().pose();
      std::fprintf(detections_, "%lld,%lld,%s,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%s\n",
                   static_cast<long long>(frame), static_cast<long long>(stamp_of(row.header().stamp())),
                   row.header().frame_id().c_str(), pose.position().x(), pose.position().y(), pose.position().z(),
                   pose.orientation().z(), pose.orientation().w(), row.bbox().size().x(), row.bbox().size().y(),
                   row.id().c_str());
    }
  }
  void add(const overtake_msgs::msg::dds_::Tracks_& m) {
    const int64_t at = now_ns();
    const std::lock_guard lock(mutex_);
    if (is_summarised_) return;
    write_time("tracks", stamp_of(m.frame_stamp()), at);
    ++track_frames_;
    for (const auto& t : m.tracks())
      std::fprintf(tracks_, "%lld,%lld,%llu,%d,%s,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%d,%d,%.17g,%.17g\n",
                   static_cast<long long>(stamp_of(m.header().stamp())),
                   static_cast<long long>(stamp_of(m.frame_stamp())), static_cast<unsigned long long>(t.id()),
                   int(t.state()), m.header().frame_id().c_str(), t.x(), t.y(), t.speed(), t.course(), t.yaw_rate(),
                   t.heading(), t.age(), t.hits(), t.covariance()[0], t.covariance()[2]);
  }
  void add_other(const char* topic, const std_msgs::msg::dds_::Header_& header, const std::string& child,
                 std::size_t count, double x, double y) {
    const std::lock_guard lock(mutex_);
    std::fprintf(others_, "%s,%lld,%s,%s,%zu,%.17g,%.17g\n", topic, static_cast<long long>(stamp_of(header.stamp())),
                 header.frame_id().c_str(), child.c_str(), count, x, y);
    std::fflush(others_);
  }
  void add(const diagnostic_msgs::msg::dds_::DiagnosticArray_& m) {
    const std::lock_guard lock(mutex_);
    for (const auto& status : m.status()) {
      std::fprintf(diagnostics_, "%d %s: %s", int(status.level()), status.name().c_str(), status.message().c_str());
      for (const auto& pair : status.values())
        std::fprintf(diagnostics_, " [%s=%s]", pair.key().c_str(), pair.value().c_str());
      std::fprintf(diagnostics_, "\n");
    }
    std::fflush(diagnostics_);
  }

 private:
  static std::FILE* open(const std::string& folder, const char* name) {
    std::FILE* file = std::fopen((folder + "/" + name).c_str(), "w");
    if (!file) throw std::runtime_error(folder + "/" + name + " cannot be written");
    return file;
  }
  void write_time(const char* what, int64_t stamp_ns, int64_t at_ns) {
    std::fprintf(times_, "%s,%lld,%lld\n", what, static_cast<long long>(stamp_ns), static_cast<long long>(at_ns));
  }
  struct Sent {
    std::set<int64_t> stamps_ns;
    int64_t written_ns = 0, arrived_ns = 0;
  };
  std::FILE *detections_, *tracks_, *others_, *diagnostics_, *endpoints_, *graph_, *times_;
  std::vector<Sent> sent_;
  std::vector<std::pair<int64_t, int64_t>> arrived_;  // stamp and time of arrival of detections
  std::size_t sent_clouds_ = 0, sent_bytes_ = 0, rows_ = 0, track_frames_ = 0;
  int64_t graph_messages_ = 0;
  bool is_summarised_ = false;
  std::mutex mutex_;
};

}  // namespace overtake::ros2_peer
