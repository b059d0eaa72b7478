// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/client/console.h"
#include "tools/evaluation/pictures.h"
#include "tools/io/angles.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

constexpr const char* kMapColor = "#2f7fd0";
constexpr const char* kPointsColor = "#e07b16";
constexpr double kPanel = 296, kReach = 4.2, kTop = 66;

// One moment from above, x of the vehicle frame up, y to the left, around the true middle of the car.
void add_fit_panel(cli::Svg& svg, double left, const FitMoment& m) {
  const double scale = kPanel / (2 * kReach);
  const auto at = [&](double x, double y) {
    return cli::SvgPoint{left + kPanel / 2 - scale * (y - m.truth.y_m), kTop + kPanel / 2 - scale * (x - m.truth.x_m)};
  };
  svg.add("<svg x=\"0\" y=\"0\" width=\"100%\" height=\"100%\">");
  for (double x = std::ceil(m.truth.x_m - kReach); x <= m.truth.x_m + kReach; ++x) {
    svg.line({left, at(x, 0).y}, {left + kPanel, at(x, 0).y}, cli::kGridLine);
    svg.text(left - 4, at(x, 0).y + 4, cli::fixed(x + 0.0, 0), "end", " font-size=\"10\"");
  }
  for (double y = std::ceil(m.truth.y_m - kReach); y <= m.truth.y_m + kReach; ++y) {
    svg.line({at(0, y).x, kTop}, {at(0, y).x, kTop + kPanel}, cli::kGridLine);
    svg.text(at(0, y).x, kTop + kPanel + 13, cli::fixed(y + 0.0, 0), "middle", " font-size=\"10\"");
  }
  const auto outline = [&](const Outline& o, const std::string& style, bool arrow) {
    const double c = std::cos(o.heading_rad), s = std::sin(o.heading_rad);
    const auto corner = [&](double along, double across) {
      return at(o.x_m + c * along - s * across, o.y_m + s * along + c * across);
    };
    const double a = o.length_m / 2, b = o.width_m / 2;
    svg.polygon({corner(a, b), corner(a, -b), corner(-a, -b), corner(-a, b)}, " fill=\"none\"" + style);
    if (arrow) svg.polyline({corner(a - 0.7, 0.5), corner(a, 0), corner(a - 0.7, -0.5)}, style);
  };
  outline(m.truth, " class=\"ink\" stroke=\"#333\" stroke-width=\"1.2\" stroke-dasharray=\"3 3\"", true);
  const auto stroke = [](const char* color, bool chosen) {
    return std::string(" stroke=\"") + color + "\" stroke-width=\"" + (chosen ? "3" : "1.6") + "\"" +
           (chosen ? "" : " stroke-dasharray=\"8 4\"");
  };
  outline(m.by_map, stroke(kMapColor, !m.points_chosen), true);
  outline(m.by_points, stroke(kPointsColor, m.points_chosen), true);
  for (const auto& [x, y] : m.points)
    if (std::fabs(double(x) - m.truth.x_m) < kReach && std::fabs(double(y) - m.truth.y_m) < kReach)
      svg.circle(at(double(x), double(y)), 1.5, cli::kInkFill);
  svg.add("</svg>");
  svg.rectangle(left, kTop, kPanel, kPanel, " fill=\"none\"" + std::string(cli::kInkLine));
  svg.text(left + kPanel / 2, kTop - 24,
           "t = " + cli::fixed(m.at.time_s, 2) + " s, true slip angle " +
               cli::fixed(io::deg(std::fabs(m.slip_rad)), 0) + " deg",
           "middle", " font-weight=\"bold\"");
  svg.text(left + kPanel / 2, kTop - 8,
           "inside: psi_REF " + std::to_string(m.inside_map) + ", psi_VAR " + std::to_string(m.inside_points) + " of " +
               std::to_string(m.points.size()) + "; taken: psi_" + (m.points_chosen ? "VAR" : "REF"),
           "middle", " font-size=\"10\"");
  svg.text(left + kPanel / 2, kTop + kPanel + 28, "y, vehicle [m]", "middle");
}

}  // namespace

std::string draw_fits(const std::vector<FitMoment>& moments, bool simulated) {
  constexpr double kStep = kPanel + 30;
  cli::Svg svg(int32_t(44 + kStep * double(std::max<std::size_t>(moments.size(), 1))), int32_t(kTop + kPanel + 58));
  svg.text(12, 20, std::string(simulated ? "A simulated" : "A recorded") + " car entering a spin: both rectangles",
           "start", " font-size=\"13\" font-weight=\"bold\"");
  for (std::size_t k = 0; k < moments.size(); ++k) add_fit_panel(svg, 44 + kStep * double(k), moments[k]);
  svg.upward_text(14, kTop + kPanel / 2, "x, vehicle [m]");
  const double y = kTop + kPanel + 46;
  double x = 44;
  const auto key = [&](const char* style, const std::string& words) {
    svg.line({x, y - 4}, {x + 26, y - 4}, style);
    svg.text(x + 32, y, words);
    x += 56 + 6.3 * double(words.size());
  };
  key((" stroke-width=\"3\" stroke=\"" + std::string(kMapColor) + "\"").c_str(), "psi_REF: heading of the map");
  key((" stroke-width=\"3\" stroke=\"" + std::string(kPointsColor) + "\"").c_str(), "psi_VAR: from the points");
  key(" class=\"ink\" stroke=\"#333\" stroke-dasharray=\"3 3\"", "truth");
  svg.text(x, y, "thick: taken; arrow: front");
  return svg.finish();
}

}  // namespace overtake::evaluation
