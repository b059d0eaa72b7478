// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses whose stamps or arrival were wrong for a while, through the C API: they are used again as soon as their
// stamps are right. test_clock.cpp tests that wrong ones are refused.
#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tests/support/detector_bench.h"

using namespace overtake::test;

namespace {

constexpr int64_t kMs = 1'000'000, kStartNs = 1'000'000 * kMs;
constexpr int64_t kPoseMs = 10, kScanMs = 50;

// A drive of one car, in milliseconds from its start. A span [from, to) of 0, 0 is empty.
struct Drive {
  int64_t end = 8'000;
  int64_t scan_latency = 20;
  struct Span {
    int64_t from = 0, to = 0, by = 0;
    int64_t at(int64_t t) const { return t >= from && t < to ? by : 0; }
  };
  Span scans_later = {}, poses_later = {};  // they arrive later by this
  Span poses_older = {};                    // their stamps are too old
  Span poses_ahead = {};                    // their clock is ahead
  Span poses_lost = {};                     // `by` is 1
  int32_t sensors = 1;
  Span pause = {};  // without scans, the last one before it by the first sensor only; `by` is 1
};

struct Frames {
  std::vector<int64_t> at;  // ms
  std::vector<ovt_frame_info> info;
  // Frames from t on without an ego pose, or with suspect poses.
  int32_t without_ego(int64_t t) const {
    int32_t count = 0;
    for (std::size_t i = 0; i < at.size(); ++i) count += at[i] >= t && info[i].ego_known == 0;
    return count;
  }
  int32_t suspect(int64_t t) const {
    int32_t count = 0;
    for (std::size_t i = 0; i < at.size(); ++i) count += at[i] >= t && (info[i].suspect_mask & OVT_SUSPECT_EGO) != 0;
    return count;
  }
};

Frames drive(const Drive& d) {
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.rows = 4, sensor.cols = 8;
  sensor.point_capacity = 32;
  const std::vector<ovt_sensor_def> sensors(std::size_t(d.sensors), sensor);
  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = sensors.data();
  def.sensor_count = d.sensors;
  def.push_policy = OVT_PUSH_WAIT;
  ovt_detector* detector = nullptr;
  ovt_reader* reader = nullptr;
  REQUIRE(ovt_create_detector(&def, &detector) == OVT_OK);
  REQUIRE(ovt_create_reader(detector, &reader) == OVT_OK);
  const std::vector<float> x(8, 20.0f), y = {-2, -1.5, -1, -0.5, 0.5, 1, 1.5, 2}, z(8, 0.5f);
  const std::vector<uint8_t> layer(8, 1);
  Frames frames;
  int64_t pose = 0, scan = 0;
  for (int64_t now = 0; now < d.end; ++now) {
    for (; pose + d.poses_later.at(pose) <= now; pose += kPoseMs) {
      if (d.poses_lost.at(pose) != 0) continue;
      ovt_ego_pose p;
      ovt_ego_pose_init(&p, sizeof p);
      p.stamp_ns = kStartNs + (pose - d.poses_older.at(pose) + d.poses_ahead.at(pose)) * kMs;
      p.x_m = 0.05 * double(pose);
      p.speed_mps = 50;
      ovt_push_ego_pose(detector, &p);
    }
    for (; scan + d.scan_latency + d.scans_later.at(scan) <= now; scan += kScanMs) {
      ovt_points p = ovt_default_points();
      p.count = int32_t(x.size());
      p.stamp_ns = kStartNs + scan * kMs;
      p.x = column_of(x, OVT_F32);
      p.y = column_of(y, OVT_F32);
      p.z = column_of(z, OVT_F32);
      p.layer = column_of(layer, OVT_U8);
      for (int32_t s = 0; s < d.sensors; ++s) {
        if (d.pause.at(scan) != 0 || (s > 0 && d.pause.at(scan + kScanMs) != 0)) continue;
        p.sensor = s;
        REQUIRE(ovt_push_scan(detector, &p) == OVT_OK);
      }
      ovt_frame_info info;
      while (ovt_next_frame(reader, &info) == OVT_OK) {
        frames.at.push_back((info.stamp_ns - kStartNs) / kMs);
        frames.info.push_back(info);
      }
    }
  }
  ovt_destroy_reader(reader);
  ovt_destroy_detector(detector);
  REQUIRE(frames.at.size() > 100);
  return frames;
}

}  // namespace

