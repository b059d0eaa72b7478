// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tracker's part of a frame: how it uses pushed detections, and what a frame without ego pose leaves unchanged.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "pipeline/method/methods.h"
#include "pipeline/stages.h"
#include "pipeline/track/track_stage.h"

namespace {

using namespace overtake;

constexpr int64_t kMs = 1'000'000;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Bench {
  StageContext context;
  TrackStage stage{context, TrackerParams{}};
  Frame frame;

  Bench() {
    FrameSizes sizes;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 256;
    sizes.cluster_capacity = 16;
    sizes.track_state_bytes = stage.tracker().state_bytes();
    REQUIRE(build_frame(frame, sizes, default_allocator()));
  }

  double yaw_rad = 1.5707963267948966, roll_rad = 0, heading_rad = kNan;

  // One pushed detection 20 m ahead. The ego pose, at the origin with heading yaw_rad, is `age_ns` old; < 0: no pose.
  void run(int64_t stamp_ns, int64_t age_ns, int32_t reference = OVT_REFERENCE_VEHICLE, double var_x = kNan,
           double var_y = kNan, double cov_xy = kNan) {
    reset_frame(frame);
    frame.kind = FrameKind::kExternal;
    frame.stamp_ns = stamp_ns;
    frame.external_reference = reference;
    frame.ego.count = age_ns < 0 ? 0 : 1;
    frame.ego.poses[0] = {};
    frame.ego.poses[0].stamp_ns = stamp_ns - age_ns;
    frame.ego.poses[0].yaw_rad = yaw_rad;
    frame.ego.poses[0].roll_rad = roll_rad;
    frame.external.count = 1;
    frame.external.x_m[0] = 20;
    frame.external.y_m[0] = 0;
    frame.external.heading_rad[0] = heading_rad;
    frame.external.var_x[0] = var_x;
    frame.external.var_y[0] = var_y;
    frame.external.cov_xy[0] = cov_xy;
    frame.external.length_m[0] = frame.external.width_m[0] = frame.external.height_m[0] = kNan;
    frame.external.score[0] = kNan;
    stage.run(frame);
  }
  void predict(int64_t stamp_ns, bool with_pose = false) {
    reset_frame(frame);
    frame.kind = FrameKind::kPrediction;
    frame.stamp_ns = stamp_ns;
    frame.ego.count = with_pose ? 1 : 0;
    frame.ego.poses[0] = {};
    frame.ego.poses[0].stamp_ns = stamp_ns;
    stage.run(frame);
  }
};

// The square of half the largest acceleration times age squared.
double extra_variance(double age_s) { return std::pow(0.5 * 26.5 * age_s * age_s, 2); }

}  // namespace

TEST_CASE("track stage: a heading that is no angle is not measured, in the vehicle frame as in the map") {
  for (const int32_t reference : {OVT_REFERENCE_VEHICLE, OVT_REFERENCE_MAP})
    for (const double heading_rad : {HUGE_VAL, -HUGE_VAL, 1e7, kNan}) {
      Bench bench;
      bench.heading_rad = heading_rad;
      bench.run(1000 * kMs, 0, reference);
      REQUIRE(bench.frame.measurements.count == 1);
      CHECK(std::isfinite(bench.frame.measurements.row[0].heading_rad) ==
            (reference == OVT_REFERENCE_MAP && std::isfinite(heading_rad)));  // the tracker drops it there
    }
}

TEST_CASE("track stage: pushed detections in the vehicle frame get the uncertainty of an old ego pose, from 20 ms on") {
  for (const int64_t age_ms : {0, 20, 21, 90, 400}) {
    CAPTURE(age_ms);
    const double extra = age_ms > 20 ? extra_variance(double(age_ms) * 1e-3) : 0.0;
    Bench bench;
    bench.run(1000 * kMs, age_ms * kMs, OVT_REFERENCE_VEHICLE, 1, 4, 0.5);
    REQUIRE(bench.frame.tracks.count == 1);
    CHECK(bench.frame.reference == OVT_REFERENCE_MAP);
    CHECK(bench.frame.tracks.y_m[0] == doctest::Approx(20));
    CHECK(bench.frame.tracks.covariance[0][0] == doctest::Approx(4 + extra).epsilon(1e-12));  // rotated to the left
    CHECK(bench.frame.tracks.covariance[1][0] == doctest::Approx(-0.5));
    CHECK(bench.frame.tracks.covariance[2][0] == doctest::Approx(1 + extra).epsilon(1e-12));

    Bench without;  // without a covariance: the parameters' R
    without.run(1000 * kMs, age_ms * kMs);
    CHECK(without.frame.tracks.covariance[0][0] == doctest::Approx(5 + extra).epsilon(1e-12));
    CHECK(without.frame.tracks.covariance[2][0] == doctest::Approx(5 + extra).epsilon(1e-12));

    Bench senseless;  // an invalid covariance
    senseless.run(1000 * kMs, age_ms * kMs, OVT_REFERENCE_VEHICLE, 1, 1, 2);
    CHECK(senseless.frame.tracks.covariance[0][0] == doctest::Approx(5 + extra).epsilon(1e-12));

    Bench in_map;  // does not need the pose
    in_map.run(1000 * kMs, age_ms * kMs, OVT_REFERENCE_MAP, 1, 4, 0.5);
    CHECK(in_map.frame.tracks.covariance[0][0] == 1);
    CHECK(in_map.frame.tracks.covariance[2][0] == 4);
  }
}

