// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Smoke and dust are not obstacles.
#include "kernels/drop_smoke.h"

#include <doctest/doctest.h>

#include <optional>
#include <random>
#include <string>
#include <vector>

#include "pipeline/method/mark_smoke.h"
#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::OwnedBits;
using test::OwnedPlane;

// Obstacles whose ranges jump by up to `jump_m`.
struct Box {
  int32_t top, left, rows, cols;
  float range_m, jump_m, light;
};
constexpr Box kSmoke = {0, 10, 8, 20, 8.0f, 2.5f, 0.02f};

// Obstacles over one row of road, a later one hides an earlier one. A point a pixel; the road's intensity is 1.
struct Scene {
  static constexpr int32_t kRows = 9, kCols = 75, kObstacleRows = kRows - 1;
  explicit Scene(const std::vector<Box>& boxes = {})
      : range(kRows, kCols),
        point(kRows, kCols),
        nonground(kRows, kCols),
        considered(kRows, kCols),
        rough(kRows, kCols),
        smoke(kRows, kCols) {
    range.fill(0.0f);
    nonground.clear();
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) point.at(r, c) = kNoPoint;
    for (int32_t c = 0; c < kCols; ++c) add(kRows - 1, c, 5.0f, 1.0f);
    for (const Box& box : boxes) add_box(box);
  }
  void add(int32_t r, int32_t c, float range_m, float light) {
    range.at(r, c) = range_m;
    point.at(r, c) = int32_t(intensity.size());
    intensity.push_back(light);
    if (r < kObstacleRows) nonground.view().set(r, c);
  }
  void add_box(const Box& box) {
    for (int32_t r = box.top; r < box.top + box.rows; ++r)
      for (int32_t c = box.left; c < box.left + box.cols; ++c)
        add(r, c, box.range_m + box.jump_m * std::uniform_real_distribution<float>(0.0f, 1.0f)(random), box.light);
  }
  void scale_intensity(float factor) {
    for (float& light : intensity) light *= factor;
  }
  // The numbers of obstacles that are smoke, and that are not.
  struct Result {
    int32_t smoke, kept;
    bool operator==(const Result&) const = default;
  };
  Result run(DropSmokeParams params = test::paper_params().drop_smoke) {
    intensity.resize(std::size_t(round_up(int32_t(intensity.size()), kRowAlign)));
    ScanTable scan;
    scan.count = scan.capacity = int32_t(intensity.size());
    scan.intensity = intensity.data();
    std::vector<float> x_m(intensity.size()), zero(intensity.size());
    scan.x_m = x_m.data(), scan.y_m = scan.z_m = zero.data();
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c)
        if (point.at(r, c) != kNoPoint) x_m[std::size_t(point.at(r, c))] = range.at(r, c);
    std::vector<int32_t> pixel(intensity.size(), -1);
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c)
        if (point.at(r, c) != kNoPoint) pixel[std::size_t(point.at(r, c))] = r * point.view().stride + c;
    const GroundLight ground = given.value_or(find_ground_light(scan, range, point, nonground.view()));
    ref::drop_smoke(params, scan, ground, pixel.data(), range, point, nonground.view(), considered.view(), rough.view(),
                    smoke.view());
    CHECK(test::tail_is_clear(smoke));
    Result result{0, 0};
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        result.smoke += smoke.view().test(r, c), result.kept += nonground.view().test(r, c);
        CHECK_FALSE((smoke.view().test(r, c) && nonground.view().test(r, c)));
      }
    return result;
  }
  OwnedPlane<float> range;
  OwnedPlane<int32_t> point;
  OwnedBits nonground, considered, rough, smoke;
  std::vector<float> intensity;
  std::optional<GroundLight> given;  // instead of that of the few road points here
  std::mt19937 random{7};
};
using Result = Scene::Result;

TEST_CASE("drop_smoke: dark returns whose ranges jump are smoke, also across words and at the edges of the image") {
  CHECK(Scene({{0, 50, 8, 25, 8.0f, 2.5f, 0.02f}}).run() == Result{200, 0});
}

TEST_CASE("drop_smoke: the scale of the intensities does not matter") {
  for (const float factor : {1.0f / 16, 255.0f}) {
    Scene scene({{0, 50, 8, 25, 8.0f, 2.5f, 0.02f}});
    scene.scale_intensity(factor);
    CHECK(scene.run() == Result{200, 0});
  }
}

