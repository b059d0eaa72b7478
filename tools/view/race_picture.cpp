// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/race_picture.h"

#include <algorithm>
#include <cmath>

#include "tools/client/console.h"
#include "tools/io/lettering.h"
#include "tools/sim/log_writer.h"
#include "tools/view/canvas.h"
#include "tools/view/scan_picture.h"
#include "tools/view/views.h"

namespace overtake::cli {
namespace {

using io::Rgb;
using sim::Vec3;

constexpr Rgb kInk = {230, 230, 230}, kEdge = {120, 120, 130}, kWall = {200, 200, 210}, kPaper = {12, 12, 16};
constexpr int32_t kWidth = 1400;

Rgb car_color(std::size_t car) { return surface_color(uint16_t(uint16_t(sim::Surface::car) + car)); }

// Corners of a car's outline in the map.
std::vector<Vec3> outline(const sim::CarState& state) {
  const double half = sim::kCarLengthM / 2, side = sim::kCarWidthM / 2;
  std::vector<Vec3> corners;
  for (const auto& [x, y] : {std::pair(half, side), std::pair(half, -side), std::pair(-half, -side),
                             std::pair(-half, side), std::pair(half, side), std::pair(half + 1.5, 0.0)})
    corners.push_back(state.T_map_vehicle * Vec3{sim::kCarCenterXM + x, y, 0});
  return corners;
}

template <class ToPaper>
void draw_track(Canvas& canvas, const sim::Track& track, double step_m, ToPaper&& to_paper) {
  const auto draw = [&](auto&& offset, Rgb color) {
    for (double s = 0; s < track.length_m(); s += step_m) {
      const Vec3 a = to_paper(track.place(s, offset(track.at(s)))),
                 b = to_paper(track.place(s + step_m, offset(track.at(s + step_m))));
      canvas.line({a.x, a.y}, {b.x, b.y}, color, 1);
    }
  };
  draw([](const sim::TrackPoint& p) { return p.width_left_m; }, kEdge);
  draw([](const sim::TrackPoint& p) { return -p.width_right_m; }, kEdge);
  draw([&](const sim::TrackPoint& p) { return -p.width_right_m - track.wall_behind_edge_m(); }, kWall);
}

template <class ToPaper>
void draw_cars(Canvas& canvas, const sim::Simulator& simulator, double at_s, ToPaper&& to_paper) {
  const auto& motions = simulator.world().motions;
  for (std::size_t car = 0; car < motions.size(); ++car) {
    const auto middle = [&](double t) {
      return to_paper(motions[car]->at(t).T_map_vehicle * Vec3{sim::kCarCenterXM, 0, 0});
    };
    const Rgb full = car_color(car), faint = {uint8_t(full[0] / 2), uint8_t(full[1] / 2), uint8_t(full[2] / 2)};
    Vec3 last = middle(0);
    for (double t = 0.1; t <= simulator.seconds(); t += 0.1) {
      const Vec3 next = middle(t);
      canvas.line({last.x, last.y}, {next.x, next.y}, faint, 1);
      last = next;
    }
    for (double t = 0; t <= simulator.seconds(); t += 1) canvas.dot({middle(t).x, middle(t).y}, full, 3);
    std::vector<Vec3> corners;
    for (const Vec3 corner : outline(motions[car]->at(at_s))) corners.push_back(to_paper(corner));
    for (std::size_t i = 1; i < corners.size(); ++i)
      canvas.line({corners[i - 1].x, corners[i - 1].y}, {corners[i].x, corners[i].y}, full, 2);
  }
}

io::Picture draw_overview(const sim::Simulator& simulator, double at_s) {
  const sim::Track& track = simulator.world().track;
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
  for (double s = 0; s < track.length_m(); s += 5) {
    const sim::TrackPoint p = track.at(s);
    low_x = std::min(low_x, p.x - 30), high_x = std::max(high_x, p.x + 30);
    low_y = std::min(low_y, p.y - 30), high_y = std::max(high_y, p.y + 30);
  }
  const double scale = kWidth / (high_x - low_x);
  Canvas canvas(low_x, high_y, scale, kWidth, int32_t((high_y - low_y) * scale), kPaper);
  const auto flat = [](Vec3 p) { return p; };
  draw_track(canvas, track, 5, flat);
  draw_cars(canvas, simulator, at_s, flat);
  std::string caption =
      simulator.scenario().name + " on " + track.name() + ", " + fixed(simulator.seconds(), 1) + " s, a dot a second:";
  io::draw_text(canvas.picture, 6, 5, caption, kInk, io::kCaptionSize);
  int32_t x = 14 + io::text_width(caption, io::kCaptionSize);
  for (std::size_t car = 0; car < simulator.scenario().cars.size(); ++car) {
    const std::string& name = simulator.scenario().cars[car].name;
    io::draw_text(canvas.picture, x, 5, name, car_color(car), io::kCaptionSize);
    x += io::text_width(name + "  ", io::kCaptionSize);
  }
  return std::move(canvas.picture);
}

// 90 m ahead, 60 m behind, 46 m to either side, in the ego's frame at that moment. Driving direction is to the right.
io::Picture draw_surroundings(const sim::Simulator& simulator, const sim::SimFrame& frame) {
  constexpr double kAhead = 90, kBehind = 60, kAside = 46;
  const double scale = kWidth / (kAhead + kBehind), at_s = double(frame.begin_ns) * 1e-9;
  const sim::World& world = simulator.world();
  const sim::Motion& ego = *world.motions[std::size_t(world.ego)];
  const sim::Rigid T_map_ego = ego.at(at_s).T_map_vehicle;
  const auto to_ego = [&](Vec3 p) { return T_map_ego.inverse_times(p); };
  Canvas canvas(-kBehind, kAside, scale, kWidth, int32_t(2 * kAside * scale), kPaper);
  draw_track(canvas, world.track, 1, to_ego);
  for (int32_t s = 0; s < sim::kSensors; ++s) {
    const sim::Scan& scan = frame.scans[std::size_t(s)];
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const sim::Rigid now = ego.at(at_s + double(scan.time_ns[i]) * 1e-9).T_map_vehicle;
      const Vec3 p = to_ego(
          now * (simulator.mounting(s).nominal * Vec3{double(scan.x_m[i]), double(scan.y_m[i]), double(scan.z_m[i])}));
      canvas.dot({p.x, p.y}, surface_color(scan.surface[i]), scan.surface[i] >= uint16_t(sim::Surface::car) ? 3 : 1);
    }
  }
  draw_cars(canvas, simulator, at_s, to_ego);
  io::draw_text(canvas.picture, 6, 5, "at " + fixed(at_s, 2) + " s, all points of the 50 ms after it", kInk,
                io::kCaptionSize);
  draw_surface_legend(canvas.picture, 340, 5);
  return std::move(canvas.picture);
}

}  // namespace

void write_race_pictures(const std::string& folder, sim::Simulator& simulator, double at_s) {
  int32_t index = 0;
  while (index + 1 < simulator.frame_count() && simulator.frame_begin_s(index) < at_s - 1e-9) ++index;
  const sim::SimFrame frame = simulator.frame(index);
  make_folder(folder);
  const double begin_s = double(frame.begin_ns) * 1e-9;
  io::write_png(folder + "/above.png",
                stack_pictures({draw_overview(simulator, begin_s), draw_surroundings(simulator, frame)}));
  for (int32_t s = 0; s < sim::kSensors; ++s) {
    const sim::Scan& scan = frame.scans[std::size_t(s)];
    const std::string name = sim::kSensorName[s];
    io::write_png(folder + "/" + name + ".png",
                  draw_scan({scan.x_m.data(), scan.y_m.data(), scan.z_m.data(), scan.size(), scan.surface.data()},
                            simulator.scenario().name + " " + fixed(begin_s, 2) + " s " + name));
  }
}

}  // namespace overtake::cli