// A frame of scans with one detection of pose_by_view, 20 m ahead.
struct ViewBench {
  StageContext context;
  TrackStage stage{context, make_tracker_params(ovt_default_params(), 64, 64)};
  Frame frame;
  int64_t stamp_ns = 1000 * kMs;
  double yaw_rad = 0.0;  // of the ego vehicle

  explicit ViewBench(StageContext of = {}) : context(std::move(of)) {
    FrameSizes sizes;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 64;
    sizes.cluster_capacity = 16;
    sizes.track_state_bytes = stage.tracker().state_bytes();
    sizes.method = &kBest;
    REQUIRE(build_frame(frame, sizes, default_allocator()));
  }
  void run(ObjectClass object, double roll_rad = 0.0, bool faint = false) {
    stamp_ns += 50 * kMs;
    reset_frame(frame);
    frame.stamp_ns = stamp_ns;
    frame.ego.count = 1;
    frame.ego.poses[0] = {};
    frame.ego.poses[0].stamp_ns = stamp_ns;
    frame.ego.poses[0].roll_rad = roll_rad;
    frame.ego.poses[0].yaw_rad = yaw_rad;
    frame.detections.count = frame.views.count = faint ? 0 : 1;
    frame.faint_count = faint ? 1 : 0;
    frame.detections.stamp_ns[0] = stamp_ns;
    frame.detections.x_m[0] = 20.0f;
    frame.detections.y_m[0] = 0.0f;
    frame.detections.z_m[0] = 0.5f;
    frame.detections.heading_rad[0] = frame.detections.length_m[0] = frame.detections.width_m[0] = 0.0f;
    frame.views.var_x[0] = 0.25f, frame.views.var_y[0] = 0.5f, frame.views.cov_xy[0] = 0.125f;
    frame.views.road_z_m[0] = -1.0f;
    frame.views.object_class[0] = int32_t(object);
    stage.run(frame);
  }
};

TEST_CASE("track stage: a detection with a covariance is measured with it, at the height of the road") {
  ViewBench bench;
  const double roll = 0.3;
  bench.run(ObjectClass::kCar, roll);
  REQUIRE(bench.frame.measurements.count == 1);
  const Measurement& z = bench.frame.measurements.row[0];
  CHECK(z.var_x == doctest::Approx(0.25));
  CHECK(z.var_y == doctest::Approx(0.5 * std::cos(roll) * std::cos(roll)));  // seen from above
  CHECK(z.cov_xy == doctest::Approx(0.125 * std::cos(roll)));
  CHECK(z.x_m == doctest::Approx(20));
  CHECK(z.y_m == doctest::Approx(std::sin(roll)));  // 1 m down the car's up axis, which leans to the right
  REQUIRE(bench.frame.tracks.count == 1);
  CHECK(bench.frame.tracks.covariance[0][0] < 1.0);

  ViewBench turned;  // the ego vehicle looks 60 deg to the left of the map's x
  turned.yaw_rad = std::acos(0.5);
  turned.run(ObjectClass::kCar);
  REQUIRE(turned.frame.measurements.count == 1);
  const Measurement& t = turned.frame.measurements.row[0];
  const double c = 0.5, s = std::sqrt(0.75);
  CHECK(t.var_x == doctest::Approx(c * c * 0.25 + s * s * 0.5 - 2 * c * s * 0.125));
  CHECK(t.var_y == doctest::Approx(s * s * 0.25 + c * c * 0.5 + 2 * c * s * 0.125));
  CHECK(t.cov_xy == doctest::Approx(c * s * (0.25 - 0.5) + (c * c - s * s) * 0.125));
}

