// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One table of function pointers per ISA, picked once at create.
#pragma once

#include "kernels/angle_image.h"
#include "kernels/build_clusters.h"
#include "kernels/fill_gaps.h"
#include "kernels/fit_rectangle.h"
#include "kernels/gate_clusters.h"
#include "kernels/label_bfs.h"
#include "kernels/label_points.h"
#include "kernels/link_pixels.h"
#include "kernels/load_points.h"
#include "kernels/mark_ground.h"
#include "kernels/merge_seams.h"
#include "kernels/project_points.h"
#include "kernels/rank_layers.h"
#include "kernels/repair_range.h"
#include "kernels/scatter_points.h"
#include "kernels/smooth_sg.h"

namespace overtake {

struct KernelTable {
  const char* isa;
#define OVT_KERNEL(name, agreement) decltype(&ref::name) name;
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

// The table of a named ISA, or with null the best this CPU has. Null when the name is unknown or the CPU lacks it.
const KernelTable* find_kernels(const char* isa) noexcept;
// All tables this CPU can run, the scalar truth ("ref") first, best last. Returns how many; out may be null.
int32_t list_kernels(const KernelTable** out) noexcept;

}  // namespace overtake
