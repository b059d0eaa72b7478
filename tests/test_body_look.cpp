// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The gates of preset `best` that look at the points of a candidate: smoke, ground, signs and reflectors are no cars,
// and beyond a bound only a car beyond doubt is one.
#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

#include "tests/support/rules_bench.h"

namespace {

using namespace overtake;
using namespace overtake::test;

// Candidates that remain of what sensor 0 sees. Gated ones are no solid body of a car.
int32_t keep_seen(const std::vector<Solid>& solids, bool with_map = true, double row_pitch_rad = 0.0035) {
  RulesBench bench(with_map);
  bench.look(solids, row_pitch_rad);
  gate(bench);
  CHECK(bench.frame.gated_size == bench.frame.merged.count - bench.frame.kept_count);
  return bench.frame.kept_count;
}

// So much smoke that dark points may be of it.
const Solid kSmoke = {25, -8, 0, 0.1, 2.0, 0.2, 1.4, -1, 0.01f};

TEST_CASE("body look: what is as dark as the smoke around it and lies on no surface is smoke") {
  // Specks of one cluster, of which each is nearer or farther than the one beside it; smoke beside them.
  const auto specks = [](float intensity, int32_t bright, bool with_smoke = true, bool in_threes = false,
                         int32_t count = 12) {
    std::vector<Solid> solids;
    for (int32_t k = 0; k < count; ++k)
      solids.push_back({20 + 0.7 * (in_threes ? k / 3 % 2 : k % 3), 0.08 * k, 0, 0.02, 0.06,
                        in_threes ? 0.4 : 0.4 + 0.1 * (k % 2), in_threes ? 0.47 : 0.47 + 0.1 * (k % 2), 1,
                        k < bright ? 1.0f : intensity});
    if (with_smoke) solids.push_back({20, 4, 0, 0.02, 0.5, 0.3, 0.8, -1, 0.01f});
    return solids;
  };
  CHECK(keep_seen(specks(0.05f, 0)) == 0);
  CHECK(keep_seen(specks(0.05f, 1)) == 0);
  CHECK(keep_seen(specks(0.2f, 0)) == 1);          // brighter than smoke
  CHECK(keep_seen(specks(0.05f, 6)) == 1);         // as a part of it: something stands in the smoke
  CHECK(keep_seen(specks(0.05f, 0, false)) == 0);  // fresh smoke is dense: there is no other
  CHECK(keep_seen(specks(0.05f, 2, false)) == 1);  // and something is bright
  CHECK(keep_seen(specks(0.05f, 0, true, false, 4)) == 0);
  CHECK(keep_seen(specks(0.05f, 0, false, false, 4)) == 1);  // of few points
  CHECK(keep_seen(specks(0.05f, 0, true, true)) == 0);       // two of three points lie beside another one
  CHECK(keep_seen(specks(0.05f, 1, true, true, 9)) == 1);    // and something is bright
  const Solid smoke = {20, 4, 0, 0.02, 0.5, 0.3, 0.8, -1, 0.01f};
  CHECK(keep_seen({{20, 0, 0, 0.02, 1.5, 0.2, 0.8, 1, 0.05f}, smoke}) == 1);    // a surface
  CHECK(keep_seen({{20, 0, 0, 0.02, 1.5, 0.2, 0.8, 1, 0.05f}, kSmoke}) == 0);   // among much smoke
  CHECK(keep_seen({{20, 0, 0, 0.02, 0.18, 0.4, 0.54, 1, 0.05f}, smoke}) == 1);  // of few points
}

TEST_CASE(
    "body look: bright specks are no body if the sensor looks between them, unless a nearer object hides the rest") {
  // Over the rear of a car.
  const auto kept = [](double x_m, double size_m, bool before_nothing = false, int32_t step = 1) {
    std::vector<Solid> specks;
    if (before_nothing) specks.push_back({x_m + 3, 0, 0, 0.02, 6, 0.0, 3.0, -2});
    for (int32_t k = 0; k < 9; k += step)
      specks.push_back(
          {x_m + 0.2 * (k % 4), -0.8 + 0.2 * k, 0, 0.02, size_m, 0.2 + 0.3 * (k % 3), 0.2 + 0.3 * (k % 3) + size_m});
    return keep_seen(specks);
  };
  CHECK(kept(10, 0.06) == 0);
  CHECK(kept(10, 0.3) == 1);  // of a body's size
  CHECK(kept(35, 0.1) == 0);
  CHECK(kept(39, 0.14, false, 2) == 0);
  CHECK(kept(41, 0.14, false, 2) == 1);  // so far away a body may be too dark to return anything
  CHECK(kept(10, 0.06, true) == 0);
  CHECK(kept(10, 0.11) == 0);
  CHECK(kept(10, 0.11, true) == 1);  // the bright parts of a body that is black, or in the shadow of the own wing
  // Through slits between boards a tenth of a body is seen.
  std::vector<Solid> fence = {{12, 0, 0, 0.5, 1.6, 0.1, 0.9}};
  for (int32_t k = -4; k <= 4; ++k) fence.push_back({9, 0.4 * k, 0, 0.02, 0.36, 0.0, 1.2, 0});
  CHECK(keep_seen(fence) == 1);
}

TEST_CASE("body look: where intensities are not above 0, nothing is dark") {
  for (const float intensity : {0.0f, -1.0f, -100.0f}) {
    CAPTURE(intensity);
    RulesBench bench;
    std::vector<Solid> solids;  // twelve specks, none of which lies on a surface with another one
    for (int32_t k = 0; k < 12; ++k)
      solids.push_back({20 + 0.7 * (k % 3), 0.08 * k, 0, 0.02, 0.06, 0.4 + 0.1 * (k % 2), 0.47 + 0.1 * (k % 2), 1});
    bench.look(solids);
    std::fill_n(bench.frame.sensors[0].scan.intensity, bench.frame.sensors[0].scan.count, intensity);
    bench.frame.sensors[0].ground_light = {.light = intensity};
    gate(bench);
    CHECK(bench.frame.kept_count == 1);
  }
}

TEST_CASE("body look: gaps in a dark surface are no jumps of smoke") {
  // Columns of a plate, of which the beam that hits it comes back from every second column only.
  const auto kept = [](double jump_m) {
    std::vector<Solid> plate = {{20.8, 0, 0, 0.01, 6, 0, 2, -2}};  // nothing comes back from behind
    for (int32_t k = 0; k < 12; ++k)
      plate.push_back({20 + jump_m * (k % 2), 0.1 * k, 0, 0.02, 0.05, 0.2, 0.8, 1, 0.05f});
    return keep_seen(plate);
  };
  CHECK(kept(0.0) == 1);
  CHECK(kept(0.7) == 0);
}

TEST_CASE("body look: on the apron, up to 5 m beyond a bound, what is a car beyond doubt stays") {
  // The bound is 6 m to the left. Number of candidates that remain of one solid, whose right side is at right_m.
  const auto kept = [](double x_m, double length_m, double width_m, double low_m, double high_m, float intensity = 1.0f,
                       double right_m = 6.5, double row_pitch_rad = 0.0035) {
    RulesBench bench;
    bench.look({{x_m, right_m + 0.5 * width_m, 0, length_m, width_m, low_m, high_m, 1, intensity}, kSmoke},
               row_pitch_rad);
    gate(bench);
    CHECK(bench.frame.gated_map + bench.frame.gated_size == 1 - bench.frame.kept_count);
    return bench.frame.kept_count;
  };
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1) == 1);
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 1.0f, 9.9) == 1);
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 1.0f, 10.6) == 0);  // its centre is farther out
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 0.05f) == 0);       // as dark as smoke
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 3.0f) == 1);
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 5.0f) == 0);  // so bright is a sign
  CHECK(kept(25, 4.0, 0.3, 0.1, 1.1) == 0);        // a piece of a wall
  CHECK(kept(25, 1.9, 1.9, 0.1, 1.1) == 0);        // a sign
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.5) == 0);        // higher than a car
  CHECK(kept(25, 4.9, 1.9, 0.5, 1.1) == 0);        // does not stand on the ground
  CHECK(kept(12, 4.9, 1.9, 0.0, 0.65) == 1);
  CHECK(kept(12, 4.9, 1.9, 0.0, 0.57) == 0);                   // lower than a car
  CHECK(kept(25, 4.9, 1.9, 0.1, 1.1, 1.0f, 6.5, 0.016) == 1);  // three rows
  CHECK(kept(12, 4.9, 1.9, 0.1, 1.1, 1.0f, 6.5, 0.046) == 0);  // two
  CHECK(kept(120, 4.9, 1.9, 0.1, 1.1) == 0);                   // few points
}