TEST_CASE("drop_smoke: neither does the range, if the intensities are signals") {
  for (const float power : {0.0f, -2.0f, -3.0f})
    for (const float light : {0.02f, 0.3f}) {
      CAPTURE(power);
      CAPTURE(light);
      Scene scene({{0, 50, 8, 25, 25.0f, 5.8f, light}});
      for (int32_t r = 0; r < Scene::kRows; ++r)
        for (int32_t c = 0; c < Scene::kCols; ++c) {
          if (r == Scene::kRows - 1) scene.range.at(r, c) = 4.0f + 0.25f * float(c);  // the road
          if (scene.point.at(r, c) == kNoPoint) continue;
          const float fall = r == Scene::kRows - 1 ? power : std::max(power, -2.0f);
          scene.intensity[std::size_t(scene.point.at(r, c))] *= std::pow(scene.range.at(r, c) / 10.0f, fall);
        }
      if (power < 0.0f) scene.given = {.light = 10.0f * 10.0f, .is_signal = true};
      CHECK(scene.run() == (light < 0.1f ? Result{200, 0} : Result{0, 200}));
    }
}

TEST_CASE("drop_smoke: a dark surface and a bright heap are obstacles") {
  CHECK(Scene({{0, 10, 8, 20, 8.0f, 0.1f, 0.02f}}).run() == Result{0, 160});
  CHECK(Scene({{0, 10, 8, 20, 8.0f, 2.5f, 0.1f}}).run() == Result{0, 160});  // not below smoke.dark_share of 1
  CHECK(Scene({{0, 10, 8, 20, 8.0f, 2.5f, 0.099f}}).run() == Result{160, 0});
}

TEST_CASE("drop_smoke: a few dark and rough pixels on a surface belong to it") {
  const Box car = {0, 10, 8, 20, 8.0f, 0.1f, 0.5f}, dark = {3, 18, 1, 4, 8.5f, 2.0f, 0.02f};
  CHECK(Scene({car, dark}).run() == Result{0, 160});
}

TEST_CASE("drop_smoke: a car in smoke stays, the smoke around it goes") {
  const Box smoke = {0, 10, 8, 50, 8.0f, 2.5f, 0.02f}, car = {3, 30, 4, 10, 9.0f, 0.1f, 0.5f};
  Scene scene({smoke, car});
  const Result result = scene.run();
  CHECK(result.kept < 40 + 12);  // a smoke pixel at the car's range may belong to either
  for (int32_t r = 3; r < 7; ++r)
    for (int32_t c = 30; c < 40; ++c) CHECK(scene.nonground.view().test(r, c));
}

TEST_CASE("drop_smoke: smoke that has neighbours at its range by chance is still smoke") {
  // Nine pixels of about one range: 8 of the 64 neighbours of the middle one at most.
  DropSmokeParams strict = test::paper_params().drop_smoke;
  strict.near_share = 0.2f;
  CHECK(Scene({kSmoke, {2, 18, 3, 3, 9.0f, 0.05f, 0.02f}}).run(strict) == Result{160, 0});
  // A wide patch is a surface: nothing in its middle is rough.
  Scene patch({{0, 10, 8, 50, 8.0f, 2.5f, 0.02f}, {0, 20, 8, 30, 9.0f, 0.05f, 0.02f}});
  patch.run(strict);
  for (int32_t r = 0; r < 8; ++r) CHECK(patch.nonground.view().test(r, 35));
}

TEST_CASE("drop_smoke: a dark pixel at the rim of a cloud goes with it, a bright one stays") {
  for (const float light : {0.02f, 0.5f}) {
    Scene scene({kSmoke});
    scene.add(4, 35, 11.0f, light);  // six columns beside the cloud
    CHECK(scene.run() == (light < 0.1f ? Result{161, 0} : Result{160, 1}));
  }
}

TEST_CASE("drop_smoke: what lies far behind or before a pixel is not its neighbour") {
  DropSmokeParams narrow = test::paper_params().drop_smoke;
  narrow.near_share = 0.3f, narrow.reach_m = 3.0f;
  const Box wall = {0, 0, 8, 75, 90.0f, 0.1f, 0.5f}, far_car = {4, 30, 1, 3, 80.0f, 0.1f, 0.02f};
  CHECK(Scene({wall, far_car}).run(narrow) == Result{0, 600});
  const Box cloud = {0, 10, 8, 50, 20.0f, 2.5f, 0.02f}, near_car = {4, 30, 1, 3, 12.0f, 0.01f, 0.02f};
  CHECK(Scene({cloud, near_car}).run(narrow) == Result{397, 3});
}

TEST_CASE("drop_smoke: a lonely dark return is smoke, a few dark returns at one range are not") {
  Scene speck;
  speck.add(4, 30, 8.0f, 0.02f);
  CHECK(speck.run() == Result{1, 0});
  Scene bright;
  bright.add(4, 30, 8.0f, 0.5f);
  CHECK(bright.run() == Result{0, 1});
  Scene pair;
  pair.add(4, 30, 8.0f, 0.02f);
  pair.add(4, 31, 8.1f, 0.02f);
  CHECK(pair.run() == Result{0, 2});
  for (const int32_t far : {36, 37}) {  // within and outside of the window
    Scene apart;
    apart.add(4, 30, 8.0f, 0.02f);
    apart.add(4, far, 8.1f, 0.02f);
    CHECK(apart.run() == (far == 36 ? Result{0, 2} : Result{2, 0}));
  }
}

