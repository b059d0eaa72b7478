// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// CLEAR MOT (Bernardin & Stiefelhagen 2008): the number of true objects that a tracker follows, and its stability.
// For each frame:
//   1. an object keeps its last track if both exist and are within the gate;
//   2. as many other pairs as possible are formed within the gate, with the least sum of distances;
//   3. the rest are misses (objects) and false positives (tracks).
// An object whose track differs from its last one, however long ago, has switched. A track is the last track of only
// one object, the one it was matched with last: when that object is absent, an earlier one must win the track in step
// 2.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace overtake::metrics {

// A true object or a track of one frame. Ids are unique in a frame; ids of objects and tracks are independent.
struct MotPlace {
  uint64_t id = 0;
  double x_m = 0, y_m = 0;
};

struct ClearMotCounts {
  int64_t frames = 0;
  int64_t objects = 0, tracks = 0;  // rows of all frames; objects = matches + misses
  int64_t matches = 0, misses = 0, false_positives = 0;
  int64_t switches = 0;   // matched with another track than last time
  int64_t fragments = 0;  // matched again after misses (frames without the object are not misses)
  double distance_m = 0;  // sum over the matches

  double mota() const;    // 1 - (misses + false positives + switches) / objects; NaN: no objects
  double motp_m() const;  // mean distance of the matches; NaN: no match
  ClearMotCounts& operator+=(const ClearMotCounts& other);
};

class ClearMot {
 public:
  explicit ClearMot(double gate_m = 2.0) : gate_m_(gate_m) {}

  // Add frames in order of time; either list may be empty. A position that is not finite is never matched.
  void add_frame(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks);

  const ClearMotCounts& counts() const { return counts_; }
  // For the last frame: each object's row in `tracks`, -1 for a miss.
  const std::vector<int32_t>& track_of_object() const { return track_of_object_; }

 private:
  struct Memory {
    uint64_t track = 0;
    bool missed = false;  // since it was last matched
  };
  void keep_last(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks);
  void pair_rest(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks);
  void count(const std::vector<MotPlace>& objects, const std::vector<MotPlace>& tracks);

  double gate_m_;
  ClearMotCounts counts_;
  std::map<uint64_t, Memory> memory_;    // of every object that was ever matched
  std::map<uint64_t, uint64_t> holder_;  // track -> the object it was matched with last
  std::vector<int32_t> track_of_object_;
  std::vector<bool> track_taken_;
};

}  // namespace overtake::metrics
