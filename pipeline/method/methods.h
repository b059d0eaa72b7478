// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The registered methods, by name.
#pragma once

#include <cstdint>
#include <string>

#include "pipeline/method/method.h"

namespace overtake {

inline constexpr int32_t kMaxMethods = 16;

// Null when no method has that name.
const Method* find_method(const char* name) noexcept;
// Lists all methods, `paper` first. Returns their number; out may be null.
int32_t list_methods(const Method** out) noexcept;
std::string join_method_names();  // "paper, best"

// Registers a method, which must stay in memory. Call it before the first detector. False if the name exists already or
// there are kMaxMethods.
bool add_method(const Method& method) noexcept;

// Whether the method has a stage: through a step, through a rule, or because every method has it.
bool has_stage(const Method& method, int32_t stage) noexcept;
// Whether a step reads the column.
bool reads_column(const Method& method, Column column) noexcept;
// Whether a step, a rule or the tracker reads the parameter with that text name.
bool reads_param(const Method& method, const char* name) noexcept;

}  // namespace overtake
