// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Labels after weak links are cut in clusters that are longer than a car.
#include "kernels/label_cut.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "kernels/kernel_table.h"
#include "kernels/label_bfs.h"
#include "kernels/link_pixels.h"
#include "tests/support/images.h"
#include "tests/support/ray_scene.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::kDegree;
using test::OwnedBits;
using test::OwnedPlane;

constexpr double kPitch = 0.2 * kDegree;
constexpr float kRow = float(0.8 * kDegree);  // between two rows

// At 30 m a link to the right with 2.8 deg < beta <= 6 deg has a step of 1.0 to 2.1 m; a link down, of 3.8 to 7.6 m.
// No cluster is in line.
CutLinksParams usual() {
  return {.tan_threshold = float(std::tan(6 * kDegree)),
          .sin_pitch = float(std::sin(kPitch)),
          .cos_pitch = float(std::cos(kPitch)),
          .step_m = 2.0f,
          .min_length_m = 5.5f,
          .max_length_m = 10.0f,
          .in_line_length_m = 3.0f,
          .in_line_width_m = 0.0f,
          .in_line_step_m = 3.0f,
          .abreast_width_m = 100.0f,
          .abreast_step_m = 1.0f};
}
CutLinksParams with_in_line() {
  CutLinksParams params = usual();
  params.in_line_width_m = 2.0f;
  return params;
}

// Ranges in metres; 0: no pixel. All neighbours are linked.
struct Cut {
  Cut(const CutLinksParams& params, OwnedPlane<float> range, bool wraps = false)
      : right(range.view().rows, range.view().cols),
        down(range.view().rows, range.view().cols),
        labels(range.view().rows, range.view().cols) {
    const int32_t rows = range.view().rows, cols = range.view().cols;
    OwnedPlane<float> elevation(rows, cols);
    OwnedBits nonground(rows, cols);
    const auto is_there = [&](int32_t r, int32_t c) {
      return r < rows && (c < cols || wraps) && range.at(r, c % cols) > 0.0f;
    };
    for (OwnedBits* bits : {&nonground, &right, &down}) bits->clear();
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        elevation.at(r, c) = -kRow * float(r);
        if (!is_there(r, c)) continue;
        nonground.view().set(r, c);
        if (is_there(r, c + 1)) right.view().set(r, c);
        if (is_there(r + 1, c)) down.view().set(r, c);
      }
    std::vector<int32_t> queue(std::size_t(rows * cols));
    const auto label = [&] { return ref::label_bfs(wraps, range, nonground, right, down, labels, queue.data()); };
    const int32_t label_count = label();
    std::vector<LabelExtent> extents(std::size_t(label_count) + 1);
    count =
        ref::cut_links(params, wraps, range, elevation, nonground, labels, label_count, right, down, extents.data());
    clusters = label();
  }
  OwnedBits right, down;
  OwnedPlane<int32_t> labels;
  int32_t count, clusters;  // of links that are cut; of clusters after that
};

TEST_CASE("cut_links: two cars in one cluster become two, above one another and side by side") {
  Cut nose_to_tail(usual(), {{36.0f, 36.0f, 36.1f}, {30.1f, 30.0f, 30.0f}});
  CHECK(nose_to_tail.count == 3);
  CHECK(art_of(nose_to_tail.labels) == drawn({"111", "222"}));
  Cut side_by_side(usual(), {{30.0f, 30.1f, 31.5f, 33.2f, 35.9f, 36.0f}});
  CHECK(side_by_side.count == 3);
  CHECK(art_of(side_by_side.labels) == drawn({"112344"}));
}

TEST_CASE("cut_links: a cluster as long as a car, and one as long as a wall, stay as they are") {
  CHECK(Cut(usual(), {{35.4f, 35.4f}, {30.0f, 30.0f}}).count == 0);
  CHECK(Cut(usual(), {{35.6f, 35.6f}, {30.0f, 30.0f}}).count == 2);
  CHECK(Cut(usual(), {{39.9f, 39.9f}, {30.0f, 30.0f}}).count == 2);
  CHECK(Cut(usual(), {{40.1f, 40.1f}, {30.0f, 30.0f}}).count == 0);
}

