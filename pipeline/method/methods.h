// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The methods there are, by name.
#pragma once

#include <cstdint>
#include <string>

#include "pipeline/method/method.h"

namespace overtake {

inline constexpr int32_t kMaxMethods = 16;

// Null when no method has that name.
const Method* find_method(const char* name) noexcept;
// All of them, `paper` first. Returns how many; out may be null.
int32_t list_methods(const Method** out) noexcept;
std::string join_method_names();  // "paper, best"

// One more, which stays where it is. Before the first detector; false when the name is taken or there are too many.
bool add_method(const Method& method) noexcept;

// Whether the method has a stage: a step, a rule, or what every method has.
bool has_stage(const Method& method, int32_t stage) noexcept;
// Whether one of its parts reads the parameter of that text name.
bool reads_param(const Method& method, const char* name) noexcept;

}  // namespace overtake
