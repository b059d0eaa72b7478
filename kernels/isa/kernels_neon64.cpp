// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The kernels for NEON (AArch64), the only file built with its flags (see ovt_add_isa).
#include "kernels/isa/vector_forms.hpp"

namespace overtake {

constinit const KernelTable kKernelsNeon64 = simd::make_kernel_table<xsimd::neon64>("neon64");

}  // namespace overtake