TEST_CASE("drop_smoke: without intensities or without ground nothing is smoke") {
  Scene dull({kSmoke});
  dull.add(4, 60, 8.0f, 1.0f);
  dull.point.at(4, 60) = kNoPoint;  // a filled gap
  dull.scale_intensity(0.0f);
  CHECK(dull.run() == Result{0, 161});
  Scene floating({kSmoke});
  for (int32_t c = 0; c < Scene::kCols; ++c) floating.nonground.view().set(Scene::kRows - 1, c);
  CHECK(floating.run() == Result{0, 160 + Scene::kCols});
  Scene off({kSmoke});
  DropSmokeParams params = test::paper_params().drop_smoke;
  params.dark_share = 0.0f;
  CHECK(off.run(params) == Result{0, 160});
}

TEST_CASE("drop_smoke: low smoke, which is ground by its height, is smoke") {
  Scene scene({kSmoke});
  for (int32_t r = 6; r < 8; ++r) scene.nonground.view().clear_row(r);
  CHECK(scene.run() == Result{160, 0});
  // Two returns at one range are smoke among low smoke, and an obstacle without it.
  for (const bool low_smoke : {true, false}) {
    Scene two;
    if (low_smoke) two.add_box({4, 14, 4, 13, 8.0f, 2.5f, 0.02f});
    for (int32_t r = 4; r < 8; ++r) two.nonground.view().clear_row(r);
    two.add_box({5, 20, 1, 2, 9.0f, 0.01f, 0.02f});
    CHECK(two.run().kept == (low_smoke ? 0 : 2));
  }
  // Bright ground is no neighbour.
  Scene road({{0, 10, 8, 20, 8.0f, 0.05f, 1.0f}});
  for (int32_t r = 0; r < 8; ++r) road.nonground.view().clear_row(r);
  road.add(4, 20, 8.0f, 0.02f);
  CHECK(road.run() == Result{1, 0});
}

TEST_CASE("drop_smoke: a filled gap goes with the smoke around it, and stays on a surface") {
  Scene scene({kSmoke});
  scene.add_box({0, 40, 8, 20, 8.0f, 0.1f, 0.02f});
  scene.point.at(4, 20) = scene.point.at(4, 50) = kNoPoint;
  CHECK(scene.run() == Result{160, 160});
  CHECK(scene.smoke.view().test(4, 20));
}

TEST_CASE("drop_smoke: the ground's intensity is a median over the whole image") {
  Scene scene;
  ScanTable scan;
  scan.intensity = scene.intensity.data();
  std::vector<float> origin(scene.intensity.size());
  scan.x_m = scan.y_m = scan.z_m = origin.data();
  for (std::size_t i = 0; i < 30; ++i) scene.intensity[i] = 100.0f;  // paint
  CHECK(find_ground_light(scan, scene.range, scene.point, scene.nonground.view()).light == 1.0f);
  for (std::size_t i = 30; i < 45; ++i) scene.intensity[i] = 100.0f;
  CHECK(find_ground_light(scan, scene.range, scene.point, scene.nonground.view()).light == 100.0f);
}

TEST_CASE("drop_smoke: the ground's intensity is that of the whole image, not of its first rows") {
  constexpr int32_t kRows = 64, kCols = 1000;
  OwnedPlane<float> range(kRows, kCols);
  OwnedPlane<int32_t> point(kRows, kCols);
  OwnedBits nonground(kRows, kCols);
  nonground.clear();
  range.fill(10.0f);
  std::vector<float> intensity(std::size_t(kRows) * kCols), zero(intensity.size());
  for (int32_t r = 0; r < kRows; ++r)
    for (int32_t c = 0; c < kCols; ++c) {
      point.at(r, c) = r * kCols + c;
      intensity[std::size_t(r * kCols + c)] = r < 12 ? 1.0f : r < 50 ? 10.0f : 90.0f;
    }
  ScanTable scan;
  scan.intensity = intensity.data();
  scan.x_m = scan.y_m = scan.z_m = zero.data();
  CHECK(find_ground_light(scan, range, point, nonground.view()).light == 10.0f);
}

