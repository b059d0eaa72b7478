// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ego poses: which ones a frame may use, and the pose between and beyond them in closed form.
#include "pipeline/ego_buffer.h"

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

using namespace overtake;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int64_t kMs = 1'000'000;
constexpr int64_t kToday = 1'700'000'000'000'000'000;  // a current stamp needs more digits than a double has

EgoWindow window_of(std::initializer_list<EgoPose> poses) {
  EgoWindow window;
  for (const EgoPose& pose : poses) window.poses[window.count++] = pose;
  return window;
}

EgoPose pose_at(int64_t stamp_ns, double x = 0, double y = 0, double yaw = 0, double speed = 0, double rate = 0) {
  return {stamp_ns, x, y, 0, 0, 0, yaw, speed, rate};
}

}  // namespace

TEST_CASE("ego_buffer: between two poses every value is interpolated linearly") {
  EgoPose a = pose_at(kToday, 10, 20, 0.1, 60, 0.2), b = pose_at(kToday + 10 * kMs, 12, 16, 0.3, 70, 0.4);
  a.z_m = 1, b.z_m = 2, a.roll_rad = -0.1, b.roll_rad = 0.1, a.pitch_rad = 0.02, b.pitch_rad = 0.04;
  const EgoWindow window = window_of({a, b});
  EgoState state;
  for (const double u : {0.0, 0.1, 0.25, 0.5, 0.9}) {
    CAPTURE(u);
    REQUIRE(window.at(kToday + int64_t(u * 10 * kMs), state));
    CHECK(state.pose.x_m == doctest::Approx(10 + 2 * u).epsilon(1e-12));
    CHECK(state.pose.y_m == doctest::Approx(20 - 4 * u).epsilon(1e-12));
    CHECK(state.pose.z_m == doctest::Approx(1 + u).epsilon(1e-12));
    CHECK(state.pose.roll_rad == doctest::Approx(-0.1 + 0.2 * u).epsilon(1e-12));
    CHECK(state.pose.pitch_rad == doctest::Approx(0.02 + 0.02 * u).epsilon(1e-12));
    CHECK(state.pose.yaw_rad == doctest::Approx(0.1 + 0.2 * u).epsilon(1e-12));
    CHECK(state.pose.speed_mps == doctest::Approx(60 + 10 * u).epsilon(1e-12));
    CHECK(state.pose.yaw_rate_rps == doctest::Approx(0.2 + 0.2 * u).epsilon(1e-12));
    CHECK(state.age_ns == std::min(state.pose.stamp_ns - kToday, kToday + 10 * kMs - state.pose.stamp_ns));
  }
}

TEST_CASE("ego_buffer: between two poses far apart the age is that of the nearer one, then the pose is unknown") {
  EgoState state;
  const EgoWindow hole = window_of({pose_at(0), pose_at(900 * kMs, 90)});
  REQUIRE(hole.at(300 * kMs, state));
  CHECK(state.pose.x_m == doctest::Approx(30));
  CHECK(state.age_ns == 300 * kMs);
  REQUIRE(hole.at(860 * kMs, state));
  CHECK(state.age_ns == 40 * kMs);
  const EgoWindow gap = window_of({pose_at(0), pose_at(1200 * kMs, 90)});
  CHECK(gap.at(500 * kMs, state));
  CHECK_FALSE(gap.at(501 * kMs, state));
  CHECK_FALSE(gap.at(699 * kMs, state));
  CHECK(gap.at(700 * kMs, state));
}

TEST_CASE("ego_buffer: the yaw is interpolated along the shorter way") {
  EgoState state;
  REQUIRE(window_of({pose_at(0, 0, 0, 3.1), pose_at(10 * kMs, 0, 0, -3.1)}).at(5 * kMs, state));
  CHECK(std::fabs(state.pose.yaw_rad) == doctest::Approx(kPi));
  REQUIRE(window_of({pose_at(0, 0, 0, -3.1), pose_at(10 * kMs, 0, 0, 3.1)}).at(2 * kMs + kMs / 2, state));
  CHECK(state.pose.yaw_rad == doctest::Approx(-3.1 - 0.25 * (2 * kPi - 6.2)));
}

TEST_CASE("ego_buffer: beyond the newest pose the car continues on its circle, and the age is reported") {
  const double speed = 77, rate = 0.3, yaw = 0.5;
  const EgoWindow window = window_of({pose_at(kToday, 100, 50, yaw, speed, rate)});
  EgoState state;
  for (const int64_t ms : {0, 20, 100, 500}) {
    CAPTURE(ms);
    const double t = double(ms) * 1e-3, radius = speed / rate;
    REQUIRE(window.at(kToday + ms * kMs, state));
    CHECK(state.pose.x_m == doctest::Approx(100 + radius * (std::sin(yaw + rate * t) - std::sin(yaw))).epsilon(1e-9));
    CHECK(state.pose.y_m == doctest::Approx(50 - radius * (std::cos(yaw + rate * t) - std::cos(yaw))).epsilon(1e-9));
    CHECK(state.pose.yaw_rad == doctest::Approx(yaw + rate * t).epsilon(1e-12));
    CHECK(state.age_ns == ms * kMs);
  }
  CHECK_FALSE(window.at(kToday + 500 * kMs + 1, state));
}

