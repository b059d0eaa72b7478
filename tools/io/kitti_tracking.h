// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Labels, poses and calibration of a sequence of the KITTI tracking benchmark, in text files:
//   labels   frame track type truncated occluded alpha x1 y1 x2 y2 height width length x y z rotation_y
//   poses    3 x 4, row by row, one line per frame: from this frame's camera to the first frame's
//   calib    NAME: numbers; R0_rect 3 x 3 and Tr_velo_to_cam 3 x 4 (or R_rect and Tr_velo_cam)
// Camera frame: rectified camera 0, x right, y down, z forward.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::io {

// y = rotation x + translation.
struct RigidTransform {
  double rotation[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  double translation_m[3] = {0, 0, 0};

  void apply(const double in[3], double out[3]) const;  // in and out may be the same
  RigidTransform inverse() const;
  RigidTransform after(const RigidTransform& first) const;  // applies `first`, then this
};

struct KittiLabel {
  int32_t frame = 0, track = -1;  // track -1: DontCare
  std::string type;               // Car, Van, Truck, Tram, Pedestrian, ..., DontCare
  double height_m = 0, width_m = 0, length_m = 0;
  double x_m = 0, y_m = 0, z_m = 0;  // centre of the box's bottom, camera frame
  double rotation_y_rad = 0;
};

// All throw Error with file and line.
std::vector<KittiLabel> read_kitti_labels(const std::string& path);
std::vector<RigidTransform> read_kitti_poses(const std::string& path);     // T_firstcamera_camera, one per frame
RigidTransform read_kitti_camera_mounting(const std::string& calib_path);  // T_velodyne_camera

// One sequence: FOLDER/SSSS_labels.txt, SSSS_poses.txt, SSSS_calib.txt. World: the Velodyne's frame in frame 0, x
// forward, y left, z up.
struct KittiSequence {
  std::vector<KittiLabel> labels;
  std::vector<RigidTransform> T_world_camera;  // one per frame

  // Centre of the label's box (half its height above its bottom) in the world. The poses must contain its frame.
  void place(const KittiLabel& label, double world_m[3]) const;
};
// Also throws if a label's frame has no pose.
KittiSequence read_kitti_sequence(const std::string& folder, const std::string& sequence);

}  // namespace overtake::io
