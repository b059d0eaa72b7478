// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/kitti_tracking.h"

#include <algorithm>
#include <string_view>

#include "tools/io/error.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

// Calls row(words, line number) for every line that is not empty.
template <class F>
void for_each_line(const std::string& path, F&& row) {
  const std::string text = read_whole_file(path, text_limit());
  int64_t line = 1;
  for (std::size_t begin = 0; begin < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const auto words = split_words(std::string_view(text).substr(begin, end - begin));
    if (!words.empty()) row(words, line);
    begin = end + 1;
  }
}

double to_number(const std::string& path, int64_t line, std::string_view word) {
  double value = 0;
  if (!parse_number(word, value) || !(value - value == 0))
    throw Error(path, line, "'" + std::string(word) + "' is not a finite number");
  return value;
}

int32_t to_index(const std::string& path, int64_t line, std::string_view word, int32_t least) {
  int64_t value = 0;
  if (!parse_integer(word, value) || value < least || value > 1'000'000'000)
    throw Error(path, line, "'" + std::string(word) + "' is not an integer from " + std::to_string(least));
  return int32_t(value);
}

// `words` from `first` on, row by row; columns 3: rotation only, 4: rotation and translation.
RigidTransform to_transform(const std::string& path, int64_t line, const std::vector<std::string_view>& words,
                            std::size_t first, std::size_t columns) {
  if (words.size() != first + 3 * columns)
    throw Error(path, line,
                std::to_string(words.size() - first) + " numbers, but a transform has " + std::to_string(3 * columns));
  RigidTransform t;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < columns; ++c)
      (c < 3 ? t.rotation[r][c] : t.translation_m[r]) = to_number(path, line, words[first + r * columns + c]);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      double dot = 0;
      for (int c = 0; c < 3; ++c) dot += t.rotation[a][c] * t.rotation[b][c];
      const double error = dot - (a == b ? 1.0 : 0.0);
      if (!(error < 1e-4 && error > -1e-4)) throw Error(path, line, "this is not a rotation matrix");
    }
  return t;
}

}  // namespace

void RigidTransform::apply(const double in[3], double out[3]) const {
  const double x = in[0], y = in[1], z = in[2];
  for (int r = 0; r < 3; ++r) out[r] = rotation[r][0] * x + rotation[r][1] * y + rotation[r][2] * z + translation_m[r];
}

RigidTransform RigidTransform::inverse() const {
  RigidTransform out;
  for (int r = 0; r < 3; ++r) {
    out.translation_m[r] = 0;
    for (int c = 0; c < 3; ++c) {
      out.rotation[r][c] = rotation[c][r];
      out.translation_m[r] -= rotation[c][r] * translation_m[c];
    }
  }
  return out;
}

RigidTransform RigidTransform::after(const RigidTransform& first) const {
  RigidTransform out;
  apply(first.translation_m, out.translation_m);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      out.rotation[r][c] = 0;
      for (int k = 0; k < 3; ++k) out.rotation[r][c] += rotation[r][k] * first.rotation[k][c];
    }
  return out;
}

std::vector<KittiLabel> read_kitti_labels(const std::string& path) {
  std::vector<KittiLabel> labels;
  for_each_line(path, [&](const std::vector<std::string_view>& words, int64_t line) {
    if (words.size() != 17)
      throw Error(path, line, std::to_string(words.size()) + " words, but a label of the tracking benchmark has 17");
    const auto number = [&](std::size_t word) { return to_number(path, line, words[word]); };
    KittiLabel label;
    label.frame = to_index(path, line, words[0], 0);
    label.track = to_index(path, line, words[1], -1);
    label.type = std::string(words[2]);
    label.height_m = number(10);
    label.width_m = number(11);
    label.length_m = number(12);
    label.x_m = number(13);
    label.y_m = number(14);
    label.z_m = number(15);
    label.rotation_y_rad = number(16);
    labels.push_back(std::move(label));
  });
  return labels;
}

std::vector<RigidTransform> read_kitti_poses(const std::string& path) {
  std::vector<RigidTransform> poses;
  for_each_line(path, [&](const std::vector<std::string_view>& words, int64_t line) {
    poses.push_back(to_transform(path, line, words, 0, 4));
  });
  if (poses.empty()) throw Error(path, 0, "no pose in it");
  return poses;
}

RigidTransform read_kitti_camera_mounting(const std::string& calib_path) {
  RigidTransform rectify, mounting;  // T_camera_unrectified, T_unrectified_velodyne
  bool has_rectify = false, has_mounting = false;
  for_each_line(calib_path, [&](const std::vector<std::string_view>& words, int64_t line) {
    const std::string_view name = words[0].substr(0, words[0].find(':'));
    if (name == "R0_rect" || name == "R_rect") {
      rectify = to_transform(calib_path, line, words, 1, 3);
      has_rectify = true;
    } else if (name == "Tr_velo_to_cam" || name == "Tr_velo_cam") {
      mounting = to_transform(calib_path, line, words, 1, 4);
      has_mounting = true;
    }
  });
  if (!has_rectify) throw Error(calib_path, 0, "R0_rect is missing");
  if (!has_mounting) throw Error(calib_path, 0, "Tr_velo_to_cam is missing");
  return rectify.after(mounting).inverse();
}

void KittiSequence::place(const KittiLabel& label, double world_m[3]) const {
  const double center_m[3] = {label.x_m, label.y_m - 0.5 * label.height_m, label.z_m};  // y points down
  T_world_camera[std::size_t(label.frame)].apply(center_m, world_m);
}

KittiSequence read_kitti_sequence(const std::string& folder, const std::string& sequence) {
  const std::string stem = folder + "/" + sequence;
  KittiSequence out;
  out.labels = read_kitti_labels(stem + "_labels.txt");
  const RigidTransform T_velodyne_camera = read_kitti_camera_mounting(stem + "_calib.txt");
  for (const RigidTransform& pose : read_kitti_poses(stem + "_poses.txt"))
    out.T_world_camera.push_back(T_velodyne_camera.after(pose));
  for (const KittiLabel& label : out.labels)
    if (std::size_t(label.frame) >= out.T_world_camera.size())
      throw Error(stem + "_labels.txt", 0, "frame " + std::to_string(label.frame) + " has no pose");
  return out;
}

}  // namespace overtake::io
