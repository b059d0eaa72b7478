// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Published tracks (columns.def lists the columns). The tracker keeps its working state (a 5 x 5 covariance per slot)
// elsewhere: pipeline/track.
#pragma once

#include <cstdint>

#include "core/ids.h"

namespace overtake {

enum class TrackState : int32_t { kTentative = 0, kConfirmed = 1 };
inline constexpr int32_t kTrackStateSize = 5;        // x, y, v, phi, omega
inline constexpr int32_t kTrackCovarianceSize = 15;  // lower triangle, row by row

// Health of a track, TrackTable::flags.
inline constexpr uint32_t kTrackCoasting = 1;    // this frame has no measurement of the track
inline constexpr uint32_t kTrackUnobserved = 2;  // no sensor of this frame could see the track's position
inline constexpr uint32_t kTrackStale = 4;       // last measured more than kTrackStale_s ago
inline constexpr double kTrackStale_s = 0.5;

// One row per live track, by slot. Frame of reference: the map, or the vehicle where no ego pose is known.
struct TrackTable {
  int32_t count = 0, capacity = 0;
#define OVT_TRACK(type, name, ...) type* name = nullptr;
#define OVT_TRACK_OWN OVT_TRACK
#define OVT_TRACK_COVARIANCE(type, name, ...) type* name[kTrackCovarianceSize] = {};
#include "core/columns.def"
};
template <class F>
void for_each_column(TrackTable& t, F&& f) {
  static constexpr const char* kCovarianceName[kTrackCovarianceSize] = {"p_xx", "p_yx", "p_yy", "p_vx", "p_vy",
                                                                        "p_vv", "p_cx", "p_cy", "p_cv", "p_cc",
                                                                        "p_wx", "p_wy", "p_wv", "p_wc", "p_ww"};
#define OVT_TRACK(type, name, ...) f(#name, t.name);
#define OVT_TRACK_OWN OVT_TRACK
#define OVT_TRACK_COVARIANCE(type, name, ...) \
  for (int32_t i = 0; i < kTrackCovarianceSize; ++i) f(kCovarianceName[i], t.name[i]);
#include "core/columns.def"
}

// What the last iteration saw of a track: ovt_visibility.
enum class Visibility : int32_t { kSeen = 0, kMissed = 1, kHidden = 2, kOwnShadow = 3, kOutside = 4 };

// The columns of a track that only the trackers of some methods write. Rows as TrackTable.
struct OptionalTrackTable {
  int32_t count = 0, capacity = 0;
#define OVT_TRACK_OPTIONAL(type, name, ...) type* name = nullptr;
#include "core/columns.def"
};
template <class F>
void for_each_column(OptionalTrackTable& t, F&& f) {
#define OVT_TRACK_OPTIONAL(type, name, ...) f(#name, t.name);
#include "core/columns.def"
}

// Predicted path of the tracks in a TrackTable: point k of track i is row i * points_per_track + k, at
// stamp + (k + 1) * step. The optional columns: as OptionalTrackTable.
struct PathTable {
  int32_t count = 0, capacity = 0;
  int32_t points_per_track = 0;
#define OVT_PATH(type, name, ...) type* name = nullptr;
#define OVT_PATH_OPTIONAL OVT_PATH
#include "core/columns.def"
};
template <class F>
void for_each_column(PathTable& t, F&& f) {
#define OVT_PATH(type, name, ...) f(#name, t.name);
#define OVT_PATH_OPTIONAL OVT_PATH
#include "core/columns.def"
}

}  // namespace overtake