TEST_CASE("body look: on the apron nothing stays whose points lie beside no other one on a surface") {
  // Posts in a row that is 3 m wide and 1.2 m deep.
  const auto kept = [](double apart_m) {
    std::vector<Solid> posts;
    for (double at_m = 0.0; at_m < 3.0; at_m += apart_m)
      posts.push_back({20 + 0.4 * at_m, 6.5 + at_m, 0, 0.02, 0.05, 0.1, 1.1});
    RulesBench bench;
    bench.look(posts);
    gate(bench);
    CHECK(bench.frame.gated_map == 1 - bench.frame.kept_count);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.05) == 1);
  CHECK(kept(0.15) == 0);
}

TEST_CASE("body look: on the apron a post and one row of the ground beside it are no car") {
  // The row hits a thin slab at 21 m; the post is one cluster with it.
  const auto kept = [](double post_m) {
    RulesBench bench;
    bench.look({{19.5, 8.2, 0, 2.6, 3.0, 0.0, 0.05}, {20.5, 8.2, 0, 0.1, post_m, 0.0, 1.0}}, 0.01);
    gate(bench);
    CHECK(bench.frame.gated_map == 1 - bench.frame.kept_count);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.12) == 0);
  CHECK(kept(1.5) == 1);  // more points on its rows than on that of the ground
}

