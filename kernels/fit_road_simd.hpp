// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 5b: lanes are columns. The walks of several vectors go up together, because each is a chain of dependent
// operations; the places of the pixels are computed once for all passes.
#pragma once

#include "kernels/fit_road_pass.h"
#include "kernels/simd.h"

namespace overtake::simd {

template <class A>
class RoadWalks {
 public:
  static constexpr int32_t kRoom = 4096 / kSize<A>;  // vectors of pixels

  RoadWalks(const RoadAxes& axes, const SensorModel& sensor, Plane<const float> range_m,
            Plane<const float> elevation_rad, const RoadShape& shape)
      : axes_(axes),
        sensor_(sensor),
        range_m_(range_m),
        elevation_rad_(elevation_rad),
        columns_(sensor, shape),
        rows_(range_m.rows) {}

  // Lists the ground of one pass, column after column.
  OVT_INLINE void collect(const RoadShape& shape, const GroundBlock& block, float reach_m, RoadPoints& points) {
    const int32_t vectors = (columns_.count + kSize<A> - 1) / kSize<A>, room = kRoom / rows_;
    const int32_t together = room < kMostTogether ? room : kMostTogether;
    points.clear();
    for (int32_t begin = 0; begin < vectors; begin += together) {
      const int32_t count = vectors - begin < together ? vectors - begin : together;
      if (laid_ != begin)
        for (int32_t v = 0; v < count; ++v) lay(shape, (begin + v) * kSize<A>, pixels_ + v * rows_);
      laid_ = begin;
      walk(shape, block, reach_m, count);
      for (int32_t v = 0; v < count; ++v) list(pixels_ + v * rows_, points);
    }
  }

 private:
  static constexpr int32_t kMostTogether = 8;

  struct Pixels {
    RoadPixel<Float<A>> at;
    Mask<A> exists;
    uint32_t used;  // lanes of the last walk whose pixel is ground for the fit
    bool any;       // of `exists`
  };

  // Pixels of the columns first, first + 1, ... of columns_; lanes beyond the last one have no returns.
  OVT_INLINE void lay(const RoadShape& shape, int32_t first, Pixels* pixels) const {
    int32_t column[kSize<A>];
    float azimuth[kSize<A>];
    for (int32_t l = 0; l < kSize<A>; ++l) {
      column[l] = columns_[first + l < columns_.count ? first + l : 0];
      azimuth[l] = azimuth_of(sensor_, column[l]);
    }
    const Int<A> index = Int<A>::load(column);
    const Mask<A> inside = Mask<A>::first(columns_.count - first);
    Float<A> sine, cosine;
    sin_cos_of(Float<A>::load(azimuth), sine, cosine);
    for (int32_t i = 0; i < rows_; ++i) {
      Pixels& p = pixels[i];
      const int32_t r = rows_ - 1 - i;
      const Float<A> range = gather(range_m_.row(r), index);
      p.exists = (range > Float<A>(0.0f)) & inside;
      p.any = p.exists.any();
      if (p.any) p.at = place_pixel(axes_, shape, range, gather(elevation_rad_.row(r), index), sine, cosine);
    }
  }

  OVT_INLINE void walk(const RoadShape& shape, const GroundBlock& block, float reach_m, int32_t count) {
    GroundState<Float<A>> states[kMostTogether];
    for (int32_t v = 0; v < count; ++v) states[v] = start_walk<Float<A>>(axes_, shape);
    for (int32_t i = 0; i < rows_; ++i)
      for (int32_t v = 0; v < count; ++v) {
        Pixels& p = pixels_[v * rows_ + i];
        if (p.any) {
          p.used = walk_pixel(block, axes_, shape, reach_m, p.at, p.exists, states[v]).bits();
        } else {
          p.used = 0;
          states[v].below_above = Float<A>(kMissing_m);
        }
      }
  }

  OVT_INLINE void list(const Pixels* pixels, RoadPoints& points) const {
    for (int32_t l = 0; l < kSize<A>; ++l) {
      int32_t row[kRoom], count = 0;
      for (int32_t i = 0; i < rows_; ++i) {
        row[count] = i;
        count += int32_t(pixels[i].used >> l & 1);
      }
      for (int32_t k = 0; k < count; ++k) {
        const RoadPixel<Float<A>>& p = pixels[row[k]].at;
        const auto lane = [l](const Float<A>& v) OVT_INLINED {
          float value;
          __builtin_memcpy(&value, reinterpret_cast<const char*>(&v) + l * int32_t(sizeof value), sizeof value);
          return value;
        };
        points.add(lane(p.x), lane(p.n), lane(p.above_m));
      }
    }
  }

  const RoadAxes& axes_;
  const SensorModel& sensor_;
  const Plane<const float> range_m_, elevation_rad_;
  const FitColumns columns_;
  const int32_t rows_;
  int32_t laid_ = -1;  // the first vector of columns whose pixels are laid
  Pixels pixels_[kRoom];
};

template <class A>
void fit_road(const RunningGroundParams& params, const RoadAxes& axes, const SensorModel& sensor,
              Plane<const float> range_m, Plane<const float> elevation_rad, RoadShape& shape) noexcept {
  if (range_m.rows > RoadWalks<A>::kRoom) return ref::fit_road(params, axes, sensor, range_m, elevation_rad, shape);
  RoadPoints points;
  RoadWalks<A> walks(axes, sensor, range_m, elevation_rad, shape);
  for (const FitPass& pass : kFitPasses) {
    if (fits_plane(shape) && !pass.of_plane) continue;
    walks.collect(shape, make_fit_block(params, pass), pass.reach_m, points);
    if (!fit_shape(points, pass.trim_m, shape)) return;
  }
}

}  // namespace overtake::simd
