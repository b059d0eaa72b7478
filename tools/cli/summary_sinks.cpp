// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/summary_sinks.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tools/io/angles.h"

namespace overtake::cli {
namespace {

// To compare with the opponent's box, which is by the pushed pose (io::BagStream).
Place place_by_pose(ovt_frame_info info, const ovt_tracks& tracks, int32_t i) {
  info.ego_heading_offset_rad = 0;
  return place_of(info, tracks, i);
}

double distance(const FinishedFrame& frame, int32_t track) {
  const Place place = place_of(frame.info, frame.tracks, track);
  return std::hypot(place.ahead_m, place.left_m);
}

int32_t nearest_track(const FinishedFrame& frame, double ahead_m, double left_m) {
  int32_t best = -1;
  double best_m = HUGE_VAL;
  for (int32_t i = 0; i < frame.tracks.count; ++i) {
    const Place place = place_by_pose(frame.info, frame.tracks, i);
    const double m = std::hypot(place.ahead_m - ahead_m, place.left_m - left_m);
    if (m < best_m) best = i, best_m = m;
  }
  return best;
}

// Decides the order of the printed table only: walls and posts are thinner than any side of a car.
bool looks_like_car(const ovt_tracks& tracks, int32_t i) {
  return std::min(tracks.length_m[i], tracks.width_m[i]) > 0.5 && std::max(tracks.length_m[i], tracks.width_m[i]) > 1.2;
}

}  // namespace

void CountSink::add(const FinishedFrame& frame) {
  if (frames_ == 0) first_stamp_ns_ = frame.info.first_stamp_ns;
  last_stamp_ns_ = frame.info.stamp_ns;
  for (uint32_t flag = 1; flag != 0; flag <<= 1)
    if (frame.info.flags & flag) ++frames_with_[flag];
  if (frame.info.flags & OVT_FLAG_EGO_OFF_MAP) off_map_m_ = std::max(off_map_m_, frame.info.ego_off_map_m);
  frames_with_ego_ += frame.info.ego_known && !(frame.info.flags & OVT_FLAG_EGO_STALE);
  ++frames_;
}

int64_t CountSink::frames_with(uint32_t flag) const {
  const auto known = frames_with_.find(flag);
  return known == frames_with_.end() ? 0 : known->second;
}

void TimesSink::add(const FinishedFrame& frame) {
  for (int32_t sensor = -1; sensor < sensor_count_; ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      const double us = read_time_us(frame.reader, sensor, ovt_stage(stage));
      if (!std::isnan(us)) times_us_[stage].push_back(us);
    }
}

std::string TimesSink::format() const {
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

void FrameTableSink::add(const FinishedFrame& frame) {
  const auto& box = frame.opponent;
  const ovt_tracks& tracks = frame.tracks;
  const int32_t t = box ? nearest_track(frame, box->x_m, box->y_m) : int32_t(-1);
  const Place none = {NAN, NAN}, place = t < 0 ? none : place_of(frame.info, tracks, t);
  const Place by_pose = t < 0 ? none : place_by_pose(frame.info, tracks, t);
  rows_.push_back({std::to_string(frame.number), std::to_string(frame.info.point_count),
                   std::to_string(frame.info.cluster_count), std::to_string(frame.info.detection_count),
                   std::to_string(tracks.count),
                   t < 0                              ? "-"
                   : tracks.state[t] == OVT_CONFIRMED ? "confirmed"
                                                      : "tentative",
                   fixed(place.ahead_m, 2), fixed(place.left_m, 2),
                   fixed(t < 0 ? NAN : io::deg(tracks.heading_rad[t]), 1), fixed(t < 0 ? NAN : tracks.speed_mps[t], 1),
                   fixed(box ? std::hypot(by_pose.ahead_m - box->x_m, by_pose.left_m - box->y_m) : NAN, 2),
                   fixed(read_time_us(frame.reader, -1, OVT_STAGE_FRAME) * 1e-3, 2)});
  any_opponent_ = any_opponent_ || box;
}

// Prints the opponent's columns only if the recording has the opponent's position: only that identifies its track.
std::string FrameTableSink::format() const {
  const std::vector<std::string> header = {"scan",    "points", "clusters",    "detections", "tracks",    "opponent",
                                           "ahead m", "left m", "heading deg", "speed m/s",  "off box m", "ms"};
  constexpr std::ptrdiff_t kOpponentBegin = 5, kOpponentEnd = 11;
  const auto strip = [this](std::vector<std::string> row) {
    if (!any_opponent_) row.erase(row.begin() + kOpponentBegin, row.begin() + kOpponentEnd);
    return row;
  };
  TextTable table(strip(header));
  for (const auto& row : rows_) table.add(strip(row));
  return table.format(24);
}

void TrackTableSink::add(const FinishedFrame& frame) {
  const ovt_tracks& tracks = frame.tracks;
  std::vector<int32_t> order;
  for (int32_t i = 0; i < tracks.count; ++i)
    if (tracks.state[i] == OVT_CONFIRMED) order.push_back(i);
  count_ = order.size();
  std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
    return std::tuple(!looks_like_car(tracks, a), -tracks.hits[a], distance(frame, a)) <
           std::tuple(!looks_like_car(tracks, b), -tracks.hits[b], distance(frame, b));
  });
  order.resize(std::min(order.size(), kMost));
  table_ = TextTable({"name", "in frame", "x m", "y m", "speed m/s", "course deg", "heading deg", "seen length m",
                      "seen width m", "hits of last " + std::to_string(window_), "age in iterations"});
  for (const int32_t i : order)
    table_.add({track_name(tracks.id[i]), frame.info.reference == OVT_REFERENCE_MAP ? "map" : "vehicle",
                fixed(tracks.x_m[i], 2), fixed(tracks.y_m[i], 2), fixed(tracks.speed_mps[i], 1),
                fixed(io::deg(tracks.course_rad[i]), 1), fixed(io::deg(tracks.heading_rad[i]), 1),
                fixed(tracks.length_m[i], 2), fixed(tracks.width_m[i], 2), std::to_string(tracks.hits[i]),
                std::to_string(tracks.age[i])});
}

}  // namespace overtake::cli
