// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Options of ros2_peer.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>

namespace overtake::ros2_peer {

struct Options {
  std::string log, folder;
  uint32_t domain = 0;
  int64_t from = 0, frames = 1'000'000'000;
  double rate = 20, shift_s = 0, jump_s = 0, wait_s = 10, linger_s = 0.5;
  int64_t jump_at = -1, silent_from = -1, silent_to = -1;
  std::string prefix, drop_field, frame_id, type, exclusive, latched, only, clock, jump_only, pose_frame, stamp, times;
  int64_t gid_bytes = 24;
  bool poses = true, no_match = false, external = false;
};

inline Options parse(int argc, char** argv) {
  Options o;
  if (argc < 3) throw std::runtime_error("usage: ros2_peer LOG FOLDER [options]");
  o.log = argv[1], o.folder = argv[2];
  const std::map<std::string, std::function<void(const std::string&)>> values = {
      {"--domain", [&](auto& v) { o.domain = uint32_t(std::stoul(v)); }},
      {"--from", [&](auto& v) { o.from = std::stoll(v); }},                // first frame
      {"--frames", [&](auto& v) { o.frames = std::stoll(v); }},            // at most; 0: listens only
      {"--rate", [&](auto& v) { o.rate = std::stod(v); }},                 // frames a second
      {"--shift", [&](auto& v) { o.shift_s = std::stod(v); }},             // of all stamps
      {"--jump-at", [&](auto& v) { o.jump_at = std::stoll(v); }},          // from this frame on ...
      {"--jump", [&](auto& v) { o.jump_s = std::stod(v); }},               // ... the stamps are later by this
      {"--jump-only", [&](auto& v) { o.jump_only = v; }},                  // ... of this sensor alone
      {"--silent-from", [&](auto& v) { o.silent_from = std::stoll(v); }},  // no clouds from this frame on
      {"--silent-to", [&](auto& v) { o.silent_to = std::stoll(v); }},
      {"--prefix", [&](auto& v) { o.prefix = v; }},          // of the topics of clouds and poses
      {"--drop-field", [&](auto& v) { o.drop_field = v; }},  // SENSOR.FIELD is not sent
      {"--frame-id", [&](auto& v) { o.frame_id = v; }},      // SENSOR=FRAME
      {"--pose-frame", [&](auto& v) { o.pose_frame = v; }},  // header.frame_id of the poses from frame 20 on
      {"--type", [&](auto& v) { o.type = v; }},              // SENSOR=type name
      {"--exclusive", [&](auto& v) { o.exclusive = v; }},    // the sensor's writer owns its topic
      {"--latched", [&](auto& v) { o.latched = v; }},        // the reader of this result asks for old ones
      {"--stamp", [&](auto& v) { o.stamp = v; }},            // SENSOR=none: no stamps; SENSOR=repeat: each comes twice
      {"--points", [&](auto& v) { o.times = v; }},           // SENSOR=N: each cloud has its points N times
      {"--gid", [&](auto& v) { o.gid_bytes = std::stoll(v); }},    // bytes of a GUID in ros_discovery_info
      {"--only", [&](auto& v) { o.only = v; }},                    // publishes this sensor alone
      {"--clock", [&](auto& v) { o.clock = v; }},                  // "run": publishes /clock; "back": it goes back
      {"--wait", [&](auto& v) { o.wait_s = std::stod(v); }},       // for subscribers
      {"--linger", [&](auto& v) { o.linger_s = std::stod(v); }}};  // after the last frame
  for (int i = 3; i < argc; ++i) {
    const std::string key = argv[i];
    if (key == "--no-poses")
      o.poses = false;
    else if (key == "--no-match")
      o.no_match = true;  // goes on without subscribers
    else if (key == "--external")
      o.external = true;  // sends detections of another detector, too
    else if (const auto found = values.find(key); found != values.end() && i + 1 < argc)
      found->second(argv[++i]);
    else
      throw std::runtime_error("unknown option " + key);
  }
  return o;
}

// "front=x": "x" if the sensor is front.
inline std::string value_for(const std::string& pair, const std::string& sensor) {
  const auto equals = pair.find('=');
  return equals != std::string::npos && pair.substr(0, equals) == sensor ? pair.substr(equals + 1) : "";
}

}  // namespace overtake::ros2_peer
