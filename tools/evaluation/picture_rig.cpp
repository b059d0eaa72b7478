// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures that do not depend on time: the sensors on the car, the track and the places of passes.
#include <algorithm>
#include <cmath>

#include "tools/client/console.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/pictures.h"
#include "tools/io/angles.h"
#include "tools/io/words.h"
#include "tools/sim/mesh.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

constexpr const char* kColors[] = {"#2f7fd0", "#2f9e44", "#e07b16", "#9b5fc0",
                                   "#c0392b", "#1aa3a3", "#8a6d3b", "#7f7f7f"};

struct Edge {
  double x_m, y_m, angle_rad;
};

// Width of the strip between two parallel edges that neither sensor sees; negative: both see it. NaN: not parallel.
double strip_between(const Edge& left_edge, const Edge& right_edge) {
  if (std::fabs(io::wrap_angle(left_edge.angle_rad - right_edge.angle_rad)) > io::rad(1)) return NAN;
  return -std::sin(left_edge.angle_rad) * (right_edge.x_m - left_edge.x_m) +
         std::cos(left_edge.angle_rad) * (right_edge.y_m - left_edge.y_m);
}

}  // namespace

std::string draw_rig(const io::Rig& rig, double length_m, double width_m) {
  constexpr int32_t kWidth = 760, kHeight = 580;
  constexpr double kScale = 45, kMiddleX = 1.95, kFar = 5.2;
  cli::Svg svg(kWidth, kHeight);
  const auto at = [](double x, double y) {
    return cli::SvgPoint{kWidth / 2.0 - kScale * y, 30 + (kHeight - 70) / 2.0 - kScale * (x - kMiddleX)};
  };
  svg.text(kWidth / 2.0, 16, "Sensors of rig " + rig.name + " and their horizontal fields of view, from above",
           "middle", " font-size=\"13\" font-weight=\"bold\"");
  for (int32_t k = -8; k <= 8; ++k) {
    if (std::fabs(k - kMiddleX) < 5.6) {
      svg.line({40, at(k, 0).y}, {kWidth - 12.0, at(k, 0).y}, cli::kGridLine);
      svg.text(36, at(k, 0).y + 4, std::to_string(k), "end");
    }
    if (at(0, k).x < 40 || at(0, k).x > kWidth - 12) continue;
    svg.line({at(0, k).x, 30}, {at(0, k).x, kHeight - 40.0}, cli::kGridLine);
    svg.text(at(0, k).x, kHeight - 26, std::to_string(k), "middle");
  }
  svg.text(kWidth / 2.0, kHeight - 8, "y [m], left positive; vehicle frame, rear axle at the origin", "middle");
  svg.upward_text(14, kHeight / 2.0, "x [m], forward");
  const double front = sim::kCarCenterXM + length_m / 2, rear = front - length_m, half = width_m / 2;
  svg.polygon({at(front, half), at(front, -half), at(rear, -half), at(rear, half)},
              " class=\"ink\" fill=\"#333\" fill-opacity=\"0.15\" stroke=\"#333\"");
  svg.text(at(rear + 0.25, 0).x, at(rear + 0.25, 0).y, "own car", "middle");
  std::vector<std::pair<Edge, Edge>> edges;  // right, left; by yaw
  std::vector<io::RigSensor> sensors = rig.sensors;
  std::sort(sensors.begin(), sensors.end(), [](const auto& a, const auto& b) { return a.yaw_deg < b.yaw_deg; });
  for (std::size_t k = 0; k < sensors.size(); ++k) {
    const io::RigSensor& s = sensors[k];
    const std::string color = kColors[k % std::size(kColors)];
    const double right = io::rad(s.yaw_deg + s.azimuth_right_deg), left = io::rad(s.yaw_deg + s.azimuth_left_deg);
    std::vector<cli::SvgPoint> sector = {at(s.x_m, s.y_m)};
    constexpr int32_t kSteps = 48;
    for (int32_t i = 0; i <= kSteps; ++i) {
      const double angle = right + (left - right) * i / kSteps;
      sector.push_back(at(s.x_m + kFar * std::cos(angle), s.y_m + kFar * std::sin(angle)));
    }
    svg.polygon(sector, " fill=\"" + color + "\" fill-opacity=\"0.22\" stroke=\"" + color + "\"");
    svg.circle(at(s.x_m, s.y_m), 5, " fill=\"" + color + "\"");
    const double middle = (left + right) / 2;
    const cli::SvgPoint name = at(s.x_m + 0.62 * kFar * std::cos(middle), s.y_m + 0.62 * kFar * std::sin(middle));
    svg.text(name.x, name.y, s.name, "middle", " font-weight=\"bold\" font-size=\"13\"");
    svg.text(name.x, name.y + 15, cli::fixed(s.azimuth_left_deg - s.azimuth_right_deg, 0) + " deg", "middle");
    svg.text(name.x, name.y + 29,
             "x " + cli::fixed(s.x_m, 2) + ", y " + cli::fixed(s.y_m, 2) + ", z " + cli::fixed(s.z_m, 2) + " m",
             "middle", " font-size=\"10\"");
    edges.push_back({{s.x_m, s.y_m, right}, {s.x_m, s.y_m, left}});
  }
  for (std::size_t k = 0; k < edges.size() && edges.size() > 1; ++k) {
    const Edge &a = edges[k].second, &b = edges[(k + 1) % edges.size()].first;
    const double strip = strip_between(a, b);
    if (std::isnan(strip)) continue;
    const double reach = kFar * 0.86, c = std::cos(a.angle_rad), s = std::sin(a.angle_rad);
    const cli::SvgPoint from = at(a.x_m + reach * c, a.y_m + reach * s),
                        to = at(a.x_m + reach * c - strip * s, a.y_m + reach * s + strip * c);
    svg.line(from, to, " class=\"ink\" stroke=\"#333\" stroke-width=\"2\"");
    const double off = 12;  // pixels, outwards
    svg.text((from.x + to.x) / 2 - off * s, (from.y + to.y) / 2 - off * c + 8,
             (strip < 0 ? "overlap " : "blind ") + cli::fixed(std::fabs(strip), 2) + " m",
             s > 0.3    ? "end"
             : s < -0.3 ? "start"
                        : "middle");
  }
  return svg.finish();
}

