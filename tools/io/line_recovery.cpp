// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/line_recovery.h"
#include "tools/io/angles.h"

#include <algorithm>
#include <cmath>

namespace overtake::io {
namespace {

constexpr uint16_t kNoLine = 65535;

struct Guess {
  std::vector<uint16_t> line;
  int32_t count = 0;
  double disorder = 1;  // share of the steps that fit no ring
};

// One full turn per ring. Rings meet at one azimuth: the first point's, or the multiple of 90 degrees just before it.
Guess guess_turns(const std::vector<float>& azimuth_deg, bool to_right) {
  constexpr double kBack = 0.33, kJump = 0.05, kSeam = 0.08, kNear = 1.0 / 360;
  Guess guess;
  guess.line.assign(azimuth_deg.size(), kNoLine);
  double reached = 0, seam = 0, last = 0;
  int64_t steps = 0, odd = 0;
  int32_t line = -1;
  for (std::size_t i = 0; i < azimuth_deg.size(); ++i) {
    if (std::isnan(azimuth_deg[i])) continue;
    const double turned = double(azimuth_deg[i]) / (to_right ? -360 : 360);
    if (line < 0) {
      seam = turned;
      const double quarter = std::floor(4 * turned) / 4;
      if (turned - quarter < kNear) seam = quarter;
    }
    const double phase = turned - seam - std::floor(turned - seam);
    const bool before_seam = line >= 0 && phase > 1 - kSeam && reached < kSeam;  // noise at the start of a ring
    if (line < 0 || phase < reached - kBack) {
      if (line >= 65533) return Guess();
      ++line;
      reached = last = phase;
    } else if (!before_seam) {
      odd += std::fabs(phase - last) > kJump;
      last = phase;
      reached = std::max(reached, phase);
    }
    ++steps;
    guess.line[i] = uint16_t(line);
  }
  guess.count = line + 1;
  guess.disorder = steps ? double(odd) / double(steps) : 1;
  return guess;
}

// One head, or two heads that each scan half of the field of view at the same time. Two heads overlap in the middle: a
// point there belongs to the end or to the start of a ring, depending on the other points of that time.
Guess guess_sweeps(const std::vector<float>& azimuth_deg, int32_t heads, bool to_right, const RigSensor& sensor) {
  constexpr double kBack = 0.33, kJump = 0.05, kOverlap = 0.016, kOverlapBack = 0.008, kLate = 0.7;
  constexpr int32_t kStragglers = 64;
  Guess guess;
  guess.line.assign(azimuth_deg.size(), kNoLine);
  double reached = 0, last = 0, last_overlap = 0;
  int64_t steps = 0, odd = 0;
  int32_t line = -1, since_start = 0;
  for (std::size_t i = 0; i < azimuth_deg.size(); ++i) {
    if (std::isnan(azimuth_deg[i])) continue;
    double at =
        (sensor.azimuth_left_deg - double(azimuth_deg[i])) / (sensor.azimuth_left_deg - sensor.azimuth_right_deg);
    if (!to_right) at = 1 - at;
    const bool overlap = heads == 2 && std::fabs(at - 0.5) < kOverlap;
    const double phase = std::clamp(heads == 1 ? at : at < 0.5 ? 2 * at : 2 * at - 1, 0.0, 1.0);
    const bool starts = overlap ? reached > 0.5 && at < last_overlap - kOverlapBack : phase < reached - kBack;
    if (line > 0 && !overlap && reached < 1 - kLate && phase > kLate && since_start < kStragglers) {
      guess.line[i] = uint16_t(line - 1);  // one head ends its ring while the other starts the next
      ++since_start;
      continue;
    }
    ++since_start;
    if (line < 0 || starts) {
      if (line >= 65533) return Guess();
      ++line;
      since_start = 0;
      reached = last = overlap ? 0 : phase;
    } else if (!overlap) {
      odd += std::fabs(phase - last) > kJump;
      last = phase;
      reached = std::max(reached, phase);
    }
    if (overlap) last_overlap = at;
    ++steps;
    guess.line[i] = uint16_t(line);
  }
  guess.count = line + 1;
  guess.disorder = steps ? double(odd) / double(steps) : 1;
  return guess;
}

Guess guess_elevation(const std::vector<float>& elevation_deg, int32_t rows) {
  Guess guess;
  std::vector<float> sorted;
  for (const float e : elevation_deg)
    if (!std::isnan(e)) sorted.push_back(e);
  if (sorted.size() < 16) return guess;
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const float gap = (sorted.front() - sorted.back()) / float(6 * rows);
  std::vector<float> tops = {sorted.front()};
  std::size_t loose = 0, begin = 0;
  for (std::size_t i = 1; i <= sorted.size(); ++i) {
    if (i < sorted.size() && sorted[i - 1] - sorted[i] <= gap) continue;
    if (sorted[begin] - sorted[i - 1] > 8 * gap) loose += i - begin;  // no ring is that thick
    if (i < sorted.size()) tops.push_back(sorted[i]);
    begin = i;
  }
  guess.count = int32_t(tops.size());
  guess.disorder = double(loose) / double(sorted.size());
  guess.line.assign(elevation_deg.size(), kNoLine);
  for (std::size_t i = 0; i < elevation_deg.size(); ++i) {
    if (std::isnan(elevation_deg[i])) continue;
    const auto behind = std::upper_bound(tops.begin(), tops.end(), elevation_deg[i], std::greater<>());
    const auto at = std::lower_bound(tops.begin(), tops.end(), elevation_deg[i], std::greater<>());
    guess.line[i] = uint16_t((at != behind ? at : at - 1) - tops.begin());
  }
  return guess;
}

}  // namespace

RecoveredLines recover_lines(const float* x_m, const float* y_m, const float* z_m, int32_t count,
                             const RigSensor& sensor) {
  std::vector<float> azimuth_deg(std::size_t(count), NAN), elevation_deg(std::size_t(count), NAN);
  for (std::size_t i = 0; i < std::size_t(count); ++i) {
    const double x = double(x_m[i]), y = double(y_m[i]), z = double(z_m[i]);
    if (!(x * x + y * y > 0) || !std::isfinite(x * x + y * y + z * z)) continue;
    azimuth_deg[i] = float(deg(std::atan2(y, x)));
    elevation_deg[i] = float(deg(std::atan2(z, std::hypot(x, y))));
  }
  const int32_t least = std::max(2, sensor.rows / 4), most = 2 * sensor.rows;
  Guess best;
  std::string how;
  const auto consider = [&](Guess guess, const char* text) {
    if (guess.count < least || guess.count > most || guess.disorder >= best.disorder) return;
    best = std::move(guess);
    how = text;
  };
  for (const bool to_right : {true, false}) {
    if (sensor.wraps) {
      consider(guess_turns(azimuth_deg, to_right), "the order of the points (a full turn a line)");
      continue;
    }
    consider(guess_sweeps(azimuth_deg, 1, to_right, sensor), "the order of the points (one sweep a line)");
    consider(guess_sweeps(azimuth_deg, 2, to_right, sensor), "the order of the points (two heads, half a line each)");
  }
  constexpr double kAccepted = 0.02;
  if (best.disorder > kAccepted) {
    best = Guess();
    best.disorder = kAccepted;
    consider(guess_elevation(elevation_deg, sensor.rows), "the elevations of the points");
  }
  RecoveredLines lines;
  if (best.line.empty()) return lines;
  lines.line = std::move(best.line);
  lines.count = best.count;
  lines.how = std::to_string(best.count) + " lines recovered from " + how;
  return lines;
}

}  // namespace overtake::io