TEST_CASE("body look: smoke at the end of a car makes it no longer") {
  // A car, and a plate behind it that is one cluster with it.
  const auto kept = [](double x_m, float plate, float car = 1.0f, bool with_smoke = true) {
    std::vector<Solid> solids = {{25, 4, 0, 4.9, 1.9, 0.1, 1.1, 1, car}, {x_m, 4, 0, 0.05, 0.5, 0.3, 0.5, 1, plate}};
    if (with_smoke) solids.push_back(kSmoke);
    return keep_seen(solids);
  };
  CHECK(kept(21, 0.05f) == 1);
  CHECK(kept(21, 1.0f) == 0);                // as bright as the car: the end of something longer
  CHECK(kept(21, 0.05f, 1.0f, false) == 0);  // a scan without smoke
  CHECK(kept(16, 0.05f) == 0);               // longer than two cars
  CHECK(kept(21, 1.0f, 0.05f) == 0);         // most of it is dark: not a car with smoke
}

TEST_CASE("body look: smoke at the end of a car that stands across makes it no longer") {
  const auto kept = [](float plate, bool with_smoke = true) {
    std::vector<Solid> solids = {{25, 0, 90, 4.9, 1.9, 0.1, 1.1, 1}, {25, 3.95, 0, 0.05, 0.5, 0.1, 1.1, 1, plate}};
    if (with_smoke) solids.push_back(kSmoke);
    return keep_seen(solids);
  };
  CHECK(kept(0.05f) == 1);
  CHECK(kept(1.0f) == 0);
  CHECK(kept(0.05f, false) == 0);
}

TEST_CASE("body look: rows that hit one height are on the ground") {
  CHECK(keep_seen({{13, 0, 0, 4, 1.5, 0.29, 0.3}}) == 0);
  CHECK(keep_seen({{13, 0, 0, 4, 1.5, 0.1, 0.6}}) == 1);
  // Few rows of a car that is seen over its whole length.
  CHECK(keep_seen({{30, 0, 0, 0.1, 1.5, 0.1, 0.2}, {34, 0, 0, 0.1, 1.5, 0.3, 0.45}}) == 1);
  CHECK(keep_seen({{13, 0, 0, 0.02, 1.5, 0.2, 0.6}}) == 1);  // an upright face
}

TEST_CASE("body look: one row that is as high over a misjudged road as the next row, at another range, is road") {
  // One row hits the top of a plate; `plate_m`, `road_m`: heights over the running ground.
  const auto kept = [](float plate_m, float road_m) {
    RulesBench bench;
    bench.look({{18, 0, 0, 0.9, 1.0, 0.29, 0.3}});
    const SegmentViews& views = bench.frame.sensors[0].kept;
    for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i)
      views.images.height_m.data[views.points.pixel[i]] = views.points.label[i] == kLabelGround ? road_m : plate_m;
    gate(bench);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.3f, 0.0f) == 1);
  CHECK(kept(0.45f, 0.4f) == 0);
  CHECK(kept(0.2f, 0.15f) == 1);  // may lie on the road
  CHECK(kept(0.59f, 0.55f) == 0);
  CHECK(kept(0.61f, 0.57f) == 1);  // a level beam over the body of a car
}

