// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// End of stage 7: from pixels back to points.
#include "kernels/label_points.h"

#include <doctest/doctest.h>

#include <vector>

#include "core/table.h"
#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::OwnedPlane;

// One row of four pixels: cluster 7; repaired over ground; ground; cluster 3 with its return where the repair is.
struct Labels {
  Labels() {
    REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, points, 16); }));
    images.range_filled_m = range;
    images.range_repaired_m = repaired;
    images.pixel_point = pixel_point;
    images.labels = labels;
  }
  // Adds a point of this range to this pixel; returns its row.
  int32_t add(int32_t pixel, float range_m, Reason reason = Reason::kLabelled) {
    const int32_t i = points.count++;
    points.pixel[i] = pixel;
    points.lost[i] = 0;
    points.range_m[i] = range_m;
    points.reason[i] = uint8_t(reason);
    points.label[i] = pixel < 0 ? kLabelNone : kLabelGround;  // by scatter_points
    return i;
  }
  // Adds a point that lost the pixel.
  int32_t add_loser(int32_t pixel, float range_m) {
    const int32_t i = add(pixel, range_m);
    points.lost[i] = 1;
    return i;
  }
  void run() { ref::label_points(test::paper_params().label_points, images, points); }
  Reason reason(int32_t i) const { return Reason(points.reason[i]); }

  OwnedPlane<float> range{{20.0f, 30.0f, 25.0f, 20.25f}}, repaired{{20.0f, 20.0f, 0.0f, 20.0f}};
  OwnedPlane<int32_t> pixel_point{{0, 1, 2, 3}}, labels{{7, 7, 0, 3}};
  Arena arena;
  RangeImages images;
  PointTable points;
};

TEST_CASE("label_points: the winner takes its pixel's label") {
  Labels l;
  const int32_t cluster = l.add(0, 20.0f), ground = l.add(2, 25.0f);
  l.run();
  CHECK(l.points.label[cluster] == 7);
  CHECK(l.points.label[ground] == kLabelGround);
  CHECK(l.reason(cluster) == Reason::kLabelled);
  CHECK(l.reason(ground) == Reason::kLabelled);
}

TEST_CASE("label_points: a repaired pixel's own return takes the label only within 0.5 m of the repair") {
  Labels l;
  const int32_t behind = l.add(1, 30.0f), here = l.add(3, 20.25f);
  l.run();
  CHECK(l.points.label[behind] == kLabelGround);  // it is ground 10 m behind the car
  CHECK(l.points.label[here] == 3);

  l.range.at(0, 3) = 20.5f;  // 0.5 m is not less than 0.5 m
  l.points.range_m[here] = 20.5f;
  l.run();
  CHECK(l.points.label[here] == kLabelGround);
}

TEST_CASE("label_points: a loser within 0.5 m of the winner takes the pixel's label") {
  Labels l;
  const int32_t nearer = l.add_loser(0, 19.5f), farther = l.add_loser(0, 20.5f), over_repair = l.add_loser(1, 30.25f);
  l.run();
  CHECK(l.points.label[nearer] == 7);
  CHECK(l.points.label[farther] == 7);
  CHECK(l.points.label[over_repair] == kLabelGround);
}

TEST_CASE("label_points: a loser more than 0.5 m nearer is dust, one farther is a second return") {
  Labels l;
  const int32_t dust = l.add_loser(0, 19.25f), second = l.add_loser(0, 20.75f);
  l.run();
  CHECK(l.points.label[dust] == kLabelNone);
  CHECK(l.reason(dust) == Reason::kDust);
  CHECK(l.points.label[second] == kLabelNone);
  CHECK(l.reason(second) == Reason::kSecondReturn);
}

TEST_CASE("label_points: a point without pixel has no label and keeps its reason") {
  Labels l;
  const int32_t zero = l.add(-1, 0.0f, Reason::kZeroRange), dropped = l.add(-1, 20.0f, Reason::kLayerDropped);
  l.run();
  CHECK(l.points.label[zero] == kLabelNone);
  CHECK(l.reason(zero) == Reason::kZeroRange);
  CHECK(l.points.label[dropped] == kLabelNone);
  CHECK(l.reason(dropped) == Reason::kLayerDropped);
}

}  // namespace
}  // namespace overtake
