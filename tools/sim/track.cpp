// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The oval consists of plateaus of curvature, banking and width with smooth steps between them:
//
//   half lap:  front stretch | turn 1 | turn 2 | back stretch      the other half is its mirror image
//   radius     700 m           223 m    240 m    straight
//   width      14 m            15.5 m   15.5 m   12.5 m
//   banking    9 deg           20 deg   20 deg   6 deg             at the centre line
//     drawn    +-1             +-1      +-1      +-2               each turn by itself
//
// The lengths follow from closure: heading pi and no lateral offset after half a lap, and 2,450 m in total. The
// banking changes over 200 m +-20 %: two tables of the Las Vegas Motor Speedway have ramps of 121 to 217 m and smooth
// ones of 239 to 274 m. Its turns are published as 20 deg, and as progressive from 12 to 20 deg: the draw makes the
// outer edge up to 4 deg steeper than the inner one.
#include "tools/sim/track.h"

#include <algorithm>
#include <stdexcept>

namespace overtake::sim {
namespace {

constexpr double kOvalLength = 2450, kBlend = 90, kBankBlend = 200, kStep = 0.5;

struct Plateau {
  double length, curvature, width;
};

// Value along plateaus with smooth steps of kBlend between them (half of it on each side).
template <class Pick>
double along_plateaus(const std::vector<Plateau>& parts, double s, Pick&& pick) {
  double begin = 0, value = pick(parts[0]);
  for (std::size_t i = 1; i < parts.size(); ++i) {
    begin += parts[i - 1].length;
    value += (pick(parts[i]) - pick(parts[i - 1])) * smooth_step((s - begin) / kBlend + 0.5);
  }
  return value;
}

double curvature_of(const std::vector<Plateau>& parts, double s) {
  return along_plateaus(parts, s, [](const Plateau& p) { return p.curvature; });
}

// Half a lap for a given half of the front stretch; the other lengths follow.
std::vector<Plateau> half_lap(double front) {
  constexpr double kFront = 1.0 / 700, kTurn1 = 1.0 / 223, kTurn2 = 1.0 / 240;
  const double turn = (kPi - front * kFront) / (kTurn1 + kTurn2);
  const double back = kOvalLength / 2 - front - 2 * turn;
  return {{front, kFront, 14}, {turn, kTurn1, 15.5}, {turn, kTurn2, 15.5}, {back, 0, 12.5}};
}

// End of half a lap that starts at the origin along +x; Simpson's rule on the heading, then on the position.
double end_x(const std::vector<Plateau>& parts) {
  double heading = 0, x = 0;
  const int n = int(kOvalLength / 2 / kStep);
  for (int i = 0; i < n; ++i) {
    const double s = i * kStep, h = kStep;
    const double k0 = curvature_of(parts, s), k1 = curvature_of(parts, s + h / 2), k2 = curvature_of(parts, s + h);
    const double middle = heading + h / 24 * (5 * k0 + 8 * k1 - k2), end = heading + h / 6 * (k0 + 4 * k1 + k2);
    x += h / 6 * (cos_of(heading) + 4 * cos_of(middle) + cos_of(end));
    heading = end;
  }
  return x;
}

}  // namespace

Track Track::make(const std::string& name, std::optional<Random> draws) {
  Track track;
  track.name_ = name;
  if (name == "oval")
    track.fill_oval(draws);
  else if (name == "road")
    track.fill_road();
  else
    throw std::invalid_argument("no track is named '" + name + "'; there are oval and road");
  track.fill_slopes(draws);
  return track;
}

void Track::fill_oval(std::optional<Random> draws) {
  double low = 250, high = 500;  // half of the front stretch: a longer one ends farther right
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (end_x(half_lap(middle)) < 0 ? low : high) = middle;
  }
  const std::vector<Plateau> parts = half_lap((low + high) / 2);
  length_ = kOvalLength;
  step_ = kStep;
  const int count = int(length_ / step_);
  const auto mirrored = [&](double s) { return s <= length_ / 2 ? s : length_ - s; };
  const auto curvature = [&](double s) { return curvature_of(parts, mirrored(s)); };
  // Banking of the whole lap: front, turns 1 and 2, back, turns 3 and 4, front.
  struct Bank {
    double from, deg, growth_deg, over;  // begins here; growth from the inner to the outer edge; length of the change
  };
  std::vector<Bank> banks;
  const double middle_deg[6] = {9, 20, 20, 6, 20, 20}, spread_deg[6] = {1, 1, 1, 2, 1, 1};
  const double part_m[6] = {parts[0].length,     parts[1].length, parts[2].length,
                            2 * parts[3].length, parts[2].length, parts[1].length};
  double begin = 0;
  for (int i = 0; i < 6; ++i) {
    Bank bank{begin, middle_deg[i], 0, kBankBlend};
    if (draws) {
      Random dice = draws->branch(uint64_t(i));
      bank.deg += dice.uniform(-spread_deg[i], spread_deg[i]);
      bank.over *= dice.uniform(0.8, 1.2);
      bank.growth_deg = middle_deg[i] == 20 ? dice.uniform(0, 4) : 0;
    }
    banks.push_back(bank);
    begin += part_m[i];
  }
  Bank last = banks.front();
  last.from = begin;
  banks.push_back(last);
  const auto along_banks = [&](double s, double Bank::*value) {
    double v = banks[0].*value;
    for (std::size_t i = 1; i < banks.size(); ++i)
      v += (banks[i].*value - banks[i - 1].*value) * smooth_step((s - banks[i].from) / banks[i].over + 0.5);
    return v;
  };
  double heading = 0, x = 0, y = 0;
  for (int i = 0; i < count; ++i) {
    const double s = i * step_, m = mirrored(s);
    TrackPoint p{};
    p.x = x, p.y = y, p.heading_rad = heading, p.curvature_pm = curvature(s);
    p.width_left_m = p.width_right_m = along_plateaus(parts, m, [](const Plateau& q) { return q.width; }) / 2;
    p.banking_rad = along_banks(s, &Bank::deg) * kDegree;
    p.bank_growth = along_banks(s, &Bank::growth_deg) * kDegree / (2 * p.width_left_m);
    p.z =
        p.width_left_m * (tan_of(p.banking_rad) - p.bank_growth * p.width_left_m / 2);  // the inner edge is level at 0
    points_.push_back(p);
    const double k1 = curvature(s + step_ / 2), k2 = curvature(s + step_);
    const double middle = heading + step_ / 24 * (5 * p.curvature_pm + 8 * k1 - k2);
    const double end = heading + step_ / 6 * (p.curvature_pm + 4 * k1 + k2);
    x += step_ / 6 * (cos_of(heading) + 4 * cos_of(middle) + cos_of(end));
    y += step_ / 6 * (sin_of(heading) + 4 * sin_of(middle) + sin_of(end));
    heading = end;
  }
  close(x, y);
}

