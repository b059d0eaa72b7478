// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// A closed race track as a surface over (s, d): s along the centre line in driving direction, d to the left of it, both
// in metres and horizontal. Curvature, banking and widths are smooth everywhere.
//
//     z  ^            outer wall |            Road: z = z_center - d tan(banking) + bank_growth d^2 / 2. With
//        |                   __/ |            banking > 0 the right side is higher (left turns).
//        |            __--''                  Left of the left edge: apron, then infield, each falls by its own slope.
//        +__-----____-''----------> -d        Right of the right edge: the road rises up to the wall.
//
// Published figures leave room for banking, its transitions and the slopes beside the road: a draw gives one track
// within them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/sim/random.h"

namespace overtake::sim {

struct TrackPoint {
  double x, y, z, heading_rad, curvature_pm;
  double banking_rad;  // at the centre line
  double bank_growth;  // per metre: how much steeper the road becomes towards the outside (progressive banking)
  double width_left_m, width_right_m;
  double apron_fall, infield_fall;  // tangents of the slopes beside the left edge, downwards
};

struct SurfaceFrame {
  Vec3 place, along, left, up;  // unit vectors; left and along span the tangent plane
};

class Track {
 public:
  // Built in: "oval" (2.45 km, similar to Las Vegas, from published data) and "road" (a Fourier curve with slopes, left
  // and right turns). Without draws: the figures in the middle. Throws std::invalid_argument for another name.
  static Track make(const std::string& name, std::optional<Random> draws = {});

  const std::string& name() const { return name_; }
  double length_m() const { return length_; }
  double wall_behind_edge_m() const { return 0.8; }
  double apron_m() const { return apron_; }
  double wrap(double s) const { return s - length_ * std::floor(s / length_); }

  TrackPoint at(double s) const;
  double height(double s, double d) const;
  SurfaceFrame frame(double s, double d) const;
  Vec3 place(double s, double d) const;

 private:
  void fill_oval(std::optional<Random> draws);
  void fill_road();
  void fill_slopes(std::optional<Random> draws);
  double height_at(const TrackPoint& p, double d) const;
  void close(double spare_x, double spare_y);

  std::string name_;
  double length_ = 0, step_ = 0, apron_ = 4.5;
  std::vector<TrackPoint> points_;  // every step_ metres, point 0 at s = 0
};

}  // namespace overtake::sim