TEST_CASE("ego clock: poses that were too old at the start cost the good ones nothing") {
  for (const int64_t latency : {0, 20, 95})  // of scans: how far good poses are ahead of them
    for (const int64_t by : {60, 120, 200, 5'000})
      for (const int64_t until : {10, 100, 500, 1'500}) {
        // After the watch has learned, this is no different from good poses whose clock steps ahead.
        if (latency == 95 && by == 120 && until == 1'500) continue;
        CAPTURE(latency);
        CAPTURE(by);
        CAPTURE(until);
        const Frames frames = drive({.end = 6'000, .scan_latency = latency, .poses_older = {0, until, by}});
        // Scans that are pushed late make good poses look ahead; then it takes 16 frames and some.
        CHECK(frames.without_ego(until + (latency > 75 ? 1'100 : 150)) == 0);
        CHECK(frames.suspect(until + 1'500) == 0);
      }
}

TEST_CASE("ego clock: poses that arrive late at the start are used when they come in time") {
  for (const int64_t by : {100, 200})
    for (const int64_t lost_at : {0, 2'000, 4'000}) {
      CAPTURE(by);
      CAPTURE(lost_at);
      const Frames frames = drive({.poses_later = {0, 2'000, by}, .poses_lost = {lost_at, lost_at + 60, 1}});
      CHECK(frames.without_ego(2'000 + by) == 0);
    }
}

TEST_CASE("ego clock: scans that come later are no step of the ego clock, also when poses are lost") {
  for (const int64_t lost_ms : {0, 40, 110, 300, 460}) {
    CAPTURE(lost_ms);
    const Frames frames =
        drive({.end = 14'000, .scans_later = {3'000, 10'000, 100}, .poses_lost = {4'000, 4'000 + lost_ms, 1}});
    CHECK(frames.without_ego(200) == 0);
    CHECK(frames.suspect(200) > 100);  // one of the two clocks does not fit
    CHECK(frames.suspect(11'000) == 0);
  }
  // Together: the poses lost are fewer than what the scans are later, so no step explains it.
  for (const int64_t lost_ms : {40, 110, 200}) {
    CAPTURE(lost_ms);
    const Frames frames =
        drive({.scans_later = {4'000, 8'000, lost_ms + 200}, .poses_lost = {4'000, 4'000 + lost_ms, 1}});
    CHECK(frames.without_ego(200) == 0);
  }
}

TEST_CASE("ego clock: a clock that steps ahead later is not believed, also after a while") {
  const Drive starts[] = {{},
                          {.poses_later = {0, 1'500, 200}},
                          {.poses_older = {0, 10, 5'000}, .poses_lost = {10, 1'500, 1}},
                          {.poses_older = {0, 200, 5'000}}};
  for (Drive with_step : starts)
    for (const int64_t by : {100, 200, 450}) {
      CAPTURE(by);
      CAPTURE(&with_step - starts);
      with_step.end = 12'000;
      with_step.poses_ahead = {3'000, 9'000, by};
      const Frames frames = drive(with_step);
      CHECK(frames.without_ego(3'600) >= 100);  // from 0.5 s after the step, to its end
      CHECK(frames.without_ego(9'700) == 0);
      for (std::size_t i = 0; i < frames.at.size(); ++i)
        if (frames.at[i] > 3'100 && frames.at[i] < 8'900) {
          CHECK((frames.info[i].suspect_mask & OVT_SUSPECT_EGO) != 0);
          if (frames.info[i].ego_known) CHECK(frames.info[i].ego_x_m == doctest::Approx(0.05 * double(frames.at[i])));
        }
    }
}

TEST_CASE("ego clock: the frame that is open when all sensors pause does not make good poses suspect") {
  for (const int64_t pause_ms : {300, 600, 800, 1'500}) {
    CAPTURE(pause_ms);
    const Frames frames = drive({.sensors = 2, .pause = {3'000, 3'000 + pause_ms, 1}});
    CHECK(frames.suspect(0) == 0);
    CHECK(frames.without_ego(200) == 0);
  }
}
