// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Describes the build of this library. CMake makes build_info.cpp from build_info.cpp.in.
#pragma once

namespace overtake {

extern const char* const kVersionText;
extern const char* const kCommit;
extern const char* const kCompiler;
const char* list_isas() noexcept;  // "ref sse2 avx2": ISAs that this CPU can run, worst first

}  // namespace overtake
