// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Rules for every frame of every detector, for any input, checked through the C API alone: each float and double is
// finite, and every row that a gate or the tracker removed is counted.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <type_traits>

#include "pipeline/columns.h"
#include "pipeline/overtake.h"

namespace overtake::test {

template <class T>
bool are_finite(const T* column, int64_t count) {
  T sum = 0;  // sum of zeros; NaN if any value is not finite
  for (int64_t i = 0; i < count; ++i) sum += column[i] - column[i];
  return sum == 0;
}

// Checks every float column and every float of a table that a reader returns.
template <class Table>
bool is_all_finite(const Table& table) {
  bool finite = true;
  overtake::for_each_column(table, [&]<class T>(const overtake::ColumnInfo&, const T* column, int64_t rows) {
    if constexpr (std::is_floating_point_v<T>) finite &= !column || are_finite(column, rows);
  });
  overtake::for_each_value(table, [&](const overtake::ValueInfo&, auto value) {
    if constexpr (std::is_floating_point_v<decltype(value)>) finite &= bool(std::isfinite(value));
  });
  return finite;
}

#define OVT_RULE(condition) \
  if (!(condition)) return #condition

// The first rule that the frame's info and gates break; null if none. `def_map`: the detector has a map.
inline const char* find_broken_info(const ovt_frame_info& info, int32_t sensor_count, bool def_map) {
  OVT_RULE(info.first_stamp_ns <= info.stamp_ns);
  OVT_RULE((info.sensor_mask | info.stale_mask) >> sensor_count == 0);
  OVT_RULE((info.incomplete_mask & ~info.sensor_mask) == 0);
  OVT_RULE(info.incomplete_mask == 0 || (info.flags & OVT_FLAG_SCAN_INCOMPLETE) != 0);
  OVT_RULE((info.blocked_mask != 0) == ((info.flags & OVT_FLAG_VIEW_BLOCKED) != 0));
  OVT_RULE((info.blocked_mask & ~info.sensor_mask) == 0);
  OVT_RULE((info.blocked_mask != 0) == (info.blocked_rad > 0) && info.blocked_rad <= 6.2831855f);
  OVT_RULE(info.blocked_mask == 0 || (info.blocked_mask >> info.blocked_sensor & 1u) != 0);
  OVT_RULE(std::fabs(info.blocked_left_rad) <= 3.1415928f);
  OVT_RULE((info.suspect_mask != 0) == ((info.flags & OVT_FLAG_CLOCK_SUSPECT) != 0));
  OVT_RULE((info.suspect_mask & ~uint32_t(OVT_SUSPECT_DETECTIONS | OVT_SUSPECT_EGO)) >> sensor_count == 0);
  OVT_RULE(std::isfinite(info.ego_x_m) && std::isfinite(info.ego_y_m));
  OVT_RULE(std::isfinite(info.ego_yaw_rad) && std::isfinite(info.ego_speed_mps));
  if (!info.ego_known)
    OVT_RULE(info.ego_x_m == 0 && info.ego_y_m == 0 && info.ego_yaw_rad == 0 && info.ego_speed_mps == 0);
  OVT_RULE(std::fabs(info.ego_heading_offset_rad) <= 3.15 && info.ego_heading_sigma_rad >= 0);
  OVT_RULE(std::isfinite(info.ego_heading_sigma_rad) && info.ego_wall_points >= 0);
  if (!info.ego_known) OVT_RULE(info.ego_heading_offset_rad == 0 && info.ego_heading_sigma_rad == 0);
  OVT_RULE(info.ego_heading_sigma_rad > 0 || (info.flags & OVT_FLAG_EGO_HEADING) == 0);
  OVT_RULE(info.ego_off_map_m >= 0 && info.ego_off_map_m <= 1e9);
  OVT_RULE(((info.flags & OVT_FLAG_NO_MAP) == 0) == def_map);
  if (!def_map) OVT_RULE(info.ego_off_map_m == 0 && (info.flags & OVT_FLAG_EGO_OFF_MAP) == 0);
  OVT_RULE(info.ego_off_map_m > 0 || (info.flags & OVT_FLAG_EGO_OFF_MAP) == 0);
  // Every loss has a count.
  OVT_RULE(info.gated_points >= 0 && info.gated_size >= 0 && info.gated_map >= 0 && info.overflow_candidates >= 0);
  OVT_RULE(info.gated_own >= 0 && info.gated_range >= 0);
  OVT_RULE(info.cluster_count == info.gated_points + info.gated_size + info.gated_own + info.candidate_count);
  OVT_RULE(info.candidate_count == info.gated_map + info.gated_range + info.overflow_candidates + info.detection_count);
  OVT_RULE(info.overflow_candidates == 0 || (info.flags & OVT_FLAG_OVERFLOW) != 0);
  return nullptr;
}

inline const char* find_broken_tracks(const ovt_tracks& t) {
  OVT_RULE(is_all_finite(t));
  for (int32_t i = 0; i < t.count; ++i) {
    OVT_RULE(t.id[i] != 0);
    for (int32_t k = 0; k < i; ++k) OVT_RULE(t.id[k] != t.id[i]);
    OVT_RULE(t.state[i] == OVT_TENTATIVE || t.state[i] == OVT_CONFIRMED);
    OVT_RULE(t.detection[i] >= -1 && t.hits[i] >= 0 && t.age[i] >= t.hits[i]);
    OVT_RULE(t.length_m[i] >= 0 && t.width_m[i] >= 0);
    for (const int32_t diagonal : {0, 2, 5, 9, 14}) OVT_RULE(t.covariance[diagonal][i] > 0);
  }
  const bool has_optional = t.existence != nullptr;
  OVT_RULE((t.object_class != nullptr) == has_optional && (t.visibility != nullptr) == has_optional);
  OVT_RULE((t.unseen_s != nullptr) == has_optional && (t.heading_sigma_rad != nullptr) == has_optional);
  OVT_RULE((t.path_steady_along_m != nullptr) == has_optional && (t.path_steady_across_m != nullptr) == has_optional);
  for (int64_t k = 0; has_optional && k < int64_t(t.count) * t.path_points; ++k)
    OVT_RULE(t.path_steady_along_m[k] > 0 && t.path_steady_across_m[k] > 0);
  for (int32_t i = 0; has_optional && i < t.count; ++i) {
    OVT_RULE(t.existence[i] > 0 && t.existence[i] < 1);
    OVT_RULE(t.object_class[i] >= OVT_CLASS_UNKNOWN && t.object_class[i] <= OVT_CLASS_DEBRIS);
    OVT_RULE(t.visibility[i] >= OVT_VISIBILITY_SEEN && t.visibility[i] <= OVT_VISIBILITY_OUTSIDE);
    OVT_RULE(t.unseen_s[i] >= 0 && (t.publish_ns >= t.measured_ns[i] || t.unseen_s[i] == 0));
    OVT_RULE(t.heading_sigma_rad[i] > 0 && t.heading_sigma_rad[i] < 3.15);
  }
  return nullptr;
}

inline const char* find_broken_image(const ovt_image& image) {
  const std::size_t bytes =
      image.type == OVT_IMAGE_BITS ? std::size_t(image.cols + 63) / 64 * 8 : std::size_t(image.cols) * 4;
  uint32_t sum = 0;
  for (int32_t r = 0; r < image.rows; ++r) {
    const char* row = static_cast<const char*>(image.data) + std::size_t(r) * image.stride_bytes;
    if (image.type == OVT_IMAGE_F32) OVT_RULE(are_finite(reinterpret_cast<const float*>(row), image.cols));
    for (std::size_t b = 0; b < bytes; b += 4) {  // the address sanitizer detects a row that is too short
      uint32_t word;
      std::memcpy(&word, row + b, 4);
      sum += word;
    }
  }
  volatile uint32_t read = sum;
  (void)read;
  return nullptr;
}

inline const char* find_broken_scan(ovt_reader* reader, int32_t sensor, bool present, int32_t cluster_count) {
  ovt_labels l;
  OVT_RULE((ovt_read_labels(reader, sensor, &l) == OVT_OK) == present);
  if (!present) return nullptr;
  for (int32_t i = 0; i < l.count; ++i) {  // each point has a label or a reason
    OVT_RULE(l.label[i] >= -1 && l.label[i] <= l.label_count);
    OVT_RULE((l.label[i] >= 0) == (l.reason[i] == 0));
    OVT_RULE(ovt_reason_name(l.reason[i]) != nullptr);
    if (l.label[i] >= 0) OVT_RULE(std::isfinite(l.x_m[i]) && std::isfinite(l.y_m[i]) && std::isfinite(l.z_m[i]));
  }
  for (int32_t i = 0; i <= l.label_count; ++i)
    OVT_RULE(l.cluster_of_label[i] >= -1 && l.cluster_of_label[i] < cluster_count);
  for (int32_t id = 0; id < OVT_IMAGE_COUNT; ++id) {
    ovt_image image;
    const ovt_status status = ovt_read_image(reader, sensor, ovt_image_id(id), &image);
    const bool of_any_method =
        id != OVT_IMAGE_ANGLE && id != OVT_IMAGE_ANGLE_SMOOTH && id != OVT_IMAGE_NONGROUND && id != OVT_IMAGE_HEIGHT;
    OVT_RULE(status == OVT_OK || (status == OVT_NOT_KEPT && id != OVT_IMAGE_PIXEL_POINT) ||
             (status == OVT_NOT_COMPUTED && !of_any_method));
    if (status != OVT_OK) continue;
    if (const char* broken = find_broken_image(image)) return broken;
  }
  return nullptr;
}

// Reads all outputs. Reads the tracks at the frame's time and at publish_ns.
inline const char* find_broken_rule(ovt_reader* reader, int32_t sensor_count, bool def_map,
                                    std::initializer_list<int64_t> publish_ns) {
  ovt_frame_info info;
  OVT_RULE(ovt_read_info(reader, &info) == OVT_OK);
  if (const char* broken = find_broken_info(info, sensor_count, def_map)) return broken;

  ovt_clusters clusters;
  OVT_RULE(ovt_read_clusters(reader, &clusters) == OVT_OK);
  OVT_RULE(clusters.count == info.cluster_count);
  OVT_RULE(is_all_finite(clusters));

  ovt_detections d;
  OVT_RULE(ovt_read_detections(reader, &d) == OVT_OK);
  OVT_RULE(d.count == info.detection_count);
  OVT_RULE(is_all_finite(d));
  // No map gate runs while the map must not be used. Methods that publish the view gate by walls, too.
  if (!d.view && (info.flags & (OVT_FLAG_NO_MAP | OVT_FLAG_EGO_OFF_MAP)) != 0) OVT_RULE(info.gated_map == 0);
  for (int32_t i = 0; i < d.count; ++i) {
    OVT_RULE(d.cluster[i] >= 0 && d.cluster[i] < clusters.count);
    if ((info.flags & (OVT_FLAG_NO_MAP | OVT_FLAG_EGO_OFF_MAP)) != 0) OVT_RULE(d.map_s_m[i] == 0 && d.map_d_m[i] == 0);
  }

  for (const int64_t ns : publish_ns) {
    ovt_tracks t;
    OVT_RULE(ovt_read_tracks(reader, ns, &t) == OVT_OK);
    OVT_RULE(t.count == info.track_count);
    if (const char* broken = find_broken_tracks(t)) return broken;
  }

  for (int32_t s = -1; s < sensor_count; ++s)
    for (int32_t stage = 0; stage < OVT_STAGE_COUNT; ++stage) {
      ovt_span span;
      const ovt_status status = ovt_read_span(reader, s, ovt_stage(stage), &span);
      const bool of_any_method = stage != OVT_STAGE_ANGLE && stage != OVT_STAGE_SMOOTH && stage != OVT_STAGE_REPAIR;
      if (status == OVT_NOT_COMPUTED && !of_any_method) continue;
      OVT_RULE(status == OVT_OK);
      OVT_RULE(span.duration_ns >= -1 && span.worker >= -1);
    }
  for (int32_t s = 0; s < sensor_count; ++s)
    if (const char* broken = find_broken_scan(reader, s, info.sensor_mask >> s & 1u, clusters.count)) return broken;
  return nullptr;
}

// Sums over all finished frames: no frame in work; needs no reader. alive: tracks after the last frame, known to the
// caller only; -1: not checked. given: rows in the used pushes of detections; -1 likewise.
inline const char* find_broken_sum(const ovt_stats& s, int64_t alive, int64_t given) {
  OVT_RULE(s.pushed == s.used + s.dropped + s.late + s.dup);
  int64_t bad = 0;
  for (const int64_t count : s.points_bad) bad += count;
  OVT_RULE(bad >= 0 && s.points_clustered >= 0 && s.points >= bad + s.points_clustered);
  OVT_RULE(s.clusters == s.gated_points + s.gated_size + s.gated_own + s.gated_map + s.gated_range +
                             s.overflow_candidates + s.detections);
  OVT_RULE(s.measurements == s.measurements_used + s.measurements_unborn + s.measurements_rejected +
                                 s.measurements_late + s.measurements_debris);
  if (given >= 0) OVT_RULE(s.detections + given == s.measurements + s.measurements_lost);
  const int64_t ended =
      s.tracks_missed + s.tracks_silent + s.tracks_displaced + s.tracks_unsound + s.tracks_forgotten + s.tracks_joined;
  OVT_RULE(s.tracks_born >= ended);
  if (alive >= 0) OVT_RULE(s.tracks_born == alive + ended);
  return nullptr;
}

#undef OVT_RULE

}  // namespace overtake::test
