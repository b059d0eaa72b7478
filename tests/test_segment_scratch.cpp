// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Frames that keep no images: the workers' scratch holds them, with any previous content, for sensors of any shape.
#include <doctest/doctest.h>

#include <cstring>
#include <functional>
#include <random>
#include <vector>

#include "core/hash.h"
#include "core/table.h"
#include "pipeline/stages.h"
#include "tests/support/detector_bench.h"
#include "tests/support/segment_chain.h"

namespace {

using namespace overtake;
using namespace overtake::test;

// A ground plane with boxes and a few random points, some of them invalid.
std::vector<test::TestPoint> make_cloud(const SensorModel& sensor, int32_t seed) {
  std::mt19937 random{uint32_t(seed)};
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  std::vector<test::TestPoint> cloud;
  for (int32_t r = 0; r < sensor.rows; ++r)
    for (int32_t c = 0; c < sensor.cols; ++c) {
      const float azimuth = sensor.azimuth_left_rad - (float(c) + 0.5f) * sensor.pitch_rad;
      const float elevation = 0.05f - 0.008f * float(r);
      const bool box = (c / 25) % 3 == seed % 3;
      float range = elevation < -0.01f ? 0.7f / -elevation : 90.0f;
      if (box) range = std::min(range, 12.0f + float(c / 25));
      if (share(random) < 0.1f) range *= share(random);
      if (share(random) < 0.05f) continue;
      const float level = range * std::cos(elevation);
      cloud.push_back(
          {level * std::cos(azimuth), level * std::sin(azimuth), range * std::sin(elevation), share(random), float(r)});
      if (share(random) < 0.02f) cloud.back().x_m = NAN;
    }
  return cloud;
}

struct World {
  StageContext context;
  FrameSizes sizes;
  Frame frame;
  SegmentScratch scratch;
  std::vector<int32_t> capacity;
  const char *block_begin = nullptr, *block_end = nullptr;  // of the frame's memory
  std::function<void(int32_t)> before_step;                 // null: one call segments

  explicit World(bool keep_images) {
    context.sensor_count = 2;
    context.sensors[0] = make_sensor_model(32, 857, 1.0471975, -1.0471975, false, 0.5, 300.0);
    context.sensors[1] = make_sensor_model(19, 301, 3.0, -3.2, true, 0.5, 300.0);
    for (int32_t s = 0; s < 2; ++s) {
      context.sensors[s].layer_last = 65535;
      context.segment[s] = test::paper_params(context.sensors[s]);
      capacity.push_back(context.sensors[s].rows * context.sensors[s].cols);
    }
    sizes.sensors = context.sensors;
    sizes.point_capacity = capacity.data();
    sizes.sensor_count = 2;
    sizes.cluster_capacity = 1024;
    sizes.candidate_capacity = sizes.track_capacity = sizes.external_capacity = 16;
    sizes.keep_images = keep_images;
    // The one block of a frame, seen on its way.
    Allocator watched = default_allocator();
    watched.user = this;
    watched.allocate = [](size_t bytes, size_t alignment, void* user) {
      auto* block = static_cast<char*>(default_allocator().allocate(bytes, alignment, nullptr));
      static_cast<World*>(user)->block_begin = block;
      static_cast<World*>(user)->block_end = block + bytes;
      return static_cast<void*>(block);
    };
    REQUIRE(build_frame(frame, sizes, watched));
    REQUIRE(build_scratch(scratch, sizes, default_allocator()));
  }