TEST_CASE("track stage: the error of the ego heading is part of a covariance, in the map and as published") {
  StageContext context;
  context.method = &kBest;
  context.sensor_count = 1;
  context.detect.ego_heading.constant_sigma_rad = 0.02;
  ViewBench bench(context);
  bench.run(ObjectClass::kCar);
  const double sigma_rad = bench.frame.ego_heading.sigma_rad;
  REQUIRE(sigma_rad > 0.01);
  const double across = 0.5 + sigma_rad * sigma_rad * 20 * 20;
  REQUIRE(bench.frame.measurements.count == 1);
  const Measurement& z = bench.frame.measurements.row[0];
  CHECK(z.var_x == doctest::Approx(0.25));
  CHECK(z.var_y == doctest::Approx(across));
  CHECK(z.cov_xy == doctest::Approx(0.125));
  CHECK(bench.frame.views.var_x[0] == doctest::Approx(0.25));
  CHECK(double(bench.frame.views.var_y[0]) == doctest::Approx(across));
}

TEST_CASE("track stage: debris initiates no track, confirms none, and each of its rows is counted") {
  ViewBench bench;
  for (int32_t i = 0; i < 20; ++i) bench.run(ObjectClass::kDebris);
  CHECK(bench.frame.tracks.count == 0);
  TrackerCounts counts = bench.stage.tracker().counts();
  CHECK(counts.debris == 20);
  CHECK(counts.measurements ==
        counts.hits + counts.births + counts.unborn + counts.rejected + counts.debris + counts.late);

  ViewBench tentative;  // begun by a row of another class
  for (int32_t i = 0; i < 3; ++i) tentative.run(ObjectClass::kUnknown);
  for (int32_t i = 0; i < 12; ++i) tentative.run(ObjectClass::kDebris);
  CHECK((tentative.frame.tracks.count == 0 || tentative.frame.tracks.state[0] == OVT_TENTATIVE));
  CHECK(tentative.stage.tracker().counts().hits > 0);

  ViewBench confirmed;  // a car that is hidden in part stays
  for (int32_t i = 0; i < 10; ++i) confirmed.run(ObjectClass::kCar);
  for (int32_t i = 0; i < 40; ++i) confirmed.run(ObjectClass::kDebris);
  REQUIRE(confirmed.frame.tracks.count == 1);
  CHECK(confirmed.frame.tracks.state[0] == OVT_CONFIRMED);
  CHECK(confirmed.stage.tracker().counts().debris == 0);
}

TEST_CASE("track stage: faint points keep a known car's track, and are neither a detection nor counted") {
  ViewBench alone;
  for (int32_t i = 0; i < 20; ++i) alone.run(ObjectClass::kUnknown, 0.0, true);
  CHECK(alone.frame.tracks.count == 0);
  CHECK(alone.stage.tracker().counts().measurements == 0);

  ViewBench tentative;
  for (int32_t i = 0; i < 2; ++i) tentative.run(ObjectClass::kUnknown);
  const int64_t hits = tentative.stage.tracker().counts().hits;
  for (int32_t i = 0; i < 6; ++i) tentative.run(ObjectClass::kUnknown, 0.0, true);
  CHECK((tentative.frame.tracks.count == 0 || tentative.frame.tracks.state[0] == OVT_TENTATIVE));
  CHECK(tentative.stage.tracker().counts().hits == hits);

  ViewBench confirmed;
  for (int32_t i = 0; i < 10; ++i) confirmed.run(ObjectClass::kCar);
  TrackId id = confirmed.frame.tracks.id[0];
  for (int32_t i = 0; i < 100; ++i) {
    confirmed.run(ObjectClass::kUnknown, 0.0, true);
    REQUIRE(confirmed.frame.tracks.count == 1);
    CHECK(confirmed.frame.tracks.id[0] == id);
    CHECK(confirmed.frame.tracks.state[0] == OVT_CONFIRMED);
    CHECK(confirmed.frame.tracks.detection[0] == -1);
    CHECK((confirmed.frame.tracks.flags[0] & OVT_TRACK_COASTING) != 0);
    CHECK(confirmed.frame.tracks.measured_ns[0] == confirmed.stamp_ns);
  }
  const TrackerCounts counts = confirmed.stage.tracker().counts();
  CHECK(counts.measurements == 10);
  CHECK(counts.measurements ==
        counts.hits + counts.births + counts.unborn + counts.rejected + counts.debris + counts.late);
}

