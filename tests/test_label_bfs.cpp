// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Connected components of the linked pixels.
#include "kernels/label_bfs.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "tests/support/images.h"

namespace overtake {
namespace {

using test::art_of;
using test::drawn;
using test::OwnedBits;
using test::OwnedPlane;

struct Labelled {
  Labelled(bool wraps, OwnedPlane<float> range, OwnedBits bits, OwnedBits right, OwnedBits down)
      : labels(range.view().rows, range.view().cols) {
    const Plane<float> shape = range.view();
    std::vector<int32_t> queue(std::size_t(shape.rows) * std::size_t(shape.cols));
    count = ref::label_bfs(wraps, range, bits, right, down, labels, queue.data());
  }
  std::string picture() { return art_of(Plane<const int32_t>(labels)); }
  OwnedPlane<int32_t> labels;
  int32_t count = -1;
};

OwnedPlane<float> all_returns(int32_t rows, int32_t cols) { return OwnedPlane<float>(rows, cols).fill(9.0f); }

TEST_CASE("label_bfs: numbers clusters by their first pixel in row-major order") {
  // nonground   right        down        labels
  // ..#.#       ....#        ..#.#       __1_2
  // #.#.#       .....        #....   ->  3_1_2
  // ##.#.       #....        .....       33_4_
  Labelled l(false, all_returns(3, 5), {"..#.#", "#.#.#", "##.#."}, {".....", ".....", "#...."},
             {"..#.#", "#....", "....."});
  CHECK(l.count == 4);
  CHECK(l.picture() == drawn({"__1_2", "3_1_2", "33_4_"}));
}

TEST_CASE("label_bfs: follows links backwards: a spiral found from its top is one cluster") {
  // ####        every neighbouring pair of the spiral linked
  // ...#
  // ##.#
  // #..#
  // ####
  Labelled l(false, all_returns(5, 4), {"####", "...#", "##.#", "#..#", "####"},
             {"###.", "....", "#...", "....", "###."}, {"...#", "...#", "#..#", "#..#", "...."});
  CHECK(l.count == 1);
  CHECK(l.picture() == drawn({"1111", "___1", "11_1", "1__1", "1111"}));
}

TEST_CASE("label_bfs: separates neighbours without a link, and diagonal pixels") {
  Labelled l(false, all_returns(2, 4), {"##.#", "..#."}, {"....", "...."}, {"....", "...."});
  CHECK(l.count == 4);
  CHECK(l.picture() == drawn({"12_3", "__4_"}));
}

TEST_CASE("label_bfs: gives -1 to a pixel without range, 0 to a pixel with range and without cluster") {
  OwnedPlane<float> range({{5.0f, 0.0f, 5.0f, 0.0f}});
  Labelled l(false, range, {"#..#"}, {"...."}, {"...."});  // the last pixel is a repaired one
  CHECK(l.picture() == drawn({"1._2"}));
}

TEST_CASE("label_bfs: joins across the azimuth seam only if columns wrap") {
  const OwnedBits bits{"#..#", "....", "#..#"}, right{"...#", "....", "...."}, none{"....", "....", "...."};
  CHECK(Labelled(true, all_returns(3, 4), bits, right, none).picture() == drawn({"1__1", "____", "2__3"}));
  CHECK(Labelled(false, all_returns(3, 4), bits, right, none).picture() == drawn({"1__2", "____", "3__4"}));
}

TEST_CASE("label_bfs: handles an image without clusters, and a single pixel") {
  CHECK(Labelled(false, all_returns(1, 3), {"..."}, {"..."}, {"..."}).count == 0);
  Labelled one(true, all_returns(1, 1), {"#"}, {"#"}, {"."});
  CHECK(one.count == 1);
  CHECK(one.picture() == drawn({"1"}));
}

// An independent solution: union-find over the links, then numbers in row-major order.
std::vector<int32_t> by_union_find(bool wraps, ConstBitPlane bits, ConstBitPlane right, ConstBitPlane down) {
  const int32_t rows = bits.rows, cols = bits.cols;
  std::vector<int32_t> parent(std::size_t(rows) * std::size_t(cols)), label(parent.size(), 0), number = label;
  std::iota(parent.begin(), parent.end(), 0);
  auto find = [&](int32_t i) {
    while (parent[std::size_t(i)] != i) {
      parent[std::size_t(i)] = parent[std::size_t(parent[std::size_t(i)])];  // path halving
      i = parent[std::size_t(i)];
    }
    return i;
  };
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t c = 0; c < cols; ++c) {
      if (right.test(r, c) && (c + 1 < cols || wraps))
        parent[std::size_t(find(r * cols + c))] = find(r * cols + (c + 1) % cols);
      if (down.test(r, c)) parent[std::size_t(find(r * cols + c))] = find((r + 1) * cols + c);
    }
  int32_t next = 0;
  for (int32_t i = 0; i < rows * cols; ++i) {
    if (!bits.test(i / cols, i % cols)) continue;
    int32_t& n = number[std::size_t(find(i))];
    if (n == 0) n = ++next;
    label[std::size_t(i)] = n;
  }
  return label;
}

TEST_CASE("label_bfs: agrees with union-find on random link images") {
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const int32_t rows = seed % 10 == 0 ? 128 : 1 + int32_t(random() % 32);
    const int32_t cols = seed % 10 == 0 ? 2048 : 1 + int32_t(random() % 300);
    const bool wraps = seed % 2 == 0;
    const auto density = 30 + random() % 70, bond = 30 + random() % 70;  // percent, around the percolation limit
    OwnedBits bits(rows, cols), right(rows, cols), down(rows, cols);
    bits.clear();
    right.clear();
    down.clear();
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c)
        if (random() % 100 < density) bits.view().set(r, c);
    for (int32_t r = 0; r < rows; ++r)
      for (int32_t c = 0; c < cols; ++c) {
        if (!bits.view().test(r, c)) continue;
        const int32_t next = c + 1 < cols ? c + 1 : wraps ? 0 : -1;
        if (next >= 0 && bits.view().test(r, next) && random() % 100 < bond) right.view().set(r, c);
        if (r + 1 < rows && bits.view().test(r + 1, c) && random() % 100 < bond) down.view().set(r, c);
      }
    Labelled l(wraps, all_returns(rows, cols), bits, right, down);
    const std::vector<int32_t> truth = by_union_find(wraps, bits, right, down);
    int32_t wrong = 0, largest = 0;
    for (int32_t i = 0; i < rows * cols; ++i) {
      wrong += l.labels.at(i / cols, i % cols) != truth[std::size_t(i)];
      largest = std::max(largest, truth[std::size_t(i)]);
    }
    CHECK(wrong == 0);
    CHECK(l.count == largest);
  }
}

}  // namespace
}  // namespace overtake
