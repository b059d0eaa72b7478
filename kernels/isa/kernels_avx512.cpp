// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The kernels for AVX-512, the only file built with its flags (see ovt_add_isa).
#include "kernels/isa/vector_forms.hpp"

namespace overtake {

constinit const KernelTable kKernelsAvx512 = simd::make_kernel_table<xsimd::avx512bw>("avx512");

}  // namespace overtake
