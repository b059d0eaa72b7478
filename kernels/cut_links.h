// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Section 7b of kernels/README.md: cuts weak links in clusters that may be two cars. Not a kernel of its own: the
// reference of label_cut calls it.
#pragma once

#include "core/plane.h"

namespace overtake {

struct CutLinksParams {
  float tan_threshold;  // of th_cut
  float sin_pitch, cos_pitch;
  float step_m;                             // of a link down
  float min_length_m, max_length_m;         // of a cluster
  float in_line_length_m, in_line_width_m;  // of a cluster that may be two cars in line
  float in_line_step_m;                     // of its links
  float abreast_width_m;                    // of a cluster that may be two cars side by side
  float abreast_step_m;                     // of its links to the right
};

// Scratch: where the ends of a label's runs are. The last two are of label_cut's vector form, which has one for each
// run: the pixel where the run begins.
struct LabelExtent {
  float near_m, far_m;
  int32_t first_col, last_col;
  int32_t first_turned, last_turned;  // the same, of columns turned by half of the image
  int32_t row, col;
};

// A cluster between min_length_m and max_length_m may be two cars. Cuts each of its links to the right that has
// beta <= th_cut (link_pixels.h), and each link down that has that and joins ranges which differ by step_m or more. A
// shorter cluster, from in_line_length_m on, may be parts of two cars one behind the other if it is narrower than
// in_line_width_m: cuts each of its links that has beta <= th_cut and joins ranges which differ by in_line_step_m or
// more. A shorter one that is wider than abreast_width_m may be two cars side by side: cuts the same links down, and
// each link to the right that has beta <= th_cut and joins ranges which differ by abreast_step_m or more.
//   reads    range_repaired_m elevation_repaired_rad nonground_repaired; labels label_count (from label_bfs; labels
//            beyond the count are none); the links
//   writes   link_right link_down: clears bits of cut links
//   returns  the number of cut links: if any, the labels are to be made anew
//   length   of a label: the root of (far - near)^2 + width^2, width = mean of far and near * columns * sin_pitch,
//            over the pixels that end a run (without a link to their left or right). Where columns wrap, the columns
//            are counted in an image that is turned by half, too, in which the first column has neighbours on both
//            sides: the smaller number counts, and the ends of the image are ends of its runs
//   scratch  extents[label_count + 1]      cost  each end of a run once; each pixel of a cluster of such a length
//   agrees   exactly on every ISA
namespace ref {
int32_t cut_links(const CutLinksParams& params, bool wraps, Plane<const float> range_repaired_m,
                  Plane<const float> elevation_repaired_rad, ConstBitPlane nonground_repaired,
                  Plane<const int32_t> labels, int32_t label_count, BitPlane link_right, BitPlane link_down,
                  LabelExtent* extents) noexcept;
}

}  // namespace overtake
