// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Cars of 4.921 x 1.886 m, seen from the origin unless noted otherwise.
#include "kernels/fit_rectangle.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/paper_params.h"

using namespace overtake;

namespace {

constexpr double kLength = 4.921, kWidth = 1.886, kDegree = M_PI / 180;

struct Cloud {
  std::vector<float> x, y;
  void add(double px, double py) { x.push_back(float(px)), y.push_back(float(py)); }
  int32_t count() const { return int32_t(x.size()); }
  RectangleFit fit(double heading_ref = 0, double sensor_x = 0, double sensor_y = 0,
                   const FitRectangleParams& params = test::paper_frame_params().fit_rectangle) const {
    return ref::fit_rectangle(params, x.data(), y.data(), count(), float(heading_ref), float(sensor_x),
                              float(sensor_y));
  }
};

// One side from (x0, y0) to (x1, y1), both ends included.
void add_face(Cloud& cloud, double x0, double y0, double x1, double y1, double spacing) {
  const int n = std::max(1, int(std::hypot(x1 - x0, y1 - y0) / spacing));
  for (int i = 0; i <= n; ++i) cloud.add(x0 + (x1 - x0) * i / n, y0 + (y1 - y0) * i / n);
}

// The sides of a car that the sensor sees. `grazing`: the smaller sine of incidence of the two sides, 0 with one side.
Cloud see_car(double cx, double cy, double heading, double sx, double sy, double spacing, double* grazing = nullptr) {
  Cloud cloud;
  const double c = std::cos(heading), s = std::sin(heading);
  double least = 1;
  int faces = 0;
  for (int face = 0; face < 4; ++face) {
    const bool end = face % 2 == 0;  // front, left, rear, right
    const double sign = face < 2 ? 1 : -1;
    const double nx = sign * (end ? c : -s), ny = sign * (end ? s : c);
    const double half = end ? kLength / 2 : kWidth / 2, other = end ? kWidth / 2 : kLength / 2;
    const double mx = cx + nx * half, my = cy + ny * half;
    const double incidence = ((sx - mx) * nx + (sy - my) * ny) / std::hypot(sx - mx, sy - my);
    if (incidence <= 0) continue;
    least = std::min(least, incidence);
    ++faces;
    add_face(cloud, mx - ny * other, my + nx * other, mx + ny * other, my - nx * other, spacing);
  }
  if (grazing) *grazing = faces == 2 ? least : 0;
  return cloud;
}

double wrap(double a) { return std::remainder(a, 2 * M_PI); }
double line_error(double a, double b) { return std::fabs(std::remainder(a - b, M_PI)); }

bool all_finite(const RectangleFit& f) {
  for (float v : {f.heading_ref_rad, f.heading_var_rad, f.heading_rad, f.center_x_m, f.center_y_m, f.ref_x_m, f.ref_y_m,
                  f.var_x_m, f.var_y_m, f.extent_length_m, f.extent_width_m})
    if (!std::isfinite(v)) return false;
  return true;
}

}  // namespace

TEST_CASE("fit_rectangle: finds the closed-form heading, centre and extent of an L") {
  // Heading 30 deg, nearest corner at (20, 0): the rear is left of the corner, the right side ahead of it.
  const double c = std::cos(30 * kDegree), s = std::sin(30 * kDegree);
  Cloud cloud;
  add_face(cloud, 20 - kWidth * s, kWidth * c, 20, 0, 0.1);
  add_face(cloud, 20, 0, 20 + kLength * c, kLength * s, 0.1);
  const RectangleFit f = cloud.fit(0.6);
  CHECK(f.heading_var_rad == doctest::Approx(30 * kDegree).epsilon(1e-5));
  CHECK(f.inliers_var == cloud.count());
  CHECK(f.var_x_m == doctest::Approx(20 + kLength / 2 * c - kWidth / 2 * s).epsilon(1e-5));
  CHECK(f.var_y_m == doctest::Approx(kLength / 2 * s + kWidth / 2 * c).epsilon(1e-5));
  const RectangleFit straight = cloud.fit(30 * kDegree);
  CHECK(straight.extent_length_m == doctest::Approx(kLength).epsilon(1e-4));
  CHECK(straight.extent_width_m == doctest::Approx(kWidth).epsilon(1e-4));
}

