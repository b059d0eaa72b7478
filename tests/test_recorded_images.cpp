// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Every recorded scan: each point has a label or a reason, and the images restore every pixel's point.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/recorded.h"
#include "tools/client/session.h"

namespace overtake {
namespace {

struct Totals {
  int64_t frames = 0, points = 0, labelled = 0, pixels = 0, nothing = 0, wrong_pixel = 0, unrestored = 0;
  int64_t overflow = 0;
  int32_t sensors = 0;
  const io::Rig* rig = nullptr;
};

// Counts violations. A pixel's point is restored from range, elevation and the column's azimuth.
void count_sensor(ovt_reader* reader, int32_t s, Totals& t) {
  ovt_labels labels;
  if (ovt_read_labels(reader, s, &labels) != OVT_OK) return;
  ++t.sensors;
  t.points += labels.count;
  for (int32_t i = 0; i < labels.count; ++i) {
    if (labels.label[i] >= 0) ++t.labelled;
    const bool has_label = labels.label[i] >= 0, has_reason = labels.reason[i] != 0;
    if (has_label == has_reason || labels.label[i] > labels.label_count || !ovt_reason_name(labels.reason[i]))
      ++t.nothing;
  }

  ovt_image range, elevation, owner;
  REQUIRE(ovt_read_image(reader, s, OVT_IMAGE_RANGE, &range) == OVT_OK);
  REQUIRE(ovt_read_image(reader, s, OVT_IMAGE_ELEVATION, &elevation) == OVT_OK);
  REQUIRE(ovt_read_image(reader, s, OVT_IMAGE_PIXEL_POINT, &owner) == OVT_OK);
  const io::RigSensor& sensor = t.rig->sensors[std::size_t(s)];
  const double left = sensor.azimuth_left_deg * 3.14159265358979323846 / 180.0;
  const double span = sensor.wraps
                          ? 6.28318530717958648
                          : (sensor.azimuth_left_deg - sensor.azimuth_right_deg) * 3.14159265358979323846 / 180.0;
  const double pitch = span / range.cols;
  for (int32_t r = 0; r < range.rows; ++r)
    for (int32_t c = 0; c < range.cols; ++c) {
      const auto at = [&](const ovt_image& image, auto type) {
        using T = decltype(type);
        return reinterpret_cast<const T*>(static_cast<const char*>(image.data) +
                                          std::size_t(r) * image.stride_bytes)[c];
      };
      const int32_t i = at(owner, int32_t());
      const auto rho = double(at(range, float()));
      if ((i < 0) != (rho == 0.0)) ++t.wrong_pixel;
      if (i < 0) continue;
      ++t.pixels;
      const auto e = double(at(elevation, float()));
      const auto x = double(labels.x_m[i]), y = double(labels.y_m[i]), z = double(labels.z_m[i]);
      // Float precision: an error of 3e-8 rad in the elevation, of 6e-8 times the range in the range.
      const double tolerance = 4e-7 * rho + 1e-6;
      if (std::fabs(rho * std::sin(e) - z) > tolerance || std::fabs(rho * std::cos(e) - std::hypot(x, y)) > tolerance)
        ++t.unrestored;
      const double azimuth = left - (c + 0.5) * pitch;  // the middle of the column: within half a column
      if (std::fabs(std::remainder(std::atan2(y, x) - azimuth, 6.28318530717958648)) > 0.5 * pitch + 1e-6)
        ++t.unrestored;
    }
}

Totals check_recording(const char* folder, const char* rig) {
  cli::Options options;
  options.command = "run";
  options.input = recorded(folder);
  options.rig = rig;
  const cli::Config config = cli::load_config(options);
  Totals totals;
  totals.rig = &config.rig;
  cli::Session session(
      config,
      [](ovt_reader* reader, void* user) {
        auto& t = *static_cast<Totals*>(user);
        ++t.frames;
        for (int32_t s = 0; s < int32_t(t.rig->sensors.size()); ++s) count_sensor(reader, s, t);
      },
      &totals);
  const io::Recording recording(config.input, config.rig);
  for (std::size_t i = 0; i < recording.frame_count(); ++i) session.push(recording.read(i));
  session.flush();
  CAPTURE(std::string(folder));
  CHECK(totals.frames == int64_t(recording.frame_count()));
  CHECK(totals.nothing == 0);
  CHECK(totals.wrong_pixel == 0);
  CHECK(totals.unrestored == 0);
  CHECK(totals.pixels > totals.points / 2);
  totals.overflow = session.stats().overflow_clusters + session.stats().overflow_candidates;
  MESSAGE(std::string(folder) << ": " << totals.frames << " frames, " << totals.points << " points, " << totals.labelled
                              << " labelled, " << totals.pixels << " pixels");
  return totals;
}

}  // namespace

TEST_CASE("recorded: racecar: every point has a label or a reason, and images restore their points") {
  OVT_NEED_RECORDED("racecar");
  const Totals t = check_recording("racecar", "av21");
  CHECK(t.sensors == 12);
  CHECK(t.points == 285573);
  CHECK(t.overflow == 0);  // the default capacities hold a scan without a map
}
TEST_CASE("recorded: kitti: every point has a label or a reason, and images restore their points") {
  OVT_NEED_RECORDED("kitti");
  CHECK(check_recording("kitti", "hdl64").frames == 12);
}
TEST_CASE("recorded: nuscenes: every point has a label or a reason, and images restore their points") {
  OVT_NEED_RECORDED("nuscenes");
  const Totals t = check_recording("nuscenes", "nuscenes");
  CHECK(t.points == 34688);
  CHECK(t.overflow == 0);
}
TEST_CASE(
    "recorded: av2 (two sensors in one cloud): every point has a label or a reason, images restore their points") {
  OVT_NEED_RECORDED("av2");
  const Totals t = check_recording("av2", "av2");
  CHECK(t.sensors == 2);
  CHECK(t.points == 100660);
}

}  // namespace overtake
