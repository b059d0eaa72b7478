// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The whole detector through the C API: same bytes for any thread timing, frames in order, lifetimes, flags, counters.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>
#include <thread>

#include "tests/support/one_sensor_detector.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();

std::vector<FrameRecord> run(int32_t workers, std::size_t frames, const std::vector<std::vector<int32_t>>& orders) {
  DetectorBench bench({.workers = workers});
  bench.create();
  for (std::size_t k = 0; k < frames; ++k) bench.push_frame(k, orders[k % orders.size()]);
  bench.flush();
  CHECK(adds_up(bench.stats()));
  CHECK(bench.stats().used == int64_t(3 * frames));
  return bench.records;
}

}  // namespace

TEST_CASE("detector: the same bytes for every worker count and every arrival order within a frame") {
  constexpr std::size_t kFrames = 6;
  const std::vector<FrameRecord> expected = run(1, kFrames, {{0, 1, 2}});
  REQUIRE(expected.size() == kFrames);
  int32_t detections = 0;
  for (std::size_t k = 0; k < kFrames; ++k) {
    CHECK(expected[k].info.sequence == int64_t(k));
    CHECK(expected[k].info.sensor_mask == 7);
    CHECK(expected[k].info.reference == OVT_REFERENCE_MAP);
    CHECK((expected[k].info.flags & ~uint32_t(OVT_FLAG_EGO_HEADING)) == 0);  // not learned within a few frames
    detections += expected[k].info.detection_count;
  }
  CHECK(detections > 0);
  CHECK(std::count(expected.back().track_state.begin(), expected.back().track_state.end(), OVT_CONFIRMED) > 0);
  for (const int32_t workers : {2, 3, 4, 8}) {
    CAPTURE(workers);
    CHECK(run(workers, kFrames, {{0, 1, 2}}) == expected);
  }
  const std::vector<std::vector<int32_t>> orders = {{0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    CHECK(run(workers, kFrames, orders) == expected);
    CHECK(run(workers, kFrames, {{2, 1, 0}}) == expected);
  }
}

TEST_CASE("detector: packed records at any address give the bytes of columns") {
  constexpr std::size_t kFrames = 3, kStep = 22;  // x y z intensity ring time, as drivers pack them
  const auto run_packed = [&](std::size_t shift, bool pieces) {
    DetectorBench bench({.workers = 1});
    bench.def.stream = pieces;
    bench.create();
    for (std::size_t k = 0; k < kFrames; ++k) {
      bench.push_ego(k);
      for (int32_t s = 0; s < 3; ++s) {
        const overtake::SceneScan& scan = demo_frame(k).scan[s];
        const std::size_t count = scan.x_m.size();
        std::vector<char> bytes(shift + kStep * count);
        ovt_points points = points_of(scan, s, demo_frame(k).stamp_ns);
        std::size_t offset = 0;
        const auto pack = [&](ovt_column& column, std::size_t size) {
          char* const first = bytes.data() + shift + offset;
          for (std::size_t i = 0; i < count; ++i)
            std::memcpy(first + kStep * i, static_cast<const char*>(column.data) + i * column.stride, size);
          column = {first, kStep * count - offset, kStep, column.type};
          offset += size;
        };
        pack(points.x, 4), pack(points.y, 4), pack(points.z, 4);
        pack(points.intensity, 4), pack(points.layer, 2), pack(points.time, 4);
        REQUIRE(offset == kStep);
        if (!pieces) REQUIRE(ovt_push_scan(bench.detector, &points) == OVT_OK);
        if (pieces) REQUIRE(ovt_push_points(bench.detector, &points) == OVT_OK);
        if (pieces) REQUIRE(ovt_end_scan(bench.detector, s, points.stamp_ns, points.count) == OVT_OK);
      }
    }
    bench.flush();
    return bench.records;
  };
  const std::vector<FrameRecord> expected = run(1, kFrames, {{0, 1, 2}});
  REQUIRE(expected.size() == kFrames);
  CHECK(expected.back().info.detection_count > 0);
  for (const std::size_t shift : {0, 1, 3})
    for (const bool pieces : {false, true}) {
      CAPTURE(shift);
      CAPTURE(pieces);
      CHECK(run_packed(shift, pieces) == expected);
    }
}

TEST_CASE("detector: two detectors at once do not affect each other") {
  const std::vector<FrameRecord> expected = run(1, 3, {{0, 1, 2}});
  DetectorBench a({.workers = 2}), b({.workers = 3});
  a.create();
  b.create();
  for (std::size_t k = 0; k < 3; ++k) {
    a.push_frame(k);
    b.push_frame(k, {2, 0, 1});
  }
  b.flush();
  a.flush();
  CHECK(a.records == expected);
  CHECK(b.records == expected);
}

TEST_CASE("detector: worker_count 0 uses the machine's CPUs") {
  DetectorBench bench({.workers = 0});
  bench.create();
  bench.push_frame(0);
  bench.flush();
  CHECK(bench.records.size() == 1);
}

TEST_CASE("detector: a reader's frame does not change while others finish, and outlives the detector") {
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    DetectorBench bench({.workers = workers});
    bench.create();
    ovt_reader *held = nullptr, *other = nullptr;
    ovt_frame_info info;
    REQUIRE(ovt_create_reader(bench.detector, &held) == OVT_OK);
    REQUIRE(ovt_create_reader(bench.detector, &other) == OVT_OK);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    CHECK(ovt_read_info(held, &info) == OVT_NO_FRAME);
    bench.push_frame(0);
    bench.flush();
    REQUIRE(ovt_next_frame(held, &info) == OVT_OK);
    CHECK(info.sequence == 0);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    const FrameRecord first = record_of(held, 3);
    CHECK(first == bench.records[0]);
    for (std::size_t k = 1; k < 8; ++k) {
      bench.push_frame(k);
      if (ovt_next_frame(other, nullptr) == OVT_OK) CHECK(ovt_read_info(other, &info) == OVT_OK);
    }
    bench.flush();
    CHECK(record_of(held, 3) == first);
    REQUIRE(ovt_next_frame(held, &info) == OVT_OK);
    CHECK(info.sequence == 7);
    CHECK(record_of(held, 3) == bench.records[7]);
    bench.destroy();
    CHECK(record_of(held, 3) == bench.records[7]);
    CHECK(ovt_next_frame(held, &info) == OVT_NO_FRAME);
    CHECK(ovt_next_frame(other, &info) == OVT_NO_FRAME);
    ovt_destroy_reader(held);
    ovt_destroy_reader(other);
  }
}