TEST_CASE("fit_rectangle: psi_VAR of a spun car is within 1 deg at every heading when two full sides are visible") {
  int seen = 0;
  for (int deg = 0; deg < 360; deg += 7)
    for (double bearing : {0.0, 37.0, 140.0, -95.0}) {
      CAPTURE(deg);
      CAPTURE(bearing);
      double grazing;
      const double cx = 20 * std::cos(bearing * kDegree), cy = 20 * std::sin(bearing * kDegree);
      const Cloud cloud = see_car(cx, cy, deg * kDegree, 0, 0, 0.08, &grazing);
      if (grazing < 0.1) continue;
      ++seen;
      // The reference is within 90 deg, so the direction is the car's, too.
      const RectangleFit f = cloud.fit((deg + 60) * kDegree);
      CHECK(std::fabs(wrap(f.heading_var_rad - deg * kDegree)) < 1 * kDegree);
      CHECK(f.inliers_var == cloud.count());
      CHECK(std::hypot(f.var_x_m - cx, f.var_y_m - cy) < 0.05);
    }
  CHECK(seen > 150);
}

TEST_CASE("fit_rectangle: psi_VAR of a spun car is within 1 deg with 1.5 cm of noise") {
  for (int deg = 0; deg < 360; deg += 7) {
    const uint32_t seed = uint32_t(1000 + deg);
    CAPTURE(seed);
    double grazing;
    Cloud cloud = see_car(15, -8, deg * kDegree, 0, 0, 0.04, &grazing);
    if (grazing < 0.2) continue;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.015);
    for (float& v : cloud.x) v += float(noise(random));
    for (float& v : cloud.y) v += float(noise(random));
    CHECK(line_error(cloud.fit(0).heading_var_rad, deg * kDegree) < 1 * kDegree);
  }
}

TEST_CASE("fit_rectangle: psi_VAR is refined below the 1 deg grid, also across 90 deg") {
  for (double deg : {12.5, 12.25, 12.125, 12.0625, 12.4375, 0.4375, 89.5625, 89.9375, 45.5}) {
    CAPTURE(deg);
    const Cloud cloud = see_car(18, 9, deg * kDegree, 0, 0, 0.05);
    CHECK(line_error(cloud.fit(deg * kDegree).heading_var_rad, deg * kDegree) < 0.01 * kDegree);
  }
}

TEST_CASE("fit_rectangle: with equal inliers psi_REF wins (eq. 5)") {
  // Only the rear, seen from straight behind: every rectangle contains all points.
  Cloud rear;
  add_face(rear, 40, 0.9, 40, -0.9, 0.05);
  const RectangleFit f = rear.fit(0.05);
  CHECK(f.inliers_ref == rear.count());
  CHECK(f.inliers_var == rear.count());
  CHECK_FALSE(f.from_var);
  CHECK(f.heading_rad == f.heading_ref_rad);
  CHECK(f.center_x_m == f.ref_x_m);
  CHECK(f.center_y_m == f.ref_y_m);
  // Both theta and theta + 90 deg contain all points: psi_VAR is the one nearer to psi_REF.
  CHECK(std::fabs(f.heading_var_rad) < 0.1 * kDegree);
}

TEST_CASE("fit_rectangle: with only the rear visible, the car extends away from the sensor by its known length") {
  Cloud rear;
  add_face(rear, 40, 0.943, 40, -0.943, 0.05);
  const RectangleFit f = rear.fit(0);
  CHECK(f.center_x_m == doctest::Approx(40 + kLength / 2));
  CHECK(f.center_y_m == doctest::Approx(0).epsilon(1e-4));
  CHECK(f.extent_length_m == doctest::Approx(0));
  CHECK(f.extent_width_m == doctest::Approx(kWidth));
  // Seen from the front, the same side is its front.
  CHECK(rear.fit(0, 80, 0).center_x_m == doctest::Approx(40 - kLength / 2));
}

TEST_CASE("fit_rectangle: psi_VAR finds a car that stands sideways, its centre within centimetres") {
  for (double bearing : {-30.0, -12.0, 10.0, 33.0})
    for (double distance : {8.0, 20.0, 45.0}) {
      CAPTURE(bearing);
      CAPTURE(distance);
      const double cx = distance * std::cos(bearing * kDegree), cy = distance * std::sin(bearing * kDegree);
      const Cloud cloud = see_car(cx, cy, 90 * kDegree, 0, 0, 0.1);
      const RectangleFit f = cloud.fit(0);
      CHECK(f.from_var);
      CHECK(f.inliers_ref < f.inliers_var);
      CHECK(f.inliers_var == cloud.count());
      CHECK(line_error(f.heading_rad, 90 * kDegree) < 0.2 * kDegree);
      CHECK(std::hypot(f.center_x_m - cx, f.center_y_m - cy) < 0.03);
      CHECK(f.extent_length_m == doctest::Approx(kLength).epsilon(0.01));
    }
}

