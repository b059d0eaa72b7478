// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What each isa/kernels_<isa>.cpp builds its table from: the vector forms, and the twins of the kernels without one.
#pragma once

#include "kernels/angle_image_simd.hpp"
#include "kernels/build_clusters_simd.hpp"
#include "kernels/fill_gaps_simd.hpp"
#include "kernels/fit_rectangle_simd.hpp"
#include "kernels/isa/isa.h"
#include "kernels/label_bfs_simd.hpp"
#include "kernels/label_points_simd.hpp"
#include "kernels/link_pixels_simd.hpp"
#include "kernels/load_points_simd.hpp"
#include "kernels/mark_ground_simd.hpp"
#include "kernels/merge_seams_simd.hpp"
#include "kernels/project_points_simd.hpp"
#include "kernels/repair_range_simd.hpp"
#include "kernels/scatter_points_simd.hpp"
#include "kernels/smooth_sg_simd.hpp"

namespace overtake::simd {

// A kernel that gains nothing from vectors, or has none yet: the twin's machine code, built once, for every ISA.
#define OVT_TWIN_ONLY(name) \
  template <class A>        \
  inline constexpr auto name = &ref::name
OVT_TWIN_ONLY(rank_layers);
OVT_TWIN_ONLY(gate_clusters);
#undef OVT_TWIN_ONLY

template <class A>
constexpr KernelTable make_kernel_table(const char* isa) {
  return {
      isa,
#define OVT_KERNEL(name, agreement) name<A>,
#include "kernels/kernels.def"
#undef OVT_KERNEL
  };
}

}  // namespace overtake::simd
