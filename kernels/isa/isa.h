// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The tables that isa/kernels_<isa>.cpp define. kernels/CMakeLists.txt defines OVT_ISA_<name> for each table in this
// build.
#pragma once

#include "kernels/kernel_table.h"

namespace overtake {

extern const KernelTable kKernelsSse2, kKernelsAvx2, kKernelsAvx512, kKernelsNeon64;

}  // namespace overtake
