// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The only place that includes toml++. On some bad texts (for example "[!]") its assertions fail; with NDEBUG they
// would become assumptions of the compiler and cause undefined behaviour. Here they always throw.
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
