// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/track/frame_tracker.h"

#include "pipeline/track/iteration.h"

namespace overtake {

int64_t limit_stamp(int64_t stamp_ns, int64_t publish_ns, double most_s) noexcept {
  const double dt_s = seconds_between(stamp_ns, publish_ns);
  const auto most_ns = int64_t(most_s * 1e9);
  if (dt_s > most_s) return stamp_ns + most_ns;  // no overflow: publish_ns lies beyond
  if (dt_s < -most_s) return stamp_ns - most_ns;
  return publish_ns;
}

// A track's own time can be its last measurement's, which is at most kMaxStampSpread_s from its iteration's.
int64_t limit_publish_ns(int64_t stamp_ns, int64_t publish_ns) noexcept {
  return limit_stamp(stamp_ns, publish_ns, kMaxPredict_s - kMaxStampSpread_s);
}

}  // namespace overtake
