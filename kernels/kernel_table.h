// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One table of function pointers per ISA, picked once at create.
#pragma once

#include "kernels/kernel_headers.h"  // X.h of each kernel in kernels.def, written at configure time

namespace overtake {

struct KernelTable {
  const char* isa;
#define OVT_KERNEL(name, form, caller) decltype(&ref::name) name;
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

// The table of a named ISA, or with null the best this CPU has. Null when the name is unknown or the CPU lacks it.
const KernelTable* find_kernels(const char* isa) noexcept;
// All tables this CPU can run, the scalar reference ("ref") first, best last. Returns how many; out may be null.
int32_t list_kernels(const KernelTable** out) noexcept;

}  // namespace overtake
