// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Savitzky-Golay weights and smoothing.
#include "kernels/smooth_sg.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "tests/support/images.h"

namespace overtake {
namespace {

using test::OwnedPlane;

constexpr float kU = kAngleUndefined, kS = kAngleSkipped;

SmoothSgParams paper() {
  SmoothSgParams params;
  REQUIRE(make_smooth_sg(5, 2, &params));
  return params;
}

// Least squares by the normal equations in powers of k: weights of the fitted polynomial's value at the centre.
std::vector<long double> weights_by_normal_equations(int32_t window, int32_t order) {
  const int32_t n = order + 1, half = window / 2;
  std::vector<std::vector<long double>> m(std::size_t(n), std::vector<long double>(std::size_t(n) + 1));
  for (int32_t i = 0; i < n; ++i) {
    for (int32_t j = 0; j < n; ++j)
      for (int32_t k = -half; k <= half; ++k)
        m[std::size_t(i)][std::size_t(j)] += std::pow(static_cast<long double>(k), i + j);
    m[std::size_t(i)][std::size_t(n)] = i == 0 ? 1.0L : 0.0L;
  }
  for (std::size_t i = 0; i < std::size_t(n); ++i) {
    std::size_t pivot = i;
    for (std::size_t r = i; r < std::size_t(n); ++r)
      if (std::fabs(m[r][i]) > std::fabs(m[pivot][i])) pivot = r;
    std::swap(m[i], m[pivot]);
    for (std::size_t r = 0; r < std::size_t(n); ++r) {
      if (r == i) continue;
      const long double f = m[r][i] / m[i][i];
      for (std::size_t c = i; c <= std::size_t(n); ++c) m[r][c] -= f * m[i][c];
    }
  }
  std::vector<long double> weights;
  for (int32_t k = 0; k <= half; ++k) {
    long double w = 0;
    for (std::size_t i = 0; i < std::size_t(n); ++i)
      w += m[i][std::size_t(n)] / m[i][i] * std::pow(static_cast<long double>(k), static_cast<long double>(i));
    weights.push_back(w);
  }
  return weights;
}

TEST_CASE("smooth_sg: weights of window 5, quadratic are [-3 12 17 12 -3] / 35") {
  const SmoothSgParams params = paper();
  CHECK(params.half_window == 2);
  CHECK(params.weight[0] == 17.0f / 35.0f);
  CHECK(params.weight[1] == 12.0f / 35.0f);
  CHECK(params.weight[2] == -3.0f / 35.0f);
  CHECK(params.weight[3] == 0.0f);
}

TEST_CASE("smooth_sg: weights agree with a least-squares solution for every window and order up to 5") {
  for (int32_t window = 1; window <= 2 * kMaxHalfWindow + 1; window += 2)
    for (int32_t order = 0; order < window && order <= 5; ++order) {
      CAPTURE(window);
      CAPTURE(order);
      SmoothSgParams params;
      REQUIRE(make_smooth_sg(window, order, &params));
      const std::vector<long double> truth = weights_by_normal_equations(window, order);
      for (std::size_t k = 0; k < truth.size(); ++k)
        CHECK(std::fabs(static_cast<long double>(params.weight[k]) - truth[k]) < 1e-7L);
    }
}

TEST_CASE("smooth_sg: weights of the highest order reproduce the centre alone") {
  for (int32_t window = 1; window <= 2 * kMaxHalfWindow + 1; window += 2) {
    CAPTURE(window);
    SmoothSgParams params;
    REQUIRE(make_smooth_sg(window, window - 1, &params));
    CHECK(params.weight[0] == doctest::Approx(1.0f));
    for (int32_t k = 1; k <= params.half_window; ++k) CHECK(std::fabs(params.weight[k]) < 1e-6f);
  }
}

TEST_CASE("smooth_sg: refuses even and oversized windows and invalid orders") {
  SmoothSgParams params;
  CHECK_FALSE(make_smooth_sg(0, 0, &params));
  CHECK_FALSE(make_smooth_sg(-1, 0, &params));
  CHECK_FALSE(make_smooth_sg(4, 2, &params));
  CHECK_FALSE(make_smooth_sg(17, 2, &params));
  CHECK_FALSE(make_smooth_sg(5, 5, &params));
  CHECK_FALSE(make_smooth_sg(5, -1, &params));
  CHECK(make_smooth_sg(15, 14, &params));
  CHECK(make_smooth_sg(1, 0, &params));
  CHECK(params.half_window == 0);
}

TEST_CASE("smooth_sg: keeps a quadratic away from the borders") {
  OwnedPlane<float> in(12, 3), out(12, 3);
  for (int32_t r = 0; r < 12; ++r)
    for (int32_t c = 0; c < 3; ++c) in.at(r, c) = 0.2f + 0.05f * float(r) + 0.004f * float(c * r * r);
  ref::smooth_sg(paper(), 12, in, out);
  for (int32_t r = 2; r < 10; ++r)
    for (int32_t c = 0; c < 3; ++c) CHECK(out.at(r, c) == doctest::Approx(in.at(r, c)).epsilon(1e-6));
}

TEST_CASE("smooth_sg: mirrors rows at the borders without repeating the border row (reflect-101)") {
  OwnedPlane<float> in({{0.1f}, {0.4f}, {0.2f}, {1.0f}, {0.3f}, {0.7f}}), out(6, 1);
  ref::smooth_sg(paper(), 6, in, out);
  // row 0 sees rows 2 1 0 1 2; row 5 sees 3 4 5 4 3
  CHECK(out.at(0, 0) == doctest::Approx((-3 * 0.2 + 12 * 0.4 + 17 * 0.1 + 12 * 0.4 - 3 * 0.2) / 35));
  CHECK(out.at(1, 0) == doctest::Approx((-3 * 0.4 + 12 * 0.1 + 17 * 0.4 + 12 * 0.2 - 3 * 1.0) / 35));
  CHECK(out.at(4, 0) == doctest::Approx((-3 * 0.2 + 12 * 1.0 + 17 * 0.3 + 12 * 0.7 - 3 * 0.3) / 35));
  CHECK(out.at(5, 0) == doctest::Approx((-3 * 1.0 + 12 * 0.3 + 17 * 0.7 + 12 * 0.3 - 3 * 1.0) / 35));
}

TEST_CASE("smooth_sg: keeps mirroring if the window is larger than the image") {
  SmoothSgParams wide;
  REQUIRE(make_smooth_sg(15, 2, &wide));
  OwnedPlane<float> in({{0.2f}, {0.8f}}), out(2, 1);
  ref::smooth_sg(wide, 2, in, out);
  double at[2] = {}, total = 0;  // taps alternate: even distances fall on this row, odd ones on the other
  for (int32_t k = -7; k <= 7; ++k) {
    const auto w = double(wide.weight[k < 0 ? -k : k]);
    at[0] += w * (k % 2 == 0 ? 0.2 : 0.8);
    at[1] += w * (k % 2 == 0 ? 0.8 : 0.2);
    total += w;
  }
  CHECK(double(out.at(0, 0)) == doctest::Approx(at[0] / total));
  CHECK(double(out.at(1, 0)) == doctest::Approx(at[1] / total));

  OwnedPlane<float> one({{0.6f}}), one_out(1, 1);
  ref::smooth_sg(wide, 1, one, one_out);
  CHECK(one_out.at(0, 0) == doctest::Approx(0.6f));
}

TEST_CASE("smooth_sg: leaves undefined and skipped taps out and renormalises") {
  OwnedPlane<float> in({{0.1f}, {kU}, {0.5f}, {kS}, {0.9f}}), out(5, 1);
  ref::smooth_sg(paper(), 5, in, out);
  CHECK(out.at(1, 0) == kU);  // undefined remains undefined
  CHECK(out.at(2, 0) == doctest::Approx((-3 * 0.1 + 17 * 0.5 - 3 * 0.9) / 11));
  CHECK(out.at(3, 0) == doctest::Approx((12 * 0.5 + 12 * 0.9) / 24));  // skipped: from the other taps
}

TEST_CASE("smooth_sg: a skipped pair without other taps is level; a pair without other taps keeps its value") {
  OwnedPlane<float> in({{kS, 1.2f, kS}, {kU, kU, kS}, {kU, kU, kS}}), out(3, 3);
  ref::smooth_sg(paper(), 3, in, out);
  CHECK(out.at(0, 0) == 0.0f);
  CHECK(out.at(0, 1) == doctest::Approx(1.2f));
  for (int32_t r = 0; r < 3; ++r) CHECK(out.at(r, 2) == 0.0f);
}

TEST_CASE("smooth_sg: taps with too little weight are ignored") {
  // Weights 0.5, 0.26, -0.24: at row 1 of 3 the taps are 0.26 + 0.26 (its own is undefined) and mirrored ones.
  SmoothSgParams params;
  params.half_window = 1;
  params.weight[0] = 0.51f;
  params.weight[1] = -0.235f;
  // rows 0 and 1 defined, row 1's taps: own 0.51, up -0.235, down -0.235 -> sum 0.04 < 0.05: own value
  OwnedPlane<float> in({{0.3f, 0.3f}, {0.7f, kS}, {0.3f, 0.3f}}), out(3, 2);
  ref::smooth_sg(params, 3, in, out);
  CHECK(out.at(1, 0) == 0.7f);
  CHECK(out.at(1, 1) == doctest::Approx(0.3f));  // a weight of -0.47 is enough
  params.weight[1] = -0.02f;
  ref::smooth_sg(params, 3, in, out);
  CHECK(out.at(1, 1) == 0.0f);  // skipped, -0.04: level
}

TEST_CASE("smooth_sg: an overshoot below zero never reads as undefined; rows without a pair do") {
  // Skipped centre, taps -3 0 . 12 -3 like: (12 a - 3 b - 3 c) / 6 with a = 0, b = c = 1 gives exactly -1.
  OwnedPlane<float> in({{1.0f}, {0.0f}, {kS}, {kU}, {1.0f}, {0.4f}}), out(6, 1);
  SmoothSgParams params;
  params.half_window = 2;
  params.weight[0] = 0.5f;
  params.weight[1] = 0.5f;
  params.weight[2] = -0.125f;
  ref::smooth_sg(params, 5, in, out);  // row 2: (-0.125 - 0.125) / (0.5 - 0.25) = -1
  CHECK(out.at(2, 0) < -0.99f);
  CHECK(out.at(2, 0) != kU);
  CHECK(out.at(5, 0) == kU);
}

}  // namespace
}  // namespace overtake
