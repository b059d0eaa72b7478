// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A vehicle's shape of use, in C++: three sensors, each pushed by its driver's own thread, ego poses by another, tracks
// read by this one, which never waits for the library and is never waited for. Scans arrive at 20 Hz for two seconds.
// Exit code 0 when the car ahead was tracked and the counters add up.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <overtake/overtake.hpp>
#include <span>
#include <thread>
#include <vector>

#include "simulated_scan.h"

namespace {

using Clock = std::chrono::steady_clock;
constexpr int kScans = 40;
constexpr int64_t kPeriodNs = 50'000'000;
constexpr double kEgoSpeed = 60.0, kCarSpeed = 70.0;  // m/s: the car ahead pulls away

Clock::time_point due(Clock::time_point start, int scan) { return start + std::chrono::nanoseconds(scan * kPeriodNs); }

// One thread a sensor: ovt_push_scan copies the points, so the buffer is ours again at once.
void drive_lidar(ovt::Detector& detector, int32_t sensor, double yaw_rad, Clock::time_point start) {
  std::vector<scan_point> points(SCAN_CAPACITY);
  for (int k = 0; k < kScans; ++k) {
    const double car_ahead_m = 20.0 + (kCarSpeed - kEgoSpeed) * 0.05 * k;
    const auto count = std::size_t(simulate_scan(points.data(), yaw_rad, car_ahead_m, 0.0));
    const auto seen = std::span(points).first(count);
    ovt_points scan = ovt::scan(sensor, k * kPeriodNs, count);
    scan.x = ovt::column(seen, &scan_point::x);
    scan.y = ovt::column(seen, &scan_point::y);
    scan.z = ovt::column(seen, &scan_point::z);
    scan.layer = ovt::column(seen, &scan_point::layer);
    scan.intensity = ovt::column(seen, &scan_point::intensity);
    std::this_thread::sleep_until(due(start, k));
    if (const ovt_status status = detector.push(scan); status != OVT_OK)
      std::fprintf(stderr, "sensor %d, scan %d: %s\n", sensor, k, ovt_status_text(status));
  }
}

// Poses come before the scans of their time, and more often.
void drive_localisation(ovt::Detector& detector, Clock::time_point start) {
  for (int k = -5; k < 5 * kScans; ++k) {
    ovt_ego_pose pose = ovt::ego_pose();
    pose.stamp_ns = k * kPeriodNs / 5;
    pose.x_m = kEgoSpeed * double(pose.stamp_ns) * 1e-9;
    pose.speed_mps = kEgoSpeed;
    std::this_thread::sleep_until(start + std::chrono::nanoseconds(pose.stamp_ns) - std::chrono::milliseconds(5));
    if (const ovt_status status = detector.push(pose); status != OVT_OK)
      std::fprintf(stderr, "ego pose %d: %s\n", k, ovt_status_text(status));
  }
}

int run() {
  const double yaw_rad[3] = {0.0, 2 * std::numbers::pi / 3, -2 * std::numbers::pi / 3};
  std::vector<ovt_sensor_def> sensors(3, ovt_default_sensor_def());
  for (std::size_t s = 0; s < 3; ++s) {
    sensors[s].z_m = 1.2;
    sensors[s].yaw_rad = yaw_rad[s];
    sensors[s].cols = SCAN_BEAMS;
  }
  ovt_detector_def def = ovt::definition(sensors);
  def.worker_count = 2;
  ovt::Detector detector(def);
  ovt::Reader reader(detector);
  ovt::check(reader.set_path_horizon(1.0));  // as far as the planner looks; 0 where no path is needed

  const auto start = Clock::now() + std::chrono::milliseconds(100);
  std::atomic<int> producing = 4;
  std::vector<std::jthread> producers;
  for (int32_t s = 0; s < 3; ++s)
    producers.emplace_back([&, s] { drive_lidar(detector, s, yaw_rad[s], start), --producing; });
  producers.emplace_back([&] { drive_localisation(detector, start), --producing; });

  // The planner's loop: whatever is newest, predicted to the planner's own time. The last frame comes after the flush.
  int frames = 0, confirmed = 0;
  double x_m = 0, speed_mps = 0;
  const auto take_newest = [&] {
    const auto info = reader.next_frame();
    if (!info) return;
    ++frames;
    const auto tracks = reader.tracks(info->stamp_ns + kPeriodNs);
    if (!tracks) return;
    confirmed = 0;
    for (std::size_t i = 0; i < tracks->size(); ++i) {
      if (tracks->state()[i] != OVT_CONFIRMED) continue;
      ++confirmed;
      x_m = tracks->x_m()[i];
      speed_mps = tracks->speed_mps()[i];
    }
  };
  while (producing > 0) {
    take_newest();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  producers.clear();  // the order of a shut-down: producers, flush, readers, detector
  ovt::check(detector.flush());
  take_newest();

  const ovt_stats stats = detector.stats();
  std::printf("%d frames read; %d confirmed track, x %.1f m (map), %.1f m/s\n", frames, confirmed, x_m, speed_mps);
  std::printf("%lld scans pushed: %lld used, %lld dropped\n", static_cast<long long>(stats.pushed),
              static_cast<long long>(stats.used), static_cast<long long>(stats.dropped));
  const int64_t accounted = stats.used + stats.dropped + stats.late + stats.dup;
  const bool adds_up = stats.pushed == 3 * kScans && accounted == stats.pushed;
  return adds_up && confirmed == 1 && std::abs(speed_mps - kCarSpeed) < 3.0 ? 0 : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const ovt::Error& error) {
    std::fprintf(stderr, "producers: %s\n", error.what());
    return 1;
  }
}
