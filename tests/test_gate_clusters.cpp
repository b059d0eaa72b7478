// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "kernels/gate_clusters.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "core/arena.h"
#include "core/table.h"
#include "tests/support/paper_params.h"

using namespace overtake;

namespace {

struct Merged {
  Merged() : block(1 << 16) {
    Carver carver(reinterpret_cast<void*>((reinterpret_cast<uintptr_t>(block.data()) + 63) / 64 * 64));
    carve_table(carver, table, 64);
  }
  void add(int32_t points, float x0, float x1, float y0, float y1, float z0, float z1) {
    const int32_t i = table.count++;
    table.point_count[i] = points;
    table.min_x_m[i] = x0, table.max_x_m[i] = x1;
    table.min_y_m[i] = y0, table.max_y_m[i] = y1;
    table.min_z_m[i] = z0, table.max_z_m[i] = z1;
  }
  std::vector<int32_t> gate(const GateClustersParams& params = test::paper_frame_params().gate_clusters) {
    std::vector<int32_t> kept(size_t(table.count), -7);
    kept.resize(size_t(ref::gate_clusters(params, table, kept.data())));
    return kept;
  }
  std::vector<char> block;
  FrameClusterTable table;
};

using Rows = std::vector<int32_t>;

}  // namespace

TEST_CASE("gate_clusters drops what is longer than 1.1 car lengths, to the last bit") {
  const float limit = test::paper_frame_params().gate_clusters.max_extent_m, over = std::nextafter(limit, 10.0f),
              under = std::nextafter(limit, 0.0f);
  CHECK(limit == doctest::Approx(5.4131));
  Merged m;
  m.add(50, 0, limit, 0, 1, 0, 1);
  m.add(50, 0, over, 0, 1, 0, 1);
  m.add(50, 0, under, 0, 1, 0, 1);
  m.add(50, 0, 1, 0, limit, 0, 1);
  m.add(50, 0, 1, 0, over, 0, 1);
  m.add(50, 0, 1, 0, 1, 0, limit);
  m.add(50, 0, 1, 0, 1, 0, over);
  m.add(50, -limit, 0, -limit, 0, -limit, 0);  // all three at the limit
  CHECK(m.gate() == Rows{0, 2, 3, 5, 7});
}

TEST_CASE("gate_clusters: drops clusters with fewer than 3 points: they have no rectangle") {
  Merged m;
  for (int32_t points : {1, 2, 3, 4}) m.add(points, 0, 1, 0, 1, 0, 1);
  CHECK(m.gate() == Rows{2, 3});
  GateClustersParams params = test::paper_frame_params().gate_clusters;
  params.min_points = 4;
  CHECK(m.gate(params) == Rows{3});
}

TEST_CASE("gate_clusters: keeps the known car at every heading") {
  Merged m;
  for (int deg = 0; deg < 360; deg += 6) {
    const double c = std::fabs(std::cos(deg * M_PI / 180)), s = std::fabs(std::sin(deg * M_PI / 180));
    const float hx = float(0.5 * (4.921 * c + 1.886 * s)), hy = float(0.5 * (4.921 * s + 1.886 * c));
    m.add(50, 40 - hx, 40 + hx, 3 - hy, 3 + hy, 0, 1.2f);
  }
  CHECK(m.gate().size() == size_t(m.table.count));
}

TEST_CASE("gate_clusters: keeps nothing of an empty table") { CHECK(Merged().gate().empty()); }
