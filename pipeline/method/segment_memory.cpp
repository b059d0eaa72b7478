// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/method/segment_memory.h"

#include <algorithm>
#include <utility>

#include "pipeline/method/method.h"
#include "pipeline/segment_scratch.h"

namespace overtake {
namespace {

// Readers can read these of every frame: ovt_read_labels, and ovt_read_image of OVT_IMAGE_PIXEL_POINT.
constexpr Columns kPublished = columns(Column::point_label, Column::point_reason, Column::pixel_point);
constexpr Columns kImages = columns_of(Extent::pixels) | columns_of(Extent::points);

template <class T>
Plane<T> place(Carver& carver, Plane<T>&, const SensorModel& sensor, std::size_t) {
  return carver.take_plane<T>(sensor.rows, sensor.cols);
}
BitPlane place(Carver& carver, BitPlane&, const SensorModel& sensor, std::size_t) {
  return carver.take_bits(sensor.rows, sensor.cols);
}
template <class T>
T* place(Carver& carver, T*&, const SensorModel&, std::size_t count) {
  return carver.take<T>(count);
}

std::size_t count_elements(Extent extent, const SensorModel& sensor, int32_t point_capacity) {
  const std::size_t cells = std::size_t(sensor.rows) * std::size_t(sensor.cols);
  return extent == Extent::points   ? std::size_t(round_up(point_capacity, kRowAlign))
         : extent == Extent::layers ? std::size_t(kLayerIds)
         : extent == Extent::labels ? cells + 1
         : extent == Extent::rays   ? std::size_t(count_rays(sensor.cols))
         : extent == Extent::nodes  ? std::size_t(count_rays(sensor.cols)) * kNodes
                                    : cells;
}

// A piece of the block; its last column ends with step `last`.
struct Piece {
  std::size_t bytes;
  int32_t last;
};

// Chooses the smallest free piece that is large enough, else the largest free piece, else a new piece.
int32_t choose_piece(const Piece* pieces, int32_t count, std::size_t bytes, int32_t first) {
  int32_t best = count;
  for (int32_t i = 0; i < count; ++i) {
    if (pieces[i].last >= first) continue;
    if (best == count) {
      best = i;
      continue;
    }
    const std::size_t a = pieces[i].bytes, b = pieces[best].bytes;
    if (b < bytes ? a > b : a >= bytes && a < b) best = i;
  }
  return best;
}

void find_lives(const Method& method, SegmentPlan& plan) {
  std::fill_n(plan.first, kColumnCount, -1);
  const auto use = [&](Columns set, int32_t step) {
    for (int32_t c = 0; c < kColumnCount; ++c) {
      if (!has(set, Column(c))) continue;
      if (plan.first[c] < 0) plan.first[c] = step;
      plan.last[c] = step;
    }
  };
  int32_t at = 0;
  for (const Step& step : method.segment) use(step.reads | step.writes | step.scratch, at++);
}

// Calls f(column, its extent, its view) for each column in planned memory.
template <class F>
void for_each_planned_column(SensorPart& part, SegmentViews& views, F&& f) {
  for_each_segment_column(part, views, [&](Column column, auto extent, auto& view) {
    if constexpr (extent != Extent::own) f(column, extent, view);
  });
}

}  // namespace

Columns find_columns(const Method& method) noexcept {
  Columns found = 0;
  for (const Step& step : method.segment) found |= step.writes | step.scratch;
  return found & ~columns_of(Extent::own);
}

SegmentPlan plan_segment(const FrameSizes& sizes) noexcept {
  const Method& method = *sizes.method;
  SegmentPlan plan;
  const Columns all = find_columns(method);
  plan.kept = kPublished | (sizes.keep_images ? kImages : 0);
  for (const FrameRule& rule : method.frame) plan.kept |= rule.reads;
  plan.kept &= all;
  plan.shared = all & ~plan.kept;
  find_lives(method, plan);

  SensorPart part;
  for_each_planned_column(part, part.kept, [&](Column column, Extent extent, auto& view) {
    for (int32_t s = 0; s < sizes.sensor_count; ++s) {
      Carver carver;
      place(carver, view, sizes.sensors[s], count_elements(extent, sizes.sensors[s], sizes.point_capacity[s]));
      plan.bytes_of[int32_t(column)] = std::max(plan.bytes_of[int32_t(column)], carver.bytes());
    }
  });

  // In the order of their first steps; at the same step the largest first.
  int32_t order[kColumnCount], count = 0;
  for (int32_t c = 0; c < kColumnCount; ++c)
    if (has(plan.shared, Column(c))) order[count++] = c;
  std::sort(order, order + count, [&](int32_t a, int32_t b) {
    if (plan.first[a] != plan.first[b]) return plan.first[a] < plan.first[b];
    if (plan.bytes_of[a] != plan.bytes_of[b]) return plan.bytes_of[a] > plan.bytes_of[b];
    return a < b;
  });
  Piece pieces[kColumnCount];
  int32_t piece_of[kColumnCount], piece_count = 0;
  for (int32_t i = 0; i < count; ++i) {
    const int32_t c = order[i], chosen = choose_piece(pieces, piece_count, plan.bytes_of[c], plan.first[c]);
    if (chosen == piece_count) pieces[piece_count++] = {0, -1};
    pieces[chosen] = {std::max(pieces[chosen].bytes, plan.bytes_of[c]), plan.last[c]};
    piece_of[c] = chosen;
  }
  for (int32_t p = 0; p < piece_count; ++p) {
    for (int32_t i = 0; i < count; ++i)
      if (piece_of[order[i]] == p) plan.offset[order[i]] = plan.bytes;
    plan.bytes += pieces[p].bytes;
  }
  return plan;
}

void carve_columns(Carver& carver, Columns which, const SensorModel& sensor, int32_t point_capacity,
                   SegmentViews& views) {
  SensorPart none;
  for_each_planned_column(none, views, [&](Column column, Extent extent, auto& view) {
    if (has(which, column)) view = place(carver, view, sensor, count_elements(extent, sensor, point_capacity));
  });
}

namespace {

// Calls f(column of a, the same column of b).
template <class F>
void for_each_pair(Columns which, SegmentViews& a, SegmentViews& b, F&& f) noexcept {
#define OVT_SEGMENT_COLUMN(name, place, extent)                                                                     \
  if constexpr (Extent::extent != Extent::own) {                                                                    \
    constexpr auto view = []([[maybe_unused]] auto& views, [[maybe_unused]] auto& part) -> auto& { return place; }; \
    if (has(which, Column::name)) f(view(a, which), view(b, which));                                                \
  }
#include "pipeline/method/segment_columns.def"
#undef OVT_SEGMENT_COLUMN
}

}  // namespace

void swap_columns(Columns which, SegmentViews& a, SegmentViews& b) noexcept {
  for_each_pair(which, a, b, [](auto& of_a, auto& of_b) { std::swap(of_a, of_b); });
}

void show_columns(Columns which, SegmentViews& from, SegmentViews& to) noexcept {
  for_each_pair(which, from, to, [](auto& of_from, auto& of_to) { of_to = of_from; });
}

void carve_part(Carver& carver, const SensorModel& sensor, RangeImages& images) {
  images.range_m = carver.take_plane<float>(sensor.rows, sensor.cols);
  images.elevation_rad = carver.take_plane<float>(sensor.rows, sensor.cols);
  images.pixel_point = carver.take_plane<int32_t>(sensor.rows, sensor.cols);
}

SegmentViews bind_views(const SensorModel& sensor, SensorPart& part, SegmentScratch& scratch) noexcept {
  SegmentViews views = part.kept;
  views.layer_sums = scratch.layer_sums;
  if (scratch.parts > 1) views.parts = scratch.part;
  for (int32_t i = 1; i < scratch.parts; ++i) {
    Carver carver(scratch.part_block[i]);
    carve_part(carver, sensor, scratch.part[i].images);
  }
  for_each_planned_column(part, views, [&](Column column, Extent, auto& view) {
    if (!has(scratch.plan.shared, column)) return;
    Carver carver(scratch.block + scratch.plan.offset[int32_t(column)]);
    view = place(carver, view, sensor, 0);
  });
  return views;
}

}  // namespace overtake
