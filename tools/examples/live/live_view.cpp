// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// usage: live_view [PORT [SECONDS]]     (PORT 0: a free one)
//
// A detector in a vehicle whose frames can be watched: in a browser at the address that it prints, in Foxglove or in
// Lichtblick. The library's callback gives each frame to the same sink as `overtake run --live`. While nobody watches,
// that costs the callback a microsecond; a client that reads slowly loses frames, and the detector none.
//
// The sink is of the tools, not of the installed library: link the targets ovt_view and ovt_serve of the source tree.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "pipeline/overtake.h"
#include "tools/examples/simulated_scan.h"
#include "tools/serve/live_view.h"
#include "tools/serve/view_server.h"
#include "tools/view/mcap_view.h"

using namespace overtake;

namespace {

constexpr double kPeriod_s = 0.05;

// What the view must know beside the frames: names and mounting of the sensors, size of a car.
cli::Config describe_vehicle(const ovt_sensor_def& sensor, const ovt_params& params) {
  io::RigSensor front;
  front.name = "front";
  front.x_m = sensor.x_m, front.y_m = sensor.y_m, front.z_m = sensor.z_m;
  cli::Config config;
  config.rig.name = "example";
  config.rig.period_s = kPeriod_s;
  config.rig.sensors = {front};
  config.params = params;
  return config;
}

// The callback must not throw into the library, and a view that fails must not stop the vehicle.
void on_frame(ovt_reader* reader, void* user) {
  try {
    static_cast<cli::McapView*>(user)->add(reader, {});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "live_view: %s\n", error.what());
  }
}

int run(int32_t port, double seconds) {
  ovt_sensor_def sensor = ovt_default_sensor_def();
  sensor.z_m = 1.2;
  sensor.cols = SCAN_BEAMS;
  ovt_params params;
  if (ovt_params_init(&params, sizeof params, "best") != OVT_OK) return 1;

  serve::LiveView clients;                                                    // where the messages go
  const serve::ViewServer server({"127.0.0.1", port, {}, "", {}, &clients});  // who may fetch them
  cli::McapView view(describe_vehicle(sensor, params), {&clients});           // frames to messages
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);

  ovt_detector_def def = ovt_default_detector_def();
  def.sensors = &sensor;
  def.sensor_count = 1;
  def.params = &params;
  def.worker_count = 2;
  def.on_frame = on_frame;
  def.user = &view;
  ovt_detector* detector = nullptr;
  if (ovt_create_detector(&def, &detector) != OVT_OK) return 1;

  static scan_point points[SCAN_CAPACITY];
  const auto begin = std::chrono::steady_clock::now();
  ovt_status status = OVT_OK;
  for (int64_t k = 0; status == OVT_OK && double(k) * kPeriod_s < seconds; ++k) {
    std::this_thread::sleep_until(begin + std::chrono::duration<double>(double(k) * kPeriod_s));
    ovt_points scan;
    ovt_points_init(&scan, sizeof scan);
    scan.stamp_ns = std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
    scan.count = simulate_scan(points, 0.0, 40.0 - 30.0 * std::fabs(std::sin(double(k) * 0.005)), 1.0);
    scan.x = OVT_FIELD(points, scan.count, x, OVT_F32);
    scan.y = OVT_FIELD(points, scan.count, y, OVT_F32);
    scan.z = OVT_FIELD(points, scan.count, z, OVT_F32);
    scan.intensity = OVT_FIELD(points, scan.count, intensity, OVT_F32);
    scan.layer = OVT_FIELD(points, scan.count, layer, OVT_U16);
    status = ovt_push_scan(detector, &scan);
  }
  ovt_destroy_detector(detector);  // no callback after this
  clients.drain(std::chrono::seconds(1));
  const auto counts = clients.counts();
  std::printf("%lld clients, %lld frames sent, %lld not sent to slow ones\n", static_cast<long long>(counts.clients),
              static_cast<long long>(counts.sent), static_cast<long long>(counts.dropped));
  return status == OVT_OK ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc > 1 ? std::atoi(argv[1]) : 8765, argc > 2 ? std::atof(argv[2]) : 60.0);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "live_view: %s\n", error.what());
    return 1;
  }
}
