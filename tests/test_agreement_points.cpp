// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The point kernels on every ISA against the reference, with inputs that test_agreement's clouds do not contain: every
// order of points, every field type and layout, many points in one pixel, and fits of unusual shapes.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "tests/support/kernel_world.h"
#include "tests/support/paper_params.h"
#include "tests/support/segment_chain.h"

namespace overtake::test {
namespace {

enum class Order { lines, interleaved, firing, random, one_pixel, few_layers };
constexpr Order kOrders[] = {Order::lines,  Order::interleaved, Order::firing,
                             Order::random, Order::one_pixel,   Order::few_layers};

// A wall and a floor around the sensor, seen by `rows` layers, with holes, double returns and invalid points.
std::vector<TestPoint> make_cloud(Order order, int32_t rows, int32_t cols, uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto chance = [&](int32_t percent) { return int32_t(random() % 100) < percent; };
  std::vector<TestPoint> cloud;
  const int32_t count = rows * cols;
  for (int32_t i = 0; i < count; ++i) {
    int32_t r = i / cols, c = i % cols;
    if (order == Order::firing) r = i % rows, c = i / rows;
    if (order == Order::interleaved) r = (i / cols) ^ (i & 1), c = (i % cols) / 2 + (i & 1) * (cols / 2);
    if (order == Order::one_pixel) r = c = 0;
    if (order == Order::few_layers) r %= 2;
    const float azimuth = 1.04f - 2.08f * float(c) / float(cols), elevation = 0.2f - 0.5f * float(r) / float(rows);
    float s, e_s, cosine, e_c;
    sin_cos_f32(azimuth, s, cosine);
    sin_cos_f32(elevation, e_s, e_c);
    const float wall = float(20 + c / 40 % 3 * 15) + float(random() % 100) * 0.003f;
    const float range = e_s < -0.05f ? std::min(wall, -1.5f / e_s) : wall;
    TestPoint p{range * e_c * cosine, range * e_c * s, range * e_s, float(random() % 4), float(r)};
    if (order == Order::one_pixel) p.x_m = 30.0f + 0.01f * float(random() % 8), p.y_m = 30.0f, p.z_m = 1.0f;
    if (chance(3)) continue;
    if (chance(1)) p.x_m = std::numeric_limits<float>::quiet_NaN();
    if (chance(1)) p.y_m = -std::numeric_limits<float>::infinity();
    if (chance(1)) p.x_m = p.y_m = p.z_m = -0.0f;
    if (chance(1)) p.z_m = 1e30f;
    if (chance(1)) p.layer = 1.5f;
    cloud.push_back(p);
    if (chance(5)) cloud.push_back(p), cloud.back().intensity += float(random() % 2), cloud.back().x_m *= 1.001f;
  }
  if (order == Order::random) std::shuffle(cloud.begin(), cloud.end(), random);
  return cloud;
}

// Everything that the point kernels write, with one kernel table from start to end; the image kernels are always the
// references.
uint64_t run_points(const KernelTable& k, const std::vector<TestPoint>& cloud, const PointFields& fields,
                    const SensorModel& sensor, int32_t cluster_capacity) {
  SegmentChain chain(sensor, int32_t(cloud.size()), cluster_capacity);
  const KernelTable& reference = *find_kernels("ref");
  const SensorPart& part = chain.part;
  const RangeImages& m = chain.views.images;
  LayerSums& sums = chain.views.layer_sums;
  Hash hash(1);
  for (int32_t scan = 0; scan < 2; ++scan) {  // twice: no value of the first may remain
    k.load_points(fields, int32_t(cloud.size()), chain.part.scan);
    for (const Step& step : chain.method->segment) {
      chain.run_step(step, works_on_images(&step) ? reference : k);
      if (step.name == std::string_view("project_points")) {
        std::sort(sums.touched, sums.touched + sums.touched_count);
        for (int32_t t = 0; t < sums.touched_count; ++t) {
          const int32_t layer = sums.touched[t];
          hash.add_value(layer);
          hash.add_value(sums.point_count[layer]);
          hash.add_value(sums.elevation_sum[layer]);
        }
      }
      if (step.name == std::string_view("scatter_points"))
        for (int32_t r = 0; r < sensor.rows; ++r)
          for (const void* row :
               {static_cast<const void*>(m.range_m.row(r)), static_cast<const void*>(m.elevation_rad.row(r)),
                static_cast<const void*>(m.pixel_point.row(r))})
            hash.add_bytes(row, std::size_t(sensor.cols) * 4);
    }
    hash.add_value(part.cluster_overflow);
    hash.add_bytes(part.row_of_label, (std::size_t(part.label_count) + 1) * 4);
    hash.add_bytes(part.reason_count, sizeof part.reason_count);
    hash.add_value(hash_table(part.scan, 2));
    hash.add_value(hash_table(chain.views.points, 3));
    hash.add_value(hash_table(part.clusters, 4));
    hash.add_value(hash_table(part.cluster_points, 5));
  }
  return hash.value();
}

SensorModel make_sensor(int32_t rows, int32_t cols, bool wraps) {
  const double edge = wraps ? kPi : 1.05;
  SensorModel sensor = make_sensor_model(rows, cols, edge, wraps ? -kPi : -edge, wraps, 0.5, 200.0);
  sensor.T_vehicle_sensor = make_transform(1.5, -0.3, 0.7, 0.01, -0.02, 2.1);
  return sensor;
}

void check_all(const std::vector<TestPoint>& cloud, const PointFields& fields, const SensorModel& sensor,
               int32_t cluster_capacity) {
  const KernelTable* tables[16] = {};
  const int32_t count = list_kernels(tables);
  const uint64_t truth = run_points(*tables[0], cloud, fields, sensor, cluster_capacity);
  for (int32_t t = 1; t < count; ++t) {
    INFO("isa ", tables[t]->isa);
    CHECK(run_points(*tables[t], cloud, fields, sensor, cluster_capacity) == truth);
  }
}

TEST_CASE("agreement: points in any order give the reference's bytes on every ISA") {
  for (const Order order : kOrders)
    for (uint64_t seed = 1; seed <= 4; ++seed) {
      CAPTURE(int32_t(order));
      CAPTURE(seed);
      const int32_t cols = 30 + 97 * int32_t(seed);
      const std::vector<TestPoint> cloud = make_cloud(order, 20, cols, seed);
      check_all(cloud, fields_of(cloud), make_sensor(20, cols, seed % 2 == 0), 1024);
    }
}

TEST_CASE(
    "agreement: more layers than rows and more clusters than table rows give the reference's bytes on every ISA") {
  for (const Order order : kOrders) {
    CAPTURE(int32_t(order));
    const std::vector<TestPoint> cloud = make_cloud(order, 24, 200, 9);
    check_all(cloud, fields_of(cloud), make_sensor(11, 200, false), 1024);
    check_all(cloud, fields_of(cloud), make_sensor(24, 200, false), 5);
  }
}

// All types of field in one record layout each; the values are random bits, so every special float occurs.
TEST_CASE("load_points: any type, stride and address of a field gives the reference's bytes on every ISA") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  constexpr FieldType kTypes[] = {FieldType::kNone,   FieldType::kFloat32, FieldType::kFloat64,
                                  FieldType::kInt8,   FieldType::kUint8,   FieldType::kInt16,
                                  FieldType::kUint16, FieldType::kInt32,   FieldType::kUint32};
  constexpr std::ptrdiff_t kSizes[] = {0, 4, 8, 1, 1, 2, 2, 4, 4};
  for (uint64_t seed = 1; seed <= 400; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const auto count = int32_t(random() % 70);
    const bool records = random() % 4 != 0;
    std::ptrdiff_t stride = 0;
    PointFields fields;
    PointField* all[6] = {&fields.x, &fields.y, &fields.z, &fields.intensity, &fields.layer, &fields.time};
    std::ptrdiff_t offsets[6];
    for (int32_t f = 0; f < 6; ++f) {
      const std::size_t type = random() % 3 == 0 ? random() % 9 : f < 4 ? 1 : f == 4 ? 6 : random() % 2 ? 1 : 7;
      all[f]->type = random() % 8 == 0 ? FieldType::kNone : kTypes[type];
      offsets[f] = stride;
      stride += kSizes[std::size_t(all[f]->type)] + std::ptrdiff_t(random() % 4 == 0 ? random() % 5 : 0);
    }
    fields.time_unit_ns = random() % 2 ? 1.0 : 1e9 / double(1 + random() % 1000);
    // Exactly the bytes that the fields need: the address sanitizer detects a read beyond.
    std::vector<unsigned char> bytes[6];
    for (int32_t f = 0; f < 6; ++f) {
      const std::ptrdiff_t size = kSizes[std::size_t(all[f]->type)];
      if (size == 0) continue;
      std::vector<unsigned char>& memory = records ? bytes[0] : bytes[f];
      all[f]->stride = records ? stride : size;
      const std::size_t last = std::size_t(count > 0 ? (count - 1) * all[f]->stride + size : 0);
      const std::size_t need = last + (records ? std::size_t(offsets[f]) : 0);
      if (memory.size() < need) memory.resize(need);
    }
    for (auto& memory : bytes)
      for (auto& byte : memory) byte = static_cast<unsigned char>(random() % 3 == 0 ? 0 : random());
    for (int32_t f = 0; f < 6; ++f)
      if (kSizes[std::size_t(all[f]->type)] > 0)
        all[f]->data = records ? bytes[0].data() + (count > 0 ? offsets[f] : 0) : bytes[f].data();

    uint64_t truth = 0;
    for (int32_t t = 0; t < table_count; ++t) {
      INFO("isa ", tables[t]->isa);
      Arena arena;
      ScanTable scan;
      REQUIRE(arena.build(default_allocator(), [&](Carver& carver) { carve_table(carver, scan, 70); }));
      tables[t]->load_points(fields, count, scan);
      if (t == 0) truth = hash_table(scan, 1);
      CHECK(hash_table(scan, 1) == truth);
    }
  }
}

TEST_CASE("fit_rectangle: any number and shape of points gives the reference's bytes on every ISA") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  for (uint64_t seed = 1; seed <= 410; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return float(random() % 65536) / 65536.0f; };
    const int32_t count = seed < 70        ? int32_t(seed)
                          : seed % 10 == 0 ? 4090 + int32_t(seed % 13)
                          : seed % 10 == 5 ? 4097 + int32_t(random() % 4000)  // handled block by block
                                           : int32_t(1 + random() % 900);
    const int32_t shape = int32_t(seed % 20 == 5 ? 5 : seed % 20 == 15 ? seed / 20 % 5 : seed % 6);
    std::vector<float> x, y;
    for (int32_t i = 0; i < count; ++i) {
      const float along = uniform() * 6.8f, noise = shape == 4 ? 0.0f : 0.03f * uniform();
      float u = along < 4.9f ? along : noise, v = along < 4.9f ? noise : along - 4.9f;
      if (shape == 1) v = noise;                                  // one side
      if (shape == 2) u = v = 0.0f;                               // all at one point
      if (shape == 3) u = (uniform() - 0.5f) * 1e30f, v = -0.0f;  // invalid values
      if (shape == 5) {  // mirrored: two headings cost the same except for rounding
        const int32_t half = std::max(count / 2, 1), of = i - half;
        u = float(i % 997) / 256.0f, v = float(int32_t(uniform() * 64.0f) + i % 499) / 512.0f;
        if (of >= 0 && of < half) u = y[std::size_t(of)] + 3.0f, v = x[std::size_t(of)] - 20.0f;
      }
      const float turn = shape >= 4 ? 0.0f : 0.4f;
      x.push_back(20.0f + u - turn * v);
      y.push_back(shape == 3 ? v : -3.0f + v + turn * u);
    }
    const float heading = (uniform() - 0.5f) * 7.0f;
    const FitRectangleParams params = paper_frame_params().fit_rectangle;
    RectangleFit truth{};
    for (int32_t t = 0; t < table_count; ++t) {
      INFO("isa ", tables[t]->isa);
      const RectangleFit fit = tables[t]->fit_rectangle(params, x.data(), y.data(), count, heading, 2.3f, 0.0f);
      if (t == 0) truth = fit;
      const auto same = [](float a, float b) { return std::bit_cast<uint32_t>(a) == std::bit_cast<uint32_t>(b); };
      CHECK(same(fit.heading_var_rad, truth.heading_var_rad));
      CHECK(same(fit.heading_rad, truth.heading_rad));
      CHECK(fit.inliers_ref == truth.inliers_ref);
      CHECK(fit.inliers_var == truth.inliers_var);
      CHECK(fit.from_var == truth.from_var);
      CHECK(same(fit.ref_x_m, truth.ref_x_m));
      CHECK(same(fit.ref_y_m, truth.ref_y_m));
      CHECK(same(fit.var_x_m, truth.var_x_m));
      CHECK(same(fit.var_y_m, truth.var_y_m));
      CHECK(same(fit.center_x_m, truth.center_x_m));
      CHECK(same(fit.center_y_m, truth.center_y_m));
      CHECK(same(fit.extent_length_m, truth.extent_length_m));
      CHECK(same(fit.extent_width_m, truth.extent_width_m));
    }
  }
}

}  // namespace
}  // namespace overtake::test
