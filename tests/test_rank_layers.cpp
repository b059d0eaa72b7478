// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer's row is its rank by mean elevation of this scan.
#include "kernels/rank_layers.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

namespace overtake {
namespace {

struct Layer {
  int32_t id, points;
  int64_t sum;
};

struct Ranking {
  Ranking(int32_t rows, const std::vector<Layer>& layers) {
    sums.touched = touched.data();
    sums.point_count = counts.data();
    sums.elevation_sum = elevation.data();
    for (const Layer& layer : layers) {
      sums.touched[sums.touched_count++] = layer.id;
      sums.point_count[layer.id] = layer.points;
      sums.elevation_sum[layer.id] = layer.sum;
    }
    row_count = ref::rank_layers(rows, sums, row_of.data(), order.data());
  }
  std::vector<int32_t> touched = std::vector<int32_t>(kLayerIds), counts = touched, order = touched;
  std::vector<int32_t> row_of = std::vector<int32_t>(kLayerIds, -99);
  std::vector<int64_t> elevation = std::vector<int64_t>(kLayerIds);
  LayerSums sums;
  int32_t row_count = -1;
};

TEST_CASE("rank_layers: sorts unordered layers by mean elevation, top first") {
  // means: layer 40000: 30, layer 2: -5, layer 7: 10
  Ranking ranking(8, {{7, 3, 30}, {40000, 1, 30}, {2, 2, -10}});
  CHECK(ranking.row_count == 3);
  CHECK(ranking.row_of[40000] == 0);
  CHECK(ranking.row_of[7] == 1);
  CHECK(ranking.row_of[2] == 2);
  CHECK(ranking.row_of[3] == -99);  // writes only at the touched ids
}

TEST_CASE("rank_layers: layers with equal mean elevation are ordered by layer id") {
  Ranking ranking(8, {{9, 2, 20}, {4, 1, 10}, {6, 3, 30}});
  CHECK(ranking.row_of[4] == 0);
  CHECK(ranking.row_of[6] == 1);
  CHECK(ranking.row_of[9] == 2);
}

TEST_CASE("rank_layers: with more layers than rows those with the fewest points are dropped, ties: the larger id") {
  Ranking ranking(2, {{1, 5, -50}, {2, 3, 0}, {3, 3, 300}, {4, 9, 90}, {5, 3, 30}});
  CHECK(ranking.row_count == 2);
  CHECK(ranking.row_of[4] == 0);
  CHECK(ranking.row_of[1] == 1);
  for (const int32_t layer : {2, 3, 5}) CHECK(ranking.row_of[std::size_t(layer)] == -1);

  Ranking tie(2, {{8, 3, 300}, {3, 3, 30}, {5, 3, 60}});
  CHECK(tie.row_of[8] == -1);
  CHECK(tie.row_of[5] == 0);
  CHECK(tie.row_of[3] == 1);
}

TEST_CASE("rank_layers: clears the sums for the next scan, also of dropped layers") {
  Ranking ranking(1, {{1, 5, -50}, {2, 3, 7}});
  CHECK(ranking.sums.touched_count == 2);
  CHECK(std::count(ranking.counts.begin(), ranking.counts.end(), 0) == kLayerIds);
  CHECK(std::count(ranking.elevation.begin(), ranking.elevation.end(), 0) == kLayerIds);
}

TEST_CASE("rank_layers: an empty scan uses no row") {
  Ranking ranking(4, {});
  CHECK(ranking.row_count == 0);
}

TEST_CASE("rank_layers: handles all 65536 layer ids at once") {
  std::vector<Layer> layers;
  for (int32_t id = kLayerIds - 1; id >= 0; --id) layers.push_back({id, 1 + (id == 777 ? 1 : 0), id});
  Ranking ranking(1, layers);
  CHECK(ranking.row_count == 1);
  CHECK(ranking.row_of[777] == 0);
  CHECK(std::count(ranking.row_of.begin(), ranking.row_of.end(), -1) == kLayerIds - 1);
}

}  // namespace
}  // namespace overtake