TEST_CASE("cut_links: the length is that of the diagonal, of columns and ranges") {
  // 51 columns at 32 m are 5.6 m wide; 5.2 m with 2 m of depth are 5.5 m long.
  const auto row_of = [](int32_t cols, float last_m) {
    OwnedPlane<float> range(2, cols);
    range.fill(32.0f);
    for (int32_t c = 0; c < cols; ++c) range.at(1, c) = 0.0f;
    range.at(0, cols - 1) = last_m;
    return range;
  };
  CHECK(Cut(usual(), row_of(45, 34.0f)).count == 0);   // 4.9 and 2 m
  CHECK(Cut(usual(), row_of(51, 34.0f)).count == 1);   // 5.7 and 2 m
  CHECK(Cut(usual(), row_of(100, 34.0f)).count == 0);  // 11.4 m
}

TEST_CASE("cut_links: a small step down stays, whatever its angle") {
  // The last step is one of 1.9 m between rows that almost touch.
  CHECK(Cut(usual(), {{36.0f}, {32.0f}, {30.1f}}).count == 0);
  CutLinksParams strict = usual();
  strict.tan_threshold = float(std::tan(80 * kDegree));
  CHECK(Cut(strict, {{36.0f}, {31.9f}, {30.0f}}).count == 1);
  strict.step_m = 1.8f;
  CHECK(Cut(strict, {{36.0f}, {31.9f}, {30.0f}}).count == 2);
}

TEST_CASE("cut_links: a narrow cluster shorter than a car is cut where it has a step that no car has") {
  // The far car's wing over the near car's.
  Cut in_line(with_in_line(), {{34.6f, 34.7f, 34.6f}, {30.1f, 30.0f, 30.0f}});
  CHECK(in_line.count == 3);
  CHECK(art_of(in_line.labels) == drawn({"111", "222"}));
  CHECK(Cut(usual(), {{34.6f, 34.7f, 34.6f}, {30.1f, 30.0f, 30.0f}}).count == 0);
  // A part of the far car beside the near one.
  Cut beside(with_in_line(), {{30.0f, 30.0f, 33.5f, 33.5f}});
  CHECK(beside.count == 1);
  CHECK(art_of(beside.labels) == drawn({"1122"}));
  // Steps of less than 3 m, each a weak link: one car.
  CutLinksParams weak = with_in_line();
  weak.tan_threshold = float(std::tan(40 * kDegree));
  CHECK(Cut(weak, {{34.8f}, {32.4f}, {30.0f}}).count == 0);
  CHECK(Cut(weak, {{30.0f, 32.5f, 34.9f}}).count == 0);
  CHECK(Cut(weak, {{35.0f}, {33.1f}, {30.0f}}).count == 1);
  // Not as long as 3 m.
  weak.in_line_step_m = 2.5f;
  CHECK(Cut(weak, {{32.9f}, {30.0f}}).count == 0);
  CHECK(Cut(weak, {{33.1f}, {30.0f}}).count == 1);
  // 18 columns at 32 m are 1.9 m wide, 20 are 2.1 m.
  const auto of_width = [](int32_t cols) {
    OwnedPlane<float> range(2, cols);
    range.fill(34.6f);
    for (int32_t c = 0; c < cols; ++c) range.at(1, c) = 30.0f;
    return range;
  };
  CHECK(Cut(with_in_line(), of_width(18)).count == 18);
  CHECK(Cut(with_in_line(), of_width(20)).count == 0);
  // A long one is cut as before.
  CHECK(Cut(with_in_line(), {{30.0f, 30.1f, 31.5f, 33.2f, 35.9f, 36.0f}}).count == 3);
}

