// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b: cuts weak links in clusters that may be two cars.
//
// Two cars nose to tail are one cluster when a row sees the top of the near car and the next row the far car behind it:
// the angle between two rows is large, so a step of 4 m can have beta > th_seg. Such a step is rare within one car, but
// common along a wall. So only clusters that are too long for one car and too short for a wall are cut, and those that
// are no wider than a car, in links with a step that no car has.
#include "kernels/cut_links.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/cut_links_run.h"

namespace overtake::ref {
namespace {

// Pixels of a word that have a link to their left.
uint64_t linked_left(const uint64_t* right, int32_t w) { return right[w] << 1 | (w > 0 ? right[w - 1] >> 63 : 0); }

class LinkCutter {
 public:
  LinkCutter(const CutLinksParams& params, bool wraps, Plane<const float> range_m, Plane<const float> elevation_rad,
             Plane<const int32_t> labels, int32_t label_count, BitPlane link_right, BitPlane link_down,
             LabelExtent* extents)
      : params_(params),
        wraps_(wraps),
        range_m_(range_m),
        elevation_rad_(elevation_rad),
        labels_(labels),
        label_count_(label_count),
        right_(link_right),
        down_(link_down),
        extents_(extents) {}

  void measure(ConstBitPlane nonground) const {
    const int32_t cols = labels_.cols;
    std::fill_n(extents_, label_count_ + 1, LabelExtent{INFINITY, 0.0f, cols, 0, cols, 0, 0, 0});
    for (int32_t r = 0; r < labels_.rows; ++r)
      for (int32_t first = 0, last; first < cols; first = last + 1) {
        for (last = first; nonground.test(r, last) && right_.test(r, last) && last + 1 < cols;) ++last;
        const int32_t label = labels_.row(r)[first];
        if (!nonground.test(r, first) || label < 1 || label > label_count_) continue;
        LabelExtent& extent = extents_[label];
        const bool goes_on = right_.test(r, last);  // past the edge of the image
        for (const int32_t c : {first, goes_on ? first : last}) {
          extent.near_m = std::min(extent.near_m, range_m_.row(r)[c]);
          extent.far_m = std::max(extent.far_m, range_m_.row(r)[c]);
        }
        const TurnedColumns turned = turn_columns(wraps_, cols, first, last);
        extent.first_col = std::min(extent.first_col, first), extent.last_col = std::max(extent.last_col, last);
        extent.first_turned = std::min(extent.first_turned, turned.first);
        extent.last_turned = std::max(extent.last_turned, turned.last);
      }
  }

  TwoCars may_be_two_cars(int32_t label) const {
    return label >= 1 && label <= label_count_ ? overtake::may_be_two_cars(params_, extents_[label]) : TwoCars::kNo;
  }
  // Cuts the links of the run that begins at a pixel.
  int32_t cut_run(TwoCars cluster, int32_t r, int32_t c) const {
    return overtake::cut_run(params_, steps_of(params_, cluster), range_m_, elevation_rad_, r, c, right_, down_);
  }

 private:
  const CutLinksParams& params_;
  const bool wraps_;
  const Plane<const float> range_m_, elevation_rad_;
  const Plane<const int32_t> labels_;
  const int32_t label_count_;
  const BitPlane right_, down_;
  LabelExtent* const extents_;
};

}  // namespace

int32_t cut_links(const CutLinksParams& params, bool wraps, Plane<const float> range_repaired_m,
                  Plane<const float> elevation_repaired_rad, ConstBitPlane nonground_repaired,
                  Plane<const int32_t> labels, int32_t label_count, BitPlane link_right, BitPlane link_down,
                  LabelExtent* extents) noexcept {
  const LinkCutter cutter(params, wraps, range_repaired_m, elevation_repaired_rad, labels, label_count, link_right,
                          link_down, extents);
  cutter.measure(nonground_repaired);
  bool any = false;
  for (int32_t label = 1; label <= label_count; ++label) any = any || cutter.may_be_two_cars(label) != TwoCars::kNo;
  if (!any) return 0;

  int32_t cuts = 0;
  for (int32_t r = 0; r < labels.rows; ++r)
    for (int32_t w = 0; w < nonground_repaired.words_per_row; ++w)
      for (uint64_t starts = nonground_repaired.row(r)[w] & ~linked_left(link_right.row(r), w); starts != 0;
           starts &= starts - 1) {
        const int32_t c = 64 * w + std::countr_zero(starts);
        const TwoCars cluster = cutter.may_be_two_cars(labels.row(r)[c]);
        if (cluster != TwoCars::kNo) cuts += cutter.cut_run(cluster, r, c);
      }
  return cuts;
}

}  // namespace overtake::ref