TEST_CASE("track stage: the covariance of a detection pushed in the vehicle frame rotates with the ego yaw") {
  // An ellipse of 4 m^2 along its long axis and 1 m^2 across, the long axis at 15 degrees in the vehicle frame.
  const double degree = 3.14159265358979323846 / 180, mean = 2.5, half = 1.5, axis = 15 * degree;
  for (const double yaw_deg : {-150.0, -30.0, 0.0, 30.0, 60.0, 90.0, 120.0}) {
    CAPTURE(yaw_deg);
    Bench bench;
    bench.yaw_rad = yaw_deg * degree;
    bench.run(1000 * kMs, 0, OVT_REFERENCE_VEHICLE, mean + half * std::cos(2 * axis), mean - half * std::cos(2 * axis),
              half * std::sin(2 * axis));
    REQUIRE(bench.frame.tracks.count == 1);
    const double turned = axis + bench.yaw_rad;
    CHECK(bench.frame.tracks.covariance[0][0] == doctest::Approx(mean + half * std::cos(2 * turned)).epsilon(1e-12));
    CHECK(bench.frame.tracks.covariance[1][0] == doctest::Approx(half * std::sin(2 * turned)).epsilon(1e-12));
    CHECK(bench.frame.tracks.covariance[2][0] == doctest::Approx(mean - half * std::cos(2 * turned)).epsilon(1e-12));
  }
}

TEST_CASE("track stage: on a bank the covariance of a row in the vehicle frame lies in the vehicle's plane") {
  Bench bench;
  bench.yaw_rad = 0, bench.roll_rad = 0.35;
  bench.run(1000 * kMs, 0, OVT_REFERENCE_VEHICLE, 4.0, 1.0, 0.5);
  REQUIRE(bench.frame.tracks.count == 1);
  const double level = std::cos(0.35);  // 1 m to the left is so far on the map
  CHECK(bench.frame.tracks.covariance[0][0] == doctest::Approx(4.0).epsilon(1e-9));
  CHECK(bench.frame.tracks.covariance[1][0] == doctest::Approx(0.5 * level).epsilon(1e-9));
  CHECK(bench.frame.tracks.covariance[2][0] == doctest::Approx(level * level).epsilon(1e-9));
}

TEST_CASE("track stage: an older frame is filtered again and counted, one too old is late") {
  Bench bench;
  for (int k = 0; k < 6; ++k) bench.run((1000 + 50 * k) * kMs, 0);
  CHECK(bench.frame.refiltered == 0);
  const TrackId id = bench.frame.measurements.track[0];
  bench.run(1120 * kMs, 0);
  CHECK(bench.stage.tracker().counts().late_frames == 0);
  CHECK(bench.frame.refiltered == 3);
  CHECK(bench.frame.measurements.track[0] == id);
  REQUIRE(bench.frame.tracks.count == 1);
  CHECK(bench.frame.tracks.id[0] == id);
  CHECK(bench.frame.tracks.detection[0] == 0);
  CHECK(bench.frame.tracks.hits[0] == 7);
  CHECK(bench.frame.tracks.measured_ns[0] == 1250 * kMs);
  bench.run(700 * kMs, 0);
  CHECK(bench.stage.tracker().counts().late_frames == 1);
  CHECK(bench.frame.refiltered == 0);
  CHECK(bench.frame.measurements.track[0] == kNobody);
  CHECK(bench.frame.tracks.hits[0] == 7);
}

TEST_CASE("track stage: the first frame with an ego pose makes an older one late only if it deleted iterations") {
  for (const bool has_iterations : {false, true}) {
    CAPTURE(has_iterations);
    Bench bench;
    if (has_iterations) bench.run(1000 * kMs, -1);  // in the vehicle frame
    bench.run(1100 * kMs, 0);
    bench.run(1050 * kMs, 0);
    CHECK(bench.stage.tracker().counts().late_frames == int64_t(has_iterations));
    CHECK(bench.frame.refiltered == (has_iterations ? 0 : 1));
  }
}

