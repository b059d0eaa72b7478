// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The oval consists of plateaus of curvature, banking and width with smooth steps between them:
//
//   half lap:  front stretch | turn 1 | turn 2 | back stretch      the other half is its mirror image
//   radius     700 m           223 m    240 m    straight
//   banking    9 deg           20 deg   20 deg   6 deg
//   width      14 m            15.5 m   15.5 m   12.5 m
//
// The lengths follow from closure: heading pi and no lateral offset after half a lap, and 2,450 m in total.
#include "tools/sim/track.h"

#include <algorithm>
#include <stdexcept>

namespace overtake::sim {
namespace {

constexpr double kOvalLength = 2450, kBlend = 90, kStep = 0.5;

struct Plateau {
  double length, curvature, banking_deg, width;
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
  return {{front, kFront, 9, 14}, {turn, kTurn1, 20, 15.5}, {turn, kTurn2, 20, 15.5}, {back, 0, 6, 12.5}};
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

Track Track::make(const std::string& name) {
  Track track;
  track.name_ = name;
  if (name == "oval")
    track.fill_oval();
  else if (name == "road")
    track.fill_road();
  else
    throw std::invalid_argument("no track is named '" + name + "'; there are oval and road");
  return track;
}

void Track::fill_oval() {
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
  double heading = 0, x = 0, y = 0;
  for (int i = 0; i < count; ++i) {
    const double s = i * step_, m = mirrored(s);
    TrackPoint p{};
    p.x = x, p.y = y, p.heading_rad = heading, p.curvature_pm = curvature(s);
    p.banking_rad = along_plateaus(parts, m, [](const Plateau& q) { return q.banking_deg; }) * kDegree;
    p.width_left_m = p.width_right_m = along_plateaus(parts, m, [](const Plateau& q) { return q.width; }) / 2;
    p.z = p.width_left_m * tan_of(p.banking_rad);  // the inner edge is level at 0
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
  return p;
}

double Track::height(double s, double d) const {
  const TrackPoint p = at(s);
  return p.z - clamp(d, -p.width_right_m - wall_behind_edge_m(), p.width_left_m) * tan_of(p.banking_rad);
}

Vec3 Track::place(double s, double d) const {
  const TrackPoint p = at(s);
  const SinCos h = sin_cos(p.heading_rad);
  const double lateral = clamp(d, -p.width_right_m - wall_behind_edge_m(), p.width_left_m);
  return {p.x - d * h.sin, p.y + d * h.cos, p.z - lateral * tan_of(p.banking_rad)};
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
