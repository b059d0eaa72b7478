// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// From the frame of a lane to the points of a path.
#include "kernels/place_path.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "kernels/kernel_table.h"

namespace overtake {
namespace {

struct PathBlock {
  PathCar car;
  double in[13][kPathBlock] = {}, out[8][kPathBlock];

  void run(const KernelTable& k, int32_t count) {
    std::memset(out, 0x5a, sizeof out);
    k.place_path(car, {in[0], in[1], in[2], in[3], in[4], in[11], in[12]}, {in[5], in[6], in[7], in[8], in[9], in[10]},
                 count, {out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7]});
  }
  double& heading(int32_t k) { return in[7][k]; }
  double& turn(int32_t k) { return in[10][k]; }
};

double draw(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

const KernelTable& scalar() { return *find_kernels("ref"); }

TEST_CASE("place_path: a point is ahead of the lane's place and to the left of it") {
  PathBlock b;
  b.car.p_ss = b.car.p_dd = 1.0;
  b.in[5][0] = 100.0, b.in[6][0] = 50.0, b.heading(0) = kHalfPi, b.in[8][0] = 7.0, b.in[9][0] = 2.0;
  b.run(scalar(), 1);
  CHECK(b.out[0][0] == doctest::Approx(98.0));
  CHECK(b.out[1][0] == doctest::Approx(57.0));
  CHECK(b.out[2][0] == doctest::Approx(kHalfPi));
  CHECK(b.out[3][0] == doctest::Approx(1.0));
  CHECK(b.out[5][0] == doctest::Approx(0.0));
}

TEST_CASE("place_path: the covariance is that of s + a v along and d + b c + e w across, at the course") {
  // Against the product of matrices.
  std::mt19937_64 random(11);
  for (int n = 0; n < 200; ++n) {
    double root[5][5], p[5][5] = {};
    for (auto& row : root)
      for (double& value : row) value = draw(random, -1, 1);
    for (int r = 0; r < 5; ++r)
      for (int c = 0; c < 5; ++c)
        for (int k = 0; k < 5; ++k) p[r][c] += root[r][k] * root[c][k] + 0.02 * (r == c);
    PathBlock b;
    b.car = {.speed_mps = draw(random, 0, 3),
             .p_ss = p[0][0],
             .p_sd = p[0][1],
             .p_dd = p[1][1],
             .p_sv = p[0][2],
             .p_dv = p[1][2],
             .p_vv = p[2][2],
             .p_sc = p[0][3],
             .p_dc = p[1][3],
             .p_vc = p[2][3],
             .p_cc = p[3][3],
             .p_sw = p[0][4],
             .p_dw = p[1][4],
             .p_vw = p[2][4],
             .p_cw = p[3][4],
             .p_ww = p[4][4]};
    for (int32_t c = 0; c < 3; ++c) b.in[c][0] = draw(random, 0, 2);
    b.in[3][0] = draw(random, 0, 1), b.in[4][0] = draw(random, 0, 1);
    b.heading(0) = draw(random, -3, 3), b.turn(0) = draw(random, -0.15, 0.15);
    b.run(scalar(), 1);
    const double v = b.car.speed_mps,
                 rows[2][5] = {{1, 0, b.in[0][0], 0, 0}, {0, 1, 0, v * b.in[1][0], v * b.in[2][0]}};
    double m[2][2] = {{b.in[3][0], 0}, {0, b.in[4][0]}};
    for (int r = 0; r < 2; ++r)
      for (int c = 0; c < 2; ++c)
        for (int i = 0; i < 5; ++i)
          for (int j = 0; j < 5; ++j) m[r][c] += rows[r][i] * p[i][j] * rows[c][j];
    const double course = b.heading(0) + b.turn(0), s = std::sin(course), c = std::cos(course);
    CAPTURE(n);
    CHECK(b.out[3][0] == doctest::Approx(c * c * m[0][0] + s * s * m[1][1] - 2 * s * c * m[0][1]).epsilon(1e-9));
    CHECK(b.out[4][0] == doctest::Approx(s * s * m[0][0] + c * c * m[1][1] + 2 * s * c * m[0][1]).epsilon(1e-9));
    CHECK(b.out[5][0] == doctest::Approx(s * c * (m[0][0] - m[1][1]) + (c * c - s * s) * m[0][1]).epsilon(1e-9));
  }
}

TEST_CASE("place_path: a steady car has a share of the estimate's variances, and a noise of its own") {
  PathBlock b;
  b.car = {.speed_mps = 2, .p_ss = 1, .p_dd = 0.5, .p_sv = 0.25, .p_vv = 0.5, .p_dc = 0.1, .p_cc = 0.02};
  b.car.steady_along = 0.5, b.car.steady_across = 0.25;
  b.in[0][0] = 2, b.in[1][0] = 3, b.in[3][0] = 10, b.in[4][0] = 20, b.in[11][0] = 0.125, b.in[12][0] = 0.0625;
  b.in[3][1] = b.in[4][1] = 0.25, b.in[11][1] = b.in[12][1] = 9;
  b.heading(0) = 1;
  b.run(scalar(), 3);
  // Along 1 + 2 * 2 * 0.25 + 4 * 0.5, across, with the lever 2 * 3, 0.5 + 2 * 6 * 0.1 + 36 * 0.02.
  CHECK(b.out[6][0] == doctest::Approx(std::sqrt(0.5 * 4 + 0.125)));
  CHECK(b.out[7][0] == doctest::Approx(std::sqrt(0.25 * 2.42 + 0.0625)));
  // Not more than all cars have.
  CHECK(b.out[6][1] == doctest::Approx(std::sqrt(1.25)));
  CHECK(b.out[7][1] == doctest::Approx(std::sqrt(0.75)));
  // And never 0.
  b.car.steady_along = b.car.steady_across = 0;
  b.run(scalar(), 3);
  CHECK(b.out[6][2] > 0);
  CHECK(b.out[7][2] > 0);
}

TEST_CASE("place_path: a course beyond pi is wrapped") {
  PathBlock b;
  b.car.p_ss = 1.0;
  b.heading(0) = 3.0, b.heading(1) = -3.0;
  b.turn(0) = b.turn(1) = 0.25;
  b.run(scalar(), 2);
  CHECK(b.out[2][0] == doctest::Approx(3.25 - kTwoPi));
  CHECK(b.out[2][1] == doctest::Approx(-2.75));
}

TEST_CASE("place_path: every ISA writes the reference's bytes, for ordinary and for absurd cars") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  std::mt19937_64 random(12);
  for (int n = 0; n < 4000; ++n) {
    PathBlock b;
    const double size = n % 4 == 0 ? 1e6 : 1.0;
    b.car = {.speed_mps = draw(random, 0, 100)};
    for (double* p : {&b.car.p_ss, &b.car.p_dd, &b.car.p_vv, &b.car.p_cc, &b.car.p_ww}) *p = size * draw(random, 0, 2);
    for (double* p : {&b.car.p_sd, &b.car.p_sv, &b.car.p_dv, &b.car.p_sc, &b.car.p_dc, &b.car.p_vc, &b.car.p_sw,
                      &b.car.p_dw, &b.car.p_vw, &b.car.p_cw})
      *p = size * draw(random, -1, 1);
    b.car.steady_along = draw(random, 0, 2), b.car.steady_across = draw(random, 0, 2);
    for (const int32_t c : {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12})
      for (double& value : b.in[c]) value = c < 5 || c > 10 ? draw(random, 0, 3) : draw(random, -1e3, 1e3);
    for (double& value : b.in[7]) value = draw(random, -kPi, kPi);
    for (double& value : b.in[10]) value = draw(random, -0.4, 0.4);
    b.heading(0) = kPi, b.heading(1) = -kHalfPi, b.heading(2) = kHalfPi, b.heading(3) = 0.0, b.heading(4) = -0.0;
    const int32_t count = n % (kPathBlock + 1);
    PathBlock truth = b;
    truth.run(*tables[0], count);
    for (int32_t t = 1; t < table_count; ++t) {
      b.run(*tables[t], count);
      for (int32_t c = 0; c < 8; ++c) {
        CAPTURE(n);
        CAPTURE(std::string(tables[t]->isa));
        CHECK(std::memcmp(b.out[c], truth.out[c], std::size_t(count) * sizeof(double)) == 0);
      }
    }
  }
}

}  // namespace
}  // namespace overtake
