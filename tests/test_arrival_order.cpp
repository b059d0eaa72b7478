// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The same used scans in the same frames give the same bytes, in any order of arrival and with any number of workers. A
// sensor that stops and returns does not change the detections of the others.
#include <doctest/doctest.h>

#include <algorithm>
#include <barrier>
#include <cmath>
#include <map>
#include <random>
#include <thread>

#include "tests/support/circle_road.h"
#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int32_t kWorkers[] = {1, 2, 3, 4, 8};
constexpr int32_t kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

// Every eighth point: the test compares orders, not clouds.
const std::vector<std::array<overtake::SceneScan, 3>>& thin_frames() {
  static const auto frames = [] {
    std::vector<std::array<overtake::SceneScan, 3>> all(12);
    for (std::size_t k = 0; k < all.size(); ++k)
      for (std::size_t s = 0; s < 3; ++s) {
        const overtake::SceneScan& whole = demo_frame(k).scan[s];
        overtake::SceneScan& thin = all[k][s];
        for (std::size_t i = 0; i < whole.x_m.size(); i += 8) {
          thin.add_point(whole, i);
        }
      }
    return all;
  }();
  return frames;
}

struct Push {
  std::size_t frame;
  int32_t sensor;
};

// Stamps of the three sensors within a frame differ by up to the tolerance; the first sensor changes from frame to
// frame.
int64_t stamp_of(const Push& push) {
  constexpr int64_t kPhase[3] = {0, 11 * kMs, 24 * kMs};
  return 1000 * kMs + int64_t(push.frame) * 50 * kMs + kPhase[(std::size_t(push.sensor) + push.frame) % 3];
}

struct Thin : DetectorBench {
  explicit Thin(int32_t workers) : DetectorBench({.workers = workers}) {
    for (ovt_sensor_def& sensor : sensors) sensor.cols = 107;
    create();
  }
  void push_one(const Push& p) {
    const ovt_points points = points_of(thin_frames()[p.frame][std::size_t(p.sensor)], p.sensor, stamp_of(p));
    REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
  }
  // Poses of the whole frame, before its first scan.
  void push_poses(std::size_t frame) {
    for (int64_t t = 0; t < 50; t += 10) {
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.stamp_ns = 1000 * kMs + (int64_t(frame) * 50 + t) * kMs;
      const overtake::ScenePose p = demo_scene().ego_at(double(pose.stamp_ns - 1000 * kMs) * 1e-9);
      pose.x_m = p.x_m, pose.y_m = p.y_m, pose.z_m = p.z_m;
      pose.roll_rad = p.roll_rad, pose.pitch_rad = p.pitch_rad, pose.yaw_rad = p.yaw_rad;
      pose.speed_mps = p.speed_mps, pose.yaw_rate_rps = p.yaw_rate_rps;
      REQUIRE(ovt_push_ego_pose(detector, &pose) == OVT_OK);
    }
  }
};

// Frames 0 to frame_count - 1, all sensors in the order of `orders`, one order per frame.
std::vector<FrameRecord> run_orders(int32_t workers, std::size_t frame_count, const std::vector<int32_t>& orders) {
  Thin bench(workers);
  for (std::size_t k = 0; k < frame_count; ++k) {
    bench.push_poses(k);
    for (const int32_t s : kOrders[orders[k % orders.size()]]) bench.push_one({k, s});
  }
  bench.flush();
  CHECK(bench.stats().used == int64_t(3 * frame_count));
  CHECK(adds_up(bench.stats()));
  return bench.records;
}

// The sensors of `subset` send nothing in frames first to last; else their scans come before, or after, the others'.
std::vector<FrameRecord> run_alive(int32_t workers, std::size_t frame_count, uint32_t subset, std::size_t first,
                                   std::size_t last, bool before = true) {
  Thin bench(workers);
  for (std::size_t k = 0; k < frame_count; ++k) {
    bench.push_poses(k);
    for (const bool turn : {before, !before})
      for (int32_t s = 0; s < 3; ++s)
        if (bool(subset >> s & 1u) == turn && (!turn || k < first || k > last)) bench.push_one({k, s});
  }
  bench.flush();
  CHECK(adds_up(bench.stats()));
  CHECK(bench.stats().used == bench.stats().pushed);
  return bench.records;
}

// The frame of a record, from its time, which records with any subset of sensors have in common.
std::size_t frame_of(const FrameRecord& record) {
  return std::size_t((record.info.stamp_ns - 1000 * kMs) / (50 * kMs));
}

}  // namespace