TEST_CASE("cut_links: a cluster as wide as two cars is cut where it has a step between them") {
  // Two rows of 41 columns at 30 m are 4.2 m wide from the first to the last.
  const auto of = [](int32_t cols, float step_m, float down_m = 0.0f) {
    OwnedPlane<float> range(2, cols);
    range.fill(30.0f);
    for (int32_t c = 0; c < cols; ++c) {
      range.at(0, c) += down_m + (c < cols / 2 ? 0.0f : step_m);
      range.at(1, c) += c < cols / 2 ? 0.0f : step_m;
    }
    return range;
  };
  CutLinksParams params = usual();
  params.abreast_width_m = 4.0f;
  params.abreast_step_m = 1.2f;
  CHECK(Cut(params, of(41, 1.5f)).count == 2);
  CHECK(Cut(params, of(36, 1.5f)).count == 0);
  CHECK(Cut(usual(), of(41, 1.5f)).count == 0);
  CHECK(Cut(params, of(100, 1.5f)).count == 0);  // a wall
  // A step as of one car that is seen from its side.
  CHECK(Cut(params, of(41, 1.1f)).count == 0);
  params.abreast_step_m = 1.0f;
  CHECK(Cut(params, of(41, 1.1f)).count == 2);
  // A step down: as in line, though it is large enough for a long cluster.
  params.tan_threshold = float(std::tan(40 * kDegree));
  CHECK(Cut(params, of(41, 0.0f, 2.5f)).count == 0);
  CHECK(Cut(params, of(41, 0.0f, 3.1f)).count == 41);
}

TEST_CASE("cut_links: only the links of the long cluster") {
  Cut cut(usual(), {{36.0f, 0.0f, 33.0f, 31.1f}, {30.0f, 0.0f, 0.0f, 0.0f}});
  CHECK(cut.count == 1);
  CHECK(art_of(cut.labels) == drawn({"1.22", "3..."}));
  CHECK(art_of(cut.right) == drawn({"..#.", "...."}));
}

TEST_CASE("cut_links: words of 64 columns, and an image without a cluster") {
  OwnedPlane<float> range(1, 130);
  range.fill(0.0f);
  for (int32_t c = 60; c < 70; ++c) range.at(0, c) = c < 64 ? 30.0f : 36.0f;
  Cut cut(usual(), range);
  CHECK(cut.count == 1);
  CHECK_FALSE(cut.right.view().test(0, 63));
  CHECK(cut.right.view().test(0, 64));
  CHECK(Cut(usual(), {{0.0f, 0.0f}}).count == 0);
}

TEST_CASE("cut_links: a cluster across the first column of a sensor that wraps is cut as anywhere else") {
  struct {
    CutLinksParams params;
    OwnedPlane<float> range;
    int32_t cuts, clusters;
  } scenes[] = {{usual(), {{36.0f, 36.0f, 36.1f}, {30.1f, 30.0f, 30.0f}}, 3, 2},
                {usual(), {{30.0f, 30.1f, 31.5f, 33.2f, 35.9f, 36.0f}}, 3, 4},
                {with_in_line(), {{34.1f, 34.0f, 34.0f}, {30.1f, 30.0f, 30.0f}}, 3, 2},
                {usual(), {{35.4f, 35.4f}, {30.0f, 30.0f}}, 0, 1}};
  for (auto& scene : scenes)
    for (const int32_t cols : {40, 75})
      for (int32_t first = 0; first < cols; ++first) {
        CAPTURE(cols);
        CAPTURE(first);
        OwnedPlane<float> range(scene.range.view().rows, cols);
        range.fill(0.0f);
        for (int32_t r = 0; r < scene.range.view().rows; ++r)
          for (int32_t c = 0; c < scene.range.view().cols; ++c)
            range.at(r, (first + c) % cols) = scene.range.view().row(r)[c];
        const Cut cut(scene.params, range, true);
        CHECK(cut.count == scene.cuts);
        CHECK(cut.clusters == scene.clusters);
      }
}

