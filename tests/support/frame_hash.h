// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One hash of everything a frame publishes: labels, images, clusters, detections, tracks and their paths; times apart.
#pragma once

#include "core/hash.h"
#include "pipeline/overtake.h"

namespace overtake::test {

class FrameHash {
 public:
  FrameHash(ovt_reader* reader, int32_t sensor_count) {
    ovt_frame_info info;
    ovt_detections d;
    ovt_tracks t;
    ovt_clusters c;
    if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_detections(reader, &d) != OVT_OK ||
        ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) != OVT_OK || ovt_read_clusters(reader, &c) != OVT_OK)
      return;
    for (const int64_t v : {info.sequence, info.first_stamp_ns, info.stamp_ns}) hash_.add_value(v);
    for (const uint32_t v : {info.sensor_mask, info.flags}) hash_.add_value(v);
    for (const int32_t v : {info.reference, info.ego_known, info.point_count, info.cluster_count, info.candidate_count,
                            info.detection_count, info.track_count})
      hash_.add_value(v);
    for (const double v : {info.ego_x_m, info.ego_y_m, info.ego_yaw_rad, info.ego_speed_mps}) hash_.add_value(v);
    for (int32_t s = 0; s < sensor_count; ++s) add_sensor(reader, s);
    add(c.count, c.point_count, c.min_x_m, c.min_y_m, c.min_z_m, c.max_x_m, c.max_y_m, c.max_z_m, c.center_x_m,
        c.center_y_m, c.center_z_m, c.stamp_ns, c.sensor_mask);
    add(d.count, d.stamp_ns, d.x_m, d.y_m, d.z_m, d.heading_rad, d.heading_source, d.length_m, d.width_m, d.point_count,
        d.inliers_ref, d.inliers_var, d.heading_ref_rad, d.heading_var_rad, d.ref_x_m, d.ref_y_m, d.var_x_m, d.var_y_m,
        d.sensor_mask, d.cluster, d.map_s_m, d.map_d_m, d.track);
    add(t.count, t.id, t.state, t.measured_ns, t.x_m, t.y_m, t.speed_mps, t.course_rad, t.yaw_rate_rps, t.heading_rad,
        t.length_m, t.width_m, t.age, t.hits, t.detection);
    for (const double* column : t.covariance) add(t.count, column);
    add(t.count * t.path_points, t.path_x_m, t.path_y_m, t.path_course_rad, t.path_speed_mps, t.path_var_x,
        t.path_var_y, t.path_cov_xy);
    tracks_ = t.count;
    detections_ = d.count;
  }
  uint64_t value() const { return hash_.value(); }
  int32_t tracks() const { return tracks_; }
  int32_t detections() const { return detections_; }

 private:
  template <class... T>
  void add(int32_t count, const T*... columns) {
    hash_.add_value(count);
    (hash_.add_bytes(columns, std::size_t(count) * sizeof *columns), ...);
  }

  void add_sensor(ovt_reader* reader, int32_t sensor) {
    ovt_labels l;
    if (ovt_read_labels(reader, sensor, &l) != OVT_OK) return hash_.add_value(-1);  // not in this frame
    add(l.count, l.label, l.reason, l.x_m, l.y_m, l.z_m, l.intensity, l.layer);
    add(l.label_count + 1, l.cluster_of_label);
    for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
      ovt_image image;
      if (ovt_read_image(reader, sensor, ovt_image_id(id), &image) != OVT_OK) continue;
      for (int32_t r = 0; r < image.rows; ++r) {
        const char* row = static_cast<const char*>(image.data) + std::size_t(r) * image.stride_bytes;
        if (image.type != OVT_IMAGE_BITS) {
          hash_.add_bytes(row, std::size_t(image.cols) * 4);
          continue;
        }
        const int32_t words = image.cols / 64, rest = image.cols % 64;
        hash_.add_bytes(row, std::size_t(words) * 8);
        if (rest) hash_.add_value(reinterpret_cast<const uint64_t*>(row)[words] & ((uint64_t(1) << rest) - 1));
      }
    }
  }

  Hash hash_;
  int32_t tracks_ = 0, detections_ = 0;
};

}  // namespace overtake::test
