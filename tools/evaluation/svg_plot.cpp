// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tools/evaluation/metrics/summary.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

std::string tick_text(double value, double step) {
  char text[32];
  int digits = 0;  // as many as the step has: 2.5 has one
  for (double scaled = step; digits < 6 && std::fabs(scaled - std::round(scaled)) > 1e-6 * scaled; scaled *= 10)
    ++digits;
  std::snprintf(text, sizeof text, "%.*f", digits, std::fabs(value) < 1e-12 ? 0.0 : value);
  return text;
}

// Data to pixels, the frame with its grid, and labels.
class Canvas {
 public:
  Canvas(const Axes& axes, double x_low, double x_high, double y_low, double y_high, bool x_numbers)
      : svg(axes.width, axes.height), axes_(axes), x_low_(x_low), x_high_(x_high), y_low_(y_low), y_high_(y_high) {
    if (!(x_low_ < x_high_)) x_low_ -= 0.5, x_high_ = x_low_ + 1;
    if (!(y_low_ < y_high_)) y_low_ -= 0.5, y_high_ = y_low_ + 1;
    svg.text((kLeft + axes.width - kRight) / 2, 16, axes.title, "middle", " font-size=\"13\" font-weight=\"bold\"");
    svg.text((kLeft + axes.width - kRight) / 2, axes.height - 6, axes.x_label, "middle");
    svg.upward_text(13, (kTop + axes.height - kBottom) / 2, axes.y_label);
    const double right = axes_.width - kRight;
    const auto xs = x_numbers ? round_ticks(x_low_, x_high_) : std::vector<double>();
    const auto ys = round_ticks(y_low_, y_high_);
    for (const double x : xs) {
      svg.line({px(x), kTop}, {px(x), bottom()}, x == 0 ? kZeroLine : cli::kGridLine);
      svg.text(px(x), bottom() + 14, tick_text(x, xs.size() > 1 ? xs[1] - xs[0] : 1), "middle");
    }
    for (const double y : ys) {
      svg.line({kLeft, py(y)}, {right, py(y)}, y == 0 ? kZeroLine : cli::kGridLine);
      svg.text(kLeft - 5, py(y) + 4, tick_text(y, ys.size() > 1 ? ys[1] - ys[0] : 1), "end");
    }
    svg.rectangle(kLeft, kTop, right - kLeft, bottom() - kTop, " fill=\"none\"" + std::string(cli::kInkLine));
  }

  double px(double x) const { return kLeft + (x - x_low_) / (x_high_ - x_low_) * (axes_.width - kLeft - kRight); }
  double py(double y) const {
    const double inside = std::clamp(y, y_low_, y_high_);
    return axes_.height - kBottom - (inside - y_low_) / (y_high_ - y_low_) * (axes_.height - kTop - kBottom);
  }
  double bottom() const { return axes_.height - kBottom; }

  cli::Svg svg;
  static constexpr double kLeft = 58, kRight = 14, kTop = 26, kBottom = 40;

 private:
  static constexpr const char* kZeroLine = " class=\"zero\" stroke=\"#999\"";
  const Axes axes_;
  double x_low_, x_high_, y_low_, y_high_;
};

constexpr double kLetterPx = 5.9;  // of a letter in the legend, about

std::string stroke_of(const std::string& color, const char* width) {
  return " stroke=\"" + color + "\" stroke-width=\"" + width + "\"";
}

void draw_band(Canvas& canvas, const Series& s) {
  std::size_t begin = 0;
  for (std::size_t end = 0; end <= s.x.size(); ++end) {
    if (end < s.x.size() && std::isfinite(s.y[end])) continue;
    std::vector<cli::SvgPoint> points;
    for (std::size_t i = begin; i < end; ++i) points.push_back({canvas.px(s.x[i]), canvas.py(s.high[i])});
    for (std::size_t i = end; i > begin; --i) points.push_back({canvas.px(s.x[i - 1]), canvas.py(s.low[i - 1])});
    if (end - begin > 1) canvas.svg.polygon(points, " fill=\"" + s.color + "\" fill-opacity=\"0.2\"");
    begin = end + 1;
  }
}

