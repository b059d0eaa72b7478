// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
#include "tools/evaluation/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tools/metrics/summary.h"

namespace overtake::evaluation {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string tick_text(double value, double step) {
  char text[32];
  const int digits = std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 6);
  std::snprintf(text, sizeof text, "%.*f", digits, std::fabs(value) < 1e-12 ? 0.0 : value);
  return text;
}

// Data to pixels, the frame with its grid, and labels.
class Canvas {
 public:
  Canvas(const Axes& axes, double x_low, double x_high, double y_low, double y_high, bool x_numbers)
      : axes_(axes), x_low_(x_low), x_high_(x_high), y_low_(y_low), y_high_(y_high) {
    if (!(x_low_ < x_high_)) x_low_ -= 0.5, x_high_ = x_low_ + 1;
    if (!(y_low_ < y_high_)) y_low_ -= 0.5, y_high_ = y_low_ + 1;
    svg_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + std::to_string(axes.width) + " " +
           std::to_string(axes.height) + "\" width=\"" + std::to_string(axes.width) + "\" height=\"" +
           std::to_string(axes.height) + "\" font-family=\"sans-serif\" font-size=\"11\">\n";
    svg_ += "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    text(axes.width / 2.0, 16, axes.title, "middle", " font-size=\"13\" font-weight=\"bold\"");
    text((kLeft + axes.width - kRight) / 2, axes.height - 6, axes.x_label, "middle");
    svg_ += "<text transform=\"translate(13," + number((kTop + axes.height - kBottom) / 2) +
            ") rotate(-90)\" text-anchor=\"middle\">" + escape_xml(axes.y_label) + "</text>\n";
    grid(x_numbers);
  }

  double px(double x) const { return kLeft + (x - x_low_) / (x_high_ - x_low_) * (axes_.width - kLeft - kRight); }
  double py(double y) const {
    const double inside = std::clamp(y, y_low_, y_high_);
    return axes_.height - kBottom - (inside - y_low_) / (y_high_ - y_low_) * (axes_.height - kTop - kBottom);
  }
  double bottom() const { return axes_.height - kBottom; }
  double left() const { return kLeft; }

  void add(const std::string& element) { svg_ += element + "\n"; }
  void text(double x, double y, const std::string& words, const char* anchor, const std::string& style = "") {
    svg_ += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" text-anchor=\"" + anchor + "\"" + style + ">" +
            escape_xml(words) + "</text>\n";
  }
  void polyline(const std::string& points, const std::string& style) {
    if (!points.empty()) add("<polyline points=\"" + points + "\" fill=\"none\" " + style + "/>");
  }
  std::string finish() { return svg_ + "</svg>\n"; }

  static constexpr double kLeft = 58, kRight = 14, kTop = 26, kBottom = 40;

 private:
  void grid(bool x_numbers) {
    const auto xs = x_numbers ? round_ticks(x_low_, x_high_) : std::vector<double>();
    const auto ys = round_ticks(y_low_, y_high_);
    const auto line = [&](double x1, double y1, double x2, double y2, const char* color) {
      add("<line x1=\"" + number(x1) + "\" y1=\"" + number(y1) + "\" x2=\"" + number(x2) + "\" y2=\"" + number(y2) +
          "\" stroke=\"" + color + "\" stroke-width=\"1\"/>");
    };
    const double right = axes_.width - kRight;
    for (const double x : xs) {
      line(px(x), kTop, px(x), bottom(), x == 0 ? "#999" : "#e6e6e6");
      text(px(x), bottom() + 14, tick_text(x, xs.size() > 1 ? xs[1] - xs[0] : 1), "middle");
    }
    for (const double y : ys) {
      line(kLeft, py(y), right, py(y), y == 0 ? "#999" : "#e6e6e6");
      text(kLeft - 5, py(y) + 4, tick_text(y, ys.size() > 1 ? ys[1] - ys[0] : 1), "end");
    }
    add("<rect x=\"" + number(kLeft) + "\" y=\"" + number(kTop) + "\" width=\"" + number(right - kLeft) +
        "\" height=\"" + number(bottom() - kTop) + "\" fill=\"none\" stroke=\"#444\"/>");
  }

  const Axes axes_;
  double x_low_, x_high_, y_low_, y_high_;
  std::string svg_;
};