TEST_CASE("cut_links: a wall around a sensor that wraps is long, wherever it is open") {
  constexpr int32_t kCols = 130;
  for (int32_t open = 0; open < kCols; ++open)
    for (const int32_t gap : {8, 20}) {
      OwnedPlane<float> range(1, kCols);
      for (int32_t k = 0; k < kCols; ++k)  // a step of 6 m in it is a weak link
        range.at(0, (open + k) % kCols) = k < gap ? 0.0f : k < kCols / 3 ? 30.0f : 36.0f;
      CAPTURE(open);
      CHECK(Cut(usual(), range, true).count == 0);
      // As long as two cars.
      for (int32_t k = 0; k < kCols; ++k)
        if (k < kCols / 3 - 8 || k >= kCols / 3 + 8) range.at(0, (open + k) % kCols) = 0.0f;
      CHECK(Cut(usual(), range, true).count == 1);
    }
}

// Rows of cars and walls: runs of all lengths, at a few ranges, that end at the edges of words and of the image.
TEST_CASE("label_cut: every ISA gives the labels of label_bfs after cut_links") {
  const KernelTable* tables[16] = {};
  const int32_t table_count = list_kernels(tables);
  int32_t images_with_cuts = 0;
  for (uint32_t seed = 1; seed <= 200; ++seed) {
    std::mt19937 random(seed);
    const int32_t rows = 6, cols = std::array{5, 64, 75, 130}[seed % 4];
    const bool wraps = seed % 3 == 0;
    OwnedPlane<float> range(rows, cols), elevation(rows, cols);
    OwnedBits nonground(rows, cols);
    nonground.clear();
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0, left = 0, step = 0; c < cols; ++c, --left) {
        if (left <= 0) left = int32_t(1 + random() % 20), step = int32_t(random() % 6);
        elevation.at(r, c) = -kRow * float(r);
        range.at(r, c) = step == 5 ? 0.0f : 30.0f + 1.5f * float(step) + 0.5f * float(random() % 3);
        if (step < 5) nonground.view().set(r, c);
      }
    LinkPixelsParams links = {float(std::tan(2.5 * kDegree)), float(std::sin(kPitch)), float(std::cos(kPitch)), wraps};
    CutLinksParams cut = usual();
    if (seed % 2 == 0) cut.tan_threshold = float(std::tan(20 * kDegree));  // then small steps down have weak links
    // Short clusters, too, of any width; in every fifth image no cluster is long enough without that.
    if (seed % 5 < 2) cut.in_line_width_m = 20.0f, cut.in_line_length_m = cut.in_line_step_m = 1.0f;
    if (seed % 5 == 0) cut.min_length_m = 9.9f;
    if (seed % 7 == 0) cut.abreast_width_m = cut.abreast_step_m = 3.0f;
    std::string by_cutting;
    for (int32_t t = -1; t < table_count; ++t) {
      CAPTURE(seed);
      CAPTURE(t);
      OwnedBits right(rows, cols), down(rows, cols);
      OwnedPlane<int32_t> labels(rows, cols);
      std::vector<int32_t> queue(std::size_t(rows * cols) + 1);
      std::vector<LabelExtent> extents(std::size_t(rows * cols) + 1);
      ref::link_pixels(links, range, elevation, nonground, right, down);
      int32_t count = 0;
      if (t < 0) {  // step by step
        const auto label = [&] { return ref::label_bfs(wraps, range, nonground, right, down, labels, queue.data()); };
        count = label();
        const int32_t cuts =
            ref::cut_links(cut, wraps, range, elevation, nonground, labels, count, right, down, extents.data());
        images_with_cuts += cuts > 0;
        count = label();
      } else {
        count = tables[t]->label_cut(cut, wraps, range, range, elevation, nonground, right, down, labels, queue.data(),
                                     extents.data());
      }
      std::string text = std::to_string(count) + '\n';
      for (int32_t r = 0; r < rows; ++r)
        for (int32_t c = 0; c < cols; ++c)
          text += std::to_string(labels.at(r, c)) + (right.view().test(r, c) ? '>' : ' ') +
                  (down.view().test(r, c) ? 'v' : ' ');
      if (t < 0) by_cutting = text;
      CHECK(text == by_cutting);
    }
  }
  CHECK(images_with_cuts > 30);
}

}  // namespace
}  // namespace overtake
