// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Values exactly on a limit, where < and <= differ: random noise never hits one. Every ISA against the scalar
// reference, on a few round numbers.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "pipeline/method/steps.h"
#include "tests/support/images.h"
#include "tests/support/segment_chain.h"

namespace overtake::test {
namespace {

constexpr int32_t kRows = 6, kCols = 75;

// Multiples of 1/2: sums, halves and differences are exact, and many differences are 1 and 5.
float draw_range(std::mt19937_64& random) {
  constexpr float kRanges_m[] = {0.0f, 4.0f, 5.0f, 5.5f, 9.0f, 10.0f, 10.5f, 14.0f};
  return kRanges_m[random() % std::size(kRanges_m)];
}

template <class T>
std::string draw_plane(OwnedPlane<T>& plane, int32_t rows, int32_t cols) {
  std::string text;
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) text += std::to_string(plane.at(r, c)) + (c + 1 < cols ? ' ' : '\n');
  return text;
}
std::string draw_bits(OwnedBits& bits) {
  std::string text;
  for (int32_t r = 0; r < bits.view().rows; ++r) {
    for (int32_t c = 0; c < bits.view().cols; ++c) text += bits.view().test(r, c) ? '#' : '.';
    text += '\n';
  }
  return text;
}

// run(table, random) must return the same text with every table.
template <class F>
void check_every_isa(F&& run) {
  const KernelTable* tables[16] = {};
  const int32_t count = list_kernels(tables);
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    std::string by_reference;
    for (int32_t t = 0; t < count; ++t) {
      INFO("isa ", std::string(tables[t]->isa), ", seed ", seed);
      std::mt19937_64 random(seed);
      const std::string got = run(*tables[t], random);
      if (t == 0) by_reference = got;
      CHECK(got == by_reference);
    }
  }
}

}  // namespace

TEST_CASE("limits: fill_gaps writes the reference's bytes") {
  check_every_isa([](const KernelTable& k, std::mt19937_64& random) {
    OwnedPlane<float> range(kRows, kCols), elevation(kRows, kCols), filled(kRows, kCols), e_filled(kRows, kCols);
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) range.at(r, c) = draw_range(random), elevation.at(r, c) = 0.25f * float(r);
    k.fill_gaps({1.0f, 0.0f}, range, elevation, filled, e_filled, {});
    return draw_plane(filled, kRows, kCols) + draw_plane(e_filled, kRows, kCols);
  });
}

