// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A detector with one sensor or none through the C API, and a scan with known clusters.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/support/detector_bench.h"

namespace overtake::test {

// Posts of 8 layers, 3 columns wide, from right to left at increasing distance: each gives one small cluster.
struct Posts {
  explicit Posts(int32_t count) {
    for (int32_t p = 0; p < count; ++p)
      for (int32_t c = 0; c < 3; ++c)
        for (int32_t l = 0; l < 8; ++l) {
          const double azimuth = (-59.0 + 2.2 * p + 0.14 * c) * 3.14159265358979323846 / 180.0;
          const double range = 10.0 + p;
          x.push_back(float(range * std::cos(azimuth)));
          y.push_back(float(range * std::sin(azimuth)));
          z.push_back(float(range * std::tan((4.0 - l) * 3.14159265358979323846 / 180.0)));
          layer.push_back(uint8_t(l));
        }
  }
  ovt_points points(int64_t stamp_ns) const {
    ovt_points out;
    ovt_points_init(&out, sizeof out);
    out.count = int32_t(x.size());
    out.stamp_ns = stamp_ns;
    out.x = column_of(x, OVT_F32);
    out.y = column_of(y, OVT_F32);
    out.z = column_of(z, OVT_F32);
    out.layer = column_of(layer, OVT_U8);
    return out;
  }
  std::vector<float> x, y, z;
  std::vector<uint8_t> layer;
};

struct Latest {
  ovt_frame_info info{};
  int32_t calls = 0;
};
inline void keep_latest(ovt_reader* reader, void* user) {
  auto* latest = static_cast<Latest*>(user);
  ovt_read_info(reader, &latest->info);
  ++latest->calls;
}

// One sensor or none, no map.
struct Small {
  explicit Small(int32_t sensor_count = 1, int32_t workers = 1) {
    sensor = ovt_default_sensor_def();
    def = ovt_default_detector_def();
    def.sensors = sensor_count ? &sensor : nullptr;
    def.sensor_count = sensor_count;
    def.worker_count = workers;
    def.push_policy = OVT_PUSH_WAIT;
    def.on_frame = keep_latest;
    def.user = &latest;
  }
  Small(const Small&) = delete;
  ~Small() {
    ovt_destroy_reader(reader_);
    ovt_destroy_detector(detector);
  }
  void create() { REQUIRE(ovt_create_detector(&def, &detector) == OVT_OK); }
  void create(const char* preset) {
    REQUIRE(ovt_params_init(&params_, sizeof params_, preset) == OVT_OK);
    def.params = &params_;
    create();
  }
  // The tracks of the newest frame, which must be newer than that of the last call; valid until the next one.
  ovt_tracks next_tracks() {
    ovt_tracks out;
    if (!reader_) REQUIRE(ovt_create_reader(detector, &reader_) == OVT_OK);
    REQUIRE(ovt_next_frame(reader_, nullptr) == OVT_OK);
    REQUIRE(ovt_read_tracks(reader_, OVT_AT_FRAME_STAMP, &out) == OVT_OK);
    return out;
  }
  ovt_stats stats() const {
    ovt_stats out{};
    out.struct_size = sizeof out;
    REQUIRE(ovt_read_stats(detector, &out) == OVT_OK);
    return out;
  }
  ovt_sensor_def sensor;
  ovt_detector_def def;
  ovt_detector* detector = nullptr;
  Latest latest;

 private:
  ovt_params params_;
  ovt_reader* reader_ = nullptr;
};

}  // namespace overtake::test
