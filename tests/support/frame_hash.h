// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One hash of everything that a frame publishes: labels, images, clusters, detections, tracks and paths, without times.
#pragma once

#include "core/hash.h"
#include "pipeline/columns.h"
#include "pipeline/overtake.h"

namespace overtake::test {

class FrameHash {
 public:
  FrameHash() = default;
  FrameHash(ovt_reader* reader, int32_t sensor_count) {
    ovt_frame_info info;
    ovt_detections d;
    ovt_tracks t;
    ovt_clusters c;
    if (ovt_read_info(reader, &info) != OVT_OK || ovt_read_detections(reader, &d) != OVT_OK ||
        ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &t) != OVT_OK || ovt_read_clusters(reader, &c) != OVT_OK)
      return;
    add(info);
    for (int32_t s = 0; s < sensor_count; ++s) add_sensor(reader, s);
    add(c);
    add(d);
    add(t);
    tracks_ = t.count;
    detections_ = d.count;
  }
  // One table, or the frame's numbers: every column and every number but times.
  template <class Table>
  void add(const Table& table) {
    add_to_hash(hash_, table);
  }
  uint64_t value() const { return hash_.value(); }
  int32_t tracks() const { return tracks_; }
  int32_t detections() const { return detections_; }

 private:
  void add_sensor(ovt_reader* reader, int32_t sensor) {
    ovt_labels l;
    if (ovt_read_labels(reader, sensor, &l) != OVT_OK) return hash_.add_value(-1);  // no scan in this frame
    add(l);
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
