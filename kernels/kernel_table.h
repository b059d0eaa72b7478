// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One table of function pointers per ISA, chosen once at create.
#pragma once

#include "kernels/kernel_headers.h"  // includes X.h of each kernel in kernels.def

namespace overtake {

struct KernelTable {
  const char* isa;
#define OVT_KERNEL(name, form, caller) decltype(&ref::name) name;
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

// The table of the ISA `isa`; null asks for the best of this CPU. Null if the name is unknown or the CPU lacks the ISA.
const KernelTable* find_kernels(const char* isa) noexcept;
// All tables this CPU can run: the reference ("ref") first, best last. Returns their number; out may be null.
int32_t list_kernels(const KernelTable** out) noexcept;

}  // namespace overtake