TEST_CASE("ego_buffer: before the oldest pose the car came along its circle, with the age of the distance in time") {
  const EgoWindow window = window_of({pose_at(kToday, 10, 0, 0, 50), pose_at(kToday + 10 * kMs, 10.5, 0, 0, 50)});
  EgoState state;
  REQUIRE(window.at(kToday - 200 * kMs, state));
  CHECK(state.pose.x_m == doctest::Approx(0.0));
  CHECK(state.age_ns == 200 * kMs);
  CHECK_FALSE(window.at(kToday - 500 * kMs - 1, state));
}

TEST_CASE("ego_buffer: without a pose there is no result") {
  EgoState state;
  CHECK_FALSE(EgoWindow().at(0, state));
}

TEST_CASE("ego_buffer: stamps at both ends of int64 do not overflow") {
  EgoState state;
  const EgoWindow window = window_of({pose_at(INT64_MIN, 0), pose_at(INT64_MAX, 100)});
  CHECK_FALSE(window.at(0, state));
  REQUIRE(window.at(INT64_MAX, state));
  CHECK(state.pose.x_m == doctest::Approx(100));
  REQUIRE(window.at(INT64_MIN, state));
  CHECK(state.pose.x_m == doctest::Approx(0));
  CHECK_FALSE(window_of({pose_at(INT64_MIN)}).at(INT64_MAX, state));
  CHECK_FALSE(window_of({pose_at(INT64_MAX)}).at(INT64_MIN, state));

  EgoBuffer buffer(16);
  CHECK(buffer.push(pose_at(INT64_MIN)) == OVT_OK);
  CHECK(buffer.push(pose_at(0)) == OVT_OK);          // waits
  CHECK(buffer.push(pose_at(INT64_MAX)) == OVT_OK);  // waits instead of the first
  CHECK(buffer.take_dropped() == 1);
  CHECK(buffer.push(pose_at(INT64_MIN + 10 * kMs)) == OVT_OK);
  CHECK(buffer.take_dropped() == 1);
  EgoWindow out;
  buffer.copy_window({0, 2}, INT64_MIN, INT64_MAX, out);
  CHECK(out.count == 2);
  buffer.copy_window({0, 2}, INT64_MAX, INT64_MAX, out);
  REQUIRE(out.count == 1);
  CHECK(out.poses[0].stamp_ns == INT64_MIN + 10 * kMs);
}

TEST_CASE("ego_buffer: headings are transformed to the map and back with roll and pitch") {
  EgoWindow window = window_of({pose_at(0, 1, 2, 0.7)});
  window.poses[0].roll_rad = 0.15;
  window.poses[0].pitch_rad = -0.05;
  EgoState state;
  REQUIRE(window.at(0, state));
  double x, y;
  state.to_map(3, 0, 0, x, y);
  CHECK(std::atan2(y - 2, x - 1) == doctest::Approx(0.7));
  CHECK(state.heading_to_map(0) == doctest::Approx(0.7));
  for (const double heading : {-2.0, -0.3, 0.0, 0.4, 1.9})  // a banked road bends headings by about a percent
    CHECK(state.heading_to_vehicle(state.heading_to_map(heading)) == doctest::Approx(heading).epsilon(1e-12));
  window.poses[0].roll_rad = window.poses[0].pitch_rad = 0;
  REQUIRE(window.at(0, state));
  CHECK(state.heading_to_vehicle(state.heading_to_map(-2.0)) == doctest::Approx(-2.0).epsilon(1e-12));
}

TEST_CASE("ego_buffer: stamps must grow") {
  EgoBuffer buffer(16);
  CHECK(buffer.push(pose_at(10)) == OVT_OK);
  CHECK(buffer.push(pose_at(10)) == OVT_DUPLICATE);
  CHECK(buffer.push(pose_at(9)) == OVT_LATE);
  CHECK(buffer.range().count == 1);
}

