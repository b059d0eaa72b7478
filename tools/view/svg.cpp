// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/view/svg.h"

#include <cmath>
#include <cstdio>

#include "tools/io/base64.h"

namespace overtake::cli {
namespace {

std::string attribute(const char* name, double value) {
  return std::string(" ") + name + "=\"" + svg_number(value) + "\"";
}

std::string list_of(const std::vector<SvgPoint>& points) {
  std::string out;
  for (const SvgPoint& p : points) out += (out.empty() ? "" : " ") + svg_number(p.x) + "," + svg_number(p.y);
  return out;
}

}  // namespace

std::string escape_xml(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : std::string(1, c);
  return out;
}

std::string svg_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", std::fabs(value) < 0.005 ? 0.0 : value);
  std::string out = text;
  out.erase(out.find_last_not_of('0') + 1);
  if (out.back() == '.') out.pop_back();
  return out;
}

Svg::Svg(int32_t width, int32_t height) {
  const std::string w = std::to_string(width), h = std::to_string(height);
  text_ = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + w + " " + h + "\" width=\"" + w +
          "\" height=\"" + h + "\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"11\">\n" +
          "<rect class=\"card\" width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
}

void Svg::text(double x, double y, const std::string& words, const char* anchor, const std::string& style) {
  add("<text" + attribute("x", x) + attribute("y", y) + " text-anchor=\"" + anchor + "\"" +
      (style.find("fill=") == std::string::npos ? " class=\"ink\" fill=\"#333\"" : "") + style + ">" +
      escape_xml(words) + "</text>");
}

void Svg::upward_text(double x, double y, const std::string& words) {
  add("<text transform=\"translate(" + svg_number(x) + "," + svg_number(y) +
      ") rotate(-90)\" text-anchor=\"middle\" class=\"ink\" fill=\"#333\">" + escape_xml(words) + "</text>");
}

void Svg::line(SvgPoint a, SvgPoint b, const std::string& style) {
  add("<line" + attribute("x1", a.x) + attribute("y1", a.y) + attribute("x2", b.x) + attribute("y2", b.y) + style +
      "/>");
}

void Svg::polyline(const std::vector<SvgPoint>& points, const std::string& style) {
  if (!points.empty()) add("<polyline points=\"" + list_of(points) + "\" fill=\"none\"" + style + "/>");
}

void Svg::polygon(const std::vector<SvgPoint>& points, const std::string& style) {
  if (!points.empty()) add("<polygon points=\"" + list_of(points) + "\"" + style + "/>");
}

void Svg::circle(SvgPoint at, double radius, const std::string& style) {
  add("<circle" + attribute("cx", at.x) + attribute("cy", at.y) + attribute("r", radius) + style + "/>");
}

void Svg::rectangle(double x, double y, double width, double height, const std::string& style) {
  add("<rect" + attribute("x", x) + attribute("y", y) + attribute("width", width) + attribute("height", height) +
      style + "/>");
}

void Svg::image(double x, double y, double width, double height, const io::Picture& picture) {
  add("<image" + attribute("x", x) + attribute("y", y) + attribute("width", width) + attribute("height", height) +
      " preserveAspectRatio=\"none\" style=\"image-rendering:pixelated\" href=\"data:image/png;base64," +
      io::encode_base64(io::encode_png(picture)) + "\"/>");
}

}  // namespace overtake::cli
