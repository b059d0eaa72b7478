// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Stages 0 to 7 together: scenes with exact solutions, and properties that hold for any cloud.
#include "tests/support/segment_chain.h"

#include <doctest/doctest.h>

#include <cfenv>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/support/images.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::kDegree;
using test::RayScene;
using test::SegmentChain;
using test::TestPoint;

constexpr double kSensorHeight_m = 1.2;
const test::ScenePlane kRoad = {0, 0, 1, -kSensorHeight_m};

SensorModel paper_sensor(int32_t rows = 32, int32_t cols = 857) {
  return make_sensor_model(rows, cols, 60 * kDegree, -60 * kDegree, false, 0.5, 120);
}

SegmentChain seen(const RayScene& scene, const SensorModel& sensor, double top_deg = 10, double bottom_deg = -15) {
  SegmentChain chain(sensor, sensor.rows * sensor.cols);
  chain.run(scene.scan(sensor, top_deg * kDegree, bottom_deg * kDegree));
  return chain;
}

// Largest deviation of the smoothed angle from `truth(column)`, over all defined pairs.
template <class Truth>
double angle_error(const SegmentChain& chain, Truth truth) {
  double worst = 0;
  int32_t pairs = 0;
  for (int32_t r = 0; r + 1 < chain.part.row_count; ++r)
    for (int32_t c = 0; c < chain.sensor.cols; ++c) {
      const float angle = chain.views.images.angle_smooth_rad.at(r, c);
      if (angle == kAngleUndefined) continue;
      worst = std::fmax(worst, std::fabs(double(angle) - truth(c)));
      ++pairs;
    }
  CHECK(pairs > 1000);
  return worst;
}

double azimuth_of(const SensorModel& sensor, int32_t c) {
  return double(sensor.azimuth_left_rad) - (c + 0.5) * double(sensor.pitch_rad);
}

TEST_CASE("segmentation: a level plane has ground angle 0 and is all ground") {
  const SegmentChain chain = seen({{kRoad}, {}}, paper_sensor());
  CHECK(angle_error(chain, [](int32_t) { return 0.0; }) < 0.01 * kDegree);
  CHECK(chain.part.label_count == 0);
  REQUIRE(chain.views.points.count > 10000);
  for (int32_t i = 0; i < chain.views.points.count; ++i) REQUIRE(chain.views.points.label[i] == kLabelGround);
}

TEST_CASE("segmentation: a vertical wall has angle 90 deg and is one cluster, except for the bottom row") {
  const SegmentChain chain = seen({{{1, 0, 0, 20}}, {}}, paper_sensor());
  CHECK(angle_error(chain, [](int32_t) { return 90 * kDegree; }) < 0.1 * kDegree);
  CHECK(chain.part.row_count == 32);
  CHECK(chain.part.label_count == 1);
  for (int32_t r = 0; r < 32; ++r)
    for (int32_t c = 0; c < 857; ++c) REQUIRE(chain.views.images.labels.at(r, c) == (r < 31 ? 1 : kLabelGround));
}

TEST_CASE("segmentation: a ramp is ground up to 20 deg") {
  // z = tan(s) x - height, seen along azimuth 0, where the pair's angle is s itself.
  for (const double slope_deg : {19.9, 20.1}) {
    CAPTURE(slope_deg);
    const double s = slope_deg * kDegree;
    const RayScene ramp{{{-std::sin(s), 0, std::cos(s), -kSensorHeight_m * std::cos(s)}}, {}};
    const SensorModel sensor = paper_sensor();
    const SegmentChain chain = seen(ramp, sensor, 10, -30);
    const int32_t middle = 428;
    CHECK(std::fabs(azimuth_of(sensor, middle)) < 1e-6);
    int32_t steep = 0, level = 0;
    for (int32_t r = 0; r + 1 < chain.part.row_count; ++r) {
      if (chain.views.images.range_m.at(r, middle) == kNoReturn) continue;
      ++(chain.views.images.nonground.test(r, middle) ? steep : level);
      CHECK(double(chain.views.images.angle_smooth_rad.at(r, middle)) == doctest::Approx(s).epsilon(1e-3));
    }
    CHECK(steep + level > 10);
    CHECK((slope_deg < 20 ? steep : level) == 0);
  }
}

TEST_CASE("segmentation: a banked road is ground; its angle is atan(tan(bank) |sin a|) in the column at azimuth a") {
  const double bank = 15 * kDegree;
  const SensorModel sensor = paper_sensor();
  const SegmentChain chain = seen({{{0, -std::sin(bank), std::cos(bank), -kSensorHeight_m}}, {}}, sensor, 8, -20);
  const double error = angle_error(
      chain, [&](int32_t c) { return std::atan(std::tan(bank) * std::fabs(std::sin(azimuth_of(sensor, c)))); });
  CHECK(error < 0.02 * kDegree);
  CHECK(chain.part.label_count == 0);
  for (int32_t i = 0; i < chain.views.points.count; ++i) REQUIRE(chain.views.points.label[i] == kLabelGround);
}