TEST_CASE("detector: a sensor that stops leaves the frames running and the others' detections unchanged") {
  constexpr std::size_t kFrames = 7, kLast = 3;
  for (const int32_t workers : {1, 3}) {
    CAPTURE(workers);
    DetectorBench dies({.workers = workers}), never({.workers = workers});
    dies.create();
    never.create();
    for (std::size_t k = 0; k < kFrames; ++k) {
      dies.push_frame(k, k < kLast ? std::vector<int32_t>{0, 1, 2} : std::vector<int32_t>{0, 1});
      never.push_frame(k, {0, 1});
    }
    dies.flush();
    never.flush();
    REQUIRE(dies.records.size() == kFrames);
    REQUIRE(never.records.size() == kFrames);
    for (std::size_t k = kLast; k < kFrames; ++k) {
      CHECK(dies.records[k].info.sensor_mask == 3);
      CHECK((dies.records[k].info.flags & OVT_FLAG_SENSOR_MISSING) != 0);
      CHECK(dies.records[k].detections == never.records[k].detections);
      CHECK(dies.records[k].labels == never.records[k].labels);
    }
    CHECK((dies.records[kLast].info.flags & OVT_FLAG_SENSOR_STALE) == 0);
    CHECK((dies.records[kLast + 1].info.flags & OVT_FLAG_SENSOR_STALE) != 0);
  }
}