TEST_CASE("ego_buffer: a frame sees the poses around it that were pushed before it, and no others") {
  EgoBuffer buffer(1024);
  for (int64_t i = 0; i < 100; ++i) REQUIRE(buffer.push(pose_at(i * 10 * kMs, double(i))) == OVT_OK);
  EgoWindow window;
  buffer.copy_window({0, 60}, 500 * kMs, 500 * kMs, window);
  REQUIRE(window.count > 0);
  CHECK(window.poses[0].stamp_ns == 400 * kMs);                 // 100 ms before the frame
  CHECK(window.poses[window.count - 1].stamp_ns == 590 * kMs);  // the 60th pose: later ones came after the scan
  buffer.copy_window({0, 100}, 500 * kMs, 550 * kMs, window);
  CHECK(window.poses[window.count - 1].stamp_ns == 660 * kMs);
  buffer.copy_window({0, 0}, 500 * kMs, 500 * kMs, window);
  CHECK(window.count == 0);
}

TEST_CASE("ego_buffer: a full ring keeps the newest poses, and hides overwritten ones") {
  EgoBuffer buffer(512);
  for (int64_t i = 0; i < 5000; ++i) REQUIRE(buffer.push(pose_at(i * kMs, double(i))) == OVT_OK);
  EgoWindow window;
  buffer.copy_window({0, 5000}, 4900 * kMs, 4950 * kMs, window);
  REQUIRE(window.count > 0);
  for (int32_t i = 0; i < window.count; ++i) CHECK(window.poses[i].x_m == double(window.poses[i].stamp_ns / kMs));
  CHECK(window.poses[window.count - 1].stamp_ns == 4999 * kMs);
  buffer.copy_window({0, 1000}, 900 * kMs, 950 * kMs, window);  // overwritten long ago
  CHECK(window.count == 0);
}