void draw_series(Canvas& canvas, const Series& s) {
  if (!s.low.empty() && !s.bars) draw_band(canvas, s);
  std::vector<cli::SvgPoint> points;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!std::isfinite(s.y[i])) {
      canvas.svg.polyline(points, stroke_of(s.color, "1.8"));
      points.clear();
      continue;
    }
    const cli::SvgPoint at{canvas.px(s.x[i]), canvas.py(s.y[i])};
    points.push_back(at);
    if (s.dots) canvas.svg.circle(at, 2.6, " fill=\"" + s.color + "\"");
    if (s.bars && std::isfinite(s.low[i]) && std::isfinite(s.high[i]))
      canvas.svg.line({at.x, canvas.py(s.low[i])}, {at.x, canvas.py(s.high[i])},
                      stroke_of(s.color, "1.2") + " stroke-opacity=\"0.7\"");
  }
  canvas.svg.polyline(points, stroke_of(s.color, "1.8"));
}

}  // namespace

std::vector<double> round_ticks(double low, double high) {
  if (!(low < high) || !std::isfinite(low) || !std::isfinite(high)) return {};
  const double raw = (high - low) / 7, power = std::pow(10, std::floor(std::log10(raw)));
  double step = power;
  for (const double m : {2.0, 2.5, 5.0, 10.0})
    if (step < raw) step = m * power;
  if (step < 1e-12 * std::max(std::fabs(low), std::fabs(high))) return {};  // adding it would change little or nothing
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) ticks.push_back(k * step);
  return ticks;
}

std::string line_plot(const Axes& axes, const std::vector<Series>& series) {
  double x_low = axes.x_low, x_high = axes.x_high, y_low = axes.y_low, y_high = axes.y_high;
  const double inf = std::numeric_limits<double>::infinity();
  if (x_low == x_high) x_low = inf, x_high = -inf;
  const bool find_y = y_low == y_high;
  if (find_y) y_low = inf, y_high = -inf;
  for (const Series& s : series)
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (axes.x_low == axes.x_high) x_low = std::min(x_low, s.x[i]), x_high = std::max(x_high, s.x[i]);
      if (!find_y) continue;
      for (const auto* column : {&s.y, &s.low, &s.high})
        if (!column->empty() && std::isfinite((*column)[i]))
          y_low = std::min(y_low, (*column)[i]), y_high = std::max(y_high, (*column)[i]);
    }
  if (find_y && y_low > 0 && y_low < 0.5 * y_high) y_low = 0;
  if (find_y) y_high += 0.05 * (y_high - y_low);
  Canvas canvas(axes, std::isfinite(x_low) ? x_low : 0, std::isfinite(x_high) ? x_high : 1,
                std::isfinite(y_low) ? y_low : 0, std::isfinite(y_high) ? y_high : 1, true);
  for (const Series& s : series) draw_series(canvas, s);
  // The names stand on the side where the lines leave more room.
  double room[2] = {0, 0};
  for (const Series& line : series)
    for (std::size_t i = 0; i < line.x.size(); ++i)
      if (std::isfinite(line.y[i])) {
        double& side = room[canvas.px(line.x[i]) > axes.width / 2.0];
        side = std::max(side, canvas.bottom() - canvas.py(line.y[i]));
      }
  const bool left = axes.legend_left || room[0] < 0.85 * room[1];
  double right = axes.width - Canvas::kRight;
  for (std::size_t i = series.size(); axes.legend_above && i-- > 0;
       right -= 36 + kLetterPx * double(series[i].name.size())) {
    canvas.svg.text(right - 23, 16, series[i].name, "end");
    canvas.svg.line({right - 18, 12}, {right, 12}, stroke_of(series[i].color, "3"));
  }
  for (std::size_t i = 0; i < series.size() && !axes.legend_above; ++i) {
    if (series[i].name.empty()) continue;
    const double y = axes.legend_low ? canvas.bottom() - 10 - 14 * double(series.size() - 1 - i)
                                     : Canvas::kTop + 14 + 14 * double(i);
    const double x = left ? Canvas::kLeft + 26 : axes.width - Canvas::kRight - 8;
    canvas.svg.text(left ? x + 5 : x - 22, y + 4, series[i].name, left ? "start" : "end");
    canvas.svg.line({x - 18, y}, {x, y}, stroke_of(series[i].color, "3"));
  }
  return canvas.svg.finish();
}