// Apron and infield fall towards the inside by 3 to 5 deg (4 deg without draws), each along its own smooth wave.
void Track::fill_slopes(std::optional<Random> draws) {
  const auto fill = [&](double TrackPoint::*slope, uint64_t key) {
    double waves = 0, swing = 0, phase = 0, swing_phase = 0;
    if (draws) {
      Random dice = draws->branch(key);
      waves = std::floor(dice.uniform(3, 8)), swing = std::floor(dice.uniform(2, 6));
      phase = dice.uniform(0, 2 * kPi), swing_phase = dice.uniform(0, 2 * kPi);
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double turn = 2 * kPi * double(i) / double(points_.size());
      const double wave = draws ? sin_of(waves * turn + phase + 0.8 * sin_of(swing * turn + swing_phase)) : 0;
      points_[i].*slope = tan_of((4 + wave) * kDegree);
    }
  };
  fill(&TrackPoint::apron_fall, 100);
  fill(&TrackPoint::infield_fall, 101);
}

// Spreads the remaining integration error (under a millimetre) evenly over the lap.
void Track::close(double spare_x, double spare_y) {
  const double n = double(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    points_[i].x -= spare_x * double(i) / n;
    points_[i].y -= spare_y * double(i) / n;
  }
}

// x(u), y(u), z(u) as short Fourier series; resampled to equal steps of arc length.
void Track::fill_road() {
  apron_ = 2;
  struct Curve {
    double x, y, dx, dy, ddx, ddy, z;
  };
  const auto curve = [](double u) {
    double r = 1, dr = 0, ddr = 0;
    constexpr double kWave[3][3] = {{2, 0.22, 0.4}, {3, 0.17, 1.9}, {5, 0.035, 0.3}};
    for (const auto& w : kWave) {
      const SinCos a = sin_cos(w[0] * u + w[2]);
      r += w[1] * a.cos;
      dr -= w[1] * w[0] * a.sin;
      ddr -= w[1] * w[0] * w[0] * a.cos;
    }
    const double size = 480;
    const SinCos a = sin_cos(u);
    Curve c{};
    c.x = size * r * a.cos, c.y = size * r * a.sin;
    c.dx = size * (dr * a.cos - r * a.sin), c.dy = size * (dr * a.sin + r * a.cos);
    c.ddx = size * (ddr * a.cos - 2 * dr * a.sin - r * a.cos);
    c.ddy = size * (ddr * a.sin + 2 * dr * a.cos - r * a.sin);
    c.z = 6 * sin_of(u + 0.5) + 2.5 * sin_of(3 * u);
    return c;
  };
  constexpr int kFine = 1 << 15;
  std::vector<double> arc(kFine + 1, 0);
  const double du = 2 * kPi / kFine;
  const auto rate = [&](double u) {
    const Curve c = curve(u);
    return std::sqrt(c.dx * c.dx + c.dy * c.dy);
  };
  for (int i = 0; i < kFine; ++i)
    arc[std::size_t(i) + 1] =
        arc[std::size_t(i)] + du / 6 * (rate(i * du) + 4 * rate((i + 0.5) * du) + rate((i + 1) * du));
  length_ = arc.back();
  const int count = int(length_ / kStep);
  step_ = length_ / count;
  double last_heading = 0;
  for (int i = 0; i < count; ++i) {
    const double s = i * step_;
    const auto after = std::upper_bound(arc.begin(), arc.end(), s) - arc.begin();
    double u = (double(after) - 1 +
                (s - arc[std::size_t(after) - 1]) / (arc[std::size_t(after)] - arc[std::size_t(after) - 1])) *
               du;
    const Curve c = curve(u);
    const double v = std::sqrt(c.dx * c.dx + c.dy * c.dy);
    TrackPoint p{};
    p.x = c.x, p.y = c.y, p.z = c.z;
    const double heading = atan2_of(c.dy, c.dx);
    p.heading_rad = i == 0 ? heading : last_heading + wrap_angle(heading - last_heading);
    last_heading = p.heading_rad;
    p.curvature_pm = (c.dx * c.ddy - c.dy * c.ddx) / (v * v * v);
    p.banking_rad = clamp(p.curvature_pm * 250, -1, 1) * 4 * kDegree;
    p.width_left_m = p.width_right_m = 6.25;
    points_.push_back(p);
  }
}