TEST_CASE("segmentation: a box on a plane is one cluster") {
  const test::SceneBox car = {{14, -3.5, -kSensorHeight_m}, {18.9, -1.6, -0.1}};
  const SegmentChain chain = seen({{kRoad}, {car}}, paper_sensor());
  CHECK(chain.part.label_count == 1);
  int32_t on_car = 0, of_cluster = 0;
  for (int32_t i = 0; i < chain.views.points.count; ++i) {
    const double x = double(chain.part.scan.x_m[i]), y = double(chain.part.scan.y_m[i]),
                 z = double(chain.part.scan.z_m[i]);
    REQUIRE(chain.reason(i) == Reason::kLabelled);
    const bool car_point = z > -kSensorHeight_m + 0.01;
    on_car += car_point;
    of_cluster += chain.views.points.label[i] == 1;
    // Smoothing lets an upright pair reach two rows: road before the car's foot may join, nothing else.
    if (chain.views.points.label[i] == 1) CHECK((car_point || (x > 10 && x < 14.01 && y > -4 && y < -1)));
    // and the car's faces join, but for the roof, which is level, and its last row above the road
    if (car_point && z < -0.2 && z > -kSensorHeight_m + 0.4) CHECK(chain.views.points.label[i] == 1);
  }
  CHECK(on_car > 300);
  CHECK(of_cluster > 300);
}

// ---- any cloud ------------------------------------------------------------------------------------------------------

float pick(std::mt19937& random, std::initializer_list<float> from) { return from.begin()[random() % from.size()]; }

// Points of a rough scene, and points with every kind of fault.
std::vector<TestPoint> random_cloud(std::mt19937& random, const SensorModel& sensor, int32_t count) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  std::uniform_real_distribution<float> azimuth(-3.2f, 3.2f), range(0.2f, 140.0f), noise(-0.3f, 0.3f);
  std::vector<TestPoint> cloud;
  for (int32_t i = 0; i < count; ++i) {
    const float layer = float(random() % uint32_t(sensor.rows + 2));
    const float a = azimuth(random), e = 0.3f - 0.02f * layer;
    const float r = random() % 3 == 0 ? range(random) : 20.0f + 5.0f * std::floor(a * 3) + noise(random);
    TestPoint p = {r * std::cos(e) * std::cos(a), r * std::cos(e) * std::sin(a), r * std::sin(e), float(random() % 4),
                   layer * 97};
    float* const coordinate[3] = {&p.x_m, &p.y_m, &p.z_m};
    switch (random() % 16) {
      case 0: *coordinate[random() % 3] = pick(random, {kNan, kInf, -kInf}); break;
      case 1: *coordinate[random() % 3] = pick(random, {3e38f, -3e38f, FLT_MAX, 1e19f, 1e18f}); break;
      case 2: p.x_m = p.y_m = p.z_m = pick(random, {0.0f, -0.0f, FLT_MIN / 8, 1e-20f}); break;
      case 3: p.layer = pick(random, {-1.0f, 65536.0f, 0.5f, 1e30f, kNan, kInf, 65535.0f}); break;
      case 4: p.intensity = pick(random, {kNan, kInf, -kInf, -1.0f, 1e-42f}); break;
      case 5: *coordinate[random() % 3] = pick(random, {0.0f, -0.0f, 1e-30f, -1e-42f}); break;
      case 6:
        if (!cloud.empty()) p = cloud[random() % cloud.size()];
        break;
      default: break;
    }
    cloud.push_back(p);
  }
  return cloud;
}

template <class T>
bool same_pixels(Plane<T> a, Plane<T> b) {
  for (int32_t r = 0; r < a.rows; ++r)
    if (std::memcmp(a.row(r), b.row(r), std::size_t(a.cols) * sizeof(T)) != 0) return false;
  return true;
}

bool same_bits(BitPlane a, BitPlane b) {
  return std::memcmp(a.words, b.words, std::size_t(a.rows) * std::size_t(a.words_per_row) * 8) == 0;
}