// Width is the density: a histogram of 40 bins between the 5th and the 95th percentile, smoothed by [1 2 1] twice.
std::string violin_plot(const Axes& axes, const std::vector<Violin>& violins) {
  double y_low = axes.y_low, y_high = axes.y_high;
  std::vector<metrics::Summary> summaries;
  for (const Violin& v : violins) summaries.push_back(metrics::summarize(v.values));
  if (y_low == y_high) {
    y_low = std::numeric_limits<double>::infinity(), y_high = -y_low;
    for (const auto& s : summaries)
      if (s.count > 0) y_low = std::min({y_low, s.p5, s.mean}), y_high = std::max({y_high, s.p95, s.mean});
    const double margin = 0.06 * (y_high - y_low);
    y_low -= margin, y_high += margin;
  }
  if (!std::isfinite(y_low) || !std::isfinite(y_high)) y_low = 0, y_high = 1;
  const double n = double(violins.size());
  Canvas canvas(axes, 0, n, y_low, y_high, false);
  for (std::size_t k = 0; k < violins.size(); ++k) {
    const metrics::Summary& s = summaries[k];
    const double middle = canvas.px(double(k) + 0.5), half = 0.42 * (canvas.px(1) - canvas.px(0));
    canvas.svg.text(middle, canvas.bottom() + 14, violins[k].name, "middle");
    if (s.count == 0) {
      canvas.svg.text(middle, canvas.bottom() - 8, "no data", "middle");
      continue;
    }
    constexpr std::size_t kBins = 40;
    std::vector<double> density(kBins, 0);
    const double span = s.p95 - s.p5;
    for (const double v : violins[k].values)
      if (v >= s.p5 && v <= s.p95 && span > 0)
        density[std::min(kBins - 1, std::size_t((v - s.p5) / span * double(kBins)))] += 1;
    for (int32_t pass = 0; pass < 2; ++pass) {
      const std::vector<double> from = density;
      for (std::size_t b = 0; b < kBins; ++b)
        density[b] = (from[b > 0 ? b - 1 : 0] + 2 * from[b] + from[std::min(b + 1, kBins - 1)]) / 4;
    }
    const double most = *std::max_element(density.begin(), density.end());
    std::vector<cli::SvgPoint> outline(2 * kBins);
    for (std::size_t b = 0; b < kBins && most > 0; ++b) {
      const double y = canvas.py(s.p5 + (double(b) + 0.5) / double(kBins) * span), w = half * density[b] / most;
      outline[b] = {middle + w, y};
      outline[2 * kBins - 1 - b] = {middle - w, y};
    }
    if (most > 0)
      canvas.svg.polygon(outline,
                         " fill=\"" + violins[k].color + "\" fill-opacity=\"0.45\"" + stroke_of(violins[k].color, "1"));
    const auto dash = [&](double y, double w, const std::string& style) {
      canvas.svg.line({middle - w, canvas.py(y)}, {middle + w, canvas.py(y)}, style);
    };
    dash(s.p5, 4, cli::kInkLine), dash(s.p95, 4, cli::kInkLine);
    canvas.svg.line({middle, canvas.py(s.p25)}, {middle, canvas.py(s.p75)},
                    cli::kInkLine + std::string(" stroke-width=\"4\""));
    dash(s.mean, 9, stroke_of("#e03131", "2"));
    canvas.svg.circle({middle, canvas.py(s.median)}, 2.5, " fill=\"white\" stroke=\"#333\"");
  }
  return canvas.svg.finish();
}

}  // namespace overtake::evaluation