TEST_CASE("arrival: any order of three sensors' scans and any number of workers give the same bytes") {
  constexpr std::size_t kFrames = 4;
  const std::vector<FrameRecord> expected = run_orders(1, kFrames, {0});
  REQUIRE(expected.size() == kFrames);
  int32_t detections = 0;
  for (const FrameRecord& record : expected) {
    CHECK(record.info.sensor_mask == 7);
    CHECK(record.info.stamp_ns - record.info.first_stamp_ns == 24 * kMs);
    detections += record.info.detection_count;
  }
  CHECK(detections > 0);
  for (const int32_t workers : kWorkers)
    for (int32_t order = 0; order < 6; ++order) {
      CAPTURE(workers);
      CAPTURE(order);
      CHECK(run_orders(workers, kFrames, {order}) == expected);
    }
}

TEST_CASE("arrival: another order in every frame, with interleaved frames, gives the same bytes") {
  constexpr std::size_t kFrames = 6;
  const std::vector<FrameRecord> expected = run_orders(1, kFrames, {0});
  std::mt19937 random(3);
  for (const int32_t workers : kWorkers)
    for (int32_t repeat = 0; repeat < 3; ++repeat) {
      std::vector<int32_t> orders(kFrames);
      for (int32_t& order : orders) order = int32_t(random() % 6);
      CAPTURE(workers);
      CAPTURE(repeat);
      CHECK(run_orders(workers, kFrames, orders) == expected);
    }
}

TEST_CASE("arrival: three threads that push at the same time give the same bytes") {
  constexpr std::size_t kFrames = 8;
  const std::vector<FrameRecord> expected = run_orders(1, kFrames, {0});
  for (const int32_t workers : {2, 3, 4, 8}) {
    CAPTURE(workers);
    Thin bench(workers);
    bench.push_poses(0);
    // All scans of a frame before any of the next: the scheduler decides the order within the frame.
    std::size_t next = 0;
    const auto poses = [&]() noexcept {
      if (++next < kFrames) bench.push_poses(next);
    };
    std::barrier meet(3, poses);
    std::vector<std::thread> threads;
    for (int32_t s = 0; s < 3; ++s)
      threads.emplace_back([&, s] {
        for (std::size_t k = 0; k < kFrames; ++k) {
          bench.push_one({k, s});
          meet.arrive_and_wait();
        }
      });
    for (std::thread& thread : threads) thread.join();
    bench.flush();
    CHECK(bench.records == expected);
  }
}

namespace {

// Three laps on a small circuit with hills and banking, 3 s each; the clouds of the demo scene repeat.
struct Laps : DetectorBench {
  static constexpr std::size_t kFrames = 180;
  static constexpr double kSpeed_mps = 64.0;

  explicit Laps(int32_t workers)
      : DetectorBench({.workers = workers, .record = false}),
        road({.radius_m = 30.0,
              .with_banking = true,
              .height = [](double turn) { return 0.5 * std::sin(turn); },
              .slope = [](double turn) { return 0.1 + 0.05 * std::cos(turn); }}) {
    for (ovt_sensor_def& sensor : sensors) sensor.cols = 107;
    for (double s = 0.0; s < road.length_m() - 1.0; s += 2.0) {
      const overtake::MapPose at = road.map.at(s);
      map_x.push_back(at.x_m), map_y.push_back(at.y_m), map_width.push_back(8.0), map_banking.push_back(at.banking_rad);
    }
    map_def.count = int32_t(map_x.size());
    map_def.x_m = map_x.data(), map_def.y_m = map_y.data(), map_def.banking_rad = map_banking.data();
    map_def.width_left_m = map_def.width_right_m = map_width.data();
    def.on_frame = [](ovt_reader* reader, void* user) { static_cast<Laps*>(user)->record(reader); };
    create();
  }
  void push_one(std::size_t frame, int32_t sensor) {
    const ovt_points points =
        points_of(thin_frames()[frame % 12].at(std::size_t(sensor)), sensor, stamp_of({frame, sensor}));
    REQUIRE(ovt_push_scan(detector, &points) == OVT_OK);
  }
  // Poses of the frame and 0.1 s more, every 10 ms: all that its scans use.
  void push_poses(std::size_t frame) {
    for (; ego_ns < 1000 * kMs + int64_t(frame) * 50 * kMs + 150 * kMs; ego_ns += 10 * kMs) {
      const overtake::EgoPose at = road.pose_at(kSpeed_mps * double(ego_ns - 1000 * kMs) * 1e-9, 1.0);
      ovt_ego_pose pose;
      ovt_ego_pose_init(&pose, sizeof pose);
      pose.stamp_ns = ego_ns;
      pose.x_m = at.x_m, pose.y_m = at.y_m, pose.z_m = at.z_m;
      pose.roll_rad = at.roll_rad, pose.pitch_rad = at.pitch_rad, pose.yaw_rad = at.yaw_rad;
      pose.speed_mps = kSpeed_mps, pose.yaw_rate_rps = kSpeed_mps / 30.0;
      REQUIRE(ovt_push_ego_pose(detector, &pose) == OVT_OK);
    }
  }
  // What the segmentation of each scan gave.
  void record(ovt_reader* reader) {
    for (int32_t s = 0; s < 3; ++s) {
      ovt_labels labels;
      if (ovt_read_labels(reader, s, &labels) != OVT_OK) continue;
      overtake::Hash hash;
      hash.add_bytes(labels.label, std::size_t(labels.count) * sizeof *labels.label);
      hash.add_bytes(labels.reason, std::size_t(labels.count));
      ovt_image image;
      if (ovt_read_image(reader, s, OVT_IMAGE_HEIGHT, &image) == OVT_OK)
        for (int32_t r = 0; r < image.rows; ++r)
          hash.add_bytes(static_cast<const char*>(image.data) + std::size_t(r) * image.stride_bytes,
                         std::size_t(image.cols) * sizeof(float));
      scans[{s, labels.stamp_ns}] = hash.value();
    }
  }

