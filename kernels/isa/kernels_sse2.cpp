// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The kernels for SSE2, the only file built with its flags (see ovt_add_isa).
#include "kernels/isa/vector_forms.hpp"

namespace overtake {

constinit const KernelTable kKernelsSse2 = simd::make_kernel_table<xsimd::sse2>("sse2");

}  // namespace overtake