TEST_CASE("track stage: a prediction and a frame without ego pose do not change the tracks") {
  Bench asked, quiet;
  for (Bench* bench : {&asked, &quiet})
    for (int k = 0; k < 10; ++k) bench->run((1000 + 50 * k) * kMs, 0);
  asked.predict(1510 * kMs);
  REQUIRE(asked.frame.tracks.count == 1);
  CHECK(asked.frame.tracks.stamp_ns[0] == 1510 * kMs);
  CHECK(asked.frame.tracks.flags[0] == (kTrackCoasting | kTrackUnobserved));
  CHECK(asked.frame.tracks.detection[0] == -1);
  asked.run(1530 * kMs, -1);  // the tracker works in the map, but the ego's place is unknown
  CHECK(asked.frame.tracks.stamp_ns[0] == 1530 * kMs);
  CHECK(asked.frame.measurements.count == 0);
  CHECK((asked.frame.flags & OVT_FLAG_EGO_STALE) != 0);
  for (Bench* bench : {&asked, &quiet}) bench->run(1550 * kMs, 0);
  CHECK(hash_table(asked.frame.tracks, 0) == hash_table(quiet.frame.tracks, 0));
  asked.predict(3000 * kMs);  // no pose is near
  CHECK(asked.frame.ego_known == 0);
  CHECK((asked.frame.flags & OVT_FLAG_EGO_STALE) != 0);
}

TEST_CASE("track stage: a prediction does not move the tracks to the map") {
  Bench bench;
  for (int k = 0; k < 5; ++k) bench.run((1000 + 50 * k) * kMs, -1);
  REQUIRE(bench.frame.reference == OVT_REFERENCE_VEHICLE);
  bench.predict(1300 * kMs, true);
  CHECK(bench.frame.reference == OVT_REFERENCE_VEHICLE);
  CHECK(bench.frame.tracks.count == 1);
  bench.run(1350 * kMs, 0);
  CHECK(bench.frame.reference == OVT_REFERENCE_MAP);
  CHECK(bench.frame.tracks.hits[0] == 1);
}

// ---- the corrected ego heading -------------------------------------------------------------------------------------

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180;

// A method that measures walls (plain), or one that does not. The ego vehicle stands at the origin and looks along x.
struct HeadingBench {
  StageContext context;
  std::unique_ptr<TrackStage> stage;
  Frame frame;

  explicit HeadingBench(const char* method = "plain") {
    context.method = find_method(method);
    REQUIRE(context.method != nullptr);
    context.sensor_count = 2;
    context.detect.ego_heading = {0.1 * kDegree, 0, 1 * kDegree, 0.2 * kDegree, 0.06 * kDegree, 0};
    stage = std::make_unique<TrackStage>(context, TrackerParams{});
    FrameSizes sizes;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 256;
    sizes.cluster_capacity = 16;
    sizes.track_state_bytes = stage->tracker().state_bytes();
    sizes.method = context.method;
    REQUIRE(build_frame(frame, sizes, default_allocator()));
  }
  // The walls of the two sensors show `left` and `right`; a detection of each sensor 80 m ahead.
  void run(int64_t stamp_ns, double left, double right, HeadingSource source = HeadingSource::kVar,
           bool uses_map = true) {
    reset_frame(frame);
    frame.stamp_ns = frame.first_stamp_ns = stamp_ns;
    frame.uses_map = uses_map;
    frame.restart = restart;
    frame.ego.count = 1;
    frame.ego.poses[0] = {};
    frame.ego.poses[0].stamp_ns = stamp_ns;
    frame.walls[0] = {true, left, 1e-9, 40};
    frame.walls[1] = {sees_right, right, 1e-9, 30};
    frame.merged.count = frame.detections.count = 2;
    for (int32_t i = 0; i < 2; ++i) {
      frame.merged.main_sensor[i] = i;
      DetectionTable& d = frame.detections;
      d.cluster[i] = i, d.stamp_ns[i] = stamp_ns;
      d.x_m[i] = 80, d.y_m[i] = 0, d.z_m[i] = 0, d.heading_rad[i] = 0.02f, d.length_m[i] = 4, d.width_m[i] = 1.8f;
      d.heading_source[i] = int32_t(source);
      if (frame.views.capacity == 0) continue;
      frame.views.count = 2;
      frame.views.var_x[i] = frame.views.var_y[i] = 1, frame.views.cov_xy[i] = 0, frame.views.road_z_m[i] = 0;
      frame.views.object_class[i] = OVT_CLASS_CAR;
      frame.views.ego_offset_rad[i] = 7;
    }
    stage->run(frame);
  }
  void learn(double left, double right) {
    for (int k = 0; k < 60; ++k) run((1000 + 50 * k) * kMs, left, right);
  }
  bool restart = false, sees_right = true;
  double y(int32_t i) const { return frame.measurements.row[i].y_m; }
  double heading(int32_t i) const { return frame.measurements.row[i].heading_rad; }
};

}  // namespace

