// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The memory plan of a segmentation: which columns share memory and which never may.
#include "pipeline/method/segment_memory.h"

#include <doctest/doctest.h>

#include "pipeline/method/method.h"
#include "pipeline/method/steps.h"

namespace {

using namespace overtake;
using enum Column;

struct Rig {
  SensorModel sensors[2] = {make_sensor_model(32, 857, 1.0471975, -1.0471975, false, 0.5, 300.0),
                            make_sensor_model(64, 300, 3.0, -3.2, true, 0.5, 300.0)};
  int32_t capacity[2] = {32 * 857, 70 * 300};
  FrameSizes sizes;

  explicit Rig(bool keep_images, const Method& method = kPaper) {
    sizes.sensors = sensors;
    sizes.point_capacity = capacity;
    sizes.sensor_count = 2;
    sizes.keep_images = keep_images;
    sizes.method = &method;
  }
};

bool overlap(std::size_t a, std::size_t a_size, std::size_t b, std::size_t b_size) {
  return a < b + b_size && b < a + a_size;
}

TEST_CASE("segment_memory: columns that are live in the same step share no byte") {
  for (const bool keep_images : {false, true}) {
    const SegmentPlan plan = plan_segment(Rig(keep_images).sizes);
    int32_t sharing = 0;
    for (int32_t a = 0; a < kColumnCount; ++a) {
      if (!has(plan.shared, Column(a))) continue;
      CHECK(plan.bytes_of[a] > 0);
      CHECK(plan.offset[a] % kCacheLine == 0);
      CHECK(plan.offset[a] + plan.bytes_of[a] <= plan.bytes);
      for (int32_t b = 0; b < a; ++b) {
        if (!has(plan.shared, Column(b))) continue;
        const bool together = plan.first[a] <= plan.last[b] && plan.first[b] <= plan.last[a];
        const bool same_place = overlap(plan.offset[a], plan.bytes_of[a], plan.offset[b], plan.bytes_of[b]);
        INFO(std::string(column_name(Column(a))) << " and " << std::string(column_name(Column(b))));
        CHECK(!(together && same_place));
        sharing += same_place;
      }
    }
    CHECK(sharing > 0);
  }
}

TEST_CASE("segment_memory: the frame keeps columns that readers and frame rules read, and all images on request") {
  const SegmentPlan small = plan_segment(Rig(false).sizes), whole = plan_segment(Rig(true).sizes);
  CHECK(small.kept == columns(point_label, point_reason, pixel_point));
  CHECK(whole.kept == ((columns_of(Extent::pixels) | columns_of(Extent::points)) & find_columns(kPaper)));
  CHECK((small.kept | small.shared) == find_columns(kPaper));
  CHECK((whole.kept | whole.shared) == find_columns(kPaper));
  CHECK((small.kept & small.shared) == 0);
}

// A plan by hand uses five planes for nine images, and shares nothing else.
TEST_CASE("segment_memory: the paper's scratch is smaller than a plan by hand") {
  const Rig rig(false);
  const SegmentPlan plan = plan_segment(rig.sizes);
  const std::size_t pixels = 32 * 857, points = 32 * 857, plane = plane_elements(32, 857) * 4;
  const std::size_t by_hand =
      5 * plane + 4 * 32 * 14 * 8 + 3 * (pixels + 1) * 4 + 2 * std::size_t(kLayerIds) * 4 + points * (4 * 4 + 1);
  CHECK(plan.bytes <= by_hand);
}

void run_nothing(const KernelTable&, Segment&) noexcept {}

TEST_CASE("segment_memory: a column may reuse memory only after the last read of the earlier column") {
  //             step  0   1   2   3
  //   range_m         w---r
  //   angle_rad           w---r           read in the step in which angle_smooth_rad begins: not the same place
  //   angle_smooth_rad        w---r
  //   queue                       s       scratch of the last step
  constexpr Step kSteps[] = {
      {"0", OVT_STAGE_PROJECT, columns(), columns(range_m), columns(), "", &run_nothing},
      {"1", OVT_STAGE_ANGLE, columns(range_m), columns(angle_rad), columns(), "", &run_nothing},
      {"2", OVT_STAGE_SMOOTH, columns(angle_rad), columns(angle_smooth_rad), columns(), "", &run_nothing},
      {"3", OVT_STAGE_GROUND, columns(angle_smooth_rad), columns(), columns(queue), "", &run_nothing}};
  const Method method = {"lives", kSteps, {}, nullptr, "", nullptr};
  const SegmentPlan plan = plan_segment(Rig(false, method).sizes);
  CHECK(plan.shared == columns(range_m, angle_rad, angle_smooth_rad, queue));
  const auto offset = [&](Column c) { return plan.offset[int32_t(c)]; };
  CHECK(offset(range_m) != offset(angle_rad));
  CHECK(offset(angle_smooth_rad) == offset(range_m));
  CHECK(offset(queue) == offset(angle_rad));
  CHECK(plan.bytes == 2 * plan.bytes_of[int32_t(range_m)]);
  CHECK(plan.kept == 0);
}

TEST_CASE("segment_memory: without a sensor there is no memory") {
  FrameSizes sizes;
  CHECK(plan_segment(sizes).bytes == 0);
}

}  // namespace