TEST_CASE("fit_rectangle: finds a car that stands sideways from one side") {
  Cloud flank;
  add_face(flank, 30, -kLength / 2, 30, kLength / 2, 0.1);
  const RectangleFit f = flank.fit(0.2);
  CHECK(f.from_var);
  CHECK(f.heading_rad == doctest::Approx(90 * kDegree));
  CHECK(f.center_x_m == doctest::Approx(30 + kWidth / 2));
  CHECK(f.center_y_m == doctest::Approx(0).epsilon(1e-4));
}

TEST_CASE("fit_rectangle: if theta and theta + 90 deg have equal inliers, psi_VAR is the one nearer to psi_REF") {
  // Only the rear of a car with heading -20 deg: the grid finds the line of the rear, 70 deg.
  const double c = std::cos(70 * kDegree), s = std::sin(70 * kDegree);
  Cloud rear;
  add_face(rear, 30 - 0.9 * c, -0.9 * s, 30 + 0.9 * c, 0.9 * s, 0.05);
  CHECK(rear.fit(0).heading_var_rad == doctest::Approx(-20 * kDegree));
  CHECK(rear.fit(-60 * kDegree).heading_var_rad == doctest::Approx(-20 * kDegree));
  CHECK(rear.fit(-170 * kDegree).heading_var_rad == doctest::Approx(160 * kDegree));
  CHECK(rear.fit(80 * kDegree).heading_var_rad == doctest::Approx(70 * kDegree));
}

TEST_CASE("fit_rectangle: the inliers, not psi_REF, decide between theta and theta + 90 deg") {
  // A car with heading 80 deg: nearest to psi_REF would be -10 deg.
  const Cloud cloud = see_car(25, 4, 80 * kDegree, 0, 0, 0.1);
  const RectangleFit f = cloud.fit(0);
  CHECK(f.from_var);
  CHECK(f.heading_rad == doctest::Approx(80 * kDegree).scale(0).epsilon(0.005));
}

TEST_CASE("fit_rectangle: psi_VAR takes the direction nearer to psi_REF, in (-pi, pi]") {
  const Cloud cloud = see_car(-20, 6, 20 * kDegree, 0, 0, 0.1);
  for (int ref = -180; ref <= 180; ref += 10) {
    if (std::abs(std::abs(ref - 20) - 90) < 5) continue;
    CAPTURE(ref);
    const RectangleFit f = cloud.fit(ref * kDegree);
    const double want = std::fabs(wrap((ref - 20) * kDegree)) < M_PI / 2 ? 20 : -160;
    CHECK(f.heading_var_rad == doctest::Approx(want * kDegree).scale(0).epsilon(0.005));
    CHECK(f.heading_ref_rad > -float(M_PI));
    CHECK(f.heading_ref_rad <= float(M_PI));
  }
  Cloud backwards;  // due west: +pi, never -pi
  add_face(backwards, 40, 0.9, 40, -0.9, 0.05);
  CHECK(backwards.fit(M_PI).heading_var_rad == float(M_PI));
  CHECK(backwards.fit(-3.13).heading_var_rad == float(M_PI));
}

