// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/client/console.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/pictures.h"
#include "tools/io/angles.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

constexpr int32_t kStripWidth = 920;
constexpr double kLeft = 62, kRight = 12, kImage = 64, kCloud = 150, kHead = 17, kGap = 9;
constexpr double kInside = kStripWidth - kLeft - kRight;

// A colour bar with its limits, right-aligned above a panel.
void add_scale(cli::Svg& svg, double top, const std::string& low, const std::string& high) {
  constexpr int32_t kSteps = 64;
  constexpr double kBar = 110;
  io::Picture bar(kSteps, 1);
  for (int32_t k = 0; k < kSteps; ++k) bar.at(k, 0) = io::scale_color(double(k) / (kSteps - 1));
  const double right = kStripWidth - kRight - 6.2 * double(high.size()) - 4;
  svg.text(kStripWidth - kRight, top + 11, high, "end");
  svg.image(right - kBar, top + 3, kBar, 9, bar);
  svg.text(right - kBar - 4, top + 11, low, "end");
}

void add_frame(cli::Svg& svg, double top, double height) {
  svg.rectangle(kLeft, top, kInside, height, " fill=\"none\"" + std::string(cli::kInkLine));
}

// The image's rows are its y axis.
double add_image(cli::Svg& svg, double top, const std::string& title, const cli::DenseImage& image,
                 const cli::DenseImage& returns, bool scaled) {
  const cli::ColoredImage colored = cli::color_image(image, returns);
  io::Picture picture(image.cols, image.rows);
  picture.pixels = colored.colors;
  svg.text(kLeft, top + 11, title);
  if (scaled) add_scale(svg, top, colored.low_text, colored.high_text);
  svg.image(kLeft, top + kHead, kInside, kImage, picture);
  add_frame(svg, top + kHead, kImage);
  svg.text(kLeft - 5, top + kHead + 9, "row 1", "end");
  svg.text(kLeft - 5, top + kHead + kImage, std::to_string(image.rows), "end");
  return top + kHead + kImage + kGap;
}

struct Elevations {
  double low_deg, high_deg;
};

template <class Color>
double add_cloud(cli::Svg& svg, double top, const std::string& title, const StripMoment& m, const Elevations& e,
                 Color&& color_of) {
  constexpr int32_t kCols = 1300, kRows = 225;
  io::Picture picture(kCols, kRows);
  for (const StripMoment::Point& p : m.points) {
    const double x = (m.azimuth_left_deg - io::deg(p.azimuth_rad)) / (m.azimuth_left_deg - m.azimuth_right_deg) * kCols;
    const double y = (e.high_deg - io::deg(p.elevation_rad)) / (e.high_deg - e.low_deg) * kRows;
    for (int32_t k = 0; k < 4; ++k) {
      const int32_t px = int32_t(std::floor(x)) + k % 2, py = int32_t(std::floor(y)) + k / 2;
      if (px >= 0 && px < kCols && py >= 0 && py < kRows) picture.at(px, py) = color_of(p);
    }
  }
  svg.text(kLeft, top + 11, title);
  svg.image(kLeft, top + kHead, kInside, kCloud, picture);
  add_frame(svg, top + kHead, kCloud);
  for (const double deg : {-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0}) {
    if (deg <= e.low_deg || deg >= e.high_deg) continue;
    const double y = top + kHead + (e.high_deg - deg) / (e.high_deg - e.low_deg) * kCloud;
    svg.line({kLeft - 4, y}, {kLeft, y}, cli::kInkLine);
    svg.text(kLeft - 6, y + 4, cli::fixed(deg, 0), "end");
  }
  svg.upward_text(14, top + kHead + kCloud / 2, "elevation [deg]");
  return top + kHead + kCloud + kGap;
}

}  // namespace

std::string draw_strip(const StripMoment& m) {
  cli::Svg svg(kStripWidth, int32_t(26 + 5 * (kHead + kImage + kGap) + 2 * (kHead + kCloud + kGap) + 28));
  std::vector<double> ranges, elevations;
  for (const StripMoment::Point& p : m.points) {
    ranges.push_back(double(p.range_m));
    elevations.push_back(io::deg(p.elevation_rad));
  }
  std::sort(ranges.begin(), ranges.end());
  const metrics::Summary elevation = metrics::summarize(elevations);
  const Elevations e{std::floor(elevation.least) - 0.5, std::ceil(elevation.most) + 0.5};
  const double low = std::log(std::max(metrics::percentile(ranges, 0.005), 0.1)),
               high = std::log(std::max(metrics::percentile(ranges, 0.995), 0.2));

  svg.text(kStripWidth / 2.0, 16,
           "One simulated scan, sensor " + m.sensor + ", frame " + std::to_string(m.at.frame) + ": a car " +
               cli::fixed(m.car_m, 0) + " m away",
           "middle", " font-size=\"13\" font-weight=\"bold\"");
  double top = 26;
  add_scale(svg, top, cli::fixed(std::exp(low), 1) + " m", cli::fixed(std::exp(high), 1) + " m (log)");
  top = add_cloud(svg, top, "(a) cloud P by range", m, e, [&](const StripMoment::Point& p) {
    return io::scale_color((std::log(std::max(double(p.range_m), 0.01)) - low) / (high - low));
  });
  top = add_image(svg, top, "(b) range image R", m.range, m.range, true);
  top = add_image(svg, top, "(c) angle image A (black: no return)", m.angle, m.range, true);
  top = add_image(svg, top, "(d) smoothed angle image", m.smooth, m.range, true);
  top = add_image(svg, top, "(e) repaired non-ground range image", m.repaired, m.repaired, true);
  top = add_image(svg, top, "(f) label image L (colour: label, grey: ground)", m.labels, m.range, false);
  top = add_cloud(svg, top, "(g) segmented cloud (colour: label, grey: ground)", m, e, [](const StripMoment::Point& p) {
    return p.label < 0 ? io::Rgb{110, 20, 20} : io::label_color(p.label);
  });
  top -= kGap;
  for (double deg = std::ceil(m.azimuth_right_deg / 20) * 20; deg <= m.azimuth_left_deg; deg += 20) {
    const double x = kLeft + (m.azimuth_left_deg - deg) / (m.azimuth_left_deg - m.azimuth_right_deg) * kInside;
    svg.line({x, top}, {x, top + 4}, cli::kInkLine);
    svg.text(x, top + 15, cli::fixed(deg, 0), "middle");
  }
  svg.text(kLeft + kInside / 2, top + 28, "azimuth [deg], left positive", "middle");
  return svg.finish();
}

}  // namespace overtake::evaluation
