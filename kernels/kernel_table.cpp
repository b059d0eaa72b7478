// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One table of function pointers per ISA. To add an ISA, add a line to kCandidates, after those that are slower.
#include "kernels/kernel_table.h"

#include <cstring>

#include "kernels/isa/isa.h"

namespace overtake {
namespace {

constexpr KernelTable kRef = {
    "ref",
#define OVT_KERNEL(name, form, caller) &ref::name,
#include "kernels/kernels.def"
#undef OVT_KERNEL
};

// Whether the CPU has what ovt_add_isa's flags use. The built-ins also check that the system saves the registers.
#if defined(OVT_ISA_avx2)
bool has_avx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2") &&
         __builtin_cpu_supports("popcnt");
}
#endif
#if defined(OVT_ISA_avx512)
bool has_avx512() {
  return has_avx2() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}
#endif

struct Candidate {
  const KernelTable* table;
  bool (*can_run)();
};
constexpr Candidate kCandidates[] = {
    {&kRef, [] { return true; }},
#if defined(OVT_ISA_sse2)
    {&kKernelsSse2, [] { return true; }},  // part of x86-64
#endif
#if defined(OVT_ISA_avx2)
    {&kKernelsAvx2, has_avx2},
#endif
#if defined(OVT_ISA_avx512)
    {&kKernelsAvx512, has_avx512},
#endif
#if defined(OVT_ISA_neon64)
    {&kKernelsNeon64, [] { return true; }},  // part of AArch64
#endif
};

}  // namespace

int32_t list_kernels(const KernelTable** out) noexcept {
  int32_t count = 0;
  for (const Candidate& candidate : kCandidates) {
    if (!candidate.can_run()) continue;
    if (out) out[count] = candidate.table;
    ++count;
  }
  return count;
}

const KernelTable* find_kernels(const char* isa) noexcept {
  const KernelTable* found = nullptr;
  for (const Candidate& candidate : kCandidates)
    if (candidate.can_run() && (!isa || std::strcmp(isa, candidate.table->isa) == 0)) found = candidate.table;
  return found;
}

}  // namespace overtake
