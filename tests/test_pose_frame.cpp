// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Poses of a frame's candidates: each is the rectangle of all points of its cluster, from all sensors.
#include <doctest/doctest.h>

#include <vector>

#include "pipeline/detector.h"
#include "tests/support/detector_bench.h"
#include "tests/support/paper_params.h"

namespace {

using namespace overtake;
using namespace overtake::test;

struct Watch {
  Transform mounting[kMaxSensors];
  int32_t alone = 0, joined = 0;  // detections with points of one sensor, of several
  int32_t differ = 0;             // detections with columns that differ from the fit
  int32_t of_map = 0;             // detections with a psi_REF that is not 0
  int32_t on_sensors = 0;         // time spans of the stage in a sensor's part

  static void look(void* user, HookPoint body, Frame& frame, int32_t) {
    auto& watch = *static_cast<Watch*>(user);
    if (body != HookPoint::kTrack) return;
    for (const SensorPart& part : frame.sensors) watch.on_sensors += part.spans[OVT_STAGE_POSE].duration_ns >= 0;
    for (int32_t i = 0; i < frame.detections.count; ++i) watch.check(frame, i);
  }

  void check(const Frame& frame, int32_t i) {
    const DetectionTable& d = frame.detections;
    const FrameClusterTable& merged = frame.merged;
    const int32_t row = d.cluster[i];
    std::vector<float> x_m, y_m;
    int32_t members = 0;
    for (int32_t m = merged.first_member[row]; m >= 0; m = frame.members.next_member[m], ++members) {
      const SensorPart& part = frame.sensors[frame.members.sensor[m]];
      const int32_t cluster = frame.members.cluster[m], begin = part.clusters.point_begin[cluster];
      for (int32_t k = begin; k < begin + part.clusters.point_count[cluster]; ++k) {
        x_m.push_back(part.cluster_points.x_m[k]);
        y_m.push_back(part.cluster_points.y_m[k]);
      }
    }
    ++(members > 1 ? joined : alone);
    of_map += d.heading_ref_rad[i] != 0.0f;
    const float* const at_m = mounting[merged.main_sensor[row]].t;
    const RectangleFit fit = ref::fit_rectangle(test::paper_frame_params().fit_rectangle, x_m.data(), y_m.data(),
                                                int32_t(x_m.size()), d.heading_ref_rad[i], at_m[0], at_m[1]);
    const float seen[] = {d.x_m[i],     d.y_m[i],     d.heading_rad[i], d.heading_var_rad[i], d.ref_x_m[i],
                          d.ref_y_m[i], d.var_x_m[i], d.var_y_m[i],     d.length_m[i],        d.width_m[i]};
    const float wanted[] = {fit.center_x_m, fit.center_y_m, fit.heading_rad, fit.heading_var_rad, fit.ref_x_m,
                            fit.ref_y_m,    fit.var_x_m,    fit.var_y_m,     fit.extent_length_m, fit.extent_width_m};
    const bool same = std::equal(std::begin(seen), std::end(seen), wanted) && d.inliers_ref[i] == fit.inliers_ref &&
                      d.inliers_var[i] == fit.inliers_var &&
                      d.heading_source[i] == int32_t(fit.from_var ? HeadingSource::kVar : HeadingSource::kRef);
    differ += !same;
  }
};

// Frames in which the opponent passes two seams.
Watch run(int32_t workers, bool map, int32_t cluster_capacity = 1024) {
  Watch watch;
  DetectorBench bench({.workers = workers, .map = map});
  bench.def.cluster_capacity = cluster_capacity;
  for (std::size_t s = 0; s < bench.sensors.size(); ++s) {
    const ovt_sensor_def& in = bench.sensors[s];
    watch.mounting[s] = make_transform(in.x_m, in.y_m, in.z_m, in.roll_rad, in.pitch_rad, in.yaw_rad);
  }
  bench.create();
  reinterpret_cast<Detector*>(bench.detector)->set_hook({&Watch::look, &watch});
  for (std::size_t k = 62; k < 74; ++k) bench.push_frame(k, {0, 1, 2});
  bench.flush();
  CHECK(bench.records.size() == 12);
  return watch;
}

TEST_CASE("poses: each detection is the rectangle of all points of its cluster, joined clusters included") {
  for (const int32_t workers : {1, 3})
    for (const bool map : {false, true}) {
      CAPTURE(workers);
      CAPTURE(map);
      const Watch watch = run(workers, map);
      CHECK(watch.alone > (map ? 5 : 50));
      CHECK(watch.joined > 0);
      CHECK(watch.differ == 0);
      CHECK((watch.of_map > 0) == map);
    }
}

TEST_CASE("poses: up to the rounded capacity of the cluster table") {
  const Watch watch = run(1, false, 1);
  CHECK(watch.alone + watch.joined > 12);  // more than one per frame
  CHECK(watch.differ == 0);
}

TEST_CASE("poses: the stage has no time span in a sensor's part, with a map and without") {
  for (const bool map : {false, true}) CHECK(run(1, map).on_sensors == 0);
}

}  // namespace