void draw_band(Canvas& canvas, const Series& s) {
  std::string points;
  const auto flush = [&](std::size_t begin, std::size_t end) {
    if (end - begin < 2) return;
    points.clear();
    for (std::size_t i = begin; i < end; ++i)
      points += number(canvas.px(s.x[i])) + "," + number(canvas.py(s.high[i])) + " ";
    for (std::size_t i = end; i > begin; --i)
      points += number(canvas.px(s.x[i - 1])) + "," + number(canvas.py(s.low[i - 1])) + " ";
    canvas.add("<polygon points=\"" + points + "\" fill=\"" + s.color + "\" fill-opacity=\"0.18\"/>");
  };
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= s.x.size(); ++i)
    if (i == s.x.size() || !std::isfinite(s.y[i])) flush(begin, i), begin = i + 1;
}

void draw_series(Canvas& canvas, const Series& s) {
  if (!s.low.empty() && !s.bars) draw_band(canvas, s);
  std::string points;
  const std::string style = "stroke=\"" + s.color + "\" stroke-width=\"1.8\"";
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!std::isfinite(s.y[i])) {
      canvas.polyline(points, style);
      points.clear();
      continue;
    }
    const std::string x = number(canvas.px(s.x[i])), y = number(canvas.py(s.y[i]));
    points += x + "," + y + " ";
    if (s.dots) canvas.add("<circle cx=\"" + x + "\" cy=\"" + y + "\" r=\"2.6\" fill=\"" + s.color + "\"/>");
    if (s.bars && std::isfinite(s.low[i]) && std::isfinite(s.high[i]))
      canvas.add("<line x1=\"" + x + "\" x2=\"" + x + "\" y1=\"" + number(canvas.py(s.low[i])) + "\" y2=\"" +
                 number(canvas.py(s.high[i])) + "\" stroke=\"" + s.color + "\" stroke-opacity=\"0.6\"/>");
  }
  canvas.polyline(points, style);
}

}  // namespace

std::string escape_xml(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

std::vector<double> round_ticks(double low, double high) {
  if (!(low < high) || !std::isfinite(low) || !std::isfinite(high)) return {};
  const double raw = (high - low) / 7, power = std::pow(10, std::floor(std::log10(raw)));
  double step = power;
  for (const double m : {2.0, 2.5, 5.0, 10.0})
    if (step < raw) step = m * power;
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
  for (std::size_t i = 0; i < series.size(); ++i) {
    const double y = Canvas::kTop + 14 + 14 * double(i), x = axes.width - Canvas::kRight - 8;
    canvas.text(x - 22, y + 4, series[i].name, "end");
    canvas.add("<line x1=\"" + number(x - 18) + "\" x2=\"" + number(x) + "\" y1=\"" + number(y) + "\" y2=\"" +
               number(y) + "\" stroke=\"" + series[i].color + "\" stroke-width=\"3\"/>");
  }
  return canvas.finish();
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
    canvas.text(middle, canvas.bottom() + 14, violins[k].name, "middle");
    if (s.count == 0) {
      canvas.text(middle, canvas.bottom() - 8, "no data", "middle");
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
    std::string right, left;
    for (std::size_t b = 0; b < kBins && most > 0; ++b) {
      const double y = canvas.py(s.p5 + (double(b) + 0.5) / double(kBins) * span), w = half * density[b] / most;
      right += number(middle + w) + "," + number(y) + " ";
      left = number(middle - w) + "," + number(y) + " " + left;
    }
    if (!right.empty())
      canvas.add("<polygon points=\"" + right + left + "\" fill=\"" + violins[k].color +
                 "\" fill-opacity=\"0.45\" stroke=\"" + violins[k].color + "\"/>");
    const auto dash = [&](double y, double w, const char* color, const char* width) {
      canvas.add("<line x1=\"" + number(middle - w) + "\" x2=\"" + number(middle + w) + "\" y1=\"" +
                 number(canvas.py(y)) + "\" y2=\"" + number(canvas.py(y)) + "\" stroke=\"" + color +
                 "\" stroke-width=\"" + width + "\"/>");
    };
    dash(s.p5, 4, "#333", "1"), dash(s.p95, 4, "#333", "1");
    canvas.add("<line x1=\"" + number(middle) + "\" x2=\"" + number(middle) + "\" y1=\"" + number(canvas.py(s.p25)) +
               "\" y2=\"" + number(canvas.py(s.p75)) + "\" stroke=\"#333\" stroke-width=\"4\"/>");
    dash(s.mean, 9, "#d00", "2");
    canvas.add("<circle cx=\"" + number(middle) + "\" cy=\"" + number(canvas.py(s.median)) +
               "\" r=\"2.5\" fill=\"white\" stroke=\"#333\"/>");
  }
  return canvas.finish();
}

}  // namespace overtake::evaluation
