// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/client/console.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/numbers.h"
#include "tools/evaluation/pictures.h"
#include "tools/io/angles.h"
#include "tools/sim/mesh.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

constexpr int32_t kWidth = 920, kHeight = 340;

// Parallel projection from above, behind and the right: x of the vehicle runs up and to the left.
class Camera {
 public:
  Camera(double middle_x_m, double middle_y_m) : middle_{middle_x_m, middle_y_m} {}
  cli::SvgPoint at(double x_m, double y_m, double z_m) const {
    const double x = x_m - middle_[0], y = y_m - middle_[1];
    const double across = kCosTurn * x - kSinTurn * y, away = kSinTurn * x + kCosTurn * y;
    return {kWidth / 2.0 + kPixels * across, kHeight / 2.0 - kPixels * (away * kSinTilt + z_m * kCosTilt)};
  }
  double away(double x_m, double y_m) const { return kSinTurn * x_m + kCosTurn * y_m; }

 private:
  // The vehicle drives to the right of the picture and slightly away; seen from 50 deg above.
  static constexpr double kPixels = 27, kCosTurn = 0.9659258, kSinTurn = 0.2588190, kSinTilt = 0.7660444,
                          kCosTilt = 0.6427876;
  const std::array<double, 2> middle_;
};

std::array<cli::SvgPoint, 4> corners_of(const Outline& o, const Camera& camera) {
  std::array<cli::SvgPoint, 4> out;
  const double c = std::cos(o.heading_rad), s = std::sin(o.heading_rad);
  constexpr double kSigns[4][2] = {{1, 1}, {1, -1}, {-1, -1}, {-1, 1}};
  for (std::size_t k = 0; k < 4; ++k) {
    const double a = kSigns[k][0] * o.length_m / 2, b = kSigns[k][1] * o.width_m / 2;
    out[k] = camera.at(o.x_m + c * a - s * b, o.y_m + s * a + c * b, 0);
  }
  return out;
}

template <class Color>
io::Picture draw_points(const CloudMoment& m, const Camera& camera, Color&& color_of) {
  std::vector<const CloudMoment::Point*> order;
  for (const CloudMoment::Point& p : m.points) order.push_back(&p);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) {
    return camera.away(double(a->x_m), double(a->y_m)) > camera.away(double(b->x_m), double(b->y_m));
  });
  constexpr double kFine = 1.25;  // pixels of the cloud per pixel of the picture
  io::Picture picture(int32_t(kWidth * kFine), int32_t(kHeight * kFine), {14, 15, 18});
  for (const CloudMoment::Point* p : order) {
    const cli::SvgPoint at = camera.at(double(p->x_m), double(p->y_m), double(p->z_m));
    const int32_t x = int32_t(std::floor(at.x * kFine)), y = int32_t(std::floor(at.y * kFine));
    for (int32_t k = 0; k < 4; ++k)
      if (x + k % 2 >= 0 && x + k % 2 < picture.width && y + k / 2 >= 0 && y + k / 2 < picture.height)
        picture.at(x + k % 2, y + k / 2) = color_of(*p);
  }
  return picture;
}

void add_panel(cli::Svg& svg, double top, const io::Picture& picture, const std::string& title, const CloudMoment& m,
               const io::Rig& rig, const Camera& camera) {
  svg.text(8, top + 12, title);
  svg.image(0, top + 18, kWidth, kHeight, picture);
  svg.add("<svg x=\"0\" y=\"" + cli::svg_number(top + 18) + "\" width=\"" + std::to_string(kWidth) + "\" height=\"" +
          std::to_string(kHeight) + "\">");
  for (int32_t k = -60; k <= 60; ++k) {
    const std::string style = std::string(" stroke=\"#fff\" stroke-opacity=\"") + (k % 5 == 0 ? "0.22" : "0.08") + "\"";
    svg.line(camera.at(k, -40, 0), camera.at(k, 40, 0), style);
    if (k >= -40 && k <= 40) svg.line(camera.at(-60, k, 0), camera.at(60, k, 0), style);
  }
  for (const io::RigSensor& s : rig.sensors)
    for (const double edge : {s.azimuth_left_deg, s.azimuth_right_deg}) {
      if (s.wraps) continue;
      const double angle = io::rad(s.yaw_deg + edge);
      svg.line(camera.at(s.x_m, s.y_m, 0), camera.at(s.x_m + 40 * std::cos(angle), s.y_m + 40 * std::sin(angle), 0),
               " stroke=\"#9ecbff\" stroke-width=\"1\" stroke-dasharray=\"7 5\" stroke-opacity=\"0.8\"");
    }
  const auto outline = [&](const Outline& o, const char* style) {
    const auto corners = corners_of(o, camera);
    svg.polygon({corners.begin(), corners.end()}, style);
  };
  outline({sim::kCarCenterXM, 0, 0, m.car.length_m, m.car.width_m},
          " fill=\"#fff\" fill-opacity=\"0.25\" stroke=\"#fff\" stroke-width=\"1.5\"");
  outline(m.car, " fill=\"none\" stroke=\"#fff\" stroke-width=\"1.5\" stroke-dasharray=\"3 3\"");
  svg.add("</svg>");
}

}  // namespace

std::string draw_clouds(const CloudMoment& m, const io::Rig& rig) {
  cli::Svg svg(kWidth, 2 * (kHeight + 22) + 26 + 20);
  const Camera camera(0.5 * (sim::kCarCenterXM + m.car.x_m), 0.5 * m.car.y_m);
  std::vector<double> intensities;
  for (const CloudMoment::Point& p : m.points) intensities.push_back(std::log(std::max(double(p.intensity), 1e-4)));
  const metrics::Summary shades = metrics::summarize(intensities);
  svg.text(kWidth / 2.0, 16,
           "Simulated clouds of all sensors, frame " + std::to_string(m.at.frame) + ": a car across the seam between " +
               m.sensors,
           "middle", " font-size=\"13\" font-weight=\"bold\"");
  add_panel(svg, 22,
            draw_points(m, camera,
                        [&](const CloudMoment::Point& p) {
                          const double shade = std::log(std::max(double(p.intensity), 1e-4));
                          return io::scale_color((shade - shades.p5) / (shades.p95 - shades.p5));
                        }),
            "(a) by intensity, as they come (dark blue: lowest, yellow: highest, logarithmic)", m, rig, camera);
  std::string parts;
  for (const int64_t count : m.parts) parts += (parts.empty() ? "" : " and ") + std::to_string(count);
  add_panel(svg, 22 + kHeight + 22,
            draw_points(m, camera,
                        [](const CloudMoment::Point& p) {
                          return p.cluster == -2   ? io::Rgb{110, 20, 20}
                                 : p.cluster == -1 ? io::Rgb{78, 78, 84}
                                                   : io::label_color(p.cluster + 1);
                        }),
            "(b) merged clusters (colour: cluster, grey: ground); the car's cluster has " + parts +
                " points of the two sensors",
            m, rig, camera);
  svg.text(8, 2 * (kHeight + 22) + 38,
           "White: own car (rear axle at the origin); dotted: the true place of the other; dashed: edges of the fields "
           "of view; grid 1 m and 5 m, own car drives to the right.");
  return svg.finish();
}

}  // namespace overtake::evaluation
