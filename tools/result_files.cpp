// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/result_files.h"

#include <cmath>

namespace overtake::cli {

void write_detections(io::CsvWriter& csv, int64_t frame, const ovt_detections& d) {
  for (int32_t i = 0; i < d.count; ++i) {
    csv.cell(frame).cell(d.stamp_ns[i]).cell(d.x_m[i]).cell(d.y_m[i]).cell(d.z_m[i]).cell(d.heading_rad[i]);
    csv.cell(std::string_view(d.heading_source[i] == 0 ? "ref" : "var"));
    csv.cell(d.length_m[i]).cell(d.width_m[i]).cell(d.point_count[i]).cell(d.inliers_ref[i]).cell(d.inliers_var[i]);
    csv.cell(d.heading_ref_rad[i]).cell(d.heading_var_rad[i]).cell(d.sensor_mask[i]).end_row();
  }
}

void write_tracks(io::CsvWriter& csv, int64_t frame, const ovt_tracks& t) {
  for (int32_t i = 0; i < t.count; ++i) {
    csv.cell(t.publish_ns).cell(t.id[i]);
    csv.cell(std::string_view(t.state[i] == OVT_CONFIRMED ? "confirmed" : "tentative")).cell(frame);
    csv.cell(t.x_m[i]).cell(t.y_m[i]).cell(t.speed_mps[i]).cell(t.course_rad[i]).cell(t.yaw_rate_rps[i]);
    csv.cell(t.heading_rad[i]).cell(t.age[i]).cell(t.hits[i]);
    csv.cell(t.covariance[0][i]).cell(t.covariance[2][i]).end_row();  // lower triangle: xx, yx, yy
  }
}

double read_time_us(ovt_reader* reader, int32_t sensor, ovt_stage stage) {
  int64_t ns = -1;
  return ovt_read_time(reader, sensor, stage, &ns) == OVT_OK && ns >= 0 ? double(ns) / 1000 : std::nan("");
}

void write_times(io::CsvWriter& csv, int64_t frame, int64_t stamp_ns, const io::Rig& rig, ovt_reader* reader) {
  for (int32_t sensor = -1; sensor < int32_t(rig.sensors.size()); ++sensor)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      const double us = read_time_us(reader, sensor, ovt_stage(stage));
      if (std::isnan(us)) continue;
      csv.cell(frame).cell(stamp_ns);
      csv.cell(sensor < 0 ? std::string_view() : std::string_view(rig.sensors[std::size_t(sensor)].name));
      csv.cell(std::string_view(ovt_stage_name(stage))).cell(us).end_row();
    }
}

}  // namespace overtake::cli