TrackPoint Track::at(double s) const {
  const double position = wrap(s) / step_;
  const std::size_t n = points_.size();
  const std::size_t i = std::min(std::size_t(position), n - 1), j = i + 1 < n ? i + 1 : 0;
  const double t = clamp(position - double(i), 0, 1);
  const TrackPoint& a = points_[i];
  TrackPoint b = points_[j];
  // Position and heading by Hermite's cubic with the exact slopes; the rest linear between points half a metre apart.
  const double h00 = (1 + 2 * t) * square(1 - t), h10 = t * square(1 - t), h01 = t * t * (3 - 2 * t),
               h11 = t * t * (t - 1);
  const SinCos ca = sin_cos(a.heading_rad), cb = sin_cos(b.heading_rad);
  b.heading_rad = a.heading_rad + wrap_angle(b.heading_rad - a.heading_rad);
  TrackPoint p;
  p.x = h00 * a.x + h10 * step_ * ca.cos + h01 * b.x + h11 * step_ * cb.cos;
  p.y = h00 * a.y + h10 * step_ * ca.sin + h01 * b.y + h11 * step_ * cb.sin;
  p.heading_rad =
      h00 * a.heading_rad + h10 * step_ * a.curvature_pm + h01 * b.heading_rad + h11 * step_ * b.curvature_pm;
  const auto slope = [&](std::size_t k) {
    return (points_[k + 1 < n ? k + 1 : 0].z - points_[k > 0 ? k - 1 : n - 1].z) / 2;
  };
  p.z = h00 * a.z + h10 * slope(i) + h01 * b.z + h11 * slope(j);
  p.curvature_pm = lerp(a.curvature_pm, b.curvature_pm, t);
  p.banking_rad = lerp(a.banking_rad, b.banking_rad, t);
  p.width_left_m = lerp(a.width_left_m, b.width_left_m, t);
  p.width_right_m = lerp(a.width_right_m, b.width_right_m, t);
  p.bank_growth = lerp(a.bank_growth, b.bank_growth, t);
  p.apron_fall = lerp(a.apron_fall, b.apron_fall, t);
  p.infield_fall = lerp(a.infield_fall, b.infield_fall, t);
  return p;
}

double Track::height_at(const TrackPoint& p, double d) const {
  const double on_road = clamp(d, -p.width_right_m - wall_behind_edge_m(), p.width_left_m);
  const double aside = std::max(0.0, d - p.width_left_m);
  return p.z - on_road * (tan_of(p.banking_rad) - p.bank_growth * on_road / 2) -
         std::min(aside, apron_) * p.apron_fall - std::max(0.0, aside - apron_) * p.infield_fall;
}

double Track::height(double s, double d) const { return height_at(at(s), d); }

Vec3 Track::place(double s, double d) const {
  const TrackPoint p = at(s);
  const SinCos h = sin_cos(p.heading_rad);
  return {p.x - d * h.sin, p.y + d * h.cos, height_at(p, d)};
}

SurfaceFrame Track::frame(double s, double d) const {
  constexpr double kSmall = 0.5;
  const Vec3 ahead = place(s + kSmall, d) - place(s - kSmall, d), aside = place(s, d + kSmall) - place(s, d - kSmall);
  SurfaceFrame f;
  f.place = place(s, d);
  f.up = normalized(cross(ahead, aside));
  f.along = normalized(ahead);
  f.left = cross(f.up, f.along);
  return f;
}

}  // namespace overtake::sim