TEST_CASE("fit_rectangle: of equally near corners it takes the one on the sensor's left, with any rounding") {
  // A side of 1 m across the view, seen from its middle: the car starts at its left end and extends to the right.
  for (int quarter = 0; quarter < 4; ++quarter)
    for (double jitter : {0.0, 1e-5, -1e-5, 4e-4, -4e-4})
      for (double ref : {0.0, 180.0}) {
        CAPTURE(quarter);
        CAPTURE(jitter);
        CAPTURE(ref);
        const double a = quarter * 90 * kDegree, c = std::cos(a), s = std::sin(a);
        Cloud face;
        for (int i = 0; i <= 10; ++i) {
          const double ahead = 30, left = 0.5 - 0.1 * i + (i == 0 ? jitter : 0);
          face.add(100 + ahead * c - left * s, 200 + ahead * s + left * c);
        }
        const RectangleFit f = face.fit(a + ref * kDegree, 100, 200);
        const double ahead = 30 + kLength / 2, left = 0.5 - kWidth / 2;
        CHECK(std::hypot(f.ref_x_m - (100 + ahead * c - left * s), f.ref_y_m - (200 + ahead * s + left * c)) < 2e-3);
      }
  // Beyond a millimetre the nearer corner decides: after a move to the left, the right corner is nearer.
  Cloud moved;
  add_face(moved, 30, 0.51, 30, -0.49, 0.1);
  CHECK(moved.fit(0).ref_y_m == doctest::Approx(-0.49 + kWidth / 2));
  Cloud moved_right;
  add_face(moved_right, 30, 0.49, 30, -0.51, 0.1);
  CHECK(moved_right.fit(0).ref_y_m == doctest::Approx(0.49 - kWidth / 2));
}

TEST_CASE("fit_rectangle: of equally near corners on the heading axis it takes the one on the sensor's left") {
  // 2 m of the side of a car that drives across the view (psi_REF 90 deg), seen from their middle.
  Cloud flank;
  add_face(flank, 30, 1, 30, -1, 0.1);
  for (double ref : {90.0, -90.0}) {
    const RectangleFit f = flank.fit(ref * kDegree);
    CHECK(f.ref_x_m == doctest::Approx(30 + kWidth / 2));
    CHECK(f.ref_y_m == doctest::Approx(1 - kLength / 2));
  }
}

TEST_CASE("fit_rectangle: points up to the margin outside the rectangle count, those beyond do not") {
  // The corner is (10, 1): the car covers x 10 .. 14.921, y -0.886 .. 1; the far sides have 0.10 m of margin.
  Cloud cloud;
  add_face(cloud, 10, 1, 11, 1, 0.1);
  const int32_t base = cloud.count();
  const auto inliers_with = [&](double x, double y) {
    Cloud more = cloud;
    more.add(x, y);
    return more.fit(0, 0, 8).inliers_ref - base;  // seen from (0, 8): the near corner is still (10, 1)
  };
  CHECK(inliers_with(10 + kLength + 0.099, 1) == 1);
  CHECK(inliers_with(10 + kLength + 0.101, 1) == 0);
  CHECK(inliers_with(10, 1 - kWidth - 0.099) == 1);
  CHECK(inliers_with(10, 1 - kWidth - 0.101) == 0);
}

TEST_CASE("fit_rectangle: with fewer than 5 points psi_VAR is psi_REF") {
  Cloud cloud;
  add_face(cloud, 20, 0, 21, 1, 0.4);
  REQUIRE(cloud.count() == 4);
  const RectangleFit four = cloud.fit(0.1);
  CHECK(four.heading_var_rad == four.heading_ref_rad);
  CHECK(four.inliers_var == four.inliers_ref);
  CHECK(four.var_x_m == four.ref_x_m);
  CHECK_FALSE(four.from_var);
  cloud.add(20.5, 0.5);
  CHECK(cloud.fit(0.1).heading_var_rad == doctest::Approx(45 * kDegree));
}

TEST_CASE("fit_rectangle: gives finite numbers for any finite input") {
  constexpr float kHuge = std::numeric_limits<float>::max();
  const FitRectangleParams params = test::paper_frame_params().fit_rectangle;
  const auto check = [&](const Cloud& cloud, float ref, float sx, float sy) {
    const RectangleFit f = ref::fit_rectangle(params, cloud.x.data(), cloud.y.data(), cloud.count(), ref, sx, sy);
    CHECK(all_finite(f));
    CHECK(f.inliers_ref >= 0);
    CHECK(f.inliers_var <= cloud.count());
    return f;
  };
  for (int count : {1, 2, 3, 4, 5, 16, 17, 100, 20000}) {
    CAPTURE(count);
    for (double place : {0.0, 1.0, 1e4, -1e4}) {
      CAPTURE(place);
      Cloud equal, line, steep;
      for (int i = 0; i < count; ++i) {
        equal.add(place, -place);
        line.add(place + 0.0003 * i, place);
        steep.add(place, place + 0.0002 * i);
      }
      for (const Cloud* cloud : {&equal, &line, &steep})
        for (float ref : {0.0f, 3.0f, -40.0f}) {
          check(*cloud, ref, 0, 0);
          check(*cloud, ref, cloud->x[0], cloud->y[0]);  // the sensor is inside the cluster
        }
    }
  }
  Cloud wild;
  for (float v : {0.0f, kHuge, -kHuge, 1e-40f, -0.0f, 1.0f, 3e19f, -1e30f})
    wild.add(v, -v), wild.add(v, 1), wild.add(2, v);
  check(wild, 0, 0, 0);
  check(wild, kHuge, kHuge, -kHuge);
  check(wild, -1e20f, -kHuge, 0);
  std::rotate(wild.x.begin(), wild.x.begin() + 4, wild.x.end());
  check(wild, 1, 0, kHuge);
}

