// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Ground removal.
#include "kernels/mark_ground.h"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::OwnedBits;
using test::OwnedPlane;

constexpr float kU = kAngleUndefined;

// The angle image as a drawing: '_' level, '/' steep, '?' undefined (pixel with a return), 'f' undefined and filled,
// 'F' steep and filled, '.' no range, '!' no range but steep.
std::string marked(int32_t row_count, std::initializer_list<const char*> picture) {
  const auto rows = int32_t(picture.size()), cols = int32_t(std::string(*picture.begin()).size());
  OwnedPlane<float> angle(rows, cols), range(rows, cols);
  OwnedPlane<int32_t> pixel_point(rows, cols);
  int32_t r = 0;
  for (const std::string line : picture) {
    for (int32_t c = 0; c < cols; ++c) {
      const char p = line[std::size_t(c)];
      angle.at(r, c) = p == '_' ? 0.1f : p == '/' || p == 'F' || p == '!' ? 1.2f : kU;
      range.at(r, c) = p == '.' || p == '!' ? 0.0f : 15.0f;
      pixel_point.at(r, c) = p == '_' || p == '/' || p == '?' ? 3 : kNoPoint;
    }
    ++r;
  }
  OwnedBits nonground(rows, cols);
  ref::mark_ground(test::paper_params().mark_ground, row_count, angle, range, pixel_point, nonground);
  CHECK(test::tail_is_clear(nonground));
  return art_of(nonground);
}

TEST_CASE("mark_ground: the pair (i, i + 1) decides the upper pixel i") {
  const std::string found = marked(4, {"_/_",  //
                                       "//_",  //
                                       "___",  //
                                       "???"});
  CHECK(found == drawn({".#.",  //
                        "##.",  //
                        "...",  //
                        "..."}));
}

TEST_CASE("mark_ground: the last row in use and all rows below are ground, also if steep") {
  const std::string found = marked(2, {"///",  //
                                       "/?/",  //
                                       "//?"});
  CHECK(found == drawn({"###",  //
                        "...",  //
                        "..."}));
  CHECK(marked(1, {"/"}) == drawn({"."}));
  CHECK(marked(0, {"..", ".."}) == drawn({"..", ".."}));
}

TEST_CASE("mark_ground: a return with an undefined pair is non-ground, a filled pixel is not") {
  const std::string found = marked(3, {"?f.F",  //
                                       "....",  //
                                       "____"});
  CHECK(found == drawn({"#..#",  //
                        "....",  //
                        "...."}));
}

TEST_CASE("mark_ground: the last return of a column is ground, whatever other columns contain below") {
  const std::string found = marked(4, {"?_?.",  //
                                       "._.?",  //
                                       ".?.f",  //
                                       ".__."});
  CHECK(found == drawn({"..#.",  //
                        "....",  //
                        ".#..",  //
                        "...."}));
}

TEST_CASE("mark_ground: a pixel without range is not non-ground") {
  CHECK(marked(2, {"!.", "__"}) == drawn({"..", ".."}));
}

TEST_CASE("mark_ground: the threshold is 20 deg and must be exceeded") {
  const float threshold = test::paper_params().mark_ground.threshold_rad;
  CHECK(double(threshold) == doctest::Approx(20.0 * 3.14159265358979 / 180.0));
  OwnedPlane<float> angle({{threshold, std::nextafter(threshold, 1.0f), -0.5f}, {kU, kU, kU}});
  OwnedPlane<float> range({{9.0f, 9.0f, 9.0f}, {9.0f, 9.0f, 9.0f}});
  OwnedPlane<int32_t> pixel_point({{0, 1, 2}, {3, 4, 5}});
  OwnedBits nonground(2, 3);
  ref::mark_ground(test::paper_params().mark_ground, 2, angle, range, pixel_point, nonground);
  CHECK(art_of(nonground) == drawn({".#.", "..."}));
}

}  // namespace
}  // namespace overtake