TEST_CASE("detector: without ego poses tracks are in the vehicle frame, and without a map a flag is set") {
  for (const bool map : {false, true}) {
    DetectorBench bench({.map = map});
    bench.create();
    for (std::size_t k = 0; k < 2; ++k) bench.push_frame(k, {0, 1, 2}, false);
    const ovt_frame_info& info = bench.records.back().info;
    CHECK(info.reference == OVT_REFERENCE_VEHICLE);
    CHECK(info.ego_known == 0);
    CHECK(info.flags == (OVT_FLAG_NO_EGO | (map ? 0 : OVT_FLAG_NO_MAP)));
    bench.push_frame(2);  // the first pose: from now on in the map
    CHECK(bench.records.back().info.reference == OVT_REFERENCE_MAP);
    CHECK(bench.records.back().info.ego_known == 1);
    CHECK((bench.records.back().info.flags & OVT_FLAG_NO_EGO) == 0);
  }
}

TEST_CASE("detector: when the ego poses stop for long, tracks only predict and no detection has a track") {
  DetectorBench bench({});
  bench.create();
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  for (std::size_t k = 0; k < 4; ++k) bench.push_frame(k);
  bool lost = false;
  for (std::size_t k = 4; k < 17; ++k) {
    bench.push_frame(k, {0, 1, 2}, false);
    REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
    ovt_frame_info info;
    ovt_detections d;
    REQUIRE(ovt_read_info(reader, &info) == OVT_OK);
    REQUIRE(ovt_read_detections(reader, &d) == OVT_OK);
    if (k > 6) CHECK((info.flags & OVT_FLAG_EGO_STALE) != 0);
    if (info.ego_known) continue;
    lost = true;
    CHECK(info.reference == OVT_REFERENCE_MAP);
    for (int32_t i = 0; i < d.count; ++i) CHECK(d.track[i] == 0);
  }
  CHECK(lost);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: an empty scan is valid; no valid point sets NO_DATA, mostly bad points set CLOUD_DEGRADED") {
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.create();
    Posts posts(20);
    ovt_points empty;
    ovt_points_init(&empty, sizeof empty);
    empty.x.type = empty.y.type = empty.z.type = OVT_F32;
    empty.layer.type = OVT_U8;
    CHECK(ovt_push_scan(small.detector, &empty) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.latest.info.point_count == 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) != 0);

    ovt_points good = posts.points(50 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == 0);
    CHECK(small.latest.info.cluster_count == 20);

    const std::size_t half = posts.x.size() / 2;
    for (std::size_t i = 0; i < half; ++i) posts.x[i] = kNanF;
    good = posts.points(100 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == 0);  // half is not more than half
    posts.x[half] = std::numeric_limits<float>::infinity();
    good = posts.points(150 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) == 0);
    std::fill(posts.y.begin(), posts.y.end(), kNanF);
    good = posts.points(200 * kMs);
    CHECK(ovt_push_scan(small.detector, &good) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK((small.latest.info.flags & OVT_FLAG_CLOUD_DEGRADED) != 0);
    CHECK((small.latest.info.flags & OVT_FLAG_NO_DATA) != 0);
    CHECK(small.latest.info.cluster_count == 0);
    CHECK(small.stats().points_bad[1] == int64_t(half + half + 1 + posts.x.size()));
    CHECK(small.stats().frames == 5);
  }
}

TEST_CASE("detector: a scan of mostly dust is not degraded: its cars are seen, and the dust is counted") {
  Posts posts(20);
  const std::size_t count = posts.x.size();
  std::vector<float> intensity(count, 1.0f);
  // In front of each point of a post, two dim points that lose the pixel.
  for (const float share : {0.5f, 0.75f})
    for (std::size_t i = 0; i < count; ++i) {
      posts.x.push_back(share * posts.x[i]);
      posts.y.push_back(share * posts.y[i]);
      posts.z.push_back(share * posts.z[i]);
      posts.layer.push_back(posts.layer[i]);
      intensity.push_back(0.0f);
    }
  Small small;
  small.create();
  ovt_points points = posts.points(0);
  points.intensity = column_of(intensity, OVT_F32);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(small.stats().points_bad[7] == int64_t(2 * count));
  CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == 0);
  CHECK(small.latest.info.cluster_count == 20);
}

