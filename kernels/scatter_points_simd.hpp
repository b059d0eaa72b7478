// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 1: assigns points to pixels. Computes the pixels of a block of points, kSize at a time; then each point of the
// block claims its pixel, so that the last point holds it. What follows depends on the length of the vectors:
//
//   short   a claim also writes range and elevation into the images, and lists the point that it displaces (a few
//           percent); after each block these points are compared with those that hold their pixels
//   long    after all claims a gather lists the points that do not hold their pixels, vectors compare them, and range
//           and elevation of the winners are copied in tiles of kSize columns and all rows: the points of a tile lie
//           near each other in memory, whether they came ring by ring or column by column
//
// The winner of two points follows a total order (intensity, range, input order), so the order of comparisons does not
// matter. A point without a pixel claims the lead of row 0 (plane.h).
#pragma once

#include "core/math.h"
#include "kernels/near_rows.h"
#include "kernels/scatter_points.h"
#include "kernels/simd.h"

namespace overtake::simd {

// Compares a point that does not hold its pixel with the one that does: the brightest point is the least likely dust.
// Ties: the nearest, then the first in input order.
OVT_INLINE void challenge_winner(const float* intensity, const float* range_m, int32_t i, int32_t* winner,
                                 uint8_t* lost) {
  const int32_t other = *winner;
  const float light = intensity[i], other_light = intensity[other], near = range_m[i], other_near = range_m[other];
  const bool first = (near < other_near) | ((near == other_near) & (i < other));
  const bool wins = (light > other_light) | ((light == other_light) & first);
  *winner = wins ? i : other;
  lost[wins ? other : i] = 1;
}

// The same for a list of points, which has room for whole vectors. Which of two points wins cannot be predicted, so no
// branch depends on it.
template <class A>
OVT_INLINE void challenge_winners(const float* intensity, const float* range_m, const int32_t* pixels, int32_t* list,
                                  int32_t count, int32_t* winners, uint8_t* lost) {
  for (int32_t k = count; k % kSize<A> != 0; ++k) list[k] = list[0];
  for (int32_t k = 0; k < count; k += kSize<A>) {
    const Int<A> point = Int<A>::load(list + k), pixel = gather(pixels, point);
    Mask<A> late = Mask<A>::first(count - k);
    do {
      const Int<A> other = gather(winners, pixel);
      const Float<A> light = gather(intensity, point), other_light = gather(intensity, other);
      const Float<A> near = gather(range_m, point), other_near = gather(range_m, other);
      const Mask<A> before = (near < other_near) | ((near == other_near) & (other > point));
      const Mask<A> wins = (light > other_light) | ((light == other_light) & before);
      int32_t loser_of[kSize<A>], pixel_of[kSize<A>];
      select(wins, other, point).store(loser_of);
      select(wins & late, pixel, Int<A>(-1)).store(pixel_of);
      const uint32_t lanes = late.bits();
      for (int32_t l = 0; l < kSize<A>; ++l) {
        winners[pixel_of[l]] = list[k + l];
        if (lanes >> l & 1) lost[loser_of[l]] = 1;
      }
      // Two points of one pixel may both win: then the one that does not hold it now comes again.
      late = late & wins & ~(gather(winners, pixel) == point);
    } while (late.any());
  }
}

// Computes the pixels of all points, and calls claim(begin, end) after each block: pending scattered stores delay wide
// loads with the same low address bits.
constexpr int32_t kClaimBlock = 512;
template <class A, class Claim>
OVT_INLINE void find_pixels(const ScanTable& scan, const int32_t* row_of_layer, int32_t pixel_stride,
                            PointTable& points, Claim claim) {
  const int32_t count = points.count, *layers = scan.layer, *columns = points.column;
  static_assert(kLabelGround == 0 && kLabelNone == -1);
  int32_t *pixels = points.pixel, *labels = points.label;
  uint8_t *reasons = points.reason, *lost = points.lost;
  const Int<A> none(-1), stride(pixel_stride);
  Int<A> layer_a(kNoLayer), layer_b(kNoLayer), row_a(-1), row_b(-1);
  for (int32_t i = 0, claimed = 0; i < count; i += kSize<A>) {
    const Int<A> column = Int<A>::load(columns + i);
    const Mask<A> valid = (column > none) & Mask<A>::first(count - i);
    const Int<A> layer = select(valid, Int<A>::load(layers + i), Int<A>(0));
    // Most vectors hold the layers of one ring, or of the interleaved rings of two heads.
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) {
      const int32_t last = count - i < kSize<A> ? count - 1 : i + kSize<A> - 1, before = last > 0 ? last - 1 : last;
      layer_a = Int<A>(layers[last]), layer_b = Int<A>(layers[before]);
      row_a = Int<A>(layers[last] < 0 ? -1 : row_of_layer[layers[last]]);
      row_b = Int<A>(layers[before] < 0 ? -1 : row_of_layer[layers[before]]);
    }
    Int<A> row = select(layer == layer_a, row_a, row_b);
    if ((valid & ~((layer == layer_a) | (layer == layer_b))).any()) row = gather(row_of_layer, layer);
    row = select(valid, row, none);
    const Mask<A> dropped = valid & (row < Int<A>(0));
    if (dropped.any())
      store_bytes(select(dropped, Int<A>(int32_t(Reason::kLayerDropped)), load_bytes<A>(reasons + i)), reasons + i);
    const Int<A> pixel = select(row < Int<A>(0), none, row * stride + column);
    pixel.store(pixels + i);
    (pixel >> 31).store(labels + i);  // of a point without a pixel: all bits
    store_bytes(Int<A>(0), lost + i);

    const int32_t end = i + kSize<A> < count ? i + kSize<A> : count;
    if (end % kClaimBlock != 0 && end != count) continue;
    claim(claimed, end);
    claimed = end;
  }
}