  CircleRoad road;
  std::vector<double> map_x, map_y, map_width, map_banking;
  int64_t ego_ns = 900 * kMs;
  std::map<std::pair<int32_t, int64_t>, uint64_t> scans;
};

// One sensor's scan of every fifth frame, from each sensor in turn, comes `behind` frames late.
std::map<std::pair<int32_t, int64_t>, uint64_t> run_laps(int32_t workers, std::size_t behind, bool mixed) {
  Laps bench(workers);
  const auto late_sensor = [&](std::size_t k) { return behind > 0 && k % 5 == 2 ? int32_t(k / 5 % 3) : -1; };
  for (std::size_t k = 0; k < Laps::kFrames; ++k) {
    bench.push_poses(k);
    for (const int32_t s : kOrders[mixed ? k * 7 % 6 : 0])
      if (s != late_sensor(k)) bench.push_one(k, s);
    if (k >= behind && late_sensor(k - behind) >= 0) bench.push_one(k - behind, late_sensor(k - behind));
  }
  bench.flush();
  CHECK(adds_up(bench.stats()));
  CHECK(bench.stats().used == bench.stats().pushed);
  return bench.scans;
}

}  // namespace

TEST_CASE("arrival: over several laps on a map, a scan's labels and heights do not depend on when scans arrive") {
  const auto expected = run_laps(1, 0, false);
  REQUIRE(expected.size() == 3 * Laps::kFrames);
  for (const int32_t workers : {1, 2})
    for (const std::size_t behind : {0u, 1u, 3u, 8u})
      for (const bool mixed : {false, true}) {
        CAPTURE(workers);
        CAPTURE(behind);
        CAPTURE(mixed);
        std::size_t different = 0;
        for (const auto& [scan, hash] : run_laps(workers, behind, mixed)) different += expected.at(scan) != hash;
        CHECK(different == 0);
      }
}

namespace {

constexpr std::size_t kDeathFrames = 12, kFirstDead = 4, kLastDead = 7;

// Compares every frame except that of the return, in which a scan may come too late to join the others.
void check_death(const std::vector<FrameRecord>& dies, const std::vector<FrameRecord>& never,
                 const std::vector<FrameRecord>& whole, uint32_t subset) {
  uint32_t returned = 0;
  for (const FrameRecord& record : dies) {
    const std::size_t k = frame_of(record);
    CAPTURE(k);
    if (k == kLastDead + 1) {
      returned |= record.info.sensor_mask;
      continue;
    }
    const bool dead = k >= kFirstDead && k <= kLastDead;
    const FrameRecord& same = dead ? never[k] : whole[k];
    CHECK(record.info.sensor_mask == (dead ? 7u & ~subset : 7u));
    CHECK(record.detections == same.detections);
    CHECK(record.labels == same.labels);
    CHECK(record.images == same.images);
    CHECK(((record.info.flags & OVT_FLAG_SENSOR_MISSING) != 0) == dead);
    // Silent for more than 1.5 periods: not in the first missing frame, but in each later one.
    CHECK(((record.info.flags & OVT_FLAG_SENSOR_STALE) != 0) == (dead && k > kFirstDead));
  }
  CHECK(returned == 7u);  // every sensor's first scan is used, also those of returning sensors
}

}  // namespace