// A narrow image, and one with more dark pixels in three rows than the vector form keeps the neighbours of.
TEST_CASE("limits: drop_smoke writes the reference's bytes") {
  check_every_isa([](const KernelTable& k, std::mt19937_64& random) {
    const int32_t rows = kRows, cols = random() % 4 ? kCols : 40 * kCols;
    // 10 and 10.5 differ by reach_m, 10 and 10.15 by the limit of a surface or a bit more or less.
    constexpr float kRanges_m[] = {0.0f, 9.75f, 10.0f, 10.149999f, 10.15f, 10.150001f, 10.25f, 10.5f, 14.0f};
    constexpr float kIntensities[] = {0.0f, 0.12499999f, 0.125f, 1.0f};
    OwnedPlane<float> range(rows, cols);
    OwnedPlane<int32_t> point(rows, cols);
    OwnedBits nonground(rows, cols), considered(rows, cols), rough(rows, cols), smoke(rows, cols);
    std::vector<float> intensity(std::size_t(round_up(rows * cols, kRowAlign)), 1.0f);
    std::vector<float> x_m(intensity.size()), y_m(intensity.size()), z_m(intensity.size());
    std::vector<int32_t> pixel(intensity.size(), -1);
    nonground.clear();
    const bool is_signal = random() % 2;
    constexpr float kCoordinates_m[] = {0.7f, 3.3f, 9.1f, 17.9f};
    const uint64_t ground = 2 + random() % 6;
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        const bool is_ground = random() % ground == 0;
        range.at(r, c) = kRanges_m[random() % std::size(kRanges_m)];
        point.at(r, c) = range.at(r, c) == 0.0f || random() % 8 == 0 ? kNoPoint : r * cols + c;
        // Some points without a pixel lost one.
        if (point.at(r, c) != kNoPoint || random() % 2) pixel[std::size_t(r * cols + c)] = r * point.view().stride + c;
        const auto i = std::size_t(r * cols + c);
        if (!is_ground) intensity[i] = kIntensities[random() % std::size(kIntensities)];
        for (std::vector<float>* axis : {&x_m, &y_m, &z_m})
          (*axis)[i] = kCoordinates_m[random() % std::size(kCoordinates_m)];
        if (is_signal) intensity[i] /= x_m[i] * x_m[i] + y_m[i] * y_m[i] + z_m[i] * z_m[i];
        if (!is_ground && range.at(r, c) > 0.0f) nonground.view().set(r, c);
      }
    ScanTable scan;
    scan.count = rows * cols;
    scan.capacity = int32_t(intensity.size());
    scan.intensity = intensity.data();
    scan.x_m = x_m.data(), scan.y_m = y_m.data(), scan.z_m = z_m.data();
    const GroundLight light = {.light = 1.0f, .is_signal = is_signal};
    k.drop_smoke({0.125f, 0.25f, 0.5f}, scan, light, pixel.data(), range, point, nonground.view(), considered.view(),
                 rough.view(), smoke.view());
    return draw_bits(nonground) + draw_bits(smoke);
  });
}

TEST_CASE("limits: mark_ground writes the reference's bytes") {
  check_every_isa([](const KernelTable& k, std::mt19937_64& random) {
    constexpr float kAngles[] = {0.25f, 0.5f, 0.50000006f, 1.0f, kAngleUndefined, kBesideUndefined};
    OwnedPlane<float> angle(kRows, kCols), range(kRows, kCols);
    OwnedPlane<int32_t> point(kRows, kCols);
    OwnedBits nonground(kRows, kCols);
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        angle.at(r, c) = kAngles[random() % std::size(kAngles)];
        range.at(r, c) = draw_range(random);
        point.at(r, c) = random() % 3 ? int32_t(random() % 100) : kNoPoint;
      }
    k.mark_ground({0.5f}, kRows - 1, angle, range, point, nonground, {});
    return draw_bits(nonground);
  });
}

TEST_CASE("limits: repair_range writes the reference's bytes") {
  check_every_isa([](const KernelTable& k, std::mt19937_64& random) {
    OwnedPlane<float> range(kRows, kCols), elevation(kRows, kCols), repaired(kRows, kCols), e_repaired(kRows, kCols);
    OwnedBits nonground(kRows, kCols), nonground_repaired(kRows, kCols);
    nonground.clear();
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        range.at(r, c) = draw_range(random), elevation.at(r, c) = 0.25f * float(c % 3);
        if (range.at(r, c) > 0.0f && random() % 2) nonground.view().set(r, c);
      }
    k.repair_range({4, 5.0f, random() % 2 == 0}, range, elevation, nonground, repaired, e_repaired, nonground_repaired,
                   {});
    return draw_plane(repaired, kRows, kCols) + draw_plane(e_repaired, kRows, kCols) + draw_bits(nonground_repaired);
  });
}