TEST_CASE("detector: a driver that writes the same layer for all points sets CLOUD_DEGRADED") {
  Posts posts(20);
  std::fill(posts.layer.begin(), posts.layer.end(), uint8_t(0));
  for (std::size_t i = 0; i < posts.x.size(); ++i) {
    const float scale = 1.0f + 0.1f * float(i % 8);
    posts.x[i] *= scale, posts.y[i] *= scale;
  }
  Small small;
  small.create();
  const ovt_points points = posts.points(0);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(ovt_flush(small.detector) == OVT_OK);
  CHECK((small.latest.info.flags & (OVT_FLAG_NO_DATA | OVT_FLAG_CLOUD_DEGRADED)) == OVT_FLAG_CLOUD_DEGRADED);
}

TEST_CASE("detector: an equal stamp is a duplicate, an older one is inserted, one too old is late") {
  Small small;
  small.create();
  const Posts posts(2);
  ovt_points points = posts.points(100 * kMs);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  CHECK(ovt_push_scan(small.detector, &points) == OVT_DUPLICATE);
  points.stamp_ns -= 1;
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  points.stamp_ns -= 500 * kMs;
  CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
  const ovt_stats stats = small.stats();
  CHECK(stats.pushed == 4);
  CHECK(stats.used == 2);
  CHECK(stats.dup == 1);
  CHECK(stats.late == 1);
}

TEST_CASE("detector: flush works without frames, twice, and before more pushes") {
  for (const int32_t workers : {1, 2}) {
    Small small(1, workers);
    small.create();
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(ovt_flush(small.detector) == OVT_OK);
    CHECK(small.latest.calls == 0);
    const Posts posts(2);
    for (int64_t k = 0; k < 3; ++k) {
      const ovt_points points = posts.points(k * 50 * kMs);
      CHECK(ovt_push_scan(small.detector, &points) == OVT_OK);
      CHECK(ovt_flush(small.detector) == OVT_OK);
      CHECK(small.latest.calls == int32_t(k + 1));
      CHECK(ovt_flush(small.detector) == OVT_OK);
      CHECK(small.latest.calls == int32_t(k + 1));
    }
  }
}

TEST_CASE("detector: after flush everything pushed before is finished, a thousand times") {
  Small small(1, 2);
  small.create();
  ovt_points empty;
  ovt_points_init(&empty, sizeof empty);
  empty.x.type = empty.y.type = empty.z.type = OVT_F32;
  empty.layer.type = OVT_U8;
  int64_t missed = 0;
  for (int64_t k = 1; k <= 1000; ++k) {
    empty.stamp_ns = k * 50 * kMs;
    REQUIRE(ovt_push_scan(small.detector, &empty) == OVT_OK);
    REQUIRE(ovt_flush(small.detector) == OVT_OK);
    missed += small.stats().frames != k;
  }
  CHECK(missed == 0);
}

TEST_CASE("detector: counters add up in a flood from three threads with a reader") {
  DetectorBench bench({.workers = 2, .push_policy = OVT_PUSH_REPLACE, .record = false});
  bench.create();
  const Posts posts(10);
  constexpr int64_t kScans = 300;
  std::vector<std::thread> threads;
  for (int32_t s = 0; s < 3; ++s)
    threads.emplace_back([&, s] {
      for (int64_t k = 1; k <= kScans; ++k) {
        ovt_points points = posts.points(k * 50 * kMs + s);
        points.sensor = s;
        ovt_push_scan(bench.detector, &points);
        if (k % 50 == 0) ovt_push_scan(bench.detector, &points);
      }
    });
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_reader(bench.detector, &reader) == OVT_OK);
  int64_t last = -1, backwards = 0;
  threads.emplace_back([&] {
    ovt_frame_info info;
    ovt_tracks tracks;
    for (int32_t i = 0; i < 3000; ++i) {
      if (ovt_next_frame(reader, &info) != OVT_OK) {
        std::this_thread::yield();
        continue;
      }
      backwards += info.sequence <= last;
      last = info.sequence;
      ovt_read_tracks(reader, info.stamp_ns + 50 * kMs, &tracks);
    }
  });
  for (int64_t k = 0; k < 50; ++k) ovt_advance(bench.detector, k * 300 * kMs);
  for (std::thread& thread : threads) thread.join();
  bench.flush();
  const ovt_stats stats = bench.stats();
  CHECK(backwards == 0);
  CHECK(stats.pushed == 3 * (kScans + kScans / 50));
  CHECK(stats.dup == 3 * kScans / 50);
  CHECK(adds_up(stats));
  CHECK(stats.used > 0);
  CHECK(stats.exceptions == 0);
  ovt_destroy_reader(reader);
}

