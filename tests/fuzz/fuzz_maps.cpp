// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Track maps from text files and from columns of any numbers. A map that was built answers every query with finite
// numbers, and its projection is the nearest of all segments. The first byte selects the input.
#include <cmath>
#include <vector>

#include "core/circuit_map.h"
#include "tests/fuzz/memory_file.h"
#include "tools/io/error.h"
#include "tools/io/map_file.h"

using namespace overtake;

namespace {

struct Line {
  std::vector<double> x, y, left, right, banking;
};

// Corners a few metres apart, sometimes anywhere; or any numbers.
Line draw_line(fuzz::Bytes& in, int32_t count) {
  Line line;
  const bool wild = in.chance(40);
  double x = 0, y = 0;
  for (int32_t i = 0; i < count; ++i) {
    if (wild) {
      x = in.raw<double>(), y = in.raw<double>();
    } else {
      x += 0.25 * in.in(-40, 60), y += 0.25 * in.in(-40, 60);
      if (in.chance(3)) x *= 1e5;
    }
    line.x.push_back(x);
    line.y.push_back(y);
    line.left.push_back(wild ? in.raw<double>() : 0.1 * in.byte());
    line.right.push_back(wild ? in.raw<double>() : 0.1 * in.byte());
    line.banking.push_back(wild ? in.raw<double>() : 0.0039 * in.byte());
  }
  return line;
}

void ask(const CircuitMap& map, const Line& line, fuzz::Bytes& in) {
  OVT_FUZZ_REQUIRE(std::isfinite(map.length_m()) && map.length_m() > 0);
  int32_t hint = -1;
  for (int32_t q = 0; q < 6; ++q) {
    const double s = in.chance(200) ? in.in(-2000, 4000) : in.raw<double>();
    const MapPose pose = map.at(s);
    for (const double v : {pose.x_m, pose.y_m, pose.heading_rad, pose.curvature_per_m, pose.width_left_m})
      OVT_FUZZ_REQUIRE(std::isfinite(v));
    const double x = in.chance(230) ? 0.5 * in.in(-500, 500) : in.raw<double>();
    const double y = in.chance(230) ? 0.5 * in.in(-500, 500) : in.raw<double>();
    const MapProjection p = map.project(x, y, hint);
    const MapProjection no_hint = map.project(x, y);
    OVT_FUZZ_REQUIRE(p.segment == no_hint.segment && p.s_m == no_hint.s_m && p.d_m == no_hint.d_m);
    if (p.segment < 0) {
      OVT_FUZZ_REQUIRE(!p.inside && !(std::fabs(x) <= kMaxMapCoordinate && std::fabs(y) <= kMaxMapCoordinate));
      continue;
    }
    OVT_FUZZ_REQUIRE(p.segment < map.segment_count());
    for (const double v : {p.s_m, p.d_m, p.heading_rad, p.curvature_per_m, p.width_left_m, p.width_right_m})
      OVT_FUZZ_REQUIRE(std::isfinite(v));
    hint = in.chance(128) ? p.segment : in.in(-3, map.segment_count() + 2);
    const auto n = line.x.size();
    for (std::size_t i = 0; i + 1 < n; ++i) {  // no corner and no segment is nearer
      const SegmentFoot f = find_foot(line.x[i], line.y[i], line.x[i + 1], line.y[i + 1], x, y);
      OVT_FUZZ_REQUIRE(p.d_m * p.d_m <= f.distance2 * (1 + 1e-9) + 1e-9);
    }
  }
}

void build_from_columns(fuzz::Bytes& in) {
  const int32_t count = in.in(0, 40);
  const bool closed = in.chance(128), bounds = in.chance(80);
  const Line line = draw_line(in, count);
  CircuitMap map;
  const char* error = nullptr;
  bool good;
  if (bounds) {
    const Line other = draw_line(in, in.in(0, 40));
    good = map.build_from_bounds(line.x.data(), line.y.data(), count, other.x.data(), other.y.data(),
                                 int32_t(other.x.size()), closed, &error);
  } else {
    good = map.build(line.x.data(), line.y.data(), line.left.data(), line.right.data(),
                     in.chance(128) ? line.banking.data() : nullptr, count, closed, &error);
  }
  OVT_FUZZ_REQUIRE(good == !map.empty());
  OVT_FUZZ_REQUIRE(good || (error && *error));
  if (good) ask(map, bounds ? Line() : line, in);
}

void read_file(fuzz::Bytes& in) {
  static fuzz::MemoryFile first, second;
  std::string paths;
  if (in.byte() % 4 == 0) {
    const std::string_view text = in.rest(), half = text.substr(0, text.size() / 2);
    paths = first.write(half) + "," + second.write(text.substr(half.size()));
  } else {
    paths = first.write(in.rest());
  }
  const io::MapData data = io::read_map(paths);
  const auto n = data.x_m.size();
  OVT_FUZZ_REQUIRE(data.y_m.size() == n && data.width_left_m.size() == n && data.width_right_m.size() == n);
  OVT_FUZZ_REQUIRE(data.banking_rad.empty() || data.banking_rad.size() == n);
  OVT_FUZZ_REQUIRE(data.left_x_m.size() == data.left_y_m.size() && data.right_x_m.size() == data.right_y_m.size());
  CircuitMap map;
  const char* error = nullptr;
  bool good;
  if (data.is_bounds())
    good = map.build_from_bounds(data.left_x_m.data(), data.left_y_m.data(), int32_t(data.left_x_m.size()),
                                 data.right_x_m.data(), data.right_y_m.data(), int32_t(data.right_x_m.size()),
                                 data.closed, &error);
  else
    good = map.build(data.x_m.data(), data.y_m.data(), data.width_left_m.data(), data.width_right_m.data(),
                     data.banking_rad.empty() ? nullptr : data.banking_rad.data(), int32_t(n), data.closed, &error);
  fuzz::Bytes questions(reinterpret_cast<const uint8_t*>(in.rest().data()), in.left());
  if (good) ask(map, {}, questions);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, std::size_t size) {
  fuzz::Bytes in(data, size);
  if (in.byte() % 2 == 0) {
    build_from_columns(in);
    return 0;
  }
  try {
    read_file(in);
  } catch (const io::Error& error) {
    OVT_FUZZ_REQUIRE(*error.what() != '\0');
  }
  return 0;
}