TEST_CASE("track stage: detections go to the map with the heading that the walls of their sensor gave") {
  HeadingBench bench("best");
  bench.run(900 * kMs, 1 * kDegree, 0.8 * kDegree);
  CHECK(bench.frame.views.ego_offset_rad[0] == 0);
  CHECK(bench.y(0) == doctest::Approx(0).epsilon(1e-9));  // nothing learned so far
  CHECK((bench.frame.flags & OVT_FLAG_EGO_HEADING) != 0);
  CHECK(bench.frame.ego_heading.offset_rad == 0);
  CHECK(bench.frame.ego_heading.sigma_rad > 0.5 * kDegree);
  bench.learn(1 * kDegree, 0.8 * kDegree);
  CHECK(bench.y(0) == doctest::Approx(80 * std::sin(1 * kDegree)).epsilon(0.02));
  CHECK(bench.y(1) == doctest::Approx(80 * std::sin(0.8 * kDegree)).epsilon(0.02));
  CHECK(bench.frame.ego_heading.offset_rad == doctest::Approx(0.9 * kDegree).scale(0).epsilon(0.02));
  CHECK(bench.frame.ego_heading.sigma_rad < 0.2 * kDegree);
  CHECK(bench.frame.ego_heading.sigma_rad > 0.03 * kDegree);
  CHECK(bench.frame.ego_heading.wall_points == 70);
  CHECK((bench.frame.flags & OVT_FLAG_EGO_HEADING) == 0);
  // Rows with a view say which offset they got.
  const double yaw_0 = std::atan2(bench.y(0), bench.frame.measurements.row[0].x_m);
  CHECK(double(bench.frame.views.ego_offset_rad[0]) == doctest::Approx(yaw_0).epsilon(1e-5));
  CHECK(bench.frame.views.ego_offset_rad[0] > bench.frame.views.ego_offset_rad[1]);
  // What the caller pushed stays.
  CHECK(bench.frame.ego.poses[0].yaw_rad == 0);
  CHECK(bench.frame.ego_state.pose.yaw_rad == 0);
}

TEST_CASE("track stage: a row has the variance of the heading that its own sensor knows") {
  HeadingBench bench("best");
  bench.sees_right = false;
  bench.learn(1 * kDegree, 0);
  const auto sigma_of = [&](int32_t row) { return std::sqrt(double(bench.frame.views.var_y[row]) - 1) / 80; };
  CHECK(sigma_of(0) < 0.1 * kDegree);
  CHECK(sigma_of(1) > 0.2 * kDegree);  // the other sensor's error plus its own, which no wall has shown
  CHECK(sigma_of(1) < 0.4 * kDegree);
  CHECK(bench.frame.ego_heading.sigma_rad > sigma_of(0));
  CHECK(bench.frame.ego_heading.sigma_rad < sigma_of(1));
}

TEST_CASE("track stage: psi_VAR turns with the corrected heading to the map; psi_REF of the map, to the vehicle") {
  HeadingBench bench;
  bench.learn(1 * kDegree, 1 * kDegree);
  CHECK(bench.heading(0) == doctest::Approx(0.02 + 1 * kDegree).scale(0).epsilon(0.01));
  CHECK(bench.frame.detections.heading_rad[0] == 0.02f);
  bench.run(4000 * kMs, 1 * kDegree, 1 * kDegree, HeadingSource::kRef);
  CHECK(bench.heading(0) == doctest::Approx(0.02).epsilon(1e-6));
  CHECK(double(bench.frame.detections.heading_rad[0]) == doctest::Approx(0.02 - 1 * kDegree).scale(0).epsilon(1e-3));
  CHECK(bench.y(0) == doctest::Approx(80 * std::sin(1 * kDegree)).epsilon(0.02));
  bench.run(4050 * kMs, 1 * kDegree, 1 * kDegree, HeadingSource::kRef, false);  // then it is the ego's axis
  CHECK(bench.heading(0) == doctest::Approx(0.02 + 1 * kDegree).scale(0).epsilon(0.01));
  CHECK(bench.frame.detections.heading_rad[0] == 0.02f);
}

