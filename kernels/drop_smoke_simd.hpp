// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5c: smoke and dust are not obstacles. Words of 64 columns: dark pixels are rare without smoke, and stand
// alone or in small groups. So the points tell which pixels are dark, and each of these looks at its own window, a row
// of it at a time. Most of them lie on a surface: three rows of the window show this.
#pragma once

#include "core/math.h"
#include "kernels/drop_smoke.h"
#include "kernels/simd.h"

namespace overtake::simd {

// The 64 neighbours of a pixel as bits of a word: 13 columns of each row above and below it, then its own row without
// itself. kFar: only the rows up to so many above and below; the bits of the others are 0.
constexpr int32_t kWindowCols = 2 * kSmokeCols + 1, kWindowRows = 2 * kSmokeRows + 1;
static_assert(kWindowCols * kWindowRows == 65);
template <int32_t kFar = kSmokeRows, class F>
OVT_INLINE uint64_t make_window(F&& columns_of_row) {
  constexpr uint64_t kLeft = (uint64_t(1) << kSmokeCols) - 1, kAll = (uint64_t(1) << kWindowCols) - 1;
  uint64_t window = 0;
  int32_t place = 0;
#pragma GCC unroll 5
  for (int32_t i = 0; i < kWindowRows; ++i) {
    if (i == kSmokeRows) continue;
    if (i >= kSmokeRows - kFar && i <= kSmokeRows + kFar) window |= (columns_of_row(i) & kAll) << place;
    place += kWindowCols;
  }
  const uint64_t own = columns_of_row(kSmokeRows);
  return window | ((own & kLeft) | (own >> 1 & kLeft << kSmokeCols)) << place;
}

// The windows of the pixels of a word. Bit c of low[i] belongs to column c - kSmokeCols of the word; high goes on.
struct WindowBits {
  uint64_t low[kWindowRows], high[kWindowRows];

  OVT_INLINE WindowBits(ConstBitPlane bits, int32_t r, int32_t w) {
    for (int32_t i = 0; i < kWindowRows; ++i) {
      const int32_t row = r + i - kSmokeRows;
      low[i] = high[i] = 0;
      if (row < 0 || row >= bits.rows) continue;
      const uint64_t *in = bits.row(row), own = in[w];
      const uint64_t before = w > 0 ? in[w - 1] : 0, after = w + 1 < bits.words_per_row ? in[w + 1] : 0;
      low[i] = own << kSmokeCols | before >> (64 - kSmokeCols);
      high[i] = after << kSmokeCols | own >> (64 - kSmokeCols);
    }
  }
  OVT_INLINE bool any() const {
    uint64_t all = 0;
    for (int32_t i = 0; i < kWindowRows; ++i) all |= low[i] | high[i];
    return all != 0;
  }
  OVT_INLINE uint64_t at(int32_t c) const {  // column of the word
    return make_window([&](int32_t i) OVT_INLINED { return low[i] >> c | high[i] << 1 << (63 - c); });
  }
};

// The ranges around the pixels of a row. Beyond the image's edge rows are those of the edge: no bit is set there.
struct WindowRanges {
  const float* row[kWindowRows];