TEST_CASE("limits: links and labels over the seam of narrow images are the reference's") {
  for (const int32_t cols : {1, 2, 3, 5, 16, 17, 63, 64, 65}) {
    CAPTURE(cols);
    check_every_isa([cols](const KernelTable& k, std::mt19937_64& random) {
      OwnedPlane<float> range(kRows, cols), elevation(kRows, cols);
      OwnedPlane<int32_t> labels(kRows, cols);
      OwnedBits nonground(kRows, cols), right(kRows, cols), down(kRows, cols);
      nonground.clear();
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < cols; ++c) {
          range.at(r, c) = 10.0f + 0.01f * float(random() % 8), elevation.at(r, c) = -0.01f * float(r);
          if (random() % 4) nonground.view().set(r, c);
        }
      LinkPixelsParams params = paper_params().link_pixels;
      params.wraps = true;
      params.sin_pitch = 0.09983342f, params.cos_pitch = 0.99500417f;
      k.link_pixels(params, range, elevation, nonground, right, down, {});
      std::vector<int32_t> queue(std::size_t(kRows * cols) + 1);
      const int32_t count = k.label_bfs(true, range, nonground, right, down, labels, queue.data());
      std::string text = std::to_string(count) + '\n';
      for (int32_t r = 0; r < kRows; ++r)
        for (int32_t c = 0; c < cols; ++c) text += right.view().test(r, c) ? '>' : down.view().test(r, c) ? 'v' : '.';
      return text + draw_plane(labels, kRows, cols);
    });
  }
}

TEST_CASE("limits: a full cluster table and times of both halves of a word give the reference's bytes") {
  for (const int32_t capacity : {39, 40, 41}) {
    CAPTURE(capacity);
    check_every_isa([capacity](const KernelTable& k, std::mt19937_64& random) {
      const SensorModel sensor = make_sensor_model(kRows, kCols, 1.05, -1.05, false, 0.5, 200.0);
      SegmentChain chain(sensor, 800, capacity);
      ScanTable& scan = chain.part.scan;
      PointTable& points = chain.views.points;
      scan.count = points.count = 800;
      for (int32_t i = 0; i < scan.count; ++i) {
        scan.x_m[i] = 0.5f * float(random() % 64), scan.y_m[i] = 1.0f, scan.z_m[i] = -0.5f;
        scan.time_offset_ns[i] = int32_t(random() % 100'000'000) - 50'000'000;
        points.range_m[i] = 1.0f + 0.5f * float(random() % 64);
        points.label[i] = i < 40 ? i + 1 : int32_t(random() % 41);  // 40 clusters
      }
      chain.part.label_count = 40;
      for (const Step& step : chain.method->segment)
        if (step.name == std::string("build_clusters")) chain.run_step(step, k);
      std::string text = std::to_string(chain.part.cluster_overflow) + '\n';
      const ClusterTable& clusters = chain.part.clusters;
      for (int32_t row = 0; row < clusters.count; ++row)
        text += std::to_string(clusters.label[row]) + ' ' + std::to_string(clusters.point_count[row]) + ' ' +
                std::to_string(clusters.sum_offset_ns[row]) + ' ' + std::to_string(clusters.nearest_m[row]) + '\n';
      return text;
    });
  }
}

TEST_CASE("limits: layers, ranges and coordinates on a limit give the reference's bytes") {
  const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  check_every_isa([&](const KernelTable& k, std::mt19937_64& random) {
    const float layers[] = {-1.0f, 0.0f, 3.0f, 4.0f, 9.0f, 10.0f, 65535.0f, 65536.0f, 1e9f, 2.5f, nan, infinity};
    const float ranges_m[] = {0.0f, 0.49999997f, 0.5f, 1.0f, 199.99998f, 200.0f, 200.00002f, 1e-40f, nan, infinity};
    std::vector<TestPoint> cloud(200);
    for (TestPoint& p : cloud) {
      float* const axis[] = {&p.x_m, &p.y_m, &p.z_m};  // along an axis the range is exact
      *axis[random() % 3] = ranges_m[random() % std::size(ranges_m)] * (random() % 4 ? 1.0f : -1.0f);
      if (random() % 8 == 0) *axis[random() % 3] = nan;
      p.layer = layers[random() % std::size(layers)];
    }
    SensorModel sensor = make_sensor_model(kRows, 64, 1.05, -1.05, random() % 2 == 0, 0.5, 200.0);
    sensor.layer_first = 3;
    sensor.layer_last = 9;
    SegmentChain chain(sensor, int32_t(cloud.size()));
    k.load_points(fields_of(cloud), int32_t(cloud.size()), chain.part.scan);
    chain.run_step(chain.method->segment[0], k);  // project_points
    std::string text;
    for (int32_t i = 0; i < int32_t(cloud.size()); ++i)
      text += std::to_string(chain.part.scan.layer[i]) + ' ' + std::to_string(chain.views.points.reason[i]) + ' ' +
              std::to_string(chain.views.points.column[i]) + ' ' + std::to_string(chain.views.points.range_m[i]) + '\n';
    return text;
  });
}