TEST_CASE("track stage: walls that contradict what was learned set the flag and change nothing") {
  HeadingBench bench;
  bench.learn(0.5 * kDegree, 0.5 * kDegree);
  const double before = bench.frame.ego_heading.offset_rad;
  bench.run(4000 * kMs, 2 * kDegree, 2 * kDegree);
  CHECK((bench.frame.flags & OVT_FLAG_EGO_HEADING) != 0);
  bench.run(4600 * kMs, 0.5 * kDegree, 0.5 * kDegree);
  CHECK((bench.frame.flags & OVT_FLAG_EGO_HEADING) == 0);
  CHECK(bench.frame.ego_heading.offset_rad == doctest::Approx(before).epsilon(0.01));
}

TEST_CASE("track stage: pushed detections in the vehicle frame take the corrected heading, those in the map do not") {
  HeadingBench bench;
  bench.learn(1 * kDegree, 1 * kDegree);
  for (const int32_t reference : {OVT_REFERENCE_VEHICLE, OVT_REFERENCE_MAP}) {
    reset_frame(bench.frame);
    bench.frame.kind = FrameKind::kExternal;
    bench.frame.stamp_ns = 4000 * kMs;
    bench.frame.external_reference = reference;
    bench.frame.ego.count = 1;
    bench.frame.ego.poses[0] = {};
    bench.frame.ego.poses[0].stamp_ns = 4000 * kMs;
    bench.frame.external.count = 1;
    bench.frame.external.x_m[0] = 50, bench.frame.external.y_m[0] = 0;
    for (double* column : {bench.frame.external.heading_rad, bench.frame.external.var_x, bench.frame.external.var_y,
                           bench.frame.external.cov_xy, bench.frame.external.length_m, bench.frame.external.width_m,
                           bench.frame.external.height_m, bench.frame.external.score})
      column[0] = kNan;
    bench.stage->run(bench.frame);
    const double turned = reference == OVT_REFERENCE_VEHICLE ? 50 * std::sin(1 * kDegree) : 0;
    CHECK(bench.y(0) == doctest::Approx(turned).epsilon(0.02));
  }
}

TEST_CASE("track stage: with a method that measures no walls the published heading stays") {
  HeadingBench paper("paper");
  paper.learn(1 * kDegree, 1 * kDegree);
  CHECK(paper.y(0) == 0);
  CHECK(paper.frame.ego_heading.offset_rad == 0);
  CHECK(paper.frame.ego_heading.sigma_rad == 0);
  CHECK(paper.frame.ego_heading.wall_points == 0);
  CHECK((paper.frame.flags & OVT_FLAG_EGO_HEADING) == 0);
}