TEST_CASE("body look: one row that hits a car between rows far apart, below one that hits a wall as high, is no road") {
  // Rows 2 deg apart, 0.5 m at the car; heights over the running ground.
  const auto kept = [](float car_m, float wall_m) {
    RulesBench bench;
    bench.look({{14.7, 0, 0, 0.4, 1.5, 0.3, 0.6}, {70, 0, 0, 1, 20, 0, 3, 2}}, 0.035);
    const SegmentViews& views = bench.frame.sensors[0].kept;
    const int32_t car = bench.frame.sensors[0].clusters.label[0];
    for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i)
      if (views.points.label[i] > kLabelGround)
        views.images.height_m.data[views.points.pixel[i]] = views.points.label[i] == car ? car_m : wall_m;
    gate(bench);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.45f, 0.9f) == 1);
  CHECK(kept(0.45f, 0.45f) == 1);
  CHECK(kept(0.55f, 0.55f) == 0);  // higher than the rows are apart: a row below would hit the car
}

TEST_CASE("body look: two flat rows that are as high over a misjudged road as the row above them are road") {
  // Two rows, 1 m apart; `object_m`, `road_m`: heights over the running ground.
  const auto kept = [](float object_m, float road_m, double apart_m = 1.0) {
    RulesBench bench;
    bench.look({{28, 0, 0, 0.02, 1.0, 0.26, 0.34}, {28 + apart_m, 0, 0, 0.02, 1.0, 0.35, 0.43}});
    const SegmentViews& views = bench.frame.sensors[0].kept;
    for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i)
      views.images.height_m.data[views.points.pixel[i]] = views.points.label[i] == kLabelGround ? road_m : object_m;
    gate(bench);
    CHECK(bench.frame.merged.count == 1);
    return bench.frame.kept_count;
  };
  CHECK(kept(0.4f, 0.38f) == 0);
  CHECK(kept(0.4f, 0.0f) == 1);
  CHECK(kept(0.2f, 0.18f) == 1);       // may lie on the road
  CHECK(kept(0.61f, 0.59f) == 1);      // a level beam over the body of a car
  CHECK(kept(0.4f, 0.38f, 0.3) == 1);  // upright
}

TEST_CASE("body look: far rows that are one object each are a plane, unless one is seen over a nearer car") {
  // What 40 m away passes the gates: one row of a plate. Heights over the running ground by cluster, 0: the ground.
  const auto kept = [](const std::vector<Solid>& solids, std::vector<float> heights_m, bool with_map = true,
                       double row_pitch_rad = 0.0035) {
    RulesBench bench(with_map);
    bench.look(solids, row_pitch_rad);
    const SegmentViews& views = bench.frame.sensors[0].kept;
    for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i)
      views.images.height_m.data[views.points.pixel[i]] = heights_m[std::size_t(views.points.label[i])];
    gate(bench);
    int32_t count = 0;
    for (int32_t k = 0; k < bench.frame.kept_count; ++k) {
      const float range_m = bench.frame.merged.nearest_m[bench.frame.kept[k]];
      count += range_m > 38.0f && range_m < 44.0f;
    }
    return count;
  };
  const Solid plate = {41.0, 0, 0, 0.5, 1.0, 0.05, 0.12}, other = {34.6, 0, 0, 0.5, 1.0, 0.05, 0.12, 2},
              behind = {49.0, 0, 0, 0.5, 1.0, 0.05, 0.12, 2};
  CHECK(kept({plate}, {0.0f, 0.4f}) == 1);
  CHECK(kept({plate}, {0.35f, 0.4f}) == 0);  // the ground goes on as high
  CHECK(kept({plate}, {0.35f, 0.4f}, false) == 0);
  CHECK(kept({plate}, {0.2f, 0.24f}) == 1);  // lower: an object on it
  CHECK(kept({plate}, {0.66f, 0.7f}) == 0);
  CHECK(kept({plate, other}, {0.0f, 0.8f, 0.7f}) == 0);
  CHECK(kept({plate, other}, {0.0f, 0.8f, 0.5f}) == 1);
  CHECK(kept({plate, behind}, {0.0f, 0.6f, 0.7f}) == 0);
  // A nearer car of several rows below it; it does not tell, but what the next row above hits behind a low object does.
  Solid car = other;
  car.low_m = 0.0, car.high_m = 0.24;
  CHECK(kept({plate, car}, {0.0f, 0.8f, 0.7f}) == 1);
  CHECK(kept({plate, car}, {0.0f, 0.5f, 0.45f}) == 1);
  Solid wall = behind;
  wall.high_m = 1.5;
  CHECK(kept({plate, wall}, {0.0f, 0.64f, 0.7f}) == 0);
  CHECK(kept({plate, wall}, {0.0f, 0.68f, 0.7f}) == 1);
  CHECK(kept({plate, wall}, {0.0f, 0.64f, 0.7f}, true, 0.00964) == 1);  // rows 0.4 m apart: it passes over a car
  CHECK(kept({plate, wall}, {0.0f, 0.45f, 0.5f}, true, 0.00964) == 0);
  CHECK(kept({plate, wall}, {0.66f, 0.7f, 0.3f}) == 1);  // ground 1 m before it may be its foot
}