TEST_CASE("drop_smoke: intensities that fall with the range are no reflectivities") {
  // A road of 16 rows from near_m to far_m, whose reflectivity changes with a power of the range, and scatters.
  constexpr int32_t kRows = 16;
  const auto find = [](double near_m, double far_m, double power, double sigma = 0.0, int32_t cols = 400) {
    OwnedPlane<float> range(kRows, cols);
    OwnedPlane<int32_t> point(kRows, cols);
    OwnedBits nonground(kRows, cols);
    nonground.clear();
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    std::vector<float> x_m, zero(std::size_t(kRows) * std::size_t(cols)), intensity;
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        const double range_m = far_m * std::pow(near_m / far_m, r / double(kRows - 1));
        range.at(r, c) = float(range_m), point.at(r, c) = int32_t(x_m.size());
        x_m.push_back(float(range_m));
        intensity.push_back(float(std::pow(range_m, power) * std::exp(sigma * normal(random))));
      }
    ScanTable scan;
    scan.x_m = x_m.data(), scan.y_m = scan.z_m = zero.data(), scan.intensity = intensity.data();
    return find_ground_light(scan, range, point, nonground.view());
  };
  for (const double sigma : {0.0, 0.6, 1.0}) {
    CAPTURE(sigma);
    for (const double power : {1.0, 0.3, 0.0, -0.3, -0.8}) CHECK_FALSE(find(4, 40, power, sigma).is_signal);
    for (const double power : {-2.2, -3.0}) CHECK(find(4, 40, power, sigma).is_signal);
  }
  CHECK_FALSE(find(4, 40, -1.3).is_signal);
  CHECK(find(4, 40, -1.7).is_signal);
  CHECK(double(find(4, 40, 0).light) == doctest::Approx(1.0));
  CHECK(double(find(4, 40, -2).light) == doctest::Approx(1.0));  // times the square of the range
  CHECK_FALSE(find(4, 6, -3).is_signal);                         // too little of the road to tell
  CHECK_FALSE(find(4, 40, -3, 0, 2).is_signal);                  // too few points
}

TEST_CASE("mark_smoke: points of smoke get their reason, losers of the pixel keep theirs") {
  OwnedPlane<int32_t> pixel_point(2, 70);
  pixel_point.fill(kNoPoint);
  OwnedBits smoke(2, 70);
  smoke.clear();
  smoke.view().set(1, 66);
  smoke.view().set(0, 3);  // a filled gap
  pixel_point.at(1, 66) = 1;
  pixel_point.at(1, 67) = 4;
  const int32_t at = pixel_point.view().stride + 66;
  int32_t pixel[] = {-1, at, at, at, at + 1}, label[] = {-1, 0, 0, -1, 7};
  uint8_t lost[] = {0, 0, 1, 1, 0};
  uint8_t reason[] = {uint8_t(Reason::kZeroRange), 0, 0, uint8_t(Reason::kSecondReturn), 0};
  PointTable points;
  points.count = points.capacity = 5;
  points.pixel = pixel, points.label = label, points.lost = lost, points.reason = reason;
  mark_smoke(smoke.view(), pixel_point, points);
  const Reason wanted[] = {Reason::kZeroRange, Reason::kSmoke, Reason::kSmoke, Reason::kSecondReturn,
                           Reason::kLabelled};
  const int32_t labels[] = {-1, -1, -1, -1, 7};
  for (int32_t i = 0; i < 5; ++i) {
    CHECK(Reason(reason[i]) == wanted[i]);
    CHECK(label[i] == labels[i]);
  }
}

TEST_CASE("mark_smoke: finds the losers among any number of points") {
  constexpr int32_t kCount = 64 * 3 + 5;
  OwnedPlane<int32_t> pixel_point(2, 70);
  pixel_point.fill(kNoPoint);
  OwnedBits smoke(2, 70);
  smoke.clear();
  smoke.view().set(1, 66);
  const int32_t at = pixel_point.view().stride + 66;
  std::mt19937 random(3);
  for (const uint32_t most : {2u, 30u}) {  // every other point, or a few, lost their pixels
    std::vector<int32_t> pixel, label(kCount, 0);
    std::vector<uint8_t> lost, reason(kCount, uint8_t(Reason::kLabelled));
    for (int32_t i = 0; i < kCount; ++i) {
      lost.push_back(random() % most == 0);
      pixel.push_back(random() % 4 == 0 ? at + 1 : at);
    }
    lost[10] = lost[11] = 0;  // the winners
    pixel[10] = at, pixel[11] = at + 1;
    pixel_point.at(1, 66) = 10, pixel_point.at(1, 67) = 11;
    PointTable points;
    points.count = points.capacity = kCount;
    points.pixel = pixel.data(), points.label = label.data(), points.lost = lost.data(), points.reason = reason.data();
    mark_smoke(smoke.view(), pixel_point, points);
    for (std::size_t i = 0; i < std::size_t(kCount); ++i) {
      const bool is_smoke = (lost[i] || i == 10) && pixel[i] == at;
      CHECK(Reason(reason[i]) == (is_smoke ? Reason::kSmoke : Reason::kLabelled));
      CHECK(label[i] == (is_smoke ? kLabelNone : 0));
    }
  }
}

}  // namespace
}  // namespace overtake