  OVT_INLINE WindowRanges(Plane<const float> range_m, int32_t r) {
    for (int32_t i = 0; i < kWindowRows; ++i) {
      const int32_t at = r + i - kSmokeRows;
      row[i] = range_m.row(at < 0 ? 0 : at < range_m.rows ? at : range_m.rows - 1);
    }
  }
  // The neighbours of the pixel of column c whose ranges differ from its own by less than limit_m.
  template <class A, int32_t kFar = kSmokeRows>
  OVT_INLINE uint64_t find_within(int32_t c, float limit_m) const {
    const Float<A> own(row[kSmokeRows][c]), limit(limit_m);
    return make_window<kFar>([&](int32_t i) OVT_INLINED {
      uint64_t bits = 0;
      for (int32_t k = 0; k < kWindowCols; k += kSize<A>)
        bits |= uint64_t((abs_of(Float<A>::load(row[i] + c - kSmokeCols + k) - own) < limit).bits()) << k;
      return bits;
    });
  }
};

// The pixels whose points are dark. Lists them first: which of the points are dark, and which of these hold their
// pixel, cannot be predicted, so no branch depends on it.
template <class A, bool kSignal>
OVT_INLINE void find_dark(const ScanTable& scan, const int32_t* point_pixel, Plane<const int32_t> pixel_point,
                          float darkest, BitPlane dark) {
  constexpr int32_t kBlock = 2048;
  constexpr int32_t kPlaces = 40;  // of the inverse stride: exact for up to 2^25 pixels in rows of less than 2^15
  OVT_CHECK(int64_t(pixel_point.rows) * pixel_point.stride <= 1 << 25 && pixel_point.stride < 1 << 15);
  const uint64_t per_stride = (uint64_t(1) << kPlaces) / uint64_t(pixel_point.stride) + 1;
  const Float<A> limit(darkest);
  for (int32_t begin = 0; begin < scan.count; begin += kBlock) {
    int32_t list[kBlock + kSize<A>], found = 0, held = 0;
    const int32_t end = begin + kBlock < scan.count ? begin + kBlock : scan.count;
    for (int32_t i = begin; i < end; i += kSize<A>) {
      Float<A> light = Float<A>::load(scan.intensity + i);
      if constexpr (kSignal) {  // GroundLight::of
        const Float<A> x = Float<A>::load(scan.x_m + i), y = Float<A>::load(scan.y_m + i);
        const Float<A> z = Float<A>::load(scan.z_m + i);
        light = light * (x * x + y * y + z * z);
      }
      const Mask<A> is_dark = (light < limit) & Mask<A>::first(end - i);
      store_packed(is_dark, Int<A>::count_from(i), list + found);
      found += count_bits(is_dark.bits());
    }
    if (found == 0) continue;
    for (int32_t k = found; k % kSize<A> != 0; ++k) list[k] = list[0];
    for (int32_t k = 0; k < found; k += kSize<A>) {
      const Int<A> point = Int<A>::load(list + k), pixel = gather(point_pixel, point);
      const Mask<A> holds =  // the lead of row 0 is the pixel of points without one
          (gather(pixel_point.data, pixel) == point) & (pixel > Int<A>(-1)) & Mask<A>::first(found - k);
      store_packed(holds, pixel, list + held);  // held <= k
      held += count_bits(holds.bits());
    }
    for (int32_t k = 0; k < held; ++k) {
      const auto row = int32_t(uint64_t(uint32_t(list[k])) * per_stride >> kPlaces);
      const int32_t c = list[k] - row * pixel_point.stride;
      dark.row(row)[c >> 6] |= uint64_t(1) << (c & 63);
    }
  }
}

// The pixels with a point, of the word that begins at `points`.
template <class A>
OVT_INLINE uint64_t find_points(const int32_t* points, int32_t cols) {
  uint64_t has = 0;
  for (int32_t shift = 0; shift < cols; shift += kSize<A>)
    has |= uint64_t((Int<A>::load(points + shift) > Int<A>(kNoPoint)).bits()) << shift;
  return has;
}

// The neighbours of the last dark pixels, in their order, where they are known, and a number that they are at least.
struct NeighbourRing {
  static constexpr int32_t kRoom = 2048;
  static constexpr uint64_t kUnknown = ~uint64_t(0);
  uint64_t of[kRoom];
  uint8_t least[kRoom];
  OVT_INLINE static int32_t slot(int32_t i) { return i & (kRoom - 1); }
};

// Row r of `rough`. Returns the number of dark pixels so far.
template <class A>
OVT_INLINE int32_t find_rough(const DropSmokeParams& params, Plane<const float> range_filled_m,
                              ConstBitPlane considered, ConstBitPlane dark, int32_t r, BitPlane rough,
                              NeighbourRing& ring, int32_t count) {
  const WindowRanges ranges(range_filled_m, r);
  for (int32_t w = 0; w < dark.words_per_row; ++w) {
    if (dark.row(r)[w] == 0) continue;
    const WindowBits window(considered, r, w);
    // Most dark pixels lie on a surface, and a part of the window shows it: the share of all neighbours that are near
    // is larger than this part's share of all that may be neighbours. The others are listed: which ones they are
    // cannot be predicted.
    struct Unsure {
      uint64_t all;
      int32_t shift, place;
    } unsure[64];
    int32_t unsure_count = 0;
    for (uint64_t left = dark.row(r)[w]; left != 0; left &= left - 1) {
      const int32_t shift = lowest_bit(left), c = 64 * w + shift;
      const float surface_m = kSurface_m + kSurfaceShare * range_filled_m.row(r)[c];
      const uint64_t all = window.at(shift);
      const uint64_t part = all & ranges.find_within<A, 1>(c, min_of(surface_m, params.reach_m));
      ring.of[ring.slot(count)] = NeighbourRing::kUnknown;
      ring.least[ring.slot(count)] = uint8_t(count_bits(part));
      unsure[unsure_count] = {all, shift, count++};
      unsure_count += !(float(count_bits(part)) > params.near_share * float(count_bits(all)));
    }
    uint64_t found = 0;
    for (int32_t k = 0; k < unsure_count; ++k) {
      const int32_t c = 64 * w + unsure[k].shift;
      const float surface_m = kSurface_m + kSurfaceShare * range_filled_m.row(r)[c];
      const uint64_t neighbours = unsure[k].all & ranges.find_within<A>(c, params.reach_m);
      const uint64_t near = neighbours & ranges.find_within<A>(c, surface_m);
      const bool is_rough = float(count_bits(near)) <= params.near_share * float(count_bits(neighbours));
      ring.of[ring.slot(unsure[k].place)] = neighbours;
      found |= uint64_t(is_rough) << unsure[k].shift;
    }
    rough.row(r)[w] = found;
  }
  return count;
}

// Row r of `smoke`, which holds the dark pixels before. Returns the number of dark pixels so far.
template <class A>
OVT_INLINE int32_t find_smoke(const DropSmokeParams& params, Plane<const float> range_filled_m,
                              ConstBitPlane considered, ConstBitPlane rough, int32_t r, BitPlane smoke,
                              NeighbourRing& ring, int32_t found_count, int32_t count) {
  const WindowRanges ranges(range_filled_m, r);
  for (int32_t w = 0; w < smoke.words_per_row; ++w) {
    const uint64_t dark = smoke.row(r)[w];
    if (dark == 0) continue;
    const WindowBits around(rough, r, w);
    uint64_t found = 0;
    if (!around.any()) {  // a pixel without neighbours is rough itself, so here each has one that is not rough
      count += count_bits(dark);
      smoke.row(r)[w] = 0;
      continue;
    }
    for (uint64_t left = dark; left != 0; left &= left - 1) {
      const int32_t shift = lowest_bit(left), place = count++, slot = ring.slot(place);
      const uint64_t among = around.at(shift);
      const bool is_lost = found_count - place > NeighbourRing::kRoom;
      // Most of them lie on a surface, with more neighbours than rough pixels around them.
      if (!is_lost && float(count_bits(among)) < kRoughShare * float(ring.least[slot])) continue;
      uint64_t neighbours = ring.of[slot];
      if (is_lost || neighbours == NeighbourRing::kUnknown)
        neighbours = WindowBits(considered, r, w).at(shift) & ranges.find_within<A>(64 * w + shift, params.reach_m);
      const bool is_smoke = float(count_bits(neighbours & among)) >= kRoughShare * float(count_bits(neighbours));
      found |= uint64_t(is_smoke) << shift;
    }
    smoke.row(r)[w] = found;
  }
  return count;
}

template <class A>
void drop_smoke(const DropSmokeParams& params, const ScanTable& scan, const GroundLight& ground,
                const int32_t* point_pixel, Plane<const float> range_filled_m, Plane<const int32_t> pixel_point,
                BitPlane nonground, BitPlane considered, BitPlane rough, BitPlane smoke) noexcept {
  const int32_t rows = nonground.rows, cols = nonground.cols, words_per_row = nonground.words_per_row;
  const float limit = params.dark_share * ground.light;
  const bool may_be_smoke = limit > 0.0f;  // else there is no ground, or there are no intensities
  const BitPlane dark = smoke;             // at first
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) dark.row(r)[w] = rough.row(r)[w] = 0;
  if (may_be_smoke && ground.is_signal)
    find_dark<A, true>(scan, point_pixel, pixel_point, limit, dark);
  else if (may_be_smoke)
    find_dark<A, false>(scan, point_pixel, pixel_point, limit, dark);
  uint64_t any_dark = 0;
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) {
      const uint64_t own = nonground.row(r)[w];
      if (own != 0 && may_be_smoke)  // filled gaps
        dark.row(r)[w] |= own & ~find_points<A>(pixel_point.row(r) + 64 * w, cols - 64 * w < 64 ? cols - 64 * w : 64);
      considered.row(r)[w] = own | dark.row(r)[w];
      any_dark |= dark.row(r)[w];
    }
  if (any_dark == 0) return;

  // Whether a pixel of a row is smoke is known when the rows up to kSmokeRows below it are known to be rough or not. So
  // the second step follows the first so many rows behind, and finds the neighbours of its pixels in a ring.
  NeighbourRing ring;
  int32_t found_count = 0, told_count = 0;
  for (int32_t r = 0; r < rows + kSmokeRows; ++r) {
    if (r < rows) found_count = find_rough<A>(params, range_filled_m, considered, dark, r, rough, ring, found_count);
    const int32_t done = r - kSmokeRows;
    if (done >= 0)
      told_count = find_smoke<A>(params, range_filled_m, considered, rough, done, smoke, ring, found_count, told_count);
  }
  for (int32_t r = 0; r < rows; ++r)
    for (int32_t w = 0; w < words_per_row; ++w) nonground.row(r)[w] &= ~smoke.row(r)[w];
}

}  // namespace overtake::simd
