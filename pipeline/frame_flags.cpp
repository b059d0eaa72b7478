// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/frame_flags.h"

namespace overtake {
namespace {

constexpr int64_t kManyPoints = 1000, kGroundShare = 50;  // one of so many points is ground
constexpr float kBeside_m = 3.0f;  // what begins nearer may be a car beside this one, which fills the view

bool lacks_ground(const SensorPart& part, int64_t good) noexcept {
  for (int32_t c = 0; c < part.clusters.count; ++c)
    if (part.clusters.nearest_m[c] < kBeside_m) good -= part.clusters.point_count[c];
  return good >= kManyPoints && kGroundShare * count_ground(part) < good;
}

}  // namespace

int64_t count_ground(const SensorPart& part) noexcept {
  return part.reason_count[int32_t(Reason::kLabelled)] -
         (part.cluster_points.count - part.reason_count[int32_t(Reason::kOwnBody)]);
}

int64_t count_usable(const SensorPart& part) noexcept {
  int64_t usable = part.kept.points.count;
  for (int32_t r = 1; r < int32_t(Reason::kDust); ++r) usable -= part.reason_count[r];
  return usable;
}

uint32_t flags_of(const Frame& frame, int32_t sensor_count, bool tracks_overflowed, int64_t deadline_ns) noexcept {
  uint32_t flags = 0;
  int64_t usable = 0;
  for (int32_t s = 0; s < sensor_count; ++s) {
    const SensorPart& part = frame.sensors[s];
    if (!part.present) continue;
    const int64_t count = part.kept.points.count, good = count_usable(part);
    const int64_t shadowed =
        part.reason_count[int32_t(Reason::kDust)] + part.reason_count[int32_t(Reason::kSecondReturn)];
    usable += good;
    if (good == 0 || 2 * good < count || 4 * shadowed > 3 * count) flags |= OVT_FLAG_CLOUD_DEGRADED;
    if (part.kept.images.height_m.data && lacks_ground(part, good)) flags |= OVT_FLAG_NO_GROUND;
    if (part.cluster_overflow) flags |= OVT_FLAG_OVERFLOW;
  }
  if (frame.kind == FrameKind::kScans && usable == 0) flags |= OVT_FLAG_NO_DATA;
  if (frame.merged_overflow || frame.candidate_overflow || tracks_overflowed) flags |= OVT_FLAG_OVERFLOW;
  if (deadline_ns > 0 && frame.latency_ns > deadline_ns) flags |= OVT_FLAG_DEADLINE_MISSED;
  return flags;
}

}  // namespace overtake
