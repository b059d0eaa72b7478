// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Selects the winner of each pixel.
#include "kernels/scatter_points.h"

#include <doctest/doctest.h>
#include <sys/mman.h>

#include <algorithm>
#include <random>

#include "kernels/scatter_more.h"
#include "pipeline/method/steps.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::kDegree;
using test::SegmentChain;
using test::TestPoint;

// Two rows, eight columns of 10 deg.
SegmentChain scattered(const std::vector<TestPoint>& cloud) {
  SegmentChain chain(make_sensor_model(2, 8, 40 * kDegree, -40 * kDegree, false, 0.1, 100), 16);
  chain.run(cloud);
  return chain;
}

int32_t winner_of(const std::vector<TestPoint>& cloud) {
  const SegmentChain chain = scattered(cloud);
  REQUIRE(chain.views.points.pixel[0] >= 0);
  return chain.views.images.pixel_point.data[chain.views.points.pixel[0]];
}

TEST_CASE("scatter_points: the highest intensity wins the pixel") {
  CHECK(winner_of({{10, 1, 0, 5}, {20, 2, 0, 9}, {5, 0.5f, 0, 7}}) == 1);
}

TEST_CASE("scatter_points: at equal intensity the nearer point wins, then the first") {
  CHECK(winner_of({{10, 1, 0, 5}, {20, 2, 0, 5}, {5, 0.5f, 0, 5}}) == 2);
  CHECK(winner_of({{10, 1, 0, 5}, {10, 1, 0, 5}, {10, 1, 0, 5}}) == 0);
}

TEST_CASE("scatter_points: writes the winner's range and elevation; every other pixel is empty") {
  const SegmentChain chain = scattered({{10, 1, 0.5f, 5, 3}, {20, 2, 1, 9, 3}});
  const int32_t pixel = chain.views.points.pixel[0];
  CHECK(chain.views.points.pixel[1] == pixel);
  for (int32_t r = 0; r < 2; ++r)
    for (int32_t c = 0; c < 8; ++c) {
      const bool own = r * chain.views.images.range_m.stride + c == pixel;
      CHECK(chain.views.images.range_m.at(r, c) == (own ? chain.views.points.range_m[1] : kNoReturn));
      CHECK(chain.views.images.elevation_rad.at(r, c) == (own ? chain.views.points.elevation_rad[1] : 0.0f));
      CHECK(chain.views.images.pixel_point.at(r, c) == (own ? 1 : kNoPoint));
    }
}

TEST_CASE("scatter_points: every point except the winner is marked as lost, whoever won in between") {
  // On one pixel: the second is brighter than the first, the third as bright and nearer, the fourth darker. One
  // elsewhere.
  const std::vector<TestPoint> cloud = {{10, 1, 0, 5}, {20, 2, 0, 9}, {10, 1, 0, 9}, {5, 0.5f, 0, 7}, {10, -4, 0, 1}};
  const SegmentChain chain = scattered(cloud);
  const int32_t lost[5] = {1, 1, 0, 1, 0};
  for (int32_t i = 0; i < 5; ++i) CHECK(int32_t(chain.views.points.lost[i]) == lost[i]);
  CHECK(chain.views.points.pixel[4] != chain.views.points.pixel[2]);
}