template <class A>
OVT_INLINE void scatter_by_claims(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                                  RangeImages& images) {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r)
    for (int32_t c = 0; c < winner.cols; c += kSize<A>) {
      Int<A>(kNoPoint).store(winner.row(r) + c);
      Float<A>(kNoReturn).store(images.range_m.row(r) + c);
      Float<A>(0.0f).store(images.elevation_rad.row(r) + c);
    }
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  const int32_t* pixels = points.pixel;
  int32_t* winners = winner.data;
  float *ranges_m = images.range_m.data, *elevations_rad = images.elevation_rad.data;
  uint8_t* lost = points.lost;
  find_pixels<A>(scan, row_of_layer, winner.stride, points, [=](int32_t begin, int32_t end) {
    int32_t displaced[kClaimBlock], found = 0;
    for (int32_t i = begin; i < end; ++i) {
      const int32_t pixel = pixels[i], other = winners[pixel];
      winners[pixel] = i;
      ranges_m[pixel] = range_m[i], elevations_rad[pixel] = elevation_rad[i];
      displaced[found] = other;
      found += 1 + ((other | pixel) >> 31);  // by one if both are there
    }
    for (int32_t k = 0; k < found; ++k) {
      const int32_t pixel = pixels[displaced[k]];
      challenge_winner(intensity, range_m, displaced[k], winners + pixel, lost);
      const int32_t i = winners[pixel];
      ranges_m[pixel] = range_m[i], elevations_rad[pixel] = elevation_rad[i];
    }
  });
}

template <class A>
OVT_INLINE void scatter_in_steps(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                                 RangeImages& images) {
  const Plane<int32_t> winner = images.pixel_point;
  for (int32_t r = 0; r < winner.rows; ++r)
    for (int32_t c = 0; c < winner.cols; c += kSize<A>) Int<A>(kNoPoint).store(winner.row(r) + c);
  const int32_t count = points.count, *pixels = points.pixel;
  const float *intensity = scan.intensity, *range_m = points.range_m, *elevation_rad = points.elevation_rad;
  int32_t* winners = winner.data;
  uint8_t* lost = points.lost;
  winners[-1] = kNoPoint;
  find_pixels<A>(scan, row_of_layer, winner.stride, points, [=](int32_t begin, int32_t end) {
    for (int32_t i = begin; i < end; ++i) winners[pixels[i]] = i;
  });

  const Int<A> none(-1);
  constexpr int32_t kListed = 2048;
  for (int32_t begin = 0; begin < count; begin += kListed) {
    int32_t list[kListed + kSize<A>], found = 0;
    const int32_t end = begin + kListed < count ? begin + kListed : count;
    for (int32_t i = begin; i < end; i += kSize<A>) {
      const Int<A> pixel = Int<A>::load(pixels + i), point = Int<A>::count_from(i);
      const Mask<A> late = (pixel > none) & ~(gather(winners, pixel) == point) & Mask<A>::first(end - i);
      store_packed(late, point, list + found);
      found += count_bits(late.bits());
    }
    if (found > 0) challenge_winners<A>(intensity, range_m, pixels, list, found, winners, lost);
  }

  const Float<A> no_return(kNoReturn), level(0.0f);
  for (int32_t c = 0; c < winner.cols; c += kSize<A>)
    for (int32_t r = 0; r < winner.rows; ++r) {
      const Int<A> point = Int<A>::load(winner.row(r) + c);
      const Mask<A> has = (point > none) & Mask<A>::first(winner.cols - c);
      Float<A> range = no_return, elevation = level;
      if (has.any()) {
        const NearRows<A> rows(winner.row(r) + c, has, points.capacity);
        range = select(has, rows.get(range_m), no_return);
        elevation = select(has, rows.get(elevation_rad), level);
      }
      range.store(images.range_m.row(r) + c);
      elevation.store(images.elevation_rad.row(r) + c);
    }
}

template <class A>
void scatter_points(const ScanTable& scan, const int32_t* row_of_layer, PointTable& points,
                    RangeImages& images) noexcept {
  if constexpr (kSize<A> < 16)
    scatter_by_claims<A>(scan, row_of_layer, points, images);
  else
    scatter_in_steps<A>(scan, row_of_layer, points, images);
}

}  // namespace overtake::simd
