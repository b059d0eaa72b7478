// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Small recordings with topics, and a hash of a run over one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/io/cloud.h"
#include "tools/io/mcap_writer.h"
#include "tools/io/rig.h"

namespace overtake::test {

struct Recorded {
  std::string topic, type, data;
  int64_t stamp_ns;
};

// A wall and a road seen by a sensor of `lines` rings that sweeps from left to right, `shots` per ring; the wall is 20
// m + `shift_m` ahead. Columns x y z intensity ring (uint16).
io::Cloud swept_cloud(int32_t lines, int32_t shots, double shift_m, bool with_ring = true);
std::string kitti_bytes(const io::Cloud& cloud);  // the file of KITTI: the first four columns, float32
io::Rig swept_rig(int32_t lines);                 // one sensor "front" that fits swept_cloud

Recorded cloud_of(const io::Cloud& points, const std::string& topic, int64_t stamp_ns,
                  const std::string& frame_id = "front");
// Poses of a straight drive at 30 m/s, every 10 ms.
std::vector<Recorded> straight_drive(const std::string& topic, int64_t from_ns, int64_t to_ns);

void write_mcap(const std::string& path, const std::vector<Recorded>& messages, const io::McapOptions& options = {});
void write_db3(const std::string& path, const std::vector<Recorded>& messages);

// Hash of all frames that a detector finishes on this input (result_files.h); empty ego_csv: the recording's own poses.
uint64_t hash_of_run(const std::string& input, const io::Rig& rig, const std::string& ego_csv = "",
                     int64_t* frames = nullptr, int64_t* detections = nullptr);

}  // namespace overtake::test
