// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Merging and the rectangle, compared with references that share no code with the kernels (tests/reference).
#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "kernels/kernel_table.h"
#include "tests/reference/fit_rectangle.h"
#include "tests/reference/merge_seams.h"
#include "tests/support/paper_params.h"
#include "tests/support/seam_scene.h"

using namespace overtake;
using namespace overtake::test;

namespace {

double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * double(random() >> 11) * 0x1p-53;
}

// One to eight sensors around the vehicle, some missing, with random clusters near their edges.
std::vector<Sensor> make_rig(std::mt19937_64& random) {
  const int count = 1 + int(random() % 8);
  std::vector<Sensor> rig;
  for (int s = 0; s < count; ++s) {
    const Place place{uniform(random, -2, 2), uniform(random, -1, 1), 0.7, 360.0 / count * s + uniform(random, -9, 9)};
    Sensor sensor{place, model_of(place, 40 + int(random() % 40), std::min(170.0, 360.0 / count)), true, 0, 64, {}};
    sensor.present = random() % 8 != 0;
    sensor.stamp_ns = int64_t(random() % 1000000);
    if (random() % 6 == 0) sensor.cluster_capacity = 1 + int32_t(random() % 5);
    rig.push_back(sensor);
  }
  for (Sensor& sensor : rig)
    for (int32_t label = 1; label <= 12; ++label) {
      const int32_t edge = random() % 2 ? 0 : sensor.model.cols - 10;
      const int32_t points = int32_t(random() % 9);
      const float range = float(uniform(random, 2, 12));
      for (int32_t k = 0; k < points; ++k) {
        const int32_t row = int32_t(random() % 32), column = edge + int32_t(random() % 10);
        const float azimuth = sensor.model.azimuth_left_rad - (float(column) + 0.5f) * sensor.model.pitch_rad;
        sensor.put(row, column, range * std::cos(azimuth), range * std::sin(azimuth), 0.1f * float(row) - 1.5f, label,
                   int32_t(random() % 50000000), random() % 5 != 0);
      }
    }
  return rig;
}

}  // namespace

TEST_CASE("merge_seams: sets, sums, order and overflow equal the reference over all pairs of points") {
  int joined = 0, overflowed = 0, undecided = 0;
  for (uint64_t seed = 1; seed <= 400; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const std::vector<Sensor> rig = make_rig(random);
    const MergeSeamsParams params = closer_than(float(uniform(random, 0.2, 2.5)), 1 + int32_t(random() % 8));
    const int32_t capacity = random() % 4 ? 128 : 1 + int32_t(random() % 12);
    const Frame got(rig, params, capacity);
    std::vector<SeamSide> sides(rig.size());
    for (size_t s = 0; s < rig.size(); ++s)
      sides[s] = {rig[s].present,
                  &rig[s].model,
                  &got.images[s],
                  &got.scan[s],
                  &got.points[s],
                  &got.clusters[s],
                  got.row_of_label[s].data(),
                  rig[s].stamp_ns};
    const reference::Merged want = reference::merge_seams(params, sides, capacity);
    undecided += !want.is_decided;
    if (!want.is_decided) continue;

    CHECK(got.overflow == want.overflow);
    overflowed += want.overflow > 0;
    REQUIRE(got.members.count == int32_t(want.merged_of_member.size()));
    for (int32_t m = 0; m < got.members.count; ++m) CHECK(got.members.merged[m] == want.merged_of_member[size_t(m)]);
    REQUIRE(got.merged.count == int32_t(want.rows.size()));
    for (int32_t i = 0; i < got.merged.count; ++i) {
      CAPTURE(i);
      const reference::MergedCluster& row = want.rows[size_t(i)];
      joined += row.members.size() > 1;
      CHECK(got.row_members(i) == row.members);
      CHECK(got.merged.point_count[i] == row.point_count);
      CHECK(got.merged.sensor_mask[i] == row.sensor_mask);
      CHECK(got.merged.main_sensor[i] == row.main_sensor);
      CHECK(got.merged.nearest_m[i] == row.nearest_m);
      CHECK(got.merged.stamp_ns[i] == row.stamp_ns);
      const float* const lows[3] = {got.merged.min_x_m, got.merged.min_y_m, got.merged.min_z_m};
      const float* const highs[3] = {got.merged.max_x_m, got.merged.max_y_m, got.merged.max_z_m};
      const float* const centers[3] = {got.merged.center_x_m, got.merged.center_y_m, got.merged.center_z_m};
      for (int a = 0; a < 3; ++a) {
        CHECK(lows[a][i] == row.low[a]);
        CHECK(highs[a][i] == row.high[a]);
        CHECK(centers[a][i] == row.center[a]);
      }
    }
  }
  CHECK(joined > 500);  // else the test would check nothing
  CHECK(overflowed > 20);
  CHECK(undecided < 40);
}

TEST_CASE("fit_rectangle: headings, rectangles and counts pass the reference in double precision") {
  for (uint64_t seed = 1; seed <= 600; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const auto normal = [&] { return uniform(random, -1, 1) + uniform(random, -1, 1) + uniform(random, -1, 1); };
    // One or two sides of a car at any heading, with noise and points inside; or a cloud without a shape.
    const int count = seed % 10 == 0 ? 1 + int(random() % 6) : 5 + int(random() % 200);
    const double heading = uniform(random, -M_PI, M_PI), away = uniform(random, 6, 60);
    const double bearing = uniform(random, -M_PI, M_PI), noise = uniform(random, 0, 0.05);
    const bool shapeless = random() % 8 == 0, one_face = random() % 3 == 0;
    std::vector<float> x, y;
    for (int i = 0; i < count; ++i) {
      double u = uniform(random, -2.46, 2.46), v = -0.94;
      if (!one_face && random() % 3 == 0) u = -2.46, v = uniform(random, -0.94, 0.94);
      if (shapeless || random() % 12 == 0) u = uniform(random, -2, 2), v = uniform(random, -0.9, 0.9);
      u += noise * normal(), v += noise * normal();
      x.push_back(float(away * std::cos(bearing) + u * std::cos(heading) - v * std::sin(heading)));
      y.push_back(float(away * std::sin(bearing) + u * std::sin(heading) + v * std::cos(heading)));
    }
    const FitRectangleParams params = test::paper_frame_params().fit_rectangle;
    const double heading_ref = heading + uniform(random, -0.6, 0.6), sensor_x = uniform(random, -1, 3);
    const reference::RectangleReference exact(params, x, y, sensor_x, 0.4);
    const KernelTable* tables[16] = {};
    const int32_t table_count = list_kernels(tables);
    for (int32_t t = 0; t < table_count; ++t) {
      INFO("isa ", tables[t]->isa);
      const RectangleFit fit =
          tables[t]->fit_rectangle(params, x.data(), y.data(), count, float(heading_ref), float(sensor_x), 0.4f);
      CHECK(exact.find_fault(fit, heading_ref) == "");
    }
  }
}