TEST_CASE("death: any subset of three sensors that stops and returns leaves the others' detections unchanged") {
  const std::vector<FrameRecord> whole = run_alive(1, kDeathFrames, 0, 0, 0);
  REQUIRE(whole.size() == kDeathFrames);
  for (uint32_t subset = 1; subset < 8; ++subset) {
    const std::vector<FrameRecord> never = run_alive(1, kDeathFrames, subset, 0, kDeathFrames);
    REQUIRE(never.size() == (subset == 7 ? 0 : kDeathFrames));
    for (const int32_t workers : {1, 3}) {
      CAPTURE(workers);
      CAPTURE(subset);
      const std::vector<FrameRecord> dies = run_alive(workers, kDeathFrames, subset, kFirstDead, kLastDead);
      CHECK(dies.size() >= (subset == 7 ? kDeathFrames - (kLastDead - kFirstDead + 1) : kDeathFrames));
      check_death(dies, never, whole, subset);
    }
  }
}

TEST_CASE("death: while every sensor is silent, predictions and pushed detections have the flags") {
  for (const int32_t workers : {1, 2}) {
    CAPTURE(workers);
    Thin bench(workers);
    for (std::size_t k = 0; k < 4; ++k) {
      bench.push_poses(k);
      for (int32_t s = 0; s < 3; ++s) bench.push_one({k, s});
    }
    const int64_t last_ns = 1000 * kMs + 3 * 50 * kMs + 24 * kMs;
    for (int64_t k = 1; k <= 4; ++k) REQUIRE(ovt_advance(bench.detector, last_ns + k * 50 * kMs) == OVT_OK);
    ovt_external_detections radar;
    ovt_external_detections_init(&radar, sizeof radar);
    const double x_m = 30, y_m = 0;
    radar.count = 1, radar.x_m = &x_m, radar.y_m = &y_m, radar.reference = OVT_REFERENCE_MAP;
    radar.stamp_ns = last_ns + 300 * kMs;
    REQUIRE(ovt_push_detections(bench.detector, &radar) == OVT_OK);
    bench.flush();
    REQUIRE(bench.records.size() == 4 + 3 + 1);  // 50 ms after the last scans is too early for a prediction
    for (std::size_t i = 0; i < bench.records.size(); ++i) {
      CAPTURE(i);
      const ovt_frame_info& info = bench.records[i].info;
      const auto says = [&](uint32_t flag) { return (info.flags & flag) != 0; };
      const bool predicted = i >= 4 && i < 7, pushed = i == 7;
      CHECK(says(OVT_FLAG_PREDICTION) == predicted);
      CHECK(says(OVT_FLAG_NO_DATA) == predicted);
      CHECK(says(OVT_FLAG_SENSOR_MISSING) == predicted);
      CHECK(says(OVT_FLAG_SENSOR_STALE) == (predicted || pushed));
      CHECK(info.stale_mask == (predicted || pushed ? 7u : 0u));
      CHECK(says(OVT_FLAG_EXTERNAL) == pushed);
    }
  }
}

TEST_CASE("death: sensors that never sent a scan become stale after enough time") {
  Thin bench(1);
  ovt_external_detections radar;
  ovt_external_detections_init(&radar, sizeof radar);
  for (int64_t k = 0; k < 3; ++k) {
    radar.stamp_ns = 1000 * kMs + k * 50 * kMs;
    REQUIRE(ovt_push_detections(bench.detector, &radar) == OVT_OK);
  }
  for (int32_t s = 0; s < 3; ++s) bench.push_one({3, s});
  bench.flush();
  REQUIRE(bench.records.size() == 4);
  CHECK(bench.records[0].info.stale_mask == 0);
  CHECK(bench.records[1].info.stale_mask == 0);
  CHECK(bench.records[2].info.stale_mask == 7);
  CHECK(bench.records[3].info.stale_mask == 0);
  CHECK(bench.records[3].info.sensor_mask == 7);  // the sensors waited for one another
}

TEST_CASE("death: a returning sensor's scan is used even if it comes after the others of its frame") {
  const std::vector<FrameRecord> whole = run_alive(1, kDeathFrames, 0, 0, 0);
  for (uint32_t subset = 1; subset < 7; ++subset)
    for (const int32_t workers : {1, 3}) {
      CAPTURE(workers);
      CAPTURE(subset);
      const std::vector<FrameRecord> never = run_alive(1, kDeathFrames, subset, 0, kDeathFrames);
      check_death(run_alive(workers, kDeathFrames, subset, kFirstDead, kLastDead, false), never, whole, subset);
    }
}