TEST_CASE("track stage: after a jump of the clock back, the learned heading stays, and learning goes on") {
  HeadingBench bench;
  for (int k = 0; k < 60; ++k) bench.run((90'000 + 50 * k) * kMs, 1 * kDegree, 1 * kDegree);
  bench.restart = true;
  bench.run(900 * kMs, 1 * kDegree, 1 * kDegree);
  bench.restart = false;
  CHECK(bench.frame.ego_heading.offset_rad == doctest::Approx(1 * kDegree).scale(0).epsilon(0.02));
  for (int k = 0; k < 60; ++k) bench.run((1000 + 50 * k) * kMs, 1.2 * kDegree, 1.2 * kDegree);
  CHECK(bench.frame.ego_heading.offset_rad > 1.05 * kDegree);
}

TEST_CASE("track stage: a detection has the ego pose of its own stamp, also where the frame's is nearly too old") {
  for (const Method* const method : {&kPaper, &kBest}) {
    CAPTURE(method->name);
    StageContext context;
    context.method = method;
    TrackStage stage(context, make_tracker_params(ovt_default_params(), 64, 64));
    FrameSizes sizes;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 64;
    sizes.cluster_capacity = 16;
    sizes.track_state_bytes = stage.tracker().state_bytes();
    sizes.method = method;
    Frame frame;
    REQUIRE(build_frame(frame, sizes, default_allocator()));
    // The last pose is 480 ms older than the frame, and serves it. What is far later has no place in the map.
    for (const int64_t after_ms : {0, 40, 600}) {
      reset_frame(frame);
      frame.stamp_ns = 1000 * kMs;
      frame.ego.count = 1;
      frame.ego.poses[0] = {};
      frame.ego.poses[0].stamp_ns = 520 * kMs;
      frame.ego.poses[0].x_m = 1000, frame.ego.poses[0].y_m = 2000, frame.ego.poses[0].speed_mps = 50;
      DetectionTable& rows = frame.detections;
      rows.count = 1;
      rows.stamp_ns[0] = frame.stamp_ns + after_ms * kMs;
      rows.x_m[0] = 20;
      rows.y_m[0] = rows.z_m[0] = rows.heading_rad[0] = rows.length_m[0] = rows.width_m[0] = 0;
      rows.cluster[0] = 0;
      if (frame.views.capacity > 0) {
        frame.views.count = 1;
        frame.views.var_x[0] = frame.views.var_y[0] = 0.25f;
        frame.views.cov_xy[0] = frame.views.road_z_m[0] = 0;
        frame.views.object_class[0] = int32_t(ObjectClass::kCar);
      }
      const int64_t rejected = stage.tracker().counts().rejected;
      stage.run(frame);
      CHECK(frame.ego_known);
      REQUIRE(frame.measurements.count == 1);
      if (after_ms < 600) CHECK(frame.measurements.row[0].x_m == doctest::Approx(1020 + 0.05 * double(480 + after_ms)));
      CHECK(stage.tracker().counts().rejected == rejected + (after_ms == 600));
      for (int32_t i = 0; i < frame.tracks.count; ++i) CHECK(frame.tracks.x_m[i] > 900);
    }
  }
}

TEST_CASE("track stage: pushed rows in the map wait for an ego pose after scans were tracked in the vehicle frame") {
  for (const bool waits : {false, true}) {
    CAPTURE(waits);
    Bench bench;
    if (waits) {
      reset_frame(bench.frame);
      bench.frame.stamp_ns = 0;
      bench.frame.ego.count = 0;
      bench.stage.run(bench.frame);
    }
    bench.run(50 * kMs, -1, OVT_REFERENCE_MAP);
    CHECK(bench.frame.reference == (waits ? OVT_REFERENCE_VEHICLE : OVT_REFERENCE_MAP));
    CHECK(bench.frame.lost_rows == (waits ? 1 : 0));
    CHECK(((bench.frame.flags & OVT_FLAG_NO_EGO) != 0) == waits);
    CHECK((bench.frame.flags & OVT_FLAG_EGO_STALE) == 0);
  }
}

TEST_CASE("track stage: scans without an ego pose end the map that pushed rows chose, and no empty push chooses one") {
  Bench bench;
  bench.run(0, -1, OVT_REFERENCE_MAP);
  CHECK(bench.frame.reference == OVT_REFERENCE_MAP);
  reset_frame(bench.frame);
  bench.frame.stamp_ns = 50 * kMs;
  bench.frame.ego.count = 0;
  bench.stage.run(bench.frame);
  CHECK(bench.frame.reference == OVT_REFERENCE_VEHICLE);
  CHECK((bench.frame.flags & OVT_FLAG_NO_EGO) != 0);
  CHECK((bench.frame.flags & OVT_FLAG_EGO_STALE) == 0);
  CHECK(bench.frame.lost_rows == 0);
  bench.run(100 * kMs, -1, OVT_REFERENCE_MAP);
  CHECK(bench.frame.reference == OVT_REFERENCE_VEHICLE);
  CHECK(bench.frame.lost_rows == 1);

  Bench empty;
  reset_frame(empty.frame);
  empty.frame.kind = FrameKind::kExternal;
  empty.frame.external_reference = OVT_REFERENCE_MAP;
  empty.frame.stamp_ns = 0;
  empty.frame.ego.count = 0;
  empty.stage.run(empty.frame);
  CHECK(empty.frame.reference == OVT_REFERENCE_VEHICLE);
}

TEST_CASE("track stage: a prediction with an ego pose does not make the map, which pushed rows chose, the ego pose's") {
  for (const bool asks : {false, true}) {
    CAPTURE(asks);
    Bench bench;
    bench.run(0, -1, OVT_REFERENCE_MAP);
    if (asks) {
      bench.predict(50 * kMs, true);
      REQUIRE(bench.frame.ego_known == 1);
    }
    reset_frame(bench.frame);
    bench.frame.stamp_ns = 1000 * kMs;  // scans without a pose
    bench.frame.ego.count = 0;
    bench.stage.run(bench.frame);
    CHECK(bench.frame.reference == OVT_REFERENCE_VEHICLE);
  }
}

TEST_CASE("track stage: the map that pushed rows chose stays once an ego pose was known") {
  Bench bench;
  bench.run(0, -1, OVT_REFERENCE_MAP);
  bench.run(50 * kMs, 50 * kMs, OVT_REFERENCE_MAP);
  reset_frame(bench.frame);
  bench.frame.stamp_ns = 5000 * kMs;  // the pose is too old
  bench.stage.run(bench.frame);
  CHECK(bench.frame.reference == OVT_REFERENCE_MAP);
}
