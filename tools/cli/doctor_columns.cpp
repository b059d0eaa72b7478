// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/doctor_columns.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "tools/cli/doctor_lines.h"
#include "tools/io/angles.h"

namespace overtake::cli {
namespace {

constexpr int32_t kSteppedScans = 3;
constexpr std::size_t kFewestSteps = 50;  // points of a line, and steps
constexpr double kOwnBody_m = 0.5;        // nearer points are of the own car, or none
constexpr long kMostCols = 16384;         // of a rig
constexpr float kSameBeam_deg = 0.01f;    // several returns of one beam
constexpr double kOtherWidth = 1.6;       // recorded and simulated sensors: 0.98 to 1.03 of a column

}  // namespace

void ColumnSteps::add(const io::SensorScan& scan) {
  if (scans_ >= kSteppedScans || scan.count == 0) return;
  ++scans_;
  std::map<double, std::vector<float>> lines;
  for (std::size_t i = 0; i < std::size_t(scan.count); ++i) {
    const double x = scan.x.value(i), y = scan.y.value(i), layer = scan.layer.value(i);
    if (std::hypot(x, y) > kOwnBody_m && !std::isnan(layer)) lines[layer].push_back(float(io::deg(std::atan2(y, x))));
  }
  for (auto& [layer, azimuth_deg] : lines) {
    if (azimuth_deg.size() < kFewestSteps) continue;
    std::sort(azimuth_deg.begin(), azimuth_deg.end());
    for (std::size_t i = 1; i < azimuth_deg.size(); ++i) {
      const float step_deg = azimuth_deg[i] - azimuth_deg[i - 1];
      if (step_deg > kSameBeam_deg) steps_deg_.push_back(step_deg);
    }
  }
}

double ColumnSteps::median_deg() const { return steps_deg_.size() < kFewestSteps ? 0.0 : double(median(steps_deg_)); }

int32_t ColumnSteps::find_other_cols(const io::RigSensor& model) const {
  const double step_deg = median_deg(), ratio = step_deg / column_deg(model);
  if (!(step_deg > 0) || (ratio < kOtherWidth && ratio > 1 / kOtherWidth)) return 0;
  return int32_t(std::min(std::lround(column_deg(model) * model.cols / step_deg), kMostCols));
}

double column_deg(const io::RigSensor& model) {
  return (model.wraps ? 360.0 : model.azimuth_left_deg - model.azimuth_right_deg) / model.cols;
}

}  // namespace overtake::cli
