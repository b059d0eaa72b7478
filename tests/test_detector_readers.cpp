// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Readers of the C API: how many there are, and how much of the paths each computes.
#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <vector>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;

}  // namespace

TEST_CASE("detector: the def limits the number of readers, and destroying one makes room") {
  Small small;
  small.def.reader_capacity = 2;
  small.create();
  ovt_reader *a = nullptr, *b = nullptr, *c = nullptr;
  CHECK(ovt_create_reader(small.detector, &a) == OVT_OK);
  CHECK(ovt_create_reader(small.detector, &b) == OVT_OK);
  CHECK(ovt_create_reader(small.detector, &c) == OVT_TOO_MANY);
  CHECK(c == nullptr);
  ovt_destroy_reader(a);
  CHECK(ovt_create_reader(small.detector, &c) == OVT_OK);
  ovt_destroy_reader(b);
  ovt_destroy_reader(c);
  ovt_destroy_reader(nullptr);
}

TEST_CASE("detector: a reader computes as much of the paths as it asks for") {
  const Posts posts(50);
  const ovt_points points = posts.points(0);
  Small small;
  small.create();
  ovt_reader *reader = nullptr, *other = nullptr;
  REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
  REQUIRE(ovt_create_reader(small.detector, &other) == OVT_OK);
  CHECK(ovt_set_path_horizon(nullptr, 1.0) == OVT_BAD_ARGUMENT);
  CHECK(ovt_set_path_horizon(reader, 1.24) == OVT_OK);  // before the first frame
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  REQUIRE(ovt_next_frame(other, nullptr) == OVT_OK);
  ovt_tracks whole, part;
  REQUIRE(ovt_read_tracks(other, OVT_AT_FRAME_STAMP, &whole) == OVT_OK);
  CHECK(whole.path_points == 30);  // the default: 3 s, 0.1 s apart
  REQUIRE(whole.count > 2);
  const auto compare = [&](int32_t point_count) {
    REQUIRE(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &part) == OVT_OK);
    CHECK(part.path_points == point_count);
    CHECK(part.path_step_s == 0.1);
    REQUIRE(part.count == whole.count);
    bool same = true;
    for (int32_t i = 0; i < part.count; ++i) {
      same &= part.x_m[i] == whole.x_m[i] && part.id[i] == whole.id[i];
      for (int32_t k = 0; k < point_count; ++k) {
        const auto a = std::size_t(i * point_count + k), b = std::size_t(i * 30 + k);
        same &= part.path_x_m[a] == whole.path_x_m[b] && part.path_var_y[a] == whole.path_var_y[b];
      }
    }
    CHECK(same);
  };
  compare(12);
  for (const double bad : {-1e-9, -1.0, 3.0000001, 1e300, double(INFINITY), double(NAN)})
    CHECK(ovt_set_path_horizon(reader, bad) == OVT_BAD_ARGUMENT);
  compare(12);  // as before
  for (const auto& [horizon_s, point_count] :
       std::map<double, int32_t>{{0.0, 0}, {0.04, 0}, {0.06, 1}, {2.5, 25}, {3.0, 30}}) {
    CAPTURE(horizon_s);
    CHECK(ovt_set_path_horizon(reader, horizon_s) == OVT_OK);
    compare(point_count);
  }
  ovt_destroy_reader(reader);
  ovt_destroy_reader(other);
}

TEST_CASE("detector: the reader of on_frame keeps its path horizon for the next frames") {
  const Posts posts(50);
  ovt_points points = posts.points(0);
  static std::vector<int32_t> path_points;
  path_points.clear();
  Small small;
  small.def.on_frame = [](ovt_reader* reader, void*) {
    ovt_tracks tracks;
    if (ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks) == OVT_OK) path_points.push_back(tracks.path_points);
    if (path_points.size() == 2) ovt_set_path_horizon(reader, 0.5);
  };
  small.create();
  for (int k = 0; k < 4; ++k) {
    points.stamp_ns = 100 * kMs * (k + 1);
    REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  }
  CHECK(path_points == std::vector<int32_t>{30, 30, 5, 5});
}
