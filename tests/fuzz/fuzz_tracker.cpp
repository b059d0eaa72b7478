// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker of each preset alone: any detections at any stamps, with and without a map, and restarts. Every published
// number is finite, every covariance is positive definite, no id is used twice, and every row is counted once.
#include <cmath>
#include <vector>

#include "core/circuit_map.h"
#include "tests/fuzz/bytes.h"
#include "tests/support/tracker_bench.h"

using namespace overtake;

namespace {

constexpr int64_t kFarNs = INT64_MAX / 2;  // beyond this, a detection's stamp might overflow

const CircuitMap& ring() {
  static const CircuitMap map = [] {
    std::vector<double> x, y, width;
    for (int32_t i = 0; i < 64; ++i) {
      const double turn = 2.0 * kPi * i / 64;
      x.push_back(40.0 * std::sin(turn)), y.push_back(40.0 * (1.0 - std::cos(turn))), width.push_back(8.0);
    }
    CircuitMap made;
    const char* error = nullptr;
    OVT_FUZZ_REQUIRE(made.build(x.data(), y.data(), width.data(), width.data(), nullptr, 64, true, &error));
    return made;
  }();
  return map;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  // The length of an input chooses preset and map: no byte does, so that seeds keep their meaning.
  const char* const method = in.left() % 2 == 1 ? "best" : "paper";
  const CircuitMap* const map = in.left() / 2 % 2 == 1 ? &ring() : nullptr;
  TrackerParams params = test::tracker_params_of(method);
  params.track_capacity = in.in(1, 24);
  params.detection_capacity = in.in(1, 24);
  params.confirm_hits = in.in(1, 6);
  params.horizon_s = 0.3;
  params.keep_hits = in.in(0, params.confirm_hits - 1);
  test::TrackerBench bench(params, map, method);
  test::IdWatch ids(params);
  std::vector<test::TestDetection> detections;
  int64_t stamp_ns = in.chance(32) ? in.raw<int64_t>() : 0, given = 0;
  for (int32_t step = 0; step < 100 && !in.empty(); ++step) {
    stamp_ns = fuzz::next_stamp(in, stamp_ns);
    const int32_t what = in.in(0, 31);
    if (what == 0) {
      bench.tracker.restart();
      ids.restart();
    } else {
      const bool wild = in.chance(24);
      detections.resize(std::size_t(in.in(0, 6)));
      for (test::TestDetection& d : detections) {
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
        if (in.chance(40)) d.score = wild ? in.raw<double>() : 0.01 * in.in(-5, 105);
        if (in.chance(40)) {  // as the rules of a method give it
          d.length_m = wild ? in.raw<double>() : 0.1 * in.in(0, 60);
          d.width_m = wild ? in.raw<double>() : 0.1 * in.in(0, 30);
          d.height_m = wild ? in.raw<double>() : 0.1 * in.in(0, 20);
          d.object_class = wild ? in.raw<int32_t>() : in.in(0, 2);
          d.view = wild ? in.raw<int32_t>() : in.in(-1, 3);
          d.points = wild ? in.raw<int32_t>() : 8 * in.in(0, 255);
          d.free_heading = in.chance(128), d.debris = in.chance(16), d.faint = d.debris && in.chance(128);
        }
      }
      bench.frame.ego.known = in.chance(128);
      bench.frame.in_map = !in.chance(8), bench.frame.ask_map = !in.chance(16);
      bench.frame.ego.speed_mps = in.in(0, 90);
      bench.frame.ego.heading_rad = 0.1 * in.in(-31, 31);
      for (const test::TestDetection& d : detections) given += !d.faint;  // no counter counts those
      bench.step_ns(stamp_ns, detections);
      OVT_FUZZ_REQUIRE(test::is_sound(bench.snapshot()) && ids.accepts(bench.snapshot(), bench.last));
    }
    const int64_t publish_ns = fuzz::next_stamp(in, stamp_ns);
    const TrackTable& t = bench.tracks_at_ns(publish_ns);
    OVT_FUZZ_REQUIRE(t.count == bench.track_count() && t.count <= params.track_capacity);
    OVT_FUZZ_REQUIRE(test::is_finite(t) && test::is_finite(bench.paths()) && test::is_sound(bench.optional()));
    OVT_FUZZ_REQUIRE(test::is_positive_definite(t));
  }
  OVT_FUZZ_REQUIRE(bench.tracker.counts().measurements == given);
  OVT_FUZZ_REQUIRE(test::adds_up(bench.tracker.counts(), bench.track_count()));
  return 0;
}
