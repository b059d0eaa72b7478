// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// toml++, the only place that includes it. On some bad texts ("[!]", for one) it meets its own assertions, which NDEBUG
// turns into promises to the compiler, so that the rest of the run is undefined: here they always throw.
#pragma once

namespace overtake::io {

struct TomlBroken {};                   // parse_toml makes it an Error
[[noreturn]] void throw_toml_broken();  // toml_reader.cpp

}  // namespace overtake::io

#define TOML_ASSERT(condition) ((condition) ? void() : ::overtake::io::throw_toml_broken())
#ifdef NDEBUG
#undef NDEBUG
#include <toml++/toml.h>
#define NDEBUG
#else
#include <toml++/toml.h>
#endif
