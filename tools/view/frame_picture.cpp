// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/frame_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tools/client/console.h"
#include "tools/client/result_files.h"
#include "tools/client/session.h"
#include "tools/io/lettering.h"
#include "tools/io/mounting.h"
#include "tools/view/canvas.h"

namespace overtake::cli {
namespace {

constexpr io::Rgb kBackground = {14, 15, 20}, kGround = {52, 56, 66}, kPoint = {128, 132, 142}, kMeter = {30, 32, 40};
constexpr io::Rgb kDetection = {255, 150, 30}, kTrack = {70, 170, 255}, kEllipse = {38, 78, 120},
                  kSteady = {60, 125, 190}, kEgo = {235, 235, 235}, kTextColor = {215, 215, 220};
constexpr double kAhead_m = 90, kBehind_m = 30, kAside_m = 26;
constexpr double kChi2Of70 = 2.408, kChi2Of95 = 5.991;  // two degrees of freedom
constexpr double kMostSpread_m = 6;                     // m; an ellipse of a larger standard deviation is not drawn
constexpr int32_t kPixelsPerM = 24;                     // before the picture is halved

// The ego vehicle's frame at the frame's stamp.
struct EgoFrame {
  bool in_map;
  double x_m, y_m, c, s, yaw_rad;

  explicit EgoFrame(const ovt_frame_info& info)
      : in_map(info.reference == OVT_REFERENCE_MAP),
        x_m(info.ego_x_m),
        y_m(info.ego_y_m),
        c(std::cos(cli::vehicle_yaw_rad(info))),
        s(std::sin(cli::vehicle_yaw_rad(info))),
        yaw_rad(cli::vehicle_yaw_rad(info)) {}
  PlanePoint place(double x, double y) const {
    if (!in_map) return {x, y};
    const double dx = x - x_m, dy = y - y_m;
    return {dx * c + dy * s, dy * c - dx * s};
  }
  double heading(double heading_rad) const { return in_map ? heading_rad - yaw_rad : heading_rad; }
};

std::vector<PlanePoint> rectangle(PlanePoint center, double heading_rad, double length_m, double width_m) {
  const double c = std::cos(heading_rad), s = std::sin(heading_rad);
  std::vector<PlanePoint> corners;
  for (const auto& [along, across] :
       {std::pair(0.5, 0.5), std::pair(0.5, -0.5), std::pair(-0.5, -0.5), std::pair(-0.5, 0.5)}) {
    const double x = along * length_m, y = across * width_m;
    corners.push_back({center.right_m + c * x - s * y, center.up_m + s * x + c * y});
  }
  return corners;
}

// The ellipse of a position at a chi-square.
std::vector<PlanePoint> ellipse(PlanePoint center, double var_x, double var_y, double cov_xy, double turn_rad,
                                double chi2) {
  const double mean = (var_x + var_y) / 2, half = (var_x - var_y) / 2, root = std::hypot(half, cov_xy);
  const double a = std::sqrt(chi2 * std::max(mean + root, 0.0)), b = std::sqrt(chi2 * std::max(mean - root, 0.0));
  const double tilt = 0.5 * std::atan2(cov_xy, half) - turn_rad;
  std::vector<PlanePoint> points;
  for (int i = 0; i < 48; ++i) {
    const double t = 2 * M_PI * i / 48, x = a * std::cos(t), y = b * std::sin(t);
    points.push_back({center.right_m + x * std::cos(tilt) - y * std::sin(tilt),
                      center.up_m + x * std::sin(tilt) + y * std::cos(tilt)});
  }
  return points;
}

void draw_points(Canvas& canvas, ovt_reader* reader, const io::Rig& rig, const ovt_detections& detections) {
  std::vector<bool> is_detection;  // by merged cluster
  for (int32_t i = 0; i < detections.count; ++i) {
    const auto cluster = std::size_t(detections.cluster[i]);
    if (cluster >= is_detection.size()) is_detection.resize(cluster + 1, false);
    is_detection[cluster] = true;
  }
  for (int32_t pass = 0; pass < 3; ++pass)  // ground below, detections on top
    for (std::size_t s = 0; s < rig.sensors.size(); ++s) {
      ovt_labels labels;
      const ovt_status status = ovt_read_labels(reader, int32_t(s), &labels);
      if (status == OVT_NO_FRAME) continue;
      check(status, "labels");
      const io::Mounting mounting(rig.sensors[s]);
      for (int32_t i = 0; i < labels.count; ++i) {
        const int32_t label = labels.label[i], cluster = label > 0 ? labels.cluster_of_label[label] : -1;
        const bool detected =
            cluster >= 0 && std::size_t(cluster) < is_detection.size() && is_detection[std::size_t(cluster)];
        if ((label < 1 ? 0 : detected ? 2 : 1) != pass) continue;
        const auto at = mounting.to_vehicle(double(labels.x_m[i]), double(labels.y_m[i]), double(labels.z_m[i]));
        canvas.dot({at[0], at[1]}, pass == 2 ? kDetection : pass == 1 ? kPoint : kGround, pass == 2 ? 4 : 3);
      }
    }
}

void draw_confirmed(Canvas& canvas, const EgoFrame& ego, const ovt_tracks& tracks, int32_t i,
                    const ovt_params& params) {
  PlanePoint last = ego.place(tracks.x_m[i], tracks.y_m[i]);
  canvas.polygon(rectangle(last, ego.heading(tracks.heading_rad[i]), params.vehicle_length_m, params.vehicle_width_m),
                 kTrack, 4);
  canvas.label(last, track_label(tracks.id[i], tracks.speed_mps[i]), kTrack, 32, 44);
  for (int32_t k = 0; k < tracks.path_points; ++k) {
    const int32_t p = i * tracks.path_points + k;
    const PlanePoint next = ego.place(tracks.path_x_m[p], tracks.path_y_m[p]);
    canvas.line(last, next, kTrack, 3);
    last = next;
    const double at_s = (k + 1) * tracks.path_step_s;
    if (std::fabs(std::remainder(at_s, 0.5)) < 0.5 * tracks.path_step_s) canvas.polygon({next}, kTrack, 9);
    if (std::fabs(std::remainder(at_s, 1.0)) >= 0.5 * tracks.path_step_s) continue;
    const double turn_rad = ego.in_map ? ego.yaw_rad : 0.0;
    if (tracks.path_var_x[p] + tracks.path_var_y[p] < kMostSpread_m * kMostSpread_m)
      canvas.polygon(
          ellipse(next, tracks.path_var_x[p], tracks.path_var_y[p], tracks.path_cov_xy[p], turn_rad, kChi2Of95),
          kEllipse, 2);
    if (!tracks.path_steady_along_m || !tracks.path_steady_across_m) continue;
    const double along_m = tracks.path_steady_along_m[p], across_m = tracks.path_steady_across_m[p];
    if (std::hypot(along_m, across_m) < kMostSpread_m)
      canvas.polygon(
          ellipse(next, along_m * along_m, across_m * across_m, 0.0, turn_rad - tracks.path_course_rad[p], kChi2Of70),
          kSteady, 2);
  }
}

}  // namespace

std::string track_label(uint64_t id, double speed_mps) { return track_name(id) + "  " + fixed(speed_mps, 1) + " m/s"; }

io::Picture draw_frame(ovt_reader* reader, const io::Rig& rig, const ovt_params& params, const std::string& caption) {
  ovt_frame_info info;
  ovt_detections detections;
  ovt_tracks tracks;
  check(ovt_read_info(reader, &info), "frame");
  check(ovt_read_detections(reader, &detections), "detections");
  check(ovt_read_tracks(reader, OVT_AT_FRAME_STAMP, &tracks), "tracks");
  const EgoFrame ego(info);
  Canvas canvas(-kBehind_m, kAside_m, kPixelsPerM, int32_t((kAhead_m + kBehind_m) * kPixelsPerM),
                int32_t(2 * kAside_m * kPixelsPerM), kBackground);
  for (double x = -kBehind_m; x <= kAhead_m; x += 10) canvas.line({x, -kAside_m}, {x, kAside_m}, kMeter, 2);
  for (double y = -20; y <= kAside_m; y += 10) canvas.line({-kBehind_m, y}, {kAhead_m, y}, kMeter, 2);
  draw_points(canvas, reader, rig, detections);
  canvas.polygon(rectangle({params.vehicle_length_m * 0.3, 0}, 0, params.vehicle_length_m, params.vehicle_width_m),
                 kEgo, 4);
  canvas.label({-2, 1}, "ego", kEgo, 32, 20);
  for (int32_t i = 0; i < detections.count; ++i)
    canvas.polygon(rectangle({double(detections.x_m[i]), double(detections.y_m[i])}, double(detections.heading_rad[i]),
                             params.vehicle_length_m, params.vehicle_width_m),
                   kDetection, 3);
  for (int32_t i = 0; i < tracks.count; ++i)
    if (tracks.state[i] == OVT_CONFIRMED) draw_confirmed(canvas, ego, tracks, i, params);
  io::draw_text(canvas.picture, 12, 1, caption, kTextColor, 24);
  return halve(canvas.picture);
}

}  // namespace overtake::cli
