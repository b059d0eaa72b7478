// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker alone: any detections at any stamps, and restarts. Every published number is finite, every covariance is
// positive definite, no id is used twice, and every row is counted once.
#include <cmath>
#include <set>

#include "tests/fuzz/bytes.h"
#include "tests/support/tracker_bench.h"

using namespace overtake;

namespace {

constexpr int64_t kFarNs = INT64_MAX / 2;  // beyond this, a detection's stamp might overflow

// Cholesky of the lower triangle, row by row, scaled to a unit diagonal: the state's units have very different sizes.
bool is_positive_definite(const TrackTable& t, std::size_t i) {
  double l[5][5] = {}, scale[5];
  for (int32_t r = 0; r < 5; ++r) scale[r] = 1 / std::sqrt(t.covariance[r * (r + 1) / 2 + r][i]);
  for (int32_t r = 0; r < 5; ++r)
    for (int32_t c = 0; c <= r; ++c) {
      double sum = t.covariance[r * (r + 1) / 2 + c][i] * scale[r] * scale[c];
      for (int32_t k = 0; k < c; ++k) sum -= l[r][k] * l[c][k];
      if (r == c && !(sum > -1e-9)) return false;  // tolerates rounding errors
      l[r][c] = r == c ? std::sqrt(std::fmax(sum, 1e-12)) : sum / l[c][c];
    }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  TrackerParams params;
  params.track_capacity = in.in(1, 24);
  params.detection_capacity = in.in(1, 24);
  params.confirm_hits = in.in(1, 6);
  params.horizon_s = 0.3;
  params.keep_hits = in.in(0, params.confirm_hits - 1);
  overtake::test::TrackerBench bench(params);
  std::vector<overtake::test::TestDetection> detections;
  std::set<TrackId> dead, alive;
  int64_t stamp_ns = in.chance(32) ? in.raw<int64_t>() : 0, given = 0;
  for (int32_t step = 0; step < 100 && !in.empty(); ++step) {
    stamp_ns = fuzz::next_stamp(in, stamp_ns);
    const int32_t what = in.in(0, 31);
    if (what == 0) {
      bench.tracker.restart();
    } else {
      const bool wild = in.chance(24);
      detections.resize(std::size_t(in.in(0, 6)));
      for (overtake::test::TestDetection& d : detections) {
        d = {};
        d.x_m = wild ? in.raw<double>() : 0.25 * in.in(-128, 127);
        d.y_m = wild ? in.raw<double>() : 0.25 * in.in(-40, 40);
        if (in.chance(40) && stamp_ns > -kFarNs && stamp_ns < kFarNs) d.late_s = 0.001 * in.in(-60, 60);
        if (in.chance(40)) d.heading_rad = wild ? in.raw<double>() : 0.1 * in.in(-31, 31);
        if (in.chance(40)) {
          d.var_x = wild ? in.raw<double>() : 0.01 * in.in(0, 200);
          d.var_y = wild ? in.raw<double>() : 0.01 * in.in(0, 200);
          d.cov_xy = wild ? in.raw<double>() : 0.01 * in.in(-50, 50);
        }
      }
      bench.frame.ego.known = in.chance(128);
      bench.frame.ego.speed_mps = in.in(0, 90);
      bench.frame.ego.heading_rad = 0.1 * in.in(-31, 31);
      given += int64_t(detections.size());
      bench.step_ns(stamp_ns, detections);
    }
    const int64_t publish_ns = fuzz::next_stamp(in, stamp_ns);
    const TrackTable& t = bench.tracks_at_ns(publish_ns);
    OVT_FUZZ_REQUIRE(t.count == bench.track_count() && t.count <= params.track_capacity);
    OVT_FUZZ_REQUIRE(overtake::test::is_finite(t) && overtake::test::is_finite(bench.paths()));
    std::set<TrackId> now;
    for (std::size_t i = 0; i < std::size_t(t.count); ++i) {
      OVT_FUZZ_REQUIRE(is_positive_definite(t, i));
      OVT_FUZZ_REQUIRE(t.id[i] != kNobody && now.insert(t.id[i]).second);
      // A replay may give an id back to its car; without a replay no deleted id returns.
      OVT_FUZZ_REQUIRE(dead.count(t.id[i]) == 0 || bench.tracker.counts().replays > 0);
    }
    for (const TrackId id : alive)
      if (now.count(id) == 0) dead.insert(id);
    alive = now;
  }
  const TrackerCounts counts = bench.tracker.counts();
  OVT_FUZZ_REQUIRE(counts.measurements == given);
  OVT_FUZZ_REQUIRE(counts.measurements ==
                   counts.hits + counts.births + counts.unborn + counts.rejected + counts.debris + counts.late);
  OVT_FUZZ_REQUIRE(counts.births - counts.deaths == bench.track_count());
  OVT_FUZZ_REQUIRE(counts.deaths ==
                   counts.missed + counts.silent + counts.displaced + counts.unsound + counts.forgotten);
  return 0;
}
