// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Which slots may be near a place: square cells at least twice as wide as `near`, so all that is near a place lies in
// its cell or in the three that touch the nearest corner of it. Cells 32 apart share a list.
#pragma once

#include <algorithm>

#include "core/arena.h"
#include "pipeline/track/iteration.h"

namespace overtake {

class PlaceGrid {
 public:
  void carve(Carver& carver, int32_t slots, double near_m) {
    first_ = carver.take<int32_t>(kSide * kSide);
    next_ = carver.take<int32_t>(std::size_t(slots));
    cells_per_m_ = kMargin / (2.0 * near_m);
  }
  void clear() noexcept { std::fill_n(first_, kSide * kSide, -1); }
  void add(int32_t slot, Place place) noexcept {
    int32_t& first = first_[list_of(cell_of(place.x_m).own, cell_of(place.y_m).own)];
    next_[slot] = first;
    first = slot;
  }
  // Calls f(slot) once for each slot that may be near, and for others.
  template <class F>
  void for_each_near(Place place, F&& f) const noexcept {
    const Cell x = cell_of(place.x_m), y = cell_of(place.y_m);
    for (const int32_t list :
         {list_of(x.own, y.own), list_of(x.beside, y.own), list_of(x.own, y.beside), list_of(x.beside, y.beside)})
      for (int32_t slot = first_[list]; slot >= 0; slot = next_[slot]) f(slot);
  }

 private:
  static constexpr int64_t kSide = 32;
  static constexpr double kMargin = 0.99;  // for round-off far from the origin

  struct Cell {
    int64_t own, beside;  // beside: on the nearer side
  };
  Cell cell_of(double along_m) const noexcept {
    const double cells = along_m * cells_per_m_;
    int64_t own = int64_t(cells);
    if (cells < double(own)) --own;
    return {own, cells - double(own) < 0.5 ? own - 1 : own + 1};
  }
  static int32_t list_of(int64_t x, int64_t y) noexcept {
    return int32_t((y & (kSide - 1)) * kSide + (x & (kSide - 1)));
  }

  double cells_per_m_ = 0;
  int32_t *first_ = nullptr, *next_ = nullptr;  // by list and by slot: -1 none
};

}  // namespace overtake