// Compares all images except pixel_point, which holds indices of input rows.
void check_same_images(const RangeImages& a, const RangeImages& b) {
  CHECK(same_pixels(a.range_m, b.range_m));
  CHECK(same_pixels(a.elevation_rad, b.elevation_rad));
  CHECK(same_pixels(a.range_filled_m, b.range_filled_m));
  CHECK(same_pixels(a.elevation_filled_rad, b.elevation_filled_rad));
  CHECK(same_pixels(a.angle_rad, b.angle_rad));
  CHECK(same_pixels(a.angle_smooth_rad, b.angle_smooth_rad));
  CHECK(same_pixels(a.range_repaired_m, b.range_repaired_m));
  CHECK(same_pixels(a.elevation_repaired_rad, b.elevation_repaired_rad));
  CHECK(same_pixels(a.labels, b.labels));
  CHECK(same_bits(a.nonground, b.nonground));
  CHECK(same_bits(a.nonground_repaired, b.nonground_repaired));
  CHECK(same_bits(a.link_right, b.link_right));
  CHECK(same_bits(a.link_down, b.link_down));
}

int32_t values_not_finite(const RangeImages& m) {
  int32_t bad = 0;
  for (const Plane<float>& p : {m.range_m, m.elevation_rad, m.range_filled_m, m.elevation_filled_rad, m.angle_rad,
                                m.angle_smooth_rad, m.range_repaired_m, m.elevation_repaired_rad})
    for (int32_t r = 0; r < p.rows; ++r)
      for (int32_t c = 0; c < p.cols; ++c) bad += !std::isfinite(p.at(r, c));
  return bad;
}

struct Shape {
  int32_t rows, cols;
  bool wraps;
};
constexpr Shape kShapes[] = {{1, 1, false},  {1, 1, true},      {1, 16, false},   {2, 2, true},
                             {8, 64, true},  {5, 17, false},    {32, 857, false}, {64, 300, true},
                             {8, 64, false}, {128, 2048, true}, {3, 129, false}};

SensorModel model_of(const Shape& shape) {
  return shape.wraps ? make_sensor_model(shape.rows, shape.cols, 180 * kDegree, -180 * kDegree, true, 0.0, 120)
                     : make_sensor_model(shape.rows, shape.cols, 60 * kDegree, -60 * kDegree, false, 0.5, 1e30);
}

TEST_CASE("segmentation: for any cloud every input point gets a label or a reason") {
  int32_t tally[int(Reason::kCount)] = {}, clusters = 0;
  for (const Shape& shape : kShapes)
    for (uint32_t seed = 1; seed <= 4; ++seed) {
      CAPTURE(shape.rows);
      CAPTURE(shape.cols);
      CAPTURE(shape.wraps);
      CAPTURE(seed);
      std::mt19937 random(seed);
      const SensorModel sensor = model_of(shape);
      const int32_t count = seed == 4 ? 40 : shape.rows * shape.cols + 500;
      SegmentChain chain(sensor, count);
      chain.run(random_cloud(random, sensor, count));
      const PointTable& points = chain.views.points;
      const RangeImages& m = chain.views.images;
      REQUIRE(points.count == count);
      int32_t wrong = 0;
      for (int32_t i = 0; i < count; ++i) {
        const Reason reason = chain.reason(i);
        REQUIRE(reason < Reason::kCount);
        const int32_t label = points.label[i];
        const bool labelled = reason == Reason::kLabelled;
        wrong += labelled ? label < 0 || label > chain.part.label_count : label != kLabelNone;
        wrong += labelled && points.pixel[i] < 0;
        ++tally[int(reason)];
      }
      CHECK(wrong == 0);
      CHECK(values_not_finite(m) == 0);
      for (const BitPlane& bits : {m.nonground, m.nonground_repaired, m.link_right, m.link_down})
        CHECK(test::tail_is_clear(bits));
      clusters += chain.part.label_count;
    }
  for (int reason = 0; reason < int(Reason::kCount); ++reason) {  // the clouds contain every reason
    CAPTURE(reason);
    // This chain has no step that finds smoke or the own car.
    CHECK((tally[reason] > 0) == (Reason(reason) != Reason::kSmoke && Reason(reason) != Reason::kOwnBody));
  }
  CHECK(clusters > 100);
}