TEST_CASE("scatter_points: scatter_more reads no row of a layer whose points have no column") {
  // The rows of 4 layers at the end of a page; nothing behind it may be read.
  constexpr std::size_t kPage = 4096, kBehind = std::size_t(kLayerIds) * sizeof(int32_t);
  void* const memory = mmap(nullptr, kPage + kBehind, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  REQUIRE(memory != MAP_FAILED);
  REQUIRE(mprotect(memory, kPage, PROT_READ | PROT_WRITE) == 0);
  auto* const row_of_layer = reinterpret_cast<int32_t*>(static_cast<char*>(memory) + kPage) - 4;
  SegmentChain chain(make_sensor_model(2, 8, 40 * kDegree, -40 * kDegree, false, 0.1, 100), 64);
  const std::vector<TestPoint> cloud(64, {10, 0, 0, 1, 0});
  chain.load(fields_of(cloud), 64);
  chain.run_step(step::project_points, *chain.kernels);
  std::fill_n(chain.part.scan.layer, 64, 60000);
  std::fill_n(chain.views.points.column, 64, -1);
  clear_pixels(chain.views.images);
  scatter_more(chain.part.scan, row_of_layer, 0, 64, chain.views.points, chain.views.images);
  for (int32_t i = 0; i < 64; ++i) CHECK(chain.views.points.pixel[i] == -1);
  munmap(memory, kPage + kBehind);
}

TEST_CASE("scatter_points: scatter_more over any parts of the points writes the same, with many ties on few pixels") {
  std::mt19937 random(4);
  for (int32_t round = 0; round < 50; ++round) {
    std::vector<TestPoint> cloud;
    const int32_t count = 1 + int32_t(random() % 200);
    for (int32_t i = 0; i < count; ++i) {
      const float x_m = 10.0f + float(random() % 2), y_m = float(random() % 3) * (random() % 8 ? 1 : 100);
      const auto layer = int32_t(random() % 2);
      cloud.push_back({x_m, y_m, float(layer), float(random() % 3), float(layer)});
    }
    SegmentChain whole(make_sensor_model(2, 8, 40 * kDegree, -40 * kDegree, false, 0.1, 100), count);
    SegmentChain parts(make_sensor_model(2, 8, 40 * kDegree, -40 * kDegree, false, 0.1, 100), count);
    for (SegmentChain* chain : {&whole, &parts}) {
      chain->load(fields_of(cloud), count);
      chain->run_step(step::project_points, *chain->kernels);
      chain->run_step(step::rank_layers, *chain->kernels);
    }
    whole.run_step(step::scatter_points, *whole.kernels);
    clear_pixels(parts.views.images);
    for (int32_t begin = 0; begin < count;) {
      const int32_t end = std::min(count, begin + 1 + int32_t(random() % 40));
      scatter_more(parts.part.scan, parts.views.row_of_layer, begin, end, parts.views.points, parts.views.images);
      begin = end;
    }
    for (int32_t i = 0; i < count; ++i) {
      CHECK(parts.views.points.pixel[i] == whole.views.points.pixel[i]);
      CHECK(parts.views.points.lost[i] == whole.views.points.lost[i]);
      CHECK(parts.views.points.label[i] == whole.views.points.label[i]);
    }
    for (int32_t r = 0; r < 2; ++r)
      for (int32_t c = 0; c < 8; ++c) {
        CHECK(parts.views.images.pixel_point.at(r, c) == whole.views.images.pixel_point.at(r, c));
        CHECK(parts.views.images.range_m.at(r, c) == whole.views.images.range_m.at(r, c));
        CHECK(parts.views.images.elevation_rad.at(r, c) == whole.views.images.elevation_rad.at(r, c));
      }
  }
}

TEST_CASE("scatter_points: a point of a dropped layer gets its reason") {
  const SegmentChain chain = scattered(
      {{10, 0, 2, 1, 1}, {10, 1, 2, 1, 1}, {10, 0, 1, 1, 2}, {10, 1, 1, 1, 2}, {10, 0, 0, 1, 3}, {-1, 0, 0, 1, 1}});
  CHECK(chain.part.row_count == 2);
  CHECK(chain.reason(4) == Reason::kLayerDropped);
  CHECK(chain.views.points.pixel[4] == -1);
  CHECK(chain.views.points.label[4] == kLabelNone);
  CHECK(chain.reason(5) == Reason::kOutsideAzimuth);  // keeps the reason it came with
  CHECK(chain.views.points.pixel[5] == -1);
  CHECK(chain.reason(0) == Reason::kLabelled);
}

}  // namespace
}  // namespace overtake