TEST_CASE("detector: advance closes a frame that waits for a sensor, and predicts the tracks if no sensor sends") {
  for (const int32_t workers : {1, 2}) {
    DetectorBench bench({.workers = workers});
    bench.create();
    for (std::size_t k = 0; k < 3; ++k) bench.push_frame(k);
    bench.push_frame(3, {0, 1});
    REQUIRE(ovt_advance(bench.detector, 224 * kMs) == OVT_OK);
    REQUIRE(ovt_advance(bench.detector, 225 * kMs) == OVT_OK);  // 75 ms after its first stamp
    REQUIRE(ovt_advance(bench.detector, 300 * kMs) == OVT_OK);
    bench.flush();
    REQUIRE(bench.records.size() == 5);
    CHECK(bench.records[3].info.sensor_mask == 3);
    CHECK(bench.records[4].info.sensor_mask == 0);
    CHECK(bench.records[4].info.stamp_ns == 300 * kMs);
    CHECK(bench.records[4].info.track_count == bench.records[3].info.track_count);
    CHECK((bench.records[3].info.flags & OVT_FLAG_PREDICTION) == 0);
    CHECK((bench.records[4].info.flags & OVT_FLAG_PREDICTION) != 0);
    CHECK((bench.records[4].info.flags & OVT_FLAG_NO_DATA) != 0);
  }
}

TEST_CASE("detector: point labels lead to clusters with the counts and bounds of their points") {
  const Posts posts(5);
  const ovt_points points = posts.points(7 * kMs);
  Small small;
  small.create();
  REQUIRE(ovt_push_scan(small.detector, &points) == OVT_OK);
  ovt_reader* reader = nullptr;
  ovt_labels labels;
  ovt_clusters clusters;
  REQUIRE(ovt_create_reader(small.detector, &reader) == OVT_OK);
  CHECK(ovt_read_clusters(reader, &clusters) == OVT_NO_FRAME);
  REQUIRE(ovt_next_frame(reader, nullptr) == OVT_OK);
  REQUIRE(ovt_read_labels(reader, 0, &labels) == OVT_OK);
  REQUIRE(ovt_read_clusters(reader, &clusters) == OVT_OK);
  CHECK(ovt_read_clusters(reader, nullptr) == OVT_BAD_ARGUMENT);
  REQUIRE(clusters.count == 5);
  for (int32_t c = 0; c < clusters.count; ++c) {
    int32_t count = 0;
    float low_x = 1e9f, high_z = -1e9f;
    for (int32_t i = 0; i < labels.count; ++i) {
      if (labels.label[i] < 1 || labels.cluster_of_label[labels.label[i]] != c) continue;
      ++count;
      low_x = std::min(low_x, labels.x_m[i]);
      high_z = std::max(high_z, labels.z_m[i]);
    }
    CHECK(count > 0);
    CHECK(clusters.point_count[c] == count);
    CHECK(clusters.min_x_m[c] == low_x);
    CHECK(clusters.max_z_m[c] == high_z);
    CHECK(clusters.stamp_ns[c] == 7 * kMs);
    CHECK(clusters.sensor_mask[c] == 1);
  }
  ovt_destroy_reader(reader);
}
