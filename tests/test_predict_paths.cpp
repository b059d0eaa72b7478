// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Predicted paths of a group of cars, against the filter's prediction of one.
#include "kernels/predict_paths.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "core/table.h"
#include "kernels/kernel_table.h"
#include "pipeline/track/cvtr_tracker.h"

namespace overtake {
namespace {

constexpr int32_t kPoints = 30;

double draw(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

TrackEstimate draw_car(std::mt19937_64& random) {
  TrackEstimate e;
  e.mean = {draw(random, -1e3, 1e3), draw(random, -1e3, 1e3), draw(random, 0, 90), draw(random, -kPi, kPi),
            random() % 4 == 0 ? 0.0 : draw(random, -3.9, 3.9)};
  if (random() % 8 == 0) e.mean.course_rad = random() % 2 == 0 ? kPi : 0.0;
  const double scale[kTrackStateSize] = {1.5, 1.5, 2.0, 0.2, 0.1};
  double root[kTrackStateSize][kTrackStateSize];
  for (auto& row : root)
    for (double& value : row) value = draw(random, -1, 1);
  for (int r = 0; r < kTrackStateSize; ++r)
    for (int c = 0; c <= r; ++c) {
      for (int k = 0; k < kTrackStateSize; ++k)
        e.covariance[r][c] += scale[r] * scale[c] * (root[r][k] * root[c][k] + 0.1 * (r == c));
      e.covariance[c][r] = e.covariance[r][c];
    }
  return e;
}

void set_car(PathCars& cars, int32_t i, const TrackEstimate& e) {
  cars.x_m[i] = e.mean.x_m, cars.y_m[i] = e.mean.y_m, cars.speed_mps[i] = e.mean.speed_mps;
  cars.course_rad[i] = e.mean.course_rad, cars.yaw_rate_rps[i] = e.mean.yaw_rate_rps;
  int32_t entry = 0;
  for (int32_t r = 0; r < kTrackStateSize; ++r)
    for (int32_t c = 0; c <= r; ++c) cars.covariance[entry++][i] = e.covariance[r][c];
}

// The columns of kPathCars paths, filled with a mark.
struct PathTableRows {
  std::vector<double> column[7];
  PathRows rows;
  PathTableRows() {
    for (auto& c : column) c.assign(std::size_t(kPathCars) * kPoints, 12345.0);
    rows = {column[0].data(), column[1].data(), column[2].data(), column[3].data(),
            column[4].data(), column[5].data(), column[6].data()};
  }
};

PredictPathsParams params_of(const ProcessNoise& noise, double step_s, int32_t steps) {
  PredictPathsParams params = {step_s, steps, {}};
  for (int i = 0; i < kTrackStateSize; ++i) params.noise[i] = noise.variance_per_s[i] * step_s;
  return params;
}

bool same_bytes(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

TEST_CASE("predict_paths: the bytes of the filter's prediction, on every ISA, for any number of cars and steps") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  const ProcessNoise noise = {{0.1, 0.1, 10, 0.1, 0.01}, 0.05};
  std::mt19937_64 random(61);
  int32_t compared = 0;
  for (int n = 0; n < 400; ++n) {
    const int32_t count = n % (kPathCars + 1), steps = 1 + n % 8;
    const double point_s = 0.05 * steps;
    TrackEstimate car[kPathCars];
    PathCars cars;
    for (int32_t i = 0; i < count; ++i) set_car(cars, i, car[i] = draw_car(random));
    PathTableRows expected;
    for (int32_t i = 0; i < count; ++i)
      for (int32_t k = 0; k < kPoints; ++k) {
        predict(car[i], noise, point_s);
        const double values[7] = {car[i].mean.x_m,        car[i].mean.y_m,         car[i].mean.course_rad,
                                  car[i].mean.speed_mps,  car[i].covariance[0][0], car[i].covariance[1][1],
                                  car[i].covariance[1][0]};
        for (int c = 0; c < 7; ++c) expected.column[c][std::size_t(i * kPoints + k)] = values[c];
      }
    for (int32_t t = 0; t < table_count; ++t) {
      PathTableRows written;
      const uint32_t left =
          tables[t]->predict_paths(params_of(noise, point_s / steps, steps), cars, count, kPoints, written.rows);
      CAPTURE(n);
      CAPTURE(std::string(tables[t]->isa));
      for (int32_t i = 0; i < kPathCars; ++i) {
        if ((left >> i & 1) != 0) continue;  // too uncertain after seconds
        for (int c = 0; c < 7; ++c)
          CHECK(std::memcmp(&written.column[c][std::size_t(i * kPoints)], &expected.column[c][std::size_t(i * kPoints)],
                            kPoints * sizeof(double)) == 0);
        compared += i < count;
      }
    }
  }
  CHECK(compared > 1000 * table_count);
}

TEST_CASE("predict_paths: leaves a car to the caller that spins, is very uncertain, or is no number") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  std::mt19937_64 random(62);
  PathCars cars;
  for (int32_t i = 0; i < kPathCars; ++i) {
    TrackEstimate e = draw_car(random);
    if (i == 1) e.mean.yaw_rate_rps = 4.0;  // 0.2 rad in a step of 50 ms
    if (i == 2) e.mean.yaw_rate_rps = -3.999;
    if (i == 3) e.covariance[0][0] = 1e6;
    if (i == 4) e.covariance[3][3] = 1e3, e.mean.speed_mps = 90;  // uncertain after a second
    if (i == 5) e.mean.course_rad = std::numeric_limits<double>::quiet_NaN();
    if (i == 6) e.covariance[1][1] = std::numeric_limits<double>::quiet_NaN();
    set_car(cars, i, e);
  }
  for (int32_t t = 0; t < table_count; ++t) {
    PathTableRows written;
    CAPTURE(std::string(tables[t]->isa));
    CHECK(tables[t]->predict_paths(params_of({}, 0.05, 2), cars, kPathCars, kPoints, written.rows) == 0b1111010);
  }
}

TEST_CASE("predict_paths: paths that paper publishes are those of the filter, also for cars left to it") {
  for (const double max_step_s : {0.05, 0.01}) {  // ten steps a point: the filter alone
    TrackerParams params;
    params.predict_step_s = max_step_s;
    const CvtrPolicy policy(params, nullptr, default_allocator());
    std::mt19937_64 random(63);
    std::vector<CvtrState> states(11);
    for (std::size_t i = 0; i < states.size(); ++i) {
      states[i].estimate = draw_car(random);
      if (i % 4 == 1) states[i].estimate.mean.yaw_rate_rps = 9.0;
      if (i % 4 == 2)
        for (int k = 0; k < 2; ++k) states[i].estimate.covariance[k][k] = 1e6;
    }
    Arena arena;
    PathTable table;
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, table, 11 * kPoints + 5); }));
    table.count = 5;  // rows of another car
    table.points_per_track = kPoints;
    policy.write_paths(states, table);
    REQUIRE(table.count == 11 * kPoints + 5);
    ProcessNoise noise;
    for (int i = 0; i < kTrackStateSize; ++i) noise.variance_per_s[i] = params.q_diag[i] / params.q_step_s;
    noise.max_step_s = max_step_s;
    bool same = true;
    for (std::size_t i = 0; i < states.size(); ++i) {
      TrackEstimate e = states[i].estimate;
      for (std::size_t k = 0; k < kPoints; ++k) {
        predict(e, noise, 0.1);
        const std::size_t row = 5 + i * kPoints + k;
        same &= same_bytes(table.x_m[row], e.mean.x_m) && same_bytes(table.y_m[row], e.mean.y_m) &&
                same_bytes(table.course_rad[row], e.mean.course_rad) &&
                same_bytes(table.speed_mps[row], e.mean.speed_mps) &&
                same_bytes(table.var_x[row], e.covariance[0][0]) && same_bytes(table.var_y[row], e.covariance[1][1]) &&
                same_bytes(table.cov_xy[row], e.covariance[1][0]);
      }
    }
    CHECK(same);
  }
}

}  // namespace overtake
