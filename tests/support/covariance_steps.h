// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Random predictions and updates of one track, for any motion model: after each step the covariance is symmetric and
// positive definite, and the state is one that a car can have.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "core/math.h"
#include "pipeline/track/track_filter.h"

namespace overtake::test {

// Cholesky: whether the matrix is positive definite. With more digits than the filter, so that rounding does not
// decide.
inline bool is_positive_definite(const TrackEstimate& e) {
  constexpr int kN = kTrackStateSize;
  long double l[kN][kN] = {};
  for (int r = 0; r < kN; ++r)
    for (int c = 0; c <= r; ++c) {
      long double sum = e.covariance[r][c];
      for (int k = 0; k < c; ++k) sum -= l[r][k] * l[c][k];
      if (r == c && !(sum > 0)) return false;
      l[r][c] = r == c ? std::sqrt(sum) : sum / l[c][c];
    }
  return true;
}

inline bool is_symmetric(const TrackEstimate& e) {
  for (int r = 0; r < kTrackStateSize; ++r)
    for (int c = 0; c < r; ++c)
      if (e.covariance[r][c] != e.covariance[c][r]) return false;
  return true;
}

// Predictions by any time forwards and backwards, updates of any accepted accuracy, with and without noise. The model
// has its type of Estimate, draw_world(random, noise), whose `noise` is a factor of its process noise,
// predict(estimate, random, dt_s), and update(estimate, measurement).
template <class Model>
void run_random_steps(Model model, int32_t steps) {
  std::mt19937_64 random(27);
  const auto draw = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  // Variances of the measurements and factors of the noise: first those of car sensors, then all allowed ones.
  const struct {
    double least, most, noise;
  } worlds[] = {{-2, 1, 1}, {-4, 2, 1}, {-8, 4, 1}, {-12, 12, 1}, {-12, -6, 1}, {-4, 2, 1e-3}, {-12, 12, 0}};
  typename Model::Estimate e;
  int32_t updates = 0, backward = 0, unsound = 0, in_world = 0;
  const auto* world = worlds;
  for (int32_t n = 0; n < steps; ++n) {
    if (in_world-- == 0) {
      in_world = 2000;
      world = &worlds[random() % std::size(worlds)];
      model.draw_world(random, world->noise);
      e = {};
      e.mean = {0, 0, draw(0, 80), draw(-3, 3), draw(-0.3, 0.3)};
      const double born[kTrackStateSize] = {5, 5, 400, random() % 2 ? 0.04 : kPi * kPi, 0.01};
      for (int i = 0; i < kTrackStateSize; ++i) e.covariance[i][i] = born[i];
    }
    const double kind = draw(0, 1);
    const double dt = kind < 0.3 ? draw(-0.5, 0) : kind < 0.35 ? draw(0, 4) : kind < 0.36 ? draw(0, 60) : draw(0, 0.06);
    backward += dt < 0;
    model.predict(e, random, dt);
    CAPTURE(n);
    REQUIRE(is_symmetric(e));
    REQUIRE(is_positive_definite(e));
    if (random() % 3) {
      const double var_x = std::pow(10.0, draw(world->least, world->most));
      const double var_y = random() % 2 ? var_x : std::pow(10.0, draw(world->least, world->most));
      const double reach_x = std::sqrt(var_x + e.covariance[0][0]), reach_y = std::sqrt(var_y + e.covariance[1][1]);
      const Measurement z = {e.mean.x_m + reach_x * draw(-2, 2), e.mean.y_m + reach_y * draw(-2, 2), var_x, var_y,
                             draw(-0.99, 0.99) * std::sqrt(var_x * var_y)};
      Innovation innovation;
      if (innovate(e, z, &innovation) && innovation.d2 <= 9.21) updates += model.update(e, z);
      REQUIRE(is_symmetric(e));
      REQUIRE(is_positive_definite(e));
      REQUIRE(e.mean.speed_mps >= 0);
    }
    REQUIRE(std::fabs(e.mean.course_rad) <= kPi);
    if (is_sound(e)) continue;
    REQUIRE((e.mean.speed_mps > 1000 || std::fabs(e.mean.yaw_rate_rps) > 100));  // finite, but no car moves so
    ++unsound;
    in_world = 0;
  }
  CHECK(updates > steps / 4);
  CHECK(backward > steps / 4);
  CHECK(unsound < steps / 1000);
}

}  // namespace overtake::test
