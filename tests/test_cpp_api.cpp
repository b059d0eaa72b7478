// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The library from C++20: the README's example, word for word.
// README begin
#include <cstdio>
#include <overtake/overtake.hpp>
#include <span>
#include <vector>

struct Point {
  float x, y, z;
  uint16_t layer;
};

// Your points come from a driver. Here: the tail of a car, ahead_m in front.
std::vector<Point> look(float ahead_m) {
  std::vector<Point> points;
  for (uint16_t layer = 10; layer < 18; ++layer)
    for (float left = -0.9f; left < 0.9f; left += 0.04f)
      points.push_back({ahead_m, left, ahead_m * (0.087f - 0.0108f * float(layer)), layer});
  return points;
}

int main() try {
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.z_m = 1.2;
  ovt::Detector detector(ovt::definition(std::span(&sensor, 1)));
  ovt::Reader reader(detector);
  std::size_t confirmed = 0;
  for (int k = 0; k < 20; ++k) {
    const std::vector<Point> points = look(20.0f + 0.5f * float(k));
    ovt_points scan = ovt::scan(0, k * 50'000'000, points.size());
    scan.x = ovt::column(points, &Point::x);
    scan.y = ovt::column(points, &Point::y);
    scan.z = ovt::column(points, &Point::z);
    scan.layer = ovt::column(points, &Point::layer);
    ovt::check(detector.push(scan));  // or look at the status: what becomes of a scan is no exception by itself
    if (!reader.next_frame()) continue;
    confirmed = 0;
    if (const auto tracks = reader.tracks())
      for (std::size_t i = 0; i < tracks->size(); ++i) {
        confirmed += tracks->state()[i] == OVT_CONFIRMED;
        std::printf("x %5.2f m  %5.2f m/s\n", tracks->x_m()[i], tracks->speed_mps()[i]);
      }
  }
  return confirmed == 1 ? 0 : 1;
} catch (const ovt::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
// README end