TEST_CASE("body look: without a map, rows that go on beside the object as ground at the same range are ground") {
  // An object and, to its left, ground, and on its right at right_x_m, if not 0; the object at x_m, and high_m over the
  // running ground that the scan was judged by.
  const auto kept_by = [](bool across_first_column, double x_m, double ground_x_m, Solid object, float high_m,
                          bool with_map, double right_x_m) {
    object.x_m = x_m;
    const double width_m = 2.0, aside_m = 0.5 * (object.width_m + width_m);
    const auto ground = [&](double at_m, double left_m) {
      return Solid{at_m, left_m, 0, object.length_m, width_m, object.low_m, object.high_m, 0};
    };
    std::vector<Solid> solids = {object, ground(ground_x_m, aside_m)};
    if (right_x_m > 0) solids.push_back(ground(right_x_m, -aside_m));
    RulesBench bench(with_map);
    bench.look(solids);
    if (across_first_column) bench.roll_columns(RulesBench::kCols / 2 + 1);
    const SegmentViews& views = bench.frame.sensors[0].kept;
    for (int32_t i = 0; i < bench.frame.sensors[0].scan.count; ++i) {
      int32_t& label = views.points.label[i];
      label = std::max(label, kLabelGround);
      views.images.height_m.data[views.points.pixel[i]] = label > kLabelGround ? high_m : 0.0f;
    }
    gate(bench);
    return bench.frame.kept_count;
  };
  const auto kept = [&](double x_m, double ground_x_m, const Solid& object, float high_m, bool with_map = false,
                        double right_x_m = 0) {
    const int32_t count = kept_by(false, x_m, ground_x_m, object, high_m, with_map, right_x_m);
    CHECK(kept_by(true, x_m, ground_x_m, object, high_m, with_map, right_x_m) == count);
    return count;
  };
  const Solid row = {0, 0, 0, 0.5, 1.0, 0.29, 0.3}, flat = {0, 0, 0, 4.0, 1.5, 0.1, 0.5},
              upright = {0, 0, 0, 0.5, 1.5, 0.1, 0.5};
  CHECK(kept(18, 18, row, 0.4f) == 0);
  CHECK(kept(18, 18, row, 0.4f, true) == 1);  // with a map, what the road is like is known
  CHECK(kept(18, 20, row, 0.4f) == 1);        // a step: beside it the row passes on to the ground behind it
  CHECK(kept(18, 20, row, 0.04f) == 0);       // on the running ground there is no body
  CHECK(kept(18, 20, row, 0.04f, true) == 1);
  CHECK(kept(18, 18, flat, 0.4f) == 0);  // several rows
  CHECK(kept(18, 18, flat, 0.4f, true) == 1);
  CHECK(kept(18, 20.5, flat, 0.4f) == 1);
  CHECK(kept(18, 18, upright, 0.4f) == 1);
  const auto face = [](double x_m) { return Solid{0, 0, 0, 0.05, 1.5, 0.3, 0.3 + 0.0035 * x_m}; };  // one row
  CHECK(kept(55, 55, face(55), 0.7f) == 0);
  CHECK(kept(70, 70, face(70), 0.7f) == 1);  // far away there must be ground on both sides
  CHECK(kept(70, 70, face(70), 0.7f, false, 70) == 0);
  CHECK(kept(70, 70.5, face(70), 0.7f, false, 69.5) == 0);
  CHECK(kept(70, 70, face(70), 0.7f, false, 71) == 1);
  CHECK(kept(70, 71, face(70), 0.7f, false, 70) == 1);
  CHECK(kept(70, 70, face(70), 0.7f, true, 70) == 1);
  CHECK(kept(70, 70, upright, 0.7f, false, 70) == 1);
}