TEST_CASE("limits: label_points writes the reference's bytes") {
  check_every_isa([](const KernelTable& k, std::mt19937_64& random) {
    const SensorModel sensor = make_sensor_model(kRows, kCols, 1.05, -1.05, false, 0.5, 200.0);
    SegmentChain chain(sensor, 2 * kRows * kCols);
    RangeImages& m = chain.views.images;
    PointTable& points = chain.views.points;
    points.count = 0;
    const auto add = [&](int32_t r, int32_t c, float range_m, bool lost) {
      const int32_t i = points.count++;
      points.pixel[i] = r * m.labels.stride + c;
      points.range_m[i] = range_m;
      points.lost[i] = lost;
      points.label[i] = kLabelGround;
      points.reason[i] = 0;
      return i;
    };
    for (int32_t r = 0; r < kRows; ++r)
      for (int32_t c = 0; c < kCols; ++c) {
        const float range_m = 10.0f + 0.5f * float(random() % 3);
        m.range_filled_m.at(r, c) = range_m;
        m.range_repaired_m.at(r, c) = range_m + 0.25f * float(random() % 4);  // 0.5 m is the limit
        m.labels.at(r, c) = int32_t(random() % 4);
        m.pixel_point.at(r, c) = add(r, c, range_m, false);
      }
    for (int32_t k_lost = 0; k_lost < kRows * kCols; ++k_lost) {
      const auto r = int32_t(random() % kRows), c = int32_t(random() % kCols);
      add(r, c, m.range_filled_m.at(r, c) + 0.25f * float(int32_t(random() % 9) - 4), true);
    }
    k.label_points({0.5f, 0.5f}, m, points);
    std::string text;
    for (int32_t i = 0; i < points.count; ++i)
      text += std::to_string(points.label[i]) + ' ' + std::to_string(points.reason[i]) + '\n';
    return text;
  });
}

// The clusters' points fill their table, and the last clusters begin at any place of a vector.
TEST_CASE("limits: build_clusters writes the reference's bytes and nothing behind a full table") {
  for (int32_t last = 1; last <= 40; ++last) {
    CAPTURE(last);
    check_every_isa([&](const KernelTable& k, std::mt19937_64& random) {
      const SensorModel sensor = make_sensor_model(kRows, kCols, 1.05, -1.05, false, 0.5, 200.0);
      SegmentChain chain(sensor, 64);
      ScanTable& scan = chain.part.scan;
      PointTable& points = chain.views.points;
      ClusterPointTable& out = chain.part.cluster_points;
      const int32_t count = scan.capacity;
      scan.count = points.count = count;
      for (int32_t i = 0; i < count; ++i) {
        scan.x_m[i] = 10.0f + 0.01f * float(random() % 1000), scan.y_m[i] = 0.01f * float(random() % 1000);
        scan.z_m[i] = 0.01f * float(random() % 100);
        scan.time_offset_ns[i] = int32_t(random() % 100000000);
        points.range_m[i] = 1.0f + float(random() % 50);
        points.label[i] = i < count - last ? 1 : 2 + i % (1 + last / 9);
      }
      chain.part.label_count = 2 + last / 9;
      chain.run_step(step::build_clusters, k);
      CHECK(out.count == count);
      return std::to_string(hash_table(chain.part.clusters, 1)) + ' ' + std::to_string(hash_table(out, 2));
    });
  }
}

}  // namespace overtake::test