std::string draw_race(const io::MapData& map, const RacePath& path) {
  constexpr int32_t kWidth = 760;
  double low_x = 1e9, high_x = -1e9, low_y = 1e9, high_y = -1e9;
  for (std::size_t i = 0; i < map.x_m.size(); ++i) {
    low_x = std::min(low_x, map.x_m[i]), high_x = std::max(high_x, map.x_m[i]);
    low_y = std::min(low_y, map.y_m[i]), high_y = std::max(high_y, map.y_m[i]);
  }
  low_x -= 40, high_x += 40, low_y -= 40, high_y += 40;
  // The longer side of the track runs across the picture.
  const bool turned = high_y - low_y > high_x - low_x;
  const double wide = turned ? high_y - low_y : high_x - low_x, high = turned ? high_x - low_x : high_y - low_y;
  const double scale = (kWidth - 24) / std::max(wide, 1.0);
  const int32_t height = int32_t(scale * high) + 70;
  const auto at = [&](double x, double y) {
    return turned ? cli::SvgPoint{12 + scale * (y - low_y), 34 + scale * (x - low_x)}
                  : cli::SvgPoint{12 + scale * (x - low_x), 34 + scale * (high_y - y)};
  };
  cli::Svg svg(kWidth, height);
  std::vector<cli::SvgPoint> way, left, right;
  const std::size_t n = map.x_m.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i > 0 ? i - 1 : map.closed ? n - 1 : 0, b = i + 1 < n ? i + 1 : map.closed ? 0 : n - 1;
    const double dx = map.x_m[b] - map.x_m[a], dy = map.y_m[b] - map.y_m[a], d = std::max(std::hypot(dx, dy), 1e-9);
    left.push_back(at(map.x_m[i] - dy / d * map.width_left_m[i], map.y_m[i] + dx / d * map.width_left_m[i]));
    right.push_back(at(map.x_m[i] + dy / d * map.width_right_m[i], map.y_m[i] - dx / d * map.width_right_m[i]));
  }
  if (map.closed && n > 0) left.push_back(left.front()), right.push_back(right.front());
  svg.polyline(left, cli::kInkLine);
  svg.polyline(right, cli::kInkLine);
  for (const RacePath::Step& s : path.steps) way.push_back(at(s.x_m, s.y_m));
  svg.polyline(way, " stroke=\"#2f7fd0\" stroke-width=\"1.4\"");
  int32_t passings = 0;
  for (std::size_t i = 1; i < path.steps.size(); ++i) {
    const RacePath::Step &a = path.steps[i - 1], &b = path.steps[i];
    // A pass, not a car that appeared or left.
    if ((a.ahead_m < 0) == (b.ahead_m < 0) || !(std::fabs(b.ahead_m - a.ahead_m) < 10)) continue;
    const bool by_ego = b.ahead_m < 0;
    svg.circle(at(b.x_m, b.y_m), 7, by_ego ? " fill=\"#2f9e44\"" : " fill=\"#e07b16\"");
    svg.text(at(b.x_m, b.y_m).x, at(b.x_m, b.y_m).y + 4, std::to_string(++passings), "middle",
             " fill=\"white\" font-size=\"10\" font-weight=\"bold\"");
  }
  const double seconds = path.steps.empty() ? 0 : path.steps.back().time_s;
  svg.text(kWidth / 2.0, 16,
           std::string(path.simulated ? "The simulated" : "The recorded") +
               " race from above: " + cli::fixed(seconds, 0) + " s, " + io::counted(passings, "passing"),
           "middle", " font-size=\"13\" font-weight=\"bold\"");
  const double y = height - 12;
  svg.line({20, y - 4}, {20 + 100 * scale, y - 4}, " class=\"ink\" stroke=\"#333\" stroke-width=\"3\"");
  svg.text(26 + 100 * scale, y, "100 m");
  svg.circle({170, y - 4}, 6, " fill=\"#2f9e44\"");
  svg.text(182, y, "the ego passes");
  svg.circle({290, y - 4}, 6, " fill=\"#e07b16\"");
  svg.text(302, y, "the ego is passed");
  svg.line({425, y - 4}, {450, y - 4}, " stroke=\"#2f7fd0\" stroke-width=\"2\"");
  svg.text(456, y, "way of the ego between the edges of the track");
  return svg.finish();
}

}  // namespace overtake::evaluation
