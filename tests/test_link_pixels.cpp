// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Links neighbouring pixels of one object (eq. 2).
#include "kernels/link_pixels.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/images.h"
#include "tests/support/paper_params.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::kDegree;
using test::OwnedBits;
using test::OwnedPlane;

constexpr double kPitch = 0.14 * kDegree;
constexpr double kThreshold = 2.5 * kDegree;

LinkPixelsParams paper(bool wraps = false) {
  LinkPixelsParams params = test::paper_params().link_pixels;
  params.sin_pitch = float(std::sin(kPitch));
  params.cos_pitch = float(std::cos(kPitch));
  params.wraps = wraps;
  return params;
}

// beta as in the paper's figure, with the errors of the printed formula corrected.
double beta(double r1, double r2, double alpha) {
  const double d1 = std::max(r1, r2), d2 = std::min(r1, r2);
  return std::atan2(d2 * std::sin(alpha), d1 - d2 * std::cos(alpha));
}

struct Linked {
  Linked(const LinkPixelsParams& params, OwnedPlane<float> range, OwnedPlane<float> elevation, OwnedBits bits)
      : right(range.view().rows, range.view().cols), down(range.view().rows, range.view().cols) {
    ref::link_pixels(params, range, elevation, bits, right, down);
    CHECK(test::tail_is_clear(right));
    CHECK(test::tail_is_clear(down));
  }
  OwnedBits right, down;
};

TEST_CASE("link_pixels: the threshold's tangent is that of 2.5 deg") {
  CHECK(double(paper().tan_threshold) == doctest::Approx(std::tan(kThreshold)));
}

TEST_CASE("link_pixels: joins if beta exceeds the threshold: near neighbours, but not across a jump in depth") {
  // range  20  20.1  30  30     the step from 20.1 to 30 is a gap between two objects
  Linked l(paper(), {{20.0f, 20.1f, 30.0f, 30.0f}}, {{0.0f, 0.0f, 0.0f, 0.0f}}, {"####"});
  CHECK(art_of(l.right) == drawn({"#.#."}));
  CHECK(art_of(l.down) == drawn({"...."}));
}

TEST_CASE("link_pixels: equal ranges join to the right, where the printed formula divides by zero") {
  Linked l(paper(), {{20.0f, 20.0f}}, {{0.0f, 0.0f}}, {"##"});
  CHECK(art_of(l.right) == drawn({"#."}));
}

TEST_CASE("link_pixels: downwards alpha is the elevation difference, in both directions") {
  // 0.2 deg apart at 20 m: 70 mm; beta > 2.5 deg up to a step of 1.6 m
  const auto e = float(0.2 * kDegree);
  Linked l(paper(), {{20.0f, 20.0f, 20.0f, 21.4f}, {20.0f, 21.4f, 22.0f, 20.0f}},
           {{e, e, e, -e}, {0.0f, 0.0f, 0.0f, 0.0f}}, {"####", "####"});
  CHECK(art_of(l.down) == drawn({"##.#", "...."}));
}

TEST_CASE("link_pixels: two layers at one elevation do not join, not even at equal ranges") {
  Linked l(paper(), {{20.0f, 20.0f}, {20.0f, 21.0f}}, {{0.1f, 0.1f}, {0.1f, 0.1f}}, {"##", "##"});
  CHECK(art_of(l.down) == drawn({"..", ".."}));
}

TEST_CASE("link_pixels: links only pixels of the repaired non-ground image") {
  Linked l(paper(), {{20.0f, 20.0f, 20.0f}, {20.0f, 20.0f, 20.0f}}, {{0.01f, 0.01f, 0.01f}, {0.0f, 0.0f, 0.0f}},
           {"##.", "#.#"});
  CHECK(art_of(l.right) == drawn({"#..", "..."}));
  CHECK(art_of(l.down) == drawn({"#..", "..."}));
}

TEST_CASE("link_pixels: the last column joins column 0 only if columns wrap") {
  const OwnedPlane<float> range({{20.0f, 50.0f, 20.0f}}), elevation({{0.0f, 0.0f, 0.0f}});
  CHECK(art_of(Linked(paper(false), range, elevation, {"###"}).right) == drawn({"..."}));
  CHECK(art_of(Linked(paper(true), range, elevation, {"###"}).right) == drawn({"..#"}));
  CHECK(art_of(Linked(paper(true), {{20.0f}}, {{0.0f}}, {"#"}).right) == drawn({"."}));  // not with itself
}

TEST_CASE("link_pixels: agrees with atan2 away from the threshold, on random images") {
  int32_t linked = 0, apart = 0;
  for (uint32_t seed = 1; seed <= 30; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> base(2, 120), step(-1.5f, 1.5f), angle(-0.4f, 0.4f), tiny(-0.01f, 0.01f);
    const int32_t rows = 1 + int32_t(random() % 6), cols = 1 + int32_t(random() % 150);
    const bool wraps = random() % 2 == 0;
    OwnedPlane<float> range(rows, cols), elevation(rows, cols);
    OwnedBits bits(rows, cols);
    bits.clear();
    const float middle = base(random);
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        range.at(r, c) = std::max(1.0f, middle + step(random) * 0.06f * middle);
        elevation.at(r, c) = random() % 4 == 0 ? angle(random) : tiny(random);
        if (random() % 8 != 0) bits.view().set(r, c);
      }
    Linked l(paper(wraps), range, elevation, bits);
    auto judge = [&](double b, bool link) {
      if (std::fabs(b - kThreshold) < 1e-4) return;
      CHECK(link == (b > kThreshold));
      ++(link ? linked : apart);
    };
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        const bool own = bits.view().test(r, c);
        const int32_t right = c + 1 < cols ? c + 1 : wraps && cols > 1 ? 0 : -1;
        if (right >= 0 && own && bits.view().test(r, right))
          judge(beta(double(range.at(r, c)), double(range.at(r, right)), kPitch), l.right.view().test(r, c));
        else
          CHECK_FALSE(l.right.view().test(r, c));
        if (r + 1 < rows && own && bits.view().test(r + 1, c))
          judge(beta(double(range.at(r, c)), double(range.at(r + 1, c)),
                     std::fabs(double(elevation.at(r, c)) - double(elevation.at(r + 1, c)))),
                l.down.view().test(r, c));
        else
          CHECK_FALSE(l.down.view().test(r, c));
      }
  }
  CHECK(linked > 1000);
  CHECK(apart > 1000);
}

}  // namespace
}  // namespace overtake