TEST_CASE("fit_rectangle: a cluster's heading is the same bits at any position up to 1e4 m") {
  // Coordinates on a grid of 2^-9 m, which float32 holds up to 1e4 m, so that offsets are exact.
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> grid(-700, 700);
    Cloud near, far;
    for (int i = 0; i < 60; ++i) {
      const double x = grid(random) / 512.0 * 1.5, y = grid(random) / 512.0;
      near.add(std::floor(x * 512) / 512, y);
      far.add(near.x.back() + 8192.0, y - 9000.0);
    }
    const RectangleFit a = near.fit(0.3, -16, 4), b = far.fit(0.3, -16 + 8192.0, 4 - 9000.0);
    CHECK(a.heading_var_rad == b.heading_var_rad);
    CHECK(a.inliers_var == b.inliers_var);
    CHECK(a.inliers_ref == b.inliers_ref);
    CHECK(b.center_x_m - 8192.0f == doctest::Approx(a.center_x_m).epsilon(0.002));
  }
}

TEST_CASE("fit_rectangle: psi_VAR has the least cost of all headings, evaluated in long double") {
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(0, 1);
    std::normal_distribution<double> noise(0, 0.02);
    Cloud cloud = see_car(30 * any(random) + 8, 10 * any(random) - 5, 7 * any(random), 0, 0, 0.05 + 0.2 * any(random));
    for (float& v : cloud.x) v += float(noise(random));
    for (float& v : cloud.y) v += float(noise(random));
    const auto cost = [&](double theta) {
      const long double c = std::cos(theta), s = std::sin(theta);
      std::vector<long double> c1, c2, set[2];
      for (size_t k = 0; k < cloud.x.size(); ++k) {
        c1.push_back(cloud.x[k] * c + cloud.y[k] * s);
        c2.push_back(cloud.y[k] * c - cloud.x[k] * s);
      }
      const auto [low1, high1] = std::minmax_element(c1.begin(), c1.end());
      const auto [low2, high2] = std::minmax_element(c2.begin(), c2.end());
      for (size_t k = 0; k < c1.size(); ++k) {
        const long double d1 = std::min(c1[k] - *low1, *high1 - c1[k]), d2 = std::min(c2[k] - *low2, *high2 - c2[k]);
        set[d1 <= d2 ? 0 : 1].push_back(std::min(d1, d2));
      }
      long double total = 0;
      for (const auto& d : set) {
        long double mean = 0, square = 0;
        for (long double v : d) mean += v / (long double)d.size();
        for (long double v : d) square += (v - mean) * (v - mean);
        if (!d.empty()) total += square / (long double)d.size();
      }
      return double(total);
    };
    const RectangleFit f = cloud.fit(0);
    const double got = cost(f.heading_var_rad);
    for (int deg = 0; deg < 90; ++deg) {
      CAPTURE(deg);
      CHECK(got <= cost(deg * kDegree) + 1e-6);
    }
  }
}

TEST_CASE("fit_rectangle: does not read past its points, and repeats its bytes") {
  Cloud cloud = see_car(22, -3, 0.4, 0, 0, 0.1);
  const RectangleFit a = cloud.fit(0.1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const int32_t count = cloud.count();
  cloud.x.resize(cloud.x.size() + 16, nan);
  cloud.y.resize(cloud.y.size() + 16, nan);
  const RectangleFit b =
      ref::fit_rectangle(test::paper_frame_params().fit_rectangle, cloud.x.data(), cloud.y.data(), count, 0.1f, 0, 0);
  CHECK(std::memcmp(&a.heading_rad, &b.heading_rad, sizeof(RectangleFit) - offsetof(RectangleFit, heading_rad)) == 0);
  CHECK(a.heading_var_rad == b.heading_var_rad);
}
