// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Each isa/kernels_<isa>.cpp builds its table here: vector forms, and the references of kernels without a vector form.
#pragma once

#include "kernels/isa/isa.h"
#include "kernels/kernel_forms.hpp"  // includes X_simd.hpp of each vector kernel in kernels.def

namespace overtake::simd {

#define OVT_FORM_vector(name) name<A>
#define OVT_FORM_scalar(name) &ref::name  // built once, for every ISA
template <class A>
constexpr KernelTable make_kernel_table(const char* isa) {
  return {
      isa,
#define OVT_KERNEL(name, form, caller) OVT_FORM_##form(name),
#include "kernels/kernels.def"
#undef OVT_KERNEL
  };
}
#undef OVT_FORM_vector
#undef OVT_FORM_scalar

}  // namespace overtake::simd
