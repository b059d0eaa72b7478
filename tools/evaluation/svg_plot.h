// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Line and violin plots as SVG text: axes with round ticks, bands, a legend. No script, no network, no font but the
// reader's.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace overtake::evaluation {

struct Series {
  std::string name, color;              // "": not in the legend
  std::vector<double> x, y, low, high;  // low, high: a band, or empty; NaN ends a line
  bool dots = false, bars = false;      // bars: low..high as an error bar at each dot
};

// One distribution. Drawn from its 5th to its 95th percentile with quartiles (line), median (dot) and mean (bar).
struct Violin {
  std::string name, color;
  std::vector<double> values;
};

struct Axes {
  std::string title, x_label, y_label;
  double x_low = 0, x_high = 0, y_low = 0, y_high = 0;  // low == high: from the data
  int32_t width = 640, height = 300;
  bool legend_left = false;  // else where the lines leave more room
  bool legend_low = false;
  bool legend_above = false;  // at the right end of the title's line, clear of the lines
};

std::string line_plot(const Axes& axes, const std::vector<Series>& series);
std::string violin_plot(const Axes& axes, const std::vector<Violin>& violins);

// 5 to 9 round numbers from low to high, both within. Empty unless low < high, both finite.
std::vector<double> round_ticks(double low, double high);

}  // namespace overtake::evaluation