TEST_CASE("body look: far away without a map, one row that is lower than the tyres of a car is ground") {
  constexpr double kPitch = 0.009;
  const auto kept = [](double x_m, double high_m, bool with_map) {
    CAPTURE(x_m);
    CAPTURE(high_m);
    return keep_seen({{x_m, 0, 0, 0.5, 1.5, 0.0, high_m}}, with_map, kPitch);
  };
  CHECK(kept(48, 0.18, false) == 0);
  CHECK(kept(48, 0.18, true) == 1);
  CHECK(kept(48, 0.7, false) == 1);  // two rows
  CHECK(kept(35, 0.18, false) == 1);
}

TEST_CASE("body look: behind the road's returns without a map, what is far brighter than the road is a sign") {
  const auto kept = [](double x_m, float intensity, bool with_map) {
    return keep_seen({{x_m, 0, 0, 0.05, 1.2, 0.5, 1.5, 1, intensity}}, with_map);
  };
  CHECK(kept(100, 5, false) == 0);
  CHECK(kept(100, 3, false) == 1);
  CHECK(kept(100, 5, true) == 1);
  CHECK(kept(60, 5, false) == 1);
}

TEST_CASE(
    "body look: far away beside a bound, what is on average far brighter than the road is a reflector and its glare") {
  const auto kept = [](double x_m, double y_m, float intensity, bool with_map = true) {
    CAPTURE(x_m);
    CAPTURE(y_m);
    const auto part = [&](double left_m, double width_m, float of_road) {
      return Solid{x_m, y_m + left_m, 0, 0.05, width_m, 0.4, 1.0, 1, of_road};
    };
    return keep_seen({part(0, 0.4, intensity), part(0.4, 0.4, 2.5f), part(-0.4, 0.4, 2.5f)}, with_map);
  };
  for (const double side : {-1.0, 1.0}) {
    CHECK(kept(80, 5 * side, 14) == 0);
    CHECK(kept(80, 5 * side, 14, false) == 1);  // less than half of it
    CHECK(kept(80, 5 * side, 5) == 1);
    CHECK(kept(80, 3 * side, 14) == 1);  // a car's lamp
    CHECK(kept(45, 5 * side, 14) == 1);
    const auto row_with = [&](double lamp_m) {  // a row of 3 points
      const Solid body = {140, 5 * side, 0, 0.05, 1.05, 0.4, 0.85},
                  lamp = {139.9, 5 * side, 0, 0.05, lamp_m, 0.4, 0.85, 1, 20};
      return keep_seen({body, lamp});
    };
    CHECK(row_with(0.3) == 1);
    CHECK(row_with(0.8) == 0);
  }
}

TEST_CASE("body look: near, or where no bound tells its place, a reflector shows by its bare part") {
  const auto kept = [](double x_m, double y_m, double bare_m, float intensity, bool with_map) {
    CAPTURE(x_m);
    CAPTURE(y_m);
    CAPTURE(bare_m);
    const auto part = [&](double left_m, double width_m, float of_road) {
      return Solid{x_m, y_m + left_m, 0, 0.05, width_m, 0.4, 1.0, 1, of_road};
    };
    const double glare_m = 0.5 * (1.4 - bare_m), side_m = 0.5 * (bare_m + glare_m);
    return keep_seen({part(0, bare_m, intensity), part(side_m, glare_m, 2.0f), part(-side_m, glare_m, 2.0f)}, with_map);
  };
  for (const double x_m : {18.0, 45.0, 65.0}) {
    CHECK(kept(x_m, 4, 0.8, 40, false) == 0);
    CHECK(kept(x_m, 4, 0.3, 40, false) == 1);  // the plate of a car, and its body
    CHECK(kept(x_m, 4, 0.8, 8, false) == 1);
    CHECK(kept(x_m, 5, 0.8, 40, true) == 0);
    CHECK(kept(x_m, 5, 0.3, x_m < 50 ? 40 : 8, true) == 1);
    CHECK(kept(x_m, 0, 0.8, 40, true) == 1);  // on the road it is an obstacle
    // A white car on a dark road: its rear, and its side from the flank to the rear.
    CHECK(keep_seen({{x_m, 4, 0, 1.6, 1.8, 0.2, 1.0, 1, 20}}, false) == 1);
    CHECK(keep_seen({{x_m, 5, 0, 1.6, 1.8, 0.2, 1.0, 1, 20}}, true) == 1);
    CHECK(keep_seen({{x_m, 4, 0, 4.0, 1.8, 0.2, 1.0, 1, 14}}, false) == 1);
  }
}

}  // namespace