TEST_CASE("ego_buffer: of too many poses in reach the newest are used") {
  EgoBuffer buffer(4096);
  for (int64_t i = 0; i < 3000; ++i) REQUIRE(buffer.push(pose_at(i * 100'000)) == OVT_OK);  // 10 kHz
  EgoWindow window;
  buffer.copy_window({0, 3000}, 150 * kMs, 150 * kMs, window);
  REQUIRE(window.count == EgoWindow::kCapacity);
  CHECK(window.poses[255].stamp_ns > 250 * kMs);
}

TEST_CASE("ego_buffer: three increasing stamps that are much older are a clock that went back") {
  EgoBuffer buffer(16);
  for (int64_t k = 0; k < 5; ++k) REQUIRE(buffer.push(pose_at(kToday + k * 10 * kMs, 1000)) == OVT_OK);
  const int64_t back = kToday - 3600 * 1000 * kMs;
  CHECK(buffer.push(pose_at(kToday - 100 * kMs)) == OVT_LATE);  // late, and no sign of another clock
  CHECK(buffer.push(pose_at(back)) == OVT_LATE);
  CHECK(buffer.push(pose_at(back + 10 * kMs)) == OVT_LATE);
  CHECK(buffer.push(pose_at(back + 5 * kMs)) == OVT_LATE);  // does not grow: the count restarts
  CHECK(buffer.push(pose_at(back + 15 * kMs)) == OVT_LATE);
  CHECK(buffer.push(pose_at(back + 25 * kMs, 7)) == OVT_OK);
  const EgoRange range = buffer.range();
  CHECK(range.first == 5);
  CHECK(range.count == 6);
  EgoWindow window;
  buffer.copy_window(range, back, back + 25 * kMs, window);
  REQUIRE(window.count == 1);
  CHECK(window.poses[0].x_m == 7);
  buffer.copy_window({0, 5}, kToday, kToday, window);  // an earlier frame still sees its own poses
  CHECK(window.count == 5);
}

TEST_CASE("ego_buffer: a good stamp between two much older ones does not change the clock") {
  EgoBuffer buffer(16);
  REQUIRE(buffer.push(pose_at(kToday)) == OVT_OK);
  for (int64_t k = 1; k < 10; ++k) {
    CHECK(buffer.push(pose_at(k * kMs)) == OVT_LATE);
    CHECK(buffer.push(pose_at((100 + k) * kMs)) == OVT_LATE);
    CHECK(buffer.push(pose_at(kToday + k * kMs)) == OVT_OK);
  }
  CHECK(buffer.range().first == 0);
}

TEST_CASE("ego_buffer: one pose ahead costs no good pose, at any rate") {
  for (const int64_t interval_ns : {kMs, 10 * kMs, 100 * kMs})
    for (const int64_t ahead_ms : {450, 2000}) {
      CAPTURE(interval_ns);
      CAPTURE(ahead_ms);
      EgoBuffer buffer(1024);
      for (int64_t k = 0; k < 20; ++k) {
        if (k == 8) CHECK(buffer.push(pose_at(kToday + k * interval_ns + ahead_ms * kMs)) == OVT_OK);
        CHECK(buffer.push(pose_at(kToday + k * interval_ns)) == OVT_OK);
        CHECK(buffer.take_dropped() == (k == 8 ? 1 : 0));
      }
      CHECK(buffer.range().count == 20);
      CHECK(buffer.range().refused == 1);
      for (int64_t i = 0; i < 20; ++i) CHECK(buffer.stamp_at(i) == kToday + i * interval_ns);
    }
}

TEST_CASE("ego_buffer: after a pause the second pose confirms the first, and both begin a run") {
  EgoBuffer buffer(64);
  for (int64_t k = 0; k < 5; ++k) REQUIRE(buffer.push(pose_at(kToday + k * 10 * kMs)) == OVT_OK);
  REQUIRE(buffer.push(pose_at(kToday + 800 * kMs)) == OVT_OK);
  CHECK(buffer.range().count == 5);  // it waits
  REQUIRE(buffer.push(pose_at(kToday + 810 * kMs)) == OVT_OK);
  CHECK(buffer.range().count == 7);
  CHECK(buffer.take_dropped() == 0);
  CHECK(buffer.range().refused == 0);
  CHECK(buffer.run_at(4) == 0);
  CHECK(buffer.run_at(5) == 5);
  CHECK(buffer.run_at(6) == 5);
  CHECK(buffer.first_run_after(buffer.range(), 0) == 5);
  CHECK(buffer.first_run_after(buffer.range(), 5) == 7);
}

TEST_CASE("ego_buffer: a slow source works") {
  EgoBuffer buffer(64);
  for (int64_t k = 0; k < 20; ++k) REQUIRE(buffer.push(pose_at(kToday + k * 400 * kMs)) == OVT_OK);
  CHECK(buffer.range().count == 20);
  CHECK(buffer.range().refused == 0);
}

TEST_CASE("ego_buffer: a wrong first pose is dropped after three consistent ones") {
  EgoBuffer buffer(64);
  REQUIRE(buffer.push(pose_at(kToday + 450 * kMs)) == OVT_OK);
  CHECK(buffer.push(pose_at(kToday)) == OVT_LATE);
  CHECK(buffer.push(pose_at(kToday + 10 * kMs)) == OVT_LATE);
  for (int64_t k = 2; k < 60; ++k) CHECK(buffer.push(pose_at(kToday + k * 10 * kMs)) == OVT_OK);
  CHECK(buffer.range().first == 1);
  CHECK(buffer.range().count == 59);
}

TEST_CASE("ego: a pose that the producer may be overwriting is not read") {
  EgoBuffer buffer(512);
  for (int64_t i = 0; i < 5000; ++i) REQUIRE(buffer.push(pose_at(i * kMs, double(i))) == OVT_OK);
  EgoPose pose;
  CHECK(buffer.read(4999, pose));
  CHECK(pose.x_m == 4999);
  CHECK(buffer.read(5000 - 511, pose));
  CHECK(pose.x_m == 5000 - 511);
  CHECK_FALSE(buffer.read(5000 - 512, pose));  // the next pose takes its place
}

TEST_CASE("ego: windows contain whole poses in order, however fast the producer is") {
  EgoBuffer buffer(1024);
  std::atomic<bool> stop{false};
  std::thread producer([&] {
    for (int64_t i = 0; !stop.load(std::memory_order_relaxed); ++i) {
      EgoPose pose = pose_at(i * kMs, double(i), double(i));
      pose.z_m = pose.speed_mps = double(i);
      buffer.push(pose);
    }
  });
  EgoWindow window;
  int64_t wrong = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(300);
  while (std::chrono::steady_clock::now() < end) {
    const EgoRange range = buffer.range();
    const int64_t at_ns = (range.count - 650) * kMs;  // near the oldest that are safe
    buffer.copy_window(range, at_ns, at_ns, window);
    for (int32_t k = 0; k < window.count; ++k) {
      const EgoPose& p = window.poses[k];
      const bool whole = p.x_m == p.y_m && p.x_m == p.z_m && p.x_m == p.speed_mps && p.x_m * 1e6 == double(p.stamp_ns);
      wrong += !whole || (k > 0 && p.stamp_ns <= window.poses[k - 1].stamp_ns);
    }
  }
  stop.store(true);
  producer.join();
  CHECK(wrong == 0);
}

TEST_CASE("ego: in a replay the oldest pose that is used does not depend on how far the producer is") {
  EgoBuffer buffer(512);
  for (int64_t i = 0; i < 700; ++i) REQUIRE(buffer.push(pose_at(i * kMs, double(i))) == OVT_OK);
  const EgoRange range{0, 600};
  CHECK(buffer.oldest_safe(range) == 700 - 512 + 128);
  buffer.set_horizon(600);  // when the scan was pushed
  CHECK(buffer.oldest_safe(range) == 600 - 512 + 128);
}