TEST_CASE("segmentation: bad points have no effect: without them the result is the same, bit by bit") {
  for (const Shape& shape : kShapes)
    for (uint32_t seed = 11; seed <= 13; ++seed) {
      CAPTURE(shape.rows);
      CAPTURE(shape.cols);
      CAPTURE(shape.wraps);
      CAPTURE(seed);
      std::mt19937 random(seed);
      const SensorModel sensor = model_of(shape);
      const int32_t count = shape.rows * shape.cols + 300;
      const std::vector<TestPoint> cloud = random_cloud(random, sensor, count);
      SegmentChain all(sensor, count), good(sensor, count);
      all.run(cloud);

      std::vector<TestPoint> kept;
      std::vector<int32_t> kept_from;
      for (int32_t i = 0; i < count; ++i) {
        const Reason reason = all.reason(i);
        if (reason >= Reason::kNotFinite && reason <= Reason::kOutsideAzimuth) continue;
        kept.push_back(cloud[std::size_t(i)]);
        kept_from.push_back(i);
      }
      REQUIRE(kept.size() < cloud.size());
      good.run(random_cloud(random, sensor, count));  // an earlier scan must have no effect
      good.run(kept);

      CHECK(good.part.row_count == all.part.row_count);
      CHECK(good.part.label_count == all.part.label_count);
      check_same_images(good.views.images, all.views.images);
      int32_t wrong = 0;
      for (std::size_t k = 0; k < kept.size(); ++k) {
        const auto i = std::size_t(kept_from[k]);
        wrong += good.views.points.label[k] != all.views.points.label[i] ||
                 good.views.points.reason[k] != all.views.points.reason[i] ||
                 good.views.points.pixel[k] != all.views.points.pixel[i];
      }
      for (int32_t r = 0; r < shape.rows; ++r)
        for (int32_t c = 0; c < shape.cols; ++c) {
          const int32_t winner = good.views.images.pixel_point.at(r, c);
          wrong += (winner < 0 ? winner : kept_from[std::size_t(winner)]) != all.views.images.pixel_point.at(r, c);
        }
      CHECK(wrong == 0);
    }
}

#if !defined(__clang__)  // clang computes values before a branch decides, which sets the flags
TEST_CASE("segmentation: for any cloud no scalar kernel divides by zero, overflows or computes with NaN") {
  for (const Shape& shape : kShapes) {
    CAPTURE(shape.rows);
    CAPTURE(shape.cols);
    std::mt19937 random(31);
    INFO("seed 31");
    const SensorModel sensor = model_of(shape);
    const int32_t count = shape.rows * shape.cols + 300;
    const std::vector<TestPoint> cloud = random_cloud(random, sensor, count);
    SegmentChain chain(sensor, count);
    chain.kernels = find_kernels("ref");  // vector forms also compute in the padding
    std::feclearexcept(FE_ALL_EXCEPT);
    chain.run(cloud);
    CHECK(std::fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW) == 0);
  }
}
#endif

TEST_CASE("segmentation: the images restore every pixel's point from r, e and the column") {
  std::mt19937 random(21);
  INFO("seed 21");
  const SensorModel sensor = make_sensor_model(32, 1084, 180 * kDegree, -180 * kDegree, true, 0.5, 120);
  SegmentChain chain(sensor, 40000);
  chain.run(random_cloud(random, sensor, 40000));
  int32_t pixels = 0;
  for (int32_t r = 0; r < 32; ++r)
    for (int32_t c = 0; c < 1084; ++c) {
      const int32_t i = chain.views.images.pixel_point.at(r, c);
      CHECK((i == kNoPoint) == (chain.views.images.range_m.at(r, c) == kNoReturn));
      if (i == kNoPoint) continue;
      const double range = double(chain.views.images.range_m.at(r, c)),
                   e = double(chain.views.images.elevation_rad.at(r, c));
      const double x = double(chain.part.scan.x_m[i]), y = double(chain.part.scan.y_m[i]),
                   z = double(chain.part.scan.z_m[i]);
      CHECK(std::fabs(range * std::sin(e) - z) < 1e-6 * range);
      CHECK(std::fabs(range * std::cos(e) - std::hypot(x, y)) < 1e-6 * range);
      const double off = std::remainder(std::atan2(y, x) - azimuth_of(sensor, c), 360 * kDegree);
      CHECK(std::fabs(off) < 0.5 * double(sensor.pitch_rad) + 1e-5);
      CHECK(chain.views.row_of_layer[chain.part.scan.layer[i]] == r);
      ++pixels;
    }
  CHECK(pixels > 10000);
}

TEST_CASE("segmentation: an empty scan is valid, and so is one with all points in one pixel") {
  for (const Shape& shape : kShapes) {
    CAPTURE(shape.rows);
    CAPTURE(shape.cols);
    SegmentChain chain(model_of(shape), 100);
    const std::vector<TestPoint> heap(100, TestPoint{20, 1, 2, 3, 500});
    chain.run(heap);
    CHECK(chain.part.row_count == 1);
    CHECK(chain.part.label_count == 0);  // the bottom row is ground
    for (int32_t i = 0; i < 100; ++i) CHECK(chain.views.points.label[i] == kLabelGround);
    chain.run({});
    CHECK(chain.views.points.count == 0);
    CHECK(chain.part.row_count == 0);
    CHECK(chain.part.label_count == 0);
    CHECK(values_not_finite(chain.views.images) == 0);
    for (int32_t r = 0; r < shape.rows; ++r)
      for (int32_t c = 0; c < shape.cols; ++c) REQUIRE(chain.views.images.labels.at(r, c) == kLabelNone);
  }
}

}  // namespace
}  // namespace overtake
