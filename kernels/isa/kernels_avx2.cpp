// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The kernels for AVX2, the only file built with its flags (see ovt_add_isa).
#include "kernels/isa/vector_forms.hpp"

namespace overtake {

constinit const KernelTable kKernelsAvx2 = simd::make_kernel_table<xsimd::avx2>("avx2");

}  // namespace overtake