  // The results of the scan for later stages and readers.
  uint64_t segment(const KernelTable& kernels, int32_t sensor, const std::vector<test::TestPoint>& cloud) {
    context.kernels = &kernels;
    SensorPart& part = frame.sensors[sensor];
    kernels.load_points(test::fields_of(cloud), int32_t(cloud.size()), part.scan);
    std::fill(std::begin(part.reason_count), std::end(part.reason_count), 0);
    if (before_step) {
      SegmentViews views = bind_views(context.sensors[sensor], part, scratch);
      Segment segment = {context.sensors[sensor], context.segment[sensor], part, views};
      for (int32_t s = 0; s < int32_t(kPaper.segment.size()); ++s) {
        before_step(s);
        kPaper.segment[std::size_t(s)].run(kernels, segment);
      }
    } else {
      context.scratch = &scratch;
      segment_scan(context, sensor, part, 0);
    }
    Hash hash(hash_table(part.clusters, hash_table(part.cluster_points, 0)));
    hash.add_value(part.label_count);
    hash.add_bytes(part.kept.points.label, cloud.size() * 4);
    hash.add_bytes(part.kept.points.reason, cloud.size());
    hash.add_bytes(part.reason_count, sizeof part.reason_count);
    hash.add_bytes(part.row_of_label, std::size_t(part.label_count + 1) * 4);
    for (int32_t r = 0; r < context.sensors[sensor].rows; ++r)
      hash.add_bytes(part.kept.images.pixel_point.row(r), std::size_t(context.sensors[sensor].cols) * 4);
    CHECK(part.clusters.count > 3);
    return hash.value();
  }
};

void soil(SegmentScratch& scratch) { std::memset(scratch.block, 0xa5, scratch.plan.bytes); }

TEST_CASE("segment_scratch: sharing by sensors of two shapes and dirty memory change no byte") {
  for (const char* isa : {"ref", "sse2", "avx2", "avx512", "neon64"}) {
    const KernelTable* kernels = find_kernels(isa);
    if (!kernels) continue;
    CAPTURE(isa);
    World kept(true), lent(false);
    for (int32_t k = 0; k < 6; ++k) {
      const int32_t sensor = k % 2;
      const auto cloud = make_cloud(kept.context.sensors[sensor], k);
      soil(lent.scratch);
      CHECK(lent.segment(*kernels, sensor, cloud) == kept.segment(*kernels, sensor, cloud));
    }
  }
}

// Bytes of the block that hold no column from an earlier step for this or a later step.
std::vector<bool> find_dead_bytes(const SegmentPlan& plan, int32_t step) {
  std::vector<bool> dead(plan.bytes, true);
  for (int32_t c = 0; c < kColumnCount; ++c)
    if (has(plan.shared, Column(c)) && plan.first[c] < step && plan.last[c] >= step)
      std::fill_n(dead.begin() + std::ptrdiff_t(plan.offset[c]), plan.bytes_of[c], false);
  return dead;
}

TEST_CASE("segment_scratch: memory that the plan calls dead before a step may contain anything") {
  World kept(true), planned(false);
  for (int32_t sensor = 0; sensor < 2; ++sensor) {
    const auto cloud = make_cloud(kept.context.sensors[sensor], 7 + sensor);
    const KernelTable& kernels = *find_kernels(nullptr);
    const uint64_t expected = kept.segment(kernels, sensor, cloud);
    planned.before_step = [&](int32_t step) {
      const std::vector<bool> dead = find_dead_bytes(planned.scratch.plan, step);
      for (std::size_t i = 0; i < dead.size(); ++i)
        if (dead[i]) planned.scratch.block[i] = char(0xff);
    };
    CHECK(planned.segment(kernels, sensor, cloud) == expected);
  }
}

TEST_CASE("segment_scratch: after a segmentation a frame shows what it keeps in memory of its own, and no more") {
  for (const bool keep_images : {false, true}) {
    World world(keep_images);
    const Columns kept = plan_segment(world.sizes).kept;
    for (int32_t sensor = 0; sensor < 2; ++sensor) {
      world.segment(*find_kernels(nullptr), sensor, make_cloud(world.context.sensors[sensor], 3));
      SensorPart& part = world.frame.sensors[sensor];
      const auto is_own = [&](const void* view) {
        const auto* at = static_cast<const char*>(view);
        return at >= world.block_begin && at < world.block_end;
      };
      for_each_segment_column(part, part.kept, [&](Column column, auto extent, auto& view) {
        CAPTURE(std::string(column_name(column)));
        const void* memory = nullptr;
        if constexpr (extent == Extent::own)
          return;
        else if constexpr (std::is_same_v<decltype(view), BitPlane&>)
          memory = view.words;
        else if constexpr (extent == Extent::pixels)
          memory = view.data;
        else
          memory = view;
        CHECK((memory != nullptr) == has(kept, column));
        CHECK((memory == nullptr || is_own(memory)));
      });
      CHECK(part.kept.layer_sums.touched == nullptr);
      CHECK(part.kept.points.count == part.scan.count);
      for_each_column(part.scan, [&](const char*, auto* column) { CHECK(is_own(column)); });
      for_each_column(part.clusters, [&](const char*, auto* column) { CHECK(is_own(column)); });
      for_each_column(part.cluster_points, [&](const char*, auto* column) { CHECK(is_own(column)); });
      CHECK(is_own(part.row_of_label));
      CHECK(is_own(part.cluster_of_label));
    }
  }
}

TEST_CASE("detector: without kept images everything else is the same bytes, on any number of workers") {
  std::vector<FrameRecord> expected;
  int64_t kept_bytes = 0;
  for (const int32_t workers : {1, 2, 4})
    for (const int32_t keep : {1, 0}) {
      DetectorBench bench({.workers = workers});
      bench.def.keep_images = keep;
      bench.create();
      for (std::size_t k = 0; k < 8; ++k) bench.push_frame(k, {0, 1, 2});
      bench.flush();
      REQUIRE(bench.records.size() == 8);
      if (expected.empty()) expected = bench.records;
      for (std::size_t k = 0; k < 8; ++k) {
        CHECK(bench.records[k].detections == expected[k].detections);
        CHECK(bench.records[k].tracks == expected[k].tracks);
        CHECK(bench.records[k].labels == expected[k].labels);
      }
      ovt_runtime_info info;
      REQUIRE(ovt_read_runtime_info(bench.detector, &info) == OVT_OK);
      if (workers == 1 && keep) kept_bytes = info.memory_bytes;
      if (workers == 1 && !keep) CHECK(info.memory_bytes < kept_bytes * 3 / 4);

      ovt_reader* reader = nullptr;
      REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
      REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
      for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
        ovt_image image{};
        const bool computed = id != OVT_IMAGE_HEIGHT, there = keep || id == OVT_IMAGE_PIXEL_POINT;
        CHECK(ovt_read_image(reader, 0, ovt_image_id(id), &image) == (!computed ? OVT_NOT_COMPUTED
                                                                      : there   ? OVT_OK
                                                                                : OVT_NOT_KEPT));
        CHECK((image.data != nullptr) == (computed && there));
      }
      CHECK(ovt_read_image(reader, 0, OVT_IMAGE_COUNT, nullptr) == OVT_BAD_ARGUMENT);
      ovt_image image;
      CHECK(ovt_read_image(reader, 0, OVT_IMAGE_COUNT, &image) == OVT_BAD_ARGUMENT);
      ovt_destroy_reader(reader);
    }
}

}  // namespace
