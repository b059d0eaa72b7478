// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// SVG as text, for plots and pictures. As a separate file it is black on white. In the report, style sheets recolour
// the classes ink, grid and card for light and dark (they override presentation attributes).
#pragma once

#include <string>
#include <vector>

#include "tools/io/image.h"

namespace overtake::cli {

struct SvgPoint {
  double x, y;
};

class Svg {
 public:
  Svg(int32_t width, int32_t height);

  // `style`: more attributes, each with a space before it.
  void text(double x, double y, const std::string& words, const char* anchor = "start", const std::string& style = "");
  void upward_text(double x, double y, const std::string& words);  // centred
  void line(SvgPoint a, SvgPoint b, const std::string& style);
  void polyline(const std::vector<SvgPoint>& points, const std::string& style);
  void polygon(const std::vector<SvgPoint>& points, const std::string& style);
  void circle(SvgPoint at, double radius, const std::string& style);
  void rectangle(double x, double y, double width, double height, const std::string& style);
  // Pixels, stretched to the rectangle without smoothing.
  void image(double x, double y, double width, double height, const io::Picture& picture);
  void add(const std::string& element) { text_ += element + "\n"; }
  std::string finish() const { return text_ + "</svg>\n"; }

 private:
  std::string text_;
};

inline constexpr const char* kInkLine = " class=\"ink\" stroke=\"#333\"";
inline constexpr const char* kInkFill = " class=\"ink\" fill=\"#333\"";
inline constexpr const char* kGridLine = " class=\"grid\" stroke=\"#e2e2e2\"";

std::string escape_xml(const std::string& text);
std::string svg_number(double value);  // at most two digits after the point

}  // namespace overtake::cli
