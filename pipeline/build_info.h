// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What this library was built from. build_info.cpp is made by CMake from build_info.cpp.in.
#pragma once

namespace overtake {

extern const char* const kVersionText;
extern const char* const kCommit;
extern const char* const kCompiler;
const char* list_isas() noexcept;  // "ref sse2 avx2": what this CPU can run, worst first

}  // namespace overtake
