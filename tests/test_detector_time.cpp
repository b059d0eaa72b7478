// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stamps that jump or come late, through the C API with one and with two workers.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

// Calls see(info, tracks) for each frame of the bench; `see` outlives the detector.
template <class See>
void watch(DetectorBench& bench, See& see) {
  bench.def.user = &see;
  bench.def.on_frame = [](ovt_reader* reader, void* user) {
    ovt_frame_info info;
    ovt_tracks tracks;
    CHECK(ovt_read_info(reader, &info) == OVT_OK);  // exceptions must not pass through the library
    CHECK(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK);
    (*static_cast<See*>(user))(info, tracks);
  };
}

}  // namespace

TEST_CASE("detector time: a clock jump restarts the tracker at the third stamp, and no id returns") {
  for (const int32_t workers : {1, 2})
    for (const int64_t jump_ns : {3'600'000 * kMs, -3'600'000 * kMs}) {
      CAPTURE(jump_ns);
      DetectorBench bench({.workers = workers, .map = false});
      std::set<uint64_t> before, after;
      std::set<uint64_t>* ids = &before;
      std::vector<uint32_t> flags;
      auto see = [&](const ovt_frame_info& info, const ovt_tracks& tracks) {
        ids->insert(tracks.id, tracks.id + tracks.count);
        flags.push_back(info.flags);
      };
      watch(bench, see);
      bench.create();
      const auto push = [&](std::size_t k, int64_t shift_ns) {
        for (int32_t s = 0; s < 3; ++s) {
          const overtake::SceneFrame& frame = demo_frame(k);
          const ovt_points points = points_of(frame.scan[s], s, frame.stamp_ns + shift_ns);
          REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
        }
      };
      for (std::size_t k = 0; k < 4; ++k) push(k, 0);
      bench.flush();
      ids = &after;
      for (std::size_t k = 4; k < 9; ++k) push(k, jump_ns);
      bench.flush();
      const ovt_stats stats = bench.stats();
      CHECK(adds_up(stats));
      CHECK(stats.clock_jumps == 1);
      CHECK(stats.used == 12 + 9);
      CHECK(stats.dropped == 6);
      CHECK(stats.late == 0);
      REQUIRE(flags.size() == 7);
      for (std::size_t i = 0; i < 7; ++i) CHECK(((flags[i] & OVT_FLAG_CLOCK_JUMP) != 0) == (i == 4));
      CHECK(!before.empty());
      CHECK(!after.empty());
      for (const uint64_t id : after) CHECK(before.count(id) == 0);
    }
}

TEST_CASE("detector time: late scans are inserted at their stamp; the tracks equal those of sorted order") {
  struct Last {
    std::vector<double> state;
    std::vector<uint64_t> ids;
    std::set<uint64_t> confirmed;  // all ids ever published as confirmed
    int32_t late_frames = 0, refiltered = 0, frames = 0;
  };
  const auto run = [](int32_t workers, const std::vector<std::size_t>& order) {
    Last last;
    DetectorBench bench({.workers = workers});
    bench.def.sensor_count = 1;
    auto see = [&](const ovt_frame_info& info, const ovt_tracks& t) {
      ++last.frames;
      if (info.flags & OVT_FLAG_OUT_OF_SEQUENCE) {
        ++last.late_frames;
        CHECK(info.tracks_stamp_ns > info.stamp_ns);
      } else {
        CHECK(info.tracks_stamp_ns == info.stamp_ns);
      }
      last.refiltered += info.refiltered;
      last.state.clear();
      last.ids.assign(t.id, t.id + t.count);
      for (int32_t i = 0; i < t.count; ++i) {
        for (const double* c : {t.x_m, t.y_m, t.speed_mps, t.course_rad, t.yaw_rate_rps}) last.state.push_back(c[i]);
        for (const double* c : t.covariance) last.state.push_back(c[i]);
        if (t.state[i] == OVT_CONFIRMED) last.confirmed.insert(t.id[i]);
        CHECK(((t.flags[i] & OVT_TRACK_STALE) != 0) == (info.tracks_stamp_ns - t.measured_ns[i] > 500 * kMs));
        CHECK(((t.flags[i] & OVT_TRACK_COASTING) == 0) == (t.detection[i] >= 0));
      }
    };
    watch(bench, see);
    bench.create();
    for (std::size_t k = 0; k < order.size(); ++k) bench.push_ego(k);
    for (const std::size_t k : order) REQUIRE(bench.push_scan(k, 0) == OVT_OK);
    bench.flush();
    const ovt_stats s = bench.stats();
    CHECK(s.used == int64_t(order.size()));
    CHECK(s.refiltered == last.late_frames);
    CHECK(s.measurements > 0);
    CHECK(s.measurements ==
          s.measurements_used + s.measurements_unborn + s.measurements_rejected + s.measurements_late);
    return last;
  };
  const Last sorted = run(1, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  CHECK(sorted.late_frames == 0);
  REQUIRE(!sorted.state.empty());
  for (const int32_t workers : {1, 2}) {
    const Last mixed = run(workers, {0, 1, 3, 2, 4, 7, 6, 5, 8, 10, 11, 9});
    CHECK(mixed.frames == 12);
    CHECK(mixed.late_frames == 4);
    CHECK(mixed.refiltered == 1 + 1 + 2 + 2);
    CHECK(mixed.state == sorted.state);  // bit by bit
    CHECK(!mixed.confirmed.empty());
    for (const uint64_t id : mixed.confirmed)  // a published id stays with its car
      CHECK(std::count(mixed.ids.begin(), mixed.ids.end(), id) == 1);
  }
}
